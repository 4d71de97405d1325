"""Winches in time: lags, loops, limits, stiction, and the energy of wound cable."""

from __future__ import annotations

import inspect

import numpy as np
import pytest

import sagline as sl
from sagline.core.arrays import Array
from sagline.dynamics.simulation.simulate import CableMass, Integrator
from sagline.dynamics.simulation.winches import Winding
from sagline.kernels import tables
from sagline.kernels.cable.geometry import CABLE_ROWS, LENGTH
from sagline.kernels.dynamics import drives as d
from sagline.kernels.dynamics.drives import BIN
from tests.dynamics.let_go import LIFT
from tests.dynamics.machines import prototype
from tests.refusal import refused
from tests.tiers import wide


def lift(robot: sl.Robot, duration: float, height: float = 0.4) -> sl.Plan:
    path = sl.septic_path([(0, 0, 0.8), (0.2, 0.1, 0.8 + height)], durations=duration, rate=500.0)
    return sl.inverse(robot, path, tension=LIFT)


def test_the_delay_of_a_lagging_winch_is_twice_damping_ratio_over_frequency() -> None:
    state = lift(sl.load_robot("article-prototype"), 1.0).state[0]
    rate, times = np.linspace(-0.02, 0.02, 8), np.array([0.0, 4.0])
    lengths = state.unstrained_length + np.outer(times, rate)
    run = sl.simulate(state, unstrained_length=(times, lengths), winches=sl.SecondOrder(3.0, 0.6))
    late = state.unstrained_length + 3.5 * rate - run.length[350]
    np.testing.assert_allclose(late, rate * 2.0 * 0.6 / (2.0 * np.pi * 3.0), rtol=0, atol=1e-6)


@pytest.mark.parametrize("integrator", ["splitting", "runge-kutta"])
def test_the_step_response_of_a_lagging_winch_is_that_of_its_transfer_function(
    integrator: Integrator,
) -> None:
    state = lift(sl.load_robot("article-prototype"), 1.0).state[0]
    target = state.unstrained_length + 1e-3
    winches = sl.SecondOrder(2.0, 0.4)
    run = sl.simulate(state, unstrained_length=target, winches=winches, duration=1.0, integrator=integrator)
    omega, ratio = 4.0 * np.pi, 0.4
    fast = omega * np.sqrt(1.0 - ratio**2)
    t = run.time
    left = np.exp(-ratio * omega * t) * (np.cos(fast * t) + ratio * omega / fast * np.sin(fast * t))
    np.testing.assert_allclose(target[0] - run.length[:, 0], 1e-3 * left, atol=1e-7)


def test_a_slow_plan_is_followed_within_its_limits_and_ends_where_it_should() -> None:
    plan = lift(prototype(), 6.0)
    run = sl.simulate(plan, winches="robot", duration=10.0)
    assert run.events == ()
    assert np.abs(run.length[-1] - plan.unstrained_length[-1]).max() < 2e-5
    at_samples = run.length[:601:1]
    assert np.abs(at_samples - plan.unstrained_length[::5][: len(at_samples)]).max() < 2e-3
    assert np.abs(run.energy.error).max() < 1e-4 * np.abs(run.energy.supplied).max()


def test_a_plan_beyond_the_limits_runs_and_reports_saturated_winches() -> None:
    plan = lift(prototype(speed_limit=60.0), 1.0)
    rates = sl.winch_rates(plan)
    assert rates.too_fast is not None
    assert plan.path is not None
    too_fast = np.flatnonzero(rates.too_fast.any(axis=0))
    assert too_fast.size > 0
    run = sl.simulate(plan, winches="robot", duration=3.0)
    told = {event.cable: event.time for event in reversed(run.events) if event.kind == "saturate"}
    assert set(too_fast) <= set(told)
    assert {event.limit for event in run.events} == {"speed"}
    for winch in too_fast.tolist():
        first = plan.path.time[np.argmax(rates.too_fast[:, winch])]
        assert told[winch] == pytest.approx(first, abs=0.05)


def test_a_saturated_winch_tells_which_limits_are_active() -> None:
    """Motors too weak for the tensions at rest; the sagging platform then asks for more than the highest speed."""
    weak = prototype(torque_limit=0.12)
    run = sl.simulate(lift(weak, 1.0), winches="robot", duration=1.0)
    at_start = {event.cable for event in run.events if event.limit == "torque" and event.time == run.step}
    assert at_start == set(range(8))
    later = [event for event in run.events if event.limit == "torque and speed"]
    assert min(event.time for event in later) > 0.05
    assert later[0].text.endswith(f"({later[0].limit}) of cable {later[0].cable}")
    held = sl.simulate(lift(weak, 1.0), winches="robot", duration=0.1, events=sl.Break(1, 0.05))
    assert [event.limit for event in held.events if event.kind == "break"] == [None]


