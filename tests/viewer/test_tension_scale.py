"""The colors of tensions."""

import numpy as np
import pytest
from numpy.typing import ArrayLike

import sagline as sl
from sagline.viewer.tension_scale import GRAY, TensionScale, cable_color

SCALE = TensionScale(10.0, 1000.0)


def test_positions_are_logarithmic_and_clipped_at_the_ends() -> None:
    shares = SCALE.fraction(np.array([1.0, 10.0, 100.0, 1000.0, 1e6]))
    assert shares == pytest.approx([0.0, 0.0, 0.5, 1.0, 1.0])


WHITE, DARK = (255, 255, 255), (27, 30, 35)  # backgrounds of the scene in page.css
# Machado, Oliveira & Fernandes 2009: how red-blind and green-blind eyes see linear sRGB
SIGHTS: dict[str, list[list[float]]] = {
    "all colors": [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
    "red-blind": [[0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216], [-0.003882, -0.048116, 1.051998]],
    "green-blind": [[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413], [-0.01182, 0.04294, 0.968881]],
}


def linear(colors: ArrayLike) -> np.ndarray:
    share = np.asarray(colors, dtype=float) / 255.0
    return np.where(share <= 0.04045, share / 12.92, ((share + 0.055) / 1.055) ** 2.4)


def luminance(colors: ArrayLike) -> np.ndarray:
    return linear(colors) @ [0.2126, 0.7152, 0.0722]


def lab(light: np.ndarray) -> np.ndarray:
    """CIELAB of linear sRGB, D65."""
    matrix = [[0.4124564, 0.3575761, 0.1804375], [0.2126729, 0.7151522, 0.0721750], [0.0193339, 0.1191920, 0.9503041]]
    x, y, z = np.cbrt(np.clip(light, 0.01, 1.0) @ np.transpose(matrix) / [0.95047, 1.0, 1.08883]).T
    return np.stack((116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)), axis=-1)


@pytest.mark.parametrize("background", [WHITE, DARK])
def test_all_tensions_are_visible_on_both_backgrounds(background: tuple[int, int, int]) -> None:
    colors = np.concatenate((SCALE.colors(np.geomspace(10.0, 1000.0, 200)), GRAY[None]))
    bright, other = luminance(colors), luminance(background)
    contrast = (np.maximum(bright, other) + 0.05) / (np.minimum(bright, other) + 0.05)
    assert contrast.min() >= 3.0
    assert np.array_equal(SCALE.colors(np.array([np.nan]))[0], GRAY)


@pytest.mark.parametrize("sight", SIGHTS)
def test_tensions_are_distinguishable_with_color_blindness(sight: str) -> None:
    colors = SCALE.colors(np.geomspace(10.0, 1000.0, 9))
    seen = lab(linear(colors) @ np.transpose(SIGHTS[sight]))
    apart = np.linalg.norm(seen[:, None] - seen, axis=2)[~np.eye(9, dtype=bool)]
    assert apart.min() > 8.0
    assert np.all(np.diff(seen[:, 2]) > 0.0)  # ever less blue, more yellow


@pytest.mark.parametrize("sight", SIGHTS)
def test_eight_cables_are_distinguishable_with_color_blindness(sight: str) -> None:
    seen = lab(linear([cable_color(k) for k in range(8)]) @ np.transpose(SIGHTS[sight]))
    apart = np.linalg.norm(seen[:, None] - seen, axis=2)[~np.eye(8, dtype=bool)]
    assert apart.min() > 20.0


def test_linear_colors_are_inverted_by_the_srgb_curve() -> None:
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
