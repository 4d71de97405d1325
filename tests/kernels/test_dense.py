"""Small dense linear algebra against NumPy."""

import numpy as np
import pytest

from sagline.arrays import Array
from sagline.kernels.algebra.dense import (
    cholesky,
    extreme_eigenvalues,
    solve_general,
    solve_lower,
    solve_upper,
    trust_step,
)

RNG = np.random.default_rng(5)


def symmetric(n: int) -> Array:
    half = RNG.normal(size=(n, n))
    return half + half.T


@pytest.mark.parametrize("n", range(1, 7))
def test_extreme_eigenvalues(n: int) -> None:
    for matrix in (symmetric(n), np.diag(np.arange(1.0, n + 1.0)), np.zeros((n, n)), np.ones((n, n))):
        found = extreme_eigenvalues(matrix.copy(), *np.zeros((4, n)))
        expected = np.linalg.eigvalsh(matrix)[[0, -1]]
        np.testing.assert_allclose(found, expected, atol=1e-14 * max(1.0, np.abs(matrix).sum()))


@pytest.mark.parametrize("n", range(1, 7))
def test_cholesky_solves_and_tells_definite_from_indefinite(n: int) -> None:
    matrix = symmetric(n)
    low = float(np.linalg.eigvalsh(matrix)[0])
    factor, right = np.zeros((n, n)), RNG.normal(size=n)
    assert not cholesky(matrix, -low - 1e-6, factor)
    assert cholesky(matrix, -low + 1.0, factor)
    solution = np.empty(n)
    solve_lower(factor, right, solution)
    solve_upper(factor, solution, solution)
    np.testing.assert_allclose((matrix + (1.0 - low) * np.eye(n)) @ solution, right, atol=1e-12)


@pytest.mark.parametrize("n", range(1, 7))
def test_gauss_elimination(n: int) -> None:
    matrix, right = RNG.normal(size=(n, n)), RNG.normal(size=n)
    matrix[0, 0] = 0.0 if n > 1 else 2.0  # needs a pivot
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
