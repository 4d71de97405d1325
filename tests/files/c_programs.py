"""sagline.c compiled as a shared library, and called with arrays."""

from __future__ import annotations

import ctypes
import shutil
import subprocess
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest

import sagline as sl
from sagline.core.arrays import Array

STRICT = ("-std=c99", "-pedantic", "-Wall", "-Wextra", "-Werror", "-O2")
SOLVED, BAD_INPUT, DEEP_SAG, OVERSTRAINED, SINGULAR, INFEASIBLE, NOT_CONVERGED = range(7)


@cache
def compiler() -> str:
    """The C compiler; a machine without one fails, because nothing else can tell whether the source is right."""
    found = shutil.which("gcc") or shutil.which("cc")
    if found is None:
        pytest.fail("no C compiler: install gcc (apt-get install gcc libc6-dev)", pytrace=False)
    return found


def compiled(source: Path, target: Path, *options: str) -> Path:
    """A source compiled with the strict flags; a warning is an error."""
    words = [compiler(), *STRICT, *options, str(source), "-o", str(target)]
    done = subprocess.run([*words, "-lm"] if "-c" not in options else words, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert not done.stderr, done.stderr
    return target


class Poses(NamedTuple):
    """Status, chord tensions [N] and lengths [m] of poses."""

    status: Array
    tension: Array
    length: Array


class Program:
    """sagline.c of one robot."""

    def __init__(self, robot: sl.Robot, folder: Path, *, single: bool = False) -> None:
        source, _, _ = sl.export_c(robot, folder / "sagline.c", single_precision=single)
        options = ("-shared", "-fPIC", "-Wdouble-promotion", "-Wconversion", "-Wshadow")
        self.library = ctypes.CDLL(str(compiled(source, folder / "sagline.so", *options)))
        self.real: Any = ctypes.c_float if single else ctypes.c_double
        self.kind = np.float32 if single else np.float64
        self.cables = robot.cable_count

    def length(self, *cables: Array) -> tuple[Array, Array]:
        """P3 of span, rise, tension, weight and stiffness, each (N,): statuses (N,), and length and T_z (N, 2)."""
        return self._each(self.library.sagline_length, cables, (1, 1))

    def tension(self, *cables: Array) -> tuple[Array, Array]:
        """P2 of span, rise, length, weight and stiffness, each (N,): statuses (N,), and T_x, T_z, tau (N, 3)."""
        return self._each(self.library.sagline_tension, cables, (2, 1))

    def structure_matrix(self, position: Array, rotation: Array) -> Array:
        """J of a pose, (6, m)."""
        matrix = np.zeros((6, self.cables), self.kind)
        assert self.library.sagline_structure_matrix(*map(self._pointer, (position, rotation)), matrix.ctypes) == SOLVED
        return matrix

    def inverse(self, pose: sl.Pose, wrench: Array | None = None, *, follow: bool = False) -> Poses:
        """Poses one by one; follow: each stays nearest to the tensions before, which stand where it fills its own."""
        found = Poses(np.zeros(len(pose), int), *np.full((2, len(pose), self.cables), np.nan))
        tension, length = np.full((2, self.cables), -1.0, self.kind)
        followed: Any = None
        for p, (position, matrix) in enumerate(zip(pose.position, pose.matrix, strict=True)):
            load = None if wrench is None else self._pointer(wrench[p])
            found.status[p] = self.library.sagline_inverse(
                self._pointer(position), self._pointer(matrix), load, followed, tension.ctypes, length.ctypes
            )
            if found.status[p] == SOLVED:
                found.tension[p], found.length[p] = tension, length
                followed = tension.ctypes if follow else None
        return found

    def _pointer(self, values: Array) -> Any:
        array = np.ascontiguousarray(values, self.kind)
        return array.ctypes.data_as(ctypes.POINTER(self.real))

    def _each(self, function: Any, cables: tuple[Array, ...], sizes: tuple[int, int]) -> tuple[Array, Array]:
        count = len(cables[0])
        first, second = (np.full((count, size), np.nan, self.kind) for size in sizes)
        status = np.empty(count, int)
        for k, row in enumerate(np.stack(cables, axis=1).astype(self.kind)):
            status[k] = function(*map(self.real, row), first[k].ctypes, second[k].ctypes)
        return status, np.hstack((first, second)).astype(float)
