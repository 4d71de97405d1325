"""Faults as texts, and their effects in a controller."""

from __future__ import annotations

import math

import numpy as np
import pytest

import sagline as sl
from sagline.control import Mode, Sample
from sagline.twin.injected import KINDS, Injected, TimedQueue, fault
from tests.control.protocol import PERIOD, GroupFault, GroupStatus, WinchState
from tests.refusal import refused
from tests.tiers import wide
from tests.twin.pilot import HOME, Pilot, leg

ROBOT = sl.load_robot("article-prototype")
PLAN = sl.inverse(ROBOT, HOME)


@pytest.mark.parametrize("name", KINDS)
def test_a_fault_is_its_text(name: str) -> None:
    kind = KINDS[name]
    value = 2.5 * kind.scale if "#" in name else 0.0
    ends = (math.inf,) if kind.for_good else (math.inf, 0.25)
    for duration in ends:
        for time in (0.0, 40.125):
            given = Injected(name, 3 if kind.numbered else 0, value, time, duration)
            read = fault(str(given))
            assert (read.kind, read.which, read.time, read.duration) == (name, given.which, time, duration)
            assert read.value == pytest.approx(value, rel=1e-12)
            assert str(read) == str(given)
    if kind.for_good:
        with refused("fault", kind=sl.InvalidValueError) as caught:
            fault(f"{given} for 2 s")
        assert "no duration" in caught.value.allowed


def test_defaults_of_omitted_parts() -> None:
    assert fault("  Cell 3   STICKS ") == Injected("cell sticks", 3)
    later, negative = fault("cable 4 breaks at 1e1 s"), fault("encoder 5 jumps by -2 mm at 40 s")
    assert (later.time, negative.value) == (10.0, -0.002)


ITEMS = ("cable", "cell", "commands", "emergency stop", "encoder", "group", "load", "servo")
CELL = ("cell NUMBER", "sticks", "reads # N", "saturates", "fails", "is wrong by # N")
SECONDS = ("number", " s")
WRONG: dict[str, tuple[str, ...]] = {  # in the allowed values of the message
    "cel 3 sticks": ITEMS,
    "": ITEMS,
    "cell 3": CELL,
    "cell sticks": CELL,
    "cell 3 melts": CELL,
    "cell x sticks": CELL,
    "cell -1 sticks": CELL,
    "cell 3 sticks at dawn": CELL,
    "cell 3 sticks at dawn s": SECONDS,
    "cell 3 sticks at -1 s": (">= 0 s",),
    "cell 3 sticks at nan s": SECONDS,
    "cell 3 sticks at 1 s for 0 s": ("duration", "> 0 s"),
    "cell 3 is wrong by much N": ("number", " N"),
    "cell 3 is wrong by 50": CELL,
    "cell 3 is wrong by 1_0 N": ("number", " N"),
    "cell ٣ sticks": CELL,
    "commands 3 stop": ("commands", "stop", "repeat"),
    "emergency stop now": ("emergency stop",),
    "group 2 is loud\x1b[31m": ("group NUMBER", "is silent", "repeats"),
    "x" * 5000: ITEMS,
}


@pytest.mark.parametrize("text", WRONG)
def test_an_invalid_text_is_refused_with_the_allowed_values(text: str) -> None:
    with refused("fault", kind=sl.InvalidValueError) as caught:
        fault(text)
    assert [part for part in WRONG[text] if part not in caught.value.allowed] == []
    line = str(caught.value)
    assert len(line) < 300
    assert line.isprintable()


def test_the_nearest_item_is_proposed() -> None:
    with refused("fault", "'cel 3 sticks'", next_step="Did you mean cell?"):
        fault("cel 3 sticks")


@pytest.mark.parametrize("given", [None, 3, b"cell 3 sticks", ["cell 3 sticks"]])
def test_an_empty_text(given: object) -> None:
    with refused("fault", allowed="a text", kind=sl.InvalidValueError):
        fault(given)  # type: ignore[arg-type]
    with refused("fault", kind=sl.InvalidValueError):
        sl.twin.Machine(ROBOT).inject(given)  # type: ignore[arg-type]


def test_mutilated_texts_are_read_or_refused_in_one_line() -> None:
    generator = np.random.default_rng(1)
    words = [word for name in KINDS for word in name.split()] + ["at", "for", "s", "3", "-2", "1e400", "", "é", "\0"]
    lines = []
    for _ in range(500):
        text = " ".join(generator.choice(words, generator.integers(0, 9)))
        try:
            fault(text)
        except sl.InvalidValueError as error:
            lines.append(str(error))
    assert len(lines) > 400
    assert all(len(line) < 300 and line.isprintable() for line in lines)


