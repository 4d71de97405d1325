"""Capacity margin of a pose: distance to the faces of the available wrench set.

The wrenches of all tensions within their limits form a zonotope. Each face of the zonotope is parallel to n - 1 columns
of the structure matrix. The force part of a face normal has length 1. With this scale, the distance to a face is the
smallest extra force that reaches the face.

Source:
    Bouchard, Gosselin & Moore 2010, "On the ability of a cable-driven robot to generate a prescribed set of
    wrenches"; Guay, Cardou, Cruz-Ruiz & Caro 2014, "Measuring how well a structure supports varying external
    wrenches" (the capacity margin).
"""

from __future__ import annotations

import math

from sagline.core.arrays import Array, Indices
from sagline.kernels.algebra.factors import dot, norm, normalize_row, orthogonalize_row
from sagline.kernels.jit import formula, glue, kernel
from sagline.kernels.memory import Memory, block, counters

MOST_FACES = 1 << 40  # largest number of passes of the loop, which is never reached
ALONG = 1e-13  # a column with a smaller component along the unit normal lies in the face
# least share of a column's squared length outside the span of the others
DEPENDENT = 1e-20


@glue
def _next_choice(chosen: Indices, m: int) -> int:
    """Replace the combination `chosen` by the next one. Returns the first changed position, or -1 after the last."""
    count = chosen.size
    place = -1
    for k in range(count):
        if chosen[k] < m - count + k:
            place = k
    if place >= 0:
        chosen[place] += 1
        for j in range(place + 1, count):
            chosen[j] = chosen[j - 1] + 1
    return place


@glue
def _extend_frame(matrix: Array, chosen: Indices, first: int, frame: Array, triangle: Array) -> int:
    """Add the columns `chosen[first:]` to the frame (n, n). Returns the number of rows of the frame."""
    # A column that depends linearly on the columns before it adds no row.
    n = matrix.shape[0]
    held = first
    for c in range(first, chosen.size):
        size = 0.0
        for k in range(n):
            frame[c, k] = matrix[k, chosen[c]]
            size += frame[c, k] * frame[c, k]
        square = orthogonalize_row(frame, c, triangle)
        if not square > DEPENDENT * size:
            break
        normalize_row(frame, c, triangle, square)
        held = c + 1
    return held


@glue
def _complete_frame(frame: Array, triangle: Array) -> None:
    """Fill the last row of a frame (n, n), which is perpendicular to all other rows."""
    n = frame.shape[0]
    best = 0
    least = math.inf
    for k in range(n):
        covered = dot(frame[: n - 1, k], frame[: n - 1, k])
        if covered < least:
            least, best = covered, k
    for k in range(n):
        frame[n - 1, k] = 1.0 if k == best else 0.0
    normalize_row(frame, n - 1, triangle, orthogonalize_row(frame, n - 1, triangle))


@formula
def _zonotope_reach(matrix: Array, low: Array, high: Array, normal: Array) -> tuple[float, float]:
    """Largest values of normal . J t and of -normal . J t over all tensions t within their limits; may be infinite."""
    forward = backward = 0.0
    for i in range(matrix.shape[1]):
        along = dot(normal, matrix[:, i])
        least = along * low[i]
        most = along * high[i] if abs(along) > ALONG else least
        forward += max(least, most)
        backward -= min(least, most)
    return forward, backward


@kernel
def zonotope_margin(matrix: Array, needed: Array, low: Array, high: Array, translations: int, memory: Memory) -> float:
    """Largest force [N] that can be added to `needed` in every direction. Negative if `needed` is infeasible."""
    # matrix: Structure matrix along the free motions, translations first, (n, m).
    # needed: Wrench to supply, in the same rows, (n,).
    # low: Smallest allowed tensions (m,).
    # high: Largest allowed tensions (m,), may be infinite.
    # translations: Number of rows of the matrix that are force components.
    # memory: Work memory.
    n, m = matrix.shape
    frame, memory = block(memory, n, n)
    triangle, memory = block(memory, n, n)
    chosen, memory = counters(memory, n - 1)
    for c in range(n - 1):
        chosen[c] = c
    normal = frame[n - 1]
    least = math.inf
    held = 0  # number of chosen columns in the frame
    for _ in range(MOST_FACES):
        held = _extend_frame(matrix, chosen, held, frame, triangle)
        if held == n - 1:
            _complete_frame(frame, triangle)
            along, force = dot(normal, needed), norm(normal[:translations])
            if force > 1e-9:
                forward, backward = _zonotope_reach(matrix, low, high, normal)
                least = min(least, (forward - along) / force, (backward + along) / force)
        changed = _next_choice(chosen, m)
        if changed < 0:
            break
        held = min(held, changed)
    return least
