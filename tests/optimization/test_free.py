"""Design variables: symmetry of anchors, effects of the numbers, and refusals."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import sagline as sl
from sagline import InvalidValueError
from sagline.optimization.candidates import Candidates, PlatformBox, impossible
from tests.optimization.pair import UNDER, apart, pair
from tests.refusal import refused

ROBOT = sl.load_robot("article-suspended")
LIGHT = sl.CableChoice("light", sl.Cable(0.03, 2e4), cost=1.0)
OWN = sl.CableChoice("own", sl.Cable(ROBOT.cables.linear_density[0], ROBOT.cables.axial_stiffness[0]), cost=2.0)

UNLIMITED = sl.load_robot("ipanema-1").replace(tension_max=np.inf)
POSTS = sl.FreeAnchors("frame", -0.1, 0.1, along=[0, 0, 1], symmetry="together")


def moved(free: sl.FreeAnchors, *values: float, robot: sl.Robot = ROBOT) -> sl.Robot:
    return Candidates(robot, [free]).robots(np.array([values]), ["moved"])[0]


def test_mirrored_anchors_stay_mirrored() -> None:
    found = moved(sl.FreeAnchors("frame", [-1, -1, -1], [1, 1, 1], symmetry="xy"), -0.5, -0.25, 0.125)
    shift = found.frame_anchors - ROBOT.frame_anchors
    np.testing.assert_allclose(np.abs(shift), np.tile([0.5, 0.25, 0.125], (8, 1)))
    for axis in (0, 1):
        mirror = np.array([-1.0 if k == axis else 1.0 for k in range(3)])
        assert {tuple(row) for row in found.frame_anchors.round(9)} == {
            tuple(row) for row in (found.frame_anchors * mirror).round(9)
        }
    assert (np.abs(found.frame_anchors[:, 0]) == 7.0).all()


def test_rotated_anchors_stay_on_a_regular_polygon() -> None:
    angle = 2.0 * np.pi * np.arange(3) / 3.0 + 0.3
    frame = np.column_stack((3.0 * np.cos(angle), 3.0 * np.sin(angle), np.full(3, 4.0)))
    robot = sl.Robot("tripod", frame, np.zeros((3, 3)), sl.Cable(0.05, 5e4), 10.0, motion_pattern="3T")
    found = moved(sl.FreeAnchors("frame", -1.0, 1.0, symmetry="turned"), 0.3, -0.4, 0.5, robot=robot).frame_anchors
    edges = np.linalg.norm(found - np.roll(found, 1, axis=0), axis=1)
    np.testing.assert_allclose(edges, edges[0])
    np.testing.assert_allclose(found[0], frame[0] + [0.3, -0.4, 0.5])


def test_platform_anchors_move_in_the_platform_frame_and_together() -> None:
    found = moved(sl.FreeAnchors("platform", -0.1, 0.1, along=[0, 0, 2], symmetry="together", cables=[1, 3]), 0.05)
    shift = found.platform_anchors - ROBOT.platform_anchors
    np.testing.assert_allclose(shift[[1, 3]], [[0, 0, 0.05]] * 2)
    assert not shift[[0, 2, 4, 5, 6, 7]].any()
    assert found.frame_anchors is ROBOT.frame_anchors or np.array_equal(found.frame_anchors, ROBOT.frame_anchors)


def test_anchors_without_symmetry_are_independent() -> None:
    candidates = Candidates(ROBOT, [sl.FreeAnchors("frame", [-1, 0, 0], [1, 0, 0.5], cables=[2, 5])])
    names = ["frame_anchors[2] x", "frame_anchors[2] z", "frame_anchors[5] x", "frame_anchors[5] z"]
    assert [part.name for part in candidates.parts] == names
    first, found = candidates.cables(np.array([[0.0, 0.0, 0.0, 0.0], [0.1, 0.2, 0.3, 0.4]]))
    np.testing.assert_array_equal(first[:, :3], ROBOT.frame_anchors)
    found -= first
    np.testing.assert_allclose(found[2, :3], [0.1, 0.0, 0.2])
    np.testing.assert_allclose(found[5, :3], [0.3, 0.0, 0.4])
    assert np.count_nonzero(found) == 4


def test_cables_and_limits_of_the_robot_change() -> None:
    strong = sl.CableChoice("strong", sl.Cable(0.2, 9e5, diameter=0.01), tension_max=4000.0)
    candidates = Candidates(ROBOT, [sl.FreeCable([LIGHT, OWN, strong]), sl.FreeLimit("tension_min", 10.0, 80.0)])
    assert candidates.start.tolist() == [1.0, 25.0]
    light, own, heavy = candidates.robots(np.array([[0.0, 40.0], [1.0, 25.0], [2.0, 80.0]]), ["a", "b", "c"])
    assert light.cables.linear_density[3] == 0.03
    assert light.tension_min[0] == 40.0
    assert np.array_equal(own.cables.axial_stiffness, ROBOT.cables.axial_stiffness)
    assert heavy.tension_max[7] == 4000.0
    assert heavy.cables.diameter is not None
    points = candidates.units(np.array([[0.0, 40.0], [1.0, 25.0], [2.0, 80.0]]))
    np.testing.assert_allclose(candidates.values(points), [[0.0, 40.0], [1.0, 25.0], [2.0, 80.0]])
    assert candidates.values(np.array([[1.0, 0.0], [0.0, 1.0]])).tolist() == [[2.0, 10.0], [0.0, 80.0]]


def test_impossible_robots_are_recognized_without_creating_them() -> None:
    frame = sl.FreeAnchors("frame", [-1, 0, 0], [0, 0, 0], cables=[1])
    platform = sl.FreeAnchors("platform", [-1, 0, -1], [1, 1, 1], cables=[1])
    limit = sl.FreeLimit("tension_min", 0.0, 3000.0)
    candidates = Candidates(ROBOT, [frame, platform, limit])
    twin = [0.0, *(ROBOT.platform_anchors[0] - ROBOT.platform_anchors[1]), 25.0]
    values = np.array([[0.0, 0.0, 0.0, 0.0, 25.0], twin, [0.0, 0.0, 0.0, 0.0, 2500.0], [-0.5, *twin[1:]]])
    none = impossible(candidates.cables(values))
    assert none.tolist() == [False, True, True, False]
    for row, wrong in zip(values, none, strict=True):
        if wrong:
            with pytest.raises(InvalidValueError):
                candidates.robots(row[None], ["none"])
        else:
            candidates.robots(row[None], ["one"])


def asked(**changes: Any) -> sl.Front:
    given: dict[str, Any] = {"free": [apart()], "goals": ["least_margin"], "poses": UNDER, "evaluations": 16}
    return sl.design(pair(), **{**given, **changes})


REFUSED: dict[str, tuple[Callable[[], object], tuple[str, ...]]] = {  # item, value and allowed range
    "unknown goal": (
        lambda: asked(goals=["workspace"]),
        (
            "goal",
            "'workspace'",
            "workspace_share, mean_margin, least_margin, largest_tension, largest_sag, least_stiffness, cable_cost",
            "Did you mean workspace_share?",
        ),
    ),
    "crossed bounds": (
        lambda: sl.FreeAnchors("frame", 0.5, -0.5, along=[0, 0, 1]),
        ("low", "0.5 m", "<= high, -0.5 m"),
    ),
    "crossed limits": (lambda: sl.FreeLimit("tension_max", 50.0, 20.0), ("low", "50 N", "< high, 20 N")),
    "a start outside": (
        lambda: sl.FreeAnchors("frame", 0.5, 1.0, along=[0, 0, 1]),
        ("low[0] to high[0]", "0.5 to 1 m", "0 m inside"),
    ),
    "a limit outside": (
        lambda: asked(free=[sl.FreeLimit("tension_max", 50.0, 80.0)]),
        ("free[0]: the robot's tension_max", "20 N", "50 to 80 N"),
    ),
    "a cable not in the catalogue": (
        lambda: asked(free=[sl.FreeCable([LIGHT, OWN])]),
        ("free[0]: the robot's cable 0", "10 g/m, 1e+06 N, up to 20 N"),
    ),
    "a budget too small": (
        lambda: asked(evaluations=15),
        ("evaluations", "15", ">= 16, two generations of cma for 1 free numbers"),
    ),
    "past the mirror": (
        lambda: asked(free=[sl.FreeAnchors("frame", -1.5, 1.0, along=[1, 0, 0], symmetry="x")]),
        ("free[0]: the shift along x", "up to 1.5 m inward", "< 1 m, the distance to the plane x = 0 m"),
    ),
    "twice the same": (lambda: asked(free=[apart(), apart()]), ("free", "twice among frame_anchors x")),
    "a cost that nobody gave": (lambda: asked(goals=["cable_cost"]), ("goals: cable_cost",)),
    "no such cable": (
        lambda: asked(free=[sl.FreeAnchors("frame", -1, 1, cables=[2])]),
        ("free[0]: cables", "2", "0 to 1"),
    ),
    "nothing limits": (
        lambda: sl.design(UNLIMITED, [POSTS], ["least_margin"], evaluations=16, grid=(2, 2, 2), model=sl.Straight()),
        ("least_margin of ipanema-1", "inf N", "a finite number"),
    ),
    "a tilted box": (
        lambda: sl.design(ROBOT, [apart()], ["least_margin"], box=ROBOT.test_box),
        ("box: tilt", "0.174533 rad"),
    ),
    "weights on a front": (
        lambda: asked(goals=[sl.Goal("least_margin", weight=2.0)], optimizer="nsga2", evaluations=60),
        ("weight of least_margin", "2"),
    ),
    "through the platform": (
        lambda: sl.design(
            ROBOT,
            [POSTS],
            ["mean_margin"],
            poses=sl.Pose([[0.0, 0.0, 3.0], [7.4, 5.4, 5.9]], np.stack([np.eye(3)] * 2)),
        ),
        ("the frame anchor of cable 0, at 7.5, 5.5, 6 m", "inside the platform at pose 1"),
    ),
}


@pytest.mark.parametrize("name", REFUSED)
def test_invalid_design_variables_are_refused_in_one_line(name: str) -> None:
    make, parts = REFUSED[name]
    with refused(*parts, kind=InvalidValueError) as caught:
        make()
    text = str(caught.value)
    assert len(text) < 300
    assert "\n" not in text


def test_candidates_with_an_anchor_inside_the_platform_are_dropped() -> None:
    through = sl.FreeAnchors("frame", -4.0, 0.0, along=[0, 0, 1], symmetry="together")
    poses = sl.Pose([[7.4, 5.4, 3.0], [0.0, 0.0, 2.0]], np.stack([np.eye(3)] * 2))
    front = sl.design(ROBOT, [through], ["mean_margin"], poses=poses, evaluations=60)
    assert ROBOT.platform_size is not None
    half = 0.5 * ROBOT.platform_size[2]
    middle = 0.5 * np.ptp(ROBOT.platform_anchors[:, 2]) + ROBOT.platform_anchors[:, 2].min()
    height = 6.0 + front.evaluated[:, 0] - 3.0 - middle
    dropped = np.isnan(front.evaluated_values[:, 0])
    assert 0 < dropped.sum() < len(dropped)
    assert np.array_equal(dropped, np.abs(height) < half)


def test_moving_anchors_keep_the_platform_anchors() -> None:
    up = sl.FreeAnchors("frame", -3.0, 3.0, along=[0, 0, 1], symmetry="together")
    poses = sl.Pose([[7.4, 5.4, 5.9], [0.0, 0.0, 3.0]], np.stack([np.eye(3)] * 2))
    found = sl.moving_anchors(ROBOT, [up], poses=poses)
    assert found.fixed_margin[0] == -np.inf
    assert np.isfinite(found.fixed_margin[1])
    assert np.isfinite(found.margin).all()
    boxes = PlatformBox(ROBOT, poses)
    shifts = found.moved[:, 0, None, None] * [0.0, 0.0, 1.0]
    assert boxes.holds_at(ROBOT.frame_anchors + 0.0 * shifts, poses).tolist() == [True, False]
    assert not boxes.holds_at(ROBOT.frame_anchors + shifts, poses).any()
    points = np.random.default_rng(0).uniform(-0.3, 0.3, (50, 2, 1, 3)) + poses.position[:, None]
    own = [[boxes_of.holds(one).item() >= 0 for boxes_of, one in zip(_each(poses), row, strict=True)] for row in points]
    assert np.array_equal([boxes.holds_at(row, poses) for row in points], own)
    assert 0 < np.count_nonzero(own) < 100


def _each(poses: sl.Pose) -> list[PlatformBox]:
    return [PlatformBox(ROBOT, poses[k : k + 1]) for k in range(len(poses))]


def test_shares_of_a_robot_without_limits_are_finite() -> None:
    front = sl.design(UNLIMITED, [POSTS], ["workspace_share"], evaluations=16, grid=(2, 2, 2))
    assert front.start_values[0] == 1.0
    assert not front.better
