"""The simulated machine of a controller: equal to `simulate`, without allocation, with sensors."""

from __future__ import annotations

import tracemalloc
from typing import Any

import numpy as np
import pytest

import sagline as sl
from tests.dynamics.machines import prototype
from tests.refusal import refused
from tests.tiers import wide

PLACE = sl.Pose.from_euler([0.1, 0.05, 1.0], 0.0, 0.0, 0.0)


@pytest.mark.parametrize("winches", ["ideal", "robot", sl.SecondOrder(10.0)])
@pytest.mark.parametrize("pulleys", wide([False, True]))
def test_motion_is_equal_to_simulate_to_the_last_bit(winches: sl.SecondOrder, pulleys: bool) -> None:
    robot = prototype(pulley_radius=0.03, dead_cable=1.0) if pulleys else prototype()
    robot = robot.replace(center_of_mass=[0.02, -0.03, 0.05])
    state, damping = sl.inverse(robot, PLACE).state, sl.Damping(1e-3, 0.1)
    machine = sl.Simulator(robot, state, winches=winches, damping=damping)
    rows, times, generator = [state.unstrained_length], [0.0], np.random.default_rng(1)
    seen = []
    for _ in range(40):
        rows.append(state.unstrained_length + generator.uniform(-0.002, 0.002, 8))
        reading = machine.step(rows[-1], 0.01)
        times.append(machine.time)
        seen.append(np.concatenate((reading.twist[3:], reading.tension, reading.length)))
    table = (times, np.array(rows))
    run = sl.simulate(state, unstrained_length=table, winches=winches, damping=damping, record=0.01)
    expected = np.hstack((run.twist[:, 3:], run.tensions, run.length))[1:]
    np.testing.assert_array_equal(np.array(seen), expected)
    assert np.abs(reading.position - run.pose.position[-1]).max() < 1e-15
    assert np.abs(reading.quaternion - run.pose.quaternion[-1]).max() < 1e-15
    assert np.abs(reading.twist - run.twist[-1]).max() < 1e-15
    assert np.ptp(run.pose.position, axis=0).max() > 1e-4


def test_steps_allocate_nothing() -> None:
    robot = prototype()
    machine = sl.Simulator(robot, PLACE)
    lengths, wrench = machine.reading.length.copy(), np.zeros(6)
    for _ in range(3):
        machine.step(lengths, 0.001, wrench=wrench)
    tracemalloc.start()
    before = tracemalloc.get_traced_memory()[0]
    for _ in range(200):
        machine.step(lengths, 0.001, wrench=wrench)
    after = tracemalloc.get_traced_memory()[0]
    tracemalloc.stop()
    assert after - before < 2000


def test_sensors_at_rest_read_true_values() -> None:
    robot = prototype()
    state = sl.inverse(robot, PLACE).state
    machine = sl.Simulator(robot, state, seed=4)
    readings = np.array([machine.step(state.unstrained_length, 0.001).load_cell.copy() for _ in range(2000)])
    expected = 1.01 * state.cables.frame_end_tension + 2.0
    assert np.abs(readings.mean(axis=0) - expected).max() < 4.0 / np.sqrt(2000)
    np.testing.assert_allclose(readings.std(axis=0), 1.0, atol=0.08)
    np.testing.assert_array_equal(machine.reading.counts, sl.encoder_counts(sl.inverse(robot, PLACE)))
    assert np.abs(machine.reading.position - PLACE.position).max() < 1e-14


def test_noise_depends_on_the_seed() -> None:
    robot, short = prototype(), prototype(load_cell_range=125.0)
    length = sl.inverse(robot, PLACE).unstrained_length
    first, same, other = (sl.Simulator(robot, PLACE, seed=seed).step(length, 0.01).load_cell for seed in (1, 1, 2))
    np.testing.assert_array_equal(first, same)
    assert (first != other).all()
    cut = sl.Simulator(short, PLACE, seed=1).step(length, 0.01).load_cell
    np.testing.assert_array_equal(cut, np.minimum(first, 125.0))
    assert 0 < np.count_nonzero(cut == 125.0) < 8


