"""Calibrations of known robots: correct values and correct standard errors."""

from collections.abc import Iterable
from functools import cache
from typing import NamedTuple

import numpy as np
import pytest

import sagline as sl
from sagline import InvalidValueError
from sagline.calibration import diagnostics, search
from sagline.calibration.parameters import parameters_of
from sagline.core.arrays import Array
from tests.calibration.synthetic import (
    LENGTH_NOISE,
    TENSION_NOISE,
    Truth,
    log_of,
    true_robot,
    usual_sensors,
    with_drums,
)
from tests.refusal import refused
from tests.tiers import extended, wide

COGIRO = with_drums()
ALL = {  # plausible errors of the 63 parameters of a drawing
    "frame_anchors": 0.02,
    "platform_anchors": 0.005,
    "length_zero": 0.03,
    "drum_radius": 0.005,
    "linear_density": 0.05,
    "axial_stiffness": 0.1,
    "mass": 0.03,
    "center_of_mass": 0.02,
}
SLIP = 0.02  # m
NO_POSE = ("without a pose that explains the readings", "at least one")


def unknowns(errors: dict[str, float]) -> list[sl.Unknown]:
    return [sl.Unknown(name, deviation=error) for name, error in errors.items()]


def errors_of_values(found: sl.Calibration, truth: Truth) -> Array:
    """Errors of the values, (P,)."""
    names = tuple(dict.fromkeys(found.parameters.names))
    really = parameters_of(truth.robot, names, truth.sensors, counted=True)
    assert really.labels == found.parameters.labels
    return np.asarray(found.values - really.prior)


class Covered(NamedTuple):
    """Shares of true values in one and two standard errors, mean squared Mahalanobis distance, missed slips.

    Attributes:
        one: Within one.
        two: Within two.
        mahalanobis: Mean square.
        unseen: Poses with a slip that is not found as an outlier.
        misnamed: Outliers with another cable than the slipped one.
        wrong: Outliers that are none.
        doubtful: How many did not end FOUND.
    """

    one: float
    two: float
    mahalanobis: float
    unseen: int
    misnamed: int
    wrong: int
    doubtful: int


@cache
def covered(robots: int, slips: int = 0, *, robust: bool = True) -> Covered:
    inside, distances, unseen, misnamed, wrong, doubtful = [], [], 0, 0, 0, 0
    for seed in range(robots):
        rng = np.random.default_rng(seed)
        rows = [int(row) for row in rng.choice(60, slips, replace=False)]
        slipped = {(row, int(rng.integers(8))): SLIP * float(rng.choice([-1.0, 1.0])) for row in rows}
        truth = true_robot(COGIRO, ALL, seed)
        made = log_of(truth, 60, seed, slips=slipped)
        found = sl.calibrate(COGIRO, made.log, unknowns(ALL), folds=0, robust=robust)
        error = errors_of_values(found, truth)
        inside.append(np.abs(error) / found.standard_error)
        distances.append(error @ np.linalg.solve(found.covariance, error))
        named = {one.row: one.cable for one in found.outliers}
        unseen += sum(row not in named for row, _ in slipped)
        misnamed += sum(named.get(row) not in (cable, None) for row, cable in slipped)
        wrong += len(named.keys() - {row for row, _ in slipped})
        doubtful += found.status is not sl.CalibrationStatus.FOUND
    deviations = np.concatenate(inside)
    shares = float(np.mean(deviations < 1.0)), float(np.mean(deviations < 2.0))
    return Covered(*shares, float(np.mean(distances)), unseen, misnamed, wrong, doubtful)


@pytest.mark.parametrize(
    ("robots", "one", "two", "mahalanobis"),  # tolerances
    [
        (15, 0.06, 0.03, 8.6),
        pytest.param(60, 0.04, 0.02, 4.3, marks=extended),
        pytest.param(2000, 0.015, 0.007, 1.0, marks=pytest.mark.soak),
    ],
)
def test_standard_errors_cover_the_truth(robots: int, one: float, two: float, mahalanobis: float) -> None:
    found = covered(robots)
    assert abs(found.one - 0.683) < one
    assert abs(found.two - 0.954) < two
    assert abs(found.mahalanobis - 63.0) < mahalanobis
    assert found.doubtful <= 0.04 * robots


