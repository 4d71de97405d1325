"""Kernels of a shared page in node and in a native program with the same C library; both return their memory."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
from base64 import b64decode
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

import sagline as sl
from sagline.core.arrays import Array
from sagline.share.machine import model_data
from sagline.share.packing import SCRIPT
from tools.translate import wasm

TARGET: Final = "x86_64-linux-musl"
Rows = list[dict[str, list[float]]]
Images = NDArray[np.uint64]

MAIN: Final = """
#include <math.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>
{heads}
static _Alignas(16) unsigned char memory[{size}];
static const unsigned char filled[] = {{{filled}}};
int main(void) {{
    {fills}
    while (1) {{
        {reads}
        {calls}
    }}
}}
"""


def in_node(machine: dict[str, Any], rows: Rows, repeat: int | None = None) -> bytes:
    """Output of node.mjs; with `repeat`, all rows are timed repeatedly."""
    assert shutil.which("node"), "These tests need node: install it (apt-get install nodejs)."
    request = {"machine": machine, "rows": rows}
    given = json.dumps(request | ({} if repeat is None else {"repeat": repeat}))
    command = ["node", str(Path(__file__).with_name("node.mjs")), str(SCRIPT)]
    return subprocess.run(command, input=given.encode(), capture_output=True, check=True).stdout


def answers_in_node(robot: sl.Robot, pose: sl.Pose, lengths: Array) -> list[dict[str, Any]]:
    """Answers of sagline.mjs at poses, and at rest with lengths (N, m) [m] off the drums."""
    poses = np.hstack((pose.position, pose.quaternion))
    rows = [{"pose": row.tolist(), "given": given.tolist()} for row, given in zip(poses, lengths, strict=True)]
    found: list[dict[str, Any]] = json.loads(in_node(model_data(robot), rows, repeat=0))["found"]
    return found


def compiled_kernels(folder: Path) -> Path:
    """Object file of the kernels for this machine."""
    wasm.compile_c(wasm.source(), TARGET, folder / "kernels.o", "-c", "-O2")
    return folder / "kernels.o"


def linked_program(library: Path, kernels: dict[str, Any], names: tuple[str, ...], out: Path) -> Path:
    """Program that reads the named arrays of each row, and writes its memory after each call."""
    data, fills, size = bytearray(), [], kernels["size"]
    for place, text in kernels["filled"]:
        part = b64decode(text)
        fills.append(f"memcpy(memory + {place}, filled + {len(data)}, {len(part)});")
        data += part
    calls = [
        f"if (sagline_{entry}({', '.join(map(_argument, given))})) return 1; fwrite(memory, 1, {size}, stdout);"
        for entry, given in kernels["calls"].values()
    ]
    places = [kernels["arrays"][name] for name in names]
    reads = [f"if (fread(memory + {place}, 8, {count}, stdin) != {count}) return 0;" for _, place, count in places]
    parts = {"filled": ", ".join(map(str, data)), "fills": " ".join(fills), "reads": " ".join(reads)}
    heads = "\n".join(re.findall(r"^int sagline_.*;$", wasm.source(), re.MULTILINE))
    main = MAIN.format(size=size, heads=heads, calls="\n        ".join(calls), **parts)
    wasm.compile_c(main, TARGET, out, str(library))
    return out


def in_program(program: Path, rows: Rows) -> bytes:
    """Output of the program, with the names of the rows."""
    numbers: Array = np.array([[number for part in row.values() for number in part] for row in rows])
    return subprocess.run([program], input=numbers.tobytes(), capture_output=True, check=True).stdout


def patterns(output: bytes) -> Images:
    """64-bit patterns; those of NaN are equal, because WebAssembly does not define its sign and payload."""
    found = np.frombuffer(output, dtype=np.uint64).copy()
    found[np.isnan(found.view(np.float64))] = np.array(np.nan).view(np.uint64)
    return found


def _argument(given: Any) -> str:
    """An argument in C."""
    if isinstance(given, list):
        return f"(void *)(memory + {given[0]})"
    if isinstance(given, str):
        return f"INT64_C({given[:-1]})" if given.endswith("n") else {"NaN": "NAN"}.get(given, given.upper())
    return str(given).lower() if isinstance(given, bool) else float(given).hex()
