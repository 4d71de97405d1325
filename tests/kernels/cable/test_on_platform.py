"""Cables over pulleys on the platform: energy, wrench, stiffness and slopes of the kernels."""

import numpy as np
import pytest

import sagline as sl
from sagline.core.arrays import Array
from sagline.kernels import statics, tables
from sagline.kernels.cable import geometry as g
from sagline.kernels.cable.terms import Model
from sagline.kernels.forward import platform
from tests.kernels.cable.test_swivel import MODEL, random_cables
from tests.kernels.compiled import compiled

COUNT = 2000
SIXTH = {1: 45.0 / 60.0, 2: -9.0 / 60.0, 3: 1.0 / 60.0}  # differences of sixth order
moved_pose, unbalance = statics.moved_pose, platform.unbalance
platform_energy, platform_stiffness = platform.platform_energy, platform.platform_stiffness


def _each_platform(
    model: Model, cables: Array, lengths: Array, bodies: Array, poses: Array, motion: Array, found: Array
) -> None:
    rows, rotation, none = np.empty((g.CABLE_ROWS, 1)), np.empty((3, 3)), np.zeros(6)
    pose, gradient, stiffness = np.empty(7), np.empty(6), np.empty((6, 6))
    for i in range(cables.shape[0]):
        body, cable = bodies[i], cables[i : i + 1]
        rows[:] = np.nan
        rows[g.LENGTH, 0] = lengths[i]
        moved_pose(body, poses[i], motion[i], pose)
        unbalance(model, cable, body, none, pose, rotation, rows, gradient)
        found[i, 0] = platform_energy(model, cable, body, none, pose, rotation, rows)[0]
        found[i, 1:7] = gradient
        platform_stiffness(model, cable, rows, stiffness)
        found[i, 7:43] = stiffness.reshape(36)
        found[i, 43] = rows[g.LEAVING, 0]


each_platform = compiled(_each_platform)


def random_platforms(seed: int) -> tuple[Array, Array, Array, Array]:
    """Tables, lengths, bodies and poses of platforms without mass, each with a pulley and one cable."""
    rng = np.random.default_rng(seed)
    cables, ends, lengths = random_cables(COUNT, seed)
    turns = rng.normal(size=(COUNT, 4))
    pose = sl.Pose.from_quaternion(rng.normal(size=(COUNT, 3)), turns / np.linalg.norm(turns, axis=1)[:, None])
    anchors = rng.normal(size=(COUNT, 3))
    cables[:, tables.ENTRY] = cables[:, tables.DEAD_RISE] = 0.0
    cables[:, tables.PLATFORM_X : tables.PLATFORM_X + 3] = anchors
    cables[:, :3] = pose.position + (pose.matrix @ anchors[..., None])[..., 0] + ends
    cables[:, tables.AXIS_X :] = (cables[:, None, tables.AXIS_X :] @ pose.matrix)[:, 0]
    bodies = np.zeros((COUNT, tables.BODY_COLUMNS))
    bodies[:, tables.GRAVITY] = MODEL.gravity
    bodies[:, tables.CENTER_X :] = 0.3 * rng.normal(size=(COUNT, 3))
    return cables, lengths, bodies, np.hstack((pose.position, pose.quaternion))


def of_platforms(cables: Array, lengths: Array, bodies: Array, poses: Array, motion: Array) -> Array:
    """Energy, gradient (6), stiffness (36) and exit tension of each platform after `motion` (count, 6)."""
    found = np.empty((COUNT, 44))
    each_platform(MODEL, cables, lengths, bodies, poses, motion, found)
    return found


@pytest.mark.extended
def test_wrench_is_the_gradient_of_the_energy_and_stiffness_of_the_wrench() -> None:
    given = random_platforms(seed=5)
    cables, lengths = given[:2]
    rest = of_platforms(*given, np.zeros((COUNT, 6)))
    tension = np.linalg.norm(rest[:, 1:4], axis=1)
    step = 2e-3 * tension * lengths / cables[:, tables.STIFFNESS]
    gradient, matrix = np.zeros((COUNT, 6)), np.zeros((COUNT, 6, 6))
    for k, axis in enumerate(np.eye(6)):
        for times, weight in SIXTH.items():
            for sign in (1.0, -1.0):
                moved = of_platforms(*given, (sign * times * step)[:, None] * axis)
                gradient[:, k] += sign * weight / step * moved[:, 0]
                matrix[:, :, k] += (sign * weight / step)[:, None] * moved[:, 1:7]
    miss = np.linalg.norm(gradient - rest[:, 1:7], axis=1) / tension
    own = rest[:, 7:43].reshape(-1, 6, 6)
    wrong = np.linalg.norm(matrix - own, axis=(1, 2)) / np.linalg.norm(own, axis=(1, 2))
    heavy = cables[:, tables.DENSITY] * MODEL.gravity * cables[:, tables.PULLEY_RADIUS] / tension
    noise = (np.abs(rest[:, 0]) + tension * lengths) * 1e-16 / step / tension
    # as at the frame, the square of the side angle at the exit is neglected
    assert (miss < 4.0 * (noise + heavy**2)).all()  # 2.1
    assert (wrong < 6.0 * (noise + heavy**2)).all()  # 1.9
    assert np.median(miss) < 2e-9
    light = heavy < 1e-4
    assert light.sum() > 200
    assert max(miss[light].max(), wrong[light].max()) < 6e-9  # rounding: 3.4e-9
