"""Platform ends inside or beyond pulleys, and lengths that end before the pulley: one line or the correct result."""

import re

import numpy as np
import pytest

import sagline as sl
from sagline import article_balance
from sagline.core.errors import MOST
from sagline.viewer import readout
from sagline.viewer.robot_scene import cable_segments, chord_segments
from sagline.viewer.snapshot import Settings, snapshot_at
from tests.refusal import refused
from tests.tiers import extended, wide

FEW_AND_MANY = wide([30, 60, pytest.param(4000, marks=pytest.mark.soak)])
NUMBER = re.compile(r"[-+]?\d[.\d]*(?:e[-+]?\d+)?(?= m\b)")


def over_pulleys(random: np.random.Generator) -> sl.Robot:
    """A robot with pulleys of any size, some larger than its longest cable, with either side of entry."""
    robot = sl.load_robot(str(random.choice(["article-suspended", "ipanema-2", "cogiro"])))
    radius = 10.0 ** random.uniform(-2.0, 1.0, robot.cable_count)
    radius[random.random(robot.cable_count) < 0.7] = 0.0
    radius[int(random.integers(robot.cable_count))] = 10.0 ** random.uniform(-2.0, 1.0)
    axis = np.zeros((robot.cable_count, 3))
    axis[:, 2] = random.choice([-1.0, 1.0], robot.cable_count)
    return robot.replace(winches=sl.Winch(pulley_radius=radius, swivel_axis=axis))


def near_a_pulley(robot: sl.Robot, random: np.random.Generator) -> sl.Pose:
    """A pose with a platform end within a few radii of the point at which its cable enters the pulley."""
    assert robot.winches is not None
    i = int(random.choice(np.flatnonzero(robot.winches.pulley_radius)))
    away = robot.winches.pulley_radius[i] * random.uniform(-3.0, 3.0, 3)
    turn = sl.Pose.from_euler(np.zeros(3), *random.uniform(-0.3, 0.3, 3))
    return sl.Pose(robot.frame_anchors[i] - turn.matrix @ robot.platform_anchors[i] + away, turn.rotation)


def wrong_cables(robot: sl.Robot, pose: sl.Pose) -> list[int]:
    """Cables whose end is unreachable with up to half a turn, found with a tangent that rolls on the pulley."""
    assert robot.winches is not None
    reach = pose.transform(robot.platform_anchors) - robot.frame_anchors
    span, along = np.hypot(reach[:, 0], reach[:, 1]), robot.winches.swivel_axis[:, 2] * reach[:, 2]
    found = []
    for i, radius in enumerate(robot.winches.pulley_radius):
        if not radius:
            continue
        angle = np.linspace(0.0, np.pi, 4001)
        # of the platform end seen from each point of the half turn: offset across the tangent and along it
        x, z = span[i] - radius * (1.0 - np.cos(angle)), along[i] - radius * np.sin(angle)
        beside = x * np.cos(angle) - z * np.sin(angle)
        ahead = x * np.sin(angle) + z * np.cos(angle)
        passed = (beside[:-1] > 0.0) & (beside[1:] <= 0.0) & (ahead[:-1] > 0.0)
        if not passed.any():
            found.append(i)
    return found


@pytest.mark.parametrize("count", FEW_AND_MANY)
def test_unreachable_platform_ends_are_named(count: int) -> None:
    random, outside = np.random.default_rng(5), 0
    for _ in range(count):
        robot = over_pulleys(random)
        pose = near_a_pulley(robot, random)
        wrong = wrong_cables(robot, pose)
        solver = sl.InverseSolver(robot).step(pose.position, pose.quaternion)
        if not wrong:
            assert np.isfinite(sl.structure_matrix(robot, pose)).all()
            assert solver.status is not sl.PoseStatus.NO_CHORD
            continue
        outside += 1
        assert solver.status is sl.PoseStatus.NO_CHORD
        assert np.isnan(solver.unstrained_length).all()
        both = sl.Pose(np.stack((robot_middle(robot), pose.position)), np.stack((pose.matrix, pose.matrix)))
        snapshot = snapshot_at(robot, pose, Settings(mass=robot.mass), None)
        for refuse in (sl.inverse, sl.structure_matrix, article_balance):
            with pytest.raises(sl.CableGeometryError) as error:
                refuse(robot, pose)
            check(robot, pose, wrong, error.value)
            assert snapshot.reason == str(error.value).removeprefix("pose, ")
            if not wrong_cables(robot, both[0]):
                with pytest.raises(sl.CableGeometryError) as error:
                    refuse(robot, both)
                assert error.value.item.startswith(f"pose 1, cable {wrong[0]}: ")
        assert np.isfinite(cable_segments(snapshot, 1.0)).all()
        assert np.isfinite(chord_segments(snapshot, 1.0, 0.0)).all()
        assert "No chord" in readout.verdict(snapshot)
    assert 0.2 * count < outside < 0.95 * count


