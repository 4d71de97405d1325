from itertools import product

import numpy as np
import pytest
from scipy.spatial import cKDTree

import sagline as sl
from sagline.core.arrays import Array
from tests.interference.scenes import at_rest, cable_points, from_box, from_segment, turned
from tests.tiers import wide

SAMPLES = (
    20_001  # points of a cable, 0.6 mm apart: the nearest one is too far by less than 1e-4 mm at a distance of 1 m
)


def refined(points: Array, distances: Array) -> float:
    """Least distance between samples, by the parabola through the three best ones."""
    k = int(np.clip(distances.argmin(), 1, len(distances) - 2))
    a, b, c = distances[k - 1 : k + 2]
    bend = a - 2.0 * b + c
    return float(b - 0.125 * (a - c) ** 2 / bend) if bend > 0.0 else float(b)


@pytest.mark.parametrize("robot", wide(["cogiro", "article-suspended", "expo2015-lucia-pulleys"]))
def test_distances_to_boxes_rods_and_balls_agree_with_samples(robot: str) -> None:
    rng = np.random.default_rng(7)
    place = (0.3, 0.2, 1.0) if robot == "expo2015-lucia-pulleys" else (1.0, 0.5, 1.5)
    state = at_rest(robot, place)
    assert not np.isnan(state.chord_tension).any()
    radius = 0.0 if state.one_robot.cables.diameter is None else 0.5 * state.one_robot.cables.diameter[0]
    for _ in range(6):
        where = cable_points(state, int(rng.integers(8)))[int(rng.integers(4001))]
        box = sl.Box(rng.uniform(0.1, 1.0, 3), where + rng.normal(size=3), turned(rng))
        rod = sl.Capsule(where + rng.normal(size=3), where + rng.normal(size=3), 0.05)
        ball = sl.Sphere(where + rng.normal(size=3), 0.1)
        found = sl.clearance(state, [box, rod, ball])
        measured = dict(zip(found.pairs, found.pair_distance, strict=True))
        for i in range(8):
            points = cable_points(state, i, SAMPLES)
            for name, distances in (
                ("box", from_box(points, box)),
                ("capsule", from_segment(points, rod.start, rod.end) - rod.radius),
                ("sphere", np.linalg.norm(points - ball.center, axis=1) - ball.radius),
            ):
                value, sampled = measured[f"cable {i}", name], float(distances.min()) - radius
                assert value == pytest.approx(sampled, abs=1e-4)
                assert value <= sampled + 1e-12
        assert (found.pair_low <= found.pair_distance).all()
        assert (found.pair_low >= found.pair_distance - found.precision).all()


@pytest.mark.parametrize("order", [[0, 1], [1, 0]])
def test_distance_of_a_taut_and_a_sagging_cable_agrees_with_samples(order: list[int]) -> None:
    """The chords are nearest at the platform, the cables often at the lowest part of the heavy one."""
    rng, elsewhere = np.random.default_rng(5), 0
    ends = np.array([[0.0, 0.0, 0.0], [0.1, 0.1, 0.2]])[order]
    density = np.array([0.01, 2.0])[order]
    for _ in range(10):
        frame = (np.array([[6.0, 0.0, 2.0], [6.0, 0.0, 4.0]]) + rng.uniform(-0.5, 0.5, (2, 3)))[order]
        tension = np.array([2000.0, rng.uniform(50.0, 100.0)])[order]
        robot = sl.Robot("pair", frame, ends, sl.Cable(density, 1e5), 10.0, motion_pattern="3T")
        run = ends - frame
        cables = sl.Catenary().from_tension(robot.cables, np.hypot(*run[:, :2].T), run[:, 2], tension)
        state = sl.Equilibrium(robot, sl.Pose(np.zeros(3), np.eye(3)), np.zeros(6), cables)
        sampled, _ = cKDTree(cable_points(state, 1)).query(cable_points(state, 0))
        found = sl.clearance(state)
        (value,), (low,) = found.pair_distance, found.pair_low
        assert sampled.min() - 1e-3 < value <= sampled.min() + 1e-12
        assert value - found.precision <= low <= value
        elsewhere += sampled[-1] > value + 0.01
    assert elsewhere >= 3


def test_a_cable_that_touches_a_box_has_no_clearance() -> None:
    state = at_rest()
    inside = sl.Box([0.4, 0.4, 0.4], cable_points(state, 2)[2000])
    found = sl.clearance(state, inside)
    assert found.distance == 0.0
    assert found.low == 0.0
    assert found.between == ("cable 2", "box")


def test_boxes_and_rods_against_the_platform() -> None:
    rng = np.random.default_rng(11)
    state = at_rest("article-suspended", (0.5, 0.2, 1.5))
    own = sl.Box([0.4, 0.3, 0.5], [0.1, 0.0, -0.1], turned(rng))
    for _ in range(10):
        box = sl.Box(rng.uniform(0.1, 1.0, 3), state.pose.position + rng.normal(size=3), turned(rng))
        rod = sl.Capsule(state.pose.position + rng.normal(size=3), state.pose.position + rng.normal(size=3), 0.02)
        found = sl.clearance(state, [box, rod], platform=own)
        measured = {frozenset(pair): value for pair, value in zip(found.pairs, found.pair_distance, strict=True)}
        points = rng.uniform(-0.5, 0.5, (200_000, 3))
        k = rng.integers(3, size=200_000)
        points[np.arange(200_000), k] = np.sign(points[np.arange(200_000), k]) * 0.5  # the surface
        surface = state.pose.transform(points * own.size @ own.orientation.T + own.center)
        for value, sampled in (
            (measured[frozenset(("platform", "box"))], float(from_box(surface, box).min())),
            (
                measured[frozenset(("capsule", "platform"))],
                float(from_segment(surface, rod.start, rod.end).min()) - 0.02,
            ),
        ):
            assert value <= sampled + 1e-12
            assert value >= sampled - 0.02


