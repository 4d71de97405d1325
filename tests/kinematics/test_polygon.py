import numpy as np
import pytest

from sagline import InvalidValueError, MinimumNorm, Pose, Side, inverse, load_robot, tension_polygon
from tests.kinematics.feasible import Variable
from tests.tension.reference import planar, random_poses
from tests.tiers import wide


def area_by_sampling(low: np.ndarray, high: np.ndarray, basis: np.ndarray, origin: np.ndarray, radius: float) -> float:
    steps = np.linspace(-radius, radius, 701)
    x, y = np.meshgrid(steps, steps)
    inside = np.ones_like(x, dtype=bool)
    for i in range(len(low)):
        t = origin[i] + basis[0, i] * x + basis[1, i] * y
        inside &= (t >= low[i]) & (t <= high[i])
    return float(inside.sum() * (steps[1] - steps[0]) ** 2)


def shoelace(corners: np.ndarray) -> float:
    x, y = corners.T
    return float((x * np.roll(y, -1) - np.roll(x, -1) * y).sum() / 2)


@pytest.mark.parametrize("name", wide(["article-mixed", "cogiro", "article-suspended", "ipanema-1"]))
@pytest.mark.parametrize("variable", ["chord", "horizontal"])
def test_polygon_contains_exactly_the_feasible_tensions(name: str, variable: Variable) -> None:
    robot = load_robot(name)
    for pose in random_poses(robot, 4, np.random.default_rng(1)):
        polygon = tension_polygon(robot, pose, variable=variable)
        if not inverse(robot, pose, tension=MinimumNorm()).feasible:
            assert len(polygon.vertices) == 0
            continue
        assert polygon.bounded
        np.testing.assert_allclose(polygon.basis @ polygon.basis.T, np.eye(2), atol=1e-14)
        low, high = robot.tension_min * polygon.scale, robot.tension_max * polygon.scale
        slack = 1e-10 * robot.tension_max.max()
        assert (polygon.tensions >= low - slack).all()
        assert (polygon.tensions <= high + slack).all()
        np.testing.assert_allclose(polygon.tensions, polygon.origin + polygon.vertices @ polygon.basis, rtol=1e-12)
        radius = float(np.abs(polygon.vertices).max()) * 1.1
        area = shoelace(polygon.vertices)
        assert area == pytest.approx(area_by_sampling(low, high, polygon.basis, polygon.origin, radius), rel=0.02)
        for k, side in enumerate(polygon.sides):  # both ends of an edge are at its limit
            assert side is not None
            limit = (low if side.limit == "min" else high)[side.cable]
            ends = polygon.tensions[[k, (k + 1) % len(polygon.sides)], side.cable]
            np.testing.assert_allclose(ends, limit, atol=slack)


def test_polygon_contains_the_plan() -> None:
    robot = load_robot("article-mixed")
    pose = random_poses(robot, 1, np.random.default_rng(3))[0]
    polygon, plan = tension_polygon(robot, pose), inverse(robot, pose, tension=MinimumNorm())
    point = polygon.coordinates(plan.chord_tension)
    np.testing.assert_allclose(polygon.origin + point @ polygon.basis, plan.chord_tension, atol=1e-9)
    # the point nearest to the origin is on the boundary: all corners are beyond the line through it
    assert ((polygon.vertices - point) @ point >= -1e-6 * point @ point).all()


def test_points_of_the_polygon_of_winch_tensions_are_winch_tensions() -> None:
    robot = load_robot("article-mixed").replace(tension_limits_of="frame_end")
    pose = random_poses(robot, 1, np.random.default_rng(3))[0]
    plan = inverse(robot, pose, tension=MinimumNorm("frame_end"))
    polygon = tension_polygon(robot, pose, variable="frame_end")
    winch = plan.state.cables.frame_end_tension
    np.testing.assert_allclose(polygon.scale * plan.chord_tension + polygon.offset, winch, atol=1e-6)
    point = polygon.coordinates(plan.chord_tension)
    np.testing.assert_allclose(polygon.origin + point @ polygon.basis, winch, atol=1e-6)
    assert np.abs(polygon.offset).max() > 1e-3


def test_interval_and_point() -> None:
    seven = load_robot("falcon-7")
    pose = Pose([-0.25, 0.0, 0.75], np.eye(3))
    polygon = tension_polygon(seven, pose)
    low, high = polygon.sides
    assert low is not None
    assert high is not None
    assert polygon.tensions[0, low.cable] == pytest.approx({"min": 2.0, "max": 200.0}[low.limit], rel=1e-12)
    assert polygon.tensions[1, high.cable] == pytest.approx({"min": 2.0, "max": 200.0}[high.limit], rel=1e-12)
    assert polygon.tensions.min() >= 2.0 - 1e-9
    assert polygon.tensions.max() <= 200.0 + 1e-9
    fast = load_robot("fast")
    pose = Pose([0, 0, 220.0], np.eye(3))
    point = tension_polygon(fast, pose)
    assert point.vertices.shape == (1, 0)
    np.testing.assert_allclose(point.tensions[0], inverse(fast, pose).chord_tension, rtol=1e-12)


def test_an_unbounded_polygon_is_marked() -> None:
    robot = planar(tension_max=np.inf)
    polygon = tension_polygon(robot, Pose(np.zeros(3), np.eye(3)))
    assert not polygon.bounded
    assert None in polygon.sides
    assert Side(0, "min") in polygon.sides or Side(2, "min") in polygon.sides
    three = planar(
        frame_anchors=planar().frame_anchors[:3], platform_anchors=np.zeros((3, 3)), tension_max=np.inf, tension_min=3.8
    )
    interval = tension_polygon(three, Pose([0.1, -0.1, 0.0], np.eye(3)))
    assert np.isinf(interval.vertices).sum() == 1
    assert not interval.bounded


def test_nothing_feasible() -> None:
    polygon = tension_polygon(load_robot("article-suspended"), Pose([7.45, 0, 1.5], np.eye(3)))
    assert polygon.vertices.shape == (0, 2)
    assert polygon.sides == ()


def test_one_pose_at_a_time() -> None:
    with pytest.raises(InvalidValueError, match="single pose"):
        tension_polygon(load_robot("article-mixed"), Pose(np.zeros((2, 3)), np.broadcast_to(np.eye(3), (2, 3, 3))))