def test_items_of_a_queue_are_due_in_order_of_time_and_then_of_addition() -> None:
    queue = TimedQueue()
    for time, item in ((2.0, "c"), (1.0, "b"), (1.0, "a"), (3.0, "d")):
        queue.add(time, item)
    assert queue.due(2.0 - 1e-10) == [(1.0, "b"), (1.0, "a"), (2.0, "c")]
    assert queue.waiting
    assert queue.due(9.0) == [(3.0, "d")]
    assert not queue.waiting


def test_faults_of_a_machine_begin_and_end_at_their_times() -> None:
    rig = sl.twin.Machine(ROBOT, seed=2, faults=["load grows by 2 kg at 0.02 s for 0.03 s"])
    weights = []
    for _ in range(7):
        rig.advance()
        weights.append(float(rig._hardware._weight[2]))
    assert [weight < 0.0 for weight in weights] == [False, False, True, True, True, False, False]


def run(text: str, seconds: float = 0.6, *, moving: bool = True) -> tuple[sl.twin.Machine, list[Sample], list[Sample]]:
    """Samples before a fault that begins at 0.3 s, and from then on."""
    rig = sl.twin.Machine(ROBOT, seed=2, faults=[f"{text} at 0.3 s"] if " at " not in text else [text])
    pilot = Pilot(rig.link(), leg(ROBOT, 0.3))
    pilot.hold(0.1)
    pilot.at = 400
    pilot.length = pilot.length - pilot.length[400] + pilot.length[0]  # as fast as in the middle, from here on
    go = pilot.go if moving else pilot.hold
    return rig, go(0.2), go(seconds)


def test_a_constant_load_cell() -> None:
    _, before, after = run("cell 3 sticks")
    assert {sample.tension[3] for sample in after} == {before[-1].tension[3]}
    assert len({sample.tension[2] for sample in after}) == len(after)


@pytest.mark.parametrize(
    ("words", "reads"), wide([("reads -12.5 N", -12.5), ("saturates", 2500.0), ("reads 0 N", 0.0)], first=2)
)
def test_a_wrong_reading_of_a_load_cell(words: str, reads: float) -> None:
    _, before, after = run(f"cell 6 {words} at 0.3 s for 0.1 s")
    assert [sample.tension[6] for sample in after[:10]] == [reads] * 10
    assert abs(after[10].tension[6] - before[-1].tension[6]) < 30.0
    filtered = before[-1].filtered[6] + (reads - before[-1].filtered[6]) * 0.01 / 0.06
    assert after[0].filtered[6] == pytest.approx(filtered)


def test_a_load_cell_that_fails_and_recovers() -> None:
    _, before, after = run("cell 6 fails at 0.3 s for 0.1 s", moving=False)
    read = np.array([(sample.tension[6], sample.filtered[6]) for sample in after])
    assert np.isnan(read[:10]).all()
    assert np.abs(read[10:] - before[-1].tension[6]).max() < 30.0
    assert np.isfinite([np.delete(sample.tension, 6) for sample in after]).all()


def test_an_offset_of_a_load_cell() -> None:
    right = run("cell 1 is wrong by 0 N", moving=False)[2]
    wrong = run("cell 0 is wrong by 50 N", moving=False)[2]
    np.testing.assert_allclose([a.tension[0] - b.tension[0] for a, b in zip(wrong, right, strict=True)], 50.0)


def test_a_broken_cable() -> None:
    rig, before, after = run("cable 4 breaks", 1.0, moving=False)
    assert before[-1].tension[4] > 100.0
    assert np.abs([sample.tension[4] for sample in after]).max() < 6.0  # noise
    assert np.linalg.norm(rig.reading.position - HOME.position) > 0.02
    others = np.delete(np.array([sample.tension for sample in after]), 4, axis=1)
    assert others.max() > 1.3 * before[-1].tension.max()


