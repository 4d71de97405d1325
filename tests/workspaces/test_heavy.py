"""Workspaces of robots with heavy cables compared with verdicts of the inverse."""

from __future__ import annotations

import numpy as np
import pytest

import sagline as sl
from tests.tiers import extended
from tests.workspaces.heavy import OPEN, RIGHT, compared, poses_at, random_robots, three_robots, with_density

THREE = dict(three_robots())


def check(name: str, robot: sl.Robot, count: int, cells: int) -> None:
    """Within the error bar, also close to the boundary, and rarely open."""
    found = compared(robot, count, cells, np.random.default_rng(41))
    print(f"{name}: {found.space.volume:.1f} ± {found.space.volume_error:.1f}, {found.volume:.1f} m3, {found[3:]}")
    assert found.away <= 1.0
    assert found.contradictions == 0
    assert found.wrong_sign == 0
    assert found.open <= OPEN
    assert found.right >= RIGHT
    assert found.before_gap <= OPEN


@extended
@pytest.mark.parametrize("name", THREE)
def test_hulls_with_heavy_cables(name: str) -> None:
    check(name, THREE[name], 20_000, 10)


@pytest.mark.soak
def test_hulls_of_random_robots_with_heavy_cables_agree_with_a_million_verdicts() -> None:
    for name, robot in (*three_robots(), *random_robots(20, 42)):
        check(name, robot, 1_000_000, 20)


RANDOM = [robot for _, robot in random_robots(20, 42)]
DECIDED = [  # the multiple of the load has two local maxima, and the first one has the other sign
    (RANDOM[5], [-6.52295, 5.06309, 2.25818], sl.PoseStatus.SOLVED),
    (RANDOM[5], [-5.2136, 5.0186, 2.2581], sl.PoseStatus.SOLVED),
    (RANDOM[19], [-6.5229, 5.1676, 3.1610], sl.PoseStatus.SOLVED),
    # the cables supply some multiples of the load, but not the multiple zero
    (RANDOM[16], [-7.03091, -5.30348, 0.49996], sl.PoseStatus.INFEASIBLE),
    (RANDOM[16], [-7.03092, -5.27527, 0.99995], sl.PoseStatus.INFEASIBLE),
    (THREE["article-mixed, 0.3 kg/m"], [-7.1904, -5.04136, 0.49985], sl.PoseStatus.INFEASIBLE),
    # only the distribution iterations of the inverse find feasible tensions
    (RANDOM[10], [0.41291, 2.71026, 0.79175], sl.PoseStatus.SOLVED),
    (RANDOM[10], [2.12486, -0.83326, 1.58181], sl.PoseStatus.SOLVED),
]


@pytest.mark.parametrize(("robot", "position", "known"), DECIDED)
def test_margin_next_to_zero_has_the_sign_of_the_verdict(
    robot: sl.Robot, position: list[float], known: sl.PoseStatus
) -> None:
    pose = poses_at(np.array([position]))
    assert sl.inverse(robot, pose).status == known
    assert (sl.margin(robot, pose).value > 0.0) == (known == sl.PoseStatus.SOLVED)


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
