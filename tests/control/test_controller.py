"""The controller with a machine in the same process: motions, refusals and sent commands."""

import gc
import re
import signal
from itertools import pairwise
from typing import Any

import numpy as np
import pytest

import sagline as sl
from sagline.control.controller import Controller
from sagline.control.execution import ExecutionStatus
from sagline.control.link import Command, Mode, Sample
from sagline.control.real_time import Pace
from sagline.control.states import RefusedError, State
from sagline.twin.injected import Injected
from sagline.twin.machine import Machine
from tests.control.rigs import (
    HOME,
    Replay,
    Spy,
    Watcher,
    at,
    imperfect,
    prototype,
    rest,
    rig,
    spy_of,
    state_of,
    with_zero_errors,
)
from tests.refusal import refused


def sent(control: Controller) -> list[Command]:
    return [command for command in spy_of(control).commands if command is not None]


def test_the_platform_reaches_the_commanded_pose() -> None:
    control, machine = rig()
    done = control.go_to(at(0.1, -0.1, 1.45))
    assert done.status is ExecutionStatus.DONE
    assert state_of(control) is State.IDLE
    assert np.linalg.norm(done.position[-1] - [0.1, -0.1, 1.45]) < 2e-4  # the integrals of the drives still change
    rest(control, machine, 2.0)
    assert np.linalg.norm(rest(control, machine, 2.0) - [0.1, -0.1, 1.45]) < 5e-5
    assert np.linalg.norm(control.estimate.position - [0.1, -0.1, 1.45]) < 1e-5
    assert done.plan is not None
    assert np.array_equal(done.set_length[-1], done.plan.unstrained_length[-1])
    assert done.clock[-1] == pytest.approx(done.plan.path.duration, abs=1e-12)  # type: ignore[union-attr]


def test_recorded_samples_give_the_same_commands_exactly() -> None:
    control, _ = rig(imperfect(zero=2e-3))
    control.go_to(at(0.05, 0.0, 1.5))
    control.jog(3, 2e-3)
    spy = spy_of(control)
    replay = Replay(spy)
    again = Controller(prototype(), replay, seed=2)
    again.connect()
    again.home(HOME)
    again.go_to(at(0.05, 0.0, 1.5))
    again.jog(3, 2e-3)
    assert len(replay.commands) == len(spy.commands)
    for first, second in zip(spy.commands, replay.commands, strict=True):
        if first is None or second is None:
            assert first is second
            continue
        assert first[:4] == second[:4]
        assert all(np.array_equal(a, b, equal_nan=True) for a, b in zip(first[4:8], second[4:8], strict=True))
    assert [event.text for event in again.events] == [event.text for event in control.events]


def test_commands_have_consecutive_counters_and_feasible_set_points() -> None:
    control, _ = rig(imperfect(zero=2e-3))
    control.go_to(at(0.05, 0.0, 1.5))
    control.jog_platform([0.0, 0.01, 0.0, 0.0, 0.0, 0.02])
    control.jog(0, 3e-3)
    commands = sent(control)
    counters = [command.counter for command in commands]
    assert all((b - a) % (2**31 - 1) == 1 for a, b in pairwise(counters))
    followed = [command for command in commands if command.mode is Mode.FOLLOW]
    lengths, rates = (np.array([getattr(command, name) for command in followed]) for name in ("length", "rate"))
    steps = np.diff(lengths, axis=0)
    assert np.abs(steps - 0.5 * control.period * (rates[1:] + rates[:-1])).max() < 2e-5  # no jump in any cycle
    assert all(np.isfinite(row).all() for command in followed for row in command[4:7])


def test_no_path_is_followed_before_homing_and_valid_requests_are_named() -> None:
    control, _ = rig(home=False)
    with pytest.raises(RefusedError, match=r"OFF.*MOVING"):
        control.execute(sl.quintic_path([(0, 0, 1.5), (0, 0, 1.6)], speed=0.1))
    control.connect()
    with pytest.raises(RefusedError, match=r"READY.*MOVING.*HOMING"):
        control.execute(sl.quintic_path([(0, 0, 1.5), (0, 0, 1.6)], speed=0.1))
    assert not any(command.mode is Mode.FOLLOW for command in sent(control))


