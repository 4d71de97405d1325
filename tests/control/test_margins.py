"""What the loops can bear: the tension loop at any delay, the drives' loops on the flexible platform."""

from __future__ import annotations

import numpy as np
import pytest

import sagline as sl
from sagline.arrays import Array
from sagline.control.link import PERIOD
from sagline.control.null_space import null_space
from sagline.control.tension_loop import TensionLoop, TensionSettings
from tests.control.margins import FREQUENCY, Margins, axis, closed_poles, inner_loops, margins
from tests.control.stops import PROTOTYPE, stops
from tests.kinematics.feasible import feasible_plan

LOSSES = sl.Damping(loss_time=1e-3, air_damping=0.2)  # those of the twin
STATE = stops().state[0]
ROW = null_space(STATE)
PLANNED = STATE.cables.frame_end_tension
SLOPE = sl.stiffness(STATE).tension_sensitivity
LAG = 1.0 - np.exp(-2.0 * np.pi * 10.0 * PERIOD)  # share a cycle of an inner loop of 10 Hz
ALWAYS = {"act_above": 1e-9, "rest_below": 0.0}
ERROR = ROW.visible @ np.array([1.0, -2.0, 0.5, 1.5, -1.0, 0.3, 2.0, -0.7])


def outer_loop(gain: float, delay: int, turn: Array, filter_time: float = 0.5) -> Array:
    """Open tension loop at z = exp(i turn): filter, integrator, inner loops, and so many cycles on the way."""
    z = np.exp(1j * turn)
    share = PERIOD / (filter_time + PERIOD)
    lag = LAG / (1.0 - (1.0 - LAG) / z)
    found: Array = gain / (z - 1.0) * share / (1.0 - (1.0 - share) / z) * lag * z**-delay
    return found


def closed(settings: TensionSettings, delay: int, cycles: int) -> Array:
    """Errors, cycle by cycle, of the loop itself around a linear machine with inner loops of 10 Hz and a delay."""
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


def test_what_the_loop_does_is_what_was_counted() -> None:
    """Its answer to one error, one cycle long, has the frequency response of filter and integrator."""
    loop = TensionLoop(8, TensionSettings(gain=0.01, **ALWAYS))
    added = [loop.step(PLANNED + (ERROR if k == 0 else 0.0), PLANNED, ROW) for k in range(6000)]
    seen = -np.array([SLOPE @ one for one in added])[:, 0] / ERROR[0]
    turn = np.array([0.01, 0.03, 0.1, 0.5])
    steps = np.diff(seen, prepend=0.0)  # an integrator's answer does not end, its change does
    z = np.exp(1j * turn)
    response = (steps @ z[None, :] ** -np.arange(6000)[:, None]) / (1.0 - 1.0 / z)
    lag = LAG / (1.0 - (1.0 - LAG) / z)
    # what is sent after a sample acts in the next cycle: z times one less
    np.testing.assert_allclose(response / z, outer_loop(0.01, 0, turn) / lag, rtol=1e-6)


def test_the_loop_itself_bears_20_db_and_a_second_more_of_delay() -> None:
    """A gain of 0.1, the most that is taken, is ten times that of the default; 55 degrees at 0.91 rad/s are 1.05 s."""
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
def test_the_largest_gain_that_is_taken_is_below_the_limit_of_stability(delay: int, limit: float) -> None:
    """With inner loops of 10 Hz and a filter of 0.5 s the limit is found by roots."""
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


@pytest.mark.parametrize("count", [24, pytest.param(400, marks=pytest.mark.soak)])
def test_the_drives_have_8_db_and_30_degrees_wherever_the_platform_is(count: int) -> None:
    """Each loop with 1.5 ms of delay, the seven others closed, over the poses of the test box and the ten stops."""
    plan = feasible_plan(PROTOTYPE, count, seed=11)
    states = [*plan.state, *stops().state]
    found = []
    for state in states:
        drives = axis(state, LOSSES)
        assert closed_poles(drives).real.max() < -0.01
        loops = inner_loops(drives)
        found += [margins(loops[:, i], FREQUENCY) for i in range(8)]
    gain, phase, crossover = np.array(found).T
    assert gain.min() >= 10.0
    assert phase.min() >= 50.0
    assert 50.0 < crossover.min() <= crossover.max() < 54.0


def test_with_ten_times_the_integral_gain_the_drives_would_excite_the_platform() -> None:
    """Below sqrt(k_p k_i/k_v) a drive gives way ahead of the force: it feeds the platform's modes of 1 to 3 Hz."""
    winch = PROTOTYPE.winches
    assert winch is not None
    robot = PROTOTYPE.replace(winches=winch.replace(integral_gain=80e3))
    state = sl.inverse(robot, stops().state.pose[10]).state
    drives = axis(state, LOSSES)
    assert closed_poles(drives).real.max() > 0.0
    loops = inner_loops(drives)
    assert min(margins(loops[:, i], FREQUENCY).gain for i in range(8)) < 4.0


def test_margins_of_a_loop_that_is_known() -> None:
    """k/(s (s + 1)^2): the gain may be 2/k times as large; at a gain of 1/2 the phase is 90 - 2 atan(w) degrees."""
    frequency = np.geomspace(1e-2, 1e2, 20_000)
    s = 1j * frequency
    found = margins(0.5 / (s * (s + 1.0) ** 2), frequency)
    assert found.gain == pytest.approx(20.0 * np.log10(4.0), abs=0.01)
    assert found.phase == pytest.approx(90.0 - 2.0 * np.degrees(np.arctan(found.crossover)), abs=0.05)


def test_the_linear_drive_is_that_of_the_simulation() -> None:
    """A small push, without friction: the modes decay as the poles say; the drives lag less than is counted."""
    winch = PROTOTYPE.winches
    assert winch is not None
    robot = PROTOTYPE.replace(winches=winch.replace(friction=0.0))
    state = sl.inverse(robot, stops().state.pose[0]).state
    push = np.array([2.0, 2.0, -2.0, 0.2, 0.2, 0.1])
    table = (np.array([0.0, 0.2, 0.2001, 30.0]), np.outer([1.0, 1.0, 0.0, 0.0], push))
    run = sl.simulate(state, winches="robot", duration=24.0, wrench=table, damping=LOSSES, record=0.01)
    poles = closed_poles(axis(state, LOSSES), delay=1e-3)
    slow = poles[(poles.imag > 2.0) & (poles.imag < 100.0)]
    assert slow.size >= 6
    fall = -slow.real.max()
    kinetic, time = run.energy.kinetic, run.time
    early, late = (kinetic[(time > at) & (time < at + 4.0)].max() for at in (10.0, 20.0))
    assert np.log(early / late) / 20.0 == pytest.approx(fall, rel=0.5)
