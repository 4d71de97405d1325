"""Small dense linear algebra compared with NumPy."""

import numpy as np
import pytest

from sagline.core.arrays import Array
from sagline.kernels.algebra import factors
from sagline.kernels.forward import newton as trust
from tests.kernels.compiled import from_python

RNG = np.random.default_rng(5)
factor_positive = from_python(factors.factor_positive)
solve_lower = from_python(factors.solve_lower)
solve_upper = from_python(factors.solve_upper)
solve_general = from_python(factors.solve_general)
extreme_eigenvalues = from_python(factors.extreme_eigenvalues)
trust_step = from_python(trust.trust_step)


def symmetric(n: int) -> Array:
    half = RNG.normal(size=(n, n))
    return half + half.T


@pytest.mark.parametrize("n", range(1, 7))
def test_extreme_eigenvalues(n: int) -> None:
    steep = np.diag(10.0 ** np.arange(0.0, 2.0 * n, 2.0)) + 1e-3 * symmetric(n)
    for matrix in (symmetric(n), np.diag(np.arange(1.0, n + 1.0)), np.zeros((n, n)), np.ones((n, n)), np.eye(n), steep):
        found = extreme_eigenvalues(matrix.copy(), *np.zeros((3, n)), np.inf)
        expected = np.linalg.eigvalsh(matrix)[[0, -1]]
        np.testing.assert_allclose(found, expected, atol=1e-14 * max(1.0, np.abs(matrix).sum()))


def test_the_largest_eigenvalue_is_bounded() -> None:
    for _ in range(100):
        matrix = symmetric(6) + 3.0 * np.eye(6)
        expected = np.linalg.eigvalsh(matrix)[[0, -1]]
        low, high = extreme_eigenvalues(matrix.copy(), *np.zeros((3, 6)), 1e-9)
        assert low == pytest.approx(expected[0], abs=1e-13)
        size = np.abs(np.linalg.eigvalsh(matrix)).max()
        assert expected[1] - 1e-13 <= high <= 3.0 * size


@pytest.mark.parametrize("n", range(1, 7))
def test_cholesky_solves_definite_systems_and_reports_indefinite_ones(n: int) -> None:
    matrix = symmetric(n)
    low = float(np.linalg.eigvalsh(matrix)[0])
    factor, right = np.zeros((n, n)), RNG.normal(size=n)
    assert not factor_positive(matrix, -low - 1e-6, factor)
    assert factor_positive(matrix, -low + 1.0, factor)
    definite = matrix + (1.0 - low) * np.eye(n)
    np.testing.assert_allclose(factor, np.linalg.cholesky(definite), atol=1e-13)
    solution = right.copy()
    solve_lower(factor, solution)
    np.testing.assert_allclose(factor @ solution, right, atol=1e-12)
    solve_upper(factor, solution)
    np.testing.assert_allclose(definite @ solution, right, atol=1e-12)


@pytest.mark.parametrize("n", [2, 6])
def test_cholesky_in_place_reads_only_the_lower_triangle(n: int) -> None:
    matrix = symmetric(n) + 10.0 * np.eye(n)
    expected = np.linalg.cholesky(matrix)
    given = np.tril(matrix) + np.triu(np.full((n, n), np.nan), 1)
    assert factor_positive(given, 0.0, given)
    np.testing.assert_allclose(np.tril(given), expected, atol=1e-13)


@pytest.mark.parametrize("n", range(1, 7))
def test_gauss_elimination(n: int) -> None:
    matrix, right = RNG.normal(size=(n, n)), RNG.normal(size=n)
    matrix[0, 0] = 0.0 if n > 1 else 2.0  # requires a pivot
    solution = right.copy()
    assert solve_general(matrix.copy(), solution)
    np.testing.assert_allclose(matrix @ solution, right, atol=1e-11)
    assert not solve_general(np.zeros((n, n)), right.copy())


@pytest.mark.parametrize("radius", [1e-3, 0.1, 1.0, 1e3])
def test_trust_step_meets_the_conditions_of_optimality(radius: float) -> None:
    for _ in range(50):
        n = 6
        matrix, gradient, step = symmetric(n), RNG.normal(size=n), np.empty(n)
        shift = trust_step(matrix, gradient, radius, np.zeros((n, n)), np.empty(n), step)
        np.testing.assert_allclose(
            (matrix + shift * np.eye(n)) @ step, -gradient, atol=1e-9 * (1.0 + np.abs(step).max() * (1 + shift))
        )
        assert np.linalg.norm(step) <= 1.1 * radius
        assert np.linalg.eigvalsh(matrix)[0] + shift > 0.0
        if shift > 0.0:
            assert np.linalg.norm(step) >= 0.79 * radius
