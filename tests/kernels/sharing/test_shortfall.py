"""The smallest change of the needed force, by hand and against SciPy."""

import numpy as np
import pytest
from scipy.optimize import lsq_linear

from sagline.kernels.sharing.shortfall import wrench_shortfall
from tests.kernels.compiled import from_python, memory

shortfall = from_python(wrench_shortfall)


def test_shortfall_by_hand() -> None:
    # two cables along x and y that pull with 1 to 2 N; needed: (5, 0.5) N, three too much and half too little
    assert shortfall(np.eye(2), np.array([5.0, 0.5]), np.ones(2), np.full(2, 2.0), 2, memory()) == pytest.approx(
        np.hypot(3.0, 0.5)
    )
    # a moment that no force supplies
    matrix = np.array([[1.0, 1.0], [0.0, 0.0]])
    assert shortfall(matrix, np.array([2.0, 1.0]), np.zeros(2), np.ones(2), 1, memory()) == np.inf


def test_forces_alone_against_least_squares() -> None:
    rng = np.random.default_rng(1)
    for _ in range(60):
        matrix, needed = rng.normal(size=(3, 5)), rng.normal(size=3) * 30.0
        low, high = rng.uniform(1, 2, 5), rng.uniform(3, 9, 5)
        found = lsq_linear(matrix, needed, (low, high), method="bvls", tol=1e-14)
        expected = np.linalg.norm(found.fun)
        assert shortfall(matrix, needed, low, high, 3, memory()) == pytest.approx(expected, abs=1e-8)


def test_the_moment_is_supplied_while_the_force_gives_way() -> None:
    # two cables up at x = -1 and x = 1: force t1 + t2, moment t1 - t2; needed 10 N and 1 N m, each at most 2 N
    matrix = np.array([[1.0, 1.0], [1.0, -1.0]])
    needed = np.array([10.0, 1.0])
    assert shortfall(matrix, needed, np.zeros(2), np.full(2, 2.0), 1, memory()) == pytest.approx(7.0, rel=1e-7)
    inside = shortfall(matrix, np.array([3.0, 1.0]), np.zeros(2), np.full(2, 2.0), 1, memory())
    assert inside == pytest.approx(0.0, abs=1e-12) or inside == np.inf
