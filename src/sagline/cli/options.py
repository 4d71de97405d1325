"""Arguments and options of the subcommands: functions that declare them, and those that several commands have."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import Annotated, Any

import typer

import sagline as sl
from sagline.core.errors import InvalidValueError

FORMATS = ("png", "svg", "pdf")  # formats of figures
USUAL_FORMATS = "png,svg"


class ModelName(StrEnum):
    """Cable models."""

    CATENARY = "catenary"
    EMPIRICAL = "empirical"
    PARABOLIC = "parabolic"
    ELASTIC = "elastic"
    STRAIGHT = "straight"

    def build(self) -> sl.CableModel:
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

    def build(self, variable: TensionVariable) -> sl.TensionMethod:
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
        name, _, wide = self.value.partition("-")
        return sl.plot.style(name, 2 if wide else 1)


def robot_completions(incomplete: str) -> list[str]:
    """Completion in the shell: the presets and robot files whose names begin with a text."""
    from glob import escape, glob

    files = sorted(glob(f"{escape(incomplete)}*.yaml") + glob(f"{escape(incomplete)}*.yml"))
    return [name for name in sl.robot_names() if name.startswith(incomplete)] + files


def argument(metavar: str, text: str, completion: Callable[[str], list[str]] | None = None) -> Any:
    """An argument."""
    return typer.Argument(metavar=metavar, help=text, autocompletion=completion)


def option(metavar: str, text: str, *names: str) -> Any:
    """An option with a value; without `names`, it has the name of the parameter."""
    return typer.Option(*names, metavar=metavar, help=text)


def converted(metavar: str, text: str, function: str | Callable[..., Any], *names: str, **arguments: object) -> Any:
    """An option whose text a function converts to the value; a name is that of a function of `sagline.cli.values`."""

    def convert(parameter: typer.CallbackParam, value: Any) -> Any:
        if not isinstance(value, str):
            return value  # the default value
        if callable(function):
            return function(value, parameter.opts[-1], **arguments)
        from sagline.cli import values

        return getattr(values, function)(value, parameter.opts[-1], **arguments)

    return typer.Option(*names, metavar=metavar, help=text, parser=_unchanged, callback=convert)


def quantity(metavar: str, text: str, unit: str, *names: str, **limits: float) -> Any:
    """An option for a number, in SI or with a unit. The number must be at least `low` and greater than `above`."""
    return converted(metavar, text, "quantity", *names, unit=unit, **limits)


def choice(metavar: str, text: str, choices: type[StrEnum]) -> Any:
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
    """Condition of an option that has an effect only with, or only without, another option; part of `Annotated`."""

    other: str  # the other option, "--prove", or the name of an argument in the help, "PATH"
    given: bool  # true if the other option must be given; False if it must be missing

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


def whole_of(text: str, item: str, least: int, most: int) -> int:
    """A whole number between `least` and `most`, from a text of digits."""
    if not re.fullmatch(r"[0-9]{1,20}", text) or not least <= int(text) <= most:
        raise InvalidValueError(item, repr(text), f"a whole number from {least} to {most}", "Choose another.")
    return int(text)


def middle_pose(robot: sl.Robot) -> sl.Pose:
    """Level pose in the middle of a robot's test box. InvalidValueError if the robot has no test box."""
    if robot.test_box is None:
        raise InvalidValueError("--pose", "missing", "X,Y,Z or X,Y,Z,A,B,C", "This robot has no test box.")
    return sl.Pose((robot.test_box.low + robot.test_box.high) / 2, [[1, 0, 0], [0, 1, 0], [0, 0, 1]])


def level_grid(box: sl.PoseBox, points: Sequence[int]) -> sl.Pose:
    """Level poses on an even grid in a box; an axis with a single point has it in the middle."""
    import numpy as np

    axes = [
        np.linspace(low, high, count) if count > 1 else np.array([0.5 * (low + high)])
        for low, high, count in zip(box.low, box.high, points, strict=True)
    ]
    places = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    return sl.Pose.from_euler(places, 0.0, 0.0, 0.0)


