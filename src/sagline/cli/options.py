"""Arguments and options of the subcommands: functions to declare them, and common ones."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from sagline.core.errors import InvalidValueError

if TYPE_CHECKING:
    from sagline.cables.model import CableModel
    from sagline.tension.method import TensionMethod


FORMATS = ("png", "svg", "pdf")  # formats of figures
USUAL_FORMATS = "png,svg"


class ModelName(StrEnum):
    """Cable models."""

    CATENARY = "catenary"
    EMPIRICAL = "empirical"
    PARABOLIC = "parabolic"
    ELASTIC = "elastic"
    STRAIGHT = "straight"

    def build(self) -> CableModel:
        """The model, with its default constants."""
        from sagline.cables.models import model_of

        return model_of(self.value)


class TensionVariable(StrEnum):
    """Kinds of tension for which a tension distribution is optimal."""

    CHORD = "chord"
    HORIZONTAL = "horizontal"
    FRAME_END = "frame_end"


class Tension(StrEnum):
    """Tension distribution methods, with their default options."""

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

    def build(self, variable: TensionVariable) -> TensionMethod:
        """The method for a tension."""
        from sagline.tension.methods import METHODS

        return METHODS[self.value.title().replace("-", "")](variable.value)


class FigureStyle(StrEnum):
    """Styles of figures, by journal and width."""

    PLAIN = "plain"
    IEEE = "ieee"
    IEEE_WIDE = "ieee-wide"
    MDPI = "mdpi"
    MDPI_WIDE = "mdpi-wide"
    SLIDES = "slides"
    SLIDES_WIDE = "slides-wide"

    def active(self) -> AbstractContextManager[object]:
        """Context in which new figures have this style."""
        if self is FigureStyle.PLAIN:
            return nullcontext()
        from sagline.plot import style

        name, _, wide = self.value.partition("-")
        return style(name, 2 if wide else 1)


def robot_completions(incomplete: str) -> list[str]:
    """Names of presets and robot files that begin with a text, for completion in the shell."""
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


def converted_option(metavar: str, text: str, function: str, *names: str, **arguments: object) -> Any:
    """An option; a function of `sagline.cli.values` makes its value from text, name and further arguments."""

    def converted(parameter: typer.CallbackParam, value: Any) -> Any:
        if not isinstance(value, str):
            return value  # the default value
        from sagline.cli import values

        return getattr(values, function)(value, parameter.opts[-1], **arguments)

    return typer.Option(*names, metavar=metavar, help=text, parser=_unchanged, callback=converted)


def quantity_option(metavar: str, text: str, unit: str, *names: str, **limits: float) -> Any:
    """An option whose value is a number in SI or a text with a unit, at least `low` or greater than `above`."""
    return converted_option(metavar, text, "quantity", *names, unit=unit, **limits)


def choice_option(metavar: str, text: str, choices: type[StrEnum]) -> Any:
    """An option whose value is one of a few words; its help lists them."""
    return option(metavar, f"{text}: {', '.join(each.value for each in choices)}.")


def flag(text: str, *names: str) -> Any:
    """An option without a value."""
    return typer.Option(*names, help=text)


def out_option(default: str | bool = True) -> Any:
    """`--out`; text for the default value if it is None."""
    text = "Folder for the files. With a suffix it is the main file; the other files are named after it."
    return typer.Option("--out", metavar="DIR|FILE", help=text, show_default=default)


@dataclass(frozen=True)
class Condition:
    """Condition, beside an option in `Annotated`: the option has an effect only with, or only without another one.

    Attributes:
        other: The other option, "--prove", or the name of an argument in the help, "PATH".
        given: False if the option has an effect only without the other one.
    """

    other: str
    given: bool

    def error(self, option: str) -> InvalidValueError:
        """Error of an option that would have no effect."""
        if self.given:
            step = f"Add {self.other}, or leave out {option}."
            return InvalidValueError(option, f"given without {self.other}", "both", step)
        step = f"Leave out {option}, or {self.other}."
        return InvalidValueError(option, f"given with {self.other}", "one of both", step)


def only_with(other: str) -> Condition:
    """Condition: the option has an effect only together with the other one."""
    return Condition(other, given=True)


def only_without(other: str) -> Condition:
    """Condition: the option has an effect only without the other one."""
    return Condition(other, given=False)


def _unchanged(value: Any) -> Any:
    """The unchanged value; a callback converts it, because typer would reformat the error of a parser."""
    return value


RobotArgument = Annotated[
    str, argument("ROBOT", "A preset (see sagline robots) or a robot file, robot.yaml.", robot_completions)
]
OutOption = Annotated[Path, out_option()]
FileOption = Annotated[Path | None, out_option("stdout")]
JsonOption = Annotated[bool, flag("Print the numbers as JSON and nothing else on stdout.", "--json")]
TableOption = Annotated[bool, flag("Write the whole table as a CSV file.", "--csv/--no-csv")]
FiguresOption = Annotated[bool, flag("Draw figures.", "--figures/--no-figures")]
STYLE = choice_option("STYLE", "Style of the figures", FigureStyle)
StyleOption = Annotated[FigureStyle, STYLE, only_with("--figures")]
FormatsOption = Annotated[
    Any,
    converted_option(
        "FORMATS",
        f"Formats of the figures, with commas between: {', '.join(FORMATS)}.",
        "formats_of",
        "--format",
        known=FORMATS,
    ),
    only_with("--figures"),
]
ForceOption = Annotated[bool, flag("Replace files that exist.", "--force")]
ModelOption = Annotated[ModelName, choice_option("MODEL", "Cable model", ModelName)]
VariableOption = Annotated[
    TensionVariable, choice_option("VARIABLE", "Tension that the method distributes", TensionVariable)
]
WrenchOption = Annotated[
    Any,
    converted_option(
        "FX,FY,FZ[,MX,MY,MZ]",
        "Force [N] and moment [N m] on the platform in addition to its weight, about its center of mass, in world "
        "axes.",
        "wrench_of_text",
    ),
]
PayloadOption = Annotated[
    float | None,
    quantity_option(
        "MASS",
        "Additional mass on the platform, 20 or '20 kg'. The inertia increases in proportion.",
        "kg",
        low=0.0,
    ),
]
PoseOption = Annotated[
    Any,
    converted_option(
        "X,Y,Z[,A,B,C]",
        "Position [m] and angles about z, y, x [degrees]. Default: middle of the robot's test box.",
        "pose_of_text",
    ),
]
TensionOption = Annotated[Tension, choice_option("METHOD", "Tension distribution method", Tension)]
LossTimeOption = Annotated[
    float | None, quantity_option("TIME", "Loss time [s] of the cables' stretch: EA (1 + i omega TIME).", "s", low=0.0)
]
AirDampingOption = Annotated[
    float,
    quantity_option("NUMBER", "Air damping of a cable per length and velocity [N s/m^2].", "N*s/m^2", low=0.0),
]
ModbusOption = Annotated[bool, flag("Use Modbus TCP instead of S7.", "--modbus")]
PriorityOption = Annotated[
    int | None, option("NUMBER", "Schedule in real time (SCHED_FIFO of Linux) with this priority, 1 to 99.")
]
SeedOption = Annotated[
    int, converted_option("NUMBER", "Seed of the random numbers.", "whole_of", least=0, most=2**63 - 1)
]
HostOption = Annotated[str, option("ADDRESS", "Address to listen on; 0.0.0.0 and :: mean all addresses.")]
PortOption = Annotated[int, converted_option("NUMBER", "Port to listen on; 0 selects a free port.", "port_of")]
TrueOption = Annotated[str | None, option("ROBOT", "File of the real robot if it differs from the nominal one.")]
LogOption = Annotated[Path | None, option("FILE", "Write a log to this MCAP file, run.mcap.")]
