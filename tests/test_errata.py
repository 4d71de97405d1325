"""The errata of the article, each shown by a calculation; docs/errata.md lists the tests."""

from __future__ import annotations

import math

import numpy as np
from scipy.integrate import quad
from scipy.optimize import minimize_scalar
from scipy.spatial.transform import Rotation

import sagline as sl

CABLE = sl.Cable(0.067, 44e3)  # simulation of the article
WEIGHT = 0.067 * 9.81


def worst_error(robot: sl.Robot, model: sl.CableModel) -> float:
    """Largest position error along the path of the article with the lengths of a model [m]."""
    plan = sl.inverse(robot, sl.article_path(rate=5.0), model, sl.MinimumNorm())
    found = sl.forward(robot, plan.unstrained_length, start=plan.state.pose, wrench=plan.state.wrench)
    return float(np.linalg.norm(found.pose.position - plan.state.pose.position, axis=1).max())


def test_erratum_1_the_printed_sign_of_the_intercept_costs_a_centimeter() -> None:
    """(28), (30): b_pi = +rho g D/2 at the platform end; the printed minus sign is for the frame end."""
    state = sl.Catenary().from_tension(CABLE, 8.0, -5.0, 300.0)
    chord, slope = math.hypot(8.0, 5.0), -5.0 / 8.0
    at_platform = float(state.vertical_force - slope * state.horizontal_tension)
    at_frame = float(state.vertical_force - state.cable_weight - slope * state.horizontal_tension)
    np.testing.assert_allclose(at_platform, WEIGHT * chord / 2, rtol=0.01)
    np.testing.assert_allclose(at_frame, -WEIGHT * chord / 2, rtol=0.01)
    robot = sl.load_robot("article-suspended")
    assert worst_error(robot, sl.Empirical()) < 2e-3
    assert 9e-3 < worst_error(robot, sl.Empirical(k_h=-4.845)) < 10e-3


def test_erratum_2_gravity_read_literally_counts_twice_or_not_at_all() -> None:
    """(5) adds M g and (51) contains -mg: for both signs of g the cables would carry 0 or 2 Mg. They carry Mg."""
    robot = sl.load_robot("article-suspended")
    pose = sl.Pose.from_euler([0.5, -0.3, 1.5], 0.0, 0.0, 0.0)
    weight = robot.mass * robot.gravity
    _, b = sl.article_balance(robot, pose)
    pulls = b[2] + weight  # the contribution of the weight of the cables; (51) without its -mg
    for sign, lifted in ((-1.0, 0.0), (1.0, 2.0)):
        literal = sign * weight - (b[2] - pulls)
        np.testing.assert_allclose(literal, lifted * weight)
    plan = sl.inverse(robot, pose)
    np.testing.assert_allclose(-plan.vertical_force.sum(), weight, rtol=1e-12)


def test_erratum_3_euler_accelerations_and_the_spurious_force() -> None:
    """(5): Euler-angle rates are not the angular velocity, and M W x' is not a force."""
    alpha, beta, gamma = 0.4, 0.5, -0.3
    rates, step = np.array([0.7, -0.4, 0.6]), 1e-6

    def turned(t: float) -> Rotation:
        return Rotation.from_euler("ZYX", np.array([alpha, beta, gamma]) + t * rates)

    omega = (turned(step) * turned(-step).inv()).as_rotvec() / (2 * step)
    sa, ca, sb, cb = math.sin(alpha), math.cos(alpha), math.sin(beta), math.cos(beta)
    mapped = [-sa * rates[1] + ca * cb * rates[2], ca * rates[1] + sa * cb * rates[2], rates[0] - sb * rates[2]]
    np.testing.assert_allclose(omega, mapped, atol=1e-9)
    assert np.linalg.norm(omega - rates[::-1]) > 0.3  # compared with (gamma', beta', alpha') as x, y, z rates
    robot = sl.load_robot("article-suspended")
    coasting = np.array([[1.0, 0.5, 0.0, 0.0, 0.0, 0.8]])  # constant velocity and spin: no force is required
    pose = sl.Pose(np.zeros((1, 3)), Rotation.identity())
    force = sl.inertial_wrench(robot, pose, coasting, np.zeros((1, 6)))[0, :3]
    np.testing.assert_allclose(force, 0.0, atol=1e-12)
    assert robot.mass * np.linalg.norm(np.cross(coasting[0, 3:], coasting[0, :3])) > 40.0  # M W x' of the article


