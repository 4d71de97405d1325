"""Source text for controllers: SCL for TIA Portal."""

from __future__ import annotations

import os
from importlib.metadata import version
from importlib.resources import files
from pathlib import Path
from typing import Final

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
from sagline.core.errors import FileError
from sagline.files.writing import atomic_files
from sagline.plc.blocks import BLOCKS, LAYOUT, Block, Field
from sagline.robot.robot import Robot
from sagline.twin.plc_program import FOLLOWING, TINY
from sagline.twin.start import plc_limits

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
    """Write the SCL source for the PLCs of a robot, for TIA Portal: data blocks, limits and program.

    The program accepts commands only from the controller that owns the group, and enforces the limits. Without
    commands, it slows the winches down. Its header lists the settings of the CPU. It has not been compiled yet.

    Args:
        robot: The robot used for planning; its winches need drum_radius and counts_per_turn.
        file: Path of the output, for example plc.scl. An existing file is replaced.

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
    path = checked_name(file, ".scl", "an SCL source", "plc")
    text = source_text(robot)
    with atomic_files(path.parent, [path.name]) as partials:
        partials[0].write_text(text, encoding="utf-8", newline="\r\n")
    return path


def source_text(robot: Robot) -> str:
    """Compose the SCL source of a robot; raise InvalidValueError if data of the winches are missing."""
    return filled("scl/sagline_plc.scl", {"stop": STOP, **_words(robot)})


def _words(robot: Robot) -> dict[str, str]:
    limits = plc_limits(robot)
    words = {
        **origin(robot),
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
    """SCL text of a data block. The rows have the order of the block, for non-optimized access in TIA Portal."""
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
    """Number in SCL syntax; a large finite number replaces infinity."""
    text = repr(min(value, 1e300)).upper()
    return text if "." in text else text.replace("E", ".0E")


def checked_name(file: str | os.PathLike[str], ending: str, what: str, usual: str) -> Path:
    """Check the path `file` of a source file; raise FileError if its suffix is not `ending`."""
    path = file_path(file)
    if path.suffix != ending:
        raise FileError(
            path, f"is not a valid name for {what}", f"Let it end in {ending}: {path.stem or usual}{ending}."
        )
    return path


def filled(source: str, words: dict[str, str]) -> str:
    """Read a text file of this package, and replace each @word@ in the given order."""
    text = files("sagline.files").joinpath(source).read_text(encoding="utf-8")
    for word, value in words.items():
        text = text.replace(f"@{word}@", value)
    return text


def origin(robot: Robot) -> dict[str, str]:
    """Replacements for the robot's name and the version of sagline. The name is made ASCII and cannot end a comment."""
    name = "".join(x if x.isascii() and (x.isalnum() or x in " -_.,()") else "_" for x in robot.name)
    return {"name": name, "version": version("sagline")}
