"""Arguments and options that several subcommands share, and the choices that options offer."""

from __future__ import annotations

from collections.abc import Callable
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

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


class Variable(StrEnum):
    """Tensions in which the load can be shared."""

    CHORD = "chord"
    HORIZONTAL = "horizontal"
    FRAME_END = "frame_end"


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


def robot_completions(incomplete: str) -> list[str]:
    """Presets and robot files that begin so, for the shell."""
    from glob import escape, glob

    from sagline.robot.catalogue import robot_names

    files = sorted(glob(f"{escape(incomplete)}*.yaml") + glob(f"{escape(incomplete)}*.yml"))
    return [name for name in robot_names() if name.startswith(incomplete)] + files


def argument(metavar: str, text: str, completion: Callable[[str], list[str]] | None = None) -> Any:
    """An argument."""
    return typer.Argument(metavar=metavar, help=text, autocompletion=completion)


def option(metavar: str, text: str, *names: str) -> Any:
    """An option with a value; without names its name is that of the parameter."""
    return typer.Option(*names, metavar=metavar, help=text)


def choice(metavar: str, text: str, choices: type[StrEnum]) -> Any:
    """An option whose value is one of a few words, which its help lists."""
    return typer.Option(metavar=metavar, help=f"{text}: {', '.join(each.value for each in choices)}.")


def flag(text: str, *names: str) -> Any:
    """An option without a value."""
    return typer.Option(*names, help=text)


def figures_flag(text: str) -> Any:
    """`--figures/--no-figures`; the text says what is drawn."""
    return flag(text, "--figures/--no-figures")


RobotArgument = Annotated[
    str, argument("ROBOT", "A preset (see sagline robots) or a robot file, robot.yaml.", robot_completions)
]
OutOption = Annotated[Path, option("DIR", "Folder for the files; created if missing.", "--out")]
FileOption = Annotated[Path | None, option("FILE", "File to write. Default: stdout.", "--out")]
JsonOption = Annotated[bool, flag("Print the numbers as JSON and nothing else on stdout.", "--json")]
ModelOption = Annotated[Model, choice("MODEL", "Cable model", Model)]
VariableOption = Annotated[Variable, choice("VARIABLE", "The tension in which it is shared", Variable)]
WrenchOption = Annotated[
    str | None,
    option(
        "FX,FY,FZ[,MX,MY,MZ]",
        "Force [N] and moment [N m] that act on the platform besides its weight: at its center of mass, along "
        "the world's axes.",
    ),
]
PayloadOption = Annotated[
    str | None,
    option("MASS", "Mass that the platform carries besides its own, 20 or '20 kg'; its inertia grows in proportion."),
]
PoseOption = Annotated[
    str | None,
    option(
        "X,Y,Z[,A,B,C]",
        "Position [m] and angles about z, y, x [degrees]. Default: the middle of the robot's test box.",
    ),
]
TensionOption = Annotated[Tension, choice("METHOD", "How the load is shared among redundant cables", Tension)]
LossTimeOption = Annotated[str, option("TIME", "Loss time [s] of the cables' stretch: EA (1 + i omega TIME).")]
AirDampingOption = Annotated[str, option("NUMBER", "Force of the air on a cable over its velocity, a meter [N s/m^2].")]
ModbusOption = Annotated[bool, flag("Speak Modbus TCP instead of S7.", "--modbus")]
SeedOption = Annotated[str, option("NUMBER", "Of the load cells' noise.")]
