"""Settings of the panel, and the solution of the robot at one pose with these settings."""

from __future__ import annotations

from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Final

import numpy as np

from sagline.cables.model import CableModel
from sagline.cables.models import MODELS as ALL_MODELS
from sagline.cables.models import Catenary, Elastic, Empirical
from sagline.core.arrays import Array, checked
from sagline.core.errors import CableGeometryError
from sagline.kinematics.confirm import confirm
from sagline.kinematics.inverse import inverse
from sagline.kinematics.plan import Plan
from sagline.kinematics.status import PoseStatus
from sagline.robot.pose import Pose
from sagline.robot.robot import Robot, with_mass
from sagline.tension.margin import cable_margins
from sagline.tension.method import TensionMethod, shared_tension
from sagline.tension.methods import DEFAULT
from sagline.tension.methods import METHODS as ALL_METHODS
from sagline.viewer import shapes
from sagline.viewer.by_hand import BY_HAND, ByHand
from sagline.viewer.tension_scale import force_unit

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
MODELS: Final = MappingProxyType({model_name(make()): make() for make in reversed(ALL_MODELS.values())})
# methods that depend on history are last, so that the default depends only on the pose
METHODS: Final = MappingProxyType(
    {
        method_name(method): method
        for method in sorted((make() for make in ALL_METHODS.values()), key=depends_on_history)
    }
)


@dataclass(frozen=True, slots=True)
class Settings:
    """Changes of the robot, and settings of its solution and drawing."""

    mass: float  # mass of the platform with its load [kg], > 0; the inertia is proportional to it
    density: float = 1.0  # factor on the cables' linear density, > 0
    stiffness: float = 1.0  # factor on the cables' axial stiffness, > 0
    model: CableModel = field(default_factory=Catenary)  # cable model of the planned lengths
    tension: TensionMethod = DEFAULT.alone
    sag_scale: float = 1.0  # factor on the drawn sag, >= 0
    error_scale: float = 1.0  # factor on the drawn position error, >= 0

    def __post_init__(self) -> None:
        """Check the factors."""
        checked(self.density, "cable density", "times", above=0.0)
        checked(self.stiffness, "cable stiffness", "times", above=0.0)
        checked(self.sag_scale, "drawn sag", "times", low=0.0)
        checked(self.error_scale, "drawn error", "times", low=0.0)

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
        missing = force_unit(self.robot).written(shortfall)
        short = f"short of {missing}" if np.isfinite(shortfall) else "no force alone is sufficient"
        blocking = ", ".join(str(i) for i in np.flatnonzero(self.plan.blocking))
        return f"{short}; at their limits: cables {blocking}" if blocking else short

    @property
    def tension(self) -> Array:
        """Chord tensions [N], shape (m,); NaN without a solution."""
        return np.full(self.robot.cable_count, np.nan) if self.plan is None else self.plan.chord_tension

    @property
    def margin(self) -> Array:
        """Distance (m,) [N] from each limited tension to the nearer limit of its cable; NaN without a solution."""
        return self.tension if self.plan is None else cable_margins(self.plan.state)

    def nearer_limit(self, cable: int) -> str:
        """Name of the limit that is nearer to a cable's tension."""
        if self.plan is None:
            return ""
        tension, robot = self.plan.state.limited_tension[cable], self.robot
        lower = tension - robot.tension_min[cable] <= robot.tension_max[cable] - tension
        return "lower limit" if lower else "upper limit"

    @property
    def origin(self) -> str:
        """Cable model and tension distribution method; "" without tensions."""
        if self.plan is None:
            return ""
        return f"{model_name(self.plan.state.cables.model)}, {method_name(self.plan.tension)}"

    @property
    def error(self) -> Array | None:
        """Position error of the confirmed pose [m], shape (3,)."""
        return None if self.rest is None else self.rest.position - self.pose.position

    def courses(self, sag_scale: float) -> Array:
        """Points of the cables (m, P, 3), with their sag scaled by a factor; straight if the pose is not feasible."""
        state = self.plan.state if self.plan is not None and self.feasible else None
        return shapes.courses(self.robot, self.pose, state, sag_scale)


def snapshot_at(
    robot: Robot,
    pose: Pose,
    settings: Settings,
    previous: Plan | None,
    wrench: Array | None = None,
) -> Snapshot:
    """Solution at rest at a pose, for a robot to which the changes of the settings have already been applied."""
    reference = _remembered(previous, settings.tension)
    try:
        plan = inverse(robot, pose, settings.model, settings.tension, wrench, reference)
    except CableGeometryError as error:
        reason = "" if robot.winches is None else str(error).removeprefix("pose, ")
        return Snapshot(robot, pose, None, None, reason, reference)
    approximate = not isinstance(settings.model, Catenary) and bool(plan.feasible)
    return Snapshot(robot, pose, plan, confirm(plan).pose if approximate else None, "", reference)


def _remembered(previous: Plan | None, tension: TensionMethod) -> Array | None:
    """Previous tensions (m,) [N] in the variable of the method `tension`; None if there are no previous tensions."""
    if previous is None or not depends_on_history(tension) or not previous.feasible or previous.at_border:
        return None
    return shared_tension(previous.state, tension.variable)
