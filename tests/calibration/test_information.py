"""The greedy choice compared with an exhaustive search, and its sums with determinants and inverses."""

from itertools import combinations

import numpy as np
import pytest

from sagline.calibration.information import Information, choose_informative, deviations_of, prior_information
from sagline.core.arrays import Array, Indices
from tests.tiers import wide

SURELY = 1.0 - np.exp(-1.0)  # guaranteed share of the best log det by a greedy choice
NEAR = 0.97  # share of the best in all cases below


def rows_of(seed: int, candidates: int = 11, readings: int = 2, numbers: int = 5) -> Array:
    """Readings of very different information, with some nearly equal candidates."""
    rng = np.random.default_rng(seed)
    rows = rng.normal(size=(candidates, readings, numbers)) * 10.0 ** rng.uniform(-1.0, 1.5, (candidates, 1, numbers))
    rows[-3:] = rows[:3] + 0.05 * rng.normal(size=(3, readings, numbers))
    return rows


def log_det(rows: Array, which: tuple[int, ...] | Indices) -> float:
    flat = rows[list(which)].reshape(-1, rows.shape[-1])
    return float(np.linalg.slogdet(np.eye(rows.shape[-1]) + flat.T @ flat)[1])


@pytest.mark.parametrize("count", wide([3, 1, 2, 4]))
def test_the_choice_is_near_an_exhaustive_search(count: int) -> None:
    shares = []
    for seed in range(25):
        rows = rows_of(seed)
        best = max(log_det(rows, which) for which in combinations(range(len(rows)), count))
        found = log_det(rows, choose_informative(rows, np.eye(5), count)[0])
        assert SURELY * best <= found <= best + 1e-9
        shares.append(found / best)
    assert min(shares) >= NEAR
    assert np.median(shares) >= 1.0 - 1e-9


def test_exchanges_improve_a_greedy_choice() -> None:
    # the first has the most information alone, the two others together
    rows = np.array([[[3.0, 3.0]], [[4.0, 0.0]], [[0.0, 4.0]]])
    rows[0] *= 1.01
    assert log_det(rows, (0,)) > log_det(rows, (1,))
    assert sorted(choose_informative(rows, np.eye(2), 2)[0]) == [1, 2]


def test_gains_and_deviations_by_definition() -> None:
    rows = rows_of(3, candidates=20)
    order, gain, deviation = choose_informative(rows, np.eye(5), 12)
    assert len(set(order)) == 12
    for k in range(1, 13):
        flat = rows[order[:k]].reshape(-1, 5)
        known = np.eye(5) + flat.T @ flat
        assert gain[k - 1] == pytest.approx(np.linalg.slogdet(known)[1], rel=1e-10)
        np.testing.assert_allclose(deviation[k - 1], np.sqrt(np.diag(np.linalg.inv(known))), rtol=1e-7)
    assert (np.diff(gain, 2) <= 1e-9).all()  # the gain decreases from candidate to candidate


def test_adding_and_removing_a_candidate_is_reversible() -> None:
    rows = rows_of(5) * 1e3
    found, again = Information(rows, np.eye(5)), Information(rows, np.eye(5))
    for candidate in (4, 7, 2):
        found.take(candidate)
    found.leave(7)
    for candidate in (4, 2):
        again.take(candidate)
    np.testing.assert_allclose(found.covariance, again.covariance, rtol=1e-7, atol=1e-14)
    np.testing.assert_allclose(found.gains(), again.gains(), rtol=1e-6)


def test_candidates_without_information_are_used_once() -> None:
    assert sorted(choose_informative(np.zeros((4, 2, 3)), np.eye(3), 4)[0]) == [0, 1, 2, 3]


def test_deviations_of_undetermined_parameters() -> None:
    rows = np.diag([2.0, 1e8, 0.0, 5.0])
    np.testing.assert_allclose(deviations_of(rows, np.zeros(4), np.eye(4)), [0.5, 1e-8, np.inf, 0.2])
    np.testing.assert_allclose(
        deviations_of(rows, np.array([0.0, 0.0, 4.0, 12.0]), np.eye(4)), [0.5, 1e-8, 0.25, 1.0 / 13.0]
    )
    # only the sum of two numbers is read; their difference is undetermined, or one of them has a prior
    both = np.array([[[1.0, 1.0, 0.0]], [[0.0, 0.0, 2.0]]])
    np.testing.assert_array_equal(deviations_of(both, np.zeros(3), np.eye(3)), [np.inf, np.inf, 0.5])
    np.testing.assert_allclose(deviations_of(both, np.array([0.5, 0.0, 0.0]), np.eye(3)), [2.0, np.sqrt(5.0), 0.5])


@pytest.mark.parametrize("precision", [1.0, 1e4, 1e8])
def test_readings_of_any_precision(precision: float) -> None:
    rows = rows_of(7, candidates=12, numbers=6) * precision
    rows[..., 5] = rows[..., 4]  # never distinguished
    order, _, _ = choose_informative(rows, prior_information(rows, np.eye(6)), 8)
    assert len(set(order)) == 8
    found = deviations_of(rows[order], np.ones(6), np.eye(6))
    told = rows.reshape(-1, 6)[:, :5] / precision
    # half of the prior difference remains in two numbers with a common reading
    np.testing.assert_allclose(found[4:], np.sqrt(0.5), rtol=1e-3 if precision == 1.0 else 1e-9)
    assert (
        found[:4] >= 0.9 * np.sqrt(np.diag(np.linalg.inv(np.eye(5) / precision**2 + told.T @ told)))[:4] / precision
    ).all()
    assert (found[:4] < 1.0).all()
