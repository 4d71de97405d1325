"""Stability margins: the tension loop with any delay, the loops of the drives on the flexible platform."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import expm

import sagline as sl
from sagline.control.link import PERIOD
from sagline.control.null_space import TensionLoop, TensionSettings, null_space
from sagline.core.arrays import Array
from tests.control.margins import FREQUENCY, Margins, axis, closed_loops, closed_poles, inner_loops, margins
from tests.control.stops import PROTOTYPE, stops
from tests.kinematics.feasible import feasible_plan
from tests.tiers import extended

LOSSES = sl.Damping(loss_time=1e-3, air_damping=0.2)  # those of the twin
STATE = stops().state[0]
ROW = null_space(STATE)
PLANNED = STATE.cables.frame_end_tension
SLOPE = sl.stiffness(STATE).tension_sensitivity
LAG = 1.0 - np.exp(-2.0 * np.pi * 10.0 * PERIOD)  # share per cycle of an inner loop of 10 Hz
ALWAYS = {"act_above": 1e-9, "rest_below": 0.0}
ERROR = ROW.visible @ np.array([1.0, -2.0, 0.5, 1.5, -1.0, 0.3, 2.0, -0.7])


def outer_loop(gain: float, delay: int, turn: Array, filter_time: float = 0.5) -> Array:
    """Open tension loop at z = exp(i turn): filter, integrator, inner loops, and a number of cycles of delay."""
    z = np.exp(1j * turn)
    share = PERIOD / (filter_time + PERIOD)
    lag = LAG / (1.0 - (1.0 - LAG) / z)
    found: Array = gain / (z - 1.0) * share / (1.0 - (1.0 - share) / z) * lag * z**-delay
    return found


def closed(settings: TensionSettings, delay: int, cycles: int) -> Array:
    """Errors, cycle by cycle, of the loop with a linear machine with inner loops of 10 Hz and a delay."""
    loop, sent = TensionLoop(8, settings), [np.zeros(8)] * (delay + 1)
    length, errors = np.zeros(8), []
    for _ in range(cycles):
        length += LAG * (sent[-1 - delay] - length)
        error = ERROR + SLOPE @ length
        errors.append(np.abs(error).max())
        sent.append(loop.step(PLANNED + error, PLANNED, ROW))
    return np.array(errors)


@pytest.mark.parametrize("delay", range(6))
def test_the_tension_loop_has_20_db_and_55_degrees_at_any_delay_to_five_cycles(delay: int) -> None:
    turn = np.geomspace(1e-4, np.pi, 20_000)
    found: Margins = margins(outer_loop(0.01, delay, turn), turn)
    assert found.gain >= 23.9
    assert found.phase >= 61.0
    assert found.crossover / PERIOD == pytest.approx(0.909, abs=1e-3)  # rad/s


def test_the_loop_has_the_computed_frequency_response() -> None:
    """Its response to an error of one cycle has the frequency response of filter and integrator."""
    loop = TensionLoop(8, TensionSettings(gain=0.01, **ALWAYS))
    added = [loop.step(PLANNED + (ERROR if k == 0 else 0.0), PLANNED, ROW) for k in range(6000)]
    seen = -np.array([SLOPE @ one for one in added])[:, 0] / ERROR[0]
    turn = np.array([0.01, 0.03, 0.1, 0.5])
    steps = np.diff(seen, prepend=0.0)  # the response of an integrator does not end, its change does
    z = np.exp(1j * turn)
    response = (steps @ z[None, :] ** -np.arange(6000)[:, None]) / (1.0 - 1.0 / z)
    lag = LAG / (1.0 - (1.0 - LAG) / z)
    # a command after a sample acts in the next cycle: one factor z less
    np.testing.assert_allclose(response / z, outer_loop(0.01, 0, turn) / lag, rtol=1e-6)


def test_the_loop_is_stable_with_20_db_and_a_second_of_delay() -> None:
    """A gain of 0.1, the largest valid one, is ten times the default; 55 degrees at 0.91 rad/s are 1.05 s."""
    for settings, delay in ((TensionSettings(gain=0.1, **ALWAYS), 5), (TensionSettings(**ALWAYS), 5 + 105)):
        errors = closed(settings, delay, 6000)
        assert errors[-1000:].max() < 0.4 * errors[0]
    late = closed(TensionSettings(largest=100.0, **ALWAYS), 5 + 135, 6000)
    assert late[-1000:].max() > late[0]  # 62 degrees are 1.19 s


@pytest.mark.parametrize(("delay", "limit"), [(0, 2.0), (1, 1.0), (2, 0.618), (3, 0.445), (5, 0.285)])
def test_the_integrator_alone_is_stable_up_to_the_gain_of_the_formula(delay: int, limit: float) -> None:
    """z^(d+1) - z^d + k = 0 has its roots inside the unit circle for k < 2 sin(pi/(2(2d+1)))."""
    most = 2.0 * np.sin(np.pi / (2.0 * (2.0 * delay + 1.0)))
    assert most == pytest.approx(limit, abs=5e-4)
    for gain, inside in ((0.999 * most, True), (1.001 * most, False)):
        roots = np.roots([1.0, -1.0] + [0.0] * (delay - 1) + [gain] if delay else [1.0, gain - 1.0])
        assert bool(np.abs(roots).max() < 1.0) is inside


@pytest.mark.parametrize(("delay", "limit"), [(1, 0.48), (2, 0.32), (3, 0.25), (5, 0.17)])
def test_the_largest_accepted_gain_is_below_the_limit_of_stability(delay: int, limit: float) -> None:
    """With inner loops of 10 Hz and a filter of 0.5 s, the limit follows from roots."""
    share = PERIOD / (0.5 + PERIOD)
    poles = np.polymul(np.polymul([1.0, -1.0], [1.0, -(1.0 - share)]), [1.0, -(1.0 - LAG)])

    def largest(gain: float) -> float:
        zeros = gain * share * LAG * np.array([1.0, 0.0, 0.0])
        return float(np.abs(np.roots(np.polyadd(np.polymul(poles, [1.0] + [0.0] * delay), zeros))).max())

    low, high = 0.0, 10.0
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if largest(middle) < 1.0 else (low, middle)
    assert low == pytest.approx(limit, abs=0.006)
    with pytest.raises(sl.InvalidValueError, match="gain is "):
        TensionSettings(gain=low)


def integral(gain: float) -> sl.Robot:
    """The prototype with another integral gain of its drives [N/m]."""
    winch = PROTOTYPE.winches
    assert winch is not None
    return PROTOTYPE.replace(winches=winch.replace(integral_gain=gain))


def inner_margins(robot: sl.Robot, count: int, above: float = 0.0) -> tuple[Margins, float]:
    """Smallest margins over poses of the test box, the ten stops and all drives; and the least damped pole [1/s]."""
    box = feasible_plan(robot, count, seed=11)
    used = above < FREQUENCY
    poles, found = [], []
    for state in [*box.state, *sl.inverse(robot, stops().state.pose).state]:
        drives = axis(state, LOSSES)
        poles.append(closed_poles(drives).real.max())
        loops = inner_loops(drives)[used]
        found += [margins(loops[:, i], FREQUENCY[used]) for i in range(8)]
    gain, phase, crossover = np.array(found).T
    assert 45.0 < crossover.min() <= crossover.max() < 45.1
    return Margins(gain.min(), phase.min(), crossover.max()), max(poles)


COUNTS = [pytest.param(16, marks=extended), pytest.param(400, marks=pytest.mark.soak)]


@pytest.mark.parametrize("count", [2, *COUNTS])
def test_the_drives_have_11_db_and_60_degrees_all_over_the_test_box(count: int) -> None:
    """Each loop with 1.5 ms of delay and the others closed on the swinging platform; 8 dB and 30 degrees suffice."""
    found, slowest = inner_margins(PROTOTYPE, count)
    assert found.gain >= 11.0
    assert found.phase >= 60.0
    assert slowest < -0.01


@pytest.mark.parametrize("count", COUNTS)
def test_ten_times_the_integral_gain_feeds_the_slowest_modes(count: int) -> None:
    """Below sqrt(k_p k_i/k_v), 3.2 Hz, such a drive adds energy: as much as the losses of the cables dissipate.

    At its own bandwidth, above 8 Hz, nothing of it is seen.
    """
    found, slowest = inner_margins(integral(80e3), count)
    assert found.gain < 1.0
    assert slowest > 0.0
    above, _ = inner_margins(integral(80e3), count, above=8.0)
    assert above.gain >= 10.0
    assert above.phase >= 54.0


def test_friction_of_the_drives_damps_the_effect_of_the_integral_gain() -> None:
    """At a stop with an unstable linear model, a swing of the platform decays."""
    planned = stops().state[10]
    state = replace(planned, robot=integral(80e3))
    assert closed_poles(axis(state, LOSSES)).real.max() > 0.0
    push = np.array([60.0, 60.0, -40.0, 8.0, 8.0, 5.0])
    table = (np.array([0.0, 0.3, 0.3001, 30.0]), np.outer([1.0, 1.0, 0.0, 0.0], push))
    run = sl.simulate(state, winches="robot", duration=16.0, wrench=table, damping=LOSSES, record=0.02)
    swings = [run.energy.kinetic[(run.time > at) & (run.time < at + 4.0)].max() for at in (0.5, 4.0, 8.0, 12.0)]
    assert (np.diff(swings) < 0.0).all()
    assert swings[-1] < 0.5 * swings[0]


def test_margins_of_a_known_loop() -> None:
    """k/(s (s + 1)^2): the gain margin is 2/k; at a gain of 1/2 the phase is 90 - 2 atan(w) degrees."""
    frequency = np.geomspace(1e-2, 1e2, 20_000)
    s = 1j * frequency
    found = margins(0.5 / (s * (s + 1.0) ** 2), frequency)
    assert found.gain == pytest.approx(20.0 * np.log10(4.0), abs=0.01)
    assert found.phase == pytest.approx(90.0 - 2.0 * np.degrees(np.arctan(found.crossover)), abs=0.05)


def test_linear_and_simulated_drives_agree() -> None:
    """A small push without friction; loops of 1 kHz with reading and holding have a delay of up to a millisecond."""
    winch = PROTOTYPE.winches
    assert winch is not None
    robot = PROTOTYPE.replace(winches=winch.replace(friction=0.0))
    state = sl.inverse(robot, stops().state.pose[9]).state
    push = np.array([2.0, 2.0, -2.0, 0.2, 0.2, 0.1])
    table = (np.array([0.0, 0.2, 0.2 + 1e-9, 30.0]), np.outer([1.0, 1.0, 0.0, 0.0], push))
    run = sl.simulate(state, winches="robot", duration=8.0, wrench=table, damping=LOSSES, record=0.02)
    drives = axis(state, LOSSES)
    matrix = closed_loops(drives, delay=5e-4)
    driven = np.zeros(len(matrix))
    driven[: len(drives.by_wrench)] = drives.by_wrench @ push
    step, at = expm(0.02 * matrix), np.zeros(len(matrix))
    given = np.linalg.solve(matrix, (step - np.eye(len(matrix))) @ driven)
    moved = []
    for time in run.time:
        moved.append(at[:3])
        at = step @ at + (given if time < 0.2 - 1e-9 else 0.0)
    seen = run.pose.position - state.pose.position
    away = np.linalg.norm(seen - moved, axis=1)
    assert np.linalg.norm(seen, axis=1).max() > 5e-4
    assert away.max() < 0.03 * np.linalg.norm(seen, axis=1).max()
