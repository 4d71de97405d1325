"""`sagline new`: a first robot file from a few questions or options."""

from __future__ import annotations

import re
import sys
from dataclasses import asdict, dataclass
from math import prod
from pathlib import Path
from shlex import quote
from typing import TYPE_CHECKING

import typer

import sagline as sl
from sagline.cli import options as opt
from sagline.cli.terminal import show_note, show_text, working
from sagline.cli.view import ServerOptions, view_robot
from sagline.core.numbers import n
from sagline.files.writing import write_text

if TYPE_CHECKING:
    from sagline.core.arrays import Array
    from sagline.robot.catalogue import Design

MIDDLE = 0.5  # edges of the box of the printed feasible share, relative to the edges of the frame
GRID = (7, 7, 7)  # numbers of poses along the edges of a box
NEARLY_ALL = 0.95  # smallest feasible share in the test box of the file
_BOXES = (0.7, 0.6, 0.5, 0.4, 0.3, 0.2)  # edges of possible test boxes, relative to the edges of the frame


ROPE_NAMES = "dyneema-sk78, dyneema-sk62, steel-6x19, steel-7x19"


QUESTIONS = {  # text of the question and default, by the name of the option
    "frame": ("Frame, length x width x height", "6 x 4 x 3 m"),
    "layout": ("All cables from above, or from above and below (top, mixed)", "top"),
    "cables": ("Number of cables (6 to 8)", "8"),
    "platform": ("Platform, length x width x height", "0.5 x 0.5 x 0.4 m"),
    "mass": ("Mass of the platform with its load", "30 kg"),
    "rope": (f"Rope ({ROPE_NAMES})", "dyneema-sk78"),
    "diameter": ("Diameter of the rope", "4 mm"),
}


@dataclass(frozen=True)
class _Answers:
    """Answers to the questions of the same names. If an answer is None, the command asks the question."""

    frame: str | None = opt.option(None, "SIZE", 'Edges of the frame, "6 x 4 x 3 m".')
    layout: str | None = opt.option(None, "LAYOUT", "top: cables from above; mixed: from above and below.")
    cables: str | None = opt.option(None, "NUMBER", "Number of cables, 6 to 8.")
    platform: str | None = opt.option(None, "SIZE", 'Edges of the platform, "0.5 x 0.5 x 0.4 m".')
    mass: str | None = opt.option(None, "MASS", 'Mass of the platform with its load, "30 kg".')
    rope: str | None = opt.option(None, "ROPE", f"Rope of the cables: {ROPE_NAMES}.")
    diameter: str | None = opt.option(None, "LENGTH", 'Diameter of the rope, "4 mm".')


def new(
    file: Path = opt.argument(opt.NEEDED, "FILE", "The robot file to write (my_robot.yaml)."),
    answers: _Answers = _Answers(),
    force: bool = opt.FORCE,
    look: bool = opt.flag(False, "Show it in the browser afterwards.", "--view"),
) -> int:
    r"""Make a robot file of your own. The command asks for missing options, checks the robot and describes the robot.

    Without a terminal, the answers are read from the lines of stdin. An empty line means the default.

    For example:

        sagline new my_robot.yaml
        sagline new my_robot.yaml --frame "15 x 11 x 6 m" --mass "50 kg" \
            --rope steel-6x19 --diameter "3 mm"
    """
    from sagline.files.robot_file import parse_robot

    if file.suffix not in (".yaml", ".yml"):
        raise sl.FileError(file, "is not a valid name for a robot file", "Let it end in .yaml.")
    if file.exists() and not force:
        raise sl.FileError(file, "exists", "Choose another name, or replace it with --force.")
    design, said = _answered(file.stem, asdict(answers))
    with working(f"checking {prod(GRID)} poses of each of a few boxes"):
        robot, middle = _boxed(design)
    given = ", ".join(f"{key} {' '.join(value.split())}" for key, value in said.items())
    header = f"# made by sagline new: {given}\n# values in SI units; a quantity may also have its unit, 22 mm^2\n"
    text = header + sl.dump_robot(robot)
    made = parse_robot(text, file)
    write_text(file, text)
    with working("checking the robot"):
        lines, share = _explained(made, design, middle)
    for line in lines:
        show_text(line)
    if share < NEARLY_ALL:
        advice = "for a larger share, try a larger platform, the other layout, a thicker rope or a smaller mass."
        show_note("Advice: ", advice, style="bold")
    for what, command in (("Written", ""), ("Look at it", "sagline view "), ("Every value", "sagline show ")):
        show_text(f"{what}: {command}{quote(str(file)) if command else file}", whole=True)
    if not look:
        return 0
    return view_robot(made, file, opt.with_defaults(ServerOptions))


