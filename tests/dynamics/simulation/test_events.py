"""Events during a simulation: the following rest positions, and the reports."""

from __future__ import annotations

import re

import numpy as np
import pytest
from scipy.integrate import cumulative_trapezoid, trapezoid

import sagline as sl
from sagline.core.arrays import Array
from sagline.dynamics.simulation.results import Event
from sagline.dynamics.simulation.winches import NEEDED
from tests.dynamics.let_go import LIFT
from tests.refusal import refused
from tests.tiers import wide

PLACE = (0.4, 0.3, 1.5)


def state_at_rest(robot: sl.Robot | None = None) -> sl.Equilibrium:
    pose = sl.Pose.from_euler(PLACE, 0.0, 0.0, 0.0)
    return sl.inverse(robot or sl.load_robot("article-suspended"), pose, tension=LIFT).state


def run_with_damping(state: sl.Equilibrium, events: object) -> sl.Simulation:
    """Twenty seconds with strong damping."""
    damping = sl.Damping(loss_time=0.02, air_damping=2.0)
    return sl.simulate(state, duration=20.0, events=events, damping=damping)  # type: ignore[arg-type]


def energy_of(state: sl.Equilibrium, i: int) -> float:
    """Strain and potential energy of one cable [J], zero at its frame end, by quadrature."""
    cables, robot = state.cables, state.one_robot
    length, axial = cables.unstrained_length[i], robot.cables.axial_stiffness[i]
    weight = robot.cables.linear_density[i] * robot.gravity
    s = np.linspace(0.0, length, 20_001)
    vertical = cables.vertical_force[i] - weight * (length - s)
    force = np.hypot(cables.horizontal_tension[i], vertical)
    height = cumulative_trapezoid(vertical * (1.0 / force + 1.0 / axial), s, initial=0.0)
    return float(trapezoid(weight * height + force * force / (2.0 * axial), s))


def test_after_a_break_the_robot_comes_to_rest_on_the_other_cables() -> None:
    state = state_at_rest()
    run = run_with_damping(state, sl.Break(cable=3, time=0.5))
    kept = np.delete(np.arange(8), 3)
    robot = sl.without_cables(state.one_robot, 3)
    expected = sl.forward(robot, state.unstrained_length[kept], start=run.pose[-1])
    np.testing.assert_allclose(run.pose.position[-1], expected.pose.position, atol=1e-6)
    np.testing.assert_allclose(run.tensions[-1, kept], expected.state.cables.frame_end_tension, rtol=1e-5)
    assert (run.tensions[run.time > 0.5, 3] == 0.0).all()
    assert np.isnan(run.length[run.time > 0.5, 3]).all()
    assert np.abs(run.energy.error).max() < 1e-6 * np.ptp(run.energy.kinetic)
    assert (np.diff(run.energy.lost) >= 0.0).all()  # the cable that is suspended at its anchor carries no load
    assert (run.energy.removed[run.time <= 0.5] == 0.0).all()
    assert run.energy.removed[-1] == pytest.approx(energy_of(state, 3), rel=1e-7)
    told = run.events[0]
    assert (told.time, told.kind, told.cable) == (0.5, "break", 3)
    assert told.tension_before == pytest.approx(state.cables.frame_end_tension[3], rel=1e-9)
    assert told.tension_after == pytest.approx(run.tensions[run.time > 0.5].max(), rel=1e-3)


@pytest.mark.parametrize(("event", "mass"), [(sl.Drop(20.0, 0.5), -20.0), (sl.PickUp(15.0, 0.5), 15.0)])
def test_after_a_load_is_dropped_or_picked_up_the_robot_rests_with_its_new_mass(event: sl.Drop, mass: float) -> None:
    state = state_at_rest()
    run = run_with_damping(state, event)
    robot = state.one_robot.replace(mass=state.one_robot.mass + mass)
    expected = sl.forward(robot, state.unstrained_length, start=state.pose)
    np.testing.assert_allclose(run.pose.position[-1], expected.pose.position, atol=1e-6)
    assert np.abs(run.pose.position[-1] - PLACE).max() > 1e-3
    assert np.abs(run.energy.error).max() < 1e-5 * np.ptp(run.energy.kinetic)
    assert (np.diff(run.energy.lost) >= 0.0).all()
    assert run.energy.removed[-1] == pytest.approx(-mass * robot.gravity * PLACE[2], rel=1e-12)
    assert [told.kind for told in run.events] == ["drop" if mass < 0.0 else "pick up"]


