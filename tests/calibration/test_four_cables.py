"""The default calibration of a platform on four cables with wrong load cells, and of logs without defects."""

from __future__ import annotations

from collections import Counter

import numpy as np
import pytest

import sagline as sl
from sagline.kernels.calibration import kinds
from tests.calibration.four_cables import DEFECTS, MASS, MASS_OFF, drawn_robot, log_of_twin, twin_of


def verdict(seed: int, defect: str | None) -> tuple[str, float]:
    """Status of the default calibration, and the error of the mass in standard errors."""
    twin = twin_of(seed, defect)
    found = sl.calibrate(drawn_robot(), log_of_twin(twin, seed), folds=0)
    mass, error = found.value_of("mass")
    assert error < 1.5 * MASS_OFF * MASS
    return found.status.name, abs(mass - twin.mass) / error


@pytest.mark.parametrize(("seed", "defect"), list(enumerate(DEFECTS)))
def test_wrong_load_cells_widen_the_error_of_the_mass_or_are_doubtful(seed: int, defect: str) -> None:
    status, off = verdict(seed, defect)
    assert status == "DOUBTFUL" or (status == "FOUND" and off < 2.0)


def test_a_weighed_platform_gives_the_gain_of_the_load_cells() -> None:
    twin = twin_of(10, DEFECTS[0])
    weighed = drawn_robot().replace(mass=twin.mass, tolerances={**drawn_robot().tolerances, "mass": 0.01})
    found = sl.calibrate(weighed, log_of_twin(twin, 10), folds=0)
    which = found.parameters.where[kinds.GAIN]
    gain, error = found.values[which].mean(), np.sqrt(found.covariance[np.ix_(which, which)].mean())
    assert found.status is sl.CalibrationStatus.FOUND
    assert (np.abs(twin.gain - 1.0) > 0.05).all()
    assert error < 0.02
    assert abs(gain - twin.gain.mean()) < 2.0 * error


@pytest.mark.soak
def test_random_defects_give_true_or_doubtful_results_and_faultless_logs_are_found() -> None:
    defects = [verdict(seed, DEFECTS[seed % len(DEFECTS)]) for seed in range(200)]
    right = [status == "DOUBTFUL" or (status == "FOUND" and off < 2.0) for status, off in defects]
    honest = Counter(verdict(seed, None)[0] for seed in range(1000, 1200))
    print(f"{100.0 * np.mean(right):.1f} % of the defects, {honest['FOUND'] / 2.0:.1f} % of the honest logs")
    assert np.mean(right) >= 0.95
    assert honest["FOUND"] >= 188
