"""The feasible point nearest to a target, for any number of redundant cables: a dual active-set method.

Starting from the target itself, rows that are missed are added one by one, and rows that push the wrong way are
dropped, until all are kept. docs/model.md, section 5; for two redundant cables or fewer the polygon is quicker.
"""

from __future__ import annotations

import math

import numpy as np

from sagline.arrays import Array, Indices
from sagline.kernels.algebra.linear import most_violated
from sagline.kernels.jit import kernel

EXCHANGES = 2000
DEPENDENT = 1e-10  # a row that leaves less than this of itself outside the span of others depends on them


@kernel
def orthonormalize(rows: Array, active: Indices, count: int, frame: Array, triangle: Array) -> None:
    """Gram-Schmidt, twice: the active rows' orthonormal frame (count, d), and the triangle that makes them of it."""
    d = frame.shape[1]
    for c in range(count):
        for k in range(d):
            frame[c, k] = rows[active[c], k]
        for b in range(c):
            triangle[b, c] = 0.0
        for _ in range(2):
            for b in range(c):
                share = 0.0
                for k in range(d):
                    share += frame[b, k] * frame[c, k]
                triangle[b, c] += share
                for k in range(d):
                    frame[c, k] -= share * frame[b, k]
        square = 0.0
        for k in range(d):
            square += frame[c, k] * frame[c, k]
        triangle[c, c] = math.sqrt(square)
        for k in range(d):
            frame[c, k] /= triangle[c, c]


@kernel
def split(rows: Array, row: int, count: int, frame: Array, triangle: Array, rest: Array, shares: Array) -> float:
    """Fill what of a row lies outside the frame (d,), and its shares of the active rows; returns the rest's square."""
    d = rest.size
    for k in range(d):
        rest[k] = rows[row, k]
    for c in range(count):
        shares[c] = 0.0
    for _ in range(2):
        for c in range(count):
            share = 0.0
            for k in range(d):
                share += frame[c, k] * rest[k]
            shares[c] += share
            for k in range(d):
                rest[k] -= share * frame[c, k]
    for c in range(count - 1, -1, -1):
        for b in range(c + 1, count):
            shares[c] -= triangle[c, b] * shares[b]
        shares[c] /= triangle[c, c]
    square = 0.0
    for k in range(d):
        square += rest[k] * rest[k]
    return square


@kernel
def project(rows: Array, sides: Array, count: int, target: Array, slack: float, point: Array) -> bool:
    """Fill the point (d,) nearest to the target that keeps every row, rows . x >= sides; False where there is none.

    Source:
        Goldfarb & Idnani 1983, with the identity as its matrix.
    """
    d = target.size
    active = np.empty(d + 1, dtype=np.int64)
    pushes = np.zeros(d + 1)
    shares = np.empty(d + 1)
    frame = np.empty((d, d))
    triangle = np.empty((d, d))
    rest = np.empty(d)
    held = 0
    for k in range(d):
        point[k] = target[k]
    for exchanges in range(EXCHANGES):
        entering = most_violated(rows, sides, count, point, slack, exchanges > EXCHANGES // 2)
        if entering < 0:
            return True
        push = 0.0
        size = 0.0
        for k in range(d):
            size += rows[entering, k] * rows[entering, k]
        for _inner in range(d + 1):
            orthonormalize(rows, active, held, frame, triangle)
            square = split(rows, entering, held, frame, triangle, rest, shares)
            leaving = -1
            first = math.inf
            for c in range(held):
                if shares[c] > 0.0 and pushes[c] / shares[c] < first:
                    first = pushes[c] / shares[c]
                    leaving = c
            full = math.inf
            if held < d and square > DEPENDENT * DEPENDENT * size:
                miss = sides[entering]
                for k in range(d):
                    miss -= rows[entering, k] * point[k]
                full = max(miss, 0.0) / square
            step = min(first, full)
            if step == math.inf:
                return False
            for c in range(held):
                pushes[c] -= step * shares[c]
            push += step
            if full < math.inf:
                for k in range(d):
                    point[k] += step * rest[k]
            if full <= first:
                active[held] = entering
                pushes[held] = push
                held += 1
                break
            for c in range(leaving, held - 1):
                active[c] = active[c + 1]
                pushes[c] = pushes[c + 1]
            held -= 1
    return False