def _answered(name: str, answers: dict[str, str | None]) -> tuple[Design, dict[str, str]]:
    """The design and all answers. On a terminal, a question is repeated after an invalid answer."""
    asks = sys.stdin is not None and sys.stdin.isatty() and sys.stderr.isatty()
    said: dict[str, str] = {}
    for key, (question, default) in QUESTIONS.items():
        given = answers.get(key)
        while key not in said:
            if given is not None:
                text = given
            elif asks:
                text = str(typer.prompt(question, default=default, err=True))
            else:
                text = _read(key, question, default)
            try:
                design = _design(name, {**said, key: text})
            except sl.InvalidValueError as error:
                if given is not None or not asks:
                    raise
                show_note("No: ", str(error), style="bold red")
            else:
                said[key] = text
    return design, said


def _read(key: str, question: str, default: str) -> str:
    """An answer from a line of stdin, which is a pipe or a file. An empty line means `default`."""
    line = "" if sys.stdin is None or sys.stdin.isatty() else sys.stdin.readline()
    if line:
        return line.strip() or default
    allowed = f'an option, or a line that answers "{question}"'
    step = f'Add --{key} "{default}", for instance.'
    raise sl.InvalidValueError(f"--{key}", "missing: the input ended", allowed, step)


def _design(name: str, said: dict[str, str]) -> Design:
    """The design with the answers `said`. Valid values replace the answers that are still missing."""
    from sagline.cables.cable import ROPES
    from sagline.cli.values import quantity
    from sagline.robot.catalogue import COUNTS, LAYOUTS, Design

    frame = _edges(said["frame"], "frame")
    layout = said.get("layout", LAYOUTS[0])
    design = Design(
        name=name,
        frame=frame,
        platform=_edges(said["platform"], "platform") if "platform" in said else 0.5 * frame,
        mass=quantity(said.get("mass", "1"), "mass", "kg", above=0.0),
        rope=said.get("rope", next(iter(ROPES))),
        diameter=quantity(said.get("diameter", "0.004"), "diameter", "m"),
        cables=_count(said["cables"], layout) if "cables" in said else COUNTS.get(layout, (8,))[0],
        layout=layout,
    )
    if len(said) == len(QUESTIONS):
        design.robot()  # an error if the rope cannot support the platform
    return design


def _count(text: str, layout: str) -> int:
    from sagline.robot.catalogue import COUNTS

    if not re.fullmatch(r"[0-9]{1,3}", text.strip()):
        allowed = " or ".join(map(str, COUNTS.get(layout, (6, 7, 8))))
        raise sl.InvalidValueError("cables", repr(text), allowed, "Give a whole number.")
    return int(text)


def _edges(text: str, item: str) -> Array:
    """Three edges in m from "6 x 4 x 3 m", "6x4x3", or "600 cm x 4 m x 3 m"."""
    from sagline.core.arrays import checked
    from sagline.files.quantity import in_si

    parts = [part.strip() for part in text.replace("×", "x").split("x")]
    if len(parts) != 3:
        raise sl.InvalidValueError(item, repr(text), 'three edges, such as "6 x 4 x 3 m"', f"Correct {item}.")
    unit = parts[2].lstrip("0123456789.+-eE ")
    edges = in_si([part if part[-1:].isalpha() or not unit else f"{part} {unit}" for part in parts], "m", item)
    return checked(edges, item, "m", shape=(3,), above=0.0)


def _boxed(design: Design) -> tuple[sl.Robot, sl.Plan]:
    """The robot with its largest test box with nearly all poses feasible, and the plan in the middle of its frame."""
    from sagline.robot.pose import level_grid

    robot = design.robot()
    middle = sl.inverse(robot, level_grid(design.placed(MIDDLE), GRID))
    for share in _BOXES:
        box = design.placed(share)
        if sl.inverse(robot, level_grid(box, GRID)).feasible.mean() >= NEARLY_ALL:
            return robot.replace(test_box=box), middle
    return robot, middle


def _explained(robot: sl.Robot, design: Design, middle: sl.Plan) -> tuple[list[str], float]:
    """Lines about `robot`, and the feasible share of the poses of `middle`, in the middle of its frame."""
    from sagline.cables.cable import ROPES, SAFETY
    from sagline.robot.catalogue import SLACK_LIMIT

    share = float(middle.feasible.mean())
    density, stiffness = float(robot.cables.linear_density[0]), float(robot.cables.axial_stiffness[0])
    lines = [
        f"{robot.name}: {robot.cable_count} cables, {ROPES[design.rope].description}, "
        f"{n(1e3 * design.diameter, 'g', 'mm')}: {n(1e3 * density, '.3g', 'g/m')}, EA {n(stiffness, unit='N')}",
        f"Tensions allowed: {n(robot.tension_min[0], '.3g', 'N')} ({100 * SLACK_LIMIT:g} % of the weight) to "
        f"{n(robot.tension_max[0], unit='N')} (the breaking force divided by a safety factor of {SAFETY:g})",
        f"In the middle half of the frame, {100 * share:.0f} % of the level poses are feasible",
    ]
    if share > 0.0:
        tension = middle.chord_tension[middle.feasible]
        sag = middle.state.cables.sag[middle.feasible]
        lines.append(
            f"There cables carry {n(tension.min(), '.3g', 'N')} to {n(tension.max(), unit='N')} "
            f"and sag by up to {n(1e3 * sag.max(), '.3g', 'mm')}"
        )
    return lines, share
