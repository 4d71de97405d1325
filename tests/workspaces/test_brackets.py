"""Both proofs of the bracket compared with verdicts of the inverse, which uses the exact curves of the cables."""

from __future__ import annotations

from functools import partial

import numpy as np
import pytest

import sagline as sl
from sagline.core.arrays import Array
from tests.tiers import extended
from tests.workspaces.all_facets import all_facets, crafted, mean_arm, no_load, pulls_on_a_grid
from tests.workspaces.test_margin import poses_of

Status = sl.MarginStatus
NEAR = 1e-4  # of the width of the bracket, distance of the loads beyond its ends


def contradictions(name: str, count: int, rng: np.random.Generator) -> tuple[int, int, int]:
    """Numbers of random poses with a random wrench that contradict the inverse, are open, and are outside."""
    robot = sl.load_robot(name)
    poses = poses_of(robot, count, rng)
    poses = poses[sl.margin(robot, poses).status != Status.NO_CHORD]
    scale = 10 ** rng.uniform(-3, -0.5) * max(robot.mass * robot.gravity, float(robot.tension_min.mean()))
    wrench = rng.normal(size=6) * scale * ([1.0] * 3 + [0.1] * 3)
    found = sl.margin(robot, poses, sl.WrenchPolytope([wrench]))
    known = sl.inverse(robot, poses, wrench=wrench).status
    wrong = (found.status == Status.FEASIBLE) & (known == sl.PoseStatus.INFEASIBLE)
    wrong |= (found.status == Status.INFEASIBLE) & (known == sl.PoseStatus.SOLVED)
    wrong |= (found.status == Status.SINGULAR) != (known == sl.PoseStatus.SINGULAR)
    assert (found.low <= found.value).all()
    assert (found.value <= found.high).all()
    return int(wrong.sum()), int((found.status == Status.OPEN).sum()), int((found.status == Status.INFEASIBLE).sum())


def test_verdicts_of_all_presets_agree_with_the_inverse() -> None:
    rng = np.random.default_rng(21)
    total = np.sum([contradictions(name, 250, rng) for name in sl.robot_names()], axis=0)
    assert total[0] == 0
    assert total[1] <= 12
    assert total[2] > 400


@pytest.mark.soak
def test_a_million_verdicts_of_all_presets_agree_with_the_inverse() -> None:
    rng = np.random.default_rng(22)
    names = sl.robot_names()
    total = np.zeros(3, dtype=int)
    for _ in range(50):
        total += np.sum([contradictions(name, 1_000_000 // 50 // len(names) + 1, rng) for name in names], axis=0)
    print(f"of a million poses {total[0]} contradict the inverse, {total[1]} are open, {total[2]} outside")
    assert total[0] == 0
    assert total[1] <= 1000


def at_the_border(robots: int, rng: np.random.Generator) -> tuple[int, int, int]:
    """Contradictions at loads just beyond both ends of the bracket, with and without interior extrema.

    And how often ours said feasible or infeasible there at all.
    """
    ours = without = said = 0
    for _ in range(robots):
        robot = crafted(rng, str(rng.choice(["2T", "1R2T", "3T"])))
        pose = sl.Pose(rng.uniform(-1, 1, 3) * [1.5, robot.motion_pattern == "3T", 1.5], np.eye(3))
        arm = mean_arm(robot)
        exact = pulls_on_a_grid(robot, pose, sl.Catenary())
        for pulls in (exact, exact.ends_only()):
            border = all_facets(robot, pose, pulls, no_load, arm)
            beyond = NEAR * (border.high - border.low) + 1e-7 * robot.tension_max.max()
            for end, row, shift in ((border.low, 1, -beyond), (border.high, 2, beyond)):
                wrench = -(end + shift) * border.directions[row] * ([1.0] * 3 + [arm * arm] * 3)
                known = sl.inverse(robot, pose, wrench=wrench).status
                if pulls is exact:
                    found = sl.margin(robot, pose, sl.WrenchPolytope([wrench]))
                    low, high = float(found.low), float(found.high)
                    said += low >= 0.0 or high < 0.0
                else:
                    _, low, high, _ = all_facets(robot, pose, pulls, partial(reach_of, wrench), arm)
                wrong = known == (sl.PoseStatus.INFEASIBLE if low >= 0.0 else sl.PoseStatus.SOLVED)
                contradicts = bool(wrong) and (low >= 0.0 or high < 0.0)
                ours, without = (ours + contradicts, without) if pulls is exact else (ours, without + contradicts)
    return ours, without, said


def reach_of(wrench: Array, normals: Array) -> Array:
    """The support of a single wrench."""
    return -normals @ wrench


@extended
def test_hard_robots_at_the_boundary_contradict_only_a_bracket_from_the_ends() -> None:
    ours, without, said = at_the_border(120, np.random.default_rng(23))
    assert ours == 0
    assert without > 0
    assert said > 100


@pytest.mark.soak
def test_five_thousand_hard_robots_at_the_boundary() -> None:
    ours, without, said = at_the_border(5000, np.random.default_rng(24))
    print(f"{ours} contradictions in {said} verdicts, and {without} without the interior extrema")
    assert ours == 0
    assert without > 50
