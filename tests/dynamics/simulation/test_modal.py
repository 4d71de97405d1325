"""Small motions by modes, each compared with its closed form, and robots compared with lumped cables."""

from functools import cache
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from scipy.integrate import simpson, solve_ivp

import sagline as sl
from sagline.core.arrays import Array
from sagline.dynamics.simulation.modal import _modal_model, _modal_response
from tests.refusal import refused
from tests.tiers import extended


@cache
def state() -> sl.Equilibrium:
    return sl.inverse(sl.load_robot("expo2015-lucia"), sl.Pose([-0.6, 0.0, 3.5], np.eye(3))).state


GUST = ([0, 0.02, 0.1, 0.2, 0.21], np.outer([0, 1, 1, 1, 0], [3.0, 2.0, -3.0, 1.0, 0.8, 0.5]))


def wound() -> tuple[list[float], list[Array]]:
    """Wind out a millimeter of one cable and wind in half of one of another, and back."""
    back, there = state().unstrained_length, state().unstrained_length.copy()
    there[[0, 3]] += [1e-3, -0.5e-3]
    return [0.0, 0.2, 0.4, 0.6], [back, there, there, back]


def test_modes_under_straight_forces_are_exact() -> None:
    """Compared with an integrator of high order; energy is work minus loss."""
    rng = np.random.default_rng(1)
    frequency, ratio, step = rng.uniform(1, 20, 3), np.array([0.0, 0.02, 0.7]), 0.01
    force = rng.normal(size=(101, 3))
    amplitude, rate, _, lost = _modal_response(frequency, ratio, force, step)
    time = np.arange(101) * step

    def rates(t: float, y: Array) -> Array:
        push = np.array([np.interp(t, time, column) for column in force.T])
        return np.concatenate((y[3:], push - 2 * ratio * frequency * y[3:] - frequency**2 * y[:3]))

    exact = np.zeros(6)
    for span in pairwise(time):  # from corner to corner of the force, to keep the order
        exact = solve_ivp(rates, span, exact, "DOP853", rtol=1e-12, atol=1e-14).y[:, -1]
    assert amplitude[-1] == pytest.approx(exact[:3], abs=1e-12)
    assert rate[-1] == pytest.approx(exact[3:], abs=1e-11)
    assert (np.diff(lost) > 0.0).all()
    for damped, off in ((ratio, 2e-3), (0.0 * ratio, 1e-10)):
        amplitude, rate, supplied, lost = _modal_response(frequency, damped, force, step)
        energy = 0.5 * (rate**2 + (amplitude * frequency) ** 2).sum(axis=1)
        assert energy == pytest.approx(supplied - lost, abs=off * energy.max())


@extended
@pytest.mark.parametrize(("what", "off"), [("wrench", 2e-3), ("unstrained_length", 1e-2)])
def test_small_motions_agree_with_lumped_cables(what: str, off: float) -> None:
    """Platform, cables and energy compared with 40 nodes per cable; massless cables differ at least ten times more."""
    given: dict[str, Any] = {what: GUST if what == "wrench" else wound(), "duration": 1.0}
    run = sl.simulate(state(), cable_mass="modal", **given)
    lumped = sl.simulate(state(), cable_mass="lumped", nodes=40, **given)
    massless = sl.simulate(state(), **given)
    moved, expected, without = (r.pose.position - r.pose.position[0] for r in (run, lumped, massless))
    size = np.abs(expected).max()
    assert np.abs(moved - expected).max() < off * size
    assert np.abs(without - expected).max() > 10.0 * off * size
    assert run.twist == pytest.approx(lumped.twist, abs=0.04 * np.abs(lumped.twist).max())
    assert run.nodes is not None
    assert lumped.nodes is not None
    swung, chained = run.nodes - run.nodes[0], lumped.nodes - lumped.nodes[0]
    assert np.abs(swung[:, :, ::4] - chained[:, :, ::4]).max() < 0.1 * np.abs(chained).max()
    assert run.energy.supplied[-1] > 0.0
    assert np.abs(run.energy.error).max() < 1e-9 * run.energy.supplied.max()
    if what == "wrench":
        pulled = np.abs(lumped.tensions - lumped.tensions[0]).max()
        assert run.tensions == pytest.approx(lumped.tensions, abs=0.01 * pulled)


