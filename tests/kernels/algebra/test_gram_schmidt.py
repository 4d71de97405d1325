"""Orthonormal frames row by row, compared with the factors of NumPy."""

import numpy as np
import pytest

from sagline.core.arrays import Array
from sagline.kernels.algebra.factors import normalize_row, orthogonalize_row
from tests.kernels.compiled import from_python

take, hold = from_python(orthogonalize_row), from_python(normalize_row)


def framed(rows: Array) -> tuple[Array, Array]:
    """Frame and triangular factor of given rows."""
    count, d = rows.shape
    frame, triangle = np.full((count, d), np.nan), np.full((count, count), np.nan)
    for c in range(count):
        frame[c] = rows[c]
        hold(frame, c, triangle, take(frame, c, triangle))
    return frame, np.triu(np.nan_to_num(triangle))


@pytest.mark.parametrize("d", [1, 2, 3, 6, 15])
def test_frame_is_orthonormal_and_the_factor_gives_the_rows(d: int) -> None:
    rows = np.random.default_rng(1).normal(size=(d, d))
    frame, triangle = framed(rows)
    np.testing.assert_allclose(frame @ frame.T, np.eye(d), atol=4e-16 * d)
    np.testing.assert_allclose(triangle.T @ frame, rows, atol=1e-14)
    assert (np.diag(triangle) > 0.0).all()


def test_nearly_equal_rows_give_an_orthogonal_frame() -> None:
    rng = np.random.default_rng(2)
    for size in (1e-3, 1e-6, 1e-9):
        rows = np.ones((4, 6)) + size * rng.normal(size=(4, 6))
        frame, _ = framed(rows)
        np.testing.assert_allclose(frame @ frame.T, np.eye(4), atol=1e-15)  # a single pass would leave 1e-16/size


def test_a_dependent_row_leaves_only_rounding() -> None:
    frame, triangle = np.eye(3, 5), np.full((3, 3), np.nan)
    frame[2] = [3.0, -4.0, 0.0, 0.0, 0.0]
    assert take(frame, 2, triangle) == 0.0
    np.testing.assert_array_equal(triangle[:2, 2], [3.0, -4.0])
    frame[2] = [3.0, -4.0, 0.0, 0.5, 0.0]
    assert take(frame, 2, triangle) == 0.25
