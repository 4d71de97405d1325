"""The result of a search: covariance, residuals, status and provenance."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from datetime import UTC, datetime
from typing import Final

import numpy as np
from scipy.special import chdtr, chdtrc

from sagline.calibration.criticism import (
    considered_covariance,
    criticisms_of,
    fixed_terms,
    last_readings,
    with_fixed_parameters,
)
from sagline.calibration.findings import CalibrationStatus, Criticism, CrossValidation, Omission
from sagline.calibration.identifiability import OPEN, append_rows, gauge_of
from sagline.calibration.least_squares import QUANTILE, exceeded_with
from sagline.calibration.outliers import misfitting, outliers_in
from sagline.calibration.parameters import KINDS, Parameters, Unknown, external
from sagline.calibration.problem import FitProblem
from sagline.calibration.result import Calibration
from sagline.calibration.search import SearchResult
from sagline.calibration.weak_identifiability import weak_directions
from sagline.core.arrays import Array, Indices, locked
from sagline.robot.pose import Pose
from sagline.robot.tolerances import UNCERTAIN, Provenance

# smallest probability of such a chi squared by chance; with a smaller probability, the result is doubtful
DOUBTFUL: Final = 1e-4
ODD: Final = 0.1  # largest share of poses that fit badly; above it the whole result is doubtful
ODD_WEIGHT: Final = 0.5  # a pose with a lower weight fits badly
TOLERATED: Final = 1.1  # largest accepted ratio of chi squared to its expected value, because no model is exact
HARMLESS: Final = 1.0  # standard errors: a criticism with smaller changes of all values does not make a result doubtful
LITTLE: Final = 1e-6  # smallest component of an unobservable direction for a parameter to count as unobservable


def calibration_of(
    problem: FitProblem,
    unknowns: Sequence[Unknown],
    found: SearchResult,
    rows: Indices,
    left_out: Mapping[Omission, Indices],
    source: str,
    validation: CrossValidation | None,
) -> Calibration:
    """Calibration from a search; rows: indices of the used rows of the log, (N,); left_out: omitted rows by reason."""
    fit, kept, parameters = found.fit, found.kept, problem.parameters
    numbers, machine, normal = fit.state.numbers, fit.state.machine, fit.normal
    wider, count = with_fixed_parameters(problem, unknowns), len(numbers)
    residuals, factor = last_readings(problem, wider, fit)
    triangle = factor[:count, :count]
    values = external(parameters, numbers)
    gauge = gauge_of(triangle, parameters, values, machine.robot, machine.sensors)
    covariance, rank = covariance_of(problem, triangle, machine.slopes)
    criticisms: tuple[Criticism, ...] = ()
    if len(wider.parameters.names) > count:
        fixed = fixed_terms(problem, wider, fit, factor)
        covariance = covariance + considered_covariance(fixed)
        criticisms = criticisms_of(fixed, np.sqrt(np.diagonal(covariance)))
    whole, missed = kept & (normal.weights == 1.0), problem.missed(numbers)
    chi_squared = float(normal.squares[whole].sum() + missed @ missed)
    freedoms = int(normal.readings[whole].sum()) + int(np.isfinite(problem.prior_deviation).sum()) - rank
    bad = misfitting(np.where(kept, normal.squares, np.nan), normal.readings)
    poses = fit.state.poses[kept]
    date, errors = datetime.now(UTC).date().isoformat(), np.sqrt(np.diagonal(covariance))
    result = Calibration(
        robot=machine.robot,
        before=problem.robot,
        sensors=machine.sensors,
        length_offset=locked(machine.offset),
        status=CalibrationStatus.FOUND,
        parameters=parameters,
        values=locked(values),
        covariance=locked(covariance),
        chi_squared=chi_squared,
        degrees_of_freedom=freedoms,
        rows=locked(rows[kept]),
        left_out={**left_out, **{reason: locked(rows[which]) for reason, which in found.left_out.items()}},
        poses=Pose._adopt(locked(poses[:, :3].copy()), locked(poses[:, 3:].copy())),
        unstrained_length=locked(fit.state.lengths[kept]),
        residuals=locked(residuals[kept]),
        chi_squared_of_pose=locked(normal.squares[kept]),
        weights=locked(normal.weights[kept]),
        outliers=outliers_in(problem, fit.state, bad, rows[bad], count=int(kept.sum())),
        gauge=gauge,
        cannot_tell_apart=weak_directions(triangle, parameters, gauge),
        criticisms=criticisms,
        cross_validation=validation,
        iterations=fit.iterations,
        model=problem.model,
        log=source,
        date=date,
    )
    status = _status(found, result)
    provenance = provenance_of(parameters, errors, status, source, date)
    return replace(result, status=status, robot=machine.robot.replace(calibration=provenance))


def _status(found: SearchResult, result: Calibration) -> CalibrationStatus:
    """Status of a search, from the poses of full weight, from all poses without outliers, and from the criticisms."""
    kept, weights = found.kept, found.fit.normal.weights
    if not found.fit.converged:
        return CalibrationStatus.NOT_CONVERGED
    readings, reduced = found.fit.normal.readings[kept & (weights == 1.0)], bool((weights[kept] < 1.0).any())
    elsewhere = len(found.left_out.get(Omission.OTHER_EQUILIBRIUM, ()))
    odd = np.count_nonzero(kept & (weights < ODD_WEIGHT)) + elsewhere
    doubt = _is_doubtful(result.chi_squared, result.degrees_of_freedom, readings, robust=reduced)
    doubt = doubt or _is_doubtful(*result.chi_squared_of_all, readings[:0], robust=False)
    doubt = doubt or any(one.deviations > HARMLESS for one in result.criticisms)
    doubt = doubt or bool(odd > ODD * (np.count_nonzero(kept) + elsewhere))
    return CalibrationStatus.DOUBTFUL if doubt else CalibrationStatus.FOUND


def covariance_of(problem: FitProblem, triangle: Array, slopes: Array) -> tuple[Array, int]:
    """Covariance of the values (P, P) and its rank; infinite on the diagonal without observations and prior."""
    scale = problem.scale
    _, sizes, rows = np.linalg.svd(append_rows(triangle * scale, problem.prior_root * scale))
    observable = sizes > OPEN * sizes[0]
    unit = rows[: len(observable)][observable].T / sizes[observable] * (scale * slopes)[:, None]
    covariance: Array = unit @ unit.T
    null = rows[np.concatenate((~observable, np.ones(len(rows) - len(observable), dtype=np.bool_)))]
    unknown = np.flatnonzero((np.abs(null) > LITTLE).any(axis=0))
    covariance[unknown, unknown] = np.inf
    return covariance, int(np.count_nonzero(observable))


def _is_doubtful(chi_squared: float, free: int, readings: Indices, *, robust: bool) -> bool:
    """True if the residuals are too large or too small for the deviations of the sensors.

    Poses that fit badly are not counted. This lowers the expected sum of squares of the other poses: it is the mean of
    a chi squared distribution truncated at a quantile c, r F(c; r + 2)/F(c; r).
    """
    if free <= 0:
        return False
    cut = 0.0
    if robust:
        limit = exceeded_with(1.0 - QUANTILE, readings)
        cut = float(np.sum(readings * (1.0 - chdtr(readings + 2, limit) / QUANTILE)))
    ratio = chi_squared / max(free - cut, 1.0)
    return bool(chdtrc(free, chi_squared + cut) < DOUBTFUL and ratio > TOLERATED)


def provenance_of(
    parameters: Parameters, standard_error: Array, status: CalibrationStatus, log: str, date: str
) -> Provenance:
    """Provenance of the values of a calibrated robot, each with its standard error (P,); date in ISO 8601."""
    errors: dict[str, Array] = {}
    for name in dict.fromkeys(parameters.names):
        if name not in UNCERTAIN or (name == "length_zero" and not parameters.counted):
            continue
        first, axes = KINDS[name].first, len(KINDS[name].axes)
        error = standard_error[np.asarray(parameters.where[first : first + axes], dtype=np.int64)].T
        own = error if UNCERTAIN[name].each else error[0]
        errors[name] = own if UNCERTAIN[name].axes else own[..., 0]
    return Provenance(log, date, errors, "" if status is CalibrationStatus.FOUND else status.text)
