"""Arguments and options of the subcommands: functions that declare them, and those that several commands have."""

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
    """Tension variables of the tension distribution methods."""

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
        """The method with a tension variable."""
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
        """A context; figures that are made inside it have this style."""
        if self is FigureStyle.PLAIN:
            return nullcontext()
        from sagline.plot import style

        name, _, wide = self.value.partition("-")
        return style(name, 2 if wide else 1)


def robot_completions(incomplete: str) -> list[str]:
    """Completion in the shell: the presets and robot files whose names begin with a text."""
    from glob import escape, glob

    from sagline.robot.catalogue import robot_names

    files = sorted(glob(f"{escape(incomplete)}*.yaml") + glob(f"{escape(incomplete)}*.yml"))
    return [name for name in robot_names() if name.startswith(incomplete)] + files


def argument(metavar: str, text: str, completion: Callable[[str], list[str]] | None = None) -> Any:
    """An argument."""
    return typer.Argument(metavar=metavar, help=text, autocompletion=completion)


def option(metavar: str, text: str, *names: str) -> Any:
    """An option with a value; without `names`, it has the name of the parameter."""
    return typer.Option(*names, metavar=metavar, help=text)


def converted_option(metavar: str, text: str, function: str, *names: str, **arguments: object) -> Any:
    """An option whose text a function of `sagline.cli.values` converts to the value."""

    def converted(parameter: typer.CallbackParam, value: Any) -> Any:
        if not isinstance(value, str):
            return value  # the default value
        from sagline.cli import values

        return getattr(values, function)(value, parameter.opts[-1], **arguments)

    return typer.Option(*names, metavar=metavar, help=text, parser=_unchanged, callback=converted)


def quantity_option(metavar: str, text: str, unit: str, *names: str, **limits: float) -> Any:
    """An option for a number, in SI or with a unit. The number must be at least `low` and greater than `above`."""
    return converted_option(metavar, text, "quantity", *names, unit=unit, **limits)


def choice_option(metavar: str, text: str, choices: type[StrEnum]) -> Any:
    """An option whose value is one of a few words; the help lists the words."""
    return option(metavar, f"{text}: {', '.join(each.value for each in choices)}.")


def flag(text: str, *names: str) -> Any:
    """An option without a value."""
    return typer.Option(*names, help=text)


def out_option(default: str | bool = True) -> Any:
    """The option `--out`; its help shows this text as the default."""
    text = "Folder for the files. A name with a suffix is the main file; the other names then begin with its stem."
    return typer.Option("--out", metavar="DIR|FILE", help=text, show_default=default)


@dataclass(frozen=True)
class Condition:
    """Condition of an option that has an effect only with, or only without, another option; part of `Annotated`.

    Attributes:
        other: The other option, "--prove", or the name of an argument in the help, "PATH".
        given: True if the other option must be given; False if it must be missing.
    """

    other: str
    given: bool

    def error(self, option: str) -> InvalidValueError:
        """Error of an option that would have no effect."""
        if self.given:
            step = f"Add {self.other}, or leave out {option}."
            return InvalidValueError(option, f"given without {self.other}", "both", step)
        step = f"Leave out {option}, or {self.other}."
        return InvalidValueError(option, f"given with {self.other}", "only one of the two", step)


def only_with(other: str) -> Condition:
    """Condition of an option that has an effect only together with another option."""
    return Condition(other, given=True)


def only_without(other: str) -> Condition:
    """Condition of an option that has an effect only without another option."""
    return Condition(other, given=False)


def _unchanged(value: Any) -> Any:
    """The unchanged text. A callback converts the text, because typer would change the error message of a parser."""
    return value


RobotArgument = Annotated[
    str, argument("ROBOT", "A preset (see sagline robots) or a robot file, robot.yaml.", robot_completions)
]
OutOption = Annotated[Path, out_option()]
FileOption = Annotated[Path | None, out_option("stdout")]
JsonOption = Annotated[bool, flag("Print only the numbers on stdout, as JSON.", "--json")]
TableOption = Annotated[bool, flag("Write the whole table as a CSV file.", "--csv/--no-csv")]
FiguresOption = Annotated[bool, flag("Draw figures.", "--figures/--no-figures")]
STYLE = choice_option("STYLE", "Style of the figures", FigureStyle)
StyleOption = Annotated[FigureStyle, STYLE, only_with("--figures")]
FormatsOption = Annotated[
    Any,
    converted_option(
        "FORMATS",
        f"Formats of the figures, separated by commas: {', '.join(FORMATS)}.",
        "formats_of",
        "--format",
        known=FORMATS,
    ),
    only_with("--figures"),
]
ForceOption = Annotated[bool, flag("Replace files that exist.", "--force")]
ModelOption = Annotated[ModelName, choice_option("MODEL", "Cable model", ModelName)]
VariableOption = Annotated[
    TensionVariable, choice_option("VARIABLE", "Tension variable of the method", TensionVariable)
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
    float | None,
    quantity_option(
        "TIME", "Loss time [s] of the cable material: axial stiffness EA (1 + i omega TIME).", "s", low=0.0
    ),
]
AirDampingOption = Annotated[
    float,
    quantity_option("NUMBER", "Damping of the cables by air, per length and velocity [N s/m^2].", "N*s/m^2", low=0.0),
]
ModbusOption = Annotated[bool, flag("Use Modbus TCP instead of S7.", "--modbus")]
PriorityOption = Annotated[
    int | None, option("NUMBER", "Run in real time (Linux's SCHED_FIFO) with this priority, 1 to 99.")
]
SeedOption = Annotated[
    int,
    converted_option(
        "NUMBER",
        "Seed of the random numbers; the same seed gives the same numbers.",
        "whole_of",
        least=0,
        most=2**63 - 1,
    ),
]
HostOption = Annotated[str, option("ADDRESS", "Address to listen on; 0.0.0.0 and :: mean all addresses.")]
PortOption = Annotated[int, converted_option("NUMBER", "Port to listen on; 0 selects a free port.", "port_of")]
TrueOption = Annotated[
    str | None,
    option("ROBOT", "Robot file of the simulated machine, if it differs from the robot that the controller assumes."),
]
LogOption = Annotated[Path | None, option("FILE", "Write a log to this MCAP file, run.mcap.")]
