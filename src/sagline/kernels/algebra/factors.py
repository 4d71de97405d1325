"""Small dense matrices: Cholesky and Householder factors, Gauss elimination, orthonormal frames, extreme eigenvalues.

A matrix (n, m), n <= m, is factored as matrix.T = Q R with an orthogonal Q. The first n columns of Q give the
minimum-norm solutions. The other columns of Q span the null space. In a single sum, each addition waits for the
previous addition. The short loops therefore compute several independent sums.
"""

from __future__ import annotations

import math

from sagline.core.arrays import Array
from sagline.kernels.jit import formula, kernel

LEAST_PIVOT = 1e-15  # relative to the original diagonal element; a smaller pivot is only a rounding error


@formula
def dot(one: Array, other: Array) -> float:
    """Scalar product of two vectors."""
    total = 0.0
    for k in range(one.shape[0]):
        total += one[k] * other[k]
    return total


@formula
def norm(vector: Array) -> float:
    """Euclidean length of `vector`."""
    return math.sqrt(dot(vector, vector))


@kernel
def copy(source: Array, target: Array) -> None:
    """Copy `source` to the first entries of `target`."""
    for k in range(source.shape[0]):
        target[k] = source[k]


@kernel
def factor_positive(matrix: Array, shift: float, factor: Array) -> bool:
    """Fill the Cholesky factor L, lower triangle, of `matrix` (n, n) + `shift` * 1. False if not positive definite."""
    # Only the lower triangle of `matrix` is used. `factor` may be the same array as `matrix`.
    n = matrix.shape[0]
    for j in range(n):
        diagonal = matrix[j, j] + shift
        pivot = diagonal
        for k in range(j):
            pivot -= factor[j, k] * factor[j, k]
        if not pivot > LEAST_PIVOT * abs(diagonal):
            return False
        root = math.sqrt(pivot)
        inverse = 1.0 / root
        factor[j, j] = root
        for i in range(j + 1, n):
            total = matrix[i, j]
            for k in range(j):
                total -= factor[i, k] * factor[j, k]
            factor[i, j] = total * inverse
    return True


@kernel
def solve_lower(factor: Array, vector: Array) -> None:
    """Replace `vector` (n,) by the solution x of L x = `vector`."""
    for k in range(vector.size):
        for j in range(k):
            vector[k] -= factor[k, j] * vector[j]
        vector[k] /= factor[k, k]


@kernel
def solve_upper(factor: Array, vector: Array) -> None:
    """Replace `vector` (n,) by the solution x of L^T x = `vector`."""
    for k in range(vector.size - 1, -1, -1):
        for j in range(k + 1, vector.size):
            vector[k] -= factor[j, k] * vector[j]
        vector[k] /= factor[k, k]


@formula
def _pivot_row(matrix: Array, k: int) -> int:
    """Row from `k` on with the entry of the largest magnitude in column `k`; -1 without an entry other than 0."""
    best = k
    for i in range(k + 1, matrix.shape[0]):
        if abs(matrix[i, k]) > abs(matrix[best, k]):
            best = i
    return best if abs(matrix[best, k]) > 0.0 else -1


@formula
def _exchange_rows(matrix: Array, one: int, other: int, first: int) -> None:
    """Exchange the entries of two rows from column `first` on."""
    for j in range(first, matrix.shape[1]):
        matrix[one, j], matrix[other, j] = matrix[other, j], matrix[one, j]


@kernel
def solve_general(matrix: Array, right: Array) -> bool:
    """Gauss elimination with partial pivoting. Destroys `matrix`; `right` becomes the solution. False if singular."""
    n = matrix.shape[0]
    for k in range(n):
        best = _pivot_row(matrix, k)
        if best < 0:
            return False
        if best != k:
            _exchange_rows(matrix, k, best, k)
            right[k], right[best] = right[best], right[k]
        for i in range(k + 1, n):
            ratio = matrix[i, k] / matrix[k, k]
            for j in range(k + 1, n):
                matrix[i, j] -= ratio * matrix[k, j]
            right[i] -= ratio * right[k]
    for r in range(n):
        i = n - 1 - r
        total = right[i]
        for j in range(i + 1, n):
            total -= matrix[i, j] * right[j]
        right[i] = total / matrix[i, i]
    return True


