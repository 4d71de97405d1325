"""What a person has set in the panel, and the robot that follows from it."""

from __future__ import annotations

from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Final

from sagline.cables.catenary import Catenary
from sagline.cables.model import CableModel
from sagline.cables.models import MODELS as ALL_MODELS
from sagline.core.arrays import checked
from sagline.robot.inertia import with_mass
from sagline.robot.robot import Robot
from sagline.tension.method import TensionMethod
from sagline.tension.methods import METHODS as ALL_METHODS
from sagline.tension.minimum_norm import MinimumNorm
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
        """Check what no robot checks.

        Raises:
            InvalidValueError: If a number is not finite or out of its range.
        """
        checked(self.density, "cable density", "times", above=0.0)
        checked(self.stiffness, "cable stiffness", "times", above=0.0)
        checked(self.sag_scale, "drawn sag", "times", low=0.0)
        checked(self.error_scale, "drawn error", "times", low=0.0)

    @property
    def changes(self) -> tuple[float, float, float]:
        """What changes the robot: mass, density and stiffness."""
        return self.mass, self.density, self.stiffness

    def applied(self, robot: Robot) -> Robot:
        """The robot with its load and cables changed.

        Raises:
            InvalidValueError: If the mass is none.
        """
        if self.mass == robot.mass and self.density == self.stiffness == 1.0:
            return robot
        cables = robot.cables
        density, stiffness = cables.linear_density * self.density, cables.axial_stiffness * self.stiffness
        changed = cables.replace(linear_density=density, axial_stiffness=stiffness)
        return with_mass(robot, self.mass).replace(cables=changed)