def test_friction_holds_a_drum_under_small_forces() -> None:
    robot = prototype(position_gain=0.0, speed_gain=0.0, integral_gain=0.0)
    state = lift(robot, 1.0).state[0]
    small, large = np.array([0, 0, 20.0, 0, 0, 0]), np.array([0, 0, 300.0, 0, 0, 0])
    held, moved = (sl.simulate(state, wrench=push, winches="robot", duration=1.0) for push in (small, large))
    assert np.ptp(held.length) == pytest.approx(np.ptp(state.unstrained_length), abs=0)
    assert np.abs(np.diff(held.length, axis=0)).max() == 0.0
    assert np.abs(moved.length[-1] - moved.length[0]).max() > 1e-3
    assert moved.energy.lost[-1] > 0.0


@pytest.mark.parametrize("winding", ["constant", "remembered"])
def test_the_work_of_winches_is_in_the_energy(winding: Winding) -> None:
    plan = lift(prototype(winding_tension=100.0), 3.0)
    coarse, fine = (
        np.abs(sl.simulate(plan, winches="robot", winding=winding, step=step, duration=4.0).energy.error).max()
        for step in (1e-3, 2.5e-4)
    )
    run = sl.simulate(plan, winches="robot", winding=winding, duration=4.0)
    assert run.energy.supplied[-1] > 100.0
    assert coarse < 2e-5 * run.energy.supplied[-1]
    assert fine < 0.3 * coarse


def test_remembered_winding_returns_the_wound_cable() -> None:
    path = sl.septic_path([(0, 0, 0.8), (0.2, 0.1, 1.3), (0, 0, 0.8)], durations=[4.0, 4.0], rate=500.0)
    robot = prototype(friction=0.0)
    plan = sl.inverse(robot, path, tension=LIFT)
    run = sl.simulate(plan, winches="robot", winding="remembered", duration=10.0)
    middle = np.abs(run.length[400] - plan.unstrained_length[2000]).max()
    assert middle > 1e-3  # wound under tension, the drum has less unstrained cable than at a constant 0 N
    assert np.abs(run.length[-1] - plan.unstrained_length[-1]).max() < 0.05 * middle
    assert run.energy.lost[-1] >= 0.0


def test_gains_that_are_unstable_at_a_millisecond_are_refused() -> None:
    with refused("winches: speed_gain[0]", "50000 N s/m") as caught:
        sl.simulate(lift(prototype(speed_gain=5e4), 1.0), winches="robot")
    assert caught.value.allowed.startswith("< 2.567e+04 N s/m")  # two inertias of 12.84 kg per period
    with refused("integrator"):
        sl.simulate(lift(prototype(), 1.0), winches="robot", integrator="runge-kutta")
    with refused("step", "0.0003 s", "0.001 s divided by a whole number"):
        sl.simulate(lift(prototype(), 1.0), winches="robot", step=3e-4)


def test_remembered_winding_conserves_length_and_energy() -> None:
    robot = prototype(winding_tension=30.0)
    state = lift(robot, 1.0).state[0]
    machine = sl.Simulator(robot, state, winding="remembered")
    plant = machine._plant
    stiffness, begins = robot.cables.axial_stiffness, BIN * np.arange(plant.layers.shape[1])

    def on_drums() -> tuple[Array, float]:
        """Unstrained lengths on drums [m], (m,), and their total strain energy [J]; the last bin is excluded."""
        there = np.clip(begins + BIN - plant.now[d.WOUND][:, None], 0.0, BIN)[:, :-1]
        lengths, strains = there / (1.0 + plant.layers[:, :-1]), plant.layers[:, :-1]
        return lengths.sum(axis=1), float((0.5 * stiffness[:, None] * strains**2 * lengths).sum())

    (length, energy), off = on_drums(), machine.reading.length.copy()
    generator = np.random.default_rng(2)
    for size in np.repeat([5e-4, 3e-3, 0.02], 20):
        wanted = state.unstrained_length + size * generator.uniform(-1.0, 1.0, 8)
        machine.step(wanted, 0.05)
    after, left = on_drums()
    np.testing.assert_allclose(after + machine.reading.length, length + off, rtol=0, atol=1e-12)
    assert np.ptp(plant.layers) > 1e-4
    assert left - energy == pytest.approx(plant.audit[d.ON_DRUMS], abs=1e-9)
    assert abs(plant.audit[d.ON_DRUMS]) > 1e-3


