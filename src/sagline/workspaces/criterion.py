"""Interface of the criteria of a workspace, and the poses at which criteria are evaluated."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from types import MappingProxyType
from typing import Any, ClassVar, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from sagline.cables.model import CableModel
from sagline.core.arrays import Array, Flags, Indices, locked, number
from sagline.core.errors import InvalidValueError
from sagline.core.numbers import n
from sagline.kinematics.inverse import inverse
from sagline.kinematics.inverse_rows import Given as GivenValue
from sagline.kinematics.plan import Plan
from sagline.robot.equilibrium import Equilibrium
from sagline.robot.pose import Pose
from sagline.robot.reach import is_underconstrained
from sagline.robot.robot import Robot
from sagline.tension.method import TensionMethod
from sagline.tension.methods import Closest, PolygonWalk, methods_by_name

POSITIVE: Final = MappingProxyType({"above": 0.0})  # allowed ranges of the limits of criteria
NOT_NEGATIVE: Final = MappingProxyType({"low": 0.0})


@dataclass(eq=False)
class Given:
    """N poses of a robot at which criteria are evaluated.

    Tensions balance the middle wrench of the wrench set. Tensions are computed when they are first needed, for the K
    poses with a nonnegative margin.

    Attributes:
        robot: The robot.
        model: Cable model.
        tension: Tension distribution method.
        wrench: Middle of the wrench set, shape (6,).
        rows: Positions [m] and quaternions, shape (N, 7).
        margin: Margins of the poses [N], shape (N,), < 0 if the cables cannot hold the platform.
        cable: Cables that limit the margins, -1 for none, shape (N,).
    """

    robot: Robot
    model: CableModel
    tension: TensionMethod
    wrench: Array
    rows: Array
    margin: Array
    cable: Indices
    given: tuple[GivenValue, ...] | None = None

    def __len__(self) -> int:
        """Number of poses."""
        return len(self.margin)

    @cached_property
    def pose(self) -> Pose:
        """The poses, a batch of N. An underconstrained platform has its rotation from the balance at the K poses."""
        rotation = self.rows[:, 3:]
        if is_underconstrained(self.robot):
            rotation = rotation.copy()
            rotation[self.held] = self.state.pose.quaternion
        return Pose._adopt(self.rows[:, :3], locked(rotation))

    @cached_property
    def held(self) -> Flags:
        """True for the K poses with a nonnegative margin, shape (N,)."""
        return np.asarray(self.margin >= 0.0)

    @cached_property
    def plan(self) -> Plan:
        """Tensions and lengths at the K poses."""
        return self.planned(self.model)

    def planned(self, model: CableModel) -> Plan:
        """Tensions and lengths of another cable model at the K poses."""
        start = Pose._adopt(self.rows[self.held, :3], self.rows[self.held, 3:])
        return inverse(self.robot, start, model, self.tension, self.wrench, given=self.given)

    @property
    def state(self) -> Equilibrium:
        """Equilibria at the K poses."""
        return self.plan.state

    def spread(self, values: NDArray[Any], missing: float = np.nan) -> NDArray[Any]:
        """Values (N,) at all poses: `values` (K,) at the K poses, and `missing` at the other poses."""
        found = np.full(len(self), missing)
        found[self.held] = values
        return locked(found)


class Judged(NamedTuple):
    """Values of a criterion at N poses.

    Attributes:
        value: Distance to the limit in the criterion's unit, shape (N,): >= 0 if the criterion is met, and NaN if
            the pose has no tensions.
        cable: Limiting cable, -1 for none, shape (N,). None if this criterion is not limited by single cables.
    """

    value: Array
    cable: Indices | None = None


@dataclass(frozen=True, slots=True, eq=False)
class Criterion:
    """A condition on poses: a continuous function of the pose that is >= 0 if the condition is met.

    Attributes:
        title: Name in tables and figures.
        unit: Unit of its values.
        needs_tensions: True if the criterion depends on the tensions.
        sense: Relation to the limit, "≤" or "≥"; "" without a limit.
        _limit_range: Allowed range of the field `limit`, as in `number`; empty for no check.
    """

    title: ClassVar[str]
    unit: ClassVar[str]
    needs_tensions: ClassVar[bool] = False
    sense: ClassVar[str] = ""
    _limit_range: ClassVar[Mapping[str, float]] = MappingProxyType({})

    def __post_init__(self) -> None:
        """Check the limit. An instance of the abstract class `Criterion` itself is an error."""
        if type(self) is Criterion:
            step = "Choose one of the criteria, MaximumSag(0.05) for instance."
            raise InvalidValueError("Criterion()", "the abstract base class", "a criterion", step)
        if self._limit_range:
            value, item = getattr(self, "limit", None), f"{type(self).__name__}: limit"
            object.__setattr__(self, "limit", number(value, item, self.unit, **self._limit_range))

    def judge(self, given: Given) -> Judged:
        """Distances of poses to the limit.

        Args:
            given: The poses.

        Returns:
            Values in the criterion's unit, and the limiting cables.
        """
        raise NotImplementedError

    def scale(self, robot: Robot) -> float:
        """Scale that makes different criteria comparable: their values are divided by it. The default is the limit.

        Args:
            robot: The robot.

        Returns:
            The scale in the criterion's unit, > 0.
        """
        limit: float | None = getattr(self, "limit", None)
        if limit is None:
            raise NotImplementedError
        return limit

    def check(self, robot: Robot) -> None:
        """Reject a robot if the criterion cannot be evaluated for it.

        Args:
            robot: The robot.

        Raises:
            InvalidValueError: If the robot is not suitable.
        """

    def excluded(self, robot: Robot, pose: Pose, half: Array) -> Flags:
        """Proofs that no tensions meet the criterion at any position of a box.

        Args:
            robot: The robot.
            pose: N poses at the centers of the boxes.
            half: Half edges of the boxes [m], shape (3,).

        Returns:
            True if the box has a proof, shape (N,).
        """
        return np.zeros(len(pose), dtype=np.bool_)

    @property
    def always(self) -> bool:
        """True if every workspace includes the criterion, so that reports omit it."""
        return False

    def __str__(self) -> str:
        """Title and limit: "sag ≤ 50 mm"."""
        limit = n(getattr(self, "limit", np.nan), unit=self.unit)
        return f"{self.title} {self.sense} {limit}" if self.sense else self.title

    def values(self, given: Given) -> Array:
        """Distances of poses to the limit, without the limiting cables.

        Args:
            given: The poses.

        Returns:
            Values in the criterion's unit, shape (N,).
        """
        return self.judge(given).value


def check_continuous(method: TensionMethod, criteria: Sequence[Criterion]) -> None:
    """Reject criteria that need tensions if the tensions of `method` can jump or depend on the previous pose."""
    jumps = not method.continuous or (isinstance(method, PolygonWalk) and method.optimum == "1-norm")
    first = next((one for one in criteria if one.needs_tensions), None)
    if first is None or not (jumps or isinstance(method, Closest)):
        return
    jump = "has tensions that jump from pose to pose" if jumps else "depends on the previous pose"
    step = f"{type(first).__name__} needs tensions that are continuous."
    kinds = methods_by_name().items()
    allowed = [name for name, kind in kinds if kind.continuous and kind not in (Closest, PolygonWalk)]
    raise InvalidValueError("tension", f"{type(method).__name__}, which {jump}", ", ".join(allowed), step)
