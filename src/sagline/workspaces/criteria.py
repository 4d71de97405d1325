"""Criteria of a workspace: margin, sag, position error, stiffness, frequency, clearance and frame.

Criteria that need tensions use the tensions under the middle load of the wrench set.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import product
from typing import Any, Final

import numpy as np

from sagline.cables.model import CableModel
from sagline.cables.models import model_of
from sagline.core.arrays import Array, Flags, locked
from sagline.core.numbers import counted
from sagline.interference.clearance import ClearanceRows, check_obstacles, obstacles_of
from sagline.interference.obstacles import Mesh
from sagline.interference.pairs import Obstacle
from sagline.kinematics.confirm import confirm
from sagline.robot.pose import Pose
from sagline.robot.reach import bounds
from sagline.robot.robot import Robot
from sagline.statics.slopes import cable_slopes
from sagline.statics.stiffness import least_stiffness, modes
from sagline.workspaces.criterion import NOT_NEGATIVE, POSITIVE, Criterion, Given, Judged

_PRECISION: Final = 1e-6  # [m], jumps of the clearance between neighboring poses up to this size are acceptable
_CABLE: Final = re.compile(r"cable (\d+)")
_CORNERS: Final = 0.5 * np.array(list(product((-1.0, 1.0), repeat=3)))


@dataclass(frozen=True, slots=True, eq=False)
class LeastMargin(Criterion):
    """The cables balance every wrench of the set plus a reserve: an additional load in any direction.

    `LeastMargin` is the first criterion of every workspace, by default with a reserve of zero.

    Attributes:
        limit: Reserve [N], >= 0.
    """

    title = "margin"
    unit = "N"
    sense = "≥"
    _limit_range = NOT_NEGATIVE
    limit: float = 0.0

    @property
    def always(self) -> bool:
        """True if the reserve is zero. Every workspace includes the criterion without reserve."""
        return self.limit == 0.0

    def judge(self, given: Given) -> Judged:
        """Margins minus the reserve [N], and the cables that limit them."""
        return Judged(locked(given.margin - self.limit), given.cable)

    def scale(self, robot: Robot) -> float:
        """Weight of the platform [N]; without gravity, the largest allowed tension of a cable."""
        weight = robot.mass * robot.gravity
        if weight > 0.0:
            return weight
        strongest = robot.tension_max[robot.tension_max < float("inf")]
        return float(strongest.max(initial=0.0)) or float(robot.tension_min.max()) or 1.0


@dataclass(frozen=True, slots=True, eq=False)
class _OfTensions(Criterion):
    """Base class of criteria with a positive limit that depend on the tensions."""

    _limit_range = POSITIVE
    needs_tensions = True
    limit: float


class MaximumSag(_OfTensions):
    """The sag of every cable below its chord is within a limit, under the middle load of the set.

    Attributes:
        limit: Largest allowed sag [m], > 0.
    """

    __slots__ = ()
    title = "sag"
    unit = "m"
    sense = "≤"

    def judge(self, given: Given) -> Judged:
        """Limit minus largest sag [m], and the cable with the largest sag."""
        sag = given.state.cables.sag
        return Judged(given.spread(self.limit - sag.max(axis=1)), given.spread(sag.argmax(axis=1), -1))


@dataclass(frozen=True, slots=True, eq=False)
class PositionError(Criterion):
    """The position error that a simpler cable model causes is within a limit.

    The simpler model gives tensions and lengths for the middle load of the set. The actual pose is the equilibrium of
    the platform on exact cables with these lengths, as in `confirm`.

    Attributes:
        model: Cable model, for example `Straight()`.
        limit: Largest allowed distance [m] between the actual and the planned platform origin, > 0.
    """

    title = "position error"
    unit = "m"
    sense = "≤"
    _limit_range = POSITIVE
    needs_tensions = True
    model: CableModel
    limit: float

    def __post_init__(self) -> None:
        """Check both fields."""
        object.__setattr__(self, "model", model_of(self.model, "PositionError: model"))
        super(PositionError, self).__post_init__()

    def __str__(self) -> str:
        """Title, limit and model."""
        return f"{super(PositionError, self).__str__()} with {type(self.model).__name__}"

    def judge(self, given: Given) -> Judged:
        """Limit minus position error [m]; NaN if the model has no lengths, or if its lengths give no equilibrium."""
        found = confirm(given.planned(self.model))
        error = np.where(found.held, np.linalg.norm(found.position_error, axis=1), np.nan)
        return Judged(given.spread(self.limit - error))


class LeastStiffness(_OfTensions):
    """The stiffness against a force on the center of mass is above a limit, for any direction of the force.

    The value is the stiffness in the softest direction, at fixed lengths, for a platform that can rotate. The value is
    0 if the equilibrium is not stable. The load is the middle load of the set.

    Attributes:
        limit: Smallest allowed stiffness [N/m], > 0.
    """

    __slots__ = ()
    title = "stiffness"
    unit = "N/m"
    sense = "≥"

    def judge(self, given: Given) -> Judged:
        """Stiffness in the softest direction minus the limit [N/m]."""
        found = least_stiffness(given.robot.freedom, cable_slopes(given.state).matrix)
        return Judged(given.spread(found - self.limit))


class LeastFrequency(_OfTensions):
    """The lowest natural frequency of the platform on massless cables is above a limit; see `modes`.

    The load is the middle load of the set. The frequency is 0 Hz if the equilibrium is not stable.

    Attributes:
        limit: Smallest allowed natural frequency [Hz], > 0.
    """

    __slots__ = ()
    title = "frequency"
    unit = "Hz"
    sense = "≥"

    def judge(self, given: Given) -> Judged:
        """Lowest natural frequency minus the limit [Hz]."""
        lowest = modes(given.state).frequency[:, 0]
        unstable = np.isnan(lowest) & given.plan.feasible
        return Judged(given.spread(np.where(unstable, 0.0, lowest) - self.limit))


@dataclass(frozen=True, slots=True, eq=False)
class Clearance(_OfTensions):
    """The distances between cables, platform and obstacles are above a limit.

    The cables have the shapes under the middle load of the set. The pairs of bodies are the same as in
    `clearance`.

    Attributes:
        limit: Smallest allowed distance [m], > 0.
        obstacles: Obstacles, Box, Capsule, Sphere and Mesh, one or several.
    """

    title = "clearance"
    unit = "m"
    sense = "≥"
    obstacles: Obstacle | Sequence[Obstacle] = ()

    def __post_init__(self) -> None:
        """Check both fields."""
        super(Clearance, self).__post_init__()
        given: Any = self.obstacles
        listed = isinstance(given, Obstacle | list | tuple)
        found = obstacles_of(given if listed else [given], "Clearance: obstacles")
        object.__setattr__(self, "obstacles", found)

    def __str__(self) -> str:
        """Title, limit and counts of obstacles: "clearance ≥ 30 mm (1 obstacle, 12 triangles)"."""
        solids: Any = self.obstacles  # the check converts a single obstacle to a tuple
        triangles = sum(len(one.faces) for one in solids if isinstance(one, Mesh))
        counts = counted(len(solids), "obstacle") + (f", {counted(triangles, 'triangle')}" if triangles else "")
        return f"{super(Clearance, self).__str__()} ({counts})"

    def judge(self, given: Given) -> Judged:
        """Least distance minus the limit [m], and the first cable of the nearest pair."""
        rows = _clearance_rows(given.robot, self.obstacles)
        value, pair = rows.least(given.state)
        cables = np.array([*map(_cable_of, rows.pairs.names), -1])
        return Judged(given.spread(value - self.limit), given.spread(cables[pair], -1))

    def excluded(self, robot: Robot, pose: Pose, half: Array) -> Flags:
        """True for each box of positions in which an obstacle is always nearer than the limit."""
        return np.asarray(_clearance_rows(robot, self.obstacles).of_platform(pose, half) < self.limit)


@dataclass(frozen=True, slots=True, eq=False)
class InFrame(Criterion):
    """The platform's box and anchors keep a minimum distance from the faces of the frame.

    The frame is the box of the robot's frame_size. Without frame_size, the frame is the box around the frame anchors
    and the floor. For a planar robot, only distances along its plane count.

    Attributes:
        limit: Smallest allowed distance from the faces [m], >= 0.
    """

    title = "frame"
    unit = "m"
    sense = "≥"
    _limit_range = NOT_NEGATIVE
    limit: float = 0.0

    def judge(self, given: Given) -> Judged:
        """Least distance of a corner from the faces, minus the limit [m]."""
        robot = given.robot
        low, high = bounds(robot)
        axes = np.arange(3) if robot.plane_normal is None else np.flatnonzero(np.abs(robot.plane_normal) < 0.5)
        points = robot.platform_anchors
        if robot.platform_size is not None:
            points = np.vstack((points, _CORNERS * robot.platform_size))
        corners = given.pose.transform(points)[..., axes]
        distance = np.minimum(corners - low[axes], high[axes] - corners).min(axis=(1, 2))
        return Judged(locked(distance - self.limit))

    def scale(self, robot: Robot) -> float:
        """A tenth of the shortest edge of the frame that is not zero [m]."""
        low, high = bounds(robot)
        edges = (high - low)[high > low]
        return 0.1 * float(edges.min(initial=np.inf)) if edges.size else 1.0


@lru_cache(maxsize=4)
def _clearance_rows(robot: Robot, obstacles: Obstacle | Sequence[Obstacle]) -> ClearanceRows:
    """Function that measures clearances of `robot` and `obstacles`, with data that are prepared once for all poses."""
    return ClearanceRows(robot, check_obstacles(obstacles, robot), precision=_PRECISION)


def _cable_of(pair: tuple[str, str]) -> int:
    """First cable of a pair of bodies, from their names; -1 if neither body is a cable."""
    return next((int(found[1]) for name in pair if (found := _CABLE.fullmatch(name))), -1)
