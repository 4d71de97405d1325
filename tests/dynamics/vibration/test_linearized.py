"""Linear systems compared with `stiffness`, `modes`, a robot from the public cable models, and its motion."""

from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.signal import lsim

import sagline as sl
from sagline.core.arrays import Array
from tests.dynamics.linear_systems import (
    flexibility_of,
    mass_of,
    slopes_of,
    stretch_of,
    tensions_after,
    wrench_after,
)
from tests.kinematics.feasible import feasible_plan
from tests.refusal import refused
from tests.statics.test_sensitivities import one_pose, planar, point
from tests.tiers import extended, wide

COGIRO = sl.load_robot("cogiro")
ROBOTS = [*(sl.load_robot(name) for name in ("cogiro", "article-suspended")), planar(), point()]
OVER_PULLEYS = sl.load_robot("ipanema-2-pulleys")
MODELS = [sl.Catenary(), sl.Elastic(), sl.Parabolic()]


def tilted(seed: int = 5) -> sl.Equilibrium:
    return feasible_plan(COGIRO, 3, seed).state[0]


def response(system: sl.Linearized, frequency: float) -> Array:
    """Outputs by inputs, complex."""
    s = 2j * np.pi * frequency
    found: Array = system.C @ np.linalg.solve(s * np.eye(len(system.A)) - system.A, system.B) + system.D
    return found


def close(found: Any, expected: Any, tolerance: float) -> None:
    np.testing.assert_allclose(found, expected, rtol=0.0, atol=tolerance * np.abs(expected).max())


CASES = [(robot, sl.Catenary()) for robot in ROBOTS] + [(COGIRO, model) for model in MODELS[1:]]
ALL_CASES = wide([*CASES, (OVER_PULLEYS, sl.Catenary())], first=len(CASES))


@pytest.mark.parametrize(("robot", "model"), ALL_CASES, ids=lambda one: getattr(one, "name", type(one).__name__))
def test_static_gains_agree_with_stiffness(robot: sl.Robot, model: sl.CableModel) -> None:
    state = one_pose(robot, model)
    system, known, m = sl.linearized(state), sl.stiffness(state), robot.cable_count
    gain = system.D - system.C @ np.linalg.solve(system.A, system.B)
    close(gain[:6, :m], known.length_sensitivity, 1e-11)
    close(gain[:6, m:], known.compliance, 1e-11)
    close(gain[6 : 6 + m, :m], known.tension_sensitivity, 1e-11)
    np.testing.assert_array_equal(gain[6 + m :], np.eye(m, m + 6))


@pytest.mark.parametrize("robot", wide([*ROBOTS, OVER_PULLEYS], first=len(ROBOTS)), ids=lambda robot: robot.name)
def test_poles_are_the_modes(robot: sl.Robot) -> None:
    pose = one_pose(robot, sl.Catenary()).pose
    state = sl.inverse(robot, pose).state  # without a given moment, which `modes` halves
    frequency = sl.modes(state).frequency
    poles = sl.linearized(state).poles
    close(np.sort(poles.imag[poles.imag > 0.0]), 2.0 * np.pi * frequency, 1e-11)
    damped = sl.linearized(state, sl.Damping(modal_damping=0.03), "speeds").poles
    upper = damped[damped.imag > 0.0]
    np.testing.assert_allclose(-upper.real / np.abs(upper), 0.03, rtol=1e-9)
    np.testing.assert_allclose(np.sort(np.abs(upper)), 2.0 * np.pi * frequency, rtol=1e-9)
    assert np.abs(damped).min() < 1e-9  # constant lengths


@pytest.mark.parametrize("model", MODELS, ids=lambda model: type(model).__name__)
@pytest.mark.parametrize("frequency", [0.7, 6.0])
def test_responses_agree_with_an_independent_robot(model: sl.CableModel, frequency: float) -> None:
    state = one_pose(COGIRO, model)
    by_motion, by_length = slopes_of(wrench_after, state)
    tension_by_motion, tension_by_length = slopes_of(tensions_after, state)
    dynamic = -by_motion - (2.0 * np.pi * frequency) ** 2 * mass_of(state)
    motion = np.linalg.solve(dynamic, np.hstack((by_length, np.eye(6))))
    tension = tension_by_motion @ motion + np.hstack((tension_by_length, np.zeros((8, 6))))
    found = response(sl.linearized(state), frequency)
    for rows, expected in ((slice(0, 3), motion[:3]), (slice(3, 6), motion[3:]), (slice(6, 14), tension)):
        close(found[rows, :8], expected[:, :8], 3e-7)
        close(found[rows, 8:], expected[:, 8:], 3e-7)


def test_winding_moves_the_platform_as_integrated() -> None:
    state = tilted()
    system, lengths, mass = sl.linearized(state), state.unstrained_length.copy(), mass_of(state)
    wound = 1e-6 * np.array([1.0, -0.5, 0.3, 0.0, 0.8, -1.0, 0.2, 0.4])

    def rate(time: float, at: Array) -> Array:
        wrench = wrench_after(state, at[:6], lengths + wound * np.sin(20.0 * time))
        return np.concatenate((at[6:], np.linalg.solve(mass, wrench)))

    time = np.linspace(0.0, 0.4, 9)
    moved = solve_ivp(rate, (0.0, 0.4), np.zeros(12), method="RK45", rtol=1e-6, atol=1e-12, t_eval=time).y
    fine = np.linspace(0.0, 0.4, 4001)
    inputs = np.zeros((len(fine), 14))
    inputs[:, :8] = np.outer(np.sin(20.0 * fine), wound)
    _, output, _ = lsim(system.state_space(), inputs, fine)
    close(output[::500, :6], moved[:6].T, 1e-4)  # of second order in the motion, and interpolated


