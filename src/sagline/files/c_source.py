"""C99 for a microcontroller: `sagline.c`, which is written by hand, and a header with a robot's constants."""

from __future__ import annotations

import os
from collections.abc import Iterable
from importlib.metadata import version
from importlib.resources import files
from pathlib import Path
from typing import Final

import numpy as np

from sagline.core.arguments import file_path, instance
from sagline.core.arrays import Array
from sagline.core.errors import FileError, InvalidValueError
from sagline.files.whole import written_together
from sagline.robot.robot import Robot

ENDING: Final = ".c"
REDUNDANT: Final = 2  # cables more than freedoms: what sagline.c shares the load among
_SOURCES = files("sagline.files") / "c"
_PRECISIONS = {
    np.float64: "typedef double sagline_real;",
    np.float32: "#define SAGLINE_FLOAT /* single precision */\ntypedef float sagline_real;",
}


def export_c(robot: Robot, file: str | os.PathLike[str], *, single_precision: bool = False) -> tuple[Path, Path, Path]:
    """Write C99 that finds a robot's tensions and lengths on a microcontroller, and what a PLC can take of it.

    Three files of one name: NAME.c is the same for every robot: one cable in both directions (P2 and P3 of "The
    model"), the structure matrix and the inverse kinematics of a pose, sharing the load as `Closest` or `MinimumNorm`;
    no heap, no recursion, bounded loops, a status for each answer. NAME.h holds the robot's constants. NAME.scl is P3
    in SCL for a Siemens PLC; no compiler has seen that one.

    Args:
        robot: The robot, with two more cables than degrees of freedom, nothing behind its frame anchors, and limits of
            its chord tensions.
        file: Where to write the source, sagline.c; the others stand beside it. Files that exist are replaced.
        single_precision: Whether numbers are `float`, for controllers that compute no others in hardware.

    Returns:
        Paths of the source, the header and the SCL text.

    Raises:
        InvalidValueError: If the source does not cover the robot, or a number of it is beyond single precision.
        FileError: If the name does not end in .c, or a file cannot be written.

    Examples:
        >>> import sagline as sl
        >>> robot = sl.load_robot("article-prototype")
        >>> source, header, scl = sl.export_c(robot, "sagline.c")
    """
    instance(robot, Robot, "robot")
    real = np.float32 if instance(single_precision, bool, "single_precision") else np.float64
    path = file_path(file)
    if path.suffix != ENDING:
        raise FileError(path, "is no name for C source", f"Let it end in {ENDING}: {path.stem or 'sagline'}{ENDING}.")
    check_exportable(robot)
    header = path.with_suffix(".h")
    texts = {
        path: _source("sagline.c").replace('"sagline.h"', f'"{header.name}"'),
        header: header_text(robot, real),
        path.with_suffix(".scl"): _source("sagline.scl"),
    }
    with written_together(path.parent, [place.name for place in texts]) as partials:
        for partial, text in zip(partials, texts.values(), strict=True):
            partial.write_text(text, encoding="utf-8", newline="\n")
    source, beside, scl = texts
    return source, beside, scl


def check_exportable(robot: Robot) -> None:
    """Refuse a robot that `sagline.c` does not cover.

    Args:
        robot: The robot.

    Raises:
        InvalidValueError: If it has not two redundant cables, anything behind its frame anchors, or limits of other
            tensions than the chords'.
    """
    n, m = robot.degrees_of_freedom, robot.cable_count
    if m != n + REDUNDANT:
        step = "Plan with sagline on a PC, and send the controller lengths."
        raise InvalidValueError(
            f"{robot.name}: number of cables", m, f"{n + REDUNDANT} ({n} freedoms and {REDUNDANT})", step
        )
    winches = robot.winches
    if winches is not None:
        _without(robot, "guides", "" if winches.guides is None else "given", "none")
        _without(robot, "pulley_radius", _first(winches.pulley_radius), "0 for all")
        _without(robot, "dead_cable", _first(winches.dead_cable), "0 for all")
    if robot.tension_limits_of != "chord":
        step = "Give limits of the chord tensions; they differ by half the cable's weight at most."
        raise InvalidValueError(f"{robot.name}: tension_limits_of", robot.tension_limits_of, "chord", step)


def header_text(robot: Robot, real: type[np.floating]) -> str:
    """The header of a robot.

    Args:
        robot: The robot.
        real: float64 or float32.

    Returns:
        C99.

    Raises:
        InvalidValueError: If a number is beyond the precision.
    """
    cables = robot.cables
    constants: dict[str, Array | float] = {
        "mass": robot.mass,
        "gravity": robot.gravity,
        "center_of_mass": robot.center_of_mass,
        "frame_anchors": robot.frame_anchors,
        "levers": robot.platform_anchors - robot.center_of_mass,
        "weight": cables.linear_density * robot.gravity,
        "stiffness": cables.axial_stiffness,
        "tension_min": robot.tension_min,
        "tension_max": robot.tension_max,
        "freedom": robot.freedom,
    }
    words = {name: _literal(np.asarray(value), name, real) for name, value in constants.items()}
    words |= {
        "name": "".join(x if x.isascii() and (x.isalnum() or x in " -_.,()") else "_" for x in robot.name),
        "version": version("sagline"),
        "precision": _PRECISIONS[real],
        "cables": str(robot.cable_count),
        "freedoms": str(robot.degrees_of_freedom),
    }
    text = _source("sagline.h")
    for word, value in words.items():
        text = text.replace(f"@{word}@", value)
    return text


def _source(name: str) -> str:
    return (_SOURCES / name).read_text(encoding="utf-8")


def _literal(values: Array, name: str, real: type[np.floating]) -> str:
    """A constant of C, or braces of them; each reads back as the same number."""
    if values.ndim:
        lines = [_literal(value, name, real) for value in values]
        return _braces(lines, ", \\\n    " if values.ndim > 1 else ", ")
    with np.errstate(over="ignore", under="ignore"):
        number = real(values)
    if np.isinf(number) and np.isinf(values):
        return "INFINITY" if number > 0.0 else "-INFINITY"
    if not np.isfinite(number) or (number == 0.0) != (values == 0.0):
        step = "Export it in double precision."
        raise InvalidValueError(
            name, f"{float(values):g}", f"{np.finfo(real).tiny:.0e} to {np.finfo(real).max:.0e}", step
        )
    return f"{number!s}{'F' if real is np.float32 else ''}"


def _braces(words: Iterable[str], between: str) -> str:
    return f"{{{between.join(words)}}}"


def _first(values: Array) -> str:
    """The first value that is not zero, and of which cable; empty if all are."""
    where = np.flatnonzero(values)
    return f"{values[where[0]]:g} m at cable {where[0]}" if where.size else ""


def _without(robot: Robot, field: str, found: str, allowed: str) -> None:
    """Refuse what is behind the frame anchors."""
    if found:
        step = "The exported source knows none: plan with sagline on a PC, and send the controller lengths."
        raise InvalidValueError(f"{robot.name}: {field}", found, allowed, step)