def _sliding() -> sl.Pose:
    return sl.Pose.from_euler([[0, 0, 1.5], [0, 0, 1.501], [0, 0, 1.502]], 0.0, 0.0, 0.0)


def _ends_at_full_speed() -> sl.Path:
    path = sl.quintic_path([(0, 0, 1.5), (0, 0, 1.6)], speed=0.1)
    half = slice(len(path.time) // 2)
    assert path.twist_rate is not None
    return sl.Path(path.time[half], path.pose[half], path.twist[half], path.twist_rate[half])


REFUSED: list[tuple[Any, str]] = [
    (lambda: sl.quintic_path([(0, 0.01, 1.5), (0, 0, 1.6)], speed=0.1), r" 10 mm .*allowed: 2 mm"),
    (lambda: sl.quintic_path([(0, 0, 1.5), (0, 0, 5.0)], speed=1.0), r"INFEASIBLE, cables 0, 1"),
    (lambda: sl.septic_path([(0, 0, 1.5), (0, 1.3, 1.2)], speed=0.6), r"winch \d .* rad/s"),
    (lambda: sl.quintic_path([(0, 0, 1.5), (0, 0, 1.6)], speed=0.1, rate=70.0), r" 0\.01 s;.* 10 ms"),
    (lambda: sl.path_from_samples([0.0, 0.01, 0.02], _sliding()), r" 0\.1 m/s .*allowed: 0\.001"),
    (_ends_at_full_speed, r" 0\.1 m/s .*allowed: 0\.001"),
]  # fmt: skip


@pytest.mark.parametrize(("path", "why"), REFUSED)
def test_a_path_that_fails_a_check_is_refused_in_one_line(path: Any, why: str) -> None:
    control, _ = rig()
    before = control.state, len(sent(control))
    with refused("the path", kind=RefusedError) as caught:
        control.execute(path())
    assert re.search(why, caught.value.reason)
    assert len(str(caught.value)) < 300
    assert (control.state, len(sent(control))) == before


def test_a_pause_stays_on_the_path_and_resume_reaches_its_end() -> None:
    control, machine = rig()
    control.start(control.path_to(at(0.1, 0.0, 1.5)))
    for _ in range(60):
        control.cycle()
    control.pause()
    assert state_of(control) is State.PAUSING
    paused = control.wait()
    assert paused.status is ExecutionStatus.PAUSED
    assert state_of(control) is State.IDLE
    set_at = control.estimate.position.copy()
    rest(control, machine, 0.5)
    assert np.linalg.norm(control.estimate.position - set_at) < 1e-4
    assert abs(set_at[1]) + abs(set_at[2] - 1.5) < 2e-5  # on the path
    control.resume()
    done = control.wait()
    assert done.status is ExecutionStatus.DONE
    assert np.linalg.norm(done.position[-1] - [0.1, 0.0, 1.5]) < 2e-4
    assert len(done) > len(paused)
    followed = np.array([command.length for command in sent(control) if command.mode is Mode.FOLLOW])
    assert np.abs(np.diff(followed, 2, axis=0)).max() < 3e-5  # no corner: 0.1 m/s to rest in 0.2 s is 5e-5 per cycle^2


def test_a_stop_is_synchronous_and_a_new_path_continues_without_a_jump() -> None:
    control, _ = rig()
    control.start(control.path_to(at(0.1, 0.1, 1.5)))
    for _ in range(80):
        control.cycle()
    control.stop()
    done = control.wait()
    assert (done.status, control.state) == (ExecutionStatus.STOPPED, State.IDLE)
    stopping = done.state == State.STOPPING
    assert stopping.sum() in (20, 21)
    rates = done.set_rate[-20:]
    direction = rates[0] / np.linalg.norm(rates[0])
    assert np.abs(rates - np.outer(rates @ direction, direction)).max() < 1e-12
    assert np.allclose(np.diff(rates @ direction), -np.linalg.norm(rates[0]) / 19, rtol=1e-9)
    assert not rates[-1].any()
    done = control.go_to(HOME)
    assert done.status is ExecutionStatus.DONE
    followed = np.array([command.length for command in sent(control) if command.mode is Mode.FOLLOW])
    assert np.abs(np.diff(followed, 2, axis=0)).max() < 3e-5


def test_an_emergency_stop_locks_the_drums_until_off() -> None:
    control, machine = rig()
    control.start(control.path_to(at(0.1, 0.1, 1.5)))
    for _ in range(50):
        control.cycle()
    machine.emergency_stop()
    done = control.wait()
    assert (done.status, control.state) == (ExecutionStatus.EMERGENCY, State.EMERGENCY)
    control.cycle()
    assert sent(control)[-1].mode is Mode.LOCK
    for call in (control.acknowledge, control.claim, lambda: control.go_to(HOME)):
        with pytest.raises(RefusedError):
            call()
    control.off()
    with pytest.raises(RefusedError, match=r"group 0, 1, 2, 3: .*emergency"):
        control.connect()
    machine.reset()
    control.connect()
    with pytest.raises(RefusedError, match=r"READY.*MOVING"):
        control.go_to(HOME)


def test_the_pose_is_still_known_after_a_fault_is_acknowledged() -> None:
    control, machine = rig()
    machine.inject(Injected("group is silent", 1, 0.0, 1.5, 0.3))
    done = control.go_to(at(0.1, 0.1, 1.5))
    assert (done.status, control.state) == (ExecutionStatus.FAULT, State.FAULT)
    assert "group 1" in done.reason
    with pytest.raises(RefusedError, match=r"FAULT.*MOVING"):
        control.go_to(HOME)
    for _ in range(60):
        control.cycle()
    control.acknowledge()
    assert state_of(control) is State.IDLE
    assert control.go_to(HOME).status is ExecutionStatus.DONE


def test_a_second_controller_is_refused_and_the_first_continues() -> None:
    first, machine = rig()
    link = Spy(machine.link(moves=False))
    second = Controller(prototype(), link, seed=3)
    first.start(first.path_to(at(0.05, 0.0, 1.5)))
    second.claim()
    while first.moving:
        first.cycle()
        second.cycle()
    assert first.execution is not None
    assert first.execution.status is ExecutionStatus.DONE
    while second.state is State.CONNECTING:
        first.cycle()
        second.cycle()
    assert second.state is State.OFF
    assert f"controller, {first.owner}" in second.events[-1].text
    first.off()
    link.link = machine.link()
    second.connect()
    assert state_of(second) is State.READY


def test_of_two_controllers_with_some_groups_one_gets_all() -> None:
    machine = Machine(prototype(), start=HOME, seed=1)
    links = machine.link(), machine.link(moves=False)
    both = [Controller(prototype(), link, seed=seed) for link, seed in zip(links, (3, 4), strict=True)]
    for group in (0, 1):
        machine.claim(group, both[0].owner)
    for group in (2, 3):
        machine.claim(group, both[1].owner)
    for control in both:
        control.claim()
    for _ in range(1500):
        for control in both:
            control.cycle()
        if any(control.state is State.READY for control in both):
            break
    assert sorted(control.state is State.READY for control in both) == [False, True]


def test_a_reading_controller_sends_nothing_and_estimates_the_pose() -> None:
    control, machine = rig()
    watcher = Watcher()
    spy = Spy(machine.link(moves=False))
    shadow = Controller(prototype(), spy, shadow=True, record=watcher, seed=4)
    control.start(control.path_to(at(0.05, 0.0, 1.5)))
    while control.moving:
        control.cycle()
        shadow.cycle()
    assert all(command is None for command in spy.commands)
    assert shadow.state is State.OFF
    assert np.linalg.norm(watcher.cycles[-1].position - [0.05, 0.0, 1.5]) < 1e-4
    with pytest.raises(RefusedError, match="only reads"):
        shadow.connect()


def test_homing_proposes_a_jog_until_tensions_agree() -> None:
    # the part that no motion of the platform reduces
    tight = -6e-3 * np.linalg.svd(sl.stiffness(sl.inverse(prototype(), HOME).state).length_sensitivity)[2][6]
    control, _ = rig(with_zero_errors(prototype(), tight), home=False)
    control.connect()
    with refused("homing", kind=RefusedError) as caught:
        control.home(HOME)
    assert re.search(r"\d by [+-]\d+\.\d N.* allowed: 11\.2 N", caught.value.reason)
    assert re.search(r"jog \d [+-]\d+\.\dmm", caught.value.next_step)
    assert len(str(caught.value)) < 300
    assert state_of(control) is State.HOMING
    for winch, by in enumerate(tight):
        before = control.sample
        control.jog(winch, -by)
        assert before is not None
        assert control.sample is not None
        moved = control.sample.length - before.length
        assert moved[winch] == pytest.approx(-by, abs=2e-4)
        assert np.abs(np.delete(moved, winch)).max() < 1e-5
    with refused("homing", kind=RefusedError) as caught:
        control.home(HOME)
    lengths = re.findall(r"(\S+) mm", caught.value.reason)[:2]
    assert [float(length) for length in lengths] == [3612.9, 3609.9]  # in the machine, from homing
    jogs = [command for command in sent(control) if command.mode is Mode.FOLLOW]
    assert {command.enable.sum() for command in jogs} == {1}
    assert max(np.abs(command.rate).max() for command in jogs) <= 0.01 + 1e-12
    control.confirm_homing()
    assert state_of(control) is State.IDLE
    assert control.zero == pytest.approx(tight, abs=2e-4)


def test_a_jog_during_homing_ends_at_a_tension_limit() -> None:
    control, _ = rig(home=False)
    control.connect()
    control.begin_homing(HOME)
    control.jog(0, -0.05)
    assert state_of(control) is State.HOMING
    assert control.events[-1].name == "jog"
    assert re.search(r"cable \d", control.events[-1].text)
    assert control.sample is not None
    planned = sl.inverse(prototype(), HOME).state.cables.frame_end_tension
    assert (control.sample.tension / planned).max() < 1.4  # it stopped with the ramp of the PLC


def test_a_jog_beyond_the_limits_is_refused() -> None:
    control, _ = rig()
    control.jog(0, -0.05)
    with refused("a jog of winch 0 by -100 mm", kind=RefusedError) as caught:
        control.jog(0, -0.1)
    assert re.match(r"cable \d .* tension_m", caught.value.reason)
    with refused("by", "0.2 m", kind=sl.InvalidValueError):
        control.start_jog(0, 0.2)
    with refused("winch", "8", kind=sl.InvalidValueError):
        control.start_jog(8, 0.01)
    assert state_of(control) is State.IDLE


def test_the_platform_is_jogged_along_a_line_and_rotated() -> None:
    control, machine = rig()
    control.jog_platform([0.01, 0.0, 0.02, 0.0, 0.0, 0.03])
    assert state_of(control) is State.IDLE
    assert np.linalg.norm(rest(control, machine, 2.0) - [0.01, 0.0, 1.52]) < 1e-4
    assert np.linalg.norm(control.estimate.position - [0.01, 0.0, 1.52]) < 1e-5
    turned = sl.Pose.from_euler([0, 0, 0], 0.03, 0.0, 0.0).quaternion
    assert np.abs(control.estimate.quaternion - turned).max() < 1e-5


def test_ctrl_c_stops_the_machine_and_a_second_one_has_no_effect() -> None:
    def press() -> None:
        signal.raise_signal(signal.SIGINT)
        signal.raise_signal(signal.SIGINT)

    watcher = Watcher(60, press)
    control, _ = rig(record=watcher)
    watcher.count = 0
    before = signal.signal(
        signal.SIGINT, signal.default_int_handler
    )  # a shell can start this process with Ctrl-C ignored
    try:
        with pytest.raises(KeyboardInterrupt):
            control.go_to(at(0.1, 0.1, 1.5))
        assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
    finally:
        signal.signal(signal.SIGINT, before)
    assert state_of(control) is State.IDLE
    assert control.execution is not None
    assert control.execution.status is ExecutionStatus.STOPPED
    assert control.execution.state[-1] == State.IDLE
    assert (control.execution.state == State.STOPPING).sum() in (20, 21)


def test_no_garbage_is_collected_during_a_motion() -> None:
    seen = []
    watcher = Watcher()
    control, _ = rig(record=watcher)
    watcher.event = lambda event: None  # type: ignore[method-assign]
    watcher.cycle = lambda cycle: seen.append((cycle.state, gc.isenabled()))  # type: ignore[method-assign]
    control.go_to(at(0.02, 0.0, 1.5))
    rest_of_it = {on for state, on in seen if state is not State.MOVING}
    assert {on for state, on in seen if state is State.MOVING} == {False}
    assert rest_of_it == {True}
    assert gc.get_freeze_count() == 0


def test_observers_are_notified_before_the_first_cycle_and_after_the_last() -> None:
    watcher = Watcher()
    control, _ = rig(record=watcher)
    done = control.go_to(at(0.02, 0.0, 1.5))
    kinds = [told for told in watcher.told if told[0] in ("begins", "ends")]
    assert [told[0] for told in kinds] == ["begins", "ends"]
    assert kinds[1][1] - kinds[0][1] == len(done)
    assert kinds[1][2:] == (done.status, done.reason)
    assert watcher.cycles[-1].state is State.IDLE


def test_a_failed_log_is_an_event_and_the_motion_continues(monkeypatch: pytest.MonkeyPatch) -> None:
    watcher = Watcher(30, lambda: setattr(Watcher, "stopped", "disk full"))
    monkeypatch.setattr(Watcher, "stopped", "")
    control, _ = rig(record=watcher)
    done = control.go_to(at(0.05, 0.0, 1.5))
    assert done.status is ExecutionStatus.DONE
    assert any("disk full" in event.text for event in control.events)


def test_a_robot_without_redundancy_moves_with_the_tension_loop_off() -> None:
    winch = prototype().winches
    assert winch is not None
    fields = {name: field[:3] for name, field in winch.known().items() if name != "swivel_axis"}
    three = sl.Winch(**fields)
    tripod = sl.Robot(
        "tripod",
        frame_anchors=[[3, 0, 3], [-2, 2, 3], [-2, -2, 3]],
        platform_anchors=np.zeros((3, 3)),
        cables=sl.Cable(linear_density=0.05, axial_stiffness=5e4),
        mass=30.0,
        motion_pattern="3T",
        winches=three,
    )
    machine = Machine(tripod, start=at(0, 0, 1), seed=1)
    control = Controller(tripod, machine.link(), seed=2)
    assert [len(group) for group in machine.link().groups] == [2, 1]
    control.connect()
    control.home(at(0, 0, 1))
    done = control.go_to(at(0.2, 0.1, 1.2))
    assert done.status is ExecutionStatus.DONE
    assert np.linalg.norm(done.position[-1] - [0.2, 0.1, 1.2]) < 2e-4
    assert not done.correction.any()


def test_a_link_of_another_robot_is_refused() -> None:
    machine = Machine(prototype(), start=HOME, seed=1)
    with refused("link", "of 6 winches", kind=sl.InvalidValueError):
        Controller(prototype(), _short(machine), seed=2)
    with pytest.raises(sl.InvalidValueError, match="drum_radius"):
        Controller(sl.load_robot("cogiro"), machine.link(), seed=2)


@pytest.mark.parametrize("period", [0.005, 0.02])
def test_plcs_of_another_period_are_refused(period: float) -> None:
    """With 5 ms the platform followed a path of 10 ms per row at double speed."""
    machine = Machine(prototype(), start=HOME, seed=1, period=period)
    with refused("link", f"of PLCs with a period of {1e3 * period:g} ms", kind=sl.InvalidValueError) as caught:
        Controller(prototype(), machine.link(), seed=2)
    assert "10 ms" in caught.value.allowed
    control = Controller(prototype(), machine.link(), seed=2, pace=Pace(period))
    assert control.period == period


def _short(machine: Machine) -> Any:
    link = Spy(machine.link())
    link.groups = link.groups[:3]
    return link


def test_samples_of_an_execution_are_the_received_ones() -> None:
    control, _ = rig(imperfect())
    done = control.go_to(at(0.02, 0.0, 1.5))
    answers = [answer for answer in spy_of(control).answers if isinstance(answer, Sample)][-len(done) :]
    for k in (0, len(done) - 1):
        for kept, given in zip(done.samples.at(k)[:-1], answers[k][:-1], strict=True):  # all except the reasons
            assert np.array_equal(kept, given)  # type: ignore[arg-type]
