"""Source text for controllers: SCL for TIA Portal, and C99 for microcontrollers."""

from __future__ import annotations

import os
from importlib.metadata import version
from importlib.resources import files
from pathlib import Path
from typing import Final

import numpy as np

from sagline.control.link import (
    COUNTERS,
    GROUP_SIZE,
    HEARTBEAT,
    OWNER_TIMEOUT,
    PERIOD,
    RAMP,
    GroupFault,
    GroupStatus,
    Mode,
    WinchState,
)
from sagline.core.arguments import file_path, instance
from sagline.core.arrays import Array
from sagline.core.errors import FileError, InvalidValueError
from sagline.files.writing import atomic_files
from sagline.plc.blocks import BLOCKS, LAYOUT, Block, Field
from sagline.robot.robot import Robot
from sagline.twin.plc_program import FOLLOWING, TINY
from sagline.twin.start import plc_limits

REDUNDANT: Final = 2  # redundancy (cables minus degrees of freedom) that sagline.c supports
_PRECISIONS = {
    np.float64: "typedef double sagline_real;",
    np.float32: "#define SAGLINE_FLOAT /* single precision */\ntypedef float sagline_real;",
}
STOP: Final = """\
   // slow down by itself, and hold
   IF #wanted <> 0 AND #fault = 0 THEN
      #fault := #wanted;
      #since := #now;
      FOR #i := 1 TO #count DO
         IF #going[#i] <> 0.0 AND #ramp = 0.0 THEN
            #ramp := @ramp@;
         END_IF;
      END_FOR;
   END_IF;
   #wanted := 0;"""


def export_scl(robot: Robot, file: str | os.PathLike[str]) -> Path:
    """Write the SCL source for the PLCs of a robot (TIA Portal): data blocks, limits and program.

    The program grants and withdraws control, accepts commands and enforces the limits. Without commands, it slows the
    winches down by itself. Its header lists the settings of the CPU. It has not been compiled yet.

    Args:
        robot: The robot used for planning; its winches need drum_radius and counts_per_turn.
        file: Path of the output, plc.scl for instance. A file that exists is replaced.

    Returns:
        The path.

    Raises:
        InvalidValueError: If data of the winches are missing.
        FileError: If the name does not end in .scl, or the file cannot be written.

    Examples:
        >>> import sagline as sl
        >>> path = sl.export_scl(sl.load_robot("article-prototype"), "plc.scl")
    """
    instance(robot, Robot, "robot")
    path = _checked_name(file, ".scl", "an SCL source", "plc")
    text = source_text(robot)
    with atomic_files(path.parent, [path.name]) as partials:
        partials[0].write_text(text, encoding="utf-8", newline="\r\n")
    return path


def source_text(robot: Robot) -> str:
    """SCL source of a robot; InvalidValueError if data of the winches are missing."""
    return _filled("scl/sagline_plc.scl", {"stop": STOP, **_words(robot)})


