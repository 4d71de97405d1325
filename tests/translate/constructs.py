"""Small kernels, one for each construct of the subset, which run in Python and compile with numba."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from sagline.kernels.jit import independent

TABLE = np.array([[0.5, -1.5, 2.5], [3.0, 4.0, 5.0]])
SCALE = 3


class Pair(NamedTuple):
    """Two numbers and an array."""

    first: float
    second: float
    values: Any


def operators(x: float, y: float, i: int, j: int, out: Any) -> None:
    """Operators of numbers."""
    out[0] = x + y - 2.0 * (x - (y - 1.0))
    out[1] = -x * -y - -x
    out[2] = abs(x) + abs(-y)
    out[3] = i / 7 + x / 3
    out[4] = i // 7 + (i % 7) * 100
    out[5] = i // -7 + (i % -7) * 100
    out[6] = (i & 12) | (j ^ 5) | (1 << (j & 3)) | (i >> 2)
    out[7] = ~i
    out[8] = x**2
    out[9] = i**3
    out[10] = i * j - (i - j) // 3
    out[11] = 2**10 + 2.0**-3
    out[12] = (i > j) + (i == j) * 2
    out[13] = +x


def extremes(x: float, y: float, i: int, j: int, out: Any) -> None:
    """min, max and conversions."""
    out[0] = min(x, y)
    out[1] = max(x, y)
    out[2] = max(x, y, 1.0)
    out[3] = min(i, j)
    out[4] = max(i, j, 3)
    out[5] = max(0.0, x)
    out[6] = min(y, 0.0)
    out[7] = float(i) + bool(j)
    out[8] = int(min(max(x, -100.0), 100.0)) if x == x else 0
    out[9] = math.copysign(1.0, x) + math.copysign(2.0, y)


def comparisons(x: float, y: float, i: int, j: int, out: Any) -> None:
    """Comparisons and conditions."""
    out[0] = 1.0 if x < y else 0.0
    out[1] = 1.0 if not x >= y else 2.0 if x != y else 3.0
    out[2] = 1.0 if -1.0 < x <= y else 0.0
    out[3] = 1.0 if (x < y and i < j) or i == j else 0.0
    out[4] = 1.0 if i in (1, 2, 3) else 0.0
    out[5] = 1.0 if i not in (1, 2) and not (x > 0.0 or y > 0.0) else 0.0
    out[6] = 1.0 if math.isnan(x) or math.isinf(y) else 0.0
    out[7] = 1.0 if math.isfinite(x) and i != 0 else -1.0
    found = False
    for k in range(3):
        found = found or i == k
    out[8] = float(found)


def loops(x: float, y: float, i: int, j: int, out: Any) -> None:
    """Loops, break, continue, and the values of their variables afterwards."""
    total = 0.0
    n = min(max(i, 0), 10)
    for k in range(n):
        if k == 3:
            continue
        if k == 7:
            break
        total += k * x
    out[0] = total
    k = -1
    for k in range(2, n):  # noqa: B007
        n -= 1
    out[1] = k + 100 * n
    for k in range(6, -1, -2):
        total -= k
    out[2] = total
    count = 0
    while count < 5 and total < 100.0:
        count += 1
        total += 3
    out[3] = total + count
    for k in independent(4, 8):
        out[k] = k * x
    for d in (2, 1):
        out[3 + d] = d * y
    for value in out[:3]:
        total += value
    out[6] = total
    m = 0
    for a in range(3):
        for b in range(a, 3):
            m += a * b
    out[7] = m


def assignments(x: float, y: float, i: int, j: int, out: Any) -> None:
    """Several targets, exchanges, updates."""
    a, b = x, y
    a, b = b, a
    out[0], out[1] = a, b
    out[0], out[1] = out[1], out[0]
    c = d = x + 1.0
    out[2] = c - d
    number: float = 0
    number = number + 0.5
    out[3] = number
    e, _rest = pair_of(i, y)
    out[4] = e
    out[5] = 1.0
    out[5] += x
    out[5] *= y
    out[5] /= 3.0
    out[5] -= 1
    k = 7
    k //= 2
    k *= i
    k %= 5
    k += j
    k -= 1
    out[6] = k
    out[7] = i
    f, (g, h) = x, (y, 2)
    out[8] = f + g * h
    i = j
    out[9] = i


def pair_of(i: int, y: float) -> tuple[float, int]:
    """Two numbers; an integer becomes a float by the annotation."""
    if i > 2:
        return 1, 2
    return y, i


def views(x: float, y: float, i: int, j: int, out: Any) -> None:
    """Rows, columns, slices with bounds outside, reshape, sizes."""
    grid = out[:12].reshape((3, 4))
    for a in range(grid.shape[0]):
        row = grid[a]
        for b in range(row.size):
            row[b] = a * x + b
    column = grid[:, 1]
    column[2] = y
    part = grid[1:, 1:3]
    part[0, 1] += part[1, 0]
    out[12] = out[i:j].size + 100 * out[:i].size + 10000 * out[j:].size
    out[13] = part.shape[0] + 10 * part.shape[1] + 100 * part.size + 1000 * len(part)
    out[14:16] = 5.0
    grid[:, 3:] = y
    out[-1] = out[-4]
    fill(grid[2, 1:], x)
    out[17] = grid[min(max(i, 0), 2), 2]
    numbers = out[16:18]
    numbers[:] = x


def fill(row: Any, value: float) -> None:
    """Fill a row."""
    for k in range(row.size):
        row[k] = value


def records(x: float, y: float, i: int, j: int, out: Any) -> None:
    """NamedTuples, tuples, stars, constants."""
    pair = Pair(i, y, out[:4])
    out[4] = pair.first + weigh(pair)
    out[5] = weigh(Pair(*(1.0, 2.0), out[1:3]))
    both = (x, y) + (i,)  # noqa: RUF005
    out[6] = both[0] + both[2] + both[-1]
    three = (x, y, 1.0)
    out[7] = three[min(max(i, 0), 2)]
    out[8] = TABLE[1, 2] + TABLE[min(max(i, 0), 1), 0] + SCALE
    row = TABLE[1]
    out[9] = row[1] + TABLE.shape[1]
    out[10] = math.pi + math.inf
    other = pair if i > 0 else Pair(x, x, out[4:5])
    out[11] = other.second + other.values.size
    if pair.values.size == 4 and out[0] is not None:
        out[12] = 1.0


def weigh(pair: Pair) -> float:
    """Weigh a pair and write to its array."""
    pair.values[0] = 9.0
    return 2.0 * pair.second


def order(x: float, y: float, i: int, j: int, out: Any) -> None:
    """A call changes an array: operands to the right see the change, operands to the left do not."""
    out[0] = x
    out[1] = out[0] + change(out, 2.0) * out[0]
    out[2] = change(out, 3.0) - change(out, 4.0) * out[0]
    out[3] = y
    out[4] = 1.0 if out[3] > 0.0 and change(out, 5.0) > 0.0 and out[0] == 5.0 else out[0]
    out[5] = out[0]
    out[5] += change(out[5:], 8.0)
    a, b = out[0], change(out, 6.0)
    out[6], out[7] = a, b
    if x > 0.0 or change(out, 7.0) > 100.0:
        out[8] = out[0]
    elif y > 0.0:
        out[8] = -1.0
    else:
        out[8] = -2.0
    out[10] = Pair(change(out, 11.0), out[0], out[:1]).second
    out[11] = (change(out, 12.0), 1.0)[1] + out[0]
    t_1 = change(out, 13.0) + out[0]
    out[12] = t_1
    while change(out, out[0] + 1.0) < 40.0:
        out[9] += 1.0


def change(values: Any, value: float) -> float:
    """Write an element and return its double."""
    values[0] = value
    return 2.0 * value


def functions(x: float, y: float, i: int, j: int, out: Any) -> None:
    """Functions of math."""
    z = min(abs(x), 5.0) if x == x else 1.0
    out[0] = math.sqrt(z) + math.exp(-z) + math.log(1.0 + z) + math.log1p(z)
    out[1] = math.sin(z) + math.cos(z) + math.atan2(z, 2.0) + math.hypot(z, 2.0)
    out[2] = math.sinh(z) + math.cosh(z) + math.atanh(z / 6.0)
    out[3] = math.ceil(z) + math.floor(-z) + round(z)
    out[4] = np.cbrt(z)


def remainders(x: float, y: float, i: int, j: int, out: Any) -> None:
    """Remainder and floor division of floats."""
    out[0] = x % y
    out[1] = x // y


def whole_divisions(x: float, y: float, i: int, j: int, out: Any) -> None:
    """Remainder and floor division of integers, by zero too."""
    out[0] = i // j
    out[1] = i % j


def limits(x: float, y: float, i: int, j: int, out: Any) -> None:
    """Operations that raise an exception in Python and not in compiled code."""
    out[0] = x / y
    out[1] = i / j
    out[2] = math.sqrt(x)
    out[3] = math.log(x)
    out[4] = math.log1p(x)
    out[5] = math.exp(8.0 * x)
    out[6] = math.sinh(8.0 * x)
    out[7] = math.cosh(8.0 * x)
    out[8] = math.atanh(x)
    out[9] = math.sin(x)
    out[10] = math.hypot(x, y)
    out[11] = x**-3
    out[12] = x * y - x
    out[13] = y
    out[13] /= x
    z = 1.0
    z /= x
    out[14] = z


KERNELS = (
    operators,
    extremes,
    comparisons,
    loops,
    assignments,
    views,
    records,
    order,
    functions,
    remainders,
    whole_divisions,
    limits,
)