def moving() -> sl.Plan:
    path = sl.septic_path([PLACE, (1.4, 0.3, 1.8)], durations=2.0, rate=500.0)
    return sl.inverse(sl.load_robot("article-suspended"), path, tension=LIFT)


def test_all_winches_brake_together_evenly() -> None:
    run = sl.simulate(moving(), events=sl.Brake(0.8, duration=0.2), record=1e-3)
    rate = np.diff(run.length, axis=0) / 1e-3
    middle = run.time[1:] - 5e-4
    at_first = rate[np.searchsorted(middle, 0.8) - 1]
    left = np.clip(1.0 - (middle - 0.8) / 0.2, 0.0, 1.0)
    later = middle > 0.8
    np.testing.assert_allclose(rate[later], left[later, None] * at_first, atol=2e-3 * np.abs(at_first).max())
    assert (rate[middle > 1.001] == 0.0).all()


@pytest.mark.parametrize("winches", ["ideal", sl.SecondOrder(8.0)])
def test_a_stalled_winch_stands_and_the_others_continue(winches: sl.SecondOrder) -> None:
    plan = moving()
    run = sl.simulate(plan, events=sl.Stall(2, 0.8), duration=4.0, winches=winches)
    after = run.time >= 0.8
    assert np.ptp(run.length[after, 2]) == 0.0
    others = np.delete(np.arange(8), 2)
    np.testing.assert_allclose(run.length[-1, others], plan.unstrained_length[-1, others], atol=1e-6)


# peaks of another simulation of the prototype with its winches: +13 and +8 N at 0.06 m/s, +63 and +39 N at 0.3 m/s
@pytest.mark.parametrize(("speed", "locked", "braked"), wide([(0.3, 63.0, 39.0), (0.06, 13.0, 8.0)]))
def test_stops_of_the_prototype_raise_tensions_as_in_another_simulation(
    speed: float, locked: float, braked: float
) -> None:
    ends = np.array([[0.0, 0.0, 1.5], [-0.13, 1.42, 0.68]])
    duration = 2.1875 * float(np.linalg.norm(ends[1] - ends[0])) / speed  # 2.1875 times the mean speed in the middle
    path = sl.septic_path(ends, durations=duration, rate=100.0)
    plan = sl.inverse(sl.load_robot("article-prototype"), path, tension=LIFT)
    middle = 0.5 * duration
    before = plan.state.cables.frame_end_tension[np.argmin(np.abs(path.time - middle))]
    stops: list[list[Event]] = [[sl.Stall(i, middle) for i in range(8)], [sl.Brake(middle, duration=0.2)]]
    for events, expected in zip(stops, (locked, braked), strict=True):
        damping = sl.Damping(loss_time=1e-3)
        run = sl.simulate(plan, events=events, duration=middle + 6.0, damping=damping, record=0.002)
        peak = (run.tensions[run.time >= middle].max(axis=0) - before).max()
        assert peak == pytest.approx(expected, abs=1.2)


def test_repeated_events_occur_in_order() -> None:
    events: list[Event] = [sl.Break(5, 1.5), sl.Drop(5.0, 0.7), sl.Brake(1.0), sl.Break(2, 0.7)]
    run = sl.simulate(state_at_rest(), events=events, duration=2.0)
    assert [(told.kind, told.cable) for told in run.events if told.kind != "slack"] == [
        ("drop", None),
        ("break", 2),
        ("brake", None),
        ("break", 5),
    ]
    scale = run.energy.kinetic.max()
    assert np.abs(run.energy.error).max() < 1e-5 * scale


