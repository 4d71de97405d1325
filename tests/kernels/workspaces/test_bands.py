"""Ranges of sag forces from their ends and first order, against fine grids of exact sag forces."""

import inspect
import math
from typing import Any

import numpy as np
import pytest

import sagline as sl
from sagline.core.arrays import Array
from sagline.kernels.workspaces import sag_force_bounds
from tests.kernels.cable.plain import plain_cables

GRID = 300
between_ends = inspect.unwrap(sag_force_bounds.range_between_ends)


def cables_and_pulls(rng: np.random.Generator, count: int) -> tuple[Any, Array, Array]:
    """Cables of 2 N weight below their frame ends, and sag forces on grids of tensions, (N, GRID)."""
    sine = rng.uniform(-1.0, 0.0, count)
    level, steep = rng.random(count) < 0.3, rng.random(count) < 0.2
    sine[level] = -(10 ** rng.uniform(-5, 0, level.sum()))
    sine[steep] = 10 ** rng.uniform(-9, -1, steep.sum()) - 1.0
    low = 10 ** rng.uniform(0.5, 3, count)  # of half the weight
    high = low * 10 ** rng.uniform(0.01, 3, count)
    stiffness = high / 10 ** rng.uniform(-7, -0.83, count)
    cosine = np.sqrt(1.0 - sine * sine)
    tension = np.geomspace(low, high, GRID, axis=-1)
    tension[:, 0], tension[:, -1] = low, high
    cable = sl.Cable(np.full((count, 1), 2.0), stiffness[:, None])
    hung = sl.Catenary().from_tension(cable, cosine[:, None], sine[:, None], tension, 1.0)
    sag_force = hung.vertical_force - tension * sine[:, None]
    rows = np.zeros((sag_force_bounds.BAND_ROWS, count))
    rows[sag_force_bounds.LOW], rows[sag_force_bounds.TAUT] = low, high
    rows[sag_force_bounds.SAG_FORCE_LOW], rows[sag_force_bounds.SAG_FORCE_HIGH] = sag_force[:, 0], sag_force[:, -1]
    cables = plain_cables(count, np.nan, half_weight=np.ones(count), sine=sine, cosine=cosine, stiffness=stiffness)
    return cables, rows, sag_force


def check(rng: np.random.Generator, count: int) -> tuple[Array, Array]:
    """Compare; excess width of the ranges, NaN where undecided; whether sag forces turn between their ends."""
    cables, rows, sag_force = cables_and_pulls(rng, count)
    found = np.array([between_ends(cables, i, rows) for i in range(count)])
    told = ~np.isnan(found[:, 0])
    rounding = 1e-14 * rows[sag_force_bounds.TAUT]
    assert (found[told, 0] <= (sag_force.min(axis=1) + rounding)[told]).all()
    assert (found[told, 1] >= (sag_force.max(axis=1) - rounding)[told]).all()
    turns = (sag_force.max(axis=1) > np.maximum(sag_force[:, 0], sag_force[:, -1]) + 1e-9) | (
        sag_force.min(axis=1) < np.minimum(sag_force[:, 0], sag_force[:, -1]) - 1e-9
    )
    return found[:, 1] - found[:, 0] - np.ptp(sag_force, axis=1), turns


def test_no_pull_is_outside_its_range_and_few_ranges_are_much_too_wide() -> None:
    wider, turns = check(np.random.default_rng(31), 6000)
    told = ~np.isnan(wider)
    assert (turns & told).sum() > 1000
    assert told.mean() > 0.7
    assert np.quantile(wider[told], 0.9) < 5e-4
    assert wider[told].max() < 0.05


@pytest.mark.soak
def test_no_pull_of_a_million_cables_is_outside_its_range() -> None:
    rng = np.random.default_rng(32)
    for _ in range(50):
        check(rng, 20_000)


def test_cables_above_their_frame_ends_or_with_pulleys() -> None:
    rows = np.zeros((sag_force_bounds.BAND_ROWS, 1))
    rows[
        [sag_force_bounds.LOW, sag_force_bounds.TAUT, sag_force_bounds.SAG_FORCE_LOW, sag_force_bounds.SAG_FORCE_HIGH],
        0,
    ] = (
        5.0,
        50.0,
        1.2,
        0.9,
    )
    given = {"half_weight": np.ones(1), "cosine": np.array([0.8]), "stiffness": np.array([1e5])}
    above = plain_cables(1, np.nan, sine=np.array([0.6]), **given)
    assert between_ends(above, 0, rows) == (0.9, 1.2)
    below = plain_cables(1, np.nan, sine=np.array([-0.6]), **given)._replace(machine=True)
    assert all(math.isnan(end) for end in between_ends(below, 0, rows))
