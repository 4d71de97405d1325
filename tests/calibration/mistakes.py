"""Deliberate mistakes of users in logs, with the expected words of the diagnostics."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final, NamedTuple

import numpy as np

import sagline as sl
from sagline.core.arrays import Array
from tests.calibration.reference import counts_of


class Mistake(NamedTuple):
    """A log with a mistake.

    Attributes:
        log: The log.
        told: What a sentence about it must have in it.
    """

    log: sl.WinchLog
    told: tuple[str, ...]


def _two(log: sl.WinchLog, rng: np.random.Generator) -> tuple[int, int]:
    i, j = sorted(rng.choice(log.readings.shape[1], 2, replace=False).tolist())
    return i, j


def _column(log: sl.WinchLog) -> str:
    return "counts" if log.counts is not None else "unstrained_length"


def _cells(log: sl.WinchLog) -> Array:
    assert log.load_cells is not None
    return log.load_cells


def _swap_columns(values: Array, i: int, j: int) -> Array:
    values = values.copy()
    values[:, [i, j]] = values[:, [j, i]]
    return values


def swapped_encoders(log: sl.WinchLog, robot: sl.Robot, rng: np.random.Generator) -> Mistake:
    i, j = _two(log, rng)
    changed = log.replace(**{_column(log): _swap_columns(log.readings, i, j)})
    return Mistake(changed, (f"the encoders of cables {i} and {j} seem to be swapped",))


def swapped_cables(log: sl.WinchLog, robot: sl.Robot, rng: np.random.Generator) -> Mistake:
    i, j = _two(log, rng)
    cells = _swap_columns(_cells(log), i, j)
    changed = log.replace(**{_column(log): _swap_columns(log.readings, i, j), "load_cells": cells})
    return Mistake(changed, (f"the cables {i} and {j} seem to be swapped",))


def swapped_cells(log: sl.WinchLog, robot: sl.Robot, rng: np.random.Generator) -> Mistake:
    i, j = _two(log, rng)
    return Mistake(
        log.replace(load_cells=_swap_columns(_cells(log), i, j)),
        (f"the load cells of cables {i} and {j} seem to be swapped",),
    )


def flipped_encoder(log: sl.WinchLog, robot: sl.Robot, rng: np.random.Generator) -> Mistake:
    """Counts run backward from their zero; lengths run backward from the length at switch-on."""
    i = int(rng.integers(log.readings.shape[1]))
    read = log.readings.copy()
    counts = robot.winches is not None and log.counts is not None
    about = robot.winches.count_zero[i] if counts and robot.winches is not None else max(read[:, i]) - 1.0
    read[:, i] = 2.0 * about - read[:, i]
    return Mistake(log.replace(**{_column(log): read}), (f"the encoder of cable {i} seems to count backward",))


def late_cells(log: sl.WinchLog, robot: sl.Robot, rng: np.random.Generator) -> Mistake:
    by = int(rng.integers(1, 4)) * int(rng.choice([-1, 1]))
    n = len(log)
    cells = np.arange(max(0, -by), min(n, n - by))  # the readings are in rows that are later by this number
    shifted = log.rows(cells + by).replace(load_cells=_cells(log)[cells])
    words = f"load cell readings seem to be {abs(by)} row{'s'[: abs(by) != 1]} {'late' if by > 0 else 'early'}"
    return Mistake(shifted, (words,))


def late_lengths(log: sl.WinchLog, robot: sl.Robot, rng: np.random.Generator) -> Mistake:
    """All other columns are in rows that are earlier by this number."""
    by = int(rng.integers(1, 4)) * int(rng.choice([-1, 1]))
    n = len(log)
    lengths = np.arange(max(0, -by), min(n, n - by))
    shifted = log.rows(lengths + by).replace(**{_column(log): log.readings[lengths]})
    words = f"seem to be {abs(by)} row{'s'[: abs(by) != 1]} {'late' if by > 0 else 'early'}"
    return Mistake(shifted, (f"the {_column(log).removeprefix('unstrained_').removesuffix('s')}s {words}",))


def far_zero(log: sl.WinchLog, robot: sl.Robot, rng: np.random.Generator) -> Mistake:
    i = int(rng.integers(log.readings.shape[1]))
    off = float(rng.uniform(4.0, 5.0))
    read = log.readings.copy()
    if log.counts is None:
        read[:, i] -= off
        read[:, i] += 2.0 * off if read[:, i].min() < 0.1 else 0.0
    else:
        length = sl.lengths_from_counts(robot, read).copy()
        length[:, i] += off
        read = counts_of(robot, length)
    return Mistake(log.replace(**{_column(log): read}), ("the zeros of lengths are far off", f"on cable {i};"))


def millimeters(log: sl.WinchLog, robot: sl.Robot, rng: np.random.Generator) -> Mistake:
    assert log.unstrained_length is not None
    return Mistake(log.replace(unstrained_length=1e3 * log.unstrained_length), ("lengths seem to be in mm",))


def positions_in_millimeters(log: sl.WinchLog, robot: sl.Robot, rng: np.random.Generator) -> Mistake:
    assert log.position is not None
    return Mistake(log.replace(position=1e3 * log.position), ("positions seem to be in mm",))


def commanded_in_millimeters(log: sl.WinchLog, robot: sl.Robot, rng: np.random.Generator) -> Mistake:
    assert log.commanded is not None
    commanded = sl.Pose(1e3 * log.commanded.position, log.commanded.matrix)
    return Mistake(log.replace(commanded=commanded), ("commanded positions seem to be in mm", "x_commanded [mm]"))


def deviations_in_millimeters(log: sl.WinchLog, robot: sl.Robot, rng: np.random.Generator) -> Mistake:
    name = str(rng.choice(["length_deviation", "position_deviation"]))
    sensors = log.sensors.replace(**{name: float(rng.uniform(5.0, 20.0))})
    return Mistake(log.replace(sensors=sensors), (f"the {name} seems to be in mm", f"{name}: 0.5 mm"))


def kilonewtons(log: sl.WinchLog, robot: sl.Robot, rng: np.random.Generator) -> Mistake:
    return Mistake(log.replace(load_cells=1e-3 * _cells(log)), ("load cells seem to be in kN",))


def customary_units(log: sl.WinchLog, robot: sl.Robot, rng: np.random.Generator) -> Mistake:
    """Load cells or reported lengths in units that differ from SI units by less than a factor of fifty."""
    units = {"kgf": 9.80665, "lbf": 4.4482216} | ({} if log.counts is not None else {"ft": 0.3048, "in": 0.0254})
    unit = str(rng.choice(list(units)))
    if unit in ("kgf", "lbf"):
        return Mistake(log.replace(load_cells=_cells(log) / units[unit]), (f"load cells seem to have the unit {unit}",))
    changed = log.replace(unstrained_length=log.readings / units[unit])
    return Mistake(changed, (f"lengths seem to have the unit {unit}",))


Maker = Callable[[sl.WinchLog, sl.Robot, np.random.Generator], Mistake]
MISTAKES: Final[tuple[Maker, ...]] = (
    swapped_encoders,
    swapped_cables,
    swapped_cells,
    flipped_encoder,
    late_cells,
    late_lengths,
    far_zero,
    millimeters,
    positions_in_millimeters,
    commanded_in_millimeters,
    deviations_in_millimeters,
    kilonewtons,
    customary_units,
)