def test_losses_agree_with_cables_of_complex_stiffness() -> None:
    state, eta, frequency = tilted(), 1e-6, 4.0
    omega, cables = 2.0 * np.pi * frequency, state.cables
    weight = np.broadcast_to(cables.cable.linear_density * cables.gravity, 8)
    stretching = np.broadcast_to(cables.cable.axial_stiffness, 8)
    levers = (COGIRO.platform_anchors - COGIRO.center_of_mass) @ state.pose.matrix.T
    away = state.pose.transform(COGIRO.platform_anchors) - COGIRO.frame_anchors
    level = away[:, :2] / np.hypot(away[:, 0], away[:, 1])[:, None] * cables.horizontal_tension[:, None]
    force = np.column_stack((level, cables.vertical_force))
    change, wound = np.zeros((6, 6), dtype=complex), np.zeros((6, 8), dtype=complex)
    by_motion, by_length = np.zeros((8, 6), dtype=complex), np.zeros((8, 8), dtype=complex)  # of the tensions
    for i in range(8):
        given = (force[i], float(weight[i]), float(cables.unstrained_length[i]), float(stretching[i]))
        rest = flexibility_of(*given)
        dynamic = np.linalg.inv(rest + stretch_of(*given) * (1.0 / (1.0 + 1j * omega * eta) - 1.0))
        at_frame = force[i] - [0.0, 0.0, weight[i] * cables.unstrained_length[i]]
        entered = (1.0 / np.linalg.norm(at_frame) + 1.0 / stretching[i]) * at_frame
        x, y, z = levers[i]
        onto = np.hstack((np.eye(3), -np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])))
        change += onto.T @ (dynamic - np.linalg.inv(rest)) @ onto
        wound[:, i] = onto.T @ dynamic @ entered
        along = at_frame / np.linalg.norm(at_frame)
        by_motion[i] = along @ dynamic @ onto
        by_length[i, i] = -along @ dynamic @ entered - along[2] * weight[i]
    matrix = sl.stiffness(state).matrix + change - omega**2 * mass_of(state)
    motion = np.linalg.solve(matrix, np.hstack((wound / (1j * omega), np.eye(6))))
    tension = by_motion @ motion + np.hstack((by_length / (1j * omega), np.zeros((8, 6))))
    expected = np.vstack((motion, tension))
    found = response(sl.linearized(state, sl.Damping(loss_time=eta), "speeds"), frequency)
    for part in (slice(0, 3), slice(3, 6), slice(6, 14)):
        for inputs, turned in ((slice(0, 8), 1j), (slice(8, 14), 1.0)):  # lengths lag speeds by a quarter period
            here, there = turned * found[part, inputs], turned * expected[part, inputs]
            close(here, there, 1e-8)
            close(here.imag, there.imag, 1e-4)  # of second order in the loss


def test_columns_have_names_and_units() -> None:
    system = sl.linearized(tilted(), inputs="speeds")
    assert (len(system.state_names), len(system.input_names), len(system.output_names)) == (20, 14, 22)
    assert (len(system.input_units), len(system.output_units)) == (14, 22)
    pick = {name: k for k, name in enumerate(system.output_names)}
    given = {name: k for k, name in enumerate(system.input_names)}
    known = sl.stiffness(system.state)
    far = response(system, 1e-9)
    lifted = far[pick["displacement z"], given["force z"]].real
    assert lifted == pytest.approx(known.compliance[2, 2], rel=1e-6)
    assert system.output_units[pick["tension 3"]] == "N"
    assert system.input_units[given["speed 3"]] == "m/s"
    assert system.state_names[-1] == "length 7"


def test_refusals() -> None:
    state = tilted()
    plan = sl.inverse(COGIRO, sl.Pose([[0, 0, 1.5], [0, 0, 90.0]], np.tile(np.eye(3), (2, 1, 1))))
    unbounded = '0 with inputs="lengths": a step of a length would cause infinite tensions'
    cases: tuple[tuple[tuple[Any, ...], *tuple[str, ...]], ...] = (
        ((plan.state,), "state", "a batch of 2", "a single state"),
        ((plan.state[1],), "state", "a state without lengths or stiffness", "a state that was solved"),
        ((plan,), "state", "a batch of 2", "a single state"),
        ((state, sl.Damping(air_damping=0.1)), "air_damping", "0.1 N s/m^2", "0 for massless cables"),
        ((state, sl.Damping(1e-3)), "loss_time", "0.001 s", unbounded),
        ((state, sl.Damping(), "currents"), "inputs", "'currents'", "lengths, speeds"),
    )
    for given, *parts in cases:
        with refused(*parts, kind=sl.InvalidValueError):
            sl.linearized(*given)


@extended
def test_losses_of_cables_over_pulleys_are_refused() -> None:
    with refused("loss_time", "0.001 s", "0 for cables with pulleys or dead length"):
        sl.linearized(one_pose(OVER_PULLEYS, sl.Catenary()), sl.Damping(1e-3), "speeds")
