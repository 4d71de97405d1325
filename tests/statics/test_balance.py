"""Structure matrix, required wrench and matrices of the article, compared with independent computations."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from sagline import Cable, CableGeometryError, Pose, Robot, article_balance, inertial_wrench, structure_matrix
from sagline.core.arrays import Array
from sagline.statics.balance import external_wrench
from tests.refusal import refused


@pytest.fixture
def robot() -> Robot:
    """Eight cables without symmetry, with the center of mass off the origin."""
    rng = np.random.default_rng(11)
    frame = rng.uniform(-5.0, 5.0, (8, 3)) + np.array([0.0, 0.0, 6.0])
    return Robot(
        "crooked",
        frame,
        rng.uniform(-0.5, 0.5, (8, 3)),
        Cable(rng.uniform(0.05, 0.2, 8), rng.uniform(1e4, 1e5, 8)),
        mass=17.0,
        inertia=np.diag([1.0, 2.0, 2.5]) + 0.1,
        center_of_mass=(0.1, -0.2, 0.05),
        tension_min=1.0,
        tension_max=500.0,
    )


def pose_of(seed: int) -> Pose:
    rng = np.random.default_rng(seed)
    return Pose(rng.uniform(-1.0, 1.0, 3), Rotation.from_rotvec(rng.uniform(-0.5, 0.5, 3)))


def chords(robot: Robot, position: Array, rotation: Rotation) -> Array:
    ends = position + robot.platform_anchors @ rotation.as_matrix().T
    distance: Array = np.linalg.norm(ends - robot.frame_anchors, axis=1)
    return distance


def test_structure_matrix_is_minus_the_derivative_of_the_chords(robot: Robot) -> None:
    """Virtual work: J^T twist = -dD/dt for every motion of the center of mass."""
    pose = pose_of(1)
    center = pose.position + pose.matrix @ robot.center_of_mass
    step = 1e-6
    for k in range(6):
        change = []
        for sign in (-1.0, 1.0):
            turn = Rotation.from_rotvec(sign * step * np.eye(6)[k, 3:])
            rotation = turn * pose.rotation
            moved = center + sign * step * np.eye(6)[k, :3] - rotation.as_matrix() @ robot.center_of_mass
            change.append(chords(robot, moved, rotation))
        rate = (change[1] - change[0]) / (2.0 * step)
        np.testing.assert_allclose(structure_matrix(robot, pose)[k], -rate, atol=2e-9)


def test_planar_patterns_have_their_rows(robot: Robot) -> None:
    pose = pose_of(2)
    full = structure_matrix(robot, pose)
    planar = robot.replace(motion_pattern="1R2T", plane_normal=(0.0, 1.0, 0.0))
    rows = structure_matrix(planar, pose)
    assert rows.shape == (3, 8)
    np.testing.assert_allclose(np.abs(rows), np.abs(full[[0, 2, 4]]), atol=1e-15)


def test_h_and_b_of_the_article_give_the_same_balance(robot: Robot) -> None:
    """H t_x + b is force and moment on the platform, written out cable by cable for any tensions."""
    pose = pose_of(3)
    h, b = article_balance(robot, pose)
    horizontal = np.random.default_rng(5).uniform(10.0, 100.0, 8)
    ends = pose.position + robot.platform_anchors @ pose.matrix.T
    lever = (robot.platform_anchors - robot.center_of_mass) @ pose.matrix.T
    away = ends - robot.frame_anchors
    span, chord = np.hypot(away[:, 0], away[:, 1]), np.linalg.norm(away, axis=1)
    vertical = away[:, 2] / span * horizontal + 4.845 * robot.cables.linear_density * chord  # (21), (27), (28)
    force = -np.column_stack((away[:, :2] / span[:, None] * horizontal[:, None], vertical))
    total = np.concatenate((force.sum(0), np.cross(lever, force).sum(0)))
    total[2] -= robot.mass * robot.gravity
    np.testing.assert_allclose(h @ horizontal + b, total, rtol=1e-12, atol=1e-10)
    # and the columns of H are those of the structure matrix divided by cos(phi)
    np.testing.assert_allclose(h, structure_matrix(robot, pose) / (span / chord), rtol=1e-12, atol=1e-14)


def test_a_batch_agrees_with_single_poses(robot: Robot) -> None:
    single = [pose_of(seed) for seed in (1, 2, 3)]
    batch = Pose.from_quaternion([p.position for p in single], [p.quaternion for p in single])
    for k, pose in enumerate(single):
        np.testing.assert_array_equal(structure_matrix(robot, batch)[k], structure_matrix(robot, pose))
        np.testing.assert_array_equal(article_balance(robot, batch).h[k], article_balance(robot, pose).h)


def test_inertial_wrench_is_minus_the_rate_of_momentum(robot: Robot) -> None:
    """Linear and angular momentum about the center of mass of a tumbling platform, by central differences."""
    spin, spin_rate = np.array([0.7, -1.1, 0.4]), np.array([0.3, 0.2, -0.5])
    velocity, acceleration = np.array([0.2, 0.5, -0.1]), np.array([-0.4, 0.1, 0.9])
    start = pose_of(4)

    def motion(t: float) -> tuple[Array, Rotation, Array]:
        """Exact to the order of central differences."""
        omega = spin + t * spin_rate
        turn = spin * t + 0.5 * spin_rate * t**2 + np.cross(spin_rate, spin) * t**3 / 12.0
        rotation = Rotation.from_rotvec(turn) * start.rotation
        center = start.position + velocity * t + 0.5 * acceleration * t**2 + rotation.as_matrix() @ robot.center_of_mass
        return center, rotation, omega

    def angular_momentum(t: float) -> Array:
        _, rotation, omega = motion(t)
        matrix = rotation.as_matrix()
        momentum: Array = matrix @ robot.inertia @ matrix.T @ omega
        return momentum

    h = 1e-4
    force = robot.mass * (motion(h)[0] - 2.0 * motion(0.0)[0] + motion(-h)[0]) / h**2
    moment = (angular_momentum(h) - angular_momentum(-h)) / (2.0 * h)
    batch = Pose(start.position[None], start.rotation)
    wrench = inertial_wrench(
        robot, batch, np.concatenate((velocity, spin))[None], np.concatenate((acceleration, spin_rate))[None]
    )
    np.testing.assert_allclose(wrench[0, :3], -force, atol=1e-5)
    np.testing.assert_allclose(wrench[0, 3:], -moment, atol=1e-6)


def test_a_wrench_of_the_wrong_shape_is_named() -> None:
    with refused("wrench", "of shape (3,)", kind=ValueError):
        external_wrench([1.0, 2.0, 3.0], 4)
    with refused("wrench", "of shape (3, 6)", "shape (6,) or (4, 6)", kind=ValueError):
        external_wrench(np.zeros((3, 6)), 4)
    with refused("wrench[2]", "nan N or N m", kind=ValueError):
        external_wrench([0.0, 0.0, np.nan, 0.0, 0.0, 0.0], None)


@pytest.mark.parametrize("batch", [False, True])
def test_pose_and_cable_without_a_direction_are_named(robot: Robot, batch: bool) -> None:
    turn = Rotation.from_rotvec([0.1, -0.3, 0.2])
    at_anchor = robot.frame_anchors[5] - turn.as_matrix() @ robot.platform_anchors[5]
    pose = Pose(np.stack((np.zeros(3), at_anchor)), turn) if batch else Pose(at_anchor, turn)
    words = f"pose{' 1' if batch else ''}, cable 5: distance between its ends is 0 m; allowed: >= 1e-09 m"
    for matrix in (structure_matrix, article_balance):
        with pytest.raises(CableGeometryError, match=words):
            matrix(robot, pose)


def test_a_vertical_cable_is_finite_unlike_in_the_article(robot: Robot) -> None:
    """Erratum 8, without a warning."""
    above = np.array([0.0, 0.0, 2.0])
    straight = robot.replace(platform_anchors=robot.frame_anchors - above - np.eye(8, 3))
    pose = Pose(np.eye(8, 3)[3], np.eye(3))
    assert not np.isfinite(article_balance(straight, pose).h[2, 3])
    np.testing.assert_allclose(structure_matrix(straight, pose)[:3, 3], [0.0, 0.0, 1.0], atol=1e-15)