def test_a_filter_follows_with_its_time_constant() -> None:
    robot = prototype(load_cell_deviation=0.0, load_cell_bias=0.0, load_cell_gain=1.0, friction=500.0)
    machine, plain = (sl.Simulator(robot, PLACE, load_cell_filter=lag) for lag in (0.5, 0.0))
    length, push = machine.reading.length.copy(), np.array([0, 0, -30.0, 0, 0, 0])
    filtered = machine.reading.load_cell.copy()
    for _ in range(700):
        true = plain.step(length, 0.001, wrench=push).load_cell
        filtered += 0.001 / (0.5 + 0.001) * (true - filtered)
        np.testing.assert_allclose(machine.step(length, 0.001, wrench=push).load_cell, filtered, rtol=1e-12)


def test_held_drums_stand_until_they_are_released() -> None:
    robot = prototype()
    machine = sl.Simulator(robot, PLACE)
    length = machine.reading.length.copy()
    machine.hold(2, 5)
    held = machine.step(length + 0.01, 0.2).length.copy()
    assert (held[[2, 5]] == length[[2, 5]]).all()
    assert (np.delete(held - length, [2, 5]) > 5e-3).all()
    machine.release()
    assert (machine.step(length + 0.01, 0.5).length[[2, 5]] > length[[2, 5]] + 5e-3).all()
    with refused("winches", "8", "0 to 7"):
        machine.hold(8)


def test_a_machine_with_other_parameters_does_not_rest_there() -> None:
    robot = prototype()
    state = sl.inverse(robot, PLACE).state
    machine = sl.Simulator(robot.replace(mass=1.1 * robot.mass), state)
    for _ in range(300):
        reading = machine.step(state.unstrained_length, 0.01)
    assert reading.position[2] < PLACE.position[2] - 1e-3


def test_a_released_ideal_winch_starts_from_its_position() -> None:
    """It moves as after a set point at rest, linearly to the set points of the period."""
    state = sl.inverse(prototype(), PLACE).state
    machine, twin = (sl.Simulator(prototype(), state, winches="ideal") for _ in range(2))
    length = state.unstrained_length
    longer = length + np.where(np.arange(8) == 2, 0.02, 0.0)
    machine.hold(2)
    assert machine.step(longer, 0.1).length[2] == length[2]
    twin.step(length, 0.1)
    machine.release()
    for share in (0.5, 1.0):
        asked = length + share * (longer - length)
        reading, expected = machine.step(asked, 0.05), twin.step(asked, 0.05)
        np.testing.assert_allclose(reading.length, asked, rtol=1e-15)
        for mine, theirs in zip(reading[2:], expected[2:], strict=True):
            np.testing.assert_allclose(mine, theirs, rtol=1e-9, atol=1e-9)


def test_readings_are_copies() -> None:
    machine = sl.Simulator(prototype(), PLACE)
    for array in machine.reading:
        assert array is not None
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 0.0


