"""Slack and steep cables leave large pulleys in the direction of their force, compared with quadrature."""

from __future__ import annotations

import numpy as np
import pytest

import sagline as sl
from sagline.core.arrays import Array

NODES, WEIGHTS = np.polynomial.legendre.leggauss(40)
PIECES = 60  # the cable is divided into pieces that are short near its lowest point


def integral(values: Array, size: Array) -> Array:
    """Sum over the pieces and nodes of the last two axes."""
    return np.asarray((values * WEIGHTS * 0.5 * size[..., None]).sum(axis=(-1, -2)))


def closure(robot: sl.Robot, plan: sl.Plan) -> Array:
    """Distance of each platform end from the end of its cable, integrated from the exit point, (N, m) [m]."""
    state = plan.state[plan.feasible]
    cables, contact = state.cables, state.contact
    assert contact is not None
    weight = np.broadcast_to(robot.cables.linear_density * robot.gravity, cables.shape)
    stiffness = np.broadcast_to(robot.cables.axial_stiffness, cables.shape)
    x, z = cables.horizontal_tension, cables.vertical_force
    assert robot.winches is not None
    radius, entry = robot.winches.pulley_radius, robot.winches.swivel_axis[:, 2]
    free = state.unstrained_length - (contact.wrapped_length + contact.dead_length)
    at_exit = z - weight * free
    angle = np.arctan2(x, entry * at_exit)
    # material points at equal steps of asinh(V/T_x), where V is the vertical force
    edges = np.linspace(np.arcsinh(at_exit / x), np.arcsinh(z / x), PIECES + 1, axis=-1)
    vertical = x[..., None] * np.sinh(edges)
    step = np.diff(vertical, axis=-1) / weight[..., None]
    middle = 0.5 * (vertical[..., 1:] + vertical[..., :-1])[..., None]
    force = middle + 0.5 * weight[..., None, None] * step[..., None] * NODES
    tension = np.hypot(x[..., None, None], force)
    stretch = 1.0 / tension + 1.0 / stiffness[..., None, None]
    span = integral(x[..., None, None] * stretch, step) + radius * (1.0 - np.cos(angle))
    rise = integral(force * stretch, step) + entry * radius * np.sin(angle)
    reach = state.pose.transform(robot.platform_anchors) - robot.frame_anchors
    return np.asarray(np.hypot(span - np.hypot(reach[..., 0], reach[..., 1]), rise - reach[..., 2]))


@pytest.mark.parametrize("name", ["article-suspended", "article-mixed"])
@pytest.mark.parametrize("density", [0.1, 1.0, 6.0])
@pytest.mark.parametrize("axis", [1.0, -1.0])
def test_lengths_close_over_large_pulleys(name: str, density: float, axis: float) -> None:
    robot = sl.load_robot(name)
    robot = robot.replace(
        winches=sl.Winch(0.7, swivel_axis=(0.0, 0.0, axis)),
        cables=robot.cables.replace(linear_density=density),
        tension_min=1.0,
        tension_max=1e5,
        mass=60.0 + 400.0 * density,
    )
    rng = np.random.default_rng(5)
    place = rng.uniform((-6.0, -4.0, 0.8), (6.0, 4.0, 4.5), (150, 3))
    plan = sl.inverse(robot, sl.Pose(place, np.eye(3)), tension=sl.MinimumNorm())
    assert plan.feasible.mean() > 0.9
    assert np.nanmax(closure(robot, plan)) < 2e-11


@pytest.mark.parametrize(("count", "force"), [(5, [-5.0, 5.0, -10.0]), (6, [-2.0, 3.0, -5.0])])
def test_weightless_cables_without_tension_leave_pulleys_along_their_chords(count: int, force: list[float]) -> None:
    turn = 2.0 * np.pi * np.arange(count) / count
    anchors = np.stack([2.0 * np.cos(turn), 2.0 * np.sin(turn), np.full(count, 2.0)], axis=1)
    robot = sl.Robot(
        "weightless", anchors, np.zeros((count, 3)), sl.Cable(0.1, 1e9), 1.0, None,
        motion_pattern="3T", gravity=0.0, tension_min=0.0, tension_max=100.0, winches=sl.Winch(0.05),
    )  # fmt: skip
    poses = sl.Pose([[0.0, 0.0, 0.0], [0.2, 0.1, 0.3]], np.eye(3))
    exact, straight = (
        sl.inverse(robot, poses, model, wrench=[*force, 0.0, 0.0, 0.0]) for model in (sl.Catenary(), sl.Straight())
    )
    assert exact.feasible.all()
    assert np.abs(exact.state.chord_tension).min() <= 1e-15
    assert np.allclose(exact.unstrained_length, straight.unstrained_length, rtol=0.0, atol=1e-6)


def test_cables_to_ends_above_a_pulley_leave_it_before_the_end() -> None:
    anchors = np.array([[0.0, 0.0, 0.0], [2.0, 1.5, 3.0], [2.0, -1.5, 3.0], [-2.5, 0.0, 3.0]])
    robot = sl.Robot(
        "above", anchors, np.zeros((4, 3)), sl.Cable(0.25, 400.0), 3.0, None,
        motion_pattern="3T", tension_min=0.0, winches=sl.Winch(0.15),
    )  # fmt: skip
    near = (1e-3, 0.03, 0.05, 0.12, 0.16, 0.25)  # horizontal distances from the swivel axis of the lower pulley [m]
    poses = sl.Pose([[x, 0.0, z] for x in near for z in (0.5, 1.5, 2.5)], np.eye(3))
    plan = sl.inverse(robot, poses, tension=sl.MinimumNorm())
    assert plan.feasible.all()
    assert (plan.state.cables.span > 0.0).all()
    assert (plan.state.unstrained_length < 5.0).all()
    assert closure(robot, plan).max() < 2e-11
    assert (sl.margin(robot, poses).value > 0.0).all()
