"""The experiment of ten points on a twin: in one process, with single errors of the machine, and over S7."""

from __future__ import annotations

import re
import time
from pathlib import Path

import numpy as np
import pytest

import sagline as sl
from sagline.article.experiment import (
    BIAS,
    PROTOTYPE,
    STOP,
    Experiment,
    StopObserver,
    duration,
    experiment,
    in_process,
    points,
    with_cells,
)
from sagline.article.explanations import ANCHORS, DRUM, LOAD, MODULUS, ZERO, Errors, robot_with_errors
from sagline.article.ten_poses import HOME
from sagline.control import Controller, EventKind, RefusedError, TensionSettings
from tests.refusal import refused
from tests.tiers import extended

ROBOT = sl.load_robot(PROTOTYPE)
OFF = TensionSettings(gain=0.0)
CLASSES: dict[str, Errors] = {
    "Young's modulus E +20 %": {MODULUS: 20.0},
    "load +2 kg": {LOAD: 2.0},
    "anchor height +17.4 mm": {ANCHORS: 17.4},
    "drum radius -1 %": {DRUM: -1.0},
    "zero of the lengths -6.5 mm": {ZERO: -6.5},
}
PAGE = Path(__file__).parents[2] / "docs" / "experiment.md"


def pair(robot: sl.Robot, errors: Errors) -> tuple[sl.Robot, sl.Robot]:
    """The robot with errors, and the robot of the plan, both with the data that a twin needs."""
    true, nominal = robot_with_errors(robot, errors), robot
    assert true.winches is not None
    assert robot.winches is not None
    if errors.get(DRUM):
        radius = robot.winches.drum_radius
        assert radius is not None
        true = true.replace(winches=true.winches.replace(drum_radius=radius * (1.0 + 0.01 * errors[DRUM])))
    if errors.get(ZERO):
        assert true.winches is not None
        zero = sl.inverse(robot, sl.Pose(HOME)).unstrained_length
        nominal = robot.replace(winches=robot.winches.replace(length_zero=zero))
        true = true.replace(winches=true.winches.replace(length_zero=zero + 1e-3 * errors[ZERO]))
    return true, nominal