@pytest.mark.parametrize("robots", [pytest.param(10, marks=extended), pytest.param(200, marks=pytest.mark.soak)])
def test_slipped_cables_are_found_and_excluded(robots: int) -> None:
    found = covered(robots, slips=3)
    assert found.unseen == 0
    assert found.misnamed <= 0.01 * 3 * robots
    assert found.wrong <= max(1, 0.05 * robots)
    assert found.two >= 0.94
    plain = covered(robots, slips=3, robust=False)
    assert plain.two < 0.9


@pytest.mark.parametrize("trials", [20, pytest.param(200, marks=pytest.mark.soak)])
def test_few_poses_and_few_unknowns_converge(trials: int) -> None:
    """20 poses and 10 parameters with load cells and counts."""
    errors = {"length_zero": 0.05, "linear_density": 0.1, "axial_stiffness": 0.2}
    right = told = 0
    for seed in range(trials):
        truth = true_robot(COGIRO, errors, seed)
        found = sl.calibrate(COGIRO, log_of(truth, 20, seed).log, unknowns(errors), folds=0)
        error = errors_of_values(found, truth)
        good = float(error @ np.linalg.solve(found.covariance, error)) < 40.0  # probability of chi squared 10: 2e-5
        right += good
        told += good or found.status != sl.CalibrationStatus.FOUND
    assert told == trials
    assert right >= 0.95 * trials


@pytest.mark.parametrize("robots", [pytest.param(5, marks=extended), pytest.param(100, marks=pytest.mark.soak)])
def test_errors_of_half_a_meter_converge_to_the_global_minimum(robots: int) -> None:
    """The sum of squares has one minimum near the truth; a fit from the truth finds the same one."""
    errors = {"frame_anchors": 0.5, "length_zero": 0.1, "axial_stiffness": 0.1, "mass": 0.03, "center_of_mass": 0.02}
    reached = told = 0
    for seed in range(robots):
        truth = true_robot(COGIRO, errors, seed, usual_sensors(position_deviation=1e-3))
        made = log_of(truth, 60, seed, positions=60)
        found = sl.calibrate(COGIRO, made.log, unknowns(errors), folds=0)
        error = errors_of_values(found, truth)
        good = float(error @ np.linalg.solve(found.covariance, error)) < 3.0 * len(error)
        reached += good
        told += good or found.status != sl.CalibrationStatus.FOUND
    assert reached >= 0.95 * robots
    assert told == robots


def test_many_outlying_poses_make_the_result_doubtful() -> None:
    """Lengths of other poses in seven of sixty rows: they are outliers, with reduced weight or excluded."""
    truth = true_robot(COGIRO, ALL, 4)
    made = log_of(truth, 60, 4)
    counts = made.log.readings.copy()
    rows = np.arange(2, 58, 8)
    counts[rows] = counts[np.roll(rows, 1)]
    found = sl.calibrate(COGIRO, made.log.replace(counts=counts), unknowns(ALL), folds=0)
    assert len(found.left_out[sl.Omission.OTHER_EQUILIBRIUM]) == 4
    assert np.count_nonzero(found.weights < 0.5) == 3
    assert found.status == sl.CalibrationStatus.DOUBTFUL


@pytest.mark.parametrize("deviation", wide([1e6, 1e3, 1e9]))
def test_a_very_wide_prior_has_no_influence(deviation: float) -> None:
    """Priors of anchors, of which the readings determine all but four directions."""
    robot = sl.load_robot("cogiro")
    log = log_of(true_robot(robot, {"frame_anchors": 0.05, "mass": 0.03, "length_zero": 0.03}), 40).log
    wide, none = (
        sl.calibrate(robot, log, (sl.Unknown("frame_anchors", deviation=one), "mass", "length_zero"), folds=0)
        for one in (deviation, np.inf)
    )
    assert wide.status == sl.CalibrationStatus.FOUND
    for label in ("mass", "length_zero[3]"):
        assert wide.value_of(label) == pytest.approx(none.value_of(label), rel=1e-4)
    assert [one.name for one in wide.gauge] == [one.name for one in none.gauge]
    assert np.isinf(none.value_of("frame_anchors[0].x")[1])
    assert wide.value_of("frame_anchors[0].x")[1] > 0.3 * deviation
    # readings of 8 cells minus the determined parameters: 29 of 33, of which priors also determine 9
    assert none.degrees_of_freedom == 40 * 8 + 9 - (33 - 4)
    assert none.chi_squared == pytest.approx(wide.chi_squared, rel=1e-6)


