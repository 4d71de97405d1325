"""Screening of a log: rows that are suitable for a calibration, and the reason for the omission of every other row."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

import numpy as np
from numpy.typing import NDArray

from sagline.calibration.findings import Omission
from sagline.calibration.log import WinchLog, load_cells_of
from sagline.core.arguments import instance
from sagline.core.arrays import Array, Flags, Indices, locked, number
from sagline.core.errors import InvalidValueError
from sagline.kinematics.winches import lengths_from_counts
from sagline.robot.robot import Robot

SPEED_LIMIT: Final = 0.005  # [m/s], largest rate of a length at rest
SOONEST: Final = 0.1 * (1.0 - 1e-9)  # [s], shortest time between rows; one encoder step looks like a motion
LATEST: Final = 1.0  # [s], longest time between rows; the platform may stop within a longer time
PULLING: Final = 3.0  # smallest reading of a load cell, in standard deviations
OTHERWISE: Final = 0.5  # if more than this share of the rows has a reading of a load cell, rows without one are omitted


def screen(
    robot: Robot, log: WinchLog, speed_limit: float = SPEED_LIMIT
) -> tuple[WinchLog, Indices, Mapping[Omission, Indices]]:
    """Log of the rows with the platform at rest, taut cables and all readings, without repetitions.

    Also returns the indices of these rows (N,), and the indices of the omitted rows for each reason. Rows are omitted
    for these reasons, in this order:

    - a missing count or length of a cable, or a missing reading of a load cell that has readings in more than half of
      the rows (measured positions and rotations may be missing in any row);
    - exactly the readings of an earlier row;
    - a length that changes faster than the limit [m/s] between the row and the nearest row in time that is 0.1 s to 1 s
      away; this check is skipped if the log has no times;
    - a load cell reading, minus bias, of at most three standard deviations, because the cable may be slack.

    Raises an error if the log has another number of cables, or counts do not give lengths.
    """
    limit = number(speed_limit, "speed_limit", "m/s", above=0.0)
    lengths = lengths_of(robot, log)
    found: dict[Omission, Indices] = {}
    kept = np.ones(len(log), dtype=np.bool_)
    for reason, wrong in (
        (Omission.NOT_A_NUMBER, _incomplete(log)),
        (Omission.REPEATED, _repeated(log)),
        (Omission.MOVING, _moving(log, lengths, limit)),
        (Omission.SLACK, _slack(robot, log)),
    ):
        if (wrong & kept).any():
            found[reason] = locked(np.flatnonzero(wrong & kept))
            kept &= ~wrong
    return log if kept.all() else log.rows(kept), locked(np.flatnonzero(kept)), found


def lengths_of(robot: Robot, log: WinchLog) -> Array:
    """Lengths off the drums (N, m) [m] from the readings of a log, NaN if missing."""
    m = instance(robot, Robot, "robot").cable_count
    cables = instance(log, WinchLog, "log").readings.shape[1]
    if cables != m:
        step = "Give the log of this robot."
        raise InvalidValueError("log", f"of {cables} cables", f"{m} cables, as many as {robot.name} has", step)
    if log.counts is None:
        return log.readings
    try:
        return lengths_from_counts(robot, log.counts)
    except InvalidValueError as error:
        where = error.item.replace("sample", "row") if len(log) > 1 else f"row 0, {error.item}"
        if "count" not in error.item or "cable" not in error.item:  # an error of the robot, not of a reading
            raise
        raise InvalidValueError(where, error.value, error.allowed, error.next_step) from None


def reading_count(log: WinchLog) -> int:
    """Number of informative readings, without the lengths, because every row has equally many unknown lengths."""
    cells, positions, rotations = (
        0 if values is None else int(np.count_nonzero(~np.isnan(values)))
        for values in (log.load_cells, log.position, None if log.rotation is None else log.rotation[:, :3])
    )
    return cells + positions + rotations


def _incomplete(log: WinchLog) -> Flags:
    missing = np.asarray(np.isnan(log.readings).any(axis=1))
    if log.load_cells is not None:
        unread = np.isnan(log.load_cells)
        usual = np.mean(~unread, axis=0) > OTHERWISE if len(log) else np.zeros(unread.shape[1], dtype=np.bool_)
        missing |= (unread & usual).any(axis=1)
    return missing


def _repeated(log: WinchLog) -> Flags:
    """Flags of rows with exactly the readings of an earlier row."""
    read = [v for v in (log.readings, log.load_cells, log.position, log.rotation) if v is not None]
    bits: list[NDArray[np.uint64]] = [np.ascontiguousarray(v + 0.0).view(np.uint64) for v in read]  # -0.0 to 0.0
    digest = np.zeros(len(log), dtype=np.uint64)
    odd = np.random.default_rng(0).integers(2**63, size=sum(b.shape[1] for b in bits), dtype=np.uint64) * 2 + 1
    for column, factor in zip((c for b in bits for c in b.T), odd, strict=True):
        digest += (column ^ (column >> np.uint64(29))) * factor
    _, first, inverse = np.unique(digest, return_index=True, return_inverse=True)
    earlier = first[inverse]
    found: Flags = earlier != np.arange(len(log))
    late = np.flatnonzero(found)
    found[late] = np.all([(b[late] == b[earlier[late]]).all(axis=1) for b in bits], axis=0)  # the rows themselves
    return found


def _moving(log: WinchLog, lengths: Array, limit: float) -> Flags:
    moving = np.zeros(len(log), dtype=np.bool_)
    if log.time is None:
        return moving
    order = np.argsort(log.time, kind="stable")
    time, length = log.time[order], lengths[order]
    last = len(time) - 1
    for near in (np.searchsorted(time, time + SOONEST), np.searchsorted(time, time - SOONEST, side="right") - 1):
        other = np.clip(near, 0, last)
        step = np.abs(time[other] - time)
        there = (near == other) & (step <= LATEST)
        change = np.abs(length[other] - length).max(axis=1, initial=0.0)
        moving[order[there & (change > limit * step)]] = True  # False for NaN; such rows are omitted anyway
    return moving


def _slack(robot: Robot, log: WinchLog) -> Flags:
    if log.load_cells is None:
        return np.zeros(len(log), dtype=np.bool_)
    assert log.sensors.tension_deviation is not None  # the constructor of the log has checked this
    _, bias = load_cells_of(robot)
    return np.asarray((log.load_cells - bias <= PULLING * log.sensors.tension_deviation).any(axis=1))
