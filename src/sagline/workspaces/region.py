"""Region of positions for a workspace: a box, a plane, or a slice through a box."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np

from sagline.core.arguments import optional
from sagline.core.arrays import Array, Indices, locked
from sagline.core.errors import InvalidValueError
from sagline.robot.pose import PoseBox
from sagline.robot.reach import ROUNDING, bounds
from sagline.robot.robot import Robot
from sagline.workspaces.levels import Details

AXES: Final = "xyz"


class Region(NamedTuple):
    """Region of positions, with the number of cells of its grid.

    Attributes:
        box: The given box, or the robot's own box.
        low: Lowest corner of the region [m], shape (3,).
        high: Highest corner [m], above the lowest corner along every axis.
        flat: Index of the axis along which the box has no extent; None if it has an extent along all axes. With a flat
            axis, the positions are in a plane, and the region has a thickness. Its volume divided by the thickness is
            the area.
        thickness: Thickness of the region along the flat axis [m]; 1 without a flat axis.
        cells: Number of cells along each axis.
    """

    box: PoseBox
    low: Array
    high: Array
    flat: int | None
    thickness: float
    cells: tuple[int, int, int]

    @property
    def unit(self) -> str:
        """Unit of the region's volume or area."""
        return "m³" if self.flat is None else "m²"


def region_of(robot: Robot, box: PoseBox | None, cells: int) -> Region:
    """Region of `box`. The default box encloses the frame and the test box; for a planar robot, it is flat."""
    plane = _plane_axis(robot)
    optional(box, PoseBox, "box")
    if box is None:
        low, high = _own(robot)
        if plane is not None:
            low[plane] = high[plane] = _place_of_plane(robot, plane)
        box = PoseBox(low, high)
    extent = box.high - box.low
    flat = np.flatnonzero(extent <= ROUNDING)
    if flat.size > 1:
        value = f"without extent along {' and '.join(AXES[axis] for axis in flat)}"
        raise InvalidValueError("box", value, "extent along two axes at least", "Give a larger box.")
    if plane is not None and plane not in flat:
        where = _place_of_plane(robot, plane)
        value = f"{extent[plane]:.4g} m thick along plane_normal, {AXES[plane]}"
        step = f"Give low and high the same {AXES[plane]}, {where:g} m for instance."
        raise InvalidValueError("box", value, "0 m for a planar robot", step)
    x, y, z = (2 * max(1, round(0.5 * cells * part)) for part in (extent / extent.max()).tolist())
    if not flat.size:
        return Region(box, box.low, box.high, None, 1.0, (x, y, z))
    axis, thickness = int(flat[0]), float(extent.max()) / cells
    half = 0.5 * thickness * np.eye(3)[axis]
    x, y, z = (1 if k == axis else count for k, count in enumerate((x, y, z)))
    return Region(box, box.low - half, box.high + half, axis, thickness, (x, y, z))


def _own(robot: Robot) -> tuple[Array, Array]:
    """Corners [m] of the smallest box that encloses the frame and the test box."""
    low, high = bounds(robot)
    if robot.test_box is None:
        return low.copy(), high.copy()
    return np.minimum(low, robot.test_box.low), np.maximum(high, robot.test_box.high)


def flat_axis(box: PoseBox) -> tuple[int, float] | None:
    """First axis along which a box has no extent, and the box's coordinate on it [m]; None without such an axis."""
    flat = np.flatnonzero(box.high - box.low <= ROUNDING)
    return (int(flat[0]), float(box.low[flat[0]])) if flat.size else None


def _plane_axis(robot: Robot) -> int | None:
    """Axis of the normal of a planar robot's plane; raises an error if the normal is not along an axis."""
    if robot.plane_normal is None:
        return None
    axis = int(np.argmax(np.abs(robot.plane_normal)))
    if abs(robot.plane_normal[axis]) < 1.0 - ROUNDING:
        normal = ", ".join(f"{x:.4g}" for x in robot.plane_normal)
        step = "Rotate the robot's coordinates so that the normal of its plane is along an axis."
        raise InvalidValueError("plane_normal", f"({normal})", "along x, y or z for a workspace", step)
    return axis


def _place_of_plane(robot: Robot, axis: int) -> float:
    """Coordinate of a planar robot's plane along its normal [m]."""
    return float(robot.frame_anchors[:, axis].mean() - robot.platform_anchors[:, axis].mean())


_IN_PLANE: Final = ((1, 2), (0, 2), (0, 1))  # horizontal and vertical axis of a drawing, for each normal axis


class Plane(NamedTuple):
    """A plane perpendicular to an axis of the world.

    Attributes:
        normal: Index of the axis, 0 to 2.
        at: Coordinate of the plane along the axis [m].
    """

    normal: int
    at: float

    @property
    def axes(self) -> tuple[int, int]:
        """Horizontal and vertical axis of a drawing of the plane."""
        return _IN_PLANE[self.normal]

    def __str__(self) -> str:
        """Equation of the plane."""
        return f"{AXES[self.normal]} = {self.at:.3g} m"

    def positions(self, across: Array, up: Array) -> Array:
        """Positions (U C, 3) [m] of a grid, row by row; across, up: coordinates of the C columns and U rows [m]."""
        places = np.empty((up.size, across.size, 3))
        first, second = self.axes
        places[..., self.normal] = self.at
        places[..., first], places[..., second] = across, up[:, None]
        return places.reshape(-1, 3)


Find = Callable[[Array], Details]


@dataclass(frozen=True, slots=True, eq=False)
class Slice:
    """Levels and margins on a grid in a plane.

    Attributes:
        plane: The plane.
        across: Coordinates of the columns [m], shape (C,).
        up: Coordinates of the rows [m], shape (U,).
        level: Level of each node, >= 0 in the workspace, shape (U, C).
        margin: Signed margins [N], shape (U, C): negative if the loads are infeasible, -infinite if the robot is
            singular.
        criterion: Index of the limiting criterion, shape (U, C).
        cable: Limiting cable, -1 for none, shape (U, C).
    """

    plane: Plane
    across: Array
    up: Array
    level: Array
    margin: Array
    criterion: Indices
    cable: Indices


def slice_of(find: Find, plane: Plane, low: Array, high: Array, shape: tuple[int, int]) -> Slice:
    """Slice through `find`, a function of positions such as `Levels.details`; `low`, `high`: box corners (3,) [m]."""
    first, second = plane.axes
    across, up = np.linspace(low[first], high[first], shape[0]), np.linspace(low[second], high[second], shape[1])
    found = find(plane.positions(across, up))
    grid = (up.size, across.size)
    parts = (found.level, found.margin, found.criterion, found.cable)
    return Slice(plane, locked(across), locked(up), *(locked(part.reshape(grid)) for part in parts))
