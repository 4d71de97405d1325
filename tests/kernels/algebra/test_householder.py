"""Null space, pseudo-inverse and loss of rank compared with NumPy."""

import numpy as np
import pytest

from sagline.core.arrays import Array
from sagline.kernels.algebra import factors
from tests.kernels.compiled import from_python

factorize = from_python(factors.factorize)
orthogonal_factor = from_python(factors.orthogonal_factor)
pseudo_inverse = from_python(factors.pseudo_inverse)
minimum_norm = from_python(factors.minimum_norm)

SHAPES = [(6, 8), (6, 7), (6, 6), (2, 4), (3, 9), (1, 1), (1, 5), (6, 24)]


def check(matrix: Array, right: Array) -> None:
    """Null space, pseudo-inverse and minimum norm of one system."""
    n, m = matrix.shape
    reduced, diagonals = matrix.copy(), np.full((2, n), np.nan)
    assert factorize(reduced, diagonals)
    q, inverse, solution = np.full((m + 1, m), np.nan), np.full((n, m), np.nan), np.full(m, np.nan)
    orthogonal_factor(reduced, diagonals, q)
    pseudo_inverse(reduced, diagonals, q, inverse)
    np.testing.assert_allclose(inverse.T, np.linalg.pinv(matrix), atol=1e-13)
    np.testing.assert_allclose(matrix @ q[:m, n:], 0.0, atol=1e-14)
    np.testing.assert_allclose(q[:m].T @ q[:m], np.eye(m), atol=1e-14)
    minimum_norm(inverse, right, solution)
    np.testing.assert_allclose(solution, np.linalg.pinv(matrix) @ right, atol=1e-13)


@pytest.mark.parametrize(("n", "m"), SHAPES)
def test_pseudo_inverse_and_null_space(n: int, m: int) -> None:
    rng = np.random.default_rng(1)
    check(rng.normal(size=(n, m)), rng.normal(size=n))


def test_rows_along_the_axes_of_either_sign() -> None:
    check(np.array([[0.0, -2.0, 0.0], [3.0, 0.0, 0.0]]), np.array([1.0, -5.0]))
    check(np.array([[-2.0, 0.0, 0.0], [0.0, 0.0, 4.0]]), np.array([1.0, -5.0]))


def test_loss_of_rank_is_detected() -> None:
    rng = np.random.default_rng(2)
    matrix = rng.normal(size=(6, 8))
    matrix[4] = matrix[1] - 2 * matrix[3]
    assert not factorize(matrix.copy(), np.zeros((2, 6)))
    assert not factorize(np.zeros((2, 3)), np.zeros((2, 2)))
    assert not factorize(np.full((2, 3), np.nan), np.zeros((2, 2)))


@pytest.mark.parametrize("size", [1e-6, 1.0, 1e6])
def test_rank_is_lost_below_a_billionth_of_a_row_in_any_unit(size: float) -> None:
    for left, kept in ((0.3e-9, False), (3e-9, True)):
        matrix = np.array([[1.0, 0.0, 0.0], [1.0, left, 0.0]]) * size
        assert factorize(matrix, np.zeros((2, 2))) == kept