def test_a_jump_of_an_encoder_moves_its_cable() -> None:
    rig, before, after = run("encoder 5 jumps by 2 mm", 2.0, moving=False)
    first = after[0].length - before[-1].length
    np.testing.assert_allclose(first[5], 0.002, atol=6e-4)  # its drive, of 20 /s, is on its way back already
    np.testing.assert_allclose(np.delete(first, 5), 0.0, atol=1e-4)
    # friction of 15 N holds the last tenth of a millimeter for seconds, until the integral of 8 kN/m overcomes it
    assert after[-1].length[5] == pytest.approx(before[-1].length[5], abs=1.5e-4)
    assert rig.reading.length[5] == pytest.approx(PLAN.unstrained_length[5] - 0.002, abs=1.5e-4)
    assert (after[-1].fault == 0).all()


def test_a_servo_at_its_limit() -> None:
    """Friction of 15 N holds what is left of 162 N, or it does not."""
    _, before, after = run("servo 3 is limited to 150 N", 1.0, moving=False)
    assert (before[-1].state == WinchState.ENABLED).all()
    assert {int(sample.state[3]) for sample in after} == {WinchState.SATURATED}
    assert (after[-1].fault == 0).all()
    assert np.abs(after[-1].length - before[-1].length).max() < 1e-4
    _, before, after = run("servo 3 is limited to 20 N", 1.0, moving=False)
    assert np.abs([sample.torque[3] for sample in after]).max() <= 20.0 * 0.03 / 20 * (1 + 1e-12)
    faults = np.array([sample.fault for sample in after])
    assert np.unique(faults[:, 1]).tolist() == [0, GroupFault.FOLLOWING_ERROR]
    assert (faults[:, [0, 2, 3]] == 0).all()
    assert np.ptp(np.flatnonzero(faults[:, 1])) >= 9  # 100 ms, so that it is in a sample


def test_a_tripped_servo() -> None:
    rig, _, after = run("servo 3 trips")
    last = after[-1]
    assert (last.state[3], last.winch_fault[3], last.fault[1]) == (WinchState.FAULT, 1, GroupFault.DRIVE)
    assert last.torque[3] == 0.0
    assert np.ptp([sample.length[3] for sample in after]) < 72e-9
    rig.reset()
    assert Pilot(rig.link(), PLAN).look().winch_fault.tolist() == [0] * 8


def test_a_growing_load_is_carried() -> None:
    damped = sl.Damping(loss_time=0.05)
    rig = sl.twin.Machine(ROBOT, damping=damped, faults=["load grows by 10 kg at 0.5 s for 3 s"])
    pilot = Pilot(rig.link(), PLAN)
    pilot.hold(3.5)
    weight = [0.0, 0.0, -10.0 * ROBOT.gravity, 0.0, 0.0, 0.0]
    loaded = sl.forward(ROBOT, PLAN.unstrained_length, start=HOME, wrench=weight)
    np.testing.assert_allclose(rig.reading.position, loaded.pose.position, atol=2e-4)
    assert loaded.pose.position[2] < 1.5 - 0.005
    pilot.hold(3.0)
    np.testing.assert_allclose(rig.reading.position, HOME.position, atol=2e-4)


def test_an_emergency_stop() -> None:
    rig, _, after = run("emergency stop")
    assert (after[0].status == GroupStatus.EMERGENCY | GroupStatus.LOCKED | GroupStatus.BRAKED).all()
    assert (after[0].fault == GroupFault.EMERGENCY_STOP).all()
    assert (after[-1].state == WinchState.LOCKED).all()
    assert np.ptp([sample.length for sample in after], axis=0).max() < 72e-9
    rig.reset()
    pilot = Pilot(rig.link(), PLAN)
    pilot.counter = 1000
    assert (pilot.hold(0.05)[-1].status == GroupStatus.READY).all()


@pytest.mark.parametrize(
    "words", wide(["repeats", "is silent", "goes back", "is torn", "is foreign", "stops"], first=2)
)
def test_a_group_without_new_data(words: str) -> None:
    _, before, after = run(f"group 2 {words} at 0.3 s for 0.12 s")
    ages = np.array([sample.age for sample in after])
    np.testing.assert_allclose(ages[:12, 2], PERIOD * np.arange(1, 13), atol=1e-9)
    np.testing.assert_allclose(np.delete(ages, 2, axis=1), 0.0, atol=1e-9)
    assert {sample.counter[2] for sample in after[:12]} == {before[-1].counter[2]}
    assert {float(sample.length[4]) for sample in after[:12]} == {float(before[-1].length[4])}
    discarded = 0 if words == "is silent" else 12
    assert after[-1].discarded.tolist() == [0, 0, discarded, 0]
    assert [reason is not None for reason in after[-1].reasons] == [False, False, discarded > 0, False]
    if words == "repeats":
        assert np.abs(ages[12:, 2]).max() < 1e-9
    assert after[-1].counter[2] > before[-1].counter[2]