SIDES = np.array([sign * axis for sign in (1.0, -1.0) for axis in np.eye(3)])


@pytest.mark.parametrize("small", ["platform", "obstacle"])
def test_distance_of_box_and_plate_is_that_of_the_corners(small: str) -> None:
    """Plates on all six sides of rotated boxes, with either as platform: each corner is the nearest somewhere."""
    rng, state, nearest = np.random.default_rng(3), at_rest(), set()
    size, plate = np.array([0.4, 0.3, 0.5]), 200.0
    corners = 0.5 * size * np.array(list(product((-1.0, 1.0), repeat=3)))
    for _ in range(6):
        turn = turned(rng)
        for side in SIDES:
            apart = 1.0 * side
            extent = np.where(side == 0.0, plate, 0.2)
            if small == "platform":
                platform = sl.Box(size, [0.0, 0.0, 0.0], turn)
                obstacle = sl.Box(extent, state.pose.position + apart)
            else:
                platform = sl.Box(extent)
                obstacle = sl.Box(size, state.pose.position - apart, turn)
            found = sl.clearance(state, obstacle, platform=platform)
            reach = corners @ turn.T @ side
            nearest.add(int(reach.argmax()))
            value = found.pair_distance[[set(pair) == {"platform", "box"} for pair in found.pairs].index(True)]
            assert value == pytest.approx(1.0 - 0.1 - reach.max(), abs=1e-12)
    assert nearest == set(range(8))


def test_known_cable_diameters_are_subtracted() -> None:
    state = at_rest("expo2015-lucia", (0.3, 0.2, 1.0))
    thin = sl.clearance(state, cable_radius=0.0)
    assert sl.clearance(state).pair_distance == pytest.approx(thin.pair_distance - 0.014, abs=1e-12)
    some = sl.clearance(state, cable_radius=np.arange(8) * 1e-3)
    assert some.pair_distance[0] == pytest.approx(thin.pair_distance[0] - 1e-3, abs=1e-12)


def test_a_batch_agrees_with_its_poses_and_marks_those_without_tensions() -> None:
    robot = sl.load_robot("cogiro")
    state = sl.inverse(robot, sl.Pose([[1.0, 0.5, 1.5], [90.0, 0.0, 0.0], [0.0, 0.0, 2.0]], np.eye(3))).state
    lamp = sl.Sphere([0.0, 0.0, 2.0], 0.1, name="lamp")
    found = sl.clearance(state, lamp)
    for n in (0, 2):
        alone = sl.clearance(state[n], lamp)
        assert found.pair_distance[n].tobytes() == alone.pair_distance.tobytes()
        assert found.between[n] == alone.between
        assert found.distance[n] == alone.distance
    assert np.isnan(found.distance[1])
    assert np.isnan(found.nearest[1]).all()
    assert "no tensions" in found.between[1]
    assert f"1 poses: {found.between[1]}" in str(found)
    assert "lamp" in str(found)


def test_pairs_with_a_common_anchor_are_excluded_or_measured_from_a_distance() -> None:
    state = at_rest("article-mixed", (1.0, 0.5, 2.5))
    robot = state.one_robot
    both = robot.replace(
        platform_anchors=np.concatenate(
            (robot.platform_anchors[:1], robot.platform_anchors[:1], robot.platform_anchors[2:])
        )
    )
    state = sl.inverse(both, state.pose).state
    plain = sl.clearance(state)
    names, _, reason = plain.left_out[0].partition(": ")
    assert names == "cable 0 and cable 1"
    assert "the platform" in reason
    assert ("cable 0", "cable 1") not in plain.pairs
    measured = sl.clearance(state, from_anchor=0.5)
    value = measured.pair_distance[measured.pairs.index(("cable 0", "cable 1"))]
    one, other = (cable_points(state, i) for i in range(2))
    length = state.free_length
    one, other = (points[: int(4000 * (1.0 - 0.5 / length[i])) + 1] for i, points in enumerate((one, other)))
    sampled = min(float(np.linalg.norm(other - point, axis=1).min()) for point in one[-400:])
    assert value == pytest.approx(sampled, abs=2e-3)
    assert value > 0.01


def test_point_platforms_have_no_distances() -> None:
    robot = sl.Robot(
        "tripod", [[3, 0, 3], [-2, 2, 3], [-2, -2, 3]], np.zeros((3, 3)), sl.Cable(0.05, 5e4), 10.0, motion_pattern="3T"
    )
    found = sl.clearance(sl.inverse(robot, sl.Pose([0, 0, 1], np.eye(3))).state)
    assert found.distance == np.inf
    assert isinstance(found.between, str)  # no pairs
    names, reasons = zip(*(one.split(": ") for one in found.left_out), strict=True)
    assert names == tuple(f"cable {i} and cable {k}" for i, k in ((0, 1), (0, 2), (1, 2)))
    assert all("the platform" in reason and reason in str(found) for reason in reasons)