@extended
def test_the_experiment_in_one_process(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """One run for all checks: it takes as long as all other tests of this file together."""
    from tests.article import experiment_page

    whole = in_process()
    a_machine_as_it_was_planned_is_where_it_should_be(whole)
    it_takes_as_long_as_the_article_s(whole)
    load_cells_are_off_by_their_noise_and_bias_alone(whole)
    time_courses_are_those_of_the_plan_without_the_stops(whole)
    experiment_page.every_number_in_a_sentence_is_one_of_the_numbers_of_its_finding(whole, tmp_path)
    experiment_page.the_table_has_the_errors_of_the_article_and_of_the_run(whole)
    experiment_page.the_page_is_self_contained_and_its_numbers_are_in_a_file(whole, tmp_path)
    experiment_page.the_command_writes_the_page_and_prints_the_table(whole, tmp_path, monkeypatch)


def a_machine_as_it_was_planned_is_where_it_should_be(whole: Experiment) -> None:
    assert whole.distance.max() <= 0.05e-3
    assert whole.distance.max() <= 0.002e-3
    assert np.linalg.norm(whole.back) <= 0.01e-3
    np.testing.assert_array_equal(whole.error, whole.true - whole.table.desired)
    assert np.linalg.norm(whole.estimated - whole.true, axis=1).max() <= 0.05e-3
    assert whole.farthest <= 0.4e-3
    text = PAGE.read_text()
    assert "below 0.002 mm" in text
    assert "below 0.4 mm" in text


def it_takes_as_long_as_the_article_s(whole: Experiment) -> None:
    assert whole.duration / 60.0 == pytest.approx(13.9, abs=0.05)
    assert whole.duration == pytest.approx(duration(), abs=0.5)
    assert 1e3 * whole.winch_speed == pytest.approx(61.0, abs=0.5)
    assert not [event.text for event in whole.events if event.kind is not EventKind.STATE]


def load_cells_are_off_by_their_noise_and_bias_alone(whole: Experiment) -> None:
    bias = with_cells(ROBOT).winches
    assert bias is not None
    np.testing.assert_array_equal(np.abs(bias.load_cell_bias), BIAS)
    off = whole.tension - whole.planned_tension
    np.testing.assert_allclose(off, np.tile(bias.load_cell_bias, (10, 1)), atol=0.6)  # mean over a second, and stiction
    # the part that lengths can correct: projection onto the null space of the lengths, from the stiffness
    here = sl.stiffness(sl.inverse(ROBOT, sl.Pose(whole.table.desired[3])).state)
    slope = here.tension_sensitivity @ here.null_lengths
    seen = slope @ np.linalg.lstsq(slope, off[3])[0]
    assert whole.null_error[3] == pytest.approx(np.abs(seen).max(), rel=0.05)
    assert whole.null_error.max() <= 1.5 + BIAS


def time_courses_are_those_of_the_plan_without_the_stops(whole: Experiment) -> None:
    assert (np.diff(whole.time) > 0.0).all()
    assert whole.time[-1] == pytest.approx(duration() - 12 * STOP, abs=0.2)
    assert (np.diff(whole.stops) > 0.0).all()
    assert np.abs(whole.cells - whole.planned).max() <= 10.0
    home = sl.inverse(ROBOT, sl.Pose(HOME)).unstrained_length
    path = sl.quintic_path(points(), speed=0.06, rate=10.0)
    lengths = sl.inverse(ROBOT, path).unstrained_length - home
    planned = np.stack([np.interp(whole.time, path.time, column) for column in lengths.T], axis=1)
    assert (
        np.abs(whole.lengths - planned).max() <= 4 * 0.01 * whole.winch_speed
    )  # delay of encoders, rounding at eleven stops


@extended
def test_a_cable_break_ends_the_experiment_with_place_and_reason() -> None:
    twin = sl.twin.Machine(ROBOT, start=sl.Pose(HOME), faults=[f"cable 2 breaks at {STOP + 4.0:g} s"])
    watch = StopObserver(lambda: twin.reading.position)
    with refused("the experiment, on the way to P1", kind=RefusedError) as caught:
        experiment(Controller(ROBOT, twin.link(), record=watch, seed=1), watch)
    assert len(str(caught.value)) < 300


def test_errors_of_drums_and_zeros_of_a_pair_are_applied() -> None:
    true, nominal = pair(ROBOT, {DRUM: -1.0, ZERO: -6.5})
    assert true.winches is not None
    assert nominal.winches is not None
    assert nominal.winches.drum_radius is not None
    assert true.winches.length_zero is not None
    assert nominal.winches.length_zero is not None
    assert true.winches.drum_radius == pytest.approx(0.99 * nominal.winches.drum_radius, rel=1e-12)
    assert true.winches.length_zero - nominal.winches.length_zero == pytest.approx(-6.5e-3, rel=1e-9)
    twin = sl.twin.Machine(true, nominal=nominal, start=sl.Pose(HOME))
    shorter = sl.inverse(ROBOT, sl.Pose(HOME)).unstrained_length - 6.5e-3
    expected = sl.forward(ROBOT, shorter, start=sl.Pose(HOME)).pose.position
    np.testing.assert_allclose(twin.reading.position, expected, atol=1e-6)


@pytest.mark.soak
@pytest.mark.parametrize("name", CLASSES)
def test_the_tension_loop_does_not_correct_the_position_error(name: str) -> None:
    true, nominal = pair(ROBOT, CLASSES[name])
    off, on = (in_process(true, nominal, loop=loop) for loop in (OFF, None))
    assert 1e3 * np.abs(on.distance - off.distance).max() <= 0.1
    rows = re.findall(r"^\| (.*?) \| ([\d.]+) mm \| ([\d.]+) mm \|$", PAGE.read_text(), re.MULTILINE)
    assert [row[0] for row in rows] == list(CLASSES)
    told = next(row[1:] for row in rows if row[0] == name)
    for text, found in zip(told, (off, on), strict=True):
        assert 1e3 * found.distance.mean() == pytest.approx(float(text), abs=0.1)


@pytest.mark.soak
def test_the_loop_removes_zero_errors_from_tensions_without_motion() -> None:
    zero = sl.inverse(ROBOT, sl.Pose(HOME)).unstrained_length
    wrong = np.random.default_rng(3).normal(size=8)
    wrong *= 2e-3 / np.sqrt(np.mean(wrong**2))
    assert ROBOT.winches is not None
    nominal, true = (
        ROBOT.replace(winches=ROBOT.winches.replace(length_zero=length)) for length in (zero, zero + wrong)
    )
    off, on = (in_process(true, nominal, loop=loop) for loop in (OFF, None))
    assert on.null_error.mean() <= 1.5
    assert on.null_error.max() <= TensionSettings().act_above  # threshold of the loop
    assert off.null_error.mean() > 4.0
    assert np.linalg.norm(on.true - off.true, axis=1).max() <= 0.05e-3
    assert np.linalg.norm(on.back) <= 0.05e-3  # no drift in 14 minutes
    assert on.acting <= 0.05


@pytest.mark.soak
def test_the_experiment_runs_over_s7_in_real_time() -> None:
    from sagline.cli.article import _apart_over_s7

    begun = time.perf_counter()
    found = _apart_over_s7(ROBOT, ROBOT, 1, lambda share: None)
    assert (time.perf_counter() - begun) / 60.0 == pytest.approx(13.9, abs=0.6)
    assert found.distance.max() <= 0.05e-3
