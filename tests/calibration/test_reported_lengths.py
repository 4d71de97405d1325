"""Reported lengths with an unknown scale, and relative lengths."""

from collections.abc import Iterable

import numpy as np
import pytest

import sagline as sl
from tests.calibration.synthetic import log_of, true_robot
from tests.tiers import extended


@pytest.mark.parametrize("seeds", [range(2), pytest.param(range(12), marks=extended)])
@pytest.mark.parametrize("shared", [False, True])
def test_the_scale_is_found_within_its_standard_error(shared: bool, seeds: Iterable[int]) -> None:
    nominal, deviations = sl.load_robot("cogiro"), []
    for seed in seeds:
        scale = 1.0 + 0.02 * np.random.default_rng(seed).normal(size=1 if shared else 8)
        log = log_of(true_robot(nominal, seed=seed), 24, seed).log
        log = log.replace(unstrained_length=log.readings / scale)
        found = sl.calibrate(nominal, log, ("default", sl.Unknown("length_scale", shared=shared)), folds=0)
        assert found.status is sl.CalibrationStatus.FOUND
        which = [k for k, name in enumerate(found.parameters.names) if name == "length_scale"]
        assert np.all(found.standard_error[which] < 0.005)  # the prior has 0.05
        deviations.append((found.values[which] - scale) / found.standard_error[which])
        whole = found.forward(log.readings[:1], found.poses[:1])
        assert np.linalg.norm(whole.pose.position - found.poses[:1].position) < 0.02
    assert np.mean(np.abs(deviations) < 2.0) >= 0.9


@pytest.mark.parametrize("seeds", [range(2), pytest.param(range(12), marks=extended)])
def test_relative_lengths_with_load_cells(seeds: Iterable[int]) -> None:
    nominal, deviations = sl.load_robot("cogiro"), []
    for seed in seeds:
        truth = true_robot(nominal, seed=seed)
        made = log_of(truth, 24, seed)
        zero = made.log.readings[5]
        log = made.log.replace(unstrained_length=made.log.readings - zero)
        found = sl.calibrate(nominal, log, folds=0)
        assert found.status is sl.CalibrationStatus.FOUND
        which = [name == "length_zero" for name in found.parameters.names]
        deviations.append((found.length_offset - zero - truth.length_offset) / found.standard_error[which])
        assert np.isinf(found.parameters.prior_deviation[which]).all()
    assert np.mean(np.abs(deviations) < 2.0) >= 0.9
