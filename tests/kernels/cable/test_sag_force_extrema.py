"""Extrema of sag forces compared with signs of differences on fine grids."""

import numpy as np
import pytest

from sagline.kernels.cable.sag_forces import LEAST_TENSION, MOST_TENSION, Curves, Section
from tests.kernels.cable.curves import pulls_of, random_curves, sag_force_range, with_turns

GRID = 3000


def extrema_on_a_grid(curves: Curves, i: int) -> tuple[list[float], list[float]]:
    """Tensions of a fine grid at which the sag force is smaller or larger than at both neighbors."""
    tensions = np.geomspace(curves.cables.low[i], curves.cables.high[i], GRID)
    sag_forces = pulls_of(curves, i, tensions)
    step = np.diff(sag_forces)
    step[np.abs(step) < 1e-13 * curves.cables.half_weight[i]] = 0.0
    falls_then_rises = np.flatnonzero((step[:-1] < 0) & (step[1:] > 0)) + 1
    rises_then_falls = np.flatnonzero((step[:-1] > 0) & (step[1:] < 0)) + 1
    return list(tensions[falls_then_rises]), list(tensions[rises_then_falls])


def check(curves: Curves) -> tuple[int, int]:
    """Compare the extrema of all cables with those on a grid; return the numbers of each kind."""
    found = [0, 0]
    for i in range(curves.cables.low.size):
        width = np.log(curves.cables.high[i] / curves.cables.low[i]) / GRID
        for kind, row in enumerate((LEAST_TENSION, MOST_TENSION)):
            grid = extrema_on_a_grid(curves, i)[kind]
            turn = curves.turns[row, i]
            assert len(grid) <= 1
            if grid:
                found[kind] += 1
                assert np.log(turn / grid[0]) == pytest.approx(0.0, abs=2 * width + 1e-3)
            elif np.isfinite(turn):  # too flat for the grid: it must be close to an end, or a shallow pair
                assert curves.cables.sine[i] < 0
                assert curves.cables.low[i] <= turn <= curves.cables.high[i]
    return found[0], found[1]


def test_extrema_agree_with_a_fine_grid() -> None:
    rng = np.random.default_rng(11)
    counts = np.array([check(with_turns(random_curves(rng, 8))) for _ in range(30)]).sum(axis=0)
    assert (counts > 10).all()


@pytest.mark.soak
def test_extrema_of_twenty_thousand_cables() -> None:
    rng = np.random.default_rng(12)
    for _ in range(2500):
        check(with_turns(random_curves(rng, 8)))


def test_sag_forces_of_steep_slack_cables_are_in_their_range() -> None:
    rng = np.random.default_rng(3)
    for _ in range(60):
        curves = random_curves(rng, 8)
        cables = curves.cables
        cables.sine[:] = -np.sqrt(1.0 - rng.uniform(0.01, 0.4, 8) ** 2)
        cables.cosine[:] = np.sqrt(1.0 - cables.sine**2)
        cables.low[:] = cables.half_weight / rng.uniform(2.0, 5.0, 8)
        cables.high[:] = cables.low * 10 ** rng.uniform(0.3, 4.0, 8)
        cables.stiffness[:] = np.maximum(cables.high, cables.half_weight * 10 ** rng.uniform(0.3, 6.0, 8))
        with_turns(curves)
        for i in range(8):
            low, high = float(cables.low[i]), float(cables.high[i])
            tensions = np.geomspace(low, high, 500)
            tensions[0], tensions[-1] = low, high
            pulls = pulls_of(curves, i, tensions)
            least, most = sag_force_range(curves, i, Section(low, high, pulls[0], pulls[-1]))
            rounding = 1e-9 * cables.half_weight[i]
            assert least <= pulls.min() + rounding
            assert most >= pulls.max() - rounding