@extended
@pytest.mark.parametrize(("radius", "least"), [(0.06, 0.01), (0.0, 0.0)])
def test_pulleys_are_estimated_for_a_robot_drawn_without_them(radius: float, least: float) -> None:
    bare = sl.load_robot("cogiro").replace(winches=sl.Winch())
    truth = true_robot(bare.replace(winches=sl.Winch(pulley_radius=radius)), {"mass": 0.03}, 3)
    asked = ("length_zero", "mass", sl.Unknown("pulley_radius", deviation=0.05))
    found = sl.calibrate(bare, log_of(truth, 40, 3).log, asked, folds=0)
    assert found.status == sl.CalibrationStatus.FOUND
    assert not found.gauge
    value, error = found.value_of("pulley_radius")
    assert abs(value - radius) < 2.5 * error
    assert error < 0.01
    assert value >= least


def test_a_log_without_a_fitting_pose_is_refused() -> None:
    """One pose, and only the mass may change."""
    robot = sl.load_robot("cogiro")
    log = log_of(true_robot(robot), 40).log.rows(slice(0, 1))
    with refused("log", *NO_POSE, kind=InvalidValueError):
        sl.calibrate(robot, log, ["mass"], folds=0)


def test_too_few_readings_are_refused() -> None:
    log = log_of(true_robot(COGIRO, ALL), 7).log
    with refused("log", "56 readings in 7 rows", ">= 63, one per unknown", kind=InvalidValueError):
        sl.calibrate(COGIRO, log, unknowns(ALL))


@pytest.mark.parametrize(
    ("changes", "unknown", "parts", "step"),
    [
        ({}, "frame_anchor", ("unknown", "'frame_anchor'"), "frame_anchors?"),
        ({}, "pulley_radius", ("unknown: pulley_radius", "no number of cogiro"), "winches: {pulley_radius: 0 m}"),
        ({}, "drum_radius", ("unknown: drum_radius", "observed by no reading", "counts in the log"), "counts"),
        (
            {"load_cells": None},
            "load_cell_gain",
            ("unknown: load_cell_gain", "observed by no reading", "load cells in the log"),
            "load cells",
        ),
    ],
)
def test_invalid_unknowns_give_a_next_step(
    changes: dict[str, None], unknown: str, parts: tuple[str, ...], step: str
) -> None:
    robot = sl.load_robot("cogiro")
    log = log_of(true_robot(robot, {}), 8).log.replace(**changes)
    with refused(*parts, kind=InvalidValueError) as caught:
        sl.calibrate(robot, log, ("mass", unknown))
    assert step in caught.value.next_step


def test_too_few_readings_are_counted_with_the_reason() -> None:
    log = log_of(true_robot(COGIRO, ALL), 9).log
    slack = np.array(log.load_cells)
    slack[2:, 3] = 0.0
    value = f"16 readings in 2 rows; 7 rows left out: {sl.Omission.SLACK.text}"
    with refused("log", value, ">= 63, one per unknown", kind=InvalidValueError):
        sl.calibrate(COGIRO, log.replace(load_cells=slack), unknowns(ALL))


@pytest.mark.parametrize(
    ("factor", "status"),
    [(0.7, sl.CalibrationStatus.DOUBTFUL), (1.0, sl.CalibrationStatus.FOUND), (1.5, sl.CalibrationStatus.FOUND)],
)
def test_chi_squared_too_large_is_doubtful_and_too_small_is_not(factor: float, status: sl.CalibrationStatus) -> None:
    """Stated deviations of the sensors as multiples of the true ones."""
    robot = sl.load_robot("cogiro")
    log = log_of(true_robot(robot, {"mass": 0.03}, 4), 40, 4).log
    believed = usual_sensors(length_deviation=factor * LENGTH_NOISE, tension_deviation=factor * TENSION_NOISE)
    found = sl.calibrate(robot, log.replace(sensors=believed), ("mass",), folds=0, robust=False)
    assert found.chi_squared / found.degrees_of_freedom == pytest.approx(factor**-2, rel=0.2)
    assert found.status is status
    assert ("better than" in str(found)) is (factor > 1.0)


@extended
def test_wrong_deviations_are_printed_first() -> None:
    truth = true_robot(COGIRO, ALL, 1)
    log = log_of(truth, 60, 1).log
    trusted = log.replace(sensors=usual_sensors(length_deviation=1e-4, tension_deviation=1.0))
    found = sl.calibrate(COGIRO, trusted, unknowns(ALL), folds=0)
    assert found.status == sl.CalibrationStatus.DOUBTFUL
    assert "chi squared" in str(found).splitlines()[0]


