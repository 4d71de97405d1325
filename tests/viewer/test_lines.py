"""Cables as lines in the world."""

import numpy as np
import pytest

import sagline as sl
from sagline.viewer import shapes

ROBOT = sl.load_robot("article-suspended")
POSE = sl.Pose.from_euler([1.0, -0.7, 2.1], 0.1, -0.05, 0.08)


@pytest.mark.parametrize("sag_scale", [0.0, 1.0, 7.0])
def test_cables_are_drawn_from_anchor_to_anchor(sag_scale: float) -> None:
    plan = sl.inverse(ROBOT, POSE)
    drawn = shapes.catenaries(shapes.chords(ROBOT, POSE), plan.state.cables, sag_scale)
    ends = POSE.position + (POSE.rotation.as_matrix() @ ROBOT.platform_anchors.T).T
    assert np.abs(drawn[:, 0] - ROBOT.frame_anchors).max() < 1e-12
    assert np.abs(drawn[:, -1] - ends).max() < 1e-9


def test_drawn_sag_is_the_sag_times_its_scale() -> None:
    plan = sl.inverse(ROBOT, POSE)
    ends = shapes.chords(ROBOT, POSE)
    for sag_scale in (1.0, 5.0):
        drawn = shapes.catenaries(ends, plan.state.cables, sag_scale)
        run = ends[:, 1] - ends[:, 0]
        share = ((drawn - ends[:, :1])[..., :2] @ run[:, :2, None])[..., 0] / (run[:, :2] ** 2).sum(1)[:, None]
        drop = ends[:, 0, 2:] + share * run[:, 2:] - drawn[..., 2]
        # 41 points do not meet the lowest one: a parabola loses at most 1/40^2 of its sag
        assert drop.max(axis=1) == pytest.approx(sag_scale * plan.state.cables.sag, rel=2e-3)


def test_cable_length_along_the_line_is_the_stretched_length() -> None:
    state = sl.inverse(ROBOT, POSE).state.cables
    drawn = shapes.catenaries(shapes.chords(ROBOT, POSE), state, 1.0)
    along = np.linalg.norm(np.diff(drawn, axis=1), axis=2).sum(axis=1)
    strain = 0.5 * (state.frame_end_tension + state.platform_end_tension) / ROBOT.cables.axial_stiffness
    assert along == pytest.approx(state.unstrained_length * (1.0 + strain), rel=1e-5)


def test_vertical_cable_is_drawn_upright() -> None:
    robot = sl.load_robot("article-suspended")
    corner = robot.frame_anchors[0] - robot.platform_anchors[0]
    pose = sl.Pose(corner - [0.0, 0.0, 3.0], np.eye(3))
    ends = shapes.chords(robot, pose)
    state = sl.Catenary().from_tension(
        robot.cables, np.hypot(*(ends[:, 1] - ends[:, 0])[:, :2].T), (ends[:, 1] - ends[:, 0])[:, 2], 100.0
    )
    drawn = shapes.catenaries(ends, state, 20.0)[0]
    assert np.ptp(drawn[:, :2], axis=0) == pytest.approx([0.0, 0.0], abs=1e-12)
    assert np.all(np.diff(drawn[:, 2]) < 0.0)


def test_dashes_are_every_other_segment() -> None:
    points = shapes.straight(shapes.chords(ROBOT, POSE))
    solid, dashed = (shapes.segments(points, dashed=dashed) for dashed in (False, True))
    sizes = np.linalg.norm(dashed[:, 1] - dashed[:, 0], axis=1).reshape(8, -1)
    assert np.all(sizes[:, 1::2] == 0.0)
    assert np.array_equal(dashed.reshape(8, -1, 2, 3)[:, ::2], solid.reshape(8, -1, 2, 3)[:, ::2])


WOUND = sl.Winch(
    pulley_radius=[0.1, 0.2, 0.3, 0.0, 0.1, 0.2, 0.3, 0.15],
    swivel_axis=[[0, 0, 1]] * 6 + [[0, 0, -1]] * 2,
    dead_cable=[3.0, 3.0, 4.0, 2.0, 0.0, 3.0, 3.0, 3.0],
    dead_rise=[3.0, 1.0, -2.0, 2.0, 0.0, 3.0, 3.0, -3.0],
    drum_radius=0.2,
    drum_width=0.5,
)
OVER_PULLEYS = ROBOT.replace(winches=WOUND)


