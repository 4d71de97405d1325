import re

import numpy as np
import pytest

import sagline as sl
from sagline import Mesh
from sagline.interference.pairs import Obstacle
from tests.interference.scenes import LEVEL, at_rest, box_mesh, cable_points, turned
from tests.refusal import refused
from tests.tiers import wide


@pytest.mark.parametrize("robot", wide(["cogiro", "article-suspended"]))
def test_a_mesh_of_a_box_has_the_distances_of_the_box(robot: str) -> None:
    rng = np.random.default_rng(21)
    state = at_rest(robot)
    for _ in range(5):
        where = cable_points(state, int(rng.integers(8)))[int(rng.integers(4001))]
        size, center, turn = rng.uniform(0.1, 1.0, 3), where + 0.7 * rng.normal(size=3), turned(rng)
        solid = sl.clearance(state, sl.Box(size, center, turn, name="block"), from_anchor=0.3)
        meshed = sl.clearance(state, box_mesh(size, center, turn), from_anchor=0.3)
        right = dict(zip(solid.pairs, solid.pair_distance, strict=True))
        for pair, value, low in zip(meshed.pairs, meshed.pair_distance, meshed.pair_low, strict=True):
            assert value == pytest.approx(right[pair], abs=1e-9 if right[pair] > 0.0 else 1e-7)
            assert low <= right[pair] + 1e-12
            assert low >= value - meshed.precision


@pytest.mark.parametrize("angle", wide([0.4, 0.0]))
def test_a_mesh_below_slack_cables_has_the_distances_of_its_box(angle: float) -> None:
    state = at_rest("deep", (1.0, 0.5, 1.5))
    assert state.cables.sag.max() > 1.0
    turn = sl.Pose.from_euler([0, 0, 0], angle, angle, 0.0).matrix
    for center in ([3.0, 0.0, -3.0], [-2.0, 3.0, -4.0], [0.0, 0.0, -8.0]):
        solid = sl.clearance(state, sl.Box([9.0, 9.0, 1.0], center, turn, name="block"))
        meshed = sl.clearance(state, box_mesh([9.0, 9.0, 1.0], center, turn))
        right = dict(zip(solid.pairs, solid.pair_distance, strict=True))
        for pair, value in zip(meshed.pairs, meshed.pair_distance, strict=True):
            assert value == pytest.approx(right[pair], abs=1e-9 if right[pair] > 0.0 else 1e-7)


def test_points_inside_a_mesh_touch_it_and_a_hollow_mesh_is_free_inside() -> None:
    state = at_rest()
    block = box_mesh(np.full(3, 100.0), np.zeros(3))
    assert sl.clearance(state, block).distance == 0.0
    room = Mesh(block.vertices, block.faces[:, ::-1], "room")
    assert room.volume == pytest.approx(-1e6)
    found = sl.clearance(state, room)
    pairs = [k for k, pair in enumerate(found.pairs) if "room" in pair]
    ends = state.exit_point
    assert found.pair_distance[pairs].min() == pytest.approx(50.0 - np.abs(ends).max(), abs=1e-9)


def test_a_mesh_as_platform_agrees_with_its_box() -> None:
    state = at_rest()
    ball, rod = sl.Sphere([3.0, 2.0, 2.0], 0.2), sl.Capsule([0, 3, 0], [0, 3, 4], 0.1)
    obstacles: list[Obstacle] = [ball, rod, sl.Box([1, 1, 1], [3, 0, 1])]
    size, center = np.array([0.8, 0.6, 0.5]), np.array([0.0, 0.1, 0.2])
    solid = sl.clearance(state, obstacles, platform=sl.Box(size, center), from_anchor=0.5)
    around = [*obstacles, box_mesh([0.2] * 3, [2.0, 2.0, 0.5])]
    meshed = sl.clearance(state, around, platform=box_mesh(size, center), from_anchor=0.5)
    right = {frozenset(pair): value for pair, value in zip(solid.pairs, solid.pair_distance, strict=True)}
    for pair, value in zip(meshed.pairs, meshed.pair_distance, strict=True):
        if "block" not in pair:
            assert value == pytest.approx(right[frozenset(pair)], abs=1e-9), pair
    corner = state.pose.position + center + 0.5 * size * (1.0, 1.0, -1.0)
    value = meshed.pair_distance[meshed.pairs.index(("platform", "block"))]
    assert value == pytest.approx(np.linalg.norm(np.maximum(np.abs(corner - (2.0, 2.0, 0.5)) - 0.1, 0.0)), abs=1e-9)


def test_batches_with_meshes_agree_with_their_poses() -> None:
    from sagline.interference.clearance import ClearanceRows

    robot = sl.load_robot("cogiro")
    state = sl.inverse(robot, sl.Pose([[1.0, 0.5, 1.5], [0.0, 0.0, 2.0], [-1.0, 1.0, 1.0]], LEVEL)).state
    block = box_mesh([1.0, 1.0, 1.0], [2.0, 1.0, 0.5])
    found = sl.clearance(state, block)
    for n in range(3):
        assert found.pair_distance[n] == pytest.approx(sl.clearance(state[n], block).pair_distance, abs=1e-12)
    rows = ClearanceRows(robot, (block,))
    value, pair = rows.least(state)
    assert value == pytest.approx(found.distance, abs=1e-4)
    assert [rows.pairs.names[k] for k in pair] == list(found.between)


def test_invalid_meshes_are_refused() -> None:
    block = box_mesh([1, 1, 1], [0, 0, 0])
    with refused("hall", allowed="a closed surface", kind=sl.InvalidValueError) as caught:
        Mesh(block.vertices, block.faces[1:], "hall")
    assert re.findall(r"\d+", caught.value.value) == ["3", "11", "1", "1", "1"]  # edges, triangles, size
    with refused("one face turned", allowed="a closed surface", kind=sl.InvalidValueError):
        Mesh(block.vertices, np.concatenate((block.faces[:1, ::-1], block.faces[1:])), "one face turned")
    with refused("faces[0, 1]", "8", "whole numbers from 0 to 7", kind=sl.InvalidValueError):
        Mesh(block.vertices, [[0, 8, 1], *block.faces[1:]])
    with refused("mesh mm", allowed="up to 100 times the robot", kind=sl.InvalidValueError) as caught:
        sl.clearance(at_rest(), box_mesh([4000.0, 1000.0, 1000.0], [0, 0, 0], name="mm"))
    assert "4000 x 1000 x 1000 m" in caught.value.value
    assert 'unit="mm"' in caught.value.next_step


def test_winding_numbers_distinguish_inside_and_outside() -> None:
    rng = np.random.default_rng(5)
    turn, size = turned(rng), np.array([1.0, 2.0, 0.5])
    block = box_mesh(size, np.array([1.0, 2.0, 3.0]), turn)
    points = rng.uniform((-1.0, 0.0, 1.0), (3.0, 4.0, 5.0), (500, 3))
    within = (np.abs((points - (1.0, 2.0, 3.0)) @ turn) < 0.5 * size).all(axis=1)
    assert block.encloses(points).tolist() == within.tolist()
    assert 5 < within.sum() < 100