@kernel
def invert_general(matrix: Array, inverse: Array) -> float:
    """Fill the `inverse` (n, n) by Gauss elimination with partial pivoting. Destroys `matrix`. Returns the determinant.

    If the determinant is 0 or NaN, the inverse is not valid.
    """
    n = matrix.shape[0]
    determinant = 1.0
    for i in range(n):
        for j in range(n):
            inverse[i, j] = 1.0 if i == j else 0.0
    for k in range(n):
        best = _pivot_row(matrix, k)
        if best < 0:
            return 0.0
        if best != k:
            determinant = -determinant
            _exchange_rows(matrix, k, best, 0)
            _exchange_rows(inverse, k, best, 0)
        pivot = matrix[k, k]
        determinant *= pivot
        share = 1.0 / pivot
        for j in range(n):
            matrix[k, j] *= share
            inverse[k, j] *= share
        for i in range(n):
            ratio = matrix[i, k]
            if i != k:
                for j in range(n):
                    matrix[i, j] -= ratio * matrix[k, j]
                    inverse[i, j] -= ratio * inverse[k, j]
    return determinant


@formula
def orthogonalize_row(frame: Array, count: int, triangle: Array) -> float:
    """Make row `count` of a frame (.., d) orthogonal to the rows before it, which are orthonormal."""
    # Column `count` of the triangle is filled, above the diagonal, with the subtracted components. Returns the squared
    # length of the new row.
    d = frame.shape[1]
    for b in range(count):
        triangle[b, count] = 0.0
    for _ in range(2):
        for b in range(count):
            share = 0.0
            for k in range(d):
                share += frame[b, k] * frame[count, k]
            triangle[b, count] += share
            for k in range(d):
                frame[count, k] -= share * frame[b, k]
    square = 0.0
    for k in range(d):
        square += frame[count, k] * frame[count, k]
    return square


@formula
def normalize_row(frame: Array, count: int, triangle: Array, square: float) -> None:
    """Scale row `count` of the frame to unit length. `square` is the result of `orthogonalize_row`."""
    length = math.sqrt(square)
    triangle[count, count] = length
    for k in range(frame.shape[1]):
        frame[count, k] /= length


HEADS, FACTORS = 0, 1

RANK = 1e-9  # least diagonal entry of R, relative to the row of the matrix, that counts as full rank


@formula
def _reflect(reduced: Array, diagonals: Array, k: int, square: float) -> None:
    """Make step `k` of a QR factorization in place. `square`: squared norm of row k from the diagonal on."""
    n, m = reduced.shape
    norm = math.sqrt(square)
    first = reduced[k, k]
    head = -math.copysign(norm, first)
    factor = 1.0 / (norm * (norm + abs(first)))
    diagonals[HEADS, k] = head
    diagonals[FACTORS, k] = factor
    reduced[k, k] = first - head
    for j in range(k + 1, n):
        total = 0.0
        for i in range(k, m):
            total += reduced[k, i] * reduced[j, i]
        total *= factor
        for i in range(k, m):
            reduced[j, i] -= total * reduced[k, i]


@kernel
def reflect_rows(reduced: Array, diagonals: Array) -> None:
    """QR factorization in place of a matrix (n, m) of any rank, as in `factorize`. A zero row has no reflection."""
    n, m = reduced.shape
    for k in range(n):
        square = 0.0
        for i in range(k, m):
            square += reduced[k, i] * reduced[k, i]
        diagonals[HEADS, k] = 0.0
        diagonals[FACTORS, k] = 0.0
        if square > 0.0:
            _reflect(reduced, diagonals, k, square)


