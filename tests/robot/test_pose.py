import pickle

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from sagline import InvalidValueError, Pose, forward, load_robot
from sagline.core.arrays import Array
from sagline.robot.pose import pose_of, single_pose
from tests.effort import least_seconds
from tests.refusal import refused
from tests.tiers import extended

UNIT = "largest element of Q Q^T - 1"
ANGLE = st.floats(-7.0, 7.0)


def euler_matrix(alpha: float, beta: float, gamma: float) -> Array:
    """(9) of the article, multiplied by hand."""
    (sa, sb, sg), (ca, cb, cg) = np.sin((alpha, beta, gamma)), np.cos((alpha, beta, gamma))
    return np.array(
        [
            [ca * cb, ca * sb * sg - sa * cg, ca * sb * cg + sa * sg],
            [sa * cb, sa * sb * sg + ca * cg, sa * sb * cg - ca * sg],
            [-sb, cb * sg, cb * cg],
        ]
    )


@given(ANGLE, ANGLE, ANGLE)
def test_euler_angles_turn_about_z_then_y_then_x(alpha: float, beta: float, gamma: float) -> None:
    pose = Pose.from_euler([1.0, 2.0, 3.0], alpha, beta, gamma)
    np.testing.assert_allclose(pose.matrix, euler_matrix(alpha, beta, gamma), atol=2e-15)
    np.testing.assert_allclose(Rotation.from_euler("ZYX", [alpha, beta, gamma]).as_matrix(), pose.matrix, atol=2e-15)


def test_a_quarter_turn_about_z_takes_x_to_y() -> None:
    pose = Pose([0, 0, 0], [[0, -1, 0], [1, 0, 0], [0, 0, 1]])
    np.testing.assert_allclose(np.abs(pose.quaternion), [0, 0, np.sqrt(0.5), np.sqrt(0.5)], atol=1e-16)
    np.testing.assert_allclose(pose.rotation.apply([1, 0, 0]), [0, 1, 0], atol=1e-16)
    assert pose.shape == ()


def test_one_rotation_serves_many_positions() -> None:
    positions = np.arange(12.0).reshape(4, 3)
    poses = Pose(positions, Rotation.from_euler("z", 0.3))
    assert len(poses) == 4
    np.testing.assert_array_equal(poses.position, positions)
    np.testing.assert_allclose(poses.quaternion, np.tile([0, 0, np.sin(0.15), np.cos(0.15)], (4, 1)), atol=1e-16)
    assert poses.quaternion.flags.c_contiguous


def test_a_batch_gives_its_poses_by_index_slice_and_iteration() -> None:
    poses = Pose.from_euler(np.arange(9.0).reshape(3, 3), [0.1, 0.2, 0.3], 0.0, 0.0)
    np.testing.assert_array_equal(poses[1].position, [3, 4, 5])
    np.testing.assert_allclose(poses[1].quaternion, [0, 0, np.sin(0.1), np.cos(0.1)], rtol=1e-15)
    np.testing.assert_array_equal(poses[1:].position, [[3, 4, 5], [6, 7, 8]])
    np.testing.assert_array_equal(poses[np.array([True, False, True])].position[:, 0], [0, 6])
    assert [pose.position[0] for pose in poses] == [0.0, 3.0, 6.0]
    with refused("index", "0", "none", kind=TypeError):
        poses[0][0]
    with refused("this", "a single pose", "a batch", kind=TypeError):
        len(poses[0])


def test_the_given_array_is_copied_and_the_field_is_read_only() -> None:
    position = np.zeros((2, 3))
    poses = Pose(position, Rotation.identity())
    position[0, 0] = 5.0
    assert poses.position[0, 0] == 0.0
    for array in (poses.position, poses.quaternion, poses.matrix, poses[0].position, poses[::2].quaternion):
        with pytest.raises(ValueError, match="read-only"):
            array[...] = 1.0


