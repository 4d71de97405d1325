"""Bounds of operations and work memory: small functions counted by hand, and the memory of the inverse kernel."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest

import sagline as sl
from sagline.core.arrays import Array as Floats
from sagline.kinematics.inverse_rows import InverseRows
from sagline.statics.tables import pose_rows, robot_terms
from sagline.tension.method import kernel_options
from tools.translate import portable
from tools.translate.bounds import Bounds
from tools.translate.extents import CABLES, FREEDOMS, Array, Int, Other, Value, evaluated, exactly
from tools.translate.types import TranslationError


class Pair(NamedTuple):
    """A record."""

    first: Floats
    size: int


def sum_of_squares(values: Floats) -> float:
    total = 0.0
    for i in range(values.size):
        total += values[i] * values[i]
    return total


def triangle(matrix: Floats) -> None:
    for i in range(matrix.shape[0]):
        for j in range(i, matrix.shape[1]):
            matrix[i, j] = 2.0 * matrix[i, j]


def dearer_side(values: Floats, some: bool) -> float:
    if some:
        return sum_of_squares(values) / 2.0
    return float(values[0] + 1.0)


def never(values: Floats, some: bool | None) -> float:
    pair = Pair(values, 3)
    if some is not None and pair.size == 3:
        return sum_of_squares(pair.first)
    return pair.first[0] * 2.0 if pair.size == 3 else sum_of_squares(values)


def found_count(values: Floats) -> float:
    count = 0
    for i in range(values.size):
        if values[i] > 0.0:
            count += 1
    total = 0.0
    for k in range(count):
        total += values[k]
    return total


def part(values: Floats) -> float:
    return sum_of_squares(values[2:]) + sum_of_squares(values[:3])


def without_bound(values: Floats) -> float:
    while values[0] > 1.0:
        values[0] = values[0] / 2.0
    return float(values[0])


def hidden_count(values: Floats) -> float:
    total = 0.0
    for _ in range(int(values[0])):
        total += 1.0
    return total


ROW = Array((exactly(CABLES),), True)
SQUARE = Array((exactly(FREEDOMS), exactly(CABLES)), True)
ANY = Other("flag")


@pytest.mark.parametrize(
    ("function", "arguments", "operations"),  # for n = 6, m = 8
    [
        (sum_of_squares, (ROW,), 16),
        (triangle, (SQUARE,), 6 * 8),  # rows have the length of the longest row
        (dearer_side, (ROW, ANY), 17 + 1),  # statements after a return are added
        (dearer_side, (ROW, Other("flag", False)), 1),
        (never, (ROW, Other("none")), 1),
        (never, (ROW, ANY), 16),
        (found_count, (ROW,), 8),
        (part, (ROW,), 2 * 8 + 2 * 3 + 1),  # a difference with a constant counts as the minuend
    ],
)
def test_operations_are_counted(function: Any, arguments: tuple[Value, ...], operations: int) -> None:
    _, cost = Bounds().call(function, arguments)
    assert evaluated(cost, 6, 2) == operations


@pytest.mark.parametrize(("function", "word"), [(without_bound, "while"), (hidden_count, "int(values[0])")])
def test_a_loop_without_a_bound_is_refused(function: Callable[..., Any], word: str) -> None:
    with pytest.raises(TranslationError) as caught:
        Bounds().call(function, (ROW,))  # type: ignore[arg-type]
    assert word in caught.value.construct
    assert Path(caught.value.file).name == "test_bounds.py"


def test_an_integer_keeps_its_bounds() -> None:
    def least(values: Floats, count: int) -> int:
        return min(count, values.size) - 1

    result, _ = Bounds().call(least, (ROW, Int()))  # type: ignore[arg-type]
    assert isinstance(result, Int)
    assert result.high is not None
    assert evaluated(result.high, 6, 2) == 7


@pytest.mark.parametrize("name", ["article-prototype", "falcon-7"])
def test_the_inverse_kernel_needs_all_of_its_memory(name: str) -> None:
    """The stated number of elements is sufficient, and one element less is not."""
    from sagline.kernels.inverse.poses import inverse_poses

    robot = sl.load_robot(name)
    m, n = robot.cable_count, robot.degrees_of_freedom
    data = json.loads((Path(__file__).parents[2] / portable.FILE).read_text(encoding="utf-8"))
    stated = data["bounds"]["inverse_nearest"]["0"]
    numbers, counters = (
        sum(value * n**i * (m - n) ** j for i, j, value in stated[kind]) for kind in ("numbers", "counters")
    )
    pose = pose_rows(sl.Pose.from_euler(robot.frame_anchors.mean(axis=0), 0.0, 0.0, 0.0))
    found = InverseRows.empty(robot, 1)
    given = (*kernel_options(robot, sl.Catenary(), sl.MinimumNorm()), robot_terms(robot), pose, np.zeros((1, 6)))

    def solve(size: int, count: int) -> None:
        memory = (np.empty(size), np.empty(count, dtype=np.int64))
        inverse_poses(*given, np.full(m, np.nan), memory, None, None, found.answers, 0, 1)

    solve(numbers, counters)
    assert numbers < 100 * m
    for size, count in ((numbers - 1, counters), (numbers, counters - 1)):
        with pytest.raises(ValueError, match=r"size|memory"):
            solve(size, count)
