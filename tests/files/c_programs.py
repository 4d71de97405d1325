"""C sources of robots, compiled as shared libraries and called with arrays."""

from __future__ import annotations

import ctypes
import re
import shutil
import subprocess
from collections.abc import Sequence
from functools import cache
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np
import pytest

import sagline as sl
from sagline.core.arrays import Array

STRICT: Final = ("-std=c99", "-pedantic", "-Wall", "-Wextra", "-Werror")
EXACT: Final = ("-fno-math-errno", "-fno-trapping-math", "-ffp-contract=off")  # docs/contributing/c-kernels.md
SOLVED, INFEASIBLE, SINGULAR, TOO_SLACK, NOT_CONVERGED, NO_CHORD, BAD_INPUT = 0, 1, 2, 3, 4, 5, 9
FORWARD: Final = 10  # added to the codes of ForwardStatus that are not zero


@cache
def compiler() -> str:
    """The C compiler; a machine without one fails, because no other test checks the source."""
    found = shutil.which("gcc") or shutil.which("cc")
    if found is None:
        pytest.fail("no C compiler: install gcc (apt-get install gcc libc6-dev)", pytrace=False)
    return found


def compiled(source: Path, target: Path, *options: str, command: Sequence[str] = ()) -> Path:
    """A compiled source, with strict flags and warnings as errors."""
    words = [*(command or (compiler(),)), *STRICT, *EXACT, *options, str(source), "-o", str(target)]
    done = subprocess.run([*words, "-lm"] if "-c" not in options else words, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert not done.stderr, done.stderr
    return target


class Results(NamedTuple):
    """Status, chord tensions [N], and lengths [m] or pose rows, of poses or samples."""

    status: Array
    tension: Array
    found: Array


class Program:
    """C source of one robot."""

    def __init__(self, robot: sl.Robot, folder: Path, *options: str, single: bool = False, **asked: Any) -> None:
        source, _, _ = sl.export_c(robot, folder / "sagline.c", single_precision=single, **asked)
        promotion = ("-Wdouble-promotion",) if single else ()
        flags = ("-shared", "-fPIC", "-Wshadow", *promotion, *(options or ("-O1",)))
        self.library = ctypes.CDLL(str(compiled(source, folder / "sagline.so", *flags)))
        self.kind = np.float32 if single else np.float64
        self.cables = robot.cable_count
        self.work = ctypes.create_string_buffer(1 << 18)

    def inverse(self, pose: sl.Pose, wrench: Array | None = None, method: int = 0, *, follow: bool = False) -> Results:
        """Poses one by one; with `follow`, each is nearest to the tensions of the previous pose."""
        count = len(pose)
        status, tension = np.zeros(count, int), np.full((count, self.cables), np.nan, self.kind)
        length, previous = tension.copy(), np.full(self.cables, np.nan, self.kind)
        rows = np.hstack((pose.position, pose.quaternion)).astype(self.kind)
        for p, row in enumerate(rows):
            before = previous.ctypes if follow else None
            results = (length[p].ctypes, tension[p].ctypes)
            status[p] = self.library.sagline_inverse(
                self.work, method, row.ctypes, self._load(wrench, p), before, *results
            )
        return Results(status, tension, length)

    def forward(self, lengths: Array, start: sl.Pose | None, wrench: Array | None = None) -> Results:
        """Samples one by one, each from an initial pose or by a search."""
        count = len(lengths)
        status, tension = np.zeros(count, int), np.full((count, self.cables), np.nan, self.kind)
        poses = np.full((count, 7), np.nan, self.kind)
        function = self.library.sagline_search
        if start is not None:
            function = self.library.sagline_forward
            poses[:] = np.hstack((start.position, start.quaternion))
        for p, row in enumerate(np.ascontiguousarray(lengths, self.kind)):
            results = (poses[p].ctypes, tension[p].ctypes)
            status[p] = function(self.work, row.ctypes, self._load(wrench, p), *results)
        return Results(status, tension, poses)

    def _load(self, wrench: Array | None, p: int) -> Any:
        if wrench is None:
            return None
        self.load = np.ascontiguousarray(wrench[p], self.kind)
        return self.load.ctypes


class Sizes(NamedTuple):
    """Sizes of an object file [bytes]; the stack is that of the deepest chain of calls without the C library."""

    code: int
    constants: int
    variables: int
    stack: int


CORES: Final = {
    "Cortex-M4F": ("-mcpu=cortex-m4", "-mfpu=fpv4-sp-d16"),  # single precision in hardware
    "Cortex-M7": ("-mcpu=cortex-m7", "-mfpu=fpv5-d16"),  # double precision as well
}


def arm_sizes(source: Path, core: str, *options: str) -> Sizes:
    """Sizes of a source for an ARM core, by arm-none-eabi-gcc."""
    target = source.with_suffix(".o")
    flags = (*CORES[core], "-mthumb", "-mfloat-abi=hard", "-fcallgraph-info=su", *(options or ("-Os",)), "-c")
    compiled(source, target, *flags, command=["arm-none-eabi-gcc"])
    printed = subprocess.run(["size", "-A", str(target)], check=True, capture_output=True, text=True).stdout
    sections = [(name, int(size)) for name, size in re.findall(r"^\.(\w+)\S*\s+(\d+)", printed, re.MULTILINE)]
    code, constants, data, zeros = (
        sum(size for name, size in sections if name == kind) for kind in ("text", "rodata", "data", "bss")
    )
    return Sizes(code, constants, data + zeros, deepest_stack(target.with_suffix(".ci").read_text()))


def deepest_stack(graph: str) -> int:
    """Largest sum of stack frames along a chain of calls, from a call graph of gcc."""
    frames = {name: int(size) for name, size in re.findall(r'node: \{ title: "(\S+)" .*\\n(\d+) bytes', graph)}
    calls: dict[str, set[str]] = {}
    for caller, called in re.findall(r'edge: \{ sourcename: "(\S+)" targetname: "(\S+)"', graph):
        calls.setdefault(caller, set()).add(called)

    @cache
    def depth(name: str) -> int:
        return frames.get(name, 0) + max(map(depth, calls.get(name, ())), default=0)

    return max(map(depth, frames), default=0)
