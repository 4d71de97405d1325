"""Settings of the panel, and the robot solved at one pose with them."""

from __future__ import annotations

from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Final

import numpy as np

from sagline.cables.model import CableModel
from sagline.cables.models import MODELS as ALL_MODELS
from sagline.cables.models import Catenary
from sagline.core.arrays import Array, checked
from sagline.core.errors import CableGeometryError
from sagline.kinematics.confirm import confirm
from sagline.kinematics.inverse import inverse
from sagline.kinematics.plan import Plan
from sagline.kinematics.status import PoseStatus
from sagline.robot.inertia import with_mass
from sagline.robot.pose import Pose
from sagline.robot.robot import Robot
from sagline.tension.margin import cable_margins
from sagline.tension.method import TensionMethod, shared_tension
from sagline.tension.methods import METHODS as ALL_METHODS
from sagline.tension.methods import MinimumNorm
from sagline.viewer import lines
from sagline.viewer.tension_scale import Colors, TensionScale, force_unit
from sagline.viewer.wording import method_name, model_name, remembers

# the exact one first
MODELS: Final = MappingProxyType({model_name(make()): make() for make in reversed(ALL_MODELS.values())})
# those that remember come last: by default what is shown depends on the pose alone
METHODS: Final = MappingProxyType(
    {method_name(method): method for method in sorted((make() for make in ALL_METHODS.values()), key=remembers)}
)


@dataclass(frozen=True, slots=True)
class Settings:
    """The robot's changes, how it is solved, and how it is drawn.

    Attributes:
        mass: Mass of the platform with its load [kg], > 0; the inertia grows with it.
        density: Factor on the cables' linear density, > 0.
        stiffness: Factor on the cables' axial stiffness, > 0.
        model: Cable model that the lengths are planned with.
        tension: How the load is shared.
        sag_scale: How many times its sag a cable is drawn with, >= 0.
        error_scale: How many times its position error the platform as it really hangs is drawn with, >= 0.
    """

    mass: float
    density: float = 1.0
    stiffness: float = 1.0
    model: CableModel = field(default_factory=Catenary)
    tension: TensionMethod = field(default_factory=MinimumNorm)
    sag_scale: float = 1.0
    error_scale: float = 1.0

    def __post_init__(self) -> None:
        """Check what no robot checks."""
        checked(self.density, "cable density", "times", above=0.0)
        checked(self.stiffness, "cable stiffness", "times", above=0.0)
        checked(self.sag_scale, "drawn sag", "times", low=0.0)
        checked(self.error_scale, "drawn error", "times", low=0.0)

    @property
    def changes(self) -> tuple[float, float, float]:
        """What changes the robot: mass, density and stiffness."""
        return self.mass, self.density, self.stiffness

    def applied(self, robot: Robot) -> Robot:
        """The robot with its load and cables changed."""
        if self.mass == robot.mass and self.density == self.stiffness == 1.0:
            return robot
        cables = robot.cables
        density, stiffness = cables.linear_density * self.density, cables.axial_stiffness * self.stiffness
        changed = cables.replace(linear_density=density, axial_stiffness=stiffness)
        return with_mass(robot, self.mass).replace(cables=changed)


