"""Structure matrix and required wrench compared with cross products in NumPy."""

import numpy as np
import pytest

from sagline.core.arrays import Array
from sagline.kernels import statics as w
from sagline.kernels.cable import geometry as g
from tests.kernels.balance.robots import A_POINT, EVERY_MOTION, GRAVITY, IN_A_PLANE, TO_AND_FRO, Case, random_case
from tests.kernels.compiled import from_python

needed_wrench = from_python(w.needed_wrench)
along_freedom = from_python(w.along_freedom)
rows_along_freedom = from_python(w.rows_along_freedom)


def geometry_of(case: Case) -> Array:
    geometry = np.full((1, g.GEOMETRY_ROWS, len(case.robot)), np.nan)
    g.cable_geometries(case.robot[None], case.body[None], case.pose[None], np.empty((3, 3)), geometry)
    return np.asarray(geometry[0])


def test_structure_matrices() -> None:
    cases = [random_case(np.random.default_rng(seed), 8) for seed in range(4)]
    matrices = np.full((4, 6, 8), np.nan)
    w.structure_matrices(np.array([geometry_of(c) for c in cases]), matrices)
    for case, matrix in zip(cases, matrices, strict=True):
        np.testing.assert_allclose(matrix, case.structure, atol=1e-15)


def test_required_wrench_balances_weight_load_and_sag_forces() -> None:
    case = random_case(np.random.default_rng(1), 8)
    geometry, needed = geometry_of(case), np.full(6, np.nan)
    sag_force = np.random.default_rng(2).uniform(0.0, 5.0, 8)
    needed_wrench(geometry, case.body, case.wrench, sag_force, needed)
    hanging = np.outer(-sag_force, [0.0, 0.0, 1.0])  # of each cable on the platform, at its end
    forces = hanging.sum(axis=0) + np.array([0.0, 0.0, -5.0 * GRAVITY]) + case.wrench[:3]
    moments = np.cross(geometry[g.LEVER_X : g.LEVER_X + 3].T, hanging).sum(axis=0) + case.wrench[3:]
    np.testing.assert_allclose(needed, -np.concatenate((forces, moments)), atol=1e-13)


@pytest.mark.parametrize("freedom", [EVERY_MOTION, IN_A_PLANE, A_POINT, TO_AND_FRO], ids=len)
def test_along_free_motions(freedom: Array) -> None:
    rng = np.random.default_rng(3)
    n = len(freedom)
    turned = freedom if n == 6 else freedom @ np.linalg.qr(rng.normal(size=(6, 6)))[0]
    full, matrix = rng.normal(size=6), rng.normal(size=(6, 5))
    part, rows = np.full(n, np.nan), np.full((n, 5), np.nan)
    along_freedom(turned, full, part)
    rows_along_freedom(turned, matrix, rows)
    np.testing.assert_allclose(part, turned @ full, atol=1e-14)
    np.testing.assert_allclose(rows, turned @ matrix, atol=1e-14)
