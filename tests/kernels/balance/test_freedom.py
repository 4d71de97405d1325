"""Motions of a body and free motions of a platform, compared with NumPy."""

import numpy as np
import pytest

from sagline.kernels import statics as kernels
from sagline.robot.checks import freedom_matrix
from tests.kernels.compiled import from_python

NORMAL = np.array([1.0, -2.0, 0.5]) / np.sqrt(5.25)
FREEDOMS = {
    "3R3T": freedom_matrix("3R3T", None),
    "3T": freedom_matrix("3T", None),
    "1R2T": freedom_matrix("1R2T", NORMAL),
    "2T": freedom_matrix("2T", NORMAL),
}
turns = from_python(kernels.is_rotation)
components_along = from_python(kernels.components_along)
symmetric_part = from_python(kernels.symmetric_part)
matrix_along = from_python(kernels.matrix_along)
spread = from_python(kernels.fill_motion_of_components)


@pytest.mark.parametrize("pattern", FREEDOMS)
def test_parts_and_motions(pattern: str) -> None:
    freedom, rng = FREEDOMS[pattern], np.random.default_rng(3)
    n = len(freedom)
    unit, full, stiff = rng.uniform(0.5, 2.0, n), rng.normal(size=6), rng.normal(size=(6, 6))
    free = unit[:, None] * freedom
    part, motion, matrix = np.empty(n), np.empty(6), np.empty((n, n))
    assert components_along(free, full, part) == pytest.approx(np.linalg.norm(part), rel=1e-14)
    np.testing.assert_allclose(part, unit * (freedom @ full), rtol=1e-13, atol=1e-15)
    spread(free, part, motion)
    np.testing.assert_allclose(motion, freedom.T @ (unit * part), rtol=1e-13, atol=1e-15)
    along = np.diag(unit) @ freedom @ stiff @ freedom.T @ np.diag(unit)
    matrix_along(free, stiff, matrix)
    np.testing.assert_allclose(matrix, along, atol=1e-13)
    symmetric_part(free, stiff, matrix)
    np.testing.assert_allclose(matrix, 0.5 * (along + along.T), atol=1e-13)


def test_rotations_among_the_free_motions() -> None:
    assert [turns(FREEDOMS["3R3T"], k) for k in range(6)] == [False] * 3 + [True] * 3
    assert [turns(FREEDOMS["1R2T"], k) for k in range(3)] == [False, False, True]
    assert not any(turns(FREEDOMS["2T"], k) for k in range(2))
