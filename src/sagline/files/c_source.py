"""Source text for controllers: C99 of a robot's kinematics, translated from the kernels, and SCL for TIA Portal."""

# When the package is built, `tools/translate/portable.py` translates the kernels in parts. The C source of a robot
# contains the parts that this robot needs, its data, and functions for the caller.

from __future__ import annotations

import json
import os
import re
from collections.abc import Sequence
from importlib.metadata import version
from importlib.resources import files
from itertools import count
from pathlib import Path
from typing import Any, Final

import numpy as np

from sagline.cables.models import Catenary
from sagline.control import link
from sagline.core.arguments import file_path, flag, instance
from sagline.core.arrays import Array
from sagline.core.errors import FileError, InvalidValueError
from sagline.files.writing import atomic_files
from sagline.kernels import codes, tables
from sagline.kernels.cable.geometry import CABLE_ROWS
from sagline.kinematics.forward import DEPTH, centered_positions
from sagline.kinematics.forward_rows import without_guides
from sagline.kinematics.status import ForwardStatus, PoseStatus
from sagline.plc.blocks import BLOCKS, LAYOUT, Block, Field
from sagline.robot.batch import has_routing
from sagline.robot.checks import ROTATING
from sagline.robot.reach import LEVEL
from sagline.robot.robot import Robot
from sagline.statics.tables import body_table, cable_table
from sagline.tension.method import Options, TensionMethod, kernel_options, takes_default_kernel
from sagline.tension.methods import DEFAULT, method_of
from sagline.twin.hardware import plc_limits
from sagline.twin.plc_program import FOLLOWING, TINY

KERNELS: Final = "c/kernels.json"
BAD_INPUT: Final = 9
FORWARD_STATUS: Final = 10  # offset that is added to the status codes of the forward kernel
COMMENT: Final = re.compile(r"/\*.*?\*/", re.DOTALL)


def export_c(
    robot: Robot,
    file: str | os.PathLike[str],
    *,
    tension: TensionMethod | str | Sequence[TensionMethod | str] = DEFAULT,
    forward: bool = False,
    single_precision: bool = False,
) -> tuple[Path, Path, Path]:
    """Write C99 source of a robot's kinematics for a microcontroller, and SCL source of one function for a PLC.

    NAME.c contains the data of the robot, the translated kernels of `inverse` and, if `forward` is true, the kernels of
    `forward`. The source uses no heap and no recursion, all loops are bounded, and each function returns a status.
    NAME.h declares the functions and states the bounds of their loops. NAME.scl contains the function P3 of
    docs/model.md in SCL for a Siemens PLC. The SCL source has not been compiled yet.

    Args:
        robot: The robot; its winches may have pulleys and dead lengths, but no guides.
        file: Path of the source, sagline.c; the other files are in the same folder. Existing files are replaced.
        tension: Tension distribution method, or several methods. With several methods, each call selects one of them.
        forward: True to include the forward kinematics.
        single_precision: True for numbers of type `float`, for controllers with single precision in hardware.

    Returns:
        Paths of the source, the header and the SCL text.

    Raises:
        InvalidValueError: If the winches have guides. If a method does not support the robot. If a number is too large
            for single precision.
        FileError: If the name does not end in .c, a file cannot be written, or the package was not built.

    Examples:
        >>> import sagline as sl
        >>> robot = sl.load_robot("article-prototype")
        >>> source, header, scl = sl.export_c(robot, "sagline.c")
    """
    instance(robot, Robot, "robot")
    forward = flag(forward, "forward")
    real = np.float32 if flag(single_precision, "single_precision") else np.float64
    methods = tuple(tension) if isinstance(tension, list | tuple) else (tension,)
    if not methods:
        raise InvalidValueError("tension", "empty", "a method or several", "Give a method, for example Closest().")
    chosen = [method_of(method) for method in methods]
    path = checked_name(file_path(file), ".c", "C source", "sagline")
    source, header = source_of(without_guides(robot, "export_c", "inverse"), chosen, forward, real, path.stem)
    texts = {path: source, path.with_suffix(".h"): header, path.with_suffix(".scl"): filled("c/sagline.scl", {})}
    with atomic_files(path.parent, [place.name for place in texts]) as partials:
        for partial, text in zip(partials, texts.values(), strict=True):
            partial.write_text(text, encoding="utf-8", newline="\n")
    source_path, beside, scl = texts
    return source_path, beside, scl


