"""The feasible tensions of one pose as a picture: a polygon in the null space of two redundant cables."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from sagline.arrays import Array, Indices, locked
from sagline.cables.catenary import Catenary
from sagline.cables.model import CableModel
from sagline.errors import InvalidValueError
from sagline.kernels import codes, tables
from sagline.kernels.inverse import polygon_of_pose
from sagline.kernels.polygon import SPARE_CORNERS
from sagline.robot.pose import Pose
from sagline.robot.robot import Robot
from sagline.statics.tables import body_table, cable_table, pose_rows
from sagline.statics.wrench import external_wrench
from sagline.tension.method import Variable
from sagline.tension.minimum_norm import MinimumNorm
from sagline.tension.options import kernel_options

MERGED = 1e-10  # of the largest tension: corners closer than this are one

_CATENARY = Catenary()


class Side(NamedTuple):
    """Which limit a side of the polygon is.

    Attributes:
        cable: Index of the cable.
        limit: "min" or "max".
    """

    cable: int
    limit: str


@dataclass(frozen=True, slots=True, eq=False)
class TensionPolygon:
    """All tensions that balance one pose within their limits: tensions = origin + lambda basis.

    With a sagging cable the balance depends on the tensions: this is the polygon of the last linearization, with the
    pulls T_z - tau sin phi that the cables have at the minimum-norm tensions (docs/model.md, section 5).

    Attributes:
        vertices: The article's Omega_lambda: corners, counter-clockwise, in coordinates of the null space [N], shape
            (h, 2); for one redundant cable the ends of an interval, shape (2, 1), infinite where it has none; for no
            redundant cable one point without coordinates, shape (1, 0). Shape (0, r) where nothing is feasible.
        tensions: The article's Omega_t: tensions at the vertices [N], in the sharing's variable, shape (h, m).
        sides: The limit that each side is, from vertex k to vertex k + 1 (at vertex k for an interval); None where the
            polygon has no such side: it is unbounded there, and the vertices at both ends only stand in for infinity.
        bounded: Whether every side is a limit.
        basis: Orthonormal basis of the null space, shape (r, m).
        origin: The minimum-norm tensions of the balance without limits [N], shape (m,).
        scale: The sharing's variable is scale times the chord tension plus offset, shape (m,): 1, or cos phi for the
            horizontal tension, or the slope of the frame-end tension.
        offset: Zero but for the frame-end tension [N], shape (m,).
    """

    vertices: Array
    tensions: Array
    sides: tuple[Side | None, ...]
    bounded: bool
    basis: Array
    origin: Array
    scale: Array
    offset: Array


def tension_polygon(
    robot: Robot,
    pose: Pose,
    model: CableModel = _CATENARY,
    wrench: ArrayLike | None = None,
    variable: Variable = "chord",
) -> TensionPolygon:
    """The feasible tensions of one pose.

    Args:
        robot: The robot, with at most two redundant cables.
        pose: One pose.
        model: Cable model.
        wrench: External and inertial wrench about the center of mass, world axes [N, N m], shape (6,); None for none.
        variable: The tension the polygon is drawn in: "chord", "horizontal" (the article's) or "frame_end".

    Returns:
        The polygon, with no vertices where the pose is not feasible.

    Raises:
        InvalidValueError: If there is not one pose, the structure matrix has lost rank, a cable is too slack, or
            the robot has too few or too many cables.

    Source:
        Gia Luan & Truong Thinh 2020, (53)-(55); Gouttefarde et al. 2015; docs/model.md, section 5.
    """
    options = kernel_options(robot, model, MinimumNorm(variable))
    if robot.cable_count > robot.degrees_of_freedom + 2:
        raise InvalidValueError(
            f"{robot.name}: number of cables",
            robot.cable_count,
            f"<= {robot.degrees_of_freedom + 2}",
            "More than two redundant cables span no polygon.",
        )
    if pose.shape:
        raise InvalidValueError("pose", f"a batch of shape {pose.shape}", "one pose", "Draw one pose at a time.")
    m, r = robot.cable_count, robot.cable_count - robot.degrees_of_freedom
    work = np.full((tables.WORK_ROWS, m), np.nan)
    null = np.empty((r, m))
    corners = np.empty((2 * m + SPARE_CORNERS, 2))
    labels = np.full(2 * m + SPARE_CORNERS, -1, dtype=np.int64)
    status, count = polygon_of_pose(
        *options,
        robot.freedom,
        body_table(robot)[0],
        cable_table(robot)[0],
        pose_rows(pose)[0],
        external_wrench(wrench, None),
        work,
        null,
        corners,
        labels,
    )
    if status not in (codes.POSE_SOLVED, codes.POSE_INFEASIBLE):
        raise InvalidValueError("pose", "one without a balance", "one that `inverse` can solve", _next_step(status))
    origin, low, high = work[tables.START], work[tables.LOW], work[tables.HIGH]
    offset = work[tables.OFFSET]
    vertices, sides = _sides_of(count, null, origin, low, high, corners, labels)
    return TensionPolygon(
        vertices=locked(vertices),
        tensions=locked(_tensions(vertices, null, origin + offset)),
        sides=sides,
        bounded=None not in sides,
        basis=locked(null),
        origin=locked(origin + offset),
        scale=locked(work[tables.SCALE].copy()),
        offset=locked(work[tables.OFFSET].copy()),
    )


def _sides_of(
    count: int, null: Array, origin: Array, low: Array, high: Array, corners: Array, labels: Indices
) -> tuple[Array, tuple[Side | None, ...]]:
    """Vertices (h, r) and what the sides are."""
    r, m = null.shape
    if r == 0 or count == 0:
        return np.zeros((count, r)), ()
    if r == 1:
        ends = corners[:2, :1].copy()
        return ends, tuple(_limit_at(end, null[0], origin, low, high) for end in ends[:, 0])
    corners, labels = corners[:count], labels[:count]
    lengths = np.hypot(*(np.roll(corners, -1, axis=0) - corners).T)
    sizes = np.concatenate((np.abs(origin), low, high[np.isfinite(high)]))
    kept = lengths > MERGED * sizes.max()
    if not kept.any():
        kept[0] = True
    sides = tuple(Side(int(k) // 2, ("min", "max")[k % 2]) if k < 2 * m else None for k in labels[kept])
    return corners[kept], sides


def _limit_at(end: float, row: Array, origin: Array, low: Array, high: Array) -> Side | None:
    """The limit that ends an interval there."""
    if not np.isfinite(end):
        return None
    there = origin + row * end
    gaps = np.where(np.abs(row) > MERGED, np.minimum(np.abs(there - low), np.abs(there - high)), np.inf)
    cable = int(np.argmin(gaps))
    return Side(cable, "min" if abs(there[cable] - low[cable]) <= abs(there[cable] - high[cable]) else "max")


def _tensions(vertices: Array, null: Array, origin: Array) -> Array:
    """Tensions at the vertices; a cable that the null space does not move keeps its tension at an infinite end."""
    with np.errstate(invalid="ignore"):
        steps = vertices[:, :, None] * null
    moved = np.where(null == 0.0, 0.0, steps)
    tensions: Array = origin + moved.sum(axis=1)
    return tensions


def _next_step(status: int) -> str:
    steps = {
        codes.POSE_SINGULAR: "The structure matrix has lost rank: move the platform.",
        codes.POSE_NO_CHORD: "Both ends of a cable coincide: move the platform away from the anchor.",
        codes.POSE_TOO_SLACK: "A cable would carry less than a thousandth of its own weight: raise tension_min.",
    }
    return steps.get(status, "The tensions did not settle: please report this robot and pose.")
