"""Settings of the panel, solutions of the robot at one pose (with these settings, by every method), missing wrench."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass, field
from string import ascii_uppercase
from types import MappingProxyType
from typing import Final, NamedTuple

import numpy as np
from scipy.optimize import lsq_linear

from sagline.cables.model import CableModel
from sagline.cables.models import Catenary, Elastic, Empirical, models_by_name
from sagline.core.arrays import Array, locked
from sagline.core.errors import CableGeometryError, InvalidValueError, SaglineError
from sagline.kinematics.confirm import confirm
from sagline.kinematics.inverse import inverse
from sagline.kinematics.inverse_rows import Given
from sagline.kinematics.inverse_solver import InverseSolver
from sagline.kinematics.plan import Plan
from sagline.kinematics.status import PoseStatus
from sagline.robot.equilibrium import Equilibrium
from sagline.robot.pose import Pose
from sagline.robot.reach import is_underconstrained
from sagline.robot.robot import Robot, with_mass
from sagline.statics.balance import structure_matrix
from sagline.tension.method import TensionMethod, shared_tension
from sagline.tension.methods import DEFAULT, MinimumNorm, QuadraticProgram, methods_by_name
from sagline.viewer import shapes
from sagline.viewer.tension_scale import ForceUnit

BY_HAND: Final = "chosen by hand"


class ByHand(QuadraticProgram):
    """Feasible tensions that are closest to tensions chosen by hand; at the pose of the choice, both are equal."""

    # Tensions in force balance are the minimum-norm tensions plus a point of the null space. The sag forces shift the
    # minimum-norm tensions slightly, but they do not shift this point.


MODEL_NAMES: dict[type[CableModel], str] = {  # names that are clearer than the class names
    Catenary: "catenary (exact)",
    Empirical: "empirical (the article's)",
    Elastic: "elastic, weightless",
}


def model_name(model: CableModel) -> str:
    """Name of a cable model."""
    return MODEL_NAMES.get(type(model), type(model).__name__.lower())


def method_name(method: TensionMethod) -> str:
    """Name of a tension distribution method, with a remark if it depends on previous poses."""
    name = BY_HAND if isinstance(method, ByHand) else type(method).__name__
    return f"{name} (depends on history)" if depends_on_history(method) else name


def depends_on_history(method: TensionMethod) -> bool:
    """True if the tensions of a pose depend on the tensions of previous poses."""
    return method.alone is not method


# the exact model first
MODELS: Final = MappingProxyType({model_name(make()): make() for make in reversed(models_by_name().values())})
# methods that depend on history are last, so that the default depends only on the pose
_sorted = sorted((make() for make in methods_by_name().values()), key=depends_on_history)
METHODS: Final = MappingProxyType({method_name(method): method for method in _sorted})


@dataclass(frozen=True, slots=True)
class Settings:
    """Changes of the robot, and settings of its solution and drawing. The controls of the panel keep the ranges."""

    mass: float  # mass of the platform with its load [kg], > 0; the inertia is proportional to it
    density: float = 1.0  # factor on the cables' linear density, > 0
    stiffness: float = 1.0  # factor on the cables' axial stiffness, > 0
    model: CableModel = field(default_factory=Catenary)  # cable model of the planned lengths
    tension: TensionMethod = DEFAULT.alone
    sag_scale: float = 1.0  # factor on the drawn sag, >= 0
    error_scale: float = 1.0  # factor on the drawn position error, >= 0
    given: tuple[Given, ...] | None = None  # given values of an underconstrained platform, as in `inverse`

    @property
    def changes(self) -> tuple[float, float, float]:
        """Key that identifies the changes of the robot: mass, density and stiffness."""
        return self.mass, self.density, self.stiffness

    def applied(self, robot: Robot) -> Robot:
        """The robot with changed load and cables."""
        if self.mass == robot.mass and self.density == self.stiffness == 1.0:
            return robot
        cables = robot.cables
        density, stiffness = cables.linear_density * self.density, cables.axial_stiffness * self.stiffness
        changed = cables.replace(linear_density=density, axial_stiffness=stiffness)
        return with_mass(robot, self.mass).replace(cables=changed)


@dataclass(frozen=True, slots=True, eq=False)
class Snapshot:
    """A robot at rest at one pose."""

    robot: Robot  # robot with the changes of the settings
    pose: Pose  # planned pose
    plan: Plan | None  # the plan for this pose; None if a cable has no chord
    # equilibrium pose with catenaries of the planned lengths; None if the pose is not feasible or the model is exact
    rest: Pose | None
    refusal: str = ""  # reason why a cable over a pulley has no chord; "" if all cables have chords
    # previous tensions of a method that depends on history [N], shape (m,); None without them
    previous: Array | None = None

    @property
    def feasible(self) -> bool:
        """True if tensions within the limits balance the platform."""
        return self.plan is not None and bool(self.plan.feasible)

    @property
    def solved(self) -> bool:
        """True if the pose is feasible and its equilibrium is stable."""
        return self.plan is not None and bool(self.plan.solved)

    @property
    def status(self) -> PoseStatus:
        """Status of the solution."""
        return PoseStatus.NO_CHORD if self.plan is None else PoseStatus(int(self.plan.status))

    @property
    def reason(self) -> str:
        """Reason why the pose is not solved, with shortfall and blocking cables; "" if it is solved."""
        if self.solved:
            return ""
        if self.plan is None:
            return self.refusal or self.status.text
        if self.status is not PoseStatus.INFEASIBLE:
            return self.status.text
        shortfall = float(self.plan.shortfall)
        missing = ForceUnit.of(self.robot).written(shortfall)
        short = f"short of {missing}" if np.isfinite(shortfall) else "no force alone is sufficient"
        if is_underconstrained(self.robot):
            short = "no equilibrium at this position is within the limits"
        blocking = ", ".join(str(i) for i in np.flatnonzero(self.plan.blocking))
        return f"{short}; at their limits: cables {blocking}" if blocking else short

    @property
    def tension(self) -> Array:
        """Chord tensions [N], shape (m,); NaN without a solution."""
        return np.full(self.robot.cable_count, np.nan) if self.plan is None else self.plan.chord_tension

    @property
    def origin(self) -> str:
        """Cable model and tension distribution method; "" without tensions."""
        if self.plan is None:
            return ""
        how = "balance" if is_underconstrained(self.robot) else method_name(self.plan.tension)
        return f"{model_name(self.plan.state.cables.model)}, {how}"

    @property
    def error(self) -> Array | None:
        """Position error of the confirmed pose [m], shape (3,)."""
        return None if self.rest is None else self.rest.position - self.pose.position

    def courses(self, sag_scale: float) -> Array:
        """Points of the cables (m, P, 3), with their sag scaled by a factor; straight if the pose is not feasible."""
        state = self.plan.state if self.plan is not None and self.feasible else None
        return shapes.courses(self.robot, self.pose, state, sag_scale)

    def wheels(self) -> tuple[Array, Array]:
        """Centers (m, 3) [m] and quaternions (m, 4) of the pulleys."""
        state = self.plan.state if self.plan is not None and self.feasible else None
        return shapes.wheels(self.robot, self.pose, state, None if state is None else state.unstrained_length)


def snapshot_at(
    robot: Robot, pose: Pose, settings: Settings, previous: Plan | None, wrench: Array | None = None
) -> Snapshot:
    """Solution at rest at a pose, for a robot to which the changes of the settings have already been applied."""
    reference = _remembered(previous, settings.tension)
    if is_underconstrained(robot):  # the rotation follows from the balance, and does not depend on the previous pose
        pose = Pose.from_euler(pose.position, given_yaw(pose, settings.given), 0.0, 0.0)
    try:
        plan = inverse(robot, pose, settings.model, settings.tension, wrench, reference, given=settings.given)
    except CableGeometryError as error:
        reason = "" if robot.winches is None else str(error).removeprefix("pose, ")
        return Snapshot(robot, pose, None, None, reason, reference)
    if is_underconstrained(robot):
        pose = plan.state.pose
    approximate = not isinstance(settings.model, Catenary) and bool(plan.feasible)
    return Snapshot(robot, pose, plan, confirm(plan).pose if approximate else None, "", reference)


def given_yaw(pose: Pose, given: tuple[Given, ...] | None) -> float:
    """Yaw of a pose [rad], if it is a given value of an underconstrained platform; otherwise 0."""
    return float(pose.rotation.as_euler("ZYX")[0]) if given is not None and "yaw" in given else 0.0


def _remembered(previous: Plan | None, tension: TensionMethod) -> Array | None:
    """Previous tensions (m,) [N] in the variable of the method `tension`; None if there are no previous tensions."""
    if previous is None or not depends_on_history(tension) or not previous.feasible or previous.at_border:
        return None
    return shared_tension(previous.state, tension.variable)


class MethodMark(NamedTuple):
    """A tension distribution method with its result."""

    name: str
    letter: str
    tension: Array  # chord tensions [N], shape (m,); NaN without a solution
    missing: str = ""  # reason why there is no solution


class MethodMarks:
    """Results of all tension distribution methods at a pose; they remain valid if only the chosen method changes."""

    # For a moving robot, prepared solvers are about twelve times as fast. Their preparation takes longer than one
    # solution. A robot whose mass follows a slider therefore does not have prepared solvers.

    def __init__(self) -> None:
        """Begin without results."""
        self._key: tuple[object, ...] = ()
        self._found: tuple[MethodMark, ...] = ()
        self._solvers: dict[str, InverseSolver] = {}

    def at(self, plan: Plan) -> tuple[MethodMark, ...]:
        """Results at the pose of a plan, at rest under its wrench."""
        state = plan.state
        place = (state.pose.position.tobytes(), state.pose.quaternion.tobytes(), state.wrench.tobytes())
        key = (id(state.robot), type(state.cables.model), *place)
        if key != self._key:
            if key[:2] != self._key[:2]:
                self._solvers = {}
            elif not self._solvers:
                self._solvers = _solvers(plan)
            self._key, self._robot = key, state.robot  # the robot is kept alive, so that its id remains unique
            ways = zip(METHODS, ascii_uppercase, strict=False)
            self._found = tuple(_mark(plan, name, letter, self._solvers.get(name)) for name, letter in ways)
        return self._found


def _solvers(plan: Plan) -> dict[str, InverseSolver]:
    """Prepared solvers of the methods that are applicable to the robot of a plan."""
    robot, model = plan.state.one_robot, plan.state.cables.model
    found = {}
    for name, method in METHODS.items():
        with suppress(InvalidValueError):  # `inverse` gives the reason
            found[name] = InverseSolver(robot, model, method.alone)
    return found


def _mark(plan: Plan, name: str, letter: str, solver: InverseSolver | None) -> MethodMark:
    state = plan.state
    robot, pose = state.one_robot, state.pose
    if solver is not None:
        step = solver.step(pose.position, pose.quaternion, state.wrench)
        tension, status = step.chord_tension, step.status
    else:
        try:
            found = inverse(robot, pose, state.cables.model, METHODS[name], state.wrench)
        except InvalidValueError as error:
            return MethodMark(name, letter, np.full(robot.cable_count, np.nan), str(error))
        tension, status = found.chord_tension, PoseStatus(int(found.status))
    return MethodMark(name, letter, tension, "" if status is PoseStatus.SOLVED else status.text)


ATTEMPTS: Final = 4
MORE: Final = 1.0 + 1e-9  # factor of the wrench, by which the pose is slightly inside the boundary
NEAR: Final = 1e-4  # relative distance to a limit below which a tension counts as at the limit
_EXPLAINED: Final = (PoseStatus.INFEASIBLE, PoseStatus.BORDERLINE)


@dataclass(frozen=True, slots=True, eq=False)
class MissingWrench:
    """Smallest wrench that makes a pose feasible; it is a force without moment if a force is sufficient."""

    wrench: Array  # missing wrench about the center of mass, world axes [N, N m], shape (6,)
    state: Equilibrium  # plan with this wrench, in which the blocking cables are at their limits
    limits: dict[int, bool]  # cables at limits: True at the lower limit, False at the upper limit

    @classmethod
    def of(cls, snapshot: Snapshot) -> MissingWrench | None:
        """Missing wrench of an infeasible pose; None for other failures, or if no wrench was found."""
        plan = snapshot.plan
        if plan is None or snapshot.status not in _EXPLAINED or is_underconstrained(snapshot.robot):
            return None
        robot, state = snapshot.robot, plan.state
        missing, held = np.zeros(6), plan
        with suppress(SaglineError):
            for _ in range(ATTEMPTS):
                missing += MORE * _step(held)
                held = inverse(robot, snapshot.pose, state.cables.model, MinimumNorm(), locked(state.wrench + missing))
                if held.feasible:
                    return cls(locked(missing), held.state, _limits(plan, held))
        return None

    @property
    def force(self) -> Array:
        """Force of the wrench [N], shape (3,)."""
        return self.wrench[:3]

    @property
    def moment(self) -> Array:
        """Moment of the wrench [N m], shape (3,); zero if a force alone is sufficient."""
        return self.wrench[3:]


def _step(plan: Plan) -> Array:
    """Wrench (6,) [N, N m] of the smallest sufficient force. If no force is sufficient, the smallest wrench."""
    if plan.relief is not None and np.isfinite(plan.relief).all():
        return np.concatenate((plan.relief, np.zeros(3)))
    robot = plan.state.one_robot
    matrix, freedom = structure_matrix(robot, plan.state.pose), robot.freedom
    needed = np.zeros(6) if plan.needed is None else np.nan_to_num(plan.needed)
    turning = np.abs(freedom[:, 3:]).max(axis=1) > 0.5
    lever = float(np.abs(matrix[turning]).max(initial=0.0)) or 1.0  # [m], a moment counts as the force at this arm
    unit = np.where(turning, 1.0 / lever, 1.0)
    low = robot.tension_min
    high = np.maximum(robot.tension_max, low * (1.0 + 1e-9) + 1e-9)  # the solver requires low < high
    found = lsq_linear(unit[:, None] * matrix, unit * (freedom @ needed), (low, high), tol=1e-12)
    return np.asarray(freedom.T @ (freedom @ needed - matrix @ found.x))


def _limits(plan: Plan, held: Plan) -> dict[int, bool]:
    """Cables at limits. If a force is sufficient, these are the plan's blocking cables, otherwise those of `held`."""
    robot, tension = plan.state.one_robot, held.state.limited_tension
    to_lower, to_upper = tension - robot.tension_min, robot.tension_max - tension
    which = plan.blocking
    if not np.isfinite(plan.shortfall):
        which = np.minimum(to_lower, to_upper) <= NEAR * tension
    return {int(k): bool(to_lower[k] <= to_upper[k]) for k in np.flatnonzero(which)}
