"""Arguments and options that several subcommands share, and the choices that options offer."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

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


RobotArgument = Annotated[
    str,
    typer.Argument(
        metavar="ROBOT",
        help="A preset (see sagline robots) or a robot file, robot.yaml.",
        autocompletion=robot_completions,
    ),
]
OutOption = Annotated[Path, typer.Option("--out", metavar="DIR", help="Folder for the files; created if missing.")]
JsonOption = Annotated[bool, typer.Option("--json", help="Print the numbers as JSON and nothing else on stdout.")]
ModelOption = Annotated[
    Model, typer.Option(metavar="MODEL", help=f"Cable model: {', '.join(model.value for model in Model)}.")
]
VariableOption = Annotated[
    Variable,
    typer.Option(
        metavar="VARIABLE", help=f"The tension in which it is shared: {', '.join(each.value for each in Variable)}."
    ),
]
WrenchOption = Annotated[
    str | None,
    typer.Option(
        metavar="FX,FY,FZ[,MX,MY,MZ]",
        help="Force [N] and moment [N m] that act on the platform besides its weight: at its center of mass, along "
        "the world's axes.",
    ),
]
PayloadOption = Annotated[
    str | None,
    typer.Option(
        metavar="MASS",
        help="Mass that the platform carries besides its own, 20 or '20 kg'; its inertia grows in proportion.",
    ),
]
PoseOption = Annotated[
    str | None,
    typer.Option(
        metavar="X,Y,Z[,A,B,C]",
        help="Position [m] and angles about z, y, x [degrees]. Default: the middle of the robot's test box.",
    ),
]
TensionOption = Annotated[
    Tension,
    typer.Option(
        metavar="METHOD",
        help=f"How the load is shared among redundant cables: {', '.join(each.value for each in Tension)}.",
    ),
]
LossTimeOption = Annotated[
    str, typer.Option(metavar="TIME", help="Loss time [s] of the cables' stretch: EA (1 + i omega TIME).")
]
AirDampingOption = Annotated[
    str, typer.Option(metavar="NUMBER", help="Force of the air on a cable over its velocity, a meter [N s/m^2].")
]
