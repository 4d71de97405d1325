"""Arguments and options of the subcommands: their declaration, and the options that several commands have.

A declaration is the default value of a parameter, `cells: int = opt.option(32, "NUMBER", "Cells of the grid.")`, or of
a field of a dataclass. A parameter whose type is such a dataclass is replaced by its fields.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, nullcontext
from copy import copy
from dataclasses import dataclass, fields, is_dataclass, replace
from inspect import Parameter, Signature, signature
from pathlib import Path
from typing import Any, Final, TypeVar, cast, get_type_hints

import typer
from typer.models import ParameterInfo

import sagline as sl
from sagline.core.arguments import word_of
from sagline.core.errors import InvalidValueError
from sagline.core.surface import ordered_names

T = TypeVar("T")
Completion = Callable[[str], list[str]] | None

NEEDED: Final[Any] = ...  # default of an argument or option that must be given

FORMATS = ("png", "svg", "pdf")  # formats of figures
STYLES = ("plain", "ieee", "ieee-wide", "mdpi", "mdpi-wide", "slides", "slides-wide")  # journal and width of figures
VARIABLES = ("chord", "horizontal", "frame_end")  # tension variables of the tension distribution methods


MODELS: Final = tuple(word_of(name) for name in ordered_names("sagline.cables"))[::-1]
METHODS: Final = tuple(word_of(name) for name in ordered_names("sagline.tension"))
# Tension distribution methods with their default options. The tensions of QuadraticProgram would be the minimum norm.
TENSIONS: Final = tuple(name for name in METHODS if name != "quadratic-program")


def tension_named(name: str, variable: Any = "chord") -> sl.TensionMethod:
    """The method of the option `--tension` with a tension variable."""
    from sagline.tension.methods import methods_by_name

    return methods_by_name()[name.title().replace("-", "")](variable)


def figure_style(name: str) -> AbstractContextManager[object]:
    """Context in which figures get the style of the option `--style`."""
    if name == "plain":
        return nullcontext()
    journal, _, wide = name.partition("-")
    return sl.plot.style(journal, 2 if wide else 1)


def robot_completions(incomplete: str) -> list[str]:
    """Presets and robot files whose names begin with `incomplete`, for completion in the shell."""
    from glob import escape, glob

    files = sorted(glob(f"{escape(incomplete)}*.yaml") + glob(f"{escape(incomplete)}*.yml"))
    return [name for name in sl.robot_names() if name.startswith(incomplete)] + files


# Condition of an option that has an effect only if another option is given (True), or only if it is missing (False).
# The text is the name of the other option, "--prove", or of an argument, "PATH".
Condition = tuple[str, bool]


def only_with(other: str) -> Condition:
    """Condition of an option that has an effect only if `other` is given."""
    return other, True


def only_without(other: str) -> Condition:
    """Condition of an option that has an effect only if `other` is missing."""
    return other, False


def argument(default: T, metavar: str, text: str, *conditions: Condition, completion: Completion = None) -> T:
    """An argument with its default value, or `NEEDED`."""
    declared: T = typer.Argument(default, metavar=metavar, help=text, autocompletion=completion)
    return _with(declared, conditions)


def option(default: T, metavar: str, text: str, *more: str | Condition, **settings: Any) -> T:
    """An option with its default value, or `NEEDED`. `more`: conditions, and names other than that of the parameter."""
    names = [each for each in more if isinstance(each, str)]
    conditions = [each for each in more if not isinstance(each, str)]
    declared: T = typer.Option(default, *names, metavar=metavar or None, help=text, **settings)
    return _with(declared, conditions)


def flag(default: bool, text: str, *more: str | Condition) -> bool:
    """An option without a value."""
    return option(default, "", text, *more)


def choice(default: str | None, metavar: str, text: str, names: Sequence[str], *more: str | Condition) -> Any:
    """An option whose value is one of `names`, or several of them. The help lists them unless `text` is a sentence."""
    shown = text if text.endswith(".") else f"{text}: {', '.join(names)}."

    def check(given: str) -> str:
        if given not in names:
            raise typer.BadParameter(f"{given!r} is not one of {', '.join(map(repr, names))}.")
        return given

    def completions(incomplete: str) -> list[str]:
        return [name for name in names if name.startswith(incomplete)]

    return option(default, metavar, shown, *more, parser=check, autocompletion=completions)


def converted(
    default: object, metavar: str, text: str, function: str | Callable[..., Any], *more: str | Condition, **limits: Any
) -> Any:
    """An option whose text `function` converts to the value. A text names a function of `sagline.cli.values`."""

    def convert(parameter: typer.CallbackParam, value: Any) -> Any:
        if not isinstance(value, str):
            return value  # the default value
        if callable(function):
            return function(value, parameter.opts[-1], **limits)
        from sagline.cli import values

        return getattr(values, function)(value, parameter.opts[-1], **limits)

    # the callback converts the text, because typer would change the message of an error that the parser raises
    return option(default, metavar, text, *more, parser=lambda given: given, callback=convert)


def quantity(default: T, metavar: str, text: str, unit: str, *more: str | Condition, **limits: float) -> T:
    """An option for a number, in SI units or with its unit. The number is at least `low` and greater than `above`."""
    return cast(T, converted(default, metavar, text, "quantity", *more, unit=unit, **limits))


def out(default: T, shown: str | bool = True, *conditions: Condition) -> T:
    """The option `--out`; its help shows `shown` as the default."""
    text = "Folder for the files, or name of the main file with its suffix. The other names then begin with its stem."
    return option(default, "DIR|FILE", text, "--out", *conditions, show_default=shown)


def seed(default: int, *conditions: Condition) -> int:
    """The option `--seed`."""
    text = "Seed of the random numbers; the same seed gives the same numbers."
    return cast(int, converted(default, "NUMBER", text, whole_of, *conditions, least=0, most=2**63 - 1))


def port(default: int) -> int:
    """The option `--port`."""
    text = "Port to listen on; 0 selects a free port."
    return cast(int, converted(default, "NUMBER", text, whole_of, least=0, most=65535))


def csv_flag(default: bool, *conditions: Condition) -> bool:
    """The option `--csv`."""
    return flag(default, "Write the whole table as a CSV file.", "--csv/--no-csv", *conditions)


def if_only(option: T, *conditions: Condition) -> T:
    """A copy of `option` with other conditions."""
    return _with(copy(option), conditions)


def _with(declared: T, conditions: Sequence[Condition]) -> T:
    """An option or argument of typer, with the conditions that `main` reads."""
    cast(Any, declared).conditions = conditions
    return declared


def whole_of(text: str, item: str, least: int, most: int) -> int:
    """A whole number between `least` and `most`, from a text of digits."""
    if not re.fullmatch(r"[0-9]{1,20}", text) or not least <= int(text) <= most:
        raise InvalidValueError(item, repr(text), f"a whole number from {least} to {most}", "Choose another.")
    return int(text)


def middle_pose(robot: sl.Robot) -> sl.Pose:
    """Level pose in the middle of the test box of `robot`. InvalidValueError if `robot` has no test box."""
    if robot.test_box is None:
        raise InvalidValueError("--pose", "missing", "X,Y,Z or X,Y,Z,A,B,C", "This robot has no test box.")
    return sl.Pose((robot.test_box.low + robot.test_box.high) / 2, [[1, 0, 0], [0, 1, 0], [0, 0, 1]])


def robot_with_payload(name: str, payload: float | None) -> sl.Robot:
    """The preset or robot file `name` with a payload [kg]. The inertia increases in proportion to the mass."""
    robot = sl.load_robot(name)
    return robot if payload is None else robot.with_payload(payload)


ROBOT = argument(
    NEEDED, "ROBOT", "A preset (see sagline robots) or a robot file (robot.yaml).", completion=robot_completions
)
OUTPUT = out(Path("output"))
STDOUT: Path | None = out(None, "stdout")
JSON = flag(False, "Print only the numbers on stdout, as JSON.", "--json")
TABLE = csv_flag(False)
STYLE: str = choice("plain", "STYLE", "Style of the figures", STYLES)
FORCE = flag(False, "Replace files that exist.", "--force")
MODEL: str = choice("catenary", "MODEL", "Cable model", MODELS)
VARIABLE: Any = choice("chord", "VARIABLE", "Tension variable of the method", VARIABLES)
TENSION: str = choice("closest", "METHOD", "Tension distribution method", TENSIONS)
WRENCH = converted(
    None,
    "FX,FY,FZ[,MX,MY,MZ]",
    "Force [N] and moment [N m] on the platform in addition to its weight, about its center of mass, in world axes.",
    "wrench_of_text",
)
PAYLOAD: float | None = quantity(
    None, "MASS", "Additional mass on the platform, 20 or '20 kg'. The inertia increases in proportion.", "kg", low=0.0
)
POSE = converted(
    None,
    "X,Y,Z[,A,B,C]",
    "Position [m] and angles about z, y, x [degrees]. Default: middle of the robot's test box.",
    "pose_of_text",
)
GIVEN: Any = converted(
    None,
    "NAMES",
    "Given values of a platform with fewer cables than degrees of freedom: 'x,y,z,yaw' or 'x,y,z,level'. "
    "Default: x, y, z and, with four cables, the tension level.",
    lambda text, item: tuple(name.strip() for name in text.split(",")),
)
WINCHES: Any = choice("ideal", "WINCHES", "Model of the winches", ("ideal", "robot"))
STEP: float | None = quantity(
    None, "TIME", "Time step of the integrator [s]. Default: a step that suits the robot.", "s", above=0.0
)
BASES: list[str] | None = option(
    None,
    "FILE=CABLES",
    "Base that moves, such as a ship or a drone: its poses in .csv or .yaml, and the cables whose anchors it carries: "
    "ship.yaml=0,1,2,3. Poses are relative to the place in the robot file. The option can be repeated.",
    "--base",
)
LOSS_TIME: float | None = quantity(
    None, "TIME", "Loss time [s] of the cable material: axial stiffness EA (1 + i omega TIME).", "s", low=0.0
)
AIR_DAMPING: float = quantity(
    0, "NUMBER", "Damping of the cables by air, per length and velocity [N s/m^2].", "N*s/m^2", low=0.0
)
MODBUS = flag(False, "Use Modbus TCP instead of S7.", "--modbus")
PRIORITY: int | None = option(None, "NUMBER", "Run in real time (Linux's SCHED_FIFO) with this priority, 1 to 99.")
HOST = option("127.0.0.1", "ADDRESS", "Address to listen on; 0.0.0.0 and :: mean all addresses.")
TRUE: str | None = option(
    None, "ROBOT", "Robot file of the simulated machine, if it differs from the robot that the controller assumes."
)
LOG: Path | None = option(None, "FILE", "Write a log to this file in MCAP format (run.mcap).")


def _formats_of(text: str, item: str) -> tuple[str, ...]:
    """Formats of figures from a text such as "png, pdf"."""
    found = tuple(dict.fromkeys(part.strip().lower() for part in text.split(",")))
    if not set(found) <= set(FORMATS):
        raise InvalidValueError(item, repr(text), ", ".join(FORMATS), f"Give one or several: {item} png,pdf.")
    return found


@dataclass(frozen=True)
class Files:
    """Options of the files that a command writes. A field that gets a value instead of an option is fixed."""

    folder: Path = OUTPUT
    figures: bool = flag(True, "Draw figures.", "--figures/--no-figures")
    formats: Any = converted(
        "png,svg",
        "FORMATS",
        f"Formats of the figures, separated by commas: {', '.join(FORMATS)}.",
        _formats_of,
        "--format",
        only_with("--figures"),
    )
    style: str = if_only(STYLE, only_with("--figures"))
    table: bool = TABLE
    as_json: bool = JSON


def data_files(folder: Path = OUTPUT, *, table: bool = TABLE) -> Files:
    """Options for the output files of a command that draws no figures."""
    return Files(folder, figures=False, formats=(), style="plain", table=table)


TABLE_FILES: Final = data_files(if_only(OUTPUT, only_with("--csv")))  # of a command whose only file is a table


def expanded(function: Callable[..., Any]) -> Callable[..., Any]:
    """A function like `function`, with one parameter per option: the fields of each dataclass replace the dataclass."""
    hints, groups = get_type_hints(function), dict[str, Any]()
    options: dict[str, Parameter] = {}
    for name, each in signature(function).parameters.items():
        if is_dataclass(each.default):
            groups[name] = each.default
            options |= {part.name: part for part in _options_of(each.default)}
        else:
            options[name] = each.replace(annotation=hints[name], kind=Parameter.KEYWORD_ONLY)

    def call(**given: Any) -> Any:
        made = {
            name: replace(group, **{part.name: given.pop(part.name) for part in _options_of(group)})
            for name, group in groups.items()
        }
        return function(**given, **made)

    call.__signature__ = Signature(list(options.values()))  # type: ignore[attr-defined]
    call.__annotations__ = {name: each.annotation for name, each in options.items()}
    return call


def with_defaults(group: type[T]) -> T:
    """An instance of a dataclass of options, with the declared default values."""
    declared = {each.name: each.default for each in fields(cast(Any, group)) if isinstance(each.default, ParameterInfo)}
    return group(**{name: each.default for name, each in declared.items()})


def _options_of(group: Any) -> Iterator[Parameter]:
    """Parameters for the options in the fields of `group`; a field with another value has no parameter."""
    hints = get_type_hints(type(group))
    for name, hint in hints.items():
        if isinstance(declared := getattr(group, name), ParameterInfo):
            yield Parameter(name, Parameter.KEYWORD_ONLY, default=declared, annotation=hint)