def test_what_modes_leave_to_rest_is_little() -> None:
    """By Betti's theorem a cable let out drives the modes; at rest they sum to the exact sensitivity of the pose."""
    (_, _, motion, _, _), rest = _modal_model(state(), sl.Damping()), sl.stiffness(state())
    m = state().robot.cable_count  # type: ignore[union-attr]
    assert np.abs(motion[:, :m]).max() < 0.02 * np.abs(rest.length_sensitivity).max()
    assert np.abs(motion[:, m:]).max() < 1e-3 * np.abs(rest.compliance).max()


def test_tensions_of_a_mode_are_its_dynamic_stiffness_less_the_inertia_of_the_cable() -> None:
    """From the platform end, by the exact dynamic stiffness, the force changes by rho omega^2 times the shape."""
    (found, _, _, pulled, _), cables = _modal_model(state(), sl.Damping()), state().cables
    frequency, shape = found.frequency[:6], found.cable_shape[:6]
    exact = sl.dynamic_stiffness(state(), frequency).real
    mean = simpson(shape, dx=1.0 / (shape.shape[2] - 1), axis=2)
    mass = cables.cable.linear_density * cables.unstrained_length
    inertia = (2.0 * np.pi * frequency[:, None, None]) ** 2 * mass[:, None] * mean
    reach = state().pose.transform(state().one_robot.platform_anchors) - state().exit_point
    level = reach[:, :2] / np.hypot(reach[:, :1], reach[:, 1:2]) * cables.horizontal_tension[:, None]
    at_frame = np.column_stack((level, cables.vertical_force - cables.cable_weight))
    unit = at_frame / np.linalg.norm(at_frame, axis=1, keepdims=True)
    expected = np.einsum("kmi,mi->mk", np.einsum("kmij,kmj->kmi", exact, shape[:, :, -1]) + inertia, unit)
    off = np.abs(pulled[:, :6] - expected).max(axis=0) / np.abs(expected).max(axis=0)
    assert off.max() < 2e-6


def test_damped_modes_come_to_the_equilibrium_with_a_wrench() -> None:
    push = np.array([0.0, 0.0, -3.0, 0.0, 0.0, 0.0])
    damping = sl.Damping(modal_damping=0.3)
    wrench = ([0.0, 0.1], [np.zeros(6), push])
    run = sl.simulate(state(), cable_mass="modal", duration=10.0, wrench=wrench, damping=damping)
    way = sl.stiffness(state()).compliance @ push
    center = run.pose.transform(state().one_robot.center_of_mass)
    assert center[-1] - center[0] == pytest.approx(way[:3], rel=1e-5, abs=1e-9)
    assert run.energy.lost[-1] > 0.0
    assert np.abs(run.energy.error).max() < 1e-3 * run.energy.supplied.max()


@pytest.mark.parametrize(
    ("given", "item", "value"),
    [
        ({"events": sl.Break(0, 0.1)}, "events", "given"),
        ({"wind": [1.0, 0.0, 0.0]}, "wind", "given"),
        ({"winches": sl.SecondOrder(10.0, 0.7)}, "winches", "given"),
        ({"unstrained_length": ([0, 1], [[7.0] * 8, [9.0] * 8])}, "unstrained_length: cable 6", "changed by 1.61 m"),
        ({"damping": sl.Damping(air_damping=50.0)}, "damping", "a ratio of 1.24 at 2.01 Hz with cable mass"),
    ],
)
def test_unsupported_options_are_refused(given: dict[str, Any], item: str, value: str) -> None:
    with refused(item, value) as caught:
        sl.simulate(state(), **{"cable_mass": "modal", "duration": 0.5, **given})
    assert len(str(caught.value)) < 300


def test_robots_with_pulleys_and_starts_in_motion_have_no_modes_here() -> None:
    robot = sl.load_robot("expo2015-lucia-pulleys")
    rest = sl.inverse(robot, sl.Pose([-0.6, 0.0, 3.5], np.eye(3))).state
    with refused("start", "a robot with pulleys or dead length"):
        sl.simulate(rest, cable_mass="modal", duration=0.5)
