"""What follows from the last state of a search: covariance, residuals, and whether to believe them."""

from __future__ import annotations

from collections.abc import Mapping
from datetime import UTC, datetime
from typing import Final, NamedTuple

import numpy as np

from sagline.calibration.findings import CalibrationStatus, CrossValidation, Omission, Outlier
from sagline.calibration.identifiability import OPEN, append_rows, gauge_of
from sagline.calibration.least_squares import QUANTILE, above, below, exceeded_with, whitened_at
from sagline.calibration.observations import BLOCK
from sagline.calibration.outliers import misfitting, outliers_in
from sagline.calibration.parameters import KINDS, Parameters, external
from sagline.calibration.problem import Fit, Problem, reported_lengths
from sagline.calibration.result import Calibration
from sagline.calibration.search import Found
from sagline.calibration.weak_identifiability import cannot_tell_apart
from sagline.core.arrays import Array, Flags, Indices, locked
from sagline.core.progress import blocks
from sagline.robot.pose import Pose
from sagline.robot.provenance import Provenance
from sagline.robot.tolerances import UNCERTAIN

DOUBTFUL: Final = 1e-4  # chi squared that would be so far from what is to be expected that rarely is none
ODD: Final = 0.1  # share of the poses that may fit badly, or not at all, before the whole is in doubt
ODD_WEIGHT: Final = 0.5  # and what counts so little is one
TOLERATED: Final = 1.1  # of chi squared to what is to be expected: no model is better than that in a large log
LITTLE: Final = 1e-6  # of a direction: a number that has so little of it is told all the same


def evaluate(
    problem: Problem,
    found: Found,
    rows: Indices,
    left_out: Mapping[Omission, Indices],
    source: str,
    validation: CrossValidation | None,
) -> Calibration:
    """The result of a search.

    Args:
        problem: The problem.
        found: How the search ended.
        rows: Of the whole log, those that the problem has, (N,).
        left_out: Why the others are not among them.
        source: Where the log was read.
        validation: How well poses are predicted that were left out, where it was asked for.
    """
    fit, kept, parameters = found.fit, found.kept, problem.parameters
    numbers, machine, normal = fit.state.numbers, fit.state.machine, fit.normal
    residuals, triangle = said_by_all(problem, fit)
    values, machines = external(parameters, numbers), (machine.robot, machine.sensors)
    gauge = gauge_of(triangle, parameters, values, *machines)
    covariance, told = covariance_of(problem, triangle, machine.slopes)
    judged = _judged(problem, found, told)
    gone = dict(left_out)
    for reason, which in found.left_out.items():
        gone[reason] = locked(rows[which])
    poses = fit.state.poses[kept]
    date, errors = datetime.now(UTC).date().isoformat(), np.sqrt(np.diagonal(covariance))
    made = provenance_of(parameters, errors, judged.status, source, date)
    return Calibration(
        robot=machine.robot.replace(calibration=made),
        before=problem.robot,
        sensors=machine.sensors,
        length_offset=locked(machine.offset),
        status=judged.status,
        parameters=parameters,
        values=locked(values),
        covariance=locked(covariance),
        chi_squared=judged.chi_squared,
        degrees_of_freedom=judged.free,
        rows=locked(rows[kept]),
        left_out=gone,
        poses=Pose._adopt(locked(poses[:, :3].copy()), locked(poses[:, 3:].copy())),
        unstrained_length=locked(fit.state.lengths[kept]),
        residuals=locked(residuals[kept]),
        chi_squared_of_pose=locked(normal.squares[kept]),
        weights=locked(normal.weights[kept]),
        outliers=_outliers(problem, fit, kept, rows),
        gauge=gauge,
        cannot_tell_apart=cannot_tell_apart(triangle, parameters, gauge),
        cross_validation=validation,
        iterations=fit.iterations,
        model=problem.model,
        log=source,
        date=date,
    )


def _outliers(problem: Problem, fit: Fit, kept: Flags, rows: Indices) -> tuple[Outlier, ...]:
    """What went wrong at poses that do not fit."""
    bad = misfitting(np.where(kept, fit.normal.squares, np.nan), fit.normal.readings)
    return outliers_in(problem, fit.state, bad, rows[bad], count=int(kept.sum()))


class Judged(NamedTuple):
    """Whether to believe a calibration: its status, sum of squares, and what that is to be compared with."""

    status: CalibrationStatus
    chi_squared: float
    free: int


