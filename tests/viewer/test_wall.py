"""The highlighted side of the region near the platform, in the colors of the cables, brighter at smaller distances."""

import re
from itertools import pairwise

import numpy as np
import pytest

from sagline.viewer.tension_scale import ForceUnit, cable_color
from sagline.viewer.workspace import Hull, margin_text

SIDE = 41  # corners along each edge of a wall


def wall(*, on_box: bool = False) -> Hull:
    """A wall 4 m long and high in the plane x = 1 m, cable 2's above z = 0 and cable 5's below."""
    y, z = np.meshgrid(np.linspace(-2.0, 2.0, SIDE), np.linspace(-2.0, 2.0, SIDE))
    corners = np.stack((np.ones(y.size), y.ravel(), z.ravel()), axis=1)
    first = (np.arange(SIDE - 1)[:, None] * SIDE + np.arange(SIDE - 1)).ravel()
    faces = np.concatenate(
        [np.stack((first, first + 1, first + SIDE), 1), np.stack((first + 1, first + SIDE + 1, first + SIDE), 1)]
    )
    cable = np.where(corners[:, 2] > 1e-9, 2, 5)
    return Hull.of(corners, faces, np.zeros(len(corners)), cable, np.full(len(faces), on_box), "")


def area(vertices: np.ndarray, faces: np.ndarray) -> float:
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    return float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2.0)


def test_no_side_is_highlighted_from_far_away() -> None:
    assert wall().near_patches(np.array([-0.1, 0.0, 0.0]), 1.0) == []
    assert wall(on_box=True).near_patches(np.array([0.9, 0.0, 0.0]), 1.0) == []  # where the box ends there is no wall


@pytest.mark.parametrize("distance", [0.0, 0.3, -0.5])
def test_near_sides_are_brighter(distance: float) -> None:
    place = np.array([1.0 - distance, 0.5, 0.0])
    found = wall().near_patches(place, 1.0)
    assert {patch.color for patch in found} == {cable_color(2), cable_color(5)}
    whole = sum(area(patch.vertices, patch.faces) for patch in found)
    assert whole == pytest.approx(2.0 * np.pi * (1.0 - distance**2), rel=0.03)  # all within 1 m, on both sides
    aside = np.concatenate([patch.vertices[:, 0] - 1.0 for patch in found])
    assert np.count_nonzero(aside > 0.0) == np.count_nonzero(aside < 0.0)
    assert np.abs(aside).max() < 0.02  # m
    away: dict[float, list[float]] = {}
    for patch in found:
        middles = np.hstack((np.ones((len(patch.faces), 1)), patch.vertices[patch.faces].mean(axis=1)[:, 1:]))
        away.setdefault(patch.opacity, []).extend(np.linalg.norm(middles - place, axis=1))
    assert all(max(away[near]) <= min(away[far]) for near, far in pairwise(sorted(away, reverse=True)))
    for patch in found:
        height = patch.vertices[patch.faces][..., 2].mean(axis=1)
        assert np.all((height > -0.11) if patch.color == cable_color(2) else (height < 0.11))


def test_the_remaining_margin_is_stated() -> None:
    newtons, kilonewtons = ForceUnit("N", 1.0, ".1f"), ForceUnit("kN", 1e3, ".2f")
    assert margin_text(82.34, 3, newtons) == "82.3 N left, cable 3"
    assert re.findall(r"[\d.]+|kN|too", margin_text(-1520.0, 0, kilonewtons)) == ["1.52", "kN", "too", "0"]
    assert margin_text(12.0, -1, newtons) == "12.0 N left"
    assert re.match("nothing limits", margin_text(np.inf, -1, newtons))
    assert re.match("nothing holds", margin_text(-np.inf, -1, newtons))
