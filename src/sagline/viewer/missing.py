"""What is missing where no tensions within the limits hold the platform: a force, and which limits stand against."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np
from scipy.optimize import lsq_linear

from sagline.core.arrays import Array, locked
from sagline.core.errors import SaglineError
from sagline.kinematics.inverse import inverse
from sagline.kinematics.plan import Plan
from sagline.kinematics.status import PoseStatus
from sagline.robot.equilibrium import Equilibrium
from sagline.statics.balance import structure_matrix
from sagline.tension.minimum_norm import MinimumNorm
from sagline.viewer.snapshot import Snapshot

ATTEMPTS: Final = 4
MORE: Final = 1.0 + 1e-9  # times as large: exactly at the border rounding decides
NEAR: Final = 1e-4  # of a tension: what is this near to a limit is at it
_EXPLAINED: Final = (PoseStatus.INFEASIBLE, PoseStatus.BORDERLINE)


class AtLimit(NamedTuple):
    """A cable that stands at a limit.

    Attributes:
        cable: Its number.
        lower: Whether it is the lower one; else the upper.
    """

    cable: int
    lower: bool

    @property
    def name(self) -> str:
        """As it is written at the cable."""
        return f"{self.cable} at its {'lower' if self.lower else 'upper'} limit"


@dataclass(frozen=True, slots=True, eq=False)
class Missing:
    """A wrench that would do, the force alone wherever one does.

    Attributes:
        wrench: About the center of mass, world axes [N, N m], shape (6,).
        state: The robot as it would be held then, its blocking cables at their limits.
        limits: The cables that stand against the load.
    """

    wrench: Array
    state: Equilibrium
    limits: tuple[AtLimit, ...]

    @property
    def force(self) -> Array:
        """Its force [N], shape (3,)."""
        return self.wrench[:3]

    @property
    def moment(self) -> Array:
        """Its moment [N m], shape (3,); zero where a force alone does."""
        return self.wrench[3:]


def missing_of(snapshot: Snapshot) -> Missing | None:
    """What is missing at a pose that is not feasible; None where that is not the reason, or nothing was found."""
    plan = snapshot.plan
    if plan is None or snapshot.status not in _EXPLAINED:
        return None
    robot, state = snapshot.robot, plan.state
    missing = np.zeros(6)
    held = plan
    try:
        for _ in range(ATTEMPTS):
            missing += MORE * _step(held)
            wrench = locked(state.wrench + missing)
            held = inverse(robot, snapshot.pose, state.cables.model, MinimumNorm(), wrench)
            if held.feasible:
                return Missing(locked(missing), held.state, _limits(plan, held))
    except SaglineError:
        return None
    return None


def _step(plan: Plan) -> Array:
    """The least force that would do [N, N m], shape (6,); where none would, the least wrench."""
    if plan.relief is not None and np.isfinite(plan.relief).all():
        return np.concatenate((plan.relief, np.zeros(3)))
    robot = plan.state.one_robot
    matrix, freedom = structure_matrix(robot, plan.state.pose), robot.freedom
    needed = np.zeros(6) if plan.needed is None else np.nan_to_num(plan.needed)
    turning = np.abs(freedom[:, 3:]).max(axis=1) > 0.5
    lever = float(np.abs(matrix[turning]).max(initial=0.0)) or 1.0  # m: a moment counts as the force at this arm
    unit = np.where(turning, 1.0 / lever, 1.0)
    low = robot.tension_min
    high = np.maximum(robot.tension_max, low * (1.0 + 1e-9) + 1e-9)  # the solver wants room
    found = lsq_linear(unit[:, None] * matrix, unit * (freedom @ needed), (low, high), tol=1e-12)
    rest: Array = freedom.T @ (freedom @ needed - matrix @ found.x)
    return rest


def _limits(plan: Plan, held: Plan) -> tuple[AtLimit, ...]:
    """At which limits the cables stand that stand against the load.

    Where a force alone would do, these are the blocking ones of the plan; else those at a limit with the least wrench.
    """
    robot, tension = plan.state.one_robot, held.state.limited_tension
    to_lower, to_upper = tension - robot.tension_min, robot.tension_max - tension
    which = plan.blocking
    if not np.isfinite(plan.shortfall):
        which = np.minimum(to_lower, to_upper) <= NEAR * tension
    return tuple(AtLimit(int(k), bool(to_lower[k] <= to_upper[k])) for k in np.flatnonzero(which))
