"""One state of a robot."""

import numpy as np
import pytest

import sagline as sl
from sagline.tension.margin import cable_margins
from sagline.viewer.readout import legend
from sagline.viewer.robot_scene import cable_colors, cable_segments, chord_segments, scaled_position
from sagline.viewer.snapshot import Settings, snapshot_at
from sagline.viewer.tension_scale import TensionScale

ROBOT = sl.load_robot("article-suspended")
HERE = sl.Pose([1.0, 0.5, 2.0], np.eye(3))


def test_snapshot_shows_the_plan_of_its_pose() -> None:
    snapshot = snapshot_at(ROBOT, HERE, Settings(mass=50.0), None)
    plan = sl.inverse(ROBOT, HERE)
    assert snapshot.feasible
    assert snapshot.reason == ""
    assert np.array_equal(snapshot.tension, plan.chord_tension)
    low, high = plan.chord_tension - 25.0, 2000.0 - plan.chord_tension
    assert snapshot.plan is not None
    assert np.array_equal(cable_margins(snapshot.plan.state), np.minimum(low, high))
    assert snapshot.rest is None


def test_margins_are_those_of_the_limited_tension() -> None:
    robot = ROBOT.replace(tension_limits_of="frame_end")
    snapshot = snapshot_at(robot, HERE, Settings(mass=50.0), None)
    plan = sl.inverse(robot, HERE)
    weight = robot.cables.linear_density * 9.81 * plan.unstrained_length
    winch = np.hypot(plan.horizontal_tension, plan.vertical_force - weight)
    assert snapshot.plan is not None
    margin = cable_margins(snapshot.plan.state)
    assert margin == pytest.approx(np.minimum(winch - 25.0, 2000.0 - winch), rel=1e-12)
    assert margin.min() == pytest.approx(float(sl.limit_margin(plan.state)), rel=1e-12)
    assert np.abs(winch - plan.chord_tension).min() > 0.5  # the chord tensions would be seen


def test_settings_change_the_robot() -> None:
    robot = Settings(mass=75.0, density=2.0, stiffness=0.5).applied(ROBOT)
    assert robot.mass == 75.0
    assert robot.inertia == pytest.approx(1.5 * ROBOT.inertia)
    assert robot.cables.linear_density == pytest.approx(0.134)
    assert robot.cables.axial_stiffness == pytest.approx(22e3)
    heavier = snapshot_at(robot, HERE, Settings(mass=75.0), None)
    assert heavier.tension.sum() > 1.4 * snapshot_at(ROBOT, HERE, Settings(mass=50.0), None).tension.sum()


def test_an_invalid_mass_is_refused() -> None:
    with pytest.raises(sl.InvalidValueError):
        Settings(mass=np.nan).applied(ROBOT)


def test_the_rest_pose_of_an_approximate_model_agrees_with_forward() -> None:
    snapshot = snapshot_at(ROBOT, HERE, Settings(mass=50.0, model=sl.Empirical()), None)
    lengths = sl.inverse(ROBOT, HERE, model=sl.Empirical()).unstrained_length
    found = sl.forward(ROBOT, lengths, start=HERE)
    assert snapshot.error == pytest.approx(found.pose.position - HERE.position, abs=1e-9)
    assert 1e-4 < np.linalg.norm(found.pose.position - HERE.position) < 1e-2
    assert snapshot.rest is not None
    drawn = scaled_position(HERE, snapshot.rest, 100.0)
    assert drawn - HERE.position == pytest.approx(100.0 * (found.pose.position - HERE.position), abs=1e-7)


def test_an_infeasible_pose_has_shortfall_and_cables() -> None:
    outside = sl.Pose([7.2, 3.0, 1.5], np.eye(3))
    snapshot = snapshot_at(ROBOT, outside, Settings(mass=50.0), None)
    plan = sl.inverse(ROBOT, outside)
    assert not snapshot.feasible
    assert f"short of {float(plan.shortfall):.1f} N;" in snapshot.reason
    assert snapshot.reason.endswith("cables " + ", ".join(str(i) for i in np.flatnonzero(plan.blocking)))
    assert np.isnan(snapshot.tension).all()
    sizes = np.linalg.norm(np.diff(cable_segments(snapshot, 1.0), axis=1), axis=2)
    assert np.count_nonzero(sizes) == sizes.size // 2  # dashed


