"""Damage of files (flipped bits, holes, cuts, foreign bytes), and the check that a reader detects it."""

import time
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import TypeVar

import numpy as np

import sagline as sl
from tests.effort import least_seconds

SLOWEST = 2.0  # s of processor time of an ordinary machine
LONGEST = 300  # characters of a message, which is one line
Damage = Callable[[bytearray, np.random.Generator], None]
Read = TypeVar("Read")


def flip(content: bytearray, rng: np.random.Generator) -> None:
    bit = int(rng.integers(8 * len(content)))
    content[bit // 8] ^= 1 << bit % 8


def overwrite(content: bytearray, rng: np.random.Generator) -> None:
    first, size = int(rng.integers(len(content))), int(rng.integers(1, 4096))
    last = min(len(content), first + size)
    content[first:last] = rng.bytes(last - first)


def blank(content: bytearray, rng: np.random.Generator) -> None:
    """A lost sector of a disk."""
    first = int(rng.integers(len(content) // 512)) * 512
    content[first : first + 512] = bytes(min(512, len(content) - first))


def cut(content: bytearray, rng: np.random.Generator) -> None:
    del content[int(rng.integers(len(content))) :]


def take_out(content: bytearray, rng: np.random.Generator) -> None:
    first = int(rng.integers(len(content)))
    del content[first : first + int(rng.integers(1, 64))]


def put_in(content: bytearray, rng: np.random.Generator) -> None:
    first = int(rng.integers(len(content) + 1))
    content[first:first] = rng.bytes(int(rng.integers(1, 64)))


def swap(content: bytearray, rng: np.random.Generator) -> None:
    """Exchange two numbers."""
    one, other = (8 * int(k) for k in rng.integers(len(content) // 8, size=2))
    content[one : one + 8], content[other : other + 8] = content[other : other + 8], content[one : one + 8]


DAMAGES: tuple[Damage, ...] = (flip, overwrite, blank, cut, take_out, put_in, swap)


def errors_after_damage(
    damage: Damage,
    count: int,
    content: bytes,
    file: Path,
    load: Callable[[Path], Read],
    compare: Callable[[Read], None],
) -> list[str]:
    """Errors of a reader after many damages of a file; it must return the original content or refuse the file."""
    rng = np.random.default_rng(20)
    unlike = []
    for k in range(count):
        damaged = bytearray(content)
        damage(damaged, rng)
        file.write_bytes(damaged)
        start = time.process_time()
        loaded = loaded_or_refused(load, file)
        seconds = time.process_time() - start
        if seconds > SLOWEST:
            seconds = least_seconds(lambda: loaded_or_refused(load, file), SLOWEST, seconds)
        if seconds > SLOWEST:
            unlike.append(f"case {k} took {seconds:.1f} s")
        if loaded is not None:
            assert damaged == content, f"case {k} went unnoticed"
            compare(loaded)
    return unlike


def loaded_or_refused(load: Callable[[Path], Read], file: Path) -> Read | None:
    """Content of the file, or None if the reader refuses it with one clear line."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")  # warnings are errors
        try:
            return load(file)
        except sl.SaglineError as error:
            line = str(error).replace(str(file), file.name)
            assert line.isprintable(), line
            assert len(line) < LONGEST, line
            return None
