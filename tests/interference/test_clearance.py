import numpy as np
import pytest

import sagline as sl
from sagline.arrays import Array
from tests.interference.scenes import at_rest, cable_points, from_box, from_segment, turned

SAMPLES = 20_001  # of a cable: 0.6 mm apart, so that the nearest sample is too far by less than 1e-4 mm from 1 m


def refined(points: Array, distances: Array) -> float:
    """The least distance between samples, by the parabola through the three best ones."""
    k = int(np.clip(distances.argmin(), 1, len(distances) - 2))
    a, b, c = distances[k - 1 : k + 2]
    bend = a - 2.0 * b + c
    return float(b - 0.125 * (a - c) ** 2 / bend) if bend > 0.0 else float(b)


@pytest.mark.parametrize("robot", ["cogiro", "article-suspended", "expo2015-lucia-pulleys"])
def test_cables_against_boxes_rods_and_balls_are_as_sampled(robot: str) -> None:
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


def test_cable_diameters_are_taken_off_where_they_are_known() -> None:
    state = at_rest("expo2015-lucia", (0.3, 0.2, 1.0))
    thin = sl.clearance(state, cable_radius=0.0)
    assert sl.clearance(state).pair_distance == pytest.approx(thin.pair_distance - 0.014, abs=1e-12)
    some = sl.clearance(state, cable_radius=np.arange(8) * 1e-3)
    assert some.pair_distance[0] == pytest.approx(thin.pair_distance[0] - 1e-3, abs=1e-12)


def test_a_batch_is_its_poses_and_those_without_tensions_say_so() -> None:
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
    assert "no tensions are known" in found.between[1]
    assert "1 poses: no tensions are known" in str(found)
    assert "lamp" in str(found)


def test_pairs_that_share_an_anchor_are_left_out_by_name_or_measured_from_some_way_on() -> None:
    state = at_rest("article-mixed", (1.0, 0.5, 2.5))
    robot = state.one_robot
    both = robot.replace(
        platform_anchors=np.concatenate(
            (robot.platform_anchors[:1], robot.platform_anchors[:1], robot.platform_anchors[2:])
        )
    )
    state = sl.inverse(both, state.pose).state
    plain = sl.clearance(state)
    assert plain.left_out[0] == "cable 0 and cable 1: they share their anchor on the platform"
    assert ("cable 0", "cable 1") not in plain.pairs
    measured = sl.clearance(state, from_anchor=0.5)
    value = measured.pair_distance[measured.pairs.index(("cable 0", "cable 1"))]
    one, other = (cable_points(state, i) for i in range(2))
    length = state.free_length
    one, other = (points[: int(4000 * (1.0 - 0.5 / length[i])) + 1] for i, points in enumerate((one, other)))
    sampled = min(float(np.linalg.norm(other - point, axis=1).min()) for point in one[-400:])
    assert value == pytest.approx(sampled, abs=2e-3)
    assert value > 0.01


def test_point_platforms_have_nothing_to_measure_and_say_so() -> None:
    robot = sl.Robot(
        "tripod", [[3, 0, 3], [-2, 2, 3], [-2, -2, 3]], np.zeros((3, 3)), sl.Cable(0.05, 5e4), 10.0, motion_pattern="3T"
    )
    found = sl.clearance(sl.inverse(robot, sl.Pose([0, 0, 1], np.eye(3))).state)
    assert found.distance == np.inf
    assert found.between == "nothing is measured"
    assert len(found.left_out) == 3
    assert "they share their anchor on the platform" in str(found)