@pytest.mark.parametrize("rows", wide([20, 60]))
def test_a_log_of_another_wiring_is_refused_with_the_reason(rows: int) -> None:
    truth = true_robot(COGIRO, ALL, 1)
    log = log_of(truth, rows, 1).log
    swapped = log.readings.copy()
    swapped[:, [2, 5]] = swapped[:, [5, 2]]
    with refused("log", kind=InvalidValueError) as caught:
        sl.calibrate(COGIRO, log.replace(counts=swapped), unknowns(ALL), folds=0)
    assert "cables 2 and 5" in caught.value.value
    assert "count_2 and count_5" in caught.value.next_step


def test_poses_in_another_equilibrium_are_left_out_and_counted() -> None:
    """Two rows of a robot in another equilibrium at these lengths: its cables have other lengths."""
    truth = true_robot(COGIRO, ALL, 2)
    made = log_of(truth, 60, 2)
    counts = made.log.readings.copy()
    counts[[4, 9]] = counts[[9, 4]]  # lengths of other poses with the tensions of these
    found = sl.calibrate(COGIRO, made.log.replace(counts=counts), unknowns(ALL), folds=0)
    honest = sl.calibrate(COGIRO, made.log, unknowns(ALL), folds=0)
    out = {int(row) for rows in found.left_out.values() for row in rows}
    light = {int(row) for row, weight in zip(found.rows, found.weights, strict=True) if weight < 0.05}
    assert out | light == {4, 9}
    assert (np.abs(found.values - honest.values) / honest.standard_error).max() < 1.0


def test_a_log_without_a_valid_row_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    """As in the log of another robot: all residuals of poses are large, and the lengths give other positions."""
    log = log_of(true_robot(COGIRO, ALL, 2), 10, 2).log
    monkeypatch.setattr(search, "STRANGE", 1.0)
    monkeypatch.setattr(search, "FAR", -1.0)
    with refused("log", *NO_POSE, kind=InvalidValueError):
        sl.calibrate(COGIRO, log, ("mass",), folds=0)


TURNED = np.array([[-0.5, -(0.75**0.5), 0.0], [0.75**0.5, -0.5, 0.0], [0.0, 0.0, 1.0]])  # by 120 degrees about z


@pytest.mark.parametrize(("shift", "rows"), wide([((3.0, -2.0, 1.0), 5), ((0.0, 0.0, 0.0), 5), ((3.0, -2.0, 1.0), 60)]))
def test_positions_in_other_axes_are_refused_with_the_missing_unknown(shift: tuple[float, ...], rows: int) -> None:
    sensors = usual_sensors(position_deviation=1e-3)
    log = log_of(true_robot(COGIRO, ALL, 3, sensors), 60, 3, positions=rows).log
    assert log.position is not None
    turned = log.replace(position=(log.position - shift) @ TURNED)
    with refused("log", kind=InvalidValueError) as caught:
        sl.calibrate(COGIRO, turned, unknowns(ALL), folds=0)
    assert f"{rows} of {rows} measured poses" in caught.value.value
    assert "measuring_frame and target" in caught.value.next_step
    assert len(str(caught.value)) < 300
    assert "…" not in str(caught.value)
    found = sl.calibrate(COGIRO, turned, [*unknowns(ALL), "measuring_frame"], folds=0)
    angle, error = found.value_of("measuring_frame.about z")
    assert abs(angle - np.radians(120.0)) < 4.0 * error < 0.1


@extended
def test_a_log_of_another_wiring_is_recognized_in_any_axes() -> None:
    sensors = usual_sensors(position_deviation=1e-3)
    log = log_of(true_robot(COGIRO, ALL, 1, sensors), 60, 1, positions=5).log
    assert log.position is not None
    swapped = log.readings.copy()
    swapped[:, [2, 5]] = swapped[:, [5, 2]]
    wrong = log.replace(counts=swapped, position=log.position @ TURNED)
    with refused("log", kind=InvalidValueError) as caught:
        sl.calibrate(COGIRO, wrong, [*unknowns(ALL), "measuring_frame"], folds=0)
    assert "cables 2 and 5" in caught.value.value