def source_of(
    robot: Robot, methods: Sequence[TensionMethod], forward: bool, real: type[np.floating], stem: str
) -> tuple[str, str]:
    """Compose the C99 source and header of a robot, with numbers of type float64 or float32."""
    options = [kernel_options(robot, Catenary(), method) for method in methods]
    kernels = translated_kernels()
    words = _words(robot, methods, options, real, stem)
    asked = ["inverse_nearest" if all(map(takes_default_kernel, methods)) else "inverse_by_method"]
    if forward:
        asked.append("forward_over_pulleys" if has_routing(robot) else "forward_bare")
    inverse = [_evaluated(kernels["bounds"][asked[0]][str(each.sharing[0])], robot) for each in options]
    solve = [_evaluated(kernels["bounds"][each]["0"], robot) for each in asked[1:]]
    words |= {name: str(max(each.get(name, 1) for each in inverse + solve)) for name in ("numbers", "counters")}
    words |= {
        "inverse_operations": f"{max(each['operations'] for each in inverse):,}",
        "forward_operations": f"{max((each['operations'] for each in solve), default=0):,}",
        "inverse": asked[0],
        "otherwise": "" if asked[0] == "inverse_nearest" else "true, ",
        "solve": asked[-1],
        "behind": "true, " if has_routing(robot) else "",
    }
    words["forward"] = filled("c/forward.h", words) if forward else ""
    functions = ["c/inverse.c", *(["c/forward.c"] if forward else [])]
    body = "".join(filled(name, words) for name in functions)
    source = f"{filled('c/head.c', words)}{reached_parts(kernels[words['real']], asked)}\n{body}"
    return source, filled("c/sagline.h", words)


def translated_kernels() -> dict[str, Any]:
    """Read the translated kernels in both precisions, and their bounds."""
    place = files("sagline.files").joinpath(KERNELS)
    try:
        found: dict[str, Any] = json.loads(place.read_text(encoding="utf-8"))
    except FileNotFoundError:
        step = "Build the package: python -m tools.build, in the folder of the source code."
        raise FileError(Path(str(place)), "is missing, because the package was not built", step) from None
    return found


def _evaluated(bounds: dict[str, list[tuple[int, int, int]]], robot: Robot) -> dict[str, int]:
    """Bounds of a kernel for `robot`, from polynomials in the degrees of freedom and the redundancy."""
    n, r = robot.degrees_of_freedom, robot.cable_count - robot.degrees_of_freedom
    return {name: sum(value * n**i * r**j for i, j, value in terms) for name, terms in bounds.items()}


def reached_parts(parts: list[tuple[list[str], str]], asked: Sequence[str]) -> str:
    """Select the parts that the entries `asked` need, in the order of the source."""
    owner = {name: index for index, (names, _) in enumerate(parts) for name in names}
    waiting, reached = [owner[name] for name in asked], {index for index, (names, _) in enumerate(parts) if not names}
    while waiting:
        index = waiting.pop()
        if index not in reached:
            reached.add(index)
            used = re.findall(r"[A-Za-z_]\w*", COMMENT.sub("", parts[index][1]))
            waiting += {owner[word] for word in used if word in owner}
    return "\n".join(parts[index][1] for index in sorted(reached))