def test_erratum_4_the_normal_matrix_has_no_inverse() -> None:
    """(52) inverts H^T H, of rank 6 of 8; the minimum norm is H^T (H H^T)^-1."""
    robot = sl.load_robot("article-suspended")
    pose = sl.Pose.from_euler([1.0, 0.5, 1.5], 0.0, 0.0, 0.0)
    h, b = sl.article_balance(robot, pose)
    assert np.linalg.matrix_rank(h.T @ h) == 6
    least = h.T @ np.linalg.solve(h @ h.T, -b)
    plan = sl.inverse(robot, pose, sl.Empirical(), sl.MinimumNorm(variable="horizontal"))
    np.testing.assert_allclose(plan.horizontal_tension, least, rtol=1e-10)


def test_erratum_5_the_stretch_takes_the_mean_tension_not_the_one_at_the_end() -> None:
    """(35), (36): off by w L^2 sin(phi)/(2 EA), 1.7 mm sin(phi) at 15 m."""
    for rise in (9.0, -9.0):
        state = sl.Catenary().from_tension(CABLE, 12.0, rise, 300.0)
        length, bottom = float(state.unstrained_length), float(state.vertical_force - state.cable_weight)
        pull = float(state.horizontal_tension)
        stretch = quad(lambda s: math.hypot(pull, bottom + WEIGHT * s) / 44e3, 0.0, length)[0]  # noqa: B023
        printed = float(state.platform_end_tension) * length / 44e3
        expected = WEIGHT * length**2 * (rise / 15.0) / (2 * 44e3)
        np.testing.assert_allclose(printed - stretch, expected, rtol=0.02)
    np.testing.assert_allclose(WEIGHT * 15.0**2 / (2 * 44e3), 1.7e-3, rtol=0.02)


def test_erratum_6_the_published_sag_constant_is_a_tenth_too_large_for_shallow_cables() -> None:
    """(45): k_p = 4.385 compared with g^2/24 = 4.010, the result of exact, inextensible cables."""
    stiff = sl.Cable(0.067, 1e14)
    tension = np.array([300.0, 600.0])
    state = sl.Catenary().from_tension(stiff, 9.0, 4.0, tension)
    k_p = state.adjusting_length * (tension / (0.067 * 9.0)) ** 2 / math.hypot(9.0, 4.0)
    np.testing.assert_allclose(k_p, 9.81**2 / 24, rtol=1e-4)
    np.testing.assert_allclose(4.385 / k_p, 1.094, atol=1e-3)


def test_erratum_7_the_bound_of_a_suspended_cable_is_positive() -> None:
    """(54): T_x > +|b_pi/a_pi| is the condition that the lowest point of the exact cable leaves the span."""
    span, rise = 8.0, -3.0
    bound = WEIGHT * math.hypot(span, rise) / 2 / abs(rise / span)
    assert bound > 0
    inside, outside = (
        sl.Catenary().profile(
            CABLE, sl.Catenary().from_tension(CABLE, span, rise, t * math.hypot(span, rise) / span), 500
        )
        for t in (0.9 * bound, 1.1 * bound)
    )
    assert np.argmin(inside[:, 1]) < 499
    assert np.argmin(outside[:, 1]) == 499