def test_an_invalid_unknown_is_refused_before_any_work(monkeypatch: pytest.MonkeyPatch) -> None:
    def work(*_: object) -> None:
        raise AssertionError("it has begun")

    monkeypatch.setattr(diagnostics, "wrong_units", work)
    robot = sl.load_robot("cogiro")
    log = sl.WinchLog(
        unstrained_length=np.full((3, 8), 9.0),
        load_cells=np.full((3, 8), 500.0),
        sensors=sl.Sensors(tension_deviation=5.0),
    )
    with refused("unknown", "'1e999'", kind=sl.InvalidValueError):
        sl.calibrate(robot, log, ["1e999"])


@pytest.mark.parametrize(
    ("matrix", "step"),
    [
        (np.diag([1.0, -1.0, 1.0]), "sign of column y"),
        (np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]), "exchange two"),
    ],
)
@pytest.mark.parametrize("more", wide([[], ["measuring_frame"]]))
def test_left_handed_axes_of_measured_positions_are_named(matrix: Array, step: str, more: list[str]) -> None:
    sensors = usual_sensors(position_deviation=1e-3)
    log = log_of(true_robot(COGIRO, ALL, 3, sensors), 40, 3, positions=12).log
    assert log.position is not None
    with refused("log", kind=InvalidValueError) as caught:
        sl.calibrate(COGIRO, log.replace(position=log.position @ matrix), [*unknowns(ALL), *more], folds=0)
    assert "left-handed" in caught.value.value
    assert step in caught.value.next_step


def test_measured_positions_that_no_axes_explain_have_an_unknown_cause() -> None:
    sensors = usual_sensors(position_deviation=1e-3)
    log = log_of(true_robot(COGIRO, ALL, 3, sensors), 40, 3, positions=12).log
    assert log.position is not None
    mixed = log.position.copy()
    rows = np.flatnonzero(~np.isnan(mixed).any(axis=1))
    mixed[rows] = mixed[np.random.default_rng(2).permutation(rows)]
    with refused("log", kind=InvalidValueError) as caught:
        sl.calibrate(COGIRO, log.replace(position=mixed), unknowns(ALL), folds=0)
    assert "not known" in caught.value.value
    assert "axes" not in caught.value.value


PLANAR = np.array([[0.0, 0.0, 0.0], [2.9, 0.0, 0.0], [2.9, 0.0, 2.3], [0.0, 0.0, 2.3]])  # frame anchors [m]
CORNERS = np.array([[-0.066, 0.0, -0.061], [0.066, 0.0, -0.061], [0.066, 0.0, 0.061], [-0.066, 0.0, 0.061]])  # [m]


def planar_robot(frame: Array) -> sl.Robot:
    """Planar robot with four light cables."""
    return sl.Robot(
        "planar",
        frame,
        CORNERS,
        sl.Cable(0.007, [1.4e4] * 4),
        1.0,
        0.01 * np.eye(3),
        motion_pattern="1R2T",
        plane_normal=(0.0, 1.0, 0.0),
        tension_min=5.0,
    )


@pytest.mark.parametrize("seeds", [(9, 15), pytest.param(range(20), marks=extended)])
def test_lengths_and_positions_without_load_cells_are_sufficient(seeds: Iterable[int]) -> None:
    """Noise of the lengths exceeds the stretch of the cables, so that cables become slack during the search."""
    deviations, found = [], []
    for seed in seeds:
        rng = np.random.default_rng(seed)
        truth = planar_robot(PLANAR + rng.normal(0.0, 0.03, (4, 3)) * [1.0, 0.0, 1.0])
        places = rng.uniform((0.6, 0.0, 0.5), (2.3, 0.0, 1.8), (62, 3))
        lengths = sl.inverse(truth, sl.Pose(places, np.eye(3))).unstrained_length - rng.normal(0.0, 0.1, 4)
        log = sl.WinchLog(
            unstrained_length=lengths + rng.normal(0.0, 2.3e-3, lengths.shape),
            position=places + rng.normal(0.0, 1e-3, places.shape),
            sensors=sl.Sensors(length_deviation=2.3e-3, position_deviation=1e-3),
        )
        found.append(sl.calibrate(planar_robot(PLANAR), log, folds=0))
        moved = found[-1].robot.frame_anchors - truth.frame_anchors
        deviations.append((moved.ravel() / found[-1].standard_error[:12])[[0, 2, 3, 5, 6, 8, 9, 11]])
    assert np.mean([one.status is sl.CalibrationStatus.FOUND for one in found]) >= 0.95
    assert sl.CalibrationStatus.NOT_CONVERGED not in [one.status for one in found]
    assert np.mean(np.abs(deviations) < 2.0) >= 0.9
