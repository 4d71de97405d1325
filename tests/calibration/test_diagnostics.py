"""The diagnostics name the mistakes in logs, and logs without mistakes raise none, for any error of the drawing."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest

import sagline as sl
from sagline.calibration.diagnostics import diagnose_log
from tests.calibration.mistakes import (
    MISTAKES,
    Maker,
    commanded_in_millimeters,
    customary_units,
    deviations_in_millimeters,
    far_zero,
    kilonewtons,
    late_cells,
    millimeters,
    positions_in_millimeters,
    swapped_cables,
    swapped_cells,
    swapped_encoders,
)
from tests.calibration.synthetic import USUAL, log_of, true_robot, usual_sensors, with_drums
from tests.refusal import refused
from tests.tiers import extended, wide

EXAMPLES = Path(__file__).parents[2] / "examples"
SENSORS = usual_sensors(position_deviation=1e-3)
ROBOTS = (
    with_drums(),
    sl.load_robot("cogiro"),
    with_drums(pulley_radius=0.05, dead_cable=3.0, gear=np.array([10.0, -10.0] * 4), count_zero=1e5),
)
MORE_ERRORS = {**USUAL, "platform_anchors": 0.01, "drum_radius": 0.01, "load_cell_gain": 0.01, "load_cell_bias": 10.0}


class FaultlessLog(NamedTuple):
    """A log without mistakes, its name, and the robot of the drawing."""

    name: str
    robot: sl.Robot
    log: sl.WinchLog


def faultless_logs(count: int, anchors: float) -> Iterator[FaultlessLog]:
    """Logs of robots with anchor errors of the given size [m]."""
    for seed in range(count):
        rng = np.random.default_rng((seed, int(1e3 * anchors)))
        robot = ROBOTS[int(rng.integers(len(ROBOTS)))]
        usual = MORE_ERRORS if robot.winches is not None and rng.random() < 0.3 else USUAL
        truth = true_robot(robot, {**usual, "frame_anchors": anchors}, seed, sensors=SENSORS)
        rows, sets, positions = int(rng.choice([20, 60])), int(rng.choice([1, 4])), int(rng.choice([0, 5]))
        log = log_of(truth, rows, seed, sets=sets, positions=positions).log
        if rng.random() < 0.3:
            log = log.replace(commanded=None)
        yield FaultlessLog(f"{robot.name}, seed {seed}: {log}", robot, log)


@pytest.mark.parametrize(
    ("count", "anchors"),
    [
        (2, 0.5),
        pytest.param(10, 0.05, marks=extended),
        pytest.param(100, 0.05, marks=pytest.mark.soak),
        pytest.param(100, 0.5, marks=pytest.mark.soak),
    ],
)
def test_faultless_logs_raise_no_diagnostic(count: int, anchors: float) -> None:
    alarms = {name: told for name, robot, log in faultless_logs(count, anchors) if (told := diagnose_log(robot, log))}
    assert alarms == {}


def wrong_diagnostics(makers: tuple[Maker, ...], seeds: range) -> list[str]:
    """Cases in which the diagnostics are not exactly the mistake."""
    wrong = []
    for seed in seeds:
        robot = ROBOTS[seed % 2]
        truth = true_robot(robot, USUAL, seed, sensors=SENSORS)
        log = log_of(truth, 60, seed, positions=4).log
        for make in makers:
            if make is millimeters and log.counts is not None:
                continue
            made = make(log, robot, np.random.default_rng(seed))
            told = diagnose_log(robot, made.log)
            if len(told) != 1 or not all(words in told[0] for words in made.told) or len(told[0]) > 220:
                wrong.append(f"{make.__name__}, seed {seed}: {made.told} but {told}")
    return wrong


def test_wrong_units_of_readings_are_recognized() -> None:
    units = (millimeters, positions_in_millimeters, commanded_in_millimeters, deviations_in_millimeters, kilonewtons)
    assert wrong_diagnostics((*units, far_zero), range(4)) == []
    assert wrong_diagnostics((customary_units,), range(2)) == []


@pytest.mark.parametrize("make", wide(MISTAKES[:6]), ids=lambda make: make.__name__)
def test_a_mistake_is_recognized(make: Maker) -> None:
    assert wrong_diagnostics((make,), range(1, 2)) == []


@pytest.mark.soak
@pytest.mark.parametrize("make", MISTAKES, ids=lambda make: make.__name__)
def test_all_mistakes_are_recognized(make: Maker) -> None:
    assert wrong_diagnostics((make,), range(40)) == []


@pytest.mark.soak
@pytest.mark.parametrize("make", [swapped_encoders, swapped_cables, swapped_cells, late_cells])
def test_mistakes_are_recognized_without_commanded_poses(make: Maker) -> None:
    robot = ROBOTS[0]
    log = log_of(true_robot(robot, USUAL, 5), 60, 5).log.replace(commanded=None)
    made = make(log, robot, np.random.default_rng(5))
    (told,) = diagnose_log(robot, made.log)
    assert all(words in told for words in made.told), told


@extended
def test_a_mistake_is_recognized_in_a_log_with_excluded_rows() -> None:
    """Rows keep their numbers: late cells are late in the whole log."""
    robot = ROBOTS[0]
    log = log_of(true_robot(robot, USUAL, 3), 60, 3).log
    made = late_cells(log, robot, np.random.default_rng(3))
    cells = made.log.load_cells
    assert cells is not None
    gaps = cells.copy()
    gaps[[3, 17, 18, 40], 2] = np.nan
    (told,) = diagnose_log(robot, made.log.replace(load_cells=gaps))
    assert all(words in told for words in made.told), told


@pytest.mark.parametrize("changes", [{"load_cells": None}, {"load_cells": None, "commanded": None}])
def test_lengths_alone_raise_no_diagnostic(changes: dict[str, Any]) -> None:
    robot = ROBOTS[1]
    log = log_of(true_robot(robot, USUAL, 3), 20, 3).log.replace(**changes)
    assert diagnose_log(robot, log) == ()
    assert diagnose_log(robot, log.rows(slice(0, 0))) == ()


def test_invalid_arguments_are_refused() -> None:
    log = log_of(true_robot(ROBOTS[1]), 4).log
    wrong: Any = "a log"
    for robot, given, model in (
        (ROBOTS[1], wrong, sl.Catenary()),
        (wrong, log, sl.Catenary()),
        (ROBOTS[1], log, wrong),
    ):
        with pytest.raises(sl.InvalidValueError):
            diagnose_log(robot, given, model)
    with refused("log", "of 8 cables", kind=sl.InvalidValueError):
        diagnose_log(sl.load_robot("falcon-7"), log)


def test_exchanged_load_cells_without_equilibrium_are_refused() -> None:
    robot, log = sl.load_robot(EXAMPLES / "winches_robot.yaml"), sl.load_log(EXAMPLES / "winches.csv")
    assert log.load_cells is not None
    cells = log.load_cells[:, [2, 1, 0, 3, 4, 5, 6, 7]]
    with refused("log", kind=sl.InvalidValueError) as caught:
        sl.calibrate(robot, log.replace(load_cells=cells), folds=0)
    assert "cables 0 and 2" in caught.value.value


def test_a_unit_that_makes_most_cables_seem_slack_is_recognized() -> None:
    """With load cells in kgf the screening omits 46 of 60 rows, and the remaining rows fit."""
    robot, log = sl.load_robot(EXAMPLES / "winches_robot.yaml"), sl.load_log(EXAMPLES / "winches.csv")
    assert log.load_cells is not None
    with pytest.raises(sl.InvalidValueError, match="kgf"):
        sl.calibrate(robot, log.replace(load_cells=log.load_cells / 9.80665), folds=0)