def test_cables_lead_from_the_anchor_over_the_pulley_to_the_platform() -> None:
    """Lengths on pulleys are drawn as arcs with their radius, and the cable is straight elsewhere."""
    plan = sl.inverse(OVER_PULLEYS, POSE)
    assert plan.wrap_angle is not None
    wraps = shapes.wraps(OVER_PULLEYS, POSE, plan.state)
    np.testing.assert_array_equal(wraps[:, 0], ROBOT.frame_anchors)
    np.testing.assert_allclose(wraps[:, -1], plan.exit_point, atol=1e-15)
    on_pulley = np.linalg.norm(np.diff(wraps, axis=1), axis=2).sum(axis=1)
    chord_of_arc = 2.0 * (shapes.WRAP_POINTS - 1) * np.sin(plan.wrap_angle / (2.0 * (shapes.WRAP_POINTS - 1)))
    np.testing.assert_allclose(on_pulley, WOUND.pulley_radius * chord_of_arc, atol=1e-12)
    free = shapes.catenaries(shapes.chords(OVER_PULLEYS, POSE, wraps[:, -1]), plan.state.cables, 1.0)
    np.testing.assert_allclose(free[:, -1], POSE.transform(ROBOT.platform_anchors), atol=1e-9)
    strain = 0.5 * (plan.state.cables.frame_end_tension + plan.state.cables.platform_end_tension) / 44e3
    along = np.linalg.norm(np.diff(free, axis=1), axis=2).sum(axis=1)
    np.testing.assert_allclose(along, plan.free_length * (1.0 + strain), rtol=1e-5)
    whole = np.concatenate((wraps[:, :-1], free), axis=1)[WOUND.pulley_radius > 0.0]
    steps = np.diff(whole, axis=1)
    steps /= np.linalg.norm(steps, axis=2, keepdims=True)
    bend = np.arccos(np.clip(np.einsum("ijk,ijk->ij", steps[:, 1:], steps[:, :-1]), -1.0, 1.0))
    assert bend.max() < 1.01 * plan.wrap_angle.max() / (shapes.WRAP_POINTS - 1)


def test_straight_cables_leave_pulleys_like_weightless_ones() -> None:
    plan = sl.inverse(OVER_PULLEYS, POSE, model=sl.Elastic())
    np.testing.assert_allclose(shapes.wraps(OVER_PULLEYS, POSE)[:, -1], plan.exit_point, atol=1e-12)


def test_the_dead_length_is_drawn_to_its_rise() -> None:
    runs, upright = shapes.dead_runs(OVER_PULLEYS)
    np.testing.assert_array_equal(runs[:, 0], ROBOT.frame_anchors)
    np.testing.assert_array_equal(runs[:, 1, :2], ROBOT.frame_anchors[:, :2])
    np.testing.assert_allclose(runs[:, 0, 2] - runs[:, 1, 2], WOUND.dead_rise, atol=1e-15)
    assert upright.tolist() == [True, False, False, True, True, True, True, True]
    assert not np.diff(shapes.dead_runs(ROBOT)[0], axis=1).any()


def test_drums_touch_the_ends_of_their_dead_lengths() -> None:
    axes, feet = shapes.drum_axes(OVER_PULLEYS), shapes.dead_runs(OVER_PULLEYS)[0][:, 1]
    np.testing.assert_allclose(np.linalg.norm(axes[:, 1] - axes[:, 0], axis=1), 0.5, rtol=1e-12)
    assert not (axes[:, 1] - axes[:, 0])[:, 2].any()
    middle = axes.mean(axis=1)
    np.testing.assert_allclose(np.linalg.norm(middle - feet, axis=1), 0.2, rtol=1e-12)
    out = np.linalg.norm(middle[:, :2], axis=1) - np.linalg.norm(feet[:, :2], axis=1)
    np.testing.assert_allclose(out, 0.2, rtol=1e-3)
    assert len(shapes.drum_axes(ROBOT)) == 0
