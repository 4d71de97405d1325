"""Calibration of 60 poses, its remaining error, calibration of a million rows, and recommended poses; one core."""

from __future__ import annotations

import resource
import time
from collections.abc import Iterator

import numpy as np
from scipy.optimize import least_squares

import sagline as sl
from benchmarks.measure import Row, best_seconds, print_table
from sagline.calibration.calibrate import _active_sensors
from sagline.calibration.least_squares import best_step, evaluate_step
from sagline.calibration.observations import Readings
from sagline.calibration.parameters import parameters_of, with_values
from sagline.calibration.problem import FitProblem, SearchState, start_of
from sagline.core.arrays import Array
from sagline.robot.drum import Drums
from tests.calibration.synthetic import Truth, true_robot, usual_sensors, with_drums
from tests.calibration.varied import ERRORS, at_chosen, left_error, varied

ANCHORS = ("frame_anchors", "platform_anchors", "length_zero", "drum_radius")
ALL = (*ANCHORS, "linear_density", "axial_stiffness", "mass", "center_of_mass")  # 63 numbers in total
UNKNOWNS = [sl.Unknown(name, deviation=error) for name, error in ERRORS.items()]
COGIRO = with_drums()
ROBOTS = 16
TILED = 100_000  # number of rows in a timed iteration
MILLION = 1_000_000


def problem_of(log: sl.WinchLog) -> FitProblem:
    """Unknowns of a calibration of CoGiRo with a log."""
    sensors = _active_sensors(log)
    return FitProblem(
        COGIRO, sl.Catenary(), sensors, parameters_of(COGIRO, UNKNOWNS, sensors, counted=True), Readings.of(log)
    )


def plain_seconds(log: sl.WinchLog) -> float:
    """Time [s] of scipy's least squares with finite differences, whose unknowns include the lengths."""
    problem = problem_of(log)
    state = start_of(problem, log.commanded)
    width, deviation = len(problem.prior), log.sensors.tension_deviation
    assert log.load_cells is not None
    assert deviation is not None
    read = log.load_cells

    def misses(x: Array) -> Array:
        numbers, lengths = x[:width], x[width:].reshape(state.lengths.shape)
        robot = with_values(COGIRO, problem.parameters, problem.parameters.external(numbers))
        drums = Drums(robot)
        said = drums.lengths_at(log.readings) / (1.0 + drums.rest_strain)
        found = sl.forward(robot, lengths, log.commanded)
        cells = (read - found.state.cables.frame_end_tension) / deviation
        prior = (numbers - problem.prior) / problem.parameters.internal_deviation
        return np.concatenate((cells.ravel(), ((lengths - said) / log.sensors.length_deviation).ravel(), prior))

    scale = np.concatenate((problem.parameters.internal_deviation, np.full(state.lengths.size, 1e-3)))
    begin = np.concatenate((problem.prior, state.lengths.ravel()))
    begun = time.process_time()
    least_squares(misses, begin, x_scale=scale, ftol=1e-6, max_nfev=12)
    return time.process_time() - begun


def single() -> Iterator[Row]:
    """Calibration of 63 numbers from 60 poses, with anchor errors of 5 cm."""
    log = varied(true_robot(COGIRO, ERRORS, 1), 60, 1).log
    own = best_seconds(lambda: sl.calibrate(COGIRO, log, UNKNOWNS, folds=0), 15)
    plain = plain_seconds(log)
    yield Row(
        "63 numbers from 60 poses, anchors 5 cm off; scipy `least_squares` with differences",
        "<= 30 ms; >= 100 x",
        f"{1e3 * own:.0f} ms; {plain:.1f} s, {plain / own:.0f} x",
    )