def robot_with_payload(name: str, payload: float | None) -> sl.Robot:
    """The robot of a name or a file, with a payload [kg]; its inertia increases in proportion to its mass."""
    robot = sl.load_robot(name)
    return robot if payload is None else robot.with_payload(payload)


RobotArgument = Annotated[
    str, argument("ROBOT", "A preset (see sagline robots) or a robot file, robot.yaml.", robot_completions)
]
OutOption = Annotated[Path, out_option()]
FileOption = Annotated[Path | None, out_option("stdout")]
JsonOption = Annotated[bool, flag("Print only the numbers on stdout, as JSON.", "--json")]
TableOption = Annotated[bool, flag("Write the whole table as a CSV file.", "--csv/--no-csv")]
FiguresOption = Annotated[bool, flag("Draw figures.", "--figures/--no-figures")]
STYLE = choice("STYLE", "Style of the figures", FigureStyle)
StyleOption = Annotated[FigureStyle, STYLE, only_with("--figures")]
FormatsOption = Annotated[
    Any,
    converted(
        "FORMATS",
        f"Formats of the figures, separated by commas: {', '.join(FORMATS)}.",
        "formats_of",
        "--format",
        known=FORMATS,
    ),
    only_with("--figures"),
]
ForceOption = Annotated[bool, flag("Replace files that exist.", "--force")]
ModelOption = Annotated[ModelName, choice("MODEL", "Cable model", ModelName)]
VariableOption = Annotated[TensionVariable, choice("VARIABLE", "Tension variable of the method", TensionVariable)]
WrenchOption = Annotated[
    Any,
    converted(
        "FX,FY,FZ[,MX,MY,MZ]",
        "Force [N] and moment [N m] on the platform in addition to its weight, about its center of mass, in world "
        "axes.",
        "wrench_of_text",
    ),
]
PayloadOption = Annotated[
    float | None,
    quantity(
        "MASS",
        "Additional mass on the platform, 20 or '20 kg'. The inertia increases in proportion.",
        "kg",
        low=0.0,
    ),
]
PoseOption = Annotated[
    Any,
    converted(
        "X,Y,Z[,A,B,C]",
        "Position [m] and angles about z, y, x [degrees]. Default: middle of the robot's test box.",
        "pose_of_text",
    ),
]
TensionOption = Annotated[Tension, choice("METHOD", "Tension distribution method", Tension)]
LossTimeOption = Annotated[
    float | None,
    quantity("TIME", "Loss time [s] of the cable material: axial stiffness EA (1 + i omega TIME).", "s", low=0.0),
]
AirDampingOption = Annotated[
    float,
    quantity("NUMBER", "Damping of the cables by air, per length and velocity [N s/m^2].", "N*s/m^2", low=0.0),
]
ModbusOption = Annotated[bool, flag("Use Modbus TCP instead of S7.", "--modbus")]
PriorityOption = Annotated[
    int | None, option("NUMBER", "Run in real time (Linux's SCHED_FIFO) with this priority, 1 to 99.")
]
SeedOption = Annotated[
    int,
    converted(
        "NUMBER",
        "Seed of the random numbers; the same seed gives the same numbers.",
        whole_of,
        least=0,
        most=2**63 - 1,
    ),
]
HostOption = Annotated[str, option("ADDRESS", "Address to listen on; 0.0.0.0 and :: mean all addresses.")]
PortOption = Annotated[
    int, converted("NUMBER", "Port to listen on; 0 selects a free port.", whole_of, least=0, most=65535)
]
TrueOption = Annotated[
    str | None,
    option("ROBOT", "Robot file of the simulated machine, if it differs from the robot that the controller assumes."),
]
LogOption = Annotated[Path | None, option("FILE", "Write a log to this MCAP file, run.mcap.")]
