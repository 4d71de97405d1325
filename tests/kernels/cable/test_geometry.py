"""Spans, rises and lever arms from anchors and poses, compared with rotations of SciPy."""

import numpy as np
from scipy.spatial.transform import Rotation

from sagline.kernels.cable import geometry as g
from tests.kernels.balance.robots import random_case


def test_geometry_of_poses() -> None:
    cases = [random_case(np.random.default_rng(seed), 8) for seed in range(5)]
    robots, bodies = np.array([c.robot for c in cases]), np.array([c.body for c in cases])
    poses = np.array([c.pose for c in cases])
    poses[0, 3:] = Rotation.from_rotvec([2.0, -1.0, 0.5]).as_quat()
    for count in (1, 5):  # one robot for all poses, or one per pose
        found = np.full((5, g.GEOMETRY_ROWS, 8), np.nan)
        g.cable_geometries(robots[:count], bodies[:count], poses, np.full((3, 3), np.nan), found)
        for p in range(5):
            robot, body = robots[min(p, count - 1)], bodies[min(p, count - 1)]
            turn = Rotation.from_quat(poses[p, 3:]).as_matrix()
            rope = poses[p, :3] + robot[:, 3:6] @ turn.T - robot[:, :3]
            span = np.hypot(rope[:, 0], rope[:, 1])
            chord = np.linalg.norm(rope, axis=1)
            expected = [
                span, rope[:, 2], chord, rope[:, 2] / chord, span / chord, rope[:, 0] / span, rope[:, 1] / span,
                *((robot[:, 3:6] - body[2:]) @ turn.T).T,
            ]  # fmt: skip
            np.testing.assert_allclose(found[p, : g.AXIS_X], expected, rtol=1e-14, atol=1e-15)


def test_a_vertical_cable_and_one_without_chord() -> None:
    case = random_case(np.random.default_rng(9), 3)
    case.pose[:] = [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0]
    case.robot[0, :6] = [0.1, 0.2, 2.0, 0.1, 0.2, 0.5]
    case.robot[1, :6] = [0.1, 0.2, 2.0, 0.1, 0.2, 2.0]
    found = np.full((1, g.GEOMETRY_ROWS, 3), np.nan)
    g.cable_geometries(case.robot[None], case.body[None], case.pose[None], np.empty((3, 3)), found)
    np.testing.assert_array_equal(found[0, : g.LEVER_X, 0], [0.0, -1.5, 1.5, -1.0, 0.0, 1.0, 0.0])
    assert found[0, g.CHORD, 1] == 0.0
