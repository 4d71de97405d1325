"""Farkas vectors prove what they claim, in plain arithmetic."""

import numpy as np
import pytest

from sagline.arrays import Array, Flags
from sagline.kernels.sharing.proof import prove_empty
from tests.kernels.compiled import from_python, memory

prove = from_python(prove_empty)


def proof_of(matrix: Array, needed: Array, low: Array, high: Array, translations: int) -> tuple[Array, Flags]:
    n, m = matrix.shape
    inverse: Array = np.array(np.linalg.pinv(matrix).T, dtype=np.float64)
    null = np.linalg.svd(matrix)[2][n:].copy()
    farkas, blocking = np.full(n, 7.0), np.ones(m, dtype=np.bool_)
    prove(np.array([needed @ inverse, low, high]), inverse, null, translations, memory(), farkas, blocking)
    return farkas, blocking


@pytest.mark.parametrize(("n", "m", "translations"), [(6, 8, 3), (6, 7, 3), (3, 6, 3), (3, 5, 2), (1, 2, 1), (6, 6, 3)])
def test_no_tensions_supply_what_the_vector_rules_out(n: int, m: int, translations: int) -> None:
    rng = np.random.default_rng(n + m)
    proofs = {True: 0, False: 0}
    for trial in range(60):
        matrix = rng.normal(size=(n, m))
        low, high = rng.uniform(1, 2, m), rng.uniform(3, 9, m)
        high[rng.uniform(size=m) < 0.1] = np.inf
        needed = matrix @ rng.uniform(2, 3, m) + (rng.normal(size=n) * 20.0 if trial % 2 else 0.0)
        farkas, blocking = proof_of(matrix, needed, low, high, translations)
        proved = not np.isnan(farkas).any()
        proofs[proved] += 1
        if trial % 2 == 0:
            assert not proved
        if not proved:
            assert np.isnan(farkas).all()
            assert not blocking.any()
            continue
        along = farkas @ matrix
        takes_part = np.abs(along) > 1e-8 * np.abs(along).max()
        np.testing.assert_array_equal(blocking, takes_part)
        assert blocking.sum() <= m - n + 1
        most = (along * np.where(along > 0.0, high, low))[takes_part].sum()
        assert farkas @ needed - most > 0.0
        assert np.linalg.norm(farkas[:translations]) == pytest.approx(1.0, rel=1e-12)
    assert proofs[True] > 10


def test_a_contradiction_of_moments_alone() -> None:
    matrix = np.array([[1.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
    farkas, blocking = proof_of(matrix, np.array([2.0, 5.0]), np.zeros(3), np.full(3, 2.0), 1)
    np.testing.assert_allclose(farkas, [0.0, 1.0], atol=1e-14)
    np.testing.assert_array_equal(blocking, [False, False, True])