def test_cable_that_leaves_a_drum_keeps_its_strain() -> None:
    """Drums 3 m below and 1 m above the frame ends: energy EA strain^2/2 - w rise per unstrained meter."""
    strain, rise, speed, time = np.array([1e-3, 2e-3]), np.array([3.0, -1.0]), np.array([0.4, -0.2]), 0.01
    data, now, rows = np.zeros((d.DATA_ROWS, 2)), np.zeros((d.DRIVE_ROWS, 2)), np.zeros((CABLE_ROWS, 2))
    data[d.WINDING_STRAIN], data[d.BEHIND_RISE], now[d.SPEED] = strain, rise, speed
    cables = np.zeros((2, tables.CABLE_COLUMNS))
    cables[:, tables.DENSITY], cables[:, tables.STIFFNESS] = 0.1, 5e4
    drives = d.Drives(d.DRUMS, False, data, now, np.zeros((2, 1)), np.zeros(d.AUDIT_SIZE))
    inspect.unwrap(d._turn_drums)(drives, cables, rows, 9.81, time)
    let_out = time * speed / (1.0 + strain)
    np.testing.assert_allclose(rows[LENGTH], let_out, rtol=1e-14)
    energy = (0.5 * 5e4 * strain**2 - 0.1 * 9.81 * rise) * let_out
    assert drives.audit[d.ON_DRUMS] == pytest.approx(-energy.sum(), rel=1e-12)
    # H = T + T^2/(2 EA) - w z is equal at the frame end and at the drum
    whole, weight = 500.0, 0.1 * 9.81
    tension = inspect.unwrap(d.tension_at_drum)(whole, weight * 3.0, 5e4)
    assert tension + 0.5 * tension**2 / 5e4 + weight * 3.0 == pytest.approx(whole, rel=1e-14)


def test_a_brake_keeps_the_feedforward_tensions_of_motors() -> None:
    robot = prototype(integral_gain=0.0, friction=0.0)
    path = sl.septic_path([(0, 0, 0.5), (0.6, 0.3, 2.2)], durations=16.0, rate=62.5)
    plan = sl.inverse(robot, path, tension=LIFT)
    tension, rate = plan.state.cables.frame_end_tension, plan.length_rate
    assert rate is not None
    run = sl.simulate(plan, winches="robot", events=sl.Brake(8.0, duration=0.2), duration=16.0)
    expected = plan.unstrained_length[500] + 0.1 * rate[500]
    assert np.abs(tension[-1] - tension[500]).max() > 20.0
    assert np.abs(run.length[-1] - expected).max() < 3e-4  # 1.7 mm with continued tensions


@pytest.mark.parametrize("mass", wide(["none", "lumped"]))
def test_all_beginnings_of_events_are_recorded(mass: CableMass, monkeypatch: pytest.MonkeyPatch) -> None:
    state = lift(prototype(), 1.0).state[0]
    times = 0.1 * np.arange(11)
    lengths = state.unstrained_length + 0.06 * np.outer(np.arange(11) % 2, np.resize([1.0, -1.0], 8))
    told = []
    for room in (1000, 0):
        monkeypatch.setattr("sagline.dynamics.simulation.plant.NOTES", room)
        monkeypatch.setattr("sagline.dynamics.simulation.run.NOTES", room)
        run = sl.simulate(state, unstrained_length=(times, lengths), winches="robot", cable_mass=mass, nodes=6)
        told.append([(event.time, event.kind, event.cable) for event in run.events])
    assert len(told[0]) > 20
    assert told[0] == told[1]


@pytest.mark.parametrize("winches", ["ideal", sl.SecondOrder(3.0)])
def test_missing_drums_have_no_wound_cable(winches: str | sl.SecondOrder) -> None:
    state = lift(sl.load_robot("article-prototype"), 1.0).state[0]
    with refused("winding", '"remembered"'):
        sl.simulate(state, duration=0.1, winches=winches, winding="remembered")  # type: ignore[arg-type]
    with refused("winding", '"remembered"'):
        sl.Simulator(state.one_robot, state, winches=winches, winding="remembered")  # type: ignore[arg-type]


def test_missing_fields_of_winches_are_named_once() -> None:
    robot = prototype(position_gain=None, speed_gain=None, integral_gain=None)
    with refused("the robot", "without winches: position_gain, speed_gain, integral_gain"):
        sl.simulate(lift(robot, 1.0).state[0], duration=0.1, winches="robot")
    with refused("winches: integral_gain", "not given"):
        sl.simulate(lift(prototype(integral_gain=None), 1.0).state[0], duration=0.1, winches="robot")
