"""Standard deviations of sensors from residuals: restricted likelihood, and logs with wrong deviations."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import minimize

import sagline as sl
from sagline.calibration.findings import _variance_factors
from sagline.core.arrays import Array
from tests.calibration.four_cables import CELL_NOISE, LENGTH_NOISE, drawn_robot, log_of_twin, twin_of
from tests.calibration.synthetic import log_of, true_robot
from tests.tiers import extended

COGIRO = sl.load_robot("cogiro").replace(winches=sl.Winch())
GROUPS = [np.array([0, 1, 2]), np.array([3, 4])]


def minus_log_likelihood(logs: Array, rows: Array, noise: Array, misfit: Array, prior: Array) -> float:
    """Negative log likelihood of all readings as one normal vector with zero mean at the prior parameters."""
    count, width, _ = rows.shape
    whole = np.zeros((count * width, count * width))
    for k in range(count):
        part = slice(k * width, (k + 1) * width)
        for factor, group in zip(np.exp(logs), GROUPS, strict=True):
            whole[part, part] += factor * noise[k][:, group] @ noise[k][:, group].T
    flat = rows.reshape(count * width, -1)
    whole += flat @ prior @ flat.T
    y = misfit.ravel()
    return float(0.5 * (np.linalg.slogdet(whole)[1] + y @ np.linalg.solve(whole, y)))


def test_the_ratios_have_the_largest_likelihood_by_its_definition() -> None:
    rng = np.random.default_rng(5)
    rows, noise = rng.normal(size=(30, 4, 6)), rng.normal(size=(30, 4, 5))
    true = np.sqrt(np.repeat([4.0, 0.3], [3, 2]))
    root = np.diag([1.0, 1.0, 2.0, 0.5, 1.0, 3.0])
    prior = np.linalg.inv(root.T @ root)
    misfit = rows @ np.linalg.cholesky(prior) @ rng.normal(size=6) + np.einsum(
        "nij,nj->ni", noise, true * rng.normal(size=(30, 5))
    )
    factors, errors, redundancy = _variance_factors(rows, noise, misfit, root, GROUPS)
    given = (rows, noise, misfit, prior)
    best = minimize(minus_log_likelihood, np.zeros(2), given).x
    np.testing.assert_allclose(np.log(factors), best, atol=0.02)
    steps = 0.05 * np.array([[a, b] for a in (-1, 0, 1) for b in (-1, 0, 1)])
    values = np.reshape([minus_log_likelihood(best + step, *given) for step in steps], (3, 3))
    curved = [[values[2, 1] + values[0, 1], 0.0], [0.0, values[1, 2] + values[1, 0]]] - 2.0 * values[1, 1] * np.eye(2)
    curved[0, 1] = curved[1, 0] = 0.25 * (values[2, 2] + values[0, 0] - values[2, 0] - values[0, 2])
    np.testing.assert_allclose(errors, 0.5 * np.sqrt(np.diag(np.linalg.inv(curved / 0.05**2))), rtol=0.2)
    assert 114.0 < redundancy.sum() < 120.0  # 120 readings, and 6 parameters with priors


@pytest.mark.parametrize("wrong", [(1.0, 1.0), (3.0, 0.7)])
def test_wrongly_stated_deviations_are_estimated(wrong: tuple[float, float]) -> None:
    log = log_of_twin(twin_of(3), 3, 40)
    stated = sl.Sensors(LENGTH_NOISE / wrong[0], CELL_NOISE / wrong[1])
    found = sl.calibrate(drawn_robot(), log.replace(sensors=stated), folds=0)
    lengths, cells = found.sensor_deviations()
    for one, true in ((lengths, LENGTH_NOISE), (cells, CELL_NOISE)):
        assert abs(one.found - true) < 2.5 * one.error
        assert one.error < 0.3 * true
    assert "stated" in str(found)


def test_a_noisy_load_cell_is_found_among_the_others() -> None:
    made = log_of(true_robot(COGIRO, {"mass": 0.03}, 4), 60, 4)
    cells = np.array(made.log.load_cells)
    cells[:, 5] += 12.0 * np.random.default_rng(1).normal(size=60)
    found = sl.calibrate(COGIRO, made.log.replace(load_cells=cells), ("mass",), folds=0, robust=False)
    own = {one.cable: one for one in found.sensor_deviations(per_cable=True) if one.quantity == "load cell"}
    assert own[5].found == pytest.approx(13.0, abs=3.0 * own[5].error)
    assert all(abs(one.found - 5.0) < 3.5 * one.error for cable, one in own.items() if cable != 5)


def test_lengths_alone_beside_one_reading_do_not_determine_deviations() -> None:
    log = log_of(true_robot(COGIRO, {"mass": 0.03}, 2), 1, 2).log
    found = sl.calibrate(COGIRO, log, ("mass",), folds=0)
    assert np.isnan([one.found for one in found.sensor_deviations()]).all()
    assert "not determine" in str(found)


@extended
def test_standard_errors_of_the_deviations_cover_the_truth() -> None:
    off = []
    for seed in range(24):
        log = log_of_twin(twin_of(seed), seed)
        stated = sl.Sensors(LENGTH_NOISE / 3.0, CELL_NOISE / 0.7)
        found = sl.calibrate(drawn_robot(), log.replace(sensors=stated), folds=0).sensor_deviations()
        off += [(one.found - true) / one.error for one, true in zip(found, (LENGTH_NOISE, CELL_NOISE), strict=True)]
    off = [each for each in off if np.isfinite(each)]
    assert len(off) > 44
    assert 0.58 < np.mean(np.abs(off) < 1.0) < 0.82
    assert np.mean(np.abs(off) < 2.0) > 0.9
