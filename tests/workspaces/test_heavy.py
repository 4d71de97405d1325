"""Workspaces of robots with heavy cables compared with verdicts of the inverse."""

from __future__ import annotations

import numpy as np
import pytest

import sagline as sl
from tests.tiers import extended
from tests.workspaces.heavy import compared, random_robots, three_robots, with_density

THREE = dict(three_robots())


def check(name: str, robot: sl.Robot, count: int, cells: int) -> None:
    """Within the error bar, also close to the boundary, and rarely open."""
    found = compared(robot, count, cells, np.random.default_rng(41))
    print(f"{name}: {found.space.volume:.1f} ± {found.space.volume_error:.1f}, {found.volume:.1f} m3, {found[3:]}")
    assert found.away <= 1.0
    assert found.contradictions == 0
    assert found.open <= 0.01
    assert found.right >= 0.999


@extended
@pytest.mark.parametrize("name", THREE)
def test_hulls_with_heavy_cables(name: str) -> None:
    check(name, THREE[name], 20_000, 10)


@pytest.mark.soak
def test_hulls_of_random_robots_with_heavy_cables_agree_with_a_million_verdicts() -> None:
    for name, robot in (*three_robots(), *random_robots(20, 42)):
        check(name, robot, 1_000_000, 20)


def test_inner_and_outer_hull_enclose_the_exact_one() -> None:
    robot = with_density("article-suspended", 0.67)
    box = sl.PoseBox([-7.5, 0.0, 3.0], [7.5, 0.0, 6.0])
    inner, exact, outer = (
        sl.workspace(robot, box, cells=8, refine=False, hull=hull) for hull in ("inner", "exact", "outer")
    )
    assert 0.9 * exact.volume < inner.volume <= exact.volume * (1.0 + 1e-6)
    assert exact.volume * (1.0 - 1e-6) <= outer.volume < 1.1 * exact.volume
    assert "hull" in str(inner)
    assert "hull" not in str(exact)