@pytest.mark.parametrize("dead_cable", wide([0.0, 1.0]))
@pytest.mark.parametrize("winches", ["ideal", "robot"])
def test_invalid_periods_are_refused_without_effect(winches: Any, dead_cable: float) -> None:
    """After each refusal it continues like a second machine without the refused call."""
    robot = prototype(dead_cable=dead_cable)
    machine, twin = (sl.Simulator(robot, PLACE, winches=winches) for _ in range(2))
    length, down, tension = machine.reading.length.copy(), np.array([0, 0, -20.0, 0, 0, 0]), np.full(8, 50.0)
    one, refusals = np.arange(8) == 3, 0
    nan = np.full(8, np.nan)
    asked: list[tuple[dict[str, Any], *tuple[str, ...]]] = [
        ({"dt": 0.0015}, "dt"),
        ({"dt": 0.0}, "dt"),
        ({"dt": -1.0}, "dt"),
        ({"unstrained_length": np.where(one, np.nan, length)}, "unstrained_length[3]", "nan m"),
        ({"unstrained_length": -length, "wrench": [0, 0, -5000, 0, 0, 0]}, "unstrained_length[0]"),
        ({"unstrained_length": np.full(8, 1e60)}, "unstrained_length[0]", "1e+60 m"),
        ({"wrench": nan[:6]}, "wrench[0]", "nan N or N m"),
        ({"wrench": np.zeros(3)}, "wrench"),
        ({"unstrained_length": np.zeros(3), "wrench": 1e3 * down}, "unstrained_length"),
    ]
    if winches == "robot":
        asked += [
            ({"tension": nan}, "tension[0]", "nan N"),
            ({"tension": 9.0 * tension, "wrench": nan[:6]}, "wrench[0]", "nan N or N m"),
            ({"tension": nan, "wrench": 1e3 * down}, "tension[0]", "nan N"),
        ]
    if dead_cable:
        short = {"unstrained_length": np.where(one, 0.9, length)}
        asked.append((short, "unstrained_length: cable 3", "0.9 m", "> 1 m, its dead length"))
    for change, *parts in asked:
        with refused(*parts, kind=sl.InvalidValueError):
            machine.step(**{"unstrained_length": length, "dt": 0.01, **change})
        refusals += 1
        given: dict[str, Any] = {"wrench": down * refusals} if refusals % 3 == 0 else {}
        if winches == "robot" and refusals % 4 == 0:
            given["tension"] = tension + refusals
        seen, expected = machine.step(length, 0.01, **given), twin.step(length, 0.01, **given)
        for mine, theirs in zip(seen, expected, strict=True):
            np.testing.assert_array_equal(mine, theirs)
    assert machine.time == pytest.approx(0.01 * refusals)


def test_a_start_of_another_robot_is_refused() -> None:
    with refused("start", "of 8 cables", "7, as article-prototype has"):
        sl.Simulator(sl.without_cables(prototype(), 3), sl.inverse(prototype(), PLACE).state)


@pytest.mark.parametrize("winches", ["ideal", "robot"])
def test_a_cut_agrees_with_a_break_of_simulate(winches: str) -> None:
    state = sl.inverse(prototype(), PLACE).state
    machine = sl.Simulator(prototype(), state, winches=winches, step=1e-3)  # type: ignore[arg-type]
    run = sl.simulate(state, duration=0.6, step=1e-3, winches=winches, events=sl.Break(4, 0.2))  # type: ignore[arg-type]
    for _ in range(20):
        machine.step(state.unstrained_length, 0.01)
    machine.cut(4)
    for _ in range(40):
        reading = machine.step(state.unstrained_length, 0.01)
    np.testing.assert_allclose(reading.position, run.pose.position[-1], atol=1e-9)
    np.testing.assert_allclose(reading.tension, np.nan_to_num(run.tensions[-1]), atol=1e-6)
    assert np.linalg.norm(reading.position - PLACE.position) > 0.02


@pytest.mark.parametrize("winches", ["ideal", "robot"])
def test_masses_agree_with_the_events_of_simulate(winches: Any) -> None:
    """The platform moves when it drops a mass and picks up another, so that its momentum counts."""
    state = sl.inverse(prototype(), PLACE).state
    machine = sl.Simulator(prototype(), state, winches=winches, step=1e-3)
    rows = [state.unstrained_length - 0.05 * t * t for t in np.linspace(0.0, 0.6, 61)]
    events: list[Any] = [sl.Drop(2.0, 0.2), sl.PickUp(3.0, 0.4)]
    run = sl.simulate(
        state, unstrained_length=(np.linspace(0.0, 0.6, 61), np.array(rows)), step=1e-3, winches=winches, events=events
    )
    for i in range(60):
        if i == 20:
            machine.drop(2.0)
        if i == 40:
            machine.pick_up(3.0)
        reading = machine.step(rows[i + 1], 0.01)
    np.testing.assert_allclose(reading.position, run.pose.position[-1], atol=1e-9)
    np.testing.assert_allclose(reading.twist, run.twist[-1], atol=1e-8)
    np.testing.assert_allclose(reading.tension, run.tensions[-1], atol=1e-6)
    assert np.abs(reading.tension - state.cables.frame_end_tension).max() > 5.0
    with refused("mass", "1e+06 kg", "< 51 kg, the platform's mass"):
        machine.drop(1e6)
    with refused("mass", "-1 kg", "> 0 kg, finite"):
        machine.pick_up(-1.0)


