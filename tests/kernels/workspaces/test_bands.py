"""Differences of sag forces from their secants, compared with fine grids of exact sag forces."""

from typing import Any

import numpy as np
import pytest

import sagline as sl
from sagline.core.arrays import Array
from sagline.kernels.workspaces import sag_force_bounds
from tests.kernels.cable.plain import plain_cables
from tests.kernels.compiled import from_python

GRID = 150
off_secant = from_python(sag_force_bounds._from_secant)


def cables_and_pulls(rng: np.random.Generator, count: int) -> tuple[Any, Array, Array, Array]:
    """Cables of 2 N weight, tensions at their limits, (2, N), sag forces minus secants, and their rounding errors."""
    sine = rng.uniform(-1.0, 1.0, count)
    level, steep = rng.random(count) < 0.3, rng.random(count) < 0.1
    sine[level] = np.sign(sine[level]) * 10 ** rng.uniform(-5, 0, level.sum())
    sine[steep] = np.sign(sine[steep]) * (1.0 - 10 ** rng.uniform(-9, -1, steep.sum()))
    low = 10 ** rng.uniform(-1.0, 3, count)  # of half the weight
    high = low * 10 ** rng.uniform(0.01, 3, count)
    stiffness = high / 10 ** rng.uniform(-7, 1, count)
    cosine = np.sqrt(1.0 - sine * sine)
    even = np.linspace(0.0, 1.0, GRID) ** 2
    tension = np.hstack((np.geomspace(low, high, GRID, axis=-1), low[:, None] + (high - low)[:, None] * even))
    cable = sl.Cable(np.full((count, 1), 2.0), stiffness[:, None])
    hung = sl.Catenary().from_tension(cable, cosine[:, None], sine[:, None], tension, 1.0)
    sag_force = hung.vertical_force - tension * sine[:, None]
    first, last = sag_force[:, :1], sag_force[:, -1:]
    secant = first + (last - first) / (high - low)[:, None] * (tension - low[:, None])
    cables = plain_cables(count, np.nan, half_weight=np.ones(count), sine=sine, cosine=cosine, stiffness=stiffness)
    return cables, np.stack((low, high)), sag_force - secant, 1e-14 * (high + sag_force[:, 0])


def check(rng: np.random.Generator, count: int) -> Array:
    """Compare; return the ratio of the width of the bounds to the true one, for cables with a visible width."""
    cables, limits, off, rounding = cables_and_pulls(rng, count)
    found = np.array([off_secant(cables, i, *limits[:, i]) for i in range(count)])
    assert (found[:, 0] <= off.min(axis=1) + rounding).all()
    assert (found[:, 1] >= off.max(axis=1) - rounding).all()
    seen = np.ptp(off, axis=1) > 1e-6
    assert seen.sum() > 0.3 * count
    return np.asarray((found[seen, 1] - found[seen, 0]) / np.ptp(off[seen], axis=1))


def test_sag_forces_are_within_tight_bounds() -> None:
    wider = check(np.random.default_rng(31), 6000)
    assert np.median(wider) < 1.3
    assert np.quantile(wider, 0.9) < 8.0


@pytest.mark.soak
def test_two_million_cables_are_within_their_bounds() -> None:
    rng = np.random.default_rng(32)
    for _ in range(100):
        check(rng, 20_000)