@dataclass(frozen=True, slots=True, eq=False)
class Snapshot:
    """A robot at one pose.

    Attributes:
        robot: The robot, as the settings have changed it.
        pose: Where the platform is wanted.
        plan: The plan for this pose; None where a cable has no chord.
        rest: Where the platform would really rest on exact cables of the planned lengths; None where the plan has no
            answer or the model is exact.
        refusal: Which cable over a pulley has no chord, and why; "" where all have.
        previous: The tensions that a way of sharing that remembers went on from [N], shape (m,); None for none.
    """

    robot: Robot
    pose: Pose
    plan: Plan | None
    rest: Pose | None
    refusal: str = ""
    previous: Array | None = None

    @property
    def feasible(self) -> bool:
        """Whether tensions within the limits carry the platform."""
        return self.plan is not None and bool(self.plan.feasible)

    @property
    def status(self) -> PoseStatus:
        """How the calculation ended."""
        return PoseStatus.NO_CHORD if self.plan is None else PoseStatus(int(self.plan.status))

    @property
    def reason(self) -> str:
        """Why it is not feasible, with the shortfall and the blocking cables; "" where it is."""
        if self.feasible:
            return ""
        if self.plan is None:
            return self.refusal or self.status.text
        if self.status is not PoseStatus.INFEASIBLE:
            return self.status.text
        shortfall = float(self.plan.shortfall)
        missing = force_unit(self.robot).written(shortfall)
        short = f"short of {missing}" if np.isfinite(shortfall) else "no force alone would do"
        blocking = ", ".join(str(i) for i in np.flatnonzero(self.plan.blocking))
        return f"{short}; at their limits: cables {blocking}" if blocking else short

    @property
    def tension(self) -> Array:
        """Chord tensions [N], shape (m,); NaN where there is no answer."""
        return np.full(self.robot.cable_count, np.nan) if self.plan is None else self.plan.chord_tension

    @property
    def margin(self) -> Array:
        """How far each limited tension is within its limits [N], shape (m,); NaN where there is no answer."""
        return self.tension if self.plan is None else cable_margins(self.plan.state)

    def nearer_limit(self, cable: int) -> str:
        """The limit that a cable's tension is nearer to, by name."""
        if self.plan is None:
            return ""
        tension, robot = self.plan.state.limited_tension[cable], self.robot
        lower = tension - robot.tension_min[cable] <= robot.tension_max[cable] - tension
        return "lower limit" if lower else "upper limit"

    @property
    def origin(self) -> str:
        """Model and way of sharing that the tensions come from; "" where there are none."""
        if self.plan is None:
            return ""
        return f"{model_name(self.plan.state.cables.model)}, {method_name(self.plan.tension)}"

    @property
    def error(self) -> Array | None:
        """Where the platform would really rest less where it is wanted [m], shape (3,)."""
        return None if self.rest is None else self.rest.position - self.pose.position

    def courses(self, sag_scale: float) -> Array:
        """Points of the cables from frame anchor over pulley to platform end (m, points_per_cable, 3).

        Hanging, their sag some times as large; straight where the pose is not feasible.
        """
        wraps, ends = self._on_pulleys()
        free = lines.straight(ends)
        if self.plan is not None and self.feasible:
            free = lines.hanging(ends, self.plan.state.cables, sag_scale)
        return free if wraps.shape[1] == 1 else np.concatenate((wraps, free), axis=1)

    def cable_segments(self, sag_scale: float) -> Array:
        """Segments to draw the cables with (m (points - 1), 2, 3): hanging, or dashed chords where not feasible."""
        return lines.segments(self.courses(sag_scale), dashed=not self.feasible)

    def ghost_segments(self, sag_scale: float, apart: float) -> Array:
        """Segments of the chords where a cable as drawn hangs farther from its own than that [m]; else of no length."""
        points = lines.straight(self._on_pulleys()[1])
        drawn = self.courses(sag_scale)[:, -lines.POINTS :]
        return lines.segments(points, dashed=False, shown=np.linalg.norm(drawn - points, axis=2) > apart)

    def _on_pulleys(self) -> tuple[Array, Array]:
        """The cables on their pulleys, and both ends of the free ones."""
        contact = self.plan.state.contact if self.plan is not None and self.feasible else None
        wraps = lines.wraps(self.robot, self.pose, None if contact is None else contact.wrap_angle)
        return wraps, lines.chords(self.robot, self.pose, wraps[:, -1])

    def cable_colors(self, scale: TensionScale) -> Colors:
        """Colors of both ends of every segment as viser takes them, shape (m (points - 1), 2, 3)."""
        ends = 2 * (lines.points_per_cable(self.robot) - 1)
        return np.repeat(scale.linear_colors(self.tension), ends, axis=0).reshape(-1, 2, 3)

    def drawn_rest(self, error_scale: float) -> Array | None:
        """Where to draw the platform at rest: its position error some times as large."""
        error = self.error
        return None if error is None else self.pose.position + error_scale * error


def taken_at(
    robot: Robot,
    pose: Pose,
    settings: Settings,
    previous: Plan | None,
    *,
    confirmed: bool = True,
    wrench: Array | None = None,
) -> Snapshot:
    """A robot, already changed by the settings, held at rest at a pose."""
    reference = _remembered(previous, settings.tension)
    try:
        plan = inverse(robot, pose, settings.model, settings.tension, wrench, reference)
    except CableGeometryError as error:
        reason = "" if robot.winches is None else str(error).removeprefix("pose, ")
        return Snapshot(robot, pose, None, None, reason, reference)
    approximate = confirmed and not isinstance(settings.model, Catenary) and bool(plan.feasible)
    return Snapshot(robot, pose, plan, confirm(plan).pose if approximate else None, "", reference)


def _remembered(previous: Plan | None, tension: TensionMethod) -> Array | None:
    """The tensions that a way of sharing goes on from, in its variable [N], shape (m,); None for none."""
    if previous is None or not remembers(tension) or not previous.feasible or previous.at_border:
        return None
    return shared_tension(previous.state, tension.variable)
