"""Interface of the criteria of a workspace, and the poses that criteria judge."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar, Final, NamedTuple

import numpy as np

from sagline.cables.model import CableModel
from sagline.core.arrays import Array, Flags, Indices, locked
from sagline.core.errors import InvalidValueError
from sagline.core.numbers import n
from sagline.kinematics.inverse import inverse
from sagline.kinematics.plan import Plan
from sagline.robot.equilibrium import Equilibrium
from sagline.robot.pose import Pose
from sagline.robot.robot import Robot
from sagline.tension.method import TensionMethod
from sagline.tension.methods import Closest, PolygonWalk


class Given:
    """Poses of a robot as criteria look at them.

    Tensions are worked out once, on first use, for the poses that the margin says can be held; they balance one
    wrench, the middle of the set that the margin is of.

    Attributes:
        robot: The robot.
        model: Cable model.
        tension: How the load is shared.
        wrench: The middle of the wrench set, shape (6,).
        pose: The poses, a batch of N.
        margin: Their margins [N], shape (N,), < 0 where they cannot be held.
        cable: The cables that limit the margins, -1 for none, shape (N,).
    """

    def __init__(
        self,
        robot: Robot,
        model: CableModel,
        tension: TensionMethod,
        wrench: Array,
        rows: Array,
        margin: Array,
        cable: Indices,
    ) -> None:
        """Keep them.

        Args:
            robot: The robot.
            model: Cable model.
            tension: How the load is shared.
            wrench: The middle of the wrench set, shape (6,).
            rows: Positions and quaternions, shape (N, 7).
            margin: Of the poses [N], shape (N,).
            cable: That limits each, shape (N,).
        """
        self.robot, self.model, self.tension, self.wrench = robot, model, tension, wrench
        self.pose = Pose._adopt(rows[:, :3], rows[:, 3:])
        self.margin, self.cable = margin, cable

    def __len__(self) -> int:
        """How many poses there are."""
        return len(self.margin)

    @cached_property
    def held(self) -> Flags:
        """Whether the cables can hold the platform, by the margin, shape (N,)."""
        return np.asarray(self.margin >= 0.0)

    @cached_property
    def plan(self) -> Plan:
        """Tensions and lengths at the poses that are held, a batch of as many."""
        return self.planned(self.model)

    def planned(self, model: CableModel) -> Plan:
        """The same with a cable model of one's own.

        Args:
            model: The model.

        Returns:
            A plan of the poses that are held.
        """
        return inverse(self.robot, self.pose[self.held], model, self.tension, self.wrench)

    @property
    def state(self) -> Equilibrium:
        """The robot at the poses that are held."""
        return self.plan.state

    def spread(self, values: Array) -> Array:
        """Values of the poses that are held as values of all, NaN at the others.

        Args:
            values: Shape (K,), one a pose that is held.

        Returns:
            Shape (N,).
        """
        found = np.full(len(self), np.nan)
        found[self.held] = values
        return locked(found)

    def spread_cables(self, cables: Indices) -> Indices:
        """Indices of cables likewise, -1 at the others.

        Args:
            cables: Shape (K,).

        Returns:
            Shape (N,).
        """
        found = np.full(len(self), -1)
        found[self.held] = cables
        return locked(found)


class Judged(NamedTuple):
    """What a criterion says of N poses.

    Attributes:
        value: How far inside each is, in the criterion's unit: >= 0 where it is met; NaN where there are no tensions
            to judge, shape (N,).
        cable: Which cable decides, -1 where none does, shape (N,).
    """

    value: Array
    cable: Indices


@dataclass(frozen=True, slots=True, eq=False)
class Criterion:
    """A condition on poses: a function of the pose that is >= 0 where it is met, and continuous.

    Attributes:
        title: What it is called in tables and figures.
        unit: Of its values.
        needs_tensions: Whether it looks at how the load is shared.
        sense: Whether what it limits is to be "≤" or "≥" its limit; "" where it has none.
    """

    title: ClassVar[str]
    unit: ClassVar[str]
    needs_tensions: ClassVar[bool] = False
    sense: ClassVar[str] = ""

    def __post_init__(self) -> None:
        """Refuse the criterion that is none: the interface by itself.

        Raises:
            InvalidValueError: If there is no condition.
        """
        if type(self) is Criterion:
            step = "Choose one of the criteria, MaximumSag(0.05) for instance."
            raise InvalidValueError("Criterion()", "the interface alone", "a criterion", step)

    def judge(self, given: Given) -> Judged:
        """How far inside poses are.

        Args:
            given: The poses.

        Returns:
            Values in the criterion's unit, and the cables that decide.
        """
        raise NotImplementedError

    def scale(self, robot: Robot) -> float:
        """What counts as one, so that criteria of different units compare: in its unit, > 0.

        Args:
            robot: The robot.

        Returns:
            The size.
        """
        raise NotImplementedError

    def check(self, robot: Robot) -> None:
        """Refuse robots that it cannot judge.

        Args:
            robot: The robot.

        Raises:
            InvalidValueError: If it cannot.
        """

    @property
    def always(self) -> bool:
        """Whether every workspace has it, so that nobody need be told."""
        return False

    def __str__(self) -> str:
        """In words: "sag ≤ 50 mm"."""
        limit = n(getattr(self, "limit", np.nan), unit=self.unit)
        return f"{self.title} {self.sense} {limit}" if self.sense else self.title

    def values(self, given: Given) -> Array:
        """How far inside poses are, without the cables.

        Args:
            given: The poses.

        Returns:
            In the criterion's unit, shape (N,).
        """
        return self.judge(given).value


def no_cable(count: int) -> Indices:
    """For criteria that no single cable decides.

    Args:
        count: Number of poses.

    Returns:
        -1 for each.
    """
    return locked(np.full(count, -1))


CONTINUOUS: Final = "MinimumNorm, QuadraticProgram, PNorm, AnalyticCenter, Centroid, ClosedForm"


def jumps(method: TensionMethod) -> bool:
    """Whether tensions shared so change by leaps where the pose changes a little.

    Args:
        method: The way of sharing, each pose alone.
    """
    return not method.continuous or (isinstance(method, PolygonWalk) and method.optimum == "1-norm")


def check_sharing(method: TensionMethod, criteria: Sequence[Criterion]) -> None:
    """Refuse criteria on tensions that jump, or that depend on the pose before.

    Args:
        method: How the load is shared.
        criteria: What looks at it.

    Raises:
        InvalidValueError: If there are such criteria; the message names the continuous methods.
    """
    if not (jumps(method) or isinstance(method, Closest)) or not any(one.needs_tensions for one in criteria):
        return
    first = next(one for one in criteria if one.needs_tensions)
    jump = "has tensions that jump from pose to pose" if jumps(method) else "depends on the pose before"
    value = f"{type(method).__name__}, which {jump}"
    step = f"{type(first).__name__} needs tensions that are continuous."
    raise InvalidValueError("tension", value, CONTINUOUS, step)