@pytest.mark.parametrize(
    ("events", "parts"),
    [
        (sl.Break(8, 0.5), ("events[0]: cable", "8", "0 to 7, as article-suspended has")),
        ([sl.Break(1, 0.5), sl.Stall(9, 0.5)], ("events[1]: winch", "9")),
        (sl.Break(1, 2.5), ("events[0]: time", "2.5 s", "0 to 1 s")),
        ([sl.Break(1, 0.5), sl.Stall(1, 0.7)], ("events: cable 1", "broken before 0.7 s")),
        (sl.Drop(1e4, 0.5), ("events: Drop: mass", "10000 kg")),
        ([sl.Break(i, 0.5) for i in range(8)], ("events", "a break of every cable")),
        ([3], ("events[0]", "3", "one of Break, Stall, Brake, Drop, PickUp")),
        ("break", ("events", "'break'")),
    ],
)
def test_impossible_events_are_refused(events: object, parts: tuple[str, ...]) -> None:
    with refused(*parts, kind=sl.InvalidValueError):
        sl.simulate(state_at_rest(), events=events, duration=1.0)  # type: ignore[arg-type]


def test_half_of_the_wind_force_on_cables_acts_on_the_platform() -> None:
    robot = sl.load_robot("article-suspended")
    robot = robot.replace(cables=robot.cables.replace(diameter=0.01))
    state, wind = state_at_rest(robot), np.array([0.0, 15.0, 0.0])
    run = sl.simulate(state, wind=wind, duration=1e-3, step=1e-3, record=1e-3)
    force = np.zeros(3)
    ends = np.asarray(PLACE) + robot.platform_anchors
    for chord in ends - robot.frame_anchors:
        length = np.linalg.norm(chord)
        across = wind - chord * (wind @ chord) / length**2
        force += 0.5 * length * 0.5 * 1.2 * 1.2 * 0.01 * np.linalg.norm(across) * across
    np.testing.assert_allclose(run.twist[-1, :3] * robot.mass, force * 1e-3, atol=2e-7 * float(np.linalg.norm(force)))
    with refused("cables: diameter", "not given"):
        sl.simulate(state_at_rest(), wind=wind, duration=1.0)


def test_a_plan_with_infeasible_samples_is_refused_with_the_first_one() -> None:
    robot = sl.load_robot("article-suspended")
    plan = sl.inverse(robot, sl.quintic_path([(0, 0, 1.5), (9, 0, 1.5)], durations=20.0, rate=10.0))
    first = int(np.argmin(plan.feasible))
    assert 0 < first < len(plan.feasible)
    assert plan.path is not None
    with refused(f"start: sample {first}, {plan.path.time[first]:g} s", allowed="solved"):
        sl.simulate(plan)


@pytest.mark.parametrize(
    ("given", "item", "value"),
    [
        ({"step": 0.08}, "step", "0.08 s"),
        ({"cable_mass": "solid"}, "cable_mass", "'solid'"),
        ({"damping": sl.Damping(modal_damping=0.1)}, "damping: modal_damping", "0.1"),
        ({"unstrained_length": np.full(8, -1.0)}, "unstrained_length: cable 0", "-1 m"),
        ({"wrench": ([0.5, 1.0], np.zeros((2, 6)))}, "wrench: time[0]", "0.5 s"),
        ({"duration": None}, "duration", "not given"),
        ({"duration": 1e7}, "duration", "1e+07 s"),
        ({"winches": "robot"}, "the robot", f"without winches: {', '.join(NEEDED)}"),
        ({"record": 1e-5}, "record", "1e-05 s"),
    ],
)
def test_impossible_simulations_are_refused(given: dict[str, object], item: str, value: str) -> None:
    arguments: dict[str, object] = {"duration": 1.0, **given}
    with refused(item, value, kind=sl.InvalidValueError):
        sl.simulate(state_at_rest(), **arguments)  # type: ignore[arg-type]