def test_the_shortfall_has_the_unit_of_the_readings() -> None:
    heavy, outside = sl.load_robot("fast"), sl.Pose([100.0, 0.0, 200.0], np.eye(3))
    snapshot = snapshot_at(heavy, outside, Settings(mass=heavy.mass), None)
    missing = 1e-3 * float(sl.inverse(heavy, outside).shortfall)
    assert missing > 1.0
    assert f" {missing:.2f} kN;" in snapshot.reason
    assert "tension [kN]" in legend(TensionScale.of(heavy), heavy)


def test_a_platform_at_an_anchor_has_a_status() -> None:
    on_anchor = sl.Pose(ROBOT.frame_anchors[0] - ROBOT.platform_anchors[0], np.eye(3))
    snapshot = snapshot_at(ROBOT, on_anchor, Settings(mass=50.0), None)
    assert not snapshot.feasible
    assert "coincide" in snapshot.reason
    assert np.isfinite(cable_segments(snapshot, 1.0)).all()


def test_straight_lines_are_drawn_only_if_they_differ_from_cables() -> None:
    snapshot = snapshot_at(ROBOT, HERE, Settings(mass=50.0), None)
    assert snapshot.plan is not None
    sag = snapshot.plan.state.cables.sag
    apart = 0.042  # m: two cables sag less below their chords, the others visibly more
    assert np.abs(sag - apart).min() > 0.1 * apart
    for sag_scale in (0.0, 1.0, 3.0):
        ghosts = chord_segments(snapshot, sag_scale, apart).reshape(ROBOT.cable_count, -1, 2, 3)
        drawn = np.linalg.norm(ghosts[:, :, 1] - ghosts[:, :, 0], axis=2) > 0.0
        assert np.array_equal(drawn.any(axis=1), sag_scale * sag > apart)  # taut cables have none
        cables = cable_segments(snapshot, sag_scale).reshape(ghosts.shape)
        away = np.linalg.norm(ghosts - cables, axis=3)
        assert away[drawn].size == 0 or away[drawn].min() > apart
        assert not drawn[:, [0, -1]].any()  # where both end at the same anchor


def test_cables_are_drawn_on_pulleys_at_all_poses() -> None:
    robot = ROBOT.replace(winches=sl.Winch(pulley_radius=0.2, dead_cable=2.0))
    outside = sl.Pose([7.2, 3.0, 1.5], np.eye(3))
    for pose, model in ((HERE, sl.Catenary()), (outside, sl.Elastic())):
        snapshot = snapshot_at(robot, pose, Settings(mass=50.0), None)
        assert snapshot.feasible is (pose is HERE)
        courses = snapshot.courses(1.0)
        np.testing.assert_array_equal(courses[:, 0], ROBOT.frame_anchors)
        np.testing.assert_allclose(courses[:, -1], pose.transform(ROBOT.platform_anchors), atol=1e-9)
        centers = ROBOT.frame_anchors.copy()
        reach = (pose.transform(ROBOT.platform_anchors) - centers)[:, :2]
        centers[:, :2] += 0.2 * reach / np.linalg.norm(reach, axis=1, keepdims=True)
        from_center = np.linalg.norm(courses - centers[:, None], axis=2)
        assert from_center.min() > 0.2 - 1e-9  # none cuts through its pulley
        on_it = np.isclose(from_center, 0.2, rtol=1e-9).sum(axis=1)
        assert (on_it >= 16).all()
        assert cable_colors(snapshot, TensionScale.of(robot)).shape == cable_segments(snapshot, 1.0).shape
        if pose is HERE:
            exits = sl.inverse(robot, pose, model=model).exit_point
            assert np.abs(courses[:, :, None] - exits[:, None, None]).sum(axis=3).min(axis=(1, 2)).max() < 1e-9


def test_a_platform_inside_a_pulley_is_reported() -> None:
    robot = ROBOT.replace(winches=sl.Winch(pulley_radius=0.2))
    corner = ROBOT.frame_anchors[3] - ROBOT.platform_anchors[3]
    snapshot = snapshot_at(robot, sl.Pose(corner + np.array([0.1, 0.1, -1.0]), np.eye(3)), Settings(mass=50.0), None)
    assert not snapshot.feasible
    assert snapshot.reason.startswith("cable 2: ")
    assert "0.282842712 m; allowed: > 0.4 m there" in snapshot.reason
    assert np.isfinite(snapshot.courses(1.0)).all()
