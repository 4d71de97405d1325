"""Free travel of a platform in a known workspace."""

import re

import numpy as np
import pytest

from sagline.viewer.tension_scale import ForceUnit
from sagline.viewer.workspace import NAMES, free_travel
from tests.viewer.analytic import PER_METER, RADIUS, WALL, ball

LOW, HIGH = np.full(3, -2.0), np.full(3, 2.0)
ALL = np.arange(6)
NEWTON = ForceUnit("N", 1.0, ".1f")


def test_travel_ends_at_the_boundary_or_at_the_box() -> None:
    start = np.array([0.2, -0.3, 0.4])
    found = free_travel(ball, start, ALL, LOW, np.array([2.0, 0.5, 2.0]))
    half = np.sqrt(RADIUS**2 - start @ start + start**2)  # of the chord along each axis
    exact = [WALL - start[0], 0.5 - start[1], half[2] - start[2], *(half + start)]
    np.testing.assert_allclose(found.distance, exact, atol=2e-5)
    assert found.inside
    assert found.crossed.tolist() == [True, False, True, True, True, True]
    assert found.cable.tolist() == [3, -1, 3, 3, 3, 5]
    assert found.margin == pytest.approx(PER_METER * (RADIUS - np.linalg.norm(start)), rel=1e-12)
    np.testing.assert_allclose(np.linalg.norm(found.ends[[2, 3, 4, 5]], axis=1), RADIUS, atol=2e-5)


def test_the_nearest_end_is_printed_first() -> None:
    found = free_travel(ball, np.array([0.2, -0.3, 0.4]), ALL, LOW, HIGH)
    html = found.text(NEWTON)
    nearest = NAMES[int(found.distance.argmin())]
    assert re.search(rf"Boundary</b> {found.distance.min():.3f} m [a-z]+ {re.escape(nearest)}, cable 3", html)
    assert "<b>Margin</b> 96.1 N" in html
    assert html.count("the boundary") == 6


def test_travel_from_outside_leads_back() -> None:
    found = free_travel(ball, np.array([-1.9, 0.0, -0.1]), ALL, LOW, HIGH)
    assert not found.inside
    assert found.crossed.tolist() == [True, False, False, False, False, False]
    assert found.distance[0] == pytest.approx(1.9 - np.sqrt(RADIUS**2 - 0.01), abs=1e-4)
    html = found.text(NEWTON)
    assert "Workspace" in html
    assert "workspace, cable 5" in html


def test_a_planar_platform_has_four_directions() -> None:
    found = free_travel(ball, np.zeros(3), np.array([0, 2, 3, 5]), LOW, HIGH)
    np.testing.assert_allclose(found.distance, [WALL, RADIUS, RADIUS, RADIUS], atol=2e-5)


def test_a_platform_outside_of_the_box_finds_back_along_an_axis() -> None:
    found = free_travel(ball, np.array([0.0, 0.0, 5.0]), ALL, LOW, HIGH)
    assert found.crossed.tolist() == [False] * 5 + [True]
    assert found.distance[5] == pytest.approx(5.0 - RADIUS, abs=1e-3)
    assert "3.500 m along −z" in found.text(NEWTON)
    assert "No boundary" in free_travel(ball, np.array([3.0, 3.0, 5.0]), ALL, LOW, HIGH).text(NEWTON)
