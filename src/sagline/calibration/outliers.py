"""A pose of a log explained: the best fit where some lengths or readings are off by anything."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np
from scipy.linalg import cho_factor, cho_solve
from scipy.special import gammaln

from sagline.cables.model import CableModel
from sagline.calibration.findings import Outlier
from sagline.calibration.least_squares import above, exceeded_with
from sagline.calibration.log import Sensors, reading_deviations
from sagline.calibration.observations import NO_LOAD, Reference, misfit_at, reference_of
from sagline.calibration.problem import Problem, State, reported_lengths
from sagline.core.arrays import Array, Flags, Indices, locked
from sagline.kernels.calibration.terms import Readings
from sagline.kinematics.forward_rows import solve_rows
from sagline.robot.robot import Robot

_SETTLED: Final = 1e-3  # of a sum of squares
_HALVINGS: Final = 6


class Suspect(NamedTuple):
    """What may have gone wrong at a pose.

    Attributes:
        quantity: Of `Outlier`.
        cable: Its number, or None.
        which: Lengths, then readings that it changes, of 2 m + 6.
    """

    quantity: str
    cable: int | None
    which: Indices


class SuspectFit(NamedTuple):
    """A pose, where some things are taken to be off by what fits best.

    Attributes:
        squares: Sum of squares that is left.
        sizes: By how much each thing is off.
        deviations: The same in standard deviations.
    """

    squares: float
    sizes: list[float]
    deviations: list[float]


class PoseReadings(NamedTuple):
    """A pose of the log.

    Attributes:
        bench: What it is compared with.
        deviation: Of lengths and readings, (2 m + 6,).
        readings: What was read there, of one row.
        pose: Where it is, (1, POSE_COLUMNS).
        lengths: With which true lengths [m], (1, m).
    """

    bench: Reference
    deviation: Array
    readings: Readings
    pose: Array
    lengths: Array


class PoseFit(NamedTuple):
    """A platform at some lengths, beside what was read.

    Attributes:
        pose: (1, POSE_COLUMNS).
        lengths: [m], (1, m).
        residual: Readings less predictions, (m + 6,).
        by_length: Their slopes, (m + 6, m).
        squares: Sum of squares of all but what may be off.
    """

    pose: Array
    lengths: Array
    residual: Array
    by_length: Array
    squares: float

    @classmethod
    def of(cls, stand: PoseReadings, counts: Flags, pose: Array, lengths: Array) -> PoseFit:
        """The platform at a pose."""
        residual, by_length = misfit_at(stand.bench, stand.readings, pose, lengths)
        missed = np.concatenate((stand.readings.lengths[0] - lengths[0], residual)) / stand.deviation
        return cls(pose, lengths, residual, by_length, float(np.sum(missed[counts] ** 2)))


def fit_suspects(stand: PoseReadings, taken: Sequence[Suspect], there: Flags, rounds: int) -> SuspectFit:
    """The best fit of a pose where some lengths and readings are off by anything, as the others are not.

    With one round it is that of the slopes, with more that of the pose itself.
    """
    which = np.concatenate([one.which for one in taken]).astype(np.int64) if taken else np.zeros(0, dtype=np.int64)
    counts = np.concatenate((np.ones(stand.lengths.shape[1], dtype=np.bool_), there))
    counts[which] = False
    state = PoseFit.of(stand, counts, stand.pose, stand.lengths)
    fit, wanted = _fitted(stand, state, taken, which, there)
    for _ in range(rounds - 1):
        better = _better(stand, state, counts, wanted)
        if better is None:
            break
        gained = state.squares - better.squares
        state = better
        fit, wanted = _fitted(stand, state, taken, which, there)
        if gained < _SETTLED:
            break
    return fit if rounds == 1 else fit._replace(squares=state.squares)


def _fitted(
    stand: PoseReadings, state: PoseFit, taken: Sequence[Suspect], which: Indices, there: Flags
) -> tuple[SuspectFit, Array]:
    """The best fit by the slopes at a state, and the true lengths that it asks for, (m,)."""
    m, said = state.lengths.shape[1], stand.readings.lengths[0]
    slopes, variance = state.by_length[there], stand.deviation[:m] ** 2
    missed = state.residual[there] - slopes @ (said - state.lengths[0])
    columns = np.hstack((-slopes, np.eye(m + 6)[there]))[:, which]
    factor = cho_factor(np.diag(stand.deviation[m:][there] ** 2) + (slopes * variance) @ slopes.T)
    inverse = np.linalg.pinv(columns.T @ cho_solve(factor, columns), hermitian=True)
    off = inverse @ (columns.T @ cho_solve(factor, missed))
    rest = missed - columns @ off
    slipped = np.zeros(2 * m + 6)
    slipped[which] = off
    wanted: Array = said - slipped[:m] + variance * (slopes.T @ cho_solve(factor, rest))
    sizes, deviations, first = [], [], 0
    for one in taken:
        part = slice(first, first + len(one.which))
        own, spread = off[part], np.linalg.pinv(inverse[part, part], hermitian=True)
        sizes.append(float(own[0]) if one.cable is not None else float(np.linalg.norm(own)))
        deviations.append(float(np.sqrt(max(own @ spread @ own, 0.0))))
        first = part.stop
    return SuspectFit(float(rest @ cho_solve(factor, rest)), sizes, deviations), wanted


def _better(stand: PoseReadings, state: PoseFit, counts: Flags, wanted: Array) -> PoseFit | None:
    """The state on the way to other lengths whose sum of squares is smaller; None if there is none."""
    for halving in range(_HALVINGS):
        lengths = state.lengths + 0.5**halving * (wanted - state.lengths)
        if (lengths <= 0.0).any():
            continue
        found = solve_rows(stand.bench.robot, stand.bench.model, locked(lengths), locked(state.pose.copy()), NO_LOAD)
        if found.stable[0]:
            new = PoseFit.of(stand, counts, found.poses, lengths)
            if new.squares < state.squares:
                return new
    return None


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
    said = reported_lengths(problem, machine, slice(None))[which]
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
    bench = reference_of(robot, model, sensors)
    found: list[Outlier] = []
    for place, row in enumerate(map(int, rows)):
        one = slice(place, place + 1)
        stand = PoseReadings(bench, deviation, Readings(*(part[one] for part in readings)), poses[one], lengths[one])
        found += _outliers_at(stand, row, there[place], count)
    return tuple(found)


def _outliers_at(stand: PoseReadings, row: int, there: Flags, count: int) -> list[Outlier]:
    m = stand.lengths.shape[1]
    whole = fit_suspects(stand, (), there, 1)
    suspects = _suspects(m, there)
    taken: list[Suspect] = []
    before = whole.squares
    for _ in range(_MOST):
        first = [fit_suspects(stand, (*taken, one), there, 1) for one in suspects]
        rough = [_rarity(before, fit, one) for fit, one in zip(first, suspects, strict=True)]
        near_best = np.array(rough) < min(rough) + _WORTH
        close = [suspects[k] for k in np.flatnonzero(near_best)]
        fits = [fit_suspects(stand, (*taken, one), there, _ROUNDS) for one in close]
        if min(fit.squares for fit in fits) > _limit(there, (*taken, close[0]), count):  # none is right, or far from it
            likely = ~near_best & (np.array([fit.squares for fit in first]) < _BENT * before)
            more = [suspects[k] for k in np.flatnonzero(likely)]
            fits += [fit_suspects(stand, (*taken, one), there, _ROUNDS) for one in more]
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


def _rarity(before: float, after: SuspectFit, suspect: Suspect) -> float:
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


def _whole(stand: PoseReadings, row: int, squares: float) -> Outlier:
    """The pose as a whole, by the kind of reading that is the farthest off."""
    m = stand.lengths.shape[1]
    residual, _ = misfit_at(stand.bench, stand.readings, stand.pose, stand.lengths)
    off = np.concatenate((stand.readings.lengths[0] - stand.lengths[0], residual))
    parts = (slice(0, m), slice(m, 2 * m), slice(2 * m, 2 * m + 3), slice(2 * m + 3, 2 * m + 6))
    shares = [float(np.nansum((off[part] / stand.deviation[part]) ** 2)) for part in parts]
    worst = int(np.argmax(shares))
    return Outlier(
        row, None, _QUANTITIES[worst], float(np.sqrt(np.nansum(off[parts[worst]] ** 2))), float(np.sqrt(squares))
    )
