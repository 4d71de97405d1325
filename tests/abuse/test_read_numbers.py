"""Each number in each kind of file in unusual notations: refused, or read with the written value."""

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from sagline import SaglineError
from tests.abuse.reading import READERS, Reader, judged, sound

NUMBER = re.compile(r"(?<![\w.\"-])-?\d+(?:\.\d+)?(?:e-?\d+)?(?![\w.])|(?<=\")-?\d+(?:\.\d+)?(?:e\d+)?(?=\")")
NO_NUMBERS = (
    *("1:30", "1:30:00", "1_000", "0x10", "0o17", "0b101", "1e", "e5", ".", "-", "+", "+-1", "--1", "1-", "1.2.3"),
    *("yes", "no", "on", "off", "true", "False", "null", "~", "nan", ".nan", ".NaN", "-nan", "NaN(1)", "inf.", "∞"),
    *("٣", "１２", "𝟙", "²", "½", "Ⅷ", "1\u00a0000", "1 000", "1'000", "1/3", "2020-01-01", "1+1j", "1d3", "1f", "1L"),
    *("1,5", "1;5", "5 kg/m*", "5 /s", "5 m^", "5 m**9**9", "5 m^99", "5 (m)", "5 %", "$5", "5 none", "5 m 5", "=1"),
    *("9" * 5000, "1e" + "9" * 400, "5 " + "m*" * 3000 + "m", "5 " + "m " * 3000, "5" + "x" * 9999),
    *("1e308", "1e400", "-1e400", "1e60", "\\x31", "&#49;;", "!!int 0x1", "{}", "[1", "'1", "<b/>", "$HOME", "%s"),
)  # fmt: skip
NUMBERS = (
    "010",
    "+3",
    "3.",
    ".5",
    "5e-1",
    "00",
    "-0",
    "1E0",
    "0.30000000000000004",
    "1e-320",
    "1e-18",
    "1e-9",
    "0." + "0" * 500,
)


# in a program, "5 m 5" has two words, and "1;5" a comment: see tests/files/test_gcode_refusals.py
TABLES = [reader for reader in READERS if reader.name != "part.ngc"]


def places(sample: str) -> list[tuple[int, int]]:
    """Positions of the numbers in a sample, except in names and in the header."""
    head = sample.index("\n") + 1 if sample.startswith("<?xml") else 0
    return [found.span() for found in NUMBER.finditer(sample, head)]


def cases(count: int, words: tuple[str, ...]) -> list[tuple[Reader, int, int, str]]:
    rng = np.random.default_rng(20260110)
    chosen = []
    for k in range(count):
        reader = TABLES[k % len(TABLES)]
        spans = places(reader.sample)
        start, end = spans[int(rng.integers(len(spans)))]
        chosen.append((reader, start, end, words[int(rng.integers(len(words)))]))
    return chosen


def numbers_of(found: Any) -> set[float]:
    """All numbers of a result."""
    robot = getattr(found, "robot", found)
    slots = getattr(robot, "__slots__", None)
    values = list(found) if isinstance(found, tuple) else [getattr(robot, name) for name in slots or ()]
    numbers: set[float] = set()
    for value in values:
        if isinstance(value, float | np.ndarray):
            numbers |= set(np.ravel(value).tolist())
        elif value is not None and getattr(value, "__slots__", None):
            numbers |= numbers_of(value)
    return numbers


@pytest.mark.parametrize("count", [180, pytest.param(4000, marks=pytest.mark.soak)])
def test_text_that_is_not_a_number_is_refused(count: int, tmp_path: Path) -> None:
    for reader, start, end, word in cases(count, NO_NUMBERS):
        text = reader.sample[:start] + word + reader.sample[end:]
        what = f"{reader.name} with {word[:40]!r} at {start} for {reader.sample[start:end]}"
        found = judged(lambda: reader.read(reader.written(tmp_path, text.encode())), what)  # noqa: B023
        if not isinstance(found, SaglineError):
            good = numbers_of(reader.read(reader.written(tmp_path, reader.sample.encode())))
            assert numbers_of(found) <= good, f"{what}: read as something"
            sound(found, what)


@pytest.mark.parametrize("count", [60, pytest.param(1000, marks=pytest.mark.soak)])
def test_valid_notations_of_a_number_are_read_exactly(count: int, tmp_path: Path) -> None:
    for reader, start, end, word in cases(count, NUMBERS):
        text = reader.sample[:start] + word + reader.sample[end:]
        what = f"{reader.name} with {word!r} at {start} for {reader.sample[start:end]}"
        found = judged(lambda: reader.read(reader.written(tmp_path, text.encode())), what)  # noqa: B023
        if not isinstance(found, SaglineError):
            sound(found, what)


def test_the_samples_are_valid(tmp_path: Path) -> None:
    for reader in READERS:
        found = judged(lambda: reader.read(reader.written(tmp_path, reader.sample.encode())), reader.name)  # noqa: B023
        assert not isinstance(found, SaglineError), str(found)
        sound(found, reader.name)
        assert reader not in TABLES or len(places(reader.sample)) > 5