def test_erratum_8_the_articles_variables_break_down_under_an_anchor_and_at_level() -> None:
    """(26), (50): tan(phi) is infinite for a vertical cable; (54) is infinite for a level one. Ours are finite."""
    robot = sl.load_robot("article-suspended")
    anchor, corner = robot.frame_anchors[0], robot.platform_anchors[0]
    under = sl.Pose.from_euler([*(anchor - corner)[:2], 2.0], 0.0, 0.0, 0.0)
    with np.errstate(divide="ignore", invalid="ignore"):
        h, _ = sl.article_balance(robot, under)
    assert not np.isfinite(h[:, 0]).all()
    assert np.isfinite(sl.structure_matrix(robot, under)).all()
    np.testing.assert_allclose(sl.structure_matrix(robot, under)[:3, 0], (0.0, 0.0, 1.0), atol=1e-12)
    level = sl.Pose.from_euler([0.0, 0.0, float((anchor - corner)[2])], 0.0, 0.0, 0.0)
    strong = robot.replace(tension_max=1e9)
    bounded = sl.inverse(strong, level, tension=sl.MinimumNorm(lowest_point_margin=0.0))
    assert not bounded.feasible
    state = sl.Catenary().from_tension(CABLE, 10.0, 0.0, 100.0)
    assert state.status == sl.CableStatus.SOLVED


def test_erratum_9_the_errors_of_table_2_are_distances() -> None:
    """(56) sums B_i - P, meters; the table's 17.1464 mm and 44.7884 mm are |actual - desired|."""
    desired = np.array([[0.22, -0.45, 1.43], [-0.13, 1.42, 0.68]])
    actual = np.array([[0.2220, -0.4510, 1.4470], [-0.1290, 1.4380, 0.7210]])
    np.testing.assert_allclose(np.linalg.norm(actual - desired, axis=1) * 1e3, [17.1464, 44.7884], atol=5e-5)
    robot = sl.load_robot("article-prototype")
    ends = actual[0] + robot.platform_anchors
    assert np.linalg.norm((ends - actual[0]).sum(axis=0)) < 1e-12  # the sum of B_i - P is always 0
    assert np.linalg.norm(ends.sum(axis=0) - actual[0]) > 5.0  # (sum of B_i) - P in meters


def test_erratum_10_the_robots_are_those_of_table_1() -> None:
    """Section 7 names Table 2 for the robot parameters; the presets use Table 1."""
    for name, density, stiffness in (
        ("article-suspended", 0.067, 2e9 * 22e-6),
        ("article-mixed", 0.067, 2e9 * 22e-6),
        ("article-prototype", 0.09, 3.5e9 * 4e-6),
    ):
        robot = sl.load_robot(name)
        assert "Table 1" in robot.source
        np.testing.assert_allclose(robot.cables.linear_density, density)
        np.testing.assert_allclose(robot.cables.axial_stiffness, stiffness)


def test_erratum_11_the_smallest_tension_on_the_line_and_the_direction_of_the_rotation() -> None:
    """(31): min |T| on T_z = a T_x + b is |b|/sqrt(1 + a^2); (8): the rotation of (9) is already platform -> world."""
    a, b = -0.6, 3.0
    found = minimize_scalar(lambda t: math.hypot(t, a * t + b)).fun
    np.testing.assert_allclose(found, abs(b) / math.sqrt(1 + a * a), rtol=1e-8)
    assert abs(found - abs(b) / math.sqrt(a * a + b * b)) > 1.0
    alpha, beta, gamma = 0.3, -0.2, 0.5
    ca, sa, cb, sb = math.cos(alpha), math.sin(alpha), math.cos(beta), math.sin(beta)
    cg, sg = math.cos(gamma), math.sin(gamma)
    nine = np.array(
        [
            [ca * cb, ca * sb * sg - sa * cg, ca * sb * cg + sa * sg],
            [sa * cb, sa * sb * sg + ca * cg, sa * sb * cg - ca * sg],
            [-sb, cb * sg, cb * cg],
        ]
    )
    pose = sl.Pose.from_euler(np.zeros(3), alpha, beta, gamma)
    np.testing.assert_allclose(pose.matrix, nine, atol=1e-15)
