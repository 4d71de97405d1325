"""Small positive definite systems compared with NumPy."""

import numpy as np
import pytest

from sagline.kernels.algebra import factors
from tests.kernels.compiled import from_python

factor_positive = from_python(factors.factor_positive)
solve_lower = from_python(factors.solve_lower)
solve_upper = from_python(factors.solve_upper)


@pytest.mark.parametrize("r", [1, 2, 5, 15])
def test_factor_and_solution(r: int) -> None:
    rng = np.random.default_rng(r)
    half = rng.normal(size=(r, 2 * r))
    matrix, right = half @ half.T, rng.normal(size=r)
    factor = np.tril(matrix) + np.triu(np.full((r, r), np.nan), 1)  # elements above the diagonal are not read
    assert factor_positive(factor, 0.0, factor)
    shifted = np.full((r, r), np.nan)
    assert factor_positive(matrix, 0.5, shifted)
    np.testing.assert_allclose(np.tril(shifted), np.linalg.cholesky(matrix + 0.5 * np.eye(r)), atol=1e-12)
    np.testing.assert_allclose(np.tril(factor), np.linalg.cholesky(matrix), atol=1e-12)
    lower = right.copy()
    solve_lower(factor, lower)
    np.testing.assert_allclose(np.linalg.cholesky(matrix) @ lower, right, atol=1e-12)
    solve_upper(factor, lower)
    np.testing.assert_allclose(matrix @ lower, right, atol=1e-11)


def test_a_matrix_that_is_not_positive_definite_is_reported() -> None:
    for matrix in (np.array([[1.0, 0.0], [2.0, 3.0]]), np.zeros((1, 1)), np.array([[np.nan]])):
        assert not factor_positive(matrix, 0.0, np.empty_like(matrix))