def test_models_without_energy_are_refused() -> None:
    robot, pose = sl.load_robot("article-suspended"), sl.Pose.from_euler(PLACE, 0.0, 0.0, 0.0)
    with refused("start: model", "Parabolic()", "Catenary() or Elastic()"):
        sl.simulate(sl.inverse(robot, pose, model=sl.Parabolic()).state, duration=1.0)
    rubbing = robot.replace(winches=sl.Winch(0.05, pulley_friction=0.1))
    path = sl.septic_path([PLACE, (1.4, 0.3, 1.8)], durations=4.0, rate=20.0)
    with refused("start: winding", "given", "None"):
        sl.simulate(sl.inverse(rubbing, path, winding="path"))


def test_growing_energy_ends_the_run_with_time_and_cable(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sagline.dynamics.simulation.simulate._checked_step", lambda *_: 0.09)
    state = state_at_rest()
    with refused("step", next_step="Give step=0.018.", kind=sl.InvalidValueError) as caught:
        sl.simulate(state, wrench=np.array([50.0, 0, 0, 0, 0, 0]), duration=60.0, integrator="splitting")
    assert re.search(r"at 0\.\d+ s, .* cable \d", caught.value.value)


def test_vanishing_energy_ends_the_run() -> None:
    with refused("step", next_step="Give step=0.01.") as caught:
        sl.simulate(state_at_rest(), wrench=np.array([50.0, 0, 0, 0, 0, 0]), duration=60.0, step=0.05)
    assert re.search(r"^0\.05 s, .* at \d+\.\d s, .* cable \d", caught.value.value)


def test_damping_is_that_of_the_linear_system() -> None:
    robot = sl.load_robot("article-prototype")
    state = sl.inverse(robot, sl.Pose.from_euler([0, 0, 1], 0, 0, 0), model=sl.Elastic(), tension=LIFT).state
    push, times = np.array([0.02, 0.01, -0.03, 0.0, 0.0, 0.0]), np.arange(0.0, 1.01, 0.1)
    run = sl.simulate(state, wrench=push, duration=1.0, damping=sl.Damping(2e-3, 0.5), record=0.1)
    np.testing.assert_allclose(run.pose.position - [0, 0, 1], linear(state, push, times)[:, :3], rtol=0, atol=3e-9)
    assert np.abs(run.energy.error).max() < 1e-9
    assert run.energy.lost[-1] > 0.0


def linear(state: sl.Equilibrium, push: Array, times: Array) -> Array:
    """Motions (N, 6) of the linear system after a small wrench, with damping along the chords of the cables."""
    from scipy.linalg import expm

    robot = state.one_robot
    chords = state.pose.position + robot.platform_anchors - robot.frame_anchors
    length = np.linalg.norm(chords, axis=1)
    unit = chords / length[:, None]
    rows = np.hstack((unit, np.cross(robot.platform_anchors, unit)))
    damping = (rows.T * (2e-3 * robot.cables.axial_stiffness / state.unstrained_length)) @ rows
    for end, size in zip(robot.platform_anchors, length, strict=True):
        moves = np.hstack((np.eye(3), np.array([np.cross(axis, end) for axis in np.eye(3)]).T))
        damping += 0.5 * size / 3.0 * moves.T @ moves
    mass = np.zeros((6, 6))
    mass[:3, :3], mass[3:, 3:] = robot.mass * np.eye(3), robot.inertia
    matrix = np.zeros((13, 13))
    matrix[:6, 6:12] = np.eye(6)
    matrix[6:12, :6] = -np.linalg.solve(mass, sl.stiffness(state).matrix)
    matrix[6:12, 6:12] = -np.linalg.solve(mass, damping)
    matrix[6:12, 12] = np.linalg.solve(mass, push)
    return np.array([expm(matrix * time)[:6, 12] for time in times])