def _words(
    robot: Robot, methods: Sequence[TensionMethod], options: Sequence[Options], real: type[np.floating], stem: str
) -> dict[str, str]:
    """Data and sizes for the placeholders in the text of the functions of a robot."""
    freedom, m, n = robot.freedom, robot.cable_count, robot.degrees_of_freedom
    turning = freedom[:, 3:].any(axis=1) if robot.motion_pattern in ROTATING else np.zeros(n, dtype=bool)
    rows = tables.RESULT_ROWS if has_routing(robot) else tables.BARE_ROWS
    data: dict[str, Array | float] = {
        "freedom": freedom,
        "body": body_table(robot).ravel(),
        "table": cable_table(robot)[0],
        "translations": freedom[~turning],
        "middle": centered_positions(robot, LEVEL),
        "depth": DEPTH,
    }
    return {
        **origin(robot),
        **{name: constant_text(np.asarray(value), name, real) for name, value in data.items()},
        "header": f"{stem}.h",
        "real": "float" if real is np.float32 else "double",
        "cables": str(m),
        "freedoms": str(n),
        "translations_count": str(n - int(turning.sum())),
        "methods": ", ".join(_method_names(methods)),
        "rules": ",\n    ".join(_rule(each, real) for each in options),
        "limits_of": str(options[0].limits[0]),
        "statuses": _statuses(),
        "rows": str(rows),
        "results": str(rows * m),
        "others": str(CABLE_ROWS * m + n * n + tables.LAST_COLUMNS + tables.POSE_COLUMNS + tables.FORWARD_NUMBERS),
        "cable_rows": str(CABLE_ROWS),
        "not_converged": str(codes.FORWARD_NOT_CONVERGED),
        "offset": str(FORWARD_STATUS),
    }


def _method_names(methods: Sequence[TensionMethod]) -> list[str]:
    """C name of each method: the name of its class, with a number if several methods have this class."""
    found: list[str] = []
    for method in methods:
        name = "SAGLINE" + re.sub(r"(?=[A-Z])", "_", type(method).__name__).upper()
        found.append(next(each for k in count(1) if (each := name if k == 1 else f"{name}_{k}") not in found))
    return found


def _rule(options: Options, real: type[np.floating]) -> str:
    code, parameter, variable, weights, targets = options.sharing
    numbers = (constant_text(np.asarray(value), "tension", real) for value in (parameter, options.limits[1]))
    lists = (constant_text(np.asarray(value), "tension", real) for value in (weights, targets))
    return f"{{{code}, {', '.join(numbers)}, {variable}, {', '.join(lists)}}}"


def _statuses() -> str:
    rows = [(status.name, int(status), status.text) for status in PoseStatus if int(status) < BAD_INPUT]
    rows.append(("BAD_INPUT", BAD_INPUT, "a number is not finite, a length too short, a quaternion not of length 1"))
    forward = [(f"FORWARD_{each.name}", FORWARD_STATUS + int(each), each.text) for each in ForwardStatus]
    rows += forward[codes.FORWARD_LOOSE : codes.FORWARD_NO_LENGTHS]
    return "\n".join(f"    SAGLINE_{name} = {code}, /* {text} */" for name, code, text in rows)


def constant_text(values: Array, name: str, real: type[np.floating]) -> str:
    """C text of a constant, or of a list in braces. C reads exactly the same numbers from this text."""
    if values.ndim:
        separator = ", " if values.ndim == 1 else ",\n    "
        return f"{{{separator.join(constant_text(value, name, real).strip('{}') for value in values)}}}"
    with np.errstate(over="ignore", under="ignore"):
        number = real(values)
    if np.isnan(values) or np.isinf(values):
        return "NAN" if np.isnan(values) else "INFINITY" if number > 0.0 else "-INFINITY"
    if not np.isfinite(number) or (number == 0.0) != (values == 0.0):
        allowed = f"{np.finfo(real).tiny:.0e} to {np.finfo(real).max:.0e}"
        raise InvalidValueError(name, f"{float(values):g}", allowed, "Export it in double precision.")
    return f"{number!s}{'F' if real is np.float32 else ''}"


