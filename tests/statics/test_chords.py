"""Chords that touch pulleys, compared with the circle."""

import numpy as np
import pytest

import sagline as sl
from sagline.core.arrays import Array
from sagline.kernels.cable import geometry
from sagline.statics.tables import chord_geometry, touching_angle

RADIUS = 0.2
BASE = sl.load_robot("article-suspended")


@pytest.mark.parametrize("entry", [1.0, -1.0])
@pytest.mark.parametrize("seed", range(4))
def test_chords_touch_their_pulleys(entry: float, seed: int) -> None:
    rng = np.random.default_rng(seed)
    robot = BASE.replace(winches=sl.Winch(pulley_radius=RADIUS, swivel_axis=(0, 0, entry)))
    pose = sl.Pose(rng.uniform((-3.0, -3.0, 0.0), (3.0, 3.0, 5.0)), np.eye(3))
    ends = pose.transform(robot.platform_anchors)
    outward, up = (ends - robot.frame_anchors) * [1.0, 1.0, 0.0], np.array([0.0, 0.0, entry])
    outward /= np.linalg.norm(outward, axis=1, keepdims=True)
    centers = robot.frame_anchors + RADIUS * outward

    def on_pulleys(angle: Array) -> Array:
        return np.asarray(centers + RADIUS * (np.sin(angle)[:, None] * up - np.cos(angle)[:, None] * outward))

    chord = chord_geometry(robot, pose)[0, geometry.CHORD]
    np.testing.assert_allclose(chord**2 + RADIUS**2, ((ends - centers) ** 2).sum(axis=1), rtol=1e-13)
    exits = on_pulleys(touching_angle(robot, pose))
    np.testing.assert_allclose(np.linalg.norm(ends - exits, axis=1), chord, rtol=1e-13)
    np.testing.assert_allclose(np.einsum("ij,ij->i", ends - exits, exits - centers), 0.0, atol=1e-13)
    # the tangent that continues in the direction of the cable around the pulley
    forward = on_pulleys(touching_angle(robot, pose) + 1e-3) - exits
    assert (np.einsum("ij,ij->i", forward, ends - exits) > 0.0).all()


def test_without_pulleys_chords_begin_at_the_anchors() -> None:
    pose = sl.Pose([1.0, -0.5, 2.0], np.eye(3))
    assert not touching_angle(BASE, pose).any()
    chord = chord_geometry(BASE, pose)[0, geometry.CHORD]
    ends = pose.transform(BASE.platform_anchors)
    np.testing.assert_allclose(chord, np.linalg.norm(ends - BASE.frame_anchors, axis=1), rtol=1e-14)