def test_a_drive_with_less_force() -> None:
    """It holds up to its friction, then releases the cable; the reading says that it is at its limit."""
    robot = prototype(load_cell_deviation=0.0, load_cell_bias=0.0, load_cell_gain=1.0)
    state = sl.inverse(robot, PLACE).state
    machine, pull = sl.Simulator(robot, state), state.cables.frame_end_tension[2]
    machine.limit_force(pull - 14.0, 2)
    reading = machine.step(state.unstrained_length, 0.3)
    assert reading.saturated.tolist() == [0, 0, 1, 0, 0, 0, 0, 0]  # 1: torque
    assert reading.force[2] == pytest.approx(14.0 - pull)
    assert reading.length[2] == state.unstrained_length[2]
    machine.limit_force(pull - 16.0, 2)
    assert machine.step(state.unstrained_length, 0.3).length[2] > state.unstrained_length[2] + 1e-5
    for force in (-1.0, np.nan):
        with refused("force", f"{force:g} N"):
            machine.limit_force(force)
    with refused("force", "given", 'for winches="robot" alone'):
        sl.Simulator(robot, state, winches="ideal").limit_force(1.0)


def test_the_integral_does_not_grow_while_a_drive_is_at_its_limit() -> None:
    """A drive without enough force for 0.3 s returns to its set point without overshoot."""
    robot = prototype()
    state = sl.inverse(robot, PLACE).state
    machine, target = sl.Simulator(robot, state), state.unstrained_length
    machine.limit_force(state.cables.frame_end_tension[2] - 30.0, 2)
    assert machine.step(target, 0.3).length[2] > target[2] + 0.01
    machine.limit_force(1000.0, 2)
    left = [machine.step(target, 0.01).length[2] - target[2] for _ in range(40)]
    assert min(left) > -1e-4
    assert left[-1] < 1e-3


def test_jumps_of_set_points_are_followed_with_the_gain_of_the_loop() -> None:
    """20 /s: the remainder of a jump falls by e in 50 ms; with linear set points it would be reached in a period."""
    robot = prototype(friction=0.0)
    state = sl.inverse(robot, PLACE).state
    machine = sl.Simulator(robot, state)
    machine.shift(1e-3, 3)
    target = state.unstrained_length + np.where(np.arange(8) == 3, 1e-3, 0.0)
    left = [target[3] - machine.step(target, 0.01).length[3] for _ in range(20)]
    assert left[0] > 0.7e-3
    assert left[9] / left[4] == pytest.approx(np.exp(-1.0), rel=0.1)


def test_released_drums_start_from_their_position_with_zero_integral() -> None:
    robot = prototype()
    state = sl.inverse(robot, PLACE).state
    machine, twin = sl.Simulator(robot, state), sl.Simulator(robot, state)
    machine.hold()
    for _ in range(200):
        machine.step(state.unstrained_length + 0.02, 0.01)  # would fill the integral to its limit
    machine.release()
    place = machine.reading.position.copy()
    for _ in range(100):
        machine.step(state.unstrained_length, 0.01)
        assert np.abs(machine.reading.force - twin.step(state.unstrained_length, 0.01).force).max() < 1e-6
    np.testing.assert_allclose(machine.reading.position, place, atol=1e-12)
