import re
import tracemalloc

import numpy as np
import pytest

from sagline import (
    Cable,
    InvalidValueError,
    Pose,
    PoseStatus,
    Robot,
    inverse,
    load_robot,
    structure_matrix,
    unresisted_motion,
)
from tests.refusal import refused
from tests.tension.reference import planar


def rotating_about_an_axis(axis_z: tuple[float, float]) -> Robot:
    """All cables meet one vertical axis of the platform: no cable resists a rotation about it."""
    corners = np.array([[3.0, 3, 3], [-3, 3, 3], [-3, -3, 3], [3, -3, 3]])
    frame = np.concatenate((corners, corners * [1, 1, -1]))
    ends = np.repeat([[0.1, 0, axis_z[0]], [0.1, 0, axis_z[1]]], 4, axis=0)
    return Robot("spinning", frame, ends, Cable(0.01, 1e5), 5.0, np.eye(3), tension_min=1.0, tension_max=1e3)


def test_an_unconstrained_rotation() -> None:
    robot, pose = rotating_about_an_axis((0.2, -0.2)), Pose([0.3, 0.0, 0.0], np.eye(3))
    assert inverse(robot, pose).status == PoseStatus.SINGULAR
    motion = unresisted_motion(robot, pose)
    assert motion.resistance < 1e-15
    np.testing.assert_allclose(np.abs(motion.twist[3:]), [0, 0, 1], atol=1e-12)
    # the axis is at (0.4, 0), the center of mass (0.3, 0) moves around it
    np.testing.assert_allclose(motion.twist[:3], np.cross(motion.twist[3:], [-0.1, 0, 0]), atol=1e-12)
    assert re.match(r"rotation\b.* \(0, 0, -?1\)", motion.text)
    assert "(0.4, 0, 0) m" in motion.text


def test_an_unconstrained_translation() -> None:
    # cables on a line cannot support a point across it
    robot = planar(frame_anchors=[[-1, 0, 0], [1, 0, 0], [2, 0, 0], [-2, 0, 0]])
    pose = Pose(np.zeros(3), np.eye(3))
    assert inverse(robot, pose).status == PoseStatus.SINGULAR
    motion = unresisted_motion(robot, pose)
    np.testing.assert_allclose(np.abs(motion.twist), [0, 1, 0, 0, 0, 0], atol=1e-12)
    assert motion.text in ("translation along (0, 1, 0)", "translation along (0, -1, 0)")


def test_the_resistance_has_no_unit() -> None:
    """A robot ten times as large resists equally: rotations are scaled with the lever arm of the platform."""
    robot = load_robot("cogiro")
    large = robot.replace(
        frame_anchors=10.0 * robot.frame_anchors,
        platform_anchors=10.0 * robot.platform_anchors,
        center_of_mass=10.0 * robot.center_of_mass,
    )
    turned = Pose.from_euler((1.0, -0.5, 1.5), 0.1, 0.05, -0.1)
    motion = unresisted_motion(robot, turned)
    same = unresisted_motion(large, Pose.from_quaternion(10.0 * turned.position, turned.quaternion))
    assert same.resistance == pytest.approx(motion.resistance, rel=1e-9)
    # speeds of the cables for a rotation of one lever arm per second or a translation of one meter per second
    lever = np.linalg.norm(robot.platform_anchors - robot.center_of_mass, axis=1).max()
    weights = np.array([1.0, 1.0, 1.0, lever, lever, lever])
    speeds = structure_matrix(robot, turned).T / weights
    random = np.random.default_rng(1).normal(size=(20_000, 6))
    found = np.linalg.norm(speeds @ (random / np.linalg.norm(random, axis=1)[:, None]).T, axis=0)
    least = np.linalg.norm(speeds @ (weights * motion.twist)) / np.linalg.norm(weights * motion.twist)
    assert least <= found.min()
    assert motion.resistance <= least / found.max() * (1.0 + 1e-12)
    assert motion.resistance == pytest.approx(least / found.max(), rel=0.05)


def test_one_pose_at_a_time() -> None:
    with refused("pose", "a batch of 2", "a single pose", kind=InvalidValueError):
        unresisted_motion(planar(), Pose(np.zeros((2, 3)), np.broadcast_to(np.eye(3), (2, 3, 3))))


def test_many_cables_need_no_square_matrix() -> None:
    generator = np.random.default_rng(4)
    ends = generator.uniform(-1.0, 1.0, (20_000, 3))
    robot = Robot("many", 5.0 * generator.uniform(-1.0, 1.0, ends.shape), ends, Cable(0.1, 1e5), 10.0, np.eye(3))
    pose = Pose(np.zeros(3), np.eye(3))
    tracemalloc.start()
    motion = unresisted_motion(robot, pose)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 100e6  # the square matrix takes 3 GB
    structure = structure_matrix(robot, pose)
    lever = np.linalg.norm(ends, axis=1).max()
    scaled = structure / np.repeat([1.0, lever], 3)[:, None]
    squares = np.linalg.eigvalsh(scaled @ scaled.T)
    assert motion.resistance == pytest.approx(np.sqrt(squares[0] / squares[-1]), rel=1e-9)