@formula
def factorize(reduced: Array, diagonals: Array) -> bool:
    """QR factorization in place; returns True if the matrix (n, m) has full rank."""
    # On return, row k of reduced contains the part of column k of R above the diagonal, then the vector v of reflection
    # k. In diagonals (2, n), row HEADS is the diagonal of R, and row FACTORS contains 2/|v|^2 of the reflections.
    n, m = reduced.shape
    for k in range(n):
        before = 0.0
        for i in range(k):
            before += reduced[k, i] * reduced[k, i]
        square = 0.0
        for i in range(k, m):
            square += reduced[k, i] * reduced[k, i]
        if not square > RANK * RANK * (before + square):
            return False
        _reflect(reduced, diagonals, k, square)
    return True


@formula
def orthogonal_factor(reduced: Array, diagonals: Array, q: Array) -> None:
    """Fill `q` with the orthogonal matrix Q (m, m) from the reflections. Row m of `q` is used as work memory."""
    n, m = reduced.shape
    q[:] = 0.0
    for i in range(m):
        q[i, i] = 1.0
    for k in range(n - 1, -1, -1):
        q[m] = 0.0
        for i in range(k, m):
            for j in range(m):
                q[m, j] += reduced[k, i] * q[i, j]
        for i in range(k, m):
            share = diagonals[FACTORS, k] * reduced[k, i]
            for j in range(m):
                q[i, j] -= share * q[m, j]


@formula
def pseudo_inverse(reduced: Array, diagonals: Array, q: Array, inverse: Array) -> None:
    """Fill `inverse` (n, m), the transposed pseudo-inverse. The minimum-norm solution for a vector b is b . inverse."""
    n, m = reduced.shape
    for k in range(n - 1, -1, -1):
        for i in range(m):
            inverse[k, i] = q[i, k]
        for j in range(k + 1, n):
            for i in range(m):
                inverse[k, i] -= reduced[j, k] * inverse[j, i]
        head = 1.0 / diagonals[HEADS, k]
        for i in range(m):
            inverse[k, i] *= head


@formula
def minimum_norm(inverse: Array, right: Array, solution: Array) -> None:
    """Fill the minimum-norm `solution` (m,) of the equations matrix . solution = `right` (n,)."""
    n, m = inverse.shape
    solution[:] = 0.0
    for k in range(n):
        for i in range(m):
            solution[i] += right[k] * inverse[k, i]


STEPS = 100
STILL = 1e-16  # step length relative to the largest eigenvalue; shorter steps are only rounding errors


@formula
def _tridiagonalize(matrix: Array, diagonal: Array, beside: Array, vector: Array) -> None:
    """Reduce `matrix` to tridiagonal form (Householder). Fills `diagonal` and `beside`, (n,); overwrites `matrix`."""
    n = matrix.shape[0]
    product = diagonal  # `diagonal` is work memory here, and is filled at the end
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
    """Lower bound of the eigenvalues of the tridiagonal matrix `sign` * T, from Gershgorin's circles."""
    low = math.inf
    before = 0.0
    for k in range(diagonal.shape[0]):
        after = abs(beside[k])
        low = min(low, sign * diagonal[k] - before - after)
        before = after
    return low


@kernel
def _lowest_eigenvalue(diagonal: Array, beside: Array, sign: float) -> float:
    """Smallest eigenvalue of the tridiagonal matrix `sign` * T, by Laguerre's iteration from below."""
    # The product of the pivots q of the shifted matrix is the characteristic polynomial. All pivots are positive below
    # the smallest root, which the iteration never passes.
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
    """Smallest and largest eigenvalue of a symmetric matrix (n, n). All arrays are overwritten."""
    # If |smallest| exceeds `flat` times an upper bound of the largest eigenvalue, this bound is returned instead of the
    # largest eigenvalue, which saves time. The bound is at most three times the largest eigenvalue.
    _tridiagonalize(matrix, diagonal, beside, work)
    low = _lowest_eigenvalue(diagonal, beside, 1.0)
    bound = -_gershgorin_bound(diagonal, beside, -1.0)
    if abs(low) > flat * abs(bound):
        return low, bound
    return low, -_lowest_eigenvalue(diagonal, beside, -1.0)