def robot_middle(robot: sl.Robot) -> np.ndarray:
    assert robot.test_box is not None
    return 0.5 * (robot.test_box.low + robot.test_box.high)


def check(robot: sl.Robot, pose: sl.Pose, wrong: list[int], error: sl.CableGeometryError) -> None:
    """The numbers of an error are the numbers of the named cable, and they are outside the printed range."""
    assert robot.winches is not None
    cable = wrong[0]
    assert error.item.removeprefix("pose, ").startswith(f"cable {cable}: ")
    assert len(str(error)) < MOST
    span, *limits, radius = (
        float(number) for text in (str(error.value), error.allowed, error.next_step) for number in NUMBER.findall(text)
    )
    most, least = limits if len(limits) == 2 else (None, *limits)
    assert most is not None or "<" not in error.allowed
    reach = (pose.transform(robot.platform_anchors) - robot.frame_anchors)[cable]
    assert span == pytest.approx(np.hypot(reach[0], reach[1]), rel=1e-8)
    assert radius == pytest.approx(robot.winches.pulley_radius[cable], rel=1e-5)
    assert least is not None
    assert span <= least * (1.0 + 1e-5)
    assert most is None or span >= most * (1.0 - 1e-5)
    level = reach[:2] / np.hypot(reach[0], reach[1])
    for limit, beyond in ((least, 1.0), (most, -1.0)):
        if limit is None:
            continue
        # the limit in the message is accepted, and the next number beyond it is refused
        for side, taken in ((1e-4, True), (-1e-4, False)):
            place = (limit + beyond * side * robot.winches.pulley_radius[cable]) - np.hypot(reach[0], reach[1])
            there = sl.Pose(pose.position + np.array([*(place * level), 0.0]), pose.rotation)
            if limit > 1e-3 * robot.winches.pulley_radius[cable]:
                assert (cable not in wrong_cables(robot, there)) is taken


@pytest.mark.parametrize("count", FEW_AND_MANY)
def test_lengths_below_the_dead_length_are_named(count: int) -> None:
    random = np.random.default_rng(6)
    base = sl.load_robot("article-suspended")
    planned = sl.inverse(base, sl.Pose([0.5, 0.2, 2.0], np.eye(3))).unstrained_length
    for _ in range(count):
        dead = random.choice([0.0, 1.0], 8) * random.uniform(0.5, 9.0, 8)
        dead[int(random.integers(8))] = 2.0
        robot = base.replace(winches=sl.Winch(pulley_radius=random.choice([0.0, 0.05]), dead_cable=dead))
        cable = int(random.choice(np.flatnonzero(dead)))
        lengths = planned + dead
        lengths[cable] = dead[cable] * random.choice([1e-3, 0.5, 1.0])
        calls = (sl.forward, sl.equilibria, lambda robot, lengths: sl.ForwardSolver(robot).step(lengths))
        for refuse in calls:
            with refused(f"cable {cable}: unstrained length", f"{lengths[cable]:.9g} m") as error:
                refuse(robot, lengths)
            assert error.value.allowed.startswith(f"> {dead[cable]:.9g} m, ")
            assert len(str(error.value)) < MOST
        with refused(f"sample 1, cable {cable}: unstrained length"):
            sl.forward(robot, [planned + dead, lengths])
        with refused(f"sample 1, cable {cable}: unstrained length"):
            sl.forward([base, robot], [planned, lengths])
        with refused(f"cable {cable}: unstrained length"):
            sl.dump_mjcf(robot, sl.Pose([0.5, 0.2, 2.0], np.eye(3)), lengths)


@extended
def test_forward_accepts_the_lengths_of_inverse_near_a_pulley() -> None:
    """Cables with a small wrap are shorter than half a turn plus the dead length. None of them is refused."""
    random, shorter = np.random.default_rng(7), 0
    base = sl.load_robot("article-suspended")
    robot = base.replace(winches=sl.Winch(pulley_radius=0.3, dead_cable=4.0, dead_rise=1.0))
    middle = base.frame_anchors.mean(axis=0)
    for _ in range(60):
        i = int(random.integers(8))
        inward = np.sign(middle - base.frame_anchors[i]) * random.uniform(0.2, 0.7, 3)
        inward[2] = random.uniform(0.3, 0.45) if i % 2 == 0 else random.uniform(-0.1, 0.05)
        pose = sl.Pose(base.frame_anchors[i] - base.platform_anchors[i] + inward, np.eye(3))
        if wrong_cables(robot, pose):
            continue
        plan = sl.inverse(robot, pose)
        if plan.feasible and (plan.unstrained_length < np.pi * 0.3 + 4.0).any():
            found = sl.forward(robot, plan.unstrained_length, start=pose)
            np.testing.assert_allclose(found.pose.position, pose.position, atol=1e-9)
            shorter += 1
    assert shorter > 3
