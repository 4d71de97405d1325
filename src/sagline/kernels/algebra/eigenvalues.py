"""Smallest eigenvalue of a small symmetric matrix, and an upper bound of its largest eigenvalue."""

from __future__ import annotations

import math

from sagline.core.arrays import Array
from sagline.kernels.jit import formula, kernel

STEPS = 100
STILL = 1e-16  # relative to the largest eigenvalue; a shorter step is smaller than the rounding error


@formula
def _tridiagonalize(matrix: Array, diagonal: Array, beside: Array, vector: Array) -> None:
    """Reduce `matrix` to tridiagonal form (Householder). Fills `diagonal` and `beside`, (n,); overwrites `matrix`."""
    n = matrix.shape[0]
    product = diagonal  # used as work memory; the diagonal is filled at the end
    for k in range(n - 2):
        square = 0.0
        for i in range(k + 1, n):
            vector[i] = matrix[i, k]
            square += vector[i] * vector[i]
        rest = square - vector[k + 1] * vector[k + 1]
        if rest == 0.0:
            beside[k] = vector[k + 1]
            continue
        head = -math.copysign(math.sqrt(square), vector[k + 1])
        beside[k] = head
        vector[k + 1] -= head
        factor = 2.0 / (rest + vector[k + 1] * vector[k + 1])
        along = 0.0
        for i in range(k + 1, n):
            total = 0.0
            for j in range(k + 1, n):
                total += matrix[i, j] * vector[j]
            product[i] = factor * total
            along += product[i] * vector[i]
        for i in range(k + 1, n):
            product[i] -= 0.5 * factor * along * vector[i]
        for i in range(k + 1, n):
            for j in range(k + 1, n):
                matrix[i, j] -= vector[i] * product[j] + product[i] * vector[j]
    for k in range(n):
        diagonal[k] = matrix[k, k]
    if n > 1:
        beside[n - 2] = matrix[n - 1, n - 2]
    beside[n - 1] = 0.0


@formula
def _gershgorin_bound(diagonal: Array, beside: Array, sign: float) -> float:
    """Lower bound of the eigenvalues of `sign` T, by Gershgorin's circles. T is tridiagonal."""
    low = math.inf
    before = 0.0
    for k in range(diagonal.shape[0]):
        after = abs(beside[k])
        low = min(low, sign * diagonal[k] - before - after)
        before = after
    return low


@kernel
def _lowest_eigenvalue(diagonal: Array, beside: Array, sign: float) -> float:
    """Smallest eigenvalue of `sign` T, by Laguerre's iteration from below. T is tridiagonal.

    The product of the pivots q of the shifted matrix is its characteristic polynomial. All pivots are positive below
    the smallest root. The iteration never passes this root.
    """
    n = diagonal.shape[0]
    root = _gershgorin_bound(diagonal, beside, sign)
    size = max(abs(root), abs(_gershgorin_bound(diagonal, beside, -sign)))
    for _ in range(STEPS):
        first, second = 0.0, 0.0  # sums of 1/(l - root), 1/(l - root)^2 over the eigenvalues l
        carried, slope, bend = 0.0, 0.0, 0.0  # b^2/q, and derivatives with respect to the shift: q'/q, q''/q
        for k in range(n):
            pivot = sign * diagonal[k] - root - carried
            if not pivot > 0.0:
                return root
            inverse = 1.0 / pivot
            bend = carried * (bend - 2.0 * slope * slope) * inverse
            slope = (carried * slope - 1.0) * inverse
            first -= slope
            second += slope * slope - bend
            carried = beside[k] * beside[k] * inverse
        change = n / (first + math.sqrt(max((n - 1.0) * (n * second - first * first), 0.0)))
        root += change
        if not change > STILL * size:
            break
    return root


@kernel
def extreme_eigenvalues(matrix: Array, diagonal: Array, beside: Array, work: Array, flat: float) -> tuple[float, float]:
    """Smallest and largest eigenvalue of a symmetric matrix (n, n). All arrays are overwritten.

    The largest eigenvalue has an upper bound, which is at most three times as large. If |smallest| exceeds `flat` times
    this bound, the bound is returned instead of the largest eigenvalue. This takes less time.
    """
    _tridiagonalize(matrix, diagonal, beside, work)
    low = _lowest_eigenvalue(diagonal, beside, 1.0)
    bound = -_gershgorin_bound(diagonal, beside, -1.0)
    if abs(low) > flat * abs(bound):
        return low, bound
    return low, -_lowest_eigenvalue(diagonal, beside, -1.0)
