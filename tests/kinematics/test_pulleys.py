"""Robots with pulleys and dead length: forward of inverse, energy, and derivatives."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np
import pytest
from scipy.optimize import linprog
from scipy.spatial.transform import Rotation

import sagline as sl
from sagline.core.arrays import Array
from tests.tension.reference import needed, presets, random_poses, ropes, structure, unbalanced
from tests.tiers import extended, wide

WINCHES = [
    sl.Winch(0.05),
    sl.Winch(0.2, dead_cable=3.0, dead_rise=2.0),
    sl.Winch(0.1, dead_cable=4.0, dead_rise=-1.0, swivel_axis=[0, 0, -1]),
    sl.Winch(dead_cable=4.0),
]
NO_FORCE, NO_LENGTH = np.zeros(6), np.zeros(8)
POSE = sl.Pose.from_euler((1.5, 1.0, 2.0), 0.1, -0.1, 0.3)


def cogiro(winch: sl.Winch, softer: float = 1.0) -> sl.Robot:
    robot = sl.load_robot("cogiro")
    cables = robot.cables.replace(axial_stiffness=softer * robot.cables.axial_stiffness)
    return robot.replace(winches=winch, cables=cables, tension_min=100.0)


def test_winches_without_pulleys_and_dead_length_change_no_number() -> None:
    for robot in (sl.load_robot("cogiro"), sl.load_robot("article-mixed")):
        bare, idle = (
            sl.inverse(one, random_poses(robot, 50, np.random.default_rng(1)))
            for one in (robot, robot.replace(winches=sl.Winch(drum_radius=0.1, gear=20.0)))
        )
        assert idle.state.contact is None
        np.testing.assert_array_equal(bare.unstrained_length, idle.unstrained_length)
        np.testing.assert_array_equal(bare.chord_tension, idle.chord_tension)
        np.testing.assert_array_equal(idle.exit_point[3], robot.frame_anchors)


@pytest.mark.parametrize("winch", WINCHES)
@pytest.mark.parametrize("model", wide([sl.Straight(), sl.Elastic(), sl.Empirical(), sl.Parabolic(), sl.Catenary()]))
def test_lengths_give_the_pose(winch: sl.Winch, model: sl.CableModel) -> None:
    plan = sl.inverse(cogiro(winch), POSE, model)
    assert plan.feasible
    start = sl.Pose((1.0, 1.5, 2.2), np.eye(3))
    found = sl.forward(plan.state.one_robot, plan.unstrained_length, start=start, model=model)
    np.testing.assert_allclose(found.pose.position, POSE.position, atol=1e-11)
    if not isinstance(model, sl.Straight):
        np.testing.assert_allclose(found.state.chord_tension, plan.chord_tension, rtol=1e-8)
        np.testing.assert_allclose(found.state.free_length, plan.free_length, atol=1e-10)
    np.testing.assert_allclose(found.state.exit_point, plan.exit_point, atol=1e-9)


@extended
@pytest.mark.parametrize("robot", presets(), ids=lambda robot: robot.name)
def test_distant_starts_converge_with_pulleys_and_dead_length(robot: sl.Robot) -> None:
    """Initial poses off by 20 degrees and a meter, or by a tenth of the frame of a small robot."""
    rng = np.random.default_rng(4)
    poses = random_poses(robot, 20, rng)
    plan = sl.inverse(robot.replace(winches=sl.Winch(0.05, dead_cable=5.0)), poses)
    kept = plan.feasible
    aside = rng.normal(size=(20, 3)) @ robot.freedom[:, :3].T @ robot.freedom[:, :3]
    axes = rng.normal(size=(20, 3)) @ robot.freedom[:, 3:].T @ robot.freedom[:, 3:]
    lengths = np.linalg.norm(axes, axis=1, keepdims=True)
    turn = Rotation.from_rotvec(np.radians(20.0) * axes / np.where(lengths > 0.0, lengths, 1.0))
    far = min(1.0, 0.1 * float(np.ptp(robot.frame_anchors, axis=0).max()))
    away = far * aside / np.linalg.norm(aside, axis=1, keepdims=True)
    starts = sl.Pose(poses.position + away, turn * poses.rotation)
    found = sl.forward(plan.state.robot, plan.unstrained_length[kept], start=starts[kept])
    assert kept.sum() > 10
    assert found.solved.all()
    assert np.abs(found.pose.position - poses.position[kept]).max() < 1e-9


@pytest.mark.parametrize("winch", WINCHES)
def test_forces_balance_the_platform(winch: sl.Winch) -> None:
    plan = sl.inverse(cogiro(winch), random_poses(cogiro(winch), 50, np.random.default_rng(2)))
    assert plan.feasible.all()
    assert np.abs(unbalanced(plan)).max() < 1e-8


@pytest.mark.parametrize("winch", WINCHES[:3])
def test_cables_leave_along_their_force(winch: sl.Winch) -> None:
    """The free span begins on the pulley, tangent to it, and ends at the platform."""
    plan = sl.inverse(cogiro(winch, softer=0.02), POSE)
    robot, cables = plan.state.one_robot, plan.state.cables
    assert cables.closure_residual.max() < 1e-9
    ends = POSE.transform(robot.platform_anchors)
    reach = ends - plan.exit_point
    np.testing.assert_allclose(np.hypot(reach[:, 0], reach[:, 1]), cables.span, atol=1e-12)
    np.testing.assert_allclose(reach[:, 2], cables.rise, atol=1e-12)
    first = np.diff(cables.points(20_001)[:, :2], axis=1)[:, 0]
    outward = reach[:, :2] / np.linalg.norm(reach[:, :2], axis=1, keepdims=True)
    center = robot.frame_anchors + winch.pulley_radius * np.column_stack((outward, np.zeros(8)))
    spoke = plan.exit_point - center
    np.testing.assert_allclose(np.linalg.norm(spoke, axis=1), winch.pulley_radius, rtol=1e-12)
    along = np.column_stack((first[:, :1] * outward, first[:, 1]))
    cosine = (along * spoke).sum(axis=1) / np.linalg.norm(along, axis=1) / winch.pulley_radius
    assert np.abs(cosine).max() < 2e-5  # of the first of 20,000 pieces


@extended
@pytest.mark.parametrize("winch", WINCHES)
@pytest.mark.parametrize("model", [sl.Elastic(), sl.Catenary()])
def test_slopes_of_the_energy_are_position_and_tensions(winch: sl.Winch, model: sl.CableModel) -> None:
    """At an equilibrium dE/d(force) is minus the position and dE/dL minus H = T + T^2/(2 EA) - w z."""
    robot = cogiro(winch, softer=0.02)
    plan = sl.inverse(robot, POSE, model)

    def energy(wrench: Array, lengths: Array) -> float:
        found = sl.forward(robot, lengths, start=POSE, model=model, wrench=wrench)
        assert found.solved
        return float(found.energy)

    lengths = plan.unstrained_length

    def energy_by(step: float, force: Array = NO_FORCE, length: Array = NO_LENGTH) -> float:
        return energy(step * force, lengths + step * length)

    center = POSE.transform(robot.center_of_mass)
    for k in range(3):
        step = np.eye(6)[k]
        assert slope(partial(energy_by, force=step), 1.0) == pytest.approx(-center[k], abs=1e-7)
    weight = 0.0 if isinstance(model, sl.Elastic) else robot.cables.linear_density * robot.gravity
    cables = plan.state.cables
    tension = cables.frame_end_tension
    height = (plan.exit_point - robot.frame_anchors)[:, 2]
    whole = tension + 0.5 * tension**2 / robot.cables.axial_stiffness - weight * height
    for i in (0, 5):
        step = np.eye(8)[i]
        found = slope(partial(energy_by, length=step), 1e-4)
        # the frame end, the zero of the energy, is the source of the weight of released cable
        assert found == pytest.approx(-whole[i], rel=2e-6)


def slope(of: Callable[[float], float], step: float) -> float:
    """Central difference with extrapolation of the first error term."""
    return float((8.0 * (of(0.5 * step) - of(-0.5 * step)) - (of(step) - of(-step))) / (6.0 * step))


def motion(robot: sl.Robot, lengths: Array, wrench: Array | None = None) -> Array:
    """Displacement of the center of mass, and half of the skew part of the rotation, relative to POSE."""
    found = sl.forward(robot, lengths, start=POSE, wrench=wrench)
    assert found.solved
    turn = found.pose.matrix @ POSE.matrix.T
    skew = 0.5 * np.array([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]])
    return np.concatenate((found.pose.transform(robot.center_of_mass) - POSE.transform(robot.center_of_mass), skew))


def slopes(of: Callable[[float], Array], step: float) -> Array:
    return np.asarray((8.0 * (of(0.5 * step) - of(-0.5 * step)) - (of(step) - of(-step))) / (6.0 * step))


@extended
@pytest.mark.parametrize("winch", WINCHES)
def test_sensitivities_of_the_pose_agree_with_differences(winch: sl.Winch) -> None:
    robot = cogiro(winch, softer=0.05)
    plan = sl.inverse(robot, POSE)
    found, lengths, cable = sl.stiffness(plan.state), plan.unstrained_length, np.eye(8)[2]
    one = robot.winches
    assert one is not None

    def changed(field: str, by: float) -> sl.Robot:
        return robot.replace(cables=robot.cables.replace(**{field: getattr(robot.cables, field) + by * cable}))

    def behind(field: str, by: float) -> sl.Robot:
        return robot.replace(winches=one.replace(**{field: getattr(one, field) + by * cable}))

    def moved(by: float) -> sl.Robot:
        return robot.replace(frame_anchors=robot.frame_anchors + by * np.outer(cable, [1.0, 0.0, 0.0]))

    def pushed(wrench: Array, by: float) -> Array:
        return motion(robot, lengths, by * wrench)

    differences = {
        "length_sensitivity": slopes(lambda h: motion(robot, lengths + h * cable), 2e-3),
        "density_sensitivity": slopes(lambda h: motion(changed("linear_density", h), lengths), 2e-3),
        "stiffness_sensitivity": slopes(lambda h: motion(changed("axial_stiffness", h), lengths), 50.0),
        "frame_anchor_sensitivity": slopes(lambda h: motion(moved(h), lengths), 2e-3),
    }
    if one.pulley_radius.all():
        differences["pulley_radius_sensitivity"] = slopes(lambda h: motion(behind("pulley_radius", h), lengths), 2e-3)
    if one.dead_cable.all():
        differences["dead_cable_sensitivity"] = slopes(lambda h: motion(behind("dead_cable", h), lengths), 2e-3)
    for name, expected in differences.items():
        column = getattr(found, name)[:, 2]
        column = column[:, 0] if name == "frame_anchor_sensitivity" else column
        # the neglected terms on the pulley are of the order of beta = w R/EA, here 1e-6 times the share of the cable
        np.testing.assert_allclose(column, expected, rtol=0.0, atol=3e-7 * np.abs(expected).max(), err_msg=name)
    for k in range(6):
        wrench = np.eye(6)[k]
        expected = slopes(partial(pushed, wrench), 2.0)
        scale = np.abs(expected).max()
        np.testing.assert_allclose(found.compliance[:, k], expected, rtol=0.0, atol=3e-7 * scale)
    matrix = found.matrix
    assert np.abs(matrix - matrix.T).max() < 1e-12 * np.abs(matrix).max()


@extended
@pytest.mark.parametrize("winch", WINCHES)
def test_sensitivities_of_tensions_agree_with_differences(winch: sl.Winch) -> None:
    robot = cogiro(winch, softer=0.05)
    plan = sl.inverse(robot, POSE)
    lengths, cable = plan.unstrained_length, np.eye(8)[3]

    def tensions(by: float) -> Array:
        return sl.forward(robot, lengths + by * cable, start=POSE).state.cables.frame_end_tension

    expected = slopes(tensions, 2e-3)
    found = sl.stiffness(plan.state).tension_sensitivity[:, 3]
    np.testing.assert_allclose(found, expected, rtol=0.0, atol=3e-7 * np.abs(expected).max())


def test_a_vanishing_radius_gives_a_cable_from_its_anchor() -> None:
    bare = sl.inverse(cogiro(sl.Winch()), POSE)
    errors = [
        np.abs(sl.inverse(cogiro(sl.Winch(radius)), POSE).unstrained_length - bare.unstrained_length).max()
        for radius in (1e-3, 1e-6, 1e-9)
    ]
    assert errors[0] < 2e-3
    np.testing.assert_allclose(errors, errors[0] * np.array([1.0, 1e-3, 1e-6]), rtol=2e-3)


@extended
def test_slopes_by_the_radius_exist_at_radius_zero() -> None:
    """Slopes by R at R = 0 of a robot without winches, by one-sided differences at the same lengths."""
    robot = sl.load_robot("cogiro")
    plan, cable = sl.inverse(robot, POSE), np.eye(8)[2]
    still, near, far = (
        motion(robot.replace(winches=sl.Winch(radius * cable)), plan.unstrained_length) for radius in (0.0, 1e-5, 2e-5)
    )
    expected = (4.0 * near - far - 3.0 * still) / 2e-5
    found = sl.stiffness(plan.state).pulley_radius_sensitivity[:, 2]
    np.testing.assert_allclose(found, expected, rtol=0.0, atol=1e-6 * np.abs(expected).max())


def test_rotated_and_shifted_robots_need_the_same_lengths() -> None:
    robot = cogiro(WINCHES[1])
    turn, shift = Rotation.from_rotvec([0.0, 0.0, 0.7]), np.array([10.0, -5.0, 3.0])
    other = robot.replace(frame_anchors=robot.frame_anchors @ turn.as_matrix().T + shift)
    pose = sl.Pose(turn.as_matrix() @ POSE.position + shift, turn * POSE.rotation)
    lengths = [sl.inverse(each, where).unstrained_length for each, where in ((robot, POSE), (other, pose))]
    np.testing.assert_allclose(lengths[0], lengths[1], rtol=1e-13)


@extended
def test_errors_of_omitted_pulleys_agree_with_the_documentation() -> None:
    """A pulley of 25 to 50 mm that is missing in the plan, with lengths counted from the middle of the box."""
    robot = sl.load_robot("cogiro")
    poses = random_poses(robot, 40, np.random.default_rng(7))
    home = sl.Pose((0.0, 0.0, 2.0), np.eye(3))
    plan, at_home = sl.inverse(robot, poses), sl.inverse(robot, home)
    real = robot.replace(winches=sl.Winch(0.05))
    zero = sl.inverse(real, home).unstrained_length - at_home.unstrained_length
    found = sl.forward(real, (plan.unstrained_length + zero)[plan.feasible], start=poses[plan.feasible])
    off = np.linalg.norm(found.pose.position - poses.position[plan.feasible], axis=1)
    assert found.solved.all()
    assert 0.005 < off.mean() < 0.04
    assert off.max() < 0.12


def test_the_rate_of_winding_is_the_slope_of_the_lengths() -> None:
    robot = cogiro(WINCHES[1])
    path = sl.quintic_path([(0.0, 0.0, 2.0), (1.0, 0.5, 2.5)], durations=4.0, rate=200)
    plan = sl.inverse(robot, path)
    rates = plan.length_rate
    assert rates is not None
    lengths = plan.unstrained_length
    # fourth-order differences of the lengths along the path
    step = path.time[1] - path.time[0]
    inner = (8.0 * (lengths[3:-1] - lengths[1:-3]) - (lengths[4:] - lengths[:-4])) / (12.0 * step)
    assert np.abs(rates[2:-2] - inner).max() < 2e-5 * np.abs(rates).max()


def test_rates_of_a_cable_at_its_limit_agree_with_the_limit_without_pulley() -> None:
    robot = sl.load_robot("cogiro").replace(tension_min=150.0)
    points = [(0.0, 0.0, 1.5), (3.0, 1.0, 2.5), (-3.0, 2.0, 3.0), (4.0, -2.0, 1.2)]
    path = sl.quintic_path(points, durations=[3.0] * 3, rate=20)
    bare, tiny = (sl.inverse(one, path) for one in (robot, robot.replace(winches=sl.Winch(1e-9))))
    assert np.isclose(bare.chord_tension, 150.0, rtol=1e-9).any(axis=1).sum() >= 5
    expected, found = bare.length_rate, tiny.length_rate
    assert expected is not None
    assert found is not None
    np.testing.assert_allclose(found, expected, rtol=0.0, atol=1e-5 * np.abs(expected).max())


def formula_error(robot: sl.Robot, poses: sl.Pose) -> float:
    """Length errors if exit point and wrap are those of the straight cable, with the exact catenary from there [m]."""
    plan, winches = sl.inverse(robot, poses), robot.winches
    assert winches is not None
    reach = -ropes(robot, poses.position[:, None] + robot.platform_anchors @ np.swapaxes(poses.matrix, 1, 2))
    span, rise = np.hypot(reach[..., 0], reach[..., 1]), reach[..., 2]
    tension = plan.chord_tension
    free = sl.Catenary().from_tension(robot.cables, span, rise, np.nan_to_num(tension, nan=1.0), robot.gravity)
    angle = np.arctan2(span, winches.swivel_axis[:, 2] * rise)
    behind = winches.pulley_radius * angle + winches.dead_cable
    lengths = free.unstrained_length + behind / (1.0 + tension / robot.cables.axial_stiffness)
    return float(np.nanmax(np.abs(lengths - plan.unstrained_length)))


def test_the_exit_point_of_a_straight_cable_is_wrong_by_micrometers() -> None:
    robot = sl.load_robot("cogiro")
    poses = random_poses(robot, 60, np.random.default_rng(1))
    bare, dead = (
        formula_error(robot.replace(winches=sl.Winch(0.05, dead_cable=length)), poses) for length in (0.0, 4.0)
    )
    assert 1e-7 < bare < 3e-5
    assert bare < dead < 3e-4


def test_dead_length_stretches_as_a_spring() -> None:
    """Weightless cables: the stretch of the dead part is T D/EA, so its unstrained length is D/(1 + T/EA)."""
    plan = sl.inverse(cogiro(sl.Winch(dead_cable=4.0)), POSE, sl.Elastic())
    contact = plan.state.contact
    assert contact is not None
    strain = plan.chord_tension / plan.state.one_robot.cables.axial_stiffness
    np.testing.assert_allclose(contact.dead_length, 4.0 / (1.0 + strain), rtol=1e-14)
    np.testing.assert_array_equal(contact.wrapped_length, 0.0)


def test_limits_of_the_frame_end_apply_at_the_pulley() -> None:
    robot = cogiro(WINCHES[1]).replace(tension_limits_of="frame_end", tension_min=400.0, tension_max=1200.0)
    plan = sl.inverse(robot, random_poses(robot, 30, np.random.default_rng(3)), tension=sl.LowestSum())
    tension = plan.state.cables.frame_end_tension[plan.feasible]
    assert plan.feasible.sum() > 5
    assert tension.min() == pytest.approx(400.0, abs=1e-6)
    assert (tension >= 400.0 - 1e-6).all()
    assert (tension <= 1200.0 + 1e-6).all()


@pytest.mark.parametrize("direction", [0, 1, 4])
def test_the_boundary_of_feasibility_agrees_with_tangents(direction: int) -> None:
    """The largest load of weightless cables by verdicts, compared with a linear program for the load."""
    robot = cogiro(WINCHES[0]).replace(tension_min=0.0, tension_max=800.0)
    matrix, along = structure(robot, POSE), np.eye(6)[direction]
    most = linprog(
        np.append(np.zeros(8), -1.0),
        A_eq=np.column_stack((matrix, along)),
        b_eq=needed(robot, np.zeros(6)),
        bounds=[(0.0, 800.0)] * 8 + [(0.0, None)],
        method="highs",
    ).x[8]
    inside, outside = (
        sl.inverse(robot, POSE, sl.Elastic(), wrench=share * most * along) for share in (1.0 - 1e-6, 1.0 + 1e-6)
    )
    assert inside.feasible
    assert not outside.feasible


def test_a_weightless_cable_without_tension_leaves_along_its_chord() -> None:
    robot = cogiro(WINCHES[0]).replace(tension_min=0.0, tension_max=800.0)
    plan = sl.inverse(robot, POSE, sl.Elastic(), tension=sl.LowestSum(), wrench=[0.0, 900.0, 0.0, 0.0, 0.0, 0.0])
    slack = plan.chord_tension == 0.0
    assert plan.feasible
    assert slack.any()
    assert plan.wrap_angle is not None
    reach = -ropes(robot, POSE.transform(robot.platform_anchors))
    wraps = np.arctan2(np.hypot(reach[:, 0], reach[:, 1]), reach[:, 2])
    np.testing.assert_allclose(plan.wrap_angle, wraps, rtol=1e-12)
    chords = np.linalg.norm(reach, axis=1)
    np.testing.assert_allclose(plan.unstrained_length[slack], (chords + 0.05 * wraps)[slack], rtol=1e-12)
