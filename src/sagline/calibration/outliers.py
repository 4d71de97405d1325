"""Outliers: poses that do not fit the other poses, and the wrong readings at these poses."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve
from scipy.special import chdtrc, gammaln

from sagline.calibration import observations
from sagline.calibration.findings import Outlier, columns_of
from sagline.calibration.least_squares import exceeded_with
from sagline.calibration.log import reading_deviations
from sagline.calibration.parameters import Unknown, parameters_of
from sagline.calibration.problem import FitProblem, SearchState
from sagline.calibration.straight import lines_at
from sagline.core.arrays import Array, Flags, Indices, locked
from sagline.kernels import codes
from sagline.kinematics.forward_rows import solve_forward_rows

CHANCE: Final = 0.01  # probability that a log without errors has an outlier by chance
EXAMINED: Final = 100  # largest number of examined poses; if more poses do not fit, the whole calibration is wrong
_MOST: Final = 3  # largest number of single errors at one pose; with more errors, the whole pose is the outlier
_CLEAR: Final = 3.0  # smallest difference of log probabilities for which one explanation is preferred to another
_REST: Final = 0.1  # one error explains a pose if it leaves at most this share of the sum of squares
_WORTH: Final = 20.0  # largest difference from the best log probability for which an explanation is refined
_NONLINEAR: Final = 0.6  # a linear fit that leaves a smaller share of the sum of squares is refined by a nonlinear fit
_DROP: Final = 500.0  # quantile of chi squared above which the tail is computed by its asymptote
_ITERATIONS: Final = 10
_TOLERANCE: Final = 1e-3  # a fit stops if the sum of squares decreases by less than this value
_HALVINGS: Final = 6


class _Suspect(NamedTuple):
    """A possible error at a pose."""

    quantity: str  # "length", "load cell", "position" or "rotation"
    cable: int | None  # index of the cable, or None
    which: Indices  # indices of the wrong lengths and readings among the 2 m + 6 of a pose


class _SuspectFit(NamedTuple):
    """Best fit of a pose without the readings of the suspects."""

    squares: float  # remaining sum of squares
    sizes: list[float]  # error of each suspect
    deviations: list[float]  # error of each suspect in standard deviations


class _Case(NamedTuple):
    """One pose of the log."""

    machine: observations.MachineTerms  # the robot with sensors in SI units
    deviation: Array  # standard deviations of lengths and readings, (2 m + 6,)
    readings: observations.Readings  # readings at the pose, one row
    pose: Array  # pose row, (1, POSE_COLUMNS)
    lengths: Array  # true lengths [m], (1, m)
    read: Flags  # flags of the available readings, (m + 6,)

    @property
    def modes(self) -> int:
        """Number of natural frequencies."""
        return 0 if self.readings.frequencies is None else self.readings.frequencies.shape[1]

    def misses(self) -> tuple[Array, Array]:
        """Misfits (2 m + 6,) of lengths and readings, and derivatives (m + 6, m) of readings by true lengths."""
        # For straight cables: derivatives (2 m + 6, n) of lengths and readings by the free motions of the platform.
        m = self.lengths.shape[1]
        if self.machine.model.code == codes.STRAIGHT:
            lines = lines_at(self.machine, self.readings, self.pose)
            off, by_pose = np.full(2 * m + 6, np.nan), np.zeros((2 * m + 6, lines.by_pose.shape[2]))
            there = np.r_[:m, 2 * m : 2 * m + 6]
            off[there], by_pose[there] = lines.residual[0], lines.by_pose[0]
            return off, by_pose
        slopes = np.zeros((observations.SLOPES, 1, self.lengths.shape[1]))
        rows = observations.whitened_rows(self.machine, self.readings, slopes, self.pose, self.lengths)
        off = np.concatenate((self.readings.lengths[0] - self.lengths[0], rows.residual[0]))
        return off, rows.back[0].T / observations.EXACT**2


def _fit_suspects(case: _Case, taken: Sequence[_Suspect], iterations: int) -> _SuspectFit:
    """Best fit of a pose without the readings of the suspects `taken`; a linear fit if `iterations` is 1."""
    which = np.concatenate([one.which for one in taken]).astype(np.int64) if taken else np.zeros(0, dtype=np.int64)
    counts = np.concatenate((np.ones(case.lengths.shape[1], dtype=np.bool_), case.read))
    counts[which] = False
    if case.machine.model.code == codes.STRAIGHT:
        return _fit_of_pose(case, taken, which)
    fit, wanted, squares = _linear_fit(case, taken, which, counts)
    for _ in range(iterations - 1):
        better = _improved(case, counts, wanted, squares)
        if better is None:
            break
        before, case = squares, better
        fit, wanted, squares = _linear_fit(case, taken, which, counts)
        if before - squares < _TOLERANCE:
            break
    return fit if iterations == 1 else fit._replace(squares=squares)


def _fit_of_pose(case: _Case, taken: Sequence[_Suspect], which: Indices) -> _SuspectFit:
    """Best linear fit of a pose with straight cables, and of the errors of the readings `which`."""
    off, by_pose = case.misses()
    read = ~np.isnan(off) & np.isfinite(case.deviation)
    columns = (np.hstack((by_pose, np.eye(len(off))[:, which])) / case.deviation[:, None])[read]
    misses = off[read] / case.deviation[read]
    inverse = np.linalg.pinv(columns)
    found, errors = inverse @ misses, inverse @ inverse.T
    rest, first = misses - columns @ found, by_pose.shape[1]
    return _suspect_fit(float(rest @ rest), taken, found[first:], errors[first:, first:])


def _suspect_fit(squares: float, taken: Sequence[_Suspect], found: Array, covariance: Array) -> _SuspectFit:
    """Fit with the sum of squares `squares`; found, covariance: errors of the readings of all suspects in `taken`."""
    sizes, deviations, first = [], [], 0
    for one in taken:
        part = slice(first, first + len(one.which))
        own, weight = found[part], np.linalg.pinv(covariance[part, part], hermitian=True)
        sizes.append(float(own[0]) if one.cable is not None else float(np.linalg.norm(own)))
        deviations.append(max(float(own @ weight @ own), 0.0) ** 0.5)
        first = part.stop
    return _SuspectFit(squares, sizes, deviations)


def _linear_fit(
    case: _Case, taken: Sequence[_Suspect], which: Indices, counts: Flags
) -> tuple[_SuspectFit, Array, float]:
    """Best linear fit, the true lengths (m,) after the fit, and the sum of squares before the fit."""
    misses, by_length = case.misses()
    m, read = case.lengths.shape[1], case.read
    slopes, variance = by_length[read], case.deviation[:m] ** 2
    missed = misses[m:][read] - slopes @ misses[:m]
    columns = np.hstack((-slopes, np.eye(len(read))[read]))[:, which]
    factor = cho_factor(np.diag(case.deviation[m:][read] ** 2) + (slopes * variance) @ slopes.T)
    inverse = np.linalg.pinv(columns.T @ cho_solve(factor, columns), hermitian=True)
    off = inverse @ (columns.T @ cho_solve(factor, missed))
    rest = missed - columns @ off
    errors = np.zeros(len(misses))
    errors[which] = off
    wanted: Array = case.readings.lengths[0] - errors[:m] + variance * (slopes.T @ cho_solve(factor, rest))
    squares = float(np.sum((misses / case.deviation)[counts] ** 2))
    return _suspect_fit(float(rest @ cho_solve(factor, rest)), taken, off, inverse), wanted, squares


def _improved(case: _Case, counts: Flags, wanted: Array, squares: float) -> _Case | None:
    """Case with a smaller sum of squares, at lengths between the present lengths and `wanted`; None if not found."""
    robot, model = case.machine.robot, case.machine.model
    for halving in range(_HALVINGS):
        lengths = case.lengths + 0.5**halving * (wanted - case.lengths)
        if (lengths <= 0.0).any():
            continue
        found = solve_forward_rows(robot, model, locked(lengths), locked(case.pose.copy()), observations.NO_LOAD)
        if found.stable[0]:
            new = case._replace(pose=found.poses, lengths=lengths)
            if np.sum((new.misses()[0] / new.deviation)[counts] ** 2) < squares:
                return new
    return None


def misfitting(squares: Array, readings: NDArray[np.integer]) -> Indices:
    """Indices of at most `EXAMINED` poses with a misfit that chance does not explain; `squares`: NaN if unused."""
    known = np.where(np.isfinite(squares), squares, 0.0)
    bad = np.flatnonzero(known > exceeded_with(CHANCE / max(len(squares), 1), readings))
    return np.sort(bad[np.argsort(-known[bad], kind="stable")][:EXAMINED])


def outliers_in(
    problem: FitProblem, state: SearchState, which: Indices, rows: Indices, *, count: int
) -> tuple[Outlier, ...]:
    """Outliers that explain the misfit at the poses `which`, in the order of the rows of the log."""
    # At each pose, an error of every length, load cell, measured position and rotation is fitted. The outlier is the
    # error that explains most of the misfit. Further outliers explain the remaining misfit. If several cables or no
    # cable can explain the misfit, the whole pose is the outlier.
    log, machine, m = problem.log, state.machine, state.lengths.shape[1]
    reported = problem.reported_lengths(machine)
    modes = 0 if log.frequencies is None else log.frequencies.shape[1]
    deviation = reading_deviations(machine.sensors, m, modes)
    more = [read for read in (log.swivels, log.frequencies) if read is not None]
    read = ~np.isnan(np.hstack((log.cells, log.positions, log.rotations[:, :3], *more))) & np.isfinite(deviation[m:])
    parameters = parameters_of(machine.robot, (Unknown("mass", deviation=1.0),), machine.sensors, counted=False)
    exactly = machine.with_parameters(parameters).with_unit_sensors()  # no slopes are used
    found: list[Outlier] = []
    for k, row in zip(which.tolist(), rows.tolist(), strict=True):
        one = slice(k, k + 1)
        readings = problem.readings(reported[one], one)
        case = _Case(exactly, deviation, readings, state.poses[one], state.lengths[one], read[k])
        found += _outliers_at(case, row, count)
    return tuple(found)


def _outliers_at(case: _Case, row: int, count: int) -> list[Outlier]:
    """Outliers at a pose. If the whole pose is the outlier, it gets the quantity with the largest error."""
    m = case.lengths.shape[1]
    whole = _fit_suspects(case, (), 1)
    cells = np.flatnonzero(case.read[:m]).tolist()
    suspects = [_Suspect("length", cable, np.array([cable])) for cable in range(m)]
    suspects += [_Suspect("load cell", cable, np.array([m + cable])) for cable in cells]
    for quantity, first in (("position", m), ("rotation", m + 3)):
        if (own := np.flatnonzero(case.read[first : first + 3])).size:
            suspects.append(_Suspect(quantity, None, m + first + own))
    last = len(case.deviation) - case.modes
    swivels = np.flatnonzero(case.read[m + 6 : last - m]).tolist()
    suspects += [_Suspect("swivel angle", cable, np.array([2 * m + 6 + cable])) for cable in swivels]
    modes = np.flatnonzero(case.read[last - m :]).tolist()
    suspects += [_Suspect("frequency", None, np.array([last + k])) for k in modes]
    taken: list[_Suspect] = []
    before = whole.squares
    for _ in range(_MOST):
        first = [_fit_suspects(case, (*taken, one), 1) for one in suspects]
        rough = [_rarity(before, fit, one) for fit, one in zip(first, suspects, strict=True)]
        near_best = np.array(rough) < min(rough) + _WORTH
        close = [suspects[k] for k in np.flatnonzero(near_best)]
        fits = [_fit_suspects(case, (*taken, one), _ITERATIONS) for one in close]
        # If no suspect explains the readings, the linear fits may be inaccurate. Other suspects are fitted exactly.
        if min(fit.squares for fit in fits) > _limit(case.read, (*taken, close[0]), count):
            likely = ~near_best & (np.array([fit.squares for fit in first]) < _NONLINEAR * before)
            more = [suspects[k] for k in np.flatnonzero(likely)]
            fits += [_fit_suspects(case, (*taken, one), _ITERATIONS) for one in more]
            close += more
        rare = [_rarity(before, fit, one) for fit, one in zip(fits, close, strict=True)]
        best = int(np.argmin(rare))
        near = {close[index].quantity for index in range(len(close)) if rare[index] < rare[best] + _CLEAR}
        alone = sum(each < rare[best] + _CLEAR for each in rare) == 1
        limit = _limit(case.read, (*taken, close[best]), count)
        enough = fits[best].squares <= max(limit, 0.0 if taken else _REST * whole.squares)
        if not alone:
            if enough and not taken and len(near) == 1:  # one wrong quantity, but its cable is unknown
                return [Outlier(row, None, near.pop(), abs(fits[best].sizes[0]), fits[best].deviations[0])]
            break
        taken.append(close[best])
        suspects.remove(close[best])
        before = fits[best].squares
        if enough:
            each = zip(taken, fits[best].sizes, fits[best].deviations, strict=True)
            return [Outlier(row, one.cable, one.quantity, size, many) for one, size, many in each]
    off, _ = case.misses()
    parts = columns_of(m, case.modes, len(case.deviation))
    worst = max(parts, key=lambda name: float(np.nansum((off[parts[name]] / case.deviation[parts[name]]) ** 2)))
    size = float(np.sqrt(np.nansum(off[parts[worst]] ** 2)))
    return [Outlier(row, None, worst, size, float(np.sqrt(whole.squares)))]


def _limit(there: Flags, taken: Sequence[_Suspect], count: int) -> float:
    """Largest sum of squares that chance explains at the worst of `count` poses, without the readings of suspects."""
    used = sum(len(one.which) for one in taken)
    return float(exceeded_with(CHANCE / count, int(there.sum()) - used))


def _rarity(before: float, after: _SuspectFit, suspect: _Suspect) -> float:
    """Log probability that chance alone reduces the sum of squares from `before` to `after.squares`."""
    half, drop = 0.5 * len(suspect.which), max(before - after.squares, 0.0)
    if drop < _DROP:
        return float(np.log(chdtrc(len(suspect.which), drop)))
    return float((half - 1.0) * np.log(0.5 * drop) - 0.5 * drop - gammaln(half))  # asymptote of the chi squared tail
