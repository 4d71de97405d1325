"""Which poses do not fit the rest, and what of them: a cable that slipped, a load cell, a measured position."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np
from scipy.special import gammaln

from sagline.cables.model import CableModel
from sagline.calibration.chi_squared import above, exceeded_with
from sagline.calibration.explaining import Explained, Stand, Suspect, explained
from sagline.calibration.findings import Outlier
from sagline.calibration.plain_slopes import bench_of, said_at
from sagline.calibration.problem import Problem, State, said_lengths
from sagline.calibration.sensors import Sensors, reading_deviations
from sagline.core.arrays import Array, Flags, Indices
from sagline.kernels.calibration.terms import Readings
from sagline.robot.robot import Robot

CHANCE: Final = 0.01  # of one outlier among all poses of a log that has none
EXAMINED: Final = 100  # poses, the worst of them: where there are more, the calibration is wrong and not the poses
_MOST: Final = 3  # things that went wrong at one pose; more is the pose as a whole
_CLEAR: Final = 3.0  # of the logarithm of the probability: explanations nearer to each other are not told apart
_REST: Final = 0.1  # of the squares that one thing explains: what the rest of the calibration may be wrong by
_WORTH: Final = 20.0  # of the same, to first order: how much worse an explanation may be to be looked at closely
_BENT: Final = 0.6  # of the same: of what is off by far, the slopes need explain no more to be looked at closely
_DROP: Final = 500.0  # of chi squared
_ROUNDS: Final = 10
_QUANTITIES: Final = ("length", "load cell", "position", "rotation")


def misfitting(squares: Array, readings: Indices) -> Indices:
    """Which poses fit worse than chance lets any of so many, the worst of them where they are many: rising numbers.

    Args:
        squares: Sum of squares of each pose in standard deviations, (N,); NaN or infinite for one that does not count.
        readings: How many readings each pose has, (N,).
    """
    known = np.where(np.isfinite(squares), squares, 0.0)
    bad = np.flatnonzero(known > exceeded_with(CHANCE / max(len(squares), 1), readings))
    return np.sort(bad[np.argsort(-known[bad], kind="stable")][:EXAMINED])


def outliers_in(problem: Problem, state: State, which: Indices, rows: Indices, *, count: int) -> tuple[Outlier, ...]:
    """What went wrong at some poses of a search that do not fit.

    Args:
        problem: The problem.
        state: Where the search ended.
        which: Numbers of the poses, (n,).
        rows: Of the log, (n,).
        count: How many poses the whole log has.
    """
    log, machine = problem.log, state.machine
    said = said_lengths(problem, machine, slice(None))[which]
    readings = Readings(said, log.cells[which], log.positions[which], log.rotations[which])
    stands = state.poses[which], state.lengths[which]
    return outliers_of(machine.robot, problem.model, machine.sensors, readings, *stands, rows, count=count)


def outliers_of(
    robot: Robot,
    model: CableModel,
    sensors: Sensors,
    readings: Readings,
    poses: Array,
    lengths: Array,
    rows: Indices,
    *,
    count: int,
) -> tuple[Outlier, ...]:
    """What went wrong at poses that do not fit.

    For every length, load cell and measured position or rotation of a pose: by how much must it be off to explain the
    readings best, the lengths being known as far as their deviation says. What explains most is taken, and then what
    explains most of the rest. Where cables do alike, or nothing explains it, it is the pose as a whole.

    Args:
        robot: The calibrated robot.
        model: Cable model.
        sensors: The calibrated sensors.
        readings: What was read, and what the winches say the lengths are with the calibrated robot, at N poses that
            do not fit.
        poses: Where the calibration has the platform, (N, POSE_COLUMNS).
        lengths: True lengths that it has [m], (N, m).
        rows: Of the log, (N,).
        count: How many poses the whole log has.

    Returns:
        Outliers, in order of the rows.
    """
    m = robot.cable_count
    deviation = reading_deviations(sensors, m)
    silent = [np.isnan(part) for part in (readings.cells, readings.positions, readings.rotations[:, :3])]
    there = ~np.concatenate(silent, axis=1) & np.isfinite(deviation[m:])
    bench = bench_of(robot, model, sensors)
    found: list[Outlier] = []
    for place, row in enumerate(map(int, rows)):
        one = slice(place, place + 1)
        stand = Stand(bench, deviation, Readings(*(part[one] for part in readings)), poses[one], lengths[one])
        found += _outliers_at(stand, row, there[place], count)
    return tuple(found)


def _outliers_at(stand: Stand, row: int, there: Flags, count: int) -> list[Outlier]:
    m = stand.lengths.shape[1]
    whole = explained(stand, (), there, 1)
    suspects = _suspects(m, there)
    taken: list[Suspect] = []
    before = whole.squares
    for _ in range(_MOST):
        first = [explained(stand, (*taken, one), there, 1) for one in suspects]
        rough = [_rarity(before, fit, one) for fit, one in zip(first, suspects, strict=True)]
        near_best = np.array(rough) < min(rough) + _WORTH
        close = [suspects[k] for k in np.flatnonzero(near_best)]
        fits = [explained(stand, (*taken, one), there, _ROUNDS) for one in close]
        if min(fit.squares for fit in fits) > _limit(there, (*taken, close[0]), count):  # none is right, or far from it
            likely = ~near_best & (np.array([fit.squares for fit in first]) < _BENT * before)
            more = [suspects[k] for k in np.flatnonzero(likely)]
            fits += [explained(stand, (*taken, one), there, _ROUNDS) for one in more]
            close += more
        rare = [_rarity(before, fit, one) for fit, one in zip(fits, close, strict=True)]
        best = int(np.argmin(rare))
        near = {close[index].quantity for index in range(len(close)) if rare[index] < rare[best] + _CLEAR}
        alone = sum(each < rare[best] + _CLEAR for each in rare) == 1
        limit = _limit(there, (*taken, close[best]), count)
        enough = fits[best].squares <= max(limit, 0.0 if taken else _REST * whole.squares)
        if not alone:
            if enough and not taken and len(near) == 1:  # which of the cables it was, nothing tells
                return [Outlier(row, None, near.pop(), abs(fits[best].sizes[0]), fits[best].deviations[0])]
            break
        taken.append(close[best])
        suspects.remove(close[best])
        before = fits[best].squares
        if enough:
            each = zip(taken, fits[best].sizes, fits[best].deviations, strict=True)
            return [Outlier(row, one.cable, one.quantity, size, many) for one, size, many in each]
    return [_whole(stand, row, whole.squares)]


def _limit(there: Flags, taken: Sequence[Suspect], count: int) -> float:
    """What chance lets the worst of so many poses have where so much is off."""
    used = sum(len(one.which) for one in taken)
    return float(exceeded_with(CHANCE / count, int(there.sum()) - used))


def _rarity(before: float, after: Explained, suspect: Suspect) -> float:
    """Logarithm of the probability that chance alone would make so much better what is left."""
    half, drop = 0.5 * len(suspect.which), max(before - after.squares, 0.0)
    if drop < _DROP:
        return float(np.log(above(drop, len(suspect.which))))
    return float((half - 1.0) * np.log(0.5 * drop) - 0.5 * drop - gammaln(half))  # of its tail, which underflows


def _suspects(m: int, there: Flags) -> list[Suspect]:
    """Everything that may be off by itself."""
    found = [Suspect("length", cable, np.array([cable])) for cable in range(m)]
    found += [Suspect("load cell", cable, np.array([m + cable])) for cable in range(m) if there[cable]]
    for quantity, first in (("position", m), ("rotation", m + 3)):
        if (own := np.flatnonzero(there[first : first + 3])).size:
            found.append(Suspect(quantity, None, m + first + own))
    return found


def _whole(stand: Stand, row: int, squares: float) -> Outlier:
    """The pose as a whole, by the kind of reading that is the farthest off."""
    m = stand.lengths.shape[1]
    residual, _ = said_at(stand.bench, stand.readings, stand.pose, stand.lengths)
    off = np.concatenate((stand.readings.lengths[0] - stand.lengths[0], residual))
    parts = (slice(0, m), slice(m, 2 * m), slice(2 * m, 2 * m + 3), slice(2 * m + 3, 2 * m + 6))
    shares = [float(np.nansum((off[part] / stand.deviation[part]) ** 2)) for part in parts]
    worst = int(np.argmax(shares))
    return Outlier(
        row, None, _QUANTITIES[worst], float(np.sqrt(np.nansum(off[parts[worst]] ** 2))), float(np.sqrt(squares))
    )