def _judged(problem: Problem, found: Found, told: int) -> Judged:
    """Judge a search by the poses that count whole, of which `told` combinations of the numbers are found."""
    fit, kept, normal = found.fit, found.kept, found.fit.normal
    missed = problem.missed(fit.state.numbers)
    whole = kept & (normal.weights == 1.0)
    chi_squared = float(normal.squares[whole].sum() + missed @ missed)
    free = int(normal.readings[whole].sum()) + int(np.isfinite(problem.prior_deviation).sum()) - told
    if not fit.converged:
        return Judged(CalibrationStatus.NOT_CONVERGED, chi_squared, free)
    doubt = _is_doubtful(chi_squared, free, normal.readings[whole], robust=bool((normal.weights[kept] < 1.0).any()))
    elsewhere = len(found.left_out.get(Omission.OTHER_EQUILIBRIUM, ()))
    odd = np.count_nonzero(kept & (normal.weights < ODD_WEIGHT)) + elsewhere
    doubt = doubt or bool(odd > ODD * (np.count_nonzero(kept) + elsewhere))
    return Judged(CalibrationStatus.DOUBTFUL if doubt else CalibrationStatus.FOUND, chi_squared, free)


class Said(NamedTuple):
    """What all readings say at the end.

    Attributes:
        residuals: Readings less predictions: lengths, load cells, position, rotation [m, N, m, rad], (N, 2 m + 6); NaN
            where nothing was read.
        triangle: Triangular factor of the whitened slopes by what is looked for, poses weighted, (at most P, P).
    """

    residuals: Array
    triangle: Array


def said_by_all(problem: Problem, fit: Fit) -> Said:
    """What all readings say at the end of a search; poses of no weight say nothing."""
    state, width = fit.state, len(fit.state.numbers)
    residuals, triangle = [], np.zeros((0, width))
    for part in blocks(len(state.poses), BLOCK):
        said = reported_lengths(problem, state.machine, part)
        rows = whitened_at(problem, state, said, part, free_of_noise=True)
        residuals.append(np.hstack((said - state.lengths[part], rows.residual)))
        triangle = append_rows(triangle, rows.matrix * np.sqrt(fit.normal.weights[part])[:, None, None])
    return Said(np.concatenate(residuals), triangle)


def covariance_of(problem: Problem, triangle: Array, slopes: Array) -> tuple[Array, int]:
    """Covariance of the values, (P, P), infinite on the diagonal where neither a reading nor a prior tells.

    And how many combinations of them are told, P where all are.

    Args:
        problem: The problem.
        triangle: Of all readings.
        slopes: How the values change with what is looked for, (P,).
    """
    scale, deviation = problem.scale, problem.prior_deviation
    known = np.where(np.isfinite(deviation), scale / deviation, 0.0)
    _, sizes, rows = np.linalg.svd(append_rows(triangle * scale, np.diag(known)))
    told = sizes > OPEN * sizes[0]
    unit = rows[: len(told)][told].T / sizes[told] * (scale * slopes)[:, None]
    covariance: Array = unit @ unit.T
    lost = rows[np.concatenate((~told, np.ones(len(rows) - len(told), dtype=np.bool_)))]
    nowhere = np.flatnonzero((np.abs(lost) > LITTLE).any(axis=0))
    covariance[nowhere, nowhere] = np.inf
    return covariance, int(np.count_nonzero(told))


def _is_doubtful(chi_squared: float, free: int, readings: Indices, *, robust: bool) -> bool:
    """Whether residuals are larger or smaller than the deviations of the sensors say.

    Where poses were taken out that fit badly, what is left fits better than chance has it: the mean of a chi squared
    that is cut at a quantile c is r F(c; r + 2)/F(c; r).
    """
    if free <= 0:
        return False
    cut = 0.0
    if robust:
        limit = exceeded_with(1.0 - QUANTILE, readings)
        cut = float(np.sum(readings * (1.0 - below(limit, readings + 2) / QUANTILE)))
    ratio = chi_squared / max(free - cut, 1.0)
    rare = min(above(chi_squared + cut, free), below(chi_squared + cut, free)) < 0.5 * DOUBTFUL
    return bool(rare and not 1.0 / TOLERATED < ratio < TOLERATED)


def provenance_of(
    parameters: Parameters, standard_error: Array, status: CalibrationStatus, log: str, date: str
) -> Provenance:
    """Where the numbers of a calibrated robot come from, each with its standard error.

    Args:
        parameters: What was looked for.
        standard_error: Of what was found, in the units of the parameters, (P,).
        status: How it ended; one that is not FOUND is noted.
        log: Where the readings come from.
        date: When it was done, ISO 8601.
    """
    errors: dict[str, Array] = {}
    for name in dict.fromkeys(parameters.names):
        if name not in UNCERTAIN or (name == "length_zero" and not parameters.counted):
            continue
        first, axes = KINDS[name].first, len(KINDS[name].axes)
        error = standard_error[np.asarray(parameters.where[first : first + axes], dtype=np.int64)].T
        own = error if UNCERTAIN[name].each else error[0]
        errors[name] = own if UNCERTAIN[name].axes else own[..., 0]
    return Provenance(log, date, errors, "" if status is CalibrationStatus.FOUND else status.text)
