"""The machine behind the link: initial state, stops, and reproducible runs."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import pytest

import sagline as sl
from sagline.article.explanations import DEAD, LOAD, MODULUS, PULLEY, rest_positions, robot_with_errors
from sagline.control import Command, Mode, Sample
from tests.control.protocol import PERIOD, GroupFault, GroupStatus
from tests.dynamics.machines import prototype
from tests.refusal import refused
from tests.tiers import extended, wide
from tests.twin.pilot import HOME, Pilot, leg

ROBOT = sl.load_robot("article-prototype")
PLAN = sl.inverse(ROBOT, HOME)
OWN = 77


def test_the_machine_stands_still_on_its_drives() -> None:
    rig = sl.twin.Machine(ROBOT, seed=1)
    pilot, place = Pilot(rig.link(), PLAN), rig.reading.position.copy()
    assert np.abs(place - HOME.position).max() < 1e-12
    sample = pilot.hold(10.0)[-1]
    assert np.abs(rig.reading.position - place).max() < 1e-13
    assert np.abs(sample.length - PLAN.unstrained_length).max() < 0.5 * 72e-9
    assert (sample.status == GroupStatus.READY).all()
    assert np.abs(sample.filtered - PLAN.state.cables.frame_end_tension).max() < 1.0


STOPS = [  # model.md, section 12: kind of stop, m/s, N, mm
    (Mode.LOCK, 0.3, 63.0, 11.7),
    (Mode.HOLD, 0.3, 39.0, 26.7),
    (Mode.LOCK, 0.06, 13.0, 2.3),
    (Mode.HOLD, 0.06, 8.0, 5.1),
]


def studied() -> sl.Robot:
    """The prototype with the drives of the study."""
    assert ROBOT.winches is not None
    return ROBOT.replace(winches=ROBOT.winches.replace(integral_gain=80e3))


@pytest.mark.parametrize(("mode", "speed", "peak", "travel"), wide(STOPS, first=2))
def test_stops_of_the_study(mode: Mode, speed: float, peak: float, travel: float) -> None:
    """The integral gain of its drives was 80 kN/m."""
    robot = studied()
    plan = leg(robot, speed)
    assert plan.path is not None
    rig = sl.twin.Machine(robot, seed=1)
    pilot = Pilot(rig.link(), plan)
    pilot.hold(0.05)
    pilot.go(0.5 * plan.path.time[-1])
    place, before, largest = rig.reading.position.copy(), rig.reading.tension.copy(), 0.0
    for _ in range(300):
        pilot.send(mode)
        largest = max(largest, (rig.reading.tension - before).max())
    assert largest == pytest.approx(peak, abs=0.5)
    assert 1e3 * np.linalg.norm(rig.reading.position - place) == pytest.approx(travel, abs=0.15)


@pytest.mark.parametrize("speed", wide([0.3, 0.06]))
def test_a_dead_controller_costs_speed_times_heartbeat_and_half_the_ramp(speed: float) -> None:
    """The study: +8 and +39 N, 12.7 and 61.7 mm; it counts the heartbeat from the end of the last period."""
    robot = studied()
    plan = leg(robot, speed)
    assert plan.path is not None
    rig = sl.twin.Machine(robot, seed=1)
    pilot = Pilot(rig.link(), plan)
    pilot.hold(0.05)
    pilot.go(0.5 * plan.path.time[-1] - PERIOD)
    place, before, largest = rig.reading.position.copy(), rig.reading.tension.copy(), 0.0
    asked = pilot.go(PERIOD)[-1]
    rate = pilot.rate[pilot.at]
    samples = []
    for _ in range(300):
        samples += pilot.wait(PERIOD)
        largest = max(largest, (rig.reading.tension - before).max())
    assert largest == pytest.approx({0.06: 8.0, 0.3: 39.0}[speed], abs=0.5)
    travel = 1e3 * np.linalg.norm(rig.reading.position - place)
    assert travel == pytest.approx({0.06: 12.7, 0.3: 61.7}[speed], rel=0.015)
    np.testing.assert_allclose(samples[-1].length - pilot.length[pilot.at], rate * (0.1 - PERIOD + 0.1), atol=1e-4)
    ramps = [bool((sample.status & GroupStatus.RAMPING).all()) for sample in samples]
    assert ramps.index(True) == 9  # the scan 100 ms after that of the last command
    holds = [bool((sample.status & GroupStatus.HOLDING).all()) for sample in samples]
    assert holds.index(True) <= 29
    assert (samples[-1].fault == GroupFault.HEARTBEAT).all()
    assert (asked.fault == GroupFault.NONE).all()


def test_an_ideal_link_changes_no_bit() -> None:
    """Driven over the link, and as by a server: claims and commands by hand, blocks as reports."""
    plan = leg(ROBOT, 0.3)
    linked, served = (sl.twin.Machine(ROBOT, seed=5, faults=["cell 3 sticks at 0.4 s"]) for _ in range(2))
    pilot = Pilot(linked.link(), plan)
    for cycle in range(100):
        mode = Mode.HOLD if cycle < 5 else Mode.FOLLOW
        pilot.at = max(cycle - 5, 0)
        sample = pilot.send(mode)
        for group, winches in enumerate(served.groups):
            part = list(winches)
            if cycle == 0:
                served.claim(group, OWN)
                continue
            arrays = (pilot.length[pilot.at][part], np.zeros(2), pilot.tension[pilot.at][part], np.ones(2, dtype=bool))
            served.take(group, Command(pilot.counter, OWN, mode, pilot.valid_for, *arrays))
        served.advance()
        for group, winches in enumerate(served.groups):
            report, part = served.report(group), list(winches)
            assert report is not None
            for name in ("length", "rate", "torque", "tension", "filtered", "counts", "state", "winch_fault"):
                assert getattr(report, name) == getattr(sample, name)[part].tolist()
            for name in ("counter", "plc_time", "owner", "echo", "status", "fault"):
                assert getattr(report, name) == getattr(sample, name)[group]
    assert (linked.reading.position == served.reading.position).all()
    assert (sample.status & GroupStatus.FOLLOWING).all()
    assert np.linalg.norm(linked.reading.position - HOME.position) > 0.005


def test_a_seed_determines_a_run() -> None:
    def run(seed: int) -> list[float]:
        rig = sl.twin.Machine(ROBOT, seed=seed, jitter=0.03, loss=0.1)
        pilot = Pilot(rig.link(), PLAN)
        rig.link(moves=False)  # a second listener does not change the motion for the first one
        found: list[float] = []
        for _ in range(50):
            pilot.counter += 1
            arrays = (pilot.length[0], pilot.rate[0], pilot.tension[0], pilot.enable)
            sample = pilot.link.exchange(Command(pilot.counter, OWN, Mode.HOLD, 0.1, *arrays))
            if isinstance(sample, Sample):
                found += [float(value) for row in sample[1:-1] for value in row]
        return found

    assert run(1) == run(1)
    assert run(1) != run(2)


def test_counts_are_those_of_the_drums() -> None:
    """72 nm, 2 pi 30 mm / (20 2^17), from the mark at 3 m."""
    sample = Pilot(sl.twin.Machine(ROBOT).link(), PLAN).look()
    step = 2.0 * np.pi * 0.03 / (20 * 2**17)
    assert step == pytest.approx(72e-9, rel=2e-3)
    np.testing.assert_array_equal(sample.counts, np.rint((PLAN.unstrained_length - 3.0) / step))


DRUMS: list[dict[str, Any]] = [
    {"gear": -20.0, "winding_tension": 300.0},
    {"count_zero": 500.0},
    {"layers": 3, "drum_width": 0.03, "cable_length": 6.5, "drum_distance": 1.0, "drum_offset": -0.015},
]


@pytest.mark.parametrize("drum", wide(DRUMS, first=2))
def test_counts_and_lengths_of_a_drum_are_those_of_encoder_counts(drum: dict[str, Any]) -> None:
    wound, place = prototype(**drum), sl.Pose.from_euler([0.4, -1.0, 1.1], 0.0, 0.0, 0.0)
    plan = sl.inverse(wound, place)
    sample = Pilot(sl.twin.Machine(wound, start=place).link(), plan).look()
    assert np.abs(sample.counts - sl.encoder_counts(plan)).max() <= 1
    assert np.abs(sample.length - plan.unstrained_length).max() < 76e-9


def test_encoder_zeros_have_the_errors_of_length_zero() -> None:
    error = np.linspace(-0.002, 0.003, 8)
    assert ROBOT.winches is not None
    true = ROBOT.replace(winches=ROBOT.winches.replace(length_zero=3.0 + error))
    rig = sl.twin.Machine(true, nominal=ROBOT)
    sample = Pilot(rig.link(), PLAN).look()
    assert np.abs(sample.length - PLAN.unstrained_length).max() < 72e-9
    np.testing.assert_allclose(rig.reading.length, PLAN.unstrained_length + error, atol=1e-13)
    there = sl.forward(true, PLAN.unstrained_length + error, start=HOME).pose
    np.testing.assert_allclose(rig.reading.position, there.position, atol=1e-12)
    assert np.linalg.norm(there.position - HOME.position) > 1e-4
    surveyed = sl.twin.Machine(true, nominal=ROBOT, surveyed=True)
    np.testing.assert_allclose(surveyed.reading.position, HOME.position, atol=1e-12)
    assert np.abs(Pilot(surveyed.link(), PLAN).look().length - PLAN.unstrained_length).max() < 72e-9


def test_a_smaller_drum_lets_out_less() -> None:
    assert ROBOT.winches is not None
    true = ROBOT.replace(winches=ROBOT.winches.replace(drum_radius=0.99 * 0.03))
    rig = sl.twin.Machine(true, nominal=ROBOT)
    plan = leg(ROBOT, 0.3)
    pilot = Pilot(rig.link(), plan)
    pilot.hold(0.05)
    sample, last = pilot.go(11.0)[-1], plan.unstrained_length[-1]
    assert np.abs(sample.length - last).max() < 1e-5
    told = sample.length - PLAN.unstrained_length
    np.testing.assert_allclose(rig.reading.length - PLAN.unstrained_length, 0.99 * told, atol=2e-7)
    assert np.abs(told).max() > 0.5


@extended
@pytest.mark.parametrize(
    "error", [{PULLEY: 33.0}, {DEAD: 0.5}, {MODULUS: 20.0}, {LOAD: 2.0}, {DEAD: 1.0, PULLEY: 20.0}]
)
def test_it_begins_at_the_equilibrium_of_the_machine_of_the_article(error: dict[str, float]) -> None:
    """The contribution of pulleys and dead length to lengths at home was not counted when the encoders were set."""
    home = sl.inverse(ROBOT, sl.Pose.from_quaternion(HOME.position[None], [[0.0, 0.0, 0.0, 1.0]]))
    rig = sl.twin.Machine(robot_with_errors(ROBOT, error), nominal=ROBOT)
    np.testing.assert_allclose(rig.reading.position, rest_positions(ROBOT, home, home, [error])[0, 0], atol=1e-9)


def test_the_start_is_the_middle_of_the_test_box() -> None:
    assert np.abs(sl.twin.Machine(ROBOT).reading.position - HOME.position).max() < 1e-12
    bare = ROBOT.replace(test_box=None)
    with refused("start", "not given", kind=sl.InvalidValueError) as caught:
        sl.twin.Machine(bare)
    assert "test_box" in caught.value.allowed
    assert "start=Pose" in caught.value.next_step
    place = sl.Pose.from_euler([0.2, -0.4, 1.4], 0.0, 0.0, 0.0)
    assert np.abs(sl.twin.Machine(bare, start=place).reading.position - place.position).max() < 1e-12


def test_a_step_that_is_too_coarse_for_the_modes() -> None:
    """sqrt(k/J_e) of the stiffest drum on its cable is included."""
    stiff = ROBOT.replace(cables=ROBOT.cables.replace(axial_stiffness=3e6))
    with refused("step", "0.001 s", kind=sl.InvalidValueError) as caught:
        sl.twin.Machine(stiff)
    assert re.match(r"<= \S+ s, 0\.2 rad .* Hz", caught.value.allowed)
    sl.twin.Machine(stiff, step=float(caught.value.next_step.rpartition("step=")[2].rstrip(".")))
    assert ROBOT.winches is not None
    light = ROBOT.replace(winches=ROBOT.winches.replace(inertia=2.77e-8, speed_gain=10.0, integral_gain=100.0))
    drum = np.sqrt(1.4e4 / PLAN.unstrained_length.min() / (2.77e-8 * (20 / 0.03) ** 2))
    limit = 0.2 / np.hypot(drum, 2.0 * np.pi * 6.2)
    with refused("step", "0.001 s", kind=sl.InvalidValueError) as caught:
        sl.twin.Machine(light)
    assert float(caught.value.allowed.split("<= ")[1].split(" s")[0]) == pytest.approx(limit, rel=0.03)


def test_impossible_machines_are_refused() -> None:
    assert ROBOT.winches is not None
    blind = ROBOT.replace(winches=sl.Winch(drum_radius=0.03, inertia=1e-5))
    without_inertia = blind.replace(winches=sl.Winch(drum_radius=0.03, counts_per_turn=4096))
    rows: list[tuple[sl.Robot, dict[str, Any], tuple[str | None, ...]]] = [
        (ROBOT.replace(winches=None), {}, ("winches: counts_per_turn", "not given")),
        (blind, {}, ("winches: counts_per_turn", "not given")),
        (without_inertia, {}, ("the robot", "without winches: inertia, position_gain, speed_gain, integral_gain")),
        (ROBOT, {"nominal": sl.load_robot("fast")}, ("nominal", "of 6 cables")),
        (ROBOT, {"loss": 1.0}, ("loss", "1", ">= 0, < 1")),
        (ROBOT, {"delay": -1.0}, ("delay", "-1 s")),
        (ROBOT, {"seed": -1}, ("seed", "-1")),
        (ROBOT, {"period": 0.0123456}, ("period", "0.0123456 s")),
        (ROBOT, {"faults": ["cell 8 sticks"]}, ("fault", None, "cell 0 to 7")),
        (
            ROBOT,
            {"start": sl.Pose([9.0, 0.0, 1.0], np.eye(3))},
            ("start", "a pose that is not feasible"),
        ),
        (ROBOT.replace(mass=5000.0), {"surveyed": True, "nominal": ROBOT}, ("start", "a pose that is not feasible")),
    ]
    for robot, given, parts in rows:
        with refused(*parts, kind=sl.InvalidValueError):
            sl.twin.Machine(robot, **given)


@pytest.mark.parametrize(("share", "fault"), [(0.98, GroupFault.NONE), (1.02, GroupFault.SET_POINT)])
def test_set_points_faster_than_the_motors_are_refused(share: float, fault: GroupFault) -> None:
    winch = ROBOT.winches
    assert winch is not None
    assert winch.speed_limit is not None
    assert winch.drum_radius is not None
    pilot = Pilot(sl.twin.Machine(ROBOT, seed=1).link(), PLAN)
    pilot.hold(0.2)
    rate = np.zeros(8)
    rate[5] = share * float((winch.speed_limit * winch.drum_radius / winch.gear)[5])
    assert pilot.send(Mode.FOLLOW, rate=rate).fault.tolist() == [0, 0, fault, 0]


def test_two_controllers_on_one_machine() -> None:
    rig = sl.twin.Machine(ROBOT)
    first, second = Pilot(rig.link(), PLAN, 1), Pilot(rig.link(moves=False), PLAN, 2)
    first.hold(0.03)
    for _ in range(60):
        sample = first.send(Mode.HOLD)
        second.send(Mode.HOLD)
    assert (sample.owner == 1).all()
    first.send(Mode.LEAVE)
    second.send(Mode.HOLD)
    for _ in range(3):
        sample = first.wait(PERIOD)[-1]
        second.send(Mode.HOLD)
    assert (sample.owner == 2).all()
    assert rig.time == pytest.approx(67 * PERIOD)


@pytest.mark.parametrize(("expected", "fault", "most"), [(1e6, GroupFault.SET_POINT, 1e-4), (1999.0, None, 0.02)])
def test_motors_with_excessive_feedforward_hold_the_cables(
    expected: float, fault: GroupFault | None, most: float
) -> None:
    """Beyond the limit it is refused; below, lagging drives hold with the readings of their cells after 17 mm."""
    pilot = Pilot(sl.twin.Machine(ROBOT, seed=1).link(), PLAN)
    pilot.hold(0.2)
    begin = pilot.go(0.05)[-1]
    pilot.tension = np.full_like(pilot.tension, expected)
    followed = pilot.go(0.3)
    if fault is not None:
        assert set(followed[3].fault.tolist()) == {fault}
    held = pilot.hold(0.7)
    assert np.abs([sample.length - begin.length for sample in followed + held]).max() < most
    assert np.abs(held[-1].rate).max() < 1e-3
    assert held[-1].tension == pytest.approx(begin.tension, abs=40.0)
