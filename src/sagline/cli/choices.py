"""What can be chosen on the command line, and what it stands for."""

from __future__ import annotations

from enum import StrEnum
from typing import TYPE_CHECKING, Literal

if TYPE_CHECKING:
    from sagline.cables.model import CableModel
    from sagline.tension.method import TensionMethod


class Model(StrEnum):
    """Cable models."""

    CATENARY = "catenary"
    EMPIRICAL = "empirical"
    PARABOLIC = "parabolic"
    ELASTIC = "elastic"
    STRAIGHT = "straight"

    def build(self) -> CableModel:
        """The model, with its default constants."""
        from sagline.cables.models import MODELS

        return MODELS[self.value.title().replace("-", "")]()


class Direction(StrEnum):
    """Along which axis a force acts, or about which a moment."""

    X = "x"
    Y = "y"
    Z = "z"
    ABOUT_X = "about x"
    ABOUT_Y = "about y"
    ABOUT_Z = "about z"


class CableMass(StrEnum):
    """How cables have mass in motion."""

    NONE = "none"
    LUMPED = "lumped"
    MODAL = "modal"


class ShaperKind(StrEnum):
    """What shapes a path so that it excites no vibration."""

    NONE = "none"
    ZV = "zv"
    ZVD = "zvd"
    EI = "ei"


class Variable(StrEnum):
    """Tensions in which the load can be shared."""

    CHORD = "chord"
    HORIZONTAL = "horizontal"
    FRAME_END = "frame_end"


class Winding(StrEnum):
    """What lies on the drums of winches."""

    CONSTANT = "constant"
    REMEMBERED = "remembered"


class Tension(StrEnum):
    """Ways of sharing the load, with their default options."""

    CLOSEST = "closest"
    MINIMUM_NORM = "minimum-norm"
    LOWEST_SUM = "lowest-sum"
    LOWEST_MAXIMUM = "lowest-maximum"
    P_NORM = "p-norm"
    CENTROID = "centroid"
    ANALYTIC_CENTER = "analytic-center"
    CLOSED_FORM = "closed-form"
    IMPROVED_CLOSED_FORM = "improved-closed-form"
    PUNCTURE = "puncture"
    POLYGON_WALK = "polygon-walk"

    def build(self, variable: Variable) -> TensionMethod:
        """The method, in that tension."""
        from sagline.tension.methods import METHODS

        return METHODS[self.value.title().replace("-", "")](variable.value)


class TensionPlace(StrEnum):
    """Where a cable's tension is measured."""

    FRAME_END = "frame-end"
    PLATFORM_END = "platform-end"
    CHORD = "chord"

    @property
    def key(self) -> Literal["frame_end", "platform_end", "chord"]:
        """As the library spells it."""
        places: dict[TensionPlace, Literal["frame_end", "platform_end", "chord"]] = {
            TensionPlace.FRAME_END: "frame_end",
            TensionPlace.PLATFORM_END: "platform_end",
            TensionPlace.CHORD: "chord",
        }
        return places[self]


class Format(StrEnum):
    """What a robot can be converted to."""

    ROBOT = "robot"
    MJCF = "mjcf"


def robot_completions(incomplete: str) -> list[str]:
    """Presets and robot files that begin so, for the shell."""
    from glob import escape, glob

    from sagline.robot.catalogue import robot_names

    files = sorted(glob(f"{escape(incomplete)}*.yaml") + glob(f"{escape(incomplete)}*.yml"))
    return [name for name in robot_names() if name.startswith(incomplete)] + files