@given(st.integers(0, 2**32 - 1))
def test_pickling_keeps_all_bits_and_read_only_arrays(seed: int) -> None:
    rng = np.random.default_rng(seed)
    poses = Pose.from_euler(rng.normal(size=(20, 3)), *rng.uniform(-3, 3, size=(3, 20)))
    copy = pickle.loads(pickle.dumps(poses))
    assert copy.position.tobytes() == poses.position.tobytes()
    assert copy.quaternion.tobytes() == poses.quaternion.tobytes()
    assert not copy.quaternion.flags.writeable


def test_a_printed_quaternion_is_normalized() -> None:
    pose = Pose.from_quaternion([0, 0, 0], [0.0, 0.0, 0.7071068, 0.7071068])
    np.testing.assert_allclose(pose.quaternion, [0, 0, np.sqrt(0.5), np.sqrt(0.5)], rtol=2e-16)


@pytest.mark.parametrize(
    ("matrix", "parts"),
    [
        (np.diag([1.0, 1.0, -1.0]), ("rotation: determinant", "-1")),
        (np.diag([1.0, 1.0, 1.0 + 1e-8]), (f"rotation: {UNIT}", "1.99999998785e-08", "an orthonormal matrix")),
        (np.zeros((3, 3)), (f"rotation: {UNIT}", "1", "an orthonormal matrix")),
        (np.stack([np.eye(3), np.eye(3), 2 * np.eye(3)]), (f"rotation 2: {UNIT}", "3")),
        (np.full((3, 3), np.nan), ("rotation[0, 0]", "nan", "finite")),
        (np.zeros(4), ("rotation", "of shape (4,)")),
    ],
)
def test_matrices_other_than_rotations_are_refused(matrix: Array, parts: tuple[str, ...]) -> None:
    with refused(*parts, kind=InvalidValueError):
        Pose(np.zeros(3), matrix)


def test_a_matrix_within_the_tolerance_is_accepted() -> None:
    pose = Pose([0, 0, 0], np.diag([1.0, 1.0, 1.0 + 2e-10]))
    np.testing.assert_allclose(pose.matrix, np.eye(3), atol=1e-15)


def test_other_wrong_values_are_named() -> None:
    with refused("quaternion 1: length", "0.5", kind=InvalidValueError):
        Pose.from_quaternion(np.zeros(3), [[0.0, 0.0, 0.0, 1.0], [0.0, 0.0, 0.0, 0.5]])
    with refused("quaternion 1: length", "2", kind=InvalidValueError):
        Pose.from_quaternion(np.zeros(3), [[0, 0, 0, 1], [0, 0, 0, 2]])
    with refused("position and rotation", "of batch shapes (2,) and (3,)", kind=InvalidValueError):
        Pose(np.zeros((2, 3)), Rotation.identity(3))
    with refused("alpha, beta, gamma", "of batch shapes (2,) and (3,) and ()", kind=InvalidValueError):
        Pose.from_euler(np.zeros(3), [0, 0], [0, 0, 0], 0)
    with refused("position[1, 2]", "inf m", kind=InvalidValueError):
        Pose([[0.0, 0.0, 0.0], [0.0, 0.0, np.inf]], Rotation.identity())
    with refused("pose", "a batch of shape (2, 2)", kind=InvalidValueError):
        Pose(np.zeros((2, 2, 3)), Rotation.identity())


@extended
def test_a_million_poses_take_no_python_loop() -> None:
    rng = np.random.default_rng(5)
    position, angles = rng.normal(size=(10**6, 3)), rng.uniform(-1, 1, size=(3, 10**6))
    poses = Pose.from_euler(position, *angles)
    # typical: 0.2 s; a loop in Python takes more than 10 s
    assert least_seconds(lambda: Pose.from_euler(position, *angles), 5.0) < 5.0
    np.testing.assert_allclose(poses[-1].matrix, euler_matrix(*angles[:, -1]), atol=2e-15)