def test_a_stopped_plc_restarts_with_its_brakes_on() -> None:
    rig, before, after = run("group 2 stops at 0.3 s for 0.2 s")
    assert before[-1].owner[2] == 77
    assert np.linalg.norm(before[-1].rate[4:6]) > 0.1
    restarted = after[20]
    assert (restarted.owner[2], restarted.echo[2]) == (0, 0)
    assert restarted.status[2] == GroupStatus.READY | GroupStatus.BRAKED
    assert np.abs(after[22].length - before[-1].length)[4:6].max() < 1e-6
    assert rig.time == pytest.approx(0.9)


def test_repeated_and_reordered_blocks_have_no_effect() -> None:
    _, _, twice = run("group 2 doubles")
    assert np.abs([sample.age for sample in twice]).max() < 1e-9
    assert twice[-1].discarded.tolist() == [0, 0, 60, 0]
    _, _, swapped = run("group 2 swaps")
    ages = np.array([sample.age[2] for sample in swapped])
    np.testing.assert_allclose(ages, np.tile([PERIOD, 0.0], 30), atol=1e-9)
    assert swapped[-1].discarded.tolist() == [0, 0, 30, 0]
    assert "repeated" in str(twice[-1].reasons[2])
    assert "older" in str(swapped[-1].reasons[2])


@pytest.mark.parametrize("words", wide(["are foreign", "stop", "repeat", "are torn"], first=2))
def test_missing_commands_are_treated_as_a_dead_controller(words: str) -> None:
    _, before, after = run(f"commands {words}")
    assert {int(sample.echo[0]) for sample in after} == {int(before[-1].echo[0])}
    holds = [bool((sample.status & GroupStatus.HOLDING).all()) for sample in after]
    assert holds.index(True) == 28  # in the block 300 ms after the last command
    assert (after[-1].fault == GroupFault.HEARTBEAT).all()


def test_a_grant_taken_by_another_controller() -> None:
    _, before, after = run("group 1 is taken at 0.3 s for 0.4 s", 1.0)
    assert before[-1].owner.tolist() == [77] * 4
    assert after[0].owner[1] not in (0, 77)
    assert after[0].owner[[0, 2, 3]].tolist() == [77] * 3
    assert after[0].fault[1] == GroupFault.HEARTBEAT
    assert after[25].status[1] & GroupStatus.HOLDING
    assert after[-1].owner.tolist() == [77] * 4  # it left, and the pilot claims in every cycle


def test_faults_of_missing_parts_are_refused() -> None:
    rig = sl.twin.Machine(ROBOT)
    for text, says in (
        ("cell 8 sticks", "cell 0 to 7"),
        ("group 4 stops", "group 0 to 3"),
        ("cable 9 breaks", "0 to 7"),
    ):
        with pytest.raises(sl.InvalidValueError, match=says):
            rig.inject(text)


def test_a_fault_from_the_past_happens_at_once() -> None:
    rig = sl.twin.Machine(ROBOT)
    pilot = Pilot(rig.link(), PLAN)
    pilot.hold(0.1)
    rig.inject("emergency stop at 0.02 s")
    assert pilot.send(Mode.HOLD).status[0] & GroupStatus.EMERGENCY


@pytest.mark.parametrize(
    ("text", "again", "foreign"), [("group 0 is torn", True, False), ("group 0 is foreign", False, True)]
)
def test_a_server_shows_invalid_blocks(text: str, again: bool, foreign: bool) -> None:
    rig = sl.twin.Machine(ROBOT, faults=[text])
    rig.advance()
    report, good = rig.report(0), rig.report(1)
    assert report is not None
    assert good is not None
    assert (report.counter_again != report.counter, report.foreign) == (again, foreign)
    assert (good.counter_again, good.foreign) == (good.counter, False)


@pytest.mark.parametrize("words", ["is silent", "repeats", "goes back", "stops"])
def test_a_server_keeps_an_old_block(words: str) -> None:
    rig = sl.twin.Machine(ROBOT, faults=[f"group 1 {words}"])
    rig.advance()
    assert [rig.report(group) is None for group in range(4)] == [False, True, False, False]
