"""Screening of a log: rows that are suitable for a calibration, and reasons why other rows are omitted."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

import numpy as np
from numpy.typing import NDArray

from sagline.calibration.findings import Omission
from sagline.calibration.log import READINGS, WinchLog, load_cells_of, measures_yaw
from sagline.core.arguments import instance
from sagline.core.arrays import Array, Flags, Indices, exactly, locked
from sagline.core.errors import InvalidValueError
from sagline.kinematics.winches import lengths_from_counts
from sagline.robot.robot import Robot

SPEED_LIMIT: Final = 0.005  # [m/s], largest rate of a length of a platform at rest
SOONEST: Final = 0.1 * (1.0 - 1e-9)  # [s], smallest time between compared rows, because of encoder steps
LATEST: Final = 1.0  # [s], largest time between compared rows, because the platform may stop in between
PULLING: Final = 3.0  # a cable is taut if its load cell reads more than this multiple of the standard deviation
OTHERWISE: Final = 0.5  # rows without a reading of a load cell are omitted if more than this share has one


def screen(
    robot: Robot, log: WinchLog, speed_limit: float = SPEED_LIMIT, usable: Flags | None = None
) -> tuple[WinchLog, Indices, Mapping[Omission, Indices]]:
    """Log with the rows that have all readings, a platform at rest and taut cables, without repeated rows."""
    # Also returns the indices (N,) of the kept rows, and the indices of the omitted rows for each reason. A row is
    # omitted for the first of these reasons that applies:
    # - a count or length is missing, or a reading of a load cell that has readings in more than half of the rows
    #   (measured positions and rotations may be missing);
    # - its readings are exactly the readings of an earlier row;
    # - a length changes faster than `speed_limit` [m/s] between the row and the nearest row in time, 0.1 s to 1 s away
    #   (not checked for a log without times);
    # - a load cell reading minus bias is at most three standard deviations, so that the cable may be slack.
    # The last two reasons do not apply to the rows with `usable` True, (N,).
    # Raises an error if the log has a wrong number of cables, or the robot cannot convert its counts to lengths.
    limit = float(exactly(speed_limit, "speed_limit", "m/s", (), above=0.0, infinite=True))
    lengths = _lengths_of(robot, log)
    found: dict[Omission, Indices] = {}
    kept = np.ones(len(log), dtype=np.bool_)
    for reason, wrong in (
        (Omission.NOT_A_NUMBER, _incomplete(log)),
        (Omission.REPEATED, _repeated(log)),
        (Omission.MOVING, _moving(log, lengths, limit)),
        (Omission.SLACK, _slack(robot, log)),
    ):
        if usable is not None and reason in (Omission.MOVING, Omission.SLACK):
            wrong &= ~usable
        if (wrong & kept).any():
            found[reason] = locked(np.flatnonzero(wrong & kept))
            kept &= ~wrong
    return log if kept.all() else log.rows(kept), locked(np.flatnonzero(kept)), found


def _lengths_of(robot: Robot, log: WinchLog) -> Array:
    """Lengths off the drums (N, m) [m] that the readings of a log give; NaN for a missing reading."""
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
        if "count" not in error.item or "cable" not in error.item:  # the robot is wrong, not a reading
            raise
        raise InvalidValueError(where, error.value, error.allowed, error.next_step) from None


def reading_count(log: WinchLog) -> int:
    """Number of informative readings. Lengths do not count, because every row has equally many unknown lengths."""
    angles = {"rotation": 3 if measures_yaw(log.sensors) else 2}  # of four columns of a quaternion
    read = ((getattr(log, name), angles.get(name)) for name in READINGS)
    return sum(int(np.count_nonzero(~np.isnan(values[:, :width]))) for values, width in read if values is not None)


def _incomplete(log: WinchLog) -> Flags:
    missing = np.asarray(np.isnan(log.readings).any(axis=1))
    if log.load_cells is not None:
        unread = np.isnan(log.load_cells)
        usual = np.mean(~unread, axis=0) > OTHERWISE if len(log) else np.zeros(unread.shape[1], dtype=np.bool_)
        missing |= (unread & usual).any(axis=1)
    return missing


def _repeated(log: WinchLog) -> Flags:
    """True for each row with exactly the readings of an earlier row, (N,)."""
    read = [v for v in (getattr(log, name) for name in ("readings", *READINGS)) if v is not None]
    bits: list[NDArray[np.uint64]] = [np.ascontiguousarray(v + 0.0).view(np.uint64) for v in read]  # -0.0 becomes 0.0
    digest = np.zeros(len(log), dtype=np.uint64)
    odd = np.random.default_rng(0).integers(2**63, size=sum(b.shape[1] for b in bits), dtype=np.uint64) * 2 + 1
    for column, factor in zip((c for b in bits for c in b.T), odd, strict=True):
        digest += (column ^ (column >> np.uint64(29))) * factor
    _, first, inverse = np.unique(digest, return_index=True, return_inverse=True)
    earlier = first[inverse]
    found: Flags = earlier != np.arange(len(log))
    late = np.flatnonzero(found)
    found[late] = np.all([(b[late] == b[earlier[late]]).all(axis=1) for b in bits], axis=0)  # compare all bits
    return found


def moving_rows(robot: Robot, log: WinchLog) -> tuple[Flags, Array]:
    """Moving rows (N,) with a measured pose; speed [m/s] and acceleration [m/s^2] of reported lengths, (2, N, m)."""
    # They are differences to the nearest rows in time, 0.1 s to 1 s away on both sides; zero for all other rows.
    lengths, read = _lengths_of(robot, log), [v for v in (log.position, log.rotation) if v is not None]
    measured = np.zeros(len(log), dtype=np.bool_) if log.time is None else _moving(log, lengths, SPEED_LIMIT)
    motion = np.zeros((2, *lengths.shape))
    if log.time is None or not read:
        return measured & False, motion
    order = np.argsort(log.time, kind="stable")
    time, length = log.time[order], lengths[order]
    last = len(time) - 1
    after = np.clip(np.searchsorted(time, time + SOONEST), 0, last)
    before = np.clip(np.searchsorted(time, time - SOONEST, side="right") - 1, 0, last)
    ahead, behind = (time[after] - time)[:, None], (time - time[before])[:, None]
    with np.errstate(invalid="ignore", divide="ignore"):
        rise, past = (length[after] - length) / ahead, (length - length[before]) / behind
        motion[:, order] = (behind * rise + ahead * past) / (ahead + behind), 2.0 * (rise - past) / (ahead + behind)
    near = np.zeros(len(time), dtype=np.bool_)
    near[order] = (np.minimum(ahead, behind) >= SOONEST)[:, 0] & (np.maximum(ahead, behind) <= LATEST)[:, 0]
    measured &= near & np.isfinite(motion).all(axis=(0, 2)) & ~np.isnan(np.hstack(read)).all(axis=1)
    return measured, np.where(measured[:, None], motion, 0.0)


def _moving(log: WinchLog, lengths: Array, limit: float) -> Flags:
    moving = np.zeros(len(log), dtype=np.bool_)
    if log.time is None or np.isinf(limit):
        return moving
    order = np.argsort(log.time, kind="stable")
    time, length = log.time[order], lengths[order]
    last = len(time) - 1
    for near in (np.searchsorted(time, time + SOONEST), np.searchsorted(time, time - SOONEST, side="right") - 1):
        other = np.clip(near, 0, last)
        step = np.abs(time[other] - time)
        there = (near == other) & (step <= LATEST)
        change = np.abs(length[other] - length).max(axis=1, initial=0.0)
        moving[order[there & (change > limit * step)]] = True  # NaN gives False: a reading is missing
    return moving


def _slack(robot: Robot, log: WinchLog) -> Flags:
    if log.load_cells is None:
        return np.zeros(len(log), dtype=np.bool_)
    assert log.sensors.tension_deviation is not None  # the constructor of the log has checked this
    _, bias = load_cells_of(robot)
    return np.asarray((log.load_cells - bias <= PULLING * log.sensors.tension_deviation).any(axis=1))