def export_scl(robot: Robot, file: str | os.PathLike[str]) -> Path:
    """Write the SCL source for the PLCs of a robot, for TIA Portal: data blocks, limits and program.

    The program accepts commands only from the controller that owns the group, and enforces the limits. Without
    commands, the winches slow down. The header lists the settings of the CPU. The source has not been compiled yet.

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
    text = _source_text(robot)
    with atomic_files(path.parent, [path.name]) as partials:
        partials[0].write_text(text, encoding="utf-8", newline="\r\n")
    return path


def _source_text(robot: Robot) -> str:
    """Compose the SCL source of a robot; raise InvalidValueError if data of the winches are missing."""
    return filled("scl/sagline_plc.scl", {"stop": filled("scl/stop.scl", {}).rstrip(), **_scl_words(robot)})


def _scl_words(robot: Robot) -> dict[str, str]:
    limits = plc_limits(robot)
    words = {
        **origin(robot),
        "group_size": str(link.GROUP_SIZE),
        "numbers": ", ".join(str(block.number) for block in BLOCKS),
        "blocks": "\n".join(_block(block) for block in BLOCKS),
        "winches": str(robot.cable_count),
        "most_winches": str(robot.cable_count),
        "limits": "\n".join(_row(name, values) for name, values in limits._asdict().items()),
        "layout": str(LAYOUT),
        "counters": str(link.COUNTERS),
        "half": str(link.COUNTERS // 2),
        "tiny": f"{TINY:.1E}",
        "following_error": str(FOLLOWING),
        "heartbeat": str(link.HEARTBEAT),
        "owner_timeout": str(link.OWNER_TIMEOUT),
        "ramp": str(link.RAMP),
        "cycle": str(link.PERIOD),
    }
    words |= {
        f"{end}_magic": f"16#{block.magic:08X}" for end, block in zip(("from", "to", "claim"), BLOCKS, strict=True)
    }
    words |= {mode.name.lower(): str(int(mode)) for mode in link.Mode}
    words |= {f"{fault.name.lower()}_fault": str(int(fault)) for fault in link.GroupFault}
    words["emergency_fault"] = words["emergency_stop_fault"]
    words |= {f"{status.name.lower()}_bit": str(int(status)) for status in link.GroupStatus if status.name}
    words |= {f"state_{state.name.lower()}": str(int(state)) for state in link.WinchState}
    words["emergency_bits"] = str(int(link.GroupStatus.EMERGENCY | link.GroupStatus.LOCKED | link.GroupStatus.BRAKED))
    words["locked_bits"] = str(int(link.GroupStatus.READY | link.GroupStatus.LOCKED | link.GroupStatus.BRAKED))
    return words


def _block(block: Block) -> str:
    """SCL text of a data block. The rows keep the order of `block`, for non-optimized access in TIA Portal."""
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
    begin = f"{indent}{field.name} : Array[1..{link.GROUP_SIZE}] of Struct".ljust(40)
    return [f"{begin}// {field.offset}: {field.meaning}", *inside, f"{indent}END_STRUCT;"]


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
        step = f"Let it end in {ending}: {path.stem or usual}{ending}."
        raise FileError(path, f"is not a valid name for {what}", step)
    return path


def filled(source: str, words: dict[str, str]) -> str:
    """Read a text file of this package, and replace each @word@ in the given order."""
    text = files("sagline.files").joinpath(source).read_text(encoding="utf-8")
    for word, value in words.items():
        text = text.replace(f"@{word}@", value)
    return text


def origin(robot: Robot) -> dict[str, str]:
    """Replacements for robot name and version of sagline. The name is converted to ASCII and cannot end a comment."""
    name = "".join(x if x.isascii() and (x.isalnum() or x in " -_.,()") else "_" for x in robot.name)
    return {"name": name, "version": version("sagline")}
