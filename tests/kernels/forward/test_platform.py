"""Motions of a platform about its center of mass, and the wrench of a force at an anchor."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from sagline.kernels import statics
from sagline.kernels.cable import geometry as g
from sagline.kernels.forward import platform
from sagline.kernels.tables import BODY_COLUMNS, CENTER_X, POSE_COLUMNS
from tests.kernels.compiled import from_python

move, add_force = from_python(statics.moved_pose), from_python(platform.add_force)


@pytest.mark.parametrize("size", [1e-12, 0.3, 3.0])
def test_a_motion_shifts_the_center_of_mass_and_rotates_the_platform_about_it(size: float) -> None:
    rng = np.random.default_rng(7)
    body, motion, moved = rng.normal(size=BODY_COLUMNS), size * rng.normal(size=6), np.full(POSE_COLUMNS, np.nan)
    before = Rotation.random(rng=rng)
    pose = np.concatenate((rng.normal(size=3), before.as_quat()))
    move(body, pose, motion, moved)
    after, center = Rotation.from_quat(moved[3:]), body[CENTER_X:]
    turned = Rotation.from_rotvec(motion[3:]) * before
    np.testing.assert_allclose(after.as_matrix(), turned.as_matrix(), rtol=0.0, atol=1e-15 + 1e-15 * size)
    displaced = moved[:3] + after.apply(center) - (pose[:3] + before.apply(center))
    np.testing.assert_allclose(displaced, motion[:3], rtol=0.0, atol=2e-15)


def test_a_force_in_the_plane_of_a_cable_has_the_moment_of_its_lever_arm() -> None:
    rng = np.random.default_rng(8)
    rows, wrench = rng.normal(size=(g.GEOMETRY_ROWS, 3)), rng.normal(size=6)
    horizontal, vertical = 7.0, -3.0
    force = np.array([*(horizontal * rows[[g.AZIMUTH_X, g.AZIMUTH_Y], 1]), vertical])
    lever = rows[[g.LEVER_X, g.LEVER_Y, g.LEVER_Z], 1]
    expected = wrench + np.concatenate((force, np.cross(lever, force)))
    add_force(rows, 1, horizontal, vertical, wrench)
    np.testing.assert_allclose(wrench, expected, rtol=1e-14)