@given(st.integers(1, 4), st.integers(1, 3), st.integers(0, 2**32 - 1))
def test_points_are_transformed_as_by_scipy(count: int, points: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    poses = Pose(rng.uniform(-9, 9, (count, 3)), Rotation.random(count, rng))
    given_points = rng.uniform(-3, 3, (2, points, 3))
    for local in (given_points, given_points[0], given_points[0, 0]):
        expected = np.stack(
            [
                one.rotation.apply(local.reshape(-1, 3).copy()).reshape(local.shape) + one.position.copy()
                for one in poses
            ]
        )
        found = poses.transform(local)
        assert found.shape == (count, *local.shape)
        np.testing.assert_allclose(found, expected, atol=1e-14)
        np.testing.assert_array_equal(poses[0].transform(local).shape, local.shape)
        np.testing.assert_allclose(poses[0].transform(local), expected[0], atol=1e-14)
    assert not poses.transform(given_points).flags.writeable


def test_n_points_and_n_poses_give_all_combinations() -> None:
    poses = Pose.from_euler([[1.0, 0, 0], [0, 5.0, 0]], [0.0, np.pi / 2], 0.0, 0.0)
    expected = [[[2, 0, 0], [1, 2, 0]], [[0, 6, 0], [-2, 5, 0]]]  # by hand
    np.testing.assert_allclose(poses.transform([[1, 0, 0], [0, 2, 0]]), expected, atol=1e-15)


def test_points_are_checked_and_nan_poses_give_nan() -> None:
    with refused("points", "of shape (2,)", kind=InvalidValueError):
        Pose([0, 0, 0], np.eye(3)).transform([1.0, 2.0])
    with refused("points[0]", "nan m", kind=InvalidValueError):
        Pose([0, 0, 0], np.eye(3)).transform([np.nan, 0.0, 0.0])
    lost = forward(load_robot("cogiro"), np.full(8, np.nan), Pose([0, 0, 2], np.eye(3))).pose
    assert np.isnan(lost.transform([1.0, 0.0, 0.0])).all()


def test_a_position_alone_is_a_level_pose() -> None:
    level = Pose.from_euler((1.0, -2.0, 3.0), 0.0, 0.0, 0.0)
    for pose in (Pose((1.0, -2.0, 3.0)), Pose(1.0, -2.0, 3.0), Pose(np.array(1.0), -2, z=3)):
        np.testing.assert_array_equal(pose.position, level.position)
        np.testing.assert_array_equal(pose.quaternion, level.quaternion)
    np.testing.assert_array_equal(Pose([1, 2], 0, [[3, 4]][0]).position, [[1, 0, 3], [2, 0, 4]])
    np.testing.assert_array_equal(Pose(np.zeros((2, 3))).quaternion, [[0, 0, 0, 1]] * 2)
    with refused("z", "'up'"):
        Pose(1, 2, "up")
    with refused("x, y, z"):
        Pose([1, 2], [1, 2, 3], 0)


def test_positions_and_lists_of_poses_are_accepted() -> None:
    turned = Pose.from_euler((0.0, 0.0, 1.0), 0.5, 0.0, 0.0)
    both = pose_of([turned, Pose(1, 0, 1)])
    np.testing.assert_array_equal(both.position, [(0, 0, 1), (1, 0, 1)])
    np.testing.assert_array_equal(both.quaternion, [turned.quaternion, (0, 0, 0, 1)])
    assert pose_of(turned) is turned
    np.testing.assert_array_equal(single_pose([1, 2, 3]).position, (1, 2, 3))
    with refused("start", "a batch of 2", "a single pose"):
        single_pose(np.zeros((2, 3)), "start")
    with refused("pose", "'here'", "a Pose"):
        pose_of("here")
    with refused("pose"):
        pose_of(np.array(turned, dtype=object))  # no axes
    with refused("pose[1]", "nan m"):
        pose_of((0.0, np.nan, 0.0))
