"""Sag forces over ranges of tensions compared with fine grids."""

import numpy as np
import pytest

from sagline.kernels.cable import sag_forces
from sagline.kernels.cable.sag_forces import LEAST_TENSION, MOST_TENSION, Curves, Section
from sagline.kernels.codes import EMPIRICAL, PARABOLIC, STRAIGHT
from tests.kernels.cable.curves import pulls_of, random_curves, sag_force_range, with_turns
from tests.kernels.compiled import from_python

most_along = from_python(sag_forces.most_along)
sag_forces_at = from_python(sag_forces.sag_forces_at)
slopes_at = from_python(sag_forces.slopes_at)


def section(curves: Curves, i: int, low: float, high: float) -> Section:
    at_low, at_high = pulls_of(curves, i, np.array([low, high]))
    return Section(low, high, float(at_low), float(at_high))


def test_a_range_of_sag_forces_is_that_of_a_fine_grid() -> None:
    rng = np.random.default_rng(1)
    turned = 0
    for _ in range(40):
        curves = with_turns(random_curves(rng, 8))
        turned += np.isfinite(curves.turns[[LEAST_TENSION, MOST_TENSION]]).sum()
        for i in range(8):
            low, high = np.sort(np.exp(rng.uniform(np.log(curves.cables.low[i]), np.log(curves.cables.high[i]), 2)))
            grid = pulls_of(curves, i, np.geomspace(low, high, 400))
            least, most = sag_force_range(curves, i, section(curves, i, low, high))
            size = float(curves.cables.half_weight[i])
            assert least <= grid.min() + 1e-9 * size
            assert most >= grid.max() - 1e-9 * size
            # a grid of 400 points misses an extremum by at most the curvature over half a step
            assert least == pytest.approx(grid.min(), abs=1e-3 * (grid.max() - grid.min()) + 1e-9 * size)
            assert most == pytest.approx(grid.max(), abs=1e-3 * (grid.max() - grid.min()) + 1e-9 * size)
    assert turned > 60


def test_the_largest_force_along_a_direction_agrees_with_a_fine_grid() -> None:
    rng = np.random.default_rng(2)
    exact = 0
    for _ in range(40):
        curves = with_turns(random_curves(rng, 8))
        for i in range(8):
            low, high = float(curves.cables.low[i]), float(curves.cables.high[i])
            along, hanging = rng.normal() * 10 ** rng.uniform(-4, 0), rng.normal()
            tensions = np.geomspace(low, high, 2000)
            values = along * tensions - hanging * pulls_of(curves, i, tensions)
            bound = most_along(curves, i, section(curves, i, low, high), along, hanging)
            size = np.abs(values).max() + abs(hanging) * float(curves.cables.half_weight[i])
            assert bound >= values.max() - 1e-9 * size
            end = values[-1] if along > 0 else values[0]
            # if the tension dominates the steepest sag force, the better end is the result
            slope = np.abs(np.diff(values - along * tensions) / np.diff(tensions)).max()
            if abs(along) > 3.0 * slope:
                exact += 1
                assert bound == pytest.approx(end, abs=1e-12 * size)
            assert (
                bound <= max(values[0], values[-1]) + abs(hanging) * np.ptp(pulls_of(curves, i, tensions)) + 1e-9 * size
            )
    assert exact > 100


def test_an_unbounded_section_is_used_only_against_the_tension() -> None:
    curves = with_turns(random_curves(np.random.default_rng(3), 1))
    low = float(curves.cables.low[0])
    at_low = float(pulls_of(curves, 0, np.array([low]))[0])
    endless = Section(low, np.inf, at_low, 0.0)
    assert most_along(curves, 0, endless, 1.0, 0.5) == np.inf
    assert np.isfinite(most_along(curves, 0, endless, -1.0, 0.5))


def test_all_sag_forces_agree_with_single_ones() -> None:
    rng = np.random.default_rng(4)
    for _ in range(20):
        curves = random_curves(rng, 8)
        tau = np.sqrt(curves.cables.low * curves.cables.high)
        sag_force, slope, bend = np.empty(8), np.empty(8), np.empty(8)
        sag_forces_at(curves, tau, sag_force)
        expected = np.array([pulls_of(curves, i, tau[i : i + 1])[0] for i in range(8)])
        np.testing.assert_allclose(sag_force, expected, rtol=1e-12, atol=1e-12 * curves.cables.half_weight.max())
        slopes_at(curves, tau, slope, bend)
        for i in range(8):  # five-point differences with steps twenty times larger
            h = 2e-3 * tau[i]
            p = pulls_of(curves, i, tau[i] + h * np.array([-2, -1, 0, 1, 2]))
            assert slope[i] == pytest.approx((p[0] - 8 * p[1] + 8 * p[3] - p[4]) / (12 * h), rel=1e-6, abs=1e-9)
            second = (-p[0] + 16 * p[1] - 30 * p[2] + 16 * p[3] - p[4]) / (12 * h * h)
            if (
                curves.cables.half_weight[i] > 0.2 * tau[i]
            ):  # for tauter cables, the rounding of the sag force is visible
                assert bend[i] == pytest.approx(second, rel=1e-2)


@pytest.mark.parametrize("model", [STRAIGHT, EMPIRICAL, PARABOLIC])
def test_sag_forces_of_other_models_do_not_depend_on_the_tension(model: int) -> None:
    curves = with_turns(random_curves(np.random.default_rng(5), 4, model))
    assert np.isnan(curves.turns).all()
    slope, bend, sag_force, no_tension = np.empty(4), np.empty(4), np.empty(4), np.zeros(4)
    slopes_at(curves, no_tension, slope, bend)
    np.testing.assert_array_equal((slope, bend), 0.0)
    sag_forces_at(curves, no_tension, sag_force)
    np.testing.assert_allclose(sag_force, [pulls_of(curves, i, curves.cables.low[i : i + 1])[0] for i in range(4)])