def accuracy() -> Iterator[Row]:
    """Remaining position error after a calibration."""
    chosen = sl.calibration_poses(COGIRO, 60, UNKNOWNS, usual_sensors())
    for words, positions, goal in (
        ("no measured position, up to shift and yaw", 0, "<= 3.5 mm from 46"),
        ("no measured position, up to scale too", 0, ""),
        ("6 points of 1 mm", 6, "<= 1.7 mm"),
        ("a position of 1 mm at every pose", 60, "<= 0.7 mm from 101"),
    ):
        before: list[float] = []
        after: list[float] = []
        best: list[float] = []
        for seed in range(ROBOTS):
            sensors = usual_sensors(position_deviation=1e-3) if positions else usual_sensors()
            truth: Truth = true_robot(COGIRO, ERRORS, seed, sensors)
            logs = varied(truth, 60, seed, positions).log, at_chosen(truth, chosen, seed, positions).log
            robots = [COGIRO, *(sl.calibrate(COGIRO, log, UNKNOWNS, folds=0).robot for log in logs)]
            for robot, errors in zip(robots, (before, after, best), strict=True):
                errors.append(left_error(robot, truth.robot, seed, own=positions == 0, scaled="scale" in words))
        root = [1e3 * np.sqrt(np.mean(np.square(errors))) for errors in (before, after, best)]
        measured = f"{root[1]:.2f} mm from {root[0]:.0f} at random poses, {root[2]:.2f} mm at those chosen"
        yield Row(f"position error of {ROBOTS} robots, {words}", goal, measured)


def large() -> Iterator[Row]:
    """Time of one iteration of a calibration over many rows."""
    log = varied(true_robot(COGIRO, ERRORS, 1), 60, 1).log
    small = problem_of(log)
    state = start_of(small, log.commanded)
    for rows in (TILED, MILLION):
        times = -(-rows // 60)
        assert small.log.counts is not None
        tiled = Readings(
            np.broadcast_to(np.nan, (rows, small.log.counts.shape[1])),
            np.tile(small.log.cells, (times, 1))[:rows],
            np.broadcast_to(small.log.positions[:1], (rows, 3)),
            np.broadcast_to(small.log.rotations[:1], (rows, 4)),
            counts=np.tile(small.log.counts, (times, 1))[:rows],
        )
        problem = small._replace(log=tiled)
        begin = SearchState(
            state.numbers,
            state.machine,
            np.tile(state.lengths, (times, 1))[:rows],
            np.tile(state.poses, (times, 1))[:rows],
        )
        kept = np.ones(rows, dtype=np.bool_)
        begin, normal = evaluate_step(problem, begin, None, kept)
        step, _ = best_step(problem, begin, normal)
        begun = time.process_time()
        evaluate_step(problem, begin, step, kept)
        seconds = time.process_time() - begun
        memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
        yield Row(
            f"one iteration over {rows:,} rows; memory of the process",
            f"<= {45.0 * rows / MILLION:g} s; <= 500 MB",
            f"{seconds:.1f} s, {1e6 * seconds / rows:.0f} us per row; {memory:.0f} MB",
        )


def poses() -> Iterator[Row]:
    """Standard errors of 63 unknowns with 40 poses that are selected from 500, compared with 40 random poses."""
    for name in ("cogiro", "article-suspended"):
        robot, sensors = with_drums(name), usual_sensors()
        seconds = best_seconds(lambda robot=robot, sensors=sensors: sl.calibration_poses(robot, 40, ALL, sensors), 3)  # type: ignore[misc]
        shares = [sl.calibration_poses(robot, 40, ALL, sensors, seed=seed).share_of_random for seed in range(5)]
        yield Row(
            f"40 poses of 500 for 63 numbers, {name}",
            "errors x 0.7 of random poses, <= 1 s",
            f"x {np.mean(shares):.2f} ({min(shares):.2f} to {max(shares):.2f} of 5 seeds), worth "
            f"{np.mean(shares) ** -2.0:.1f} times as many random ones; {seconds:.2f} s",
        )


PARTS = (large, single, accuracy, poses)  # first the part that reads the largest memory of the process

if __name__ == "__main__":
    print_table("Calibration", PARTS)
