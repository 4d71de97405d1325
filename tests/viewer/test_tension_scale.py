"""The colors of tensions."""

import numpy as np
import pytest

import sagline as sl
from sagline.viewer.tension_scale import GRAY, TensionScale

SCALE = TensionScale(10.0, 1000.0)


def test_places_are_logarithmic_and_stay_at_the_ends() -> None:
    shares = SCALE.share(np.array([1.0, 10.0, 100.0, 1000.0, 1e6]))
    assert shares == pytest.approx([0.0, 0.0, 0.5, 1.0, 1.0])


def test_colors_get_brighter_with_tension_and_unknown_is_gray() -> None:
    colors = SCALE.colors(np.geomspace(10.0, 1000.0, 50)).astype(float)
    luminance = colors @ [0.2126, 0.7152, 0.0722]
    assert np.all(np.diff(luminance) > -1.0)
    assert luminance[-1] - luminance[0] > 120.0
    assert np.array_equal(SCALE.colors(np.array([np.nan]))[0], GRAY)


def test_linear_colors_come_back_through_the_srgb_curve() -> None:
    tension = np.geomspace(10.0, 1000.0, 9)
    linear = SCALE.linear_colors(tension) / 255.0
    back = np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)
    dark = 12.92 / 2.0 / 255.0 * 1.01  # half a step of a byte where the curve is steepest
    assert np.abs(back - SCALE.colors(tension) / 255.0).max() < dark


def test_scale_spans_the_limits_of_a_robot() -> None:
    scale = TensionScale.of(sl.load_robot("article-mixed"))
    assert (scale.low, scale.high) == (25.0, 2000.0)
    assert scale.ticks() == (50.0, 100.0, 200.0, 500.0, 1000.0, 2000.0)


def test_robot_without_limits_is_scaled_by_its_weight() -> None:
    robot = sl.load_robot("article-mixed").replace(tension_min=0.0, tension_max=np.inf)
    scale = TensionScale.of(robot)
    assert scale.high == pytest.approx(4.0 * 50.0 * 9.81)
    assert scale.low == pytest.approx(scale.high / 100.0)