def _words(robot: Robot) -> dict[str, str]:
    limits = plc_limits(robot)
    words = {
        **_origin(robot),
        "group_size": str(GROUP_SIZE),
        "numbers": ", ".join(str(block.number) for block in BLOCKS),
        "blocks": "\n".join(_block(block) for block in BLOCKS),
        "winches": str(robot.cable_count),
        "most_winches": str(robot.cable_count),
        "limits": "\n".join(_row(name, values) for name, values in limits._asdict().items()),
        "layout": str(LAYOUT),
        "counters": str(COUNTERS),
        "half": str(COUNTERS // 2),
        "tiny": f"{TINY:.1E}",
        "following_error": str(FOLLOWING),
        "heartbeat": str(HEARTBEAT),
        "owner_timeout": str(OWNER_TIMEOUT),
        "ramp": str(RAMP),
        "cycle": str(PERIOD),
    }
    words |= {
        f"{end}_magic": f"16#{block.magic:08X}" for end, block in zip(("from", "to", "claim"), BLOCKS, strict=True)
    }
    words |= {mode.name.lower(): str(int(mode)) for mode in Mode}
    words |= {f"{fault.name.lower()}_fault": str(int(fault)) for fault in GroupFault}
    words["emergency_fault"] = words["emergency_stop_fault"]
    words |= {f"{status.name.lower()}_bit": str(int(status)) for status in GroupStatus if status.name}
    words |= {f"state_{state.name.lower()}": str(int(state)) for state in WinchState}
    words["emergency_bits"] = str(int(GroupStatus.EMERGENCY | GroupStatus.LOCKED | GroupStatus.BRAKED))
    words["locked_bits"] = str(int(GroupStatus.READY | GroupStatus.LOCKED | GroupStatus.BRAKED))
    return words


def _block(block: Block) -> str:
    """Text of a data block; its rows keep their order, as in TIA Portal without optimized access."""
    start = [f"   magic := 16#{block.magic:08X};"]
    if any(field.name == "version" for field in block.fields):
        start.append(f"   version := {LAYOUT};")
    head = [f'DATA_BLOCK "{block.name}"', "{ S7_Optimized_Access := 'FALSE' }", "VERSION : 0.1", "   STRUCT"]
    rows = [line for field in block.fields for line in _field(field, "      ")]
    tail = ["   END_STRUCT;", "BEGIN", *start, "END_DATA_BLOCK", ""]
    return "\n".join([f"// DB{block.number}, {block.size} bytes", *head, *rows, *tail])


def _field(field: Field, indent: str) -> list[str]:
    kind = field.type
    if isinstance(kind, str):
        return [f"{indent}{field.name} : {kind};".ljust(40) + f"// {field.offset}: {field.meaning}"]
    inside = [line for each in kind for line in _field(each, indent + "   ")]
    begin = f"{indent}{field.name} : Array[1..{GROUP_SIZE}] of Struct".ljust(40) + f"// {field.offset}: {field.meaning}"
    return [begin, *inside, f"{indent}END_STRUCT;"]


def _row(name: str, values: list[float]) -> str:
    return "\n".join(f"   {name}[{i + 1}] := {_scl_number(value)};" for i, value in enumerate(values))


def _scl_number(value: float) -> str:
    """A number in SCL syntax, which does not have infinite numbers."""
    text = repr(min(value, 1e300)).upper()
    return text if "." in text else text.replace("E", ".0E")


def export_c(robot: Robot, file: str | os.PathLike[str], *, single_precision: bool = False) -> tuple[Path, Path, Path]:
    """Write C99 that computes a robot's tensions and lengths on a microcontroller, and SCL of one function for a PLC.

    NAME.c is the same for every robot: the forward and inverse problem of one cable (P2 and P3 of "The model"), the
    structure matrix and the inverse kinematics of a pose, with the tension distribution of `Closest` or `MinimumNorm`.
    It uses no heap and no recursion, all loops are bounded, and each function returns a status. NAME.h holds the
    robot's constants. NAME.scl is P3 in SCL for a Siemens PLC; it has not been compiled yet.

    Args:
        robot: The robot, with two more cables than degrees of freedom, no pulleys or drums behind its frame anchors,
            and limits of its chord tensions.
        file: Path of the source, sagline.c; the other files are in the same folder. Existing files are replaced.
        single_precision: True for `float` numbers, for controllers whose hardware has only single precision.

    Returns:
        Paths of the source, the header and the SCL text.

    Raises:
        InvalidValueError: If the source does not cover the robot, or a number exceeds single precision.
        FileError: If the name does not end in .c, or a file cannot be written.

    Examples:
        >>> import sagline as sl
        >>> robot = sl.load_robot("article-prototype")
        >>> source, header, scl = sl.export_c(robot, "sagline.c")
    """
    instance(robot, Robot, "robot")
    real = np.float32 if instance(single_precision, bool, "single_precision") else np.float64
    path = _checked_name(file, ".c", "C source", "sagline")
    _check_exportable(robot)
    header = path.with_suffix(".h")
    texts = {
        path: _filled("c/sagline.c", {}).replace('"sagline.h"', f'"{header.name}"'),
        header: _header_text(robot, real),
        path.with_suffix(".scl"): _filled("c/sagline.scl", {}),
    }
    with atomic_files(path.parent, [place.name for place in texts]) as partials:
        for partial, text in zip(partials, texts.values(), strict=True):
            partial.write_text(text, encoding="utf-8", newline="\n")
    source, beside, scl = texts
    return source, beside, scl


def _check_exportable(robot: Robot) -> None:
    """Refuse a robot without two redundant cables, with parts behind its frame anchors, or with unsupported limits."""
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


def _header_text(robot: Robot, real: type[np.floating]) -> str:
    """Header of a robot in C99, with numbers of float64 or float32."""
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
    words = {name: _c_constant(np.asarray(value), name, real) for name, value in constants.items()}
    words |= {
        **_origin(robot),
        "precision": _PRECISIONS[real],
        "cables": str(robot.cable_count),
        "freedoms": str(robot.degrees_of_freedom),
    }
    return _filled("c/sagline.h", words)


def _c_constant(values: Array, name: str, real: type[np.floating]) -> str:
    """A constant in C, or a list in braces; each is read back as the same number."""
    if values.ndim:
        lines = [_c_constant(value, name, real) for value in values]
        separator = ", \\\n    " if values.ndim > 1 else ", "
        return f"{{{separator.join(lines)}}}"
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


def _first(values: Array) -> str:
    """Text of the first nonzero value and its cable; empty if all values are zero."""
    where = np.flatnonzero(values)
    return f"{values[where[0]]:g} m at cable {where[0]}" if where.size else ""


def _without(robot: Robot, field: str, found: str, allowed: str) -> None:
    """Refuse a robot with parts behind the frame anchors."""
    if found:
        step = "The exported source knows none: plan with sagline on a PC, and send the controller lengths."
        raise InvalidValueError(f"{robot.name}: {field}", found, allowed, step)


def _checked_name(file: str | os.PathLike[str], ending: str, what: str, usual: str) -> Path:
    """Path of a source file; FileError if its suffix is wrong."""
    path = file_path(file)
    if path.suffix != ending:
        raise FileError(path, f"is no name for {what}", f"Let it end in {ending}: {path.stem or usual}{ending}.")
    return path


def _filled(source: str, words: dict[str, str]) -> str:
    """Text of a file of this package, with each @word@ replaced in the given order."""
    text = files("sagline.files").joinpath(source).read_text(encoding="utf-8")
    for word, value in words.items():
        text = text.replace(f"@{word}@", value)
    return text


def _origin(robot: Robot) -> dict[str, str]:
    """Words for the robot's name and the version of sagline; the name is ASCII and cannot end a comment."""
    name = "".join(x if x.isascii() and (x.isalnum() or x in " -_.,()") else "_" for x in robot.name)
    return {"name": name, "version": version("sagline")}
