"""Result of a calibration: covariance, status, provenance, and test of the parameters that were not estimated."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from datetime import UTC, datetime
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtr, chdtrc

from sagline.calibration.findings import CalibrationStatus, Criticism, CrossValidation, Omission
from sagline.calibration.identifiability import OPEN, append_rows, gauge_of
from sagline.calibration.least_squares import QUANTILE, exceeded_with, whitened_at
from sagline.calibration.observations import BLOCK
from sagline.calibration.outliers import misfitting, outliers_in
from sagline.calibration.parameters import KINDS, OF_CELLS, Parameters, Unknown, parameters_of
from sagline.calibration.problem import Fit, FitProblem
from sagline.calibration.result import Calibration
from sagline.calibration.weak_identifiability import weak_directions
from sagline.core.arrays import Array, Flags, Indices, blocks, locked
from sagline.core.errors import InvalidValueError
from sagline.robot.pose import Pose
from sagline.robot.tolerances import Provenance
from sagline.robot.winch import Winch

# A result is doubtful if the probability that chance alone gives such a large chi squared is below this value.
DOUBTFUL: Final = 1e-4
ODD: Final = 0.1  # the whole result is doubtful if a larger share of the poses fits badly
ODD_WEIGHT: Final = 0.5  # a pose fits badly if its weight is below this value
TOLERATED: Final = 1.1  # largest accepted ratio of chi squared to its expected value, because no model is exact
HARMLESS: Final = 1.0  # standard errors: largest change of a value by contradicted parameters that is not doubtful
LITTLE: Final = 1e-6  # largest component of an observable parameter in an unobservable direction
CHANCE: Final = 0.01  # probability that a log without errors fails a score test


def calibration_of(
    problem: FitProblem,
    unknowns: Sequence[Unknown],
    fit: Fit,
    kept: Flags,
    rows: Indices,
    left_out: Mapping[Omission, Indices],
    source: str,
    validation: CrossValidation | None,
) -> Calibration:
    """Calibration from a fit to the poses `kept`; rows: row of each pose in the log; left_out: omitted rows."""
    parameters, numbers, machine, normal = problem.parameters, fit.state.numbers, fit.state.machine, fit.normal
    wider, count = _with_fixed_parameters(problem, unknowns), len(numbers)
    residuals, factor = _last_readings(problem, wider, fit)
    triangle = factor[:count, :count]
    values = parameters.external(numbers)
    gauge = gauge_of(triangle, parameters, values, machine.robot, machine.sensors)
    covariance, rank = _covariance_of(problem, triangle, machine.slopes)
    criticisms: tuple[Criticism, ...] = ()
    if len(wider.parameters.names) > count:
        considered, criticisms = _criticism(problem, wider, fit, factor, covariance)
        covariance = covariance + considered
    whole, missed = kept & (normal.weights == 1.0), parameters.missed(numbers)
    known = np.count_nonzero(np.isfinite(parameters.internal_deviation))
    bad = misfitting(np.where(kept, normal.squares, np.nan), normal.readings)
    poses, date = fit.state.poses[kept], datetime.now(UTC).date().isoformat()
    result = Calibration(
        robot=machine.robot,
        before=problem.robot,
        sensors=machine.sensors,
        length_offset=locked(machine.offset),
        status=CalibrationStatus.FOUND,
        parameters=parameters,
        values=locked(values),
        covariance=locked(covariance),
        chi_squared=float(normal.squares[whole].sum() + missed @ missed),
        degrees_of_freedom=int(normal.readings[whole].sum() + known) - rank,
        rows=locked(rows[kept]),
        left_out=left_out,
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
    status = _status(fit, kept, result)
    provenance = _provenance_of(parameters, result.standard_error, status, source, date)
    return replace(result, status=status, robot=machine.robot.replace(calibration=provenance))


def _status(fit: Fit, kept: Flags, result: Calibration) -> CalibrationStatus:
    """Status of a fit, from chi squared, the share of poses that fit badly, and the criticisms of `result`."""
    if not fit.converged:
        return CalibrationStatus.NOT_CONVERGED
    weights, elsewhere = fit.normal.weights, len(result.left_out.get(Omission.OTHER_EQUILIBRIUM, ()))
    readings, reduced = fit.normal.readings[kept & (weights == 1.0)], bool((weights[kept] < 1.0).any())
    odd = np.count_nonzero(kept & (weights < ODD_WEIGHT)) + elsewhere
    doubtful = (
        _is_doubtful(result.chi_squared, result.degrees_of_freedom, readings, robust=reduced)
        or _is_doubtful(*result.chi_squared_of_all, readings[:0], robust=False)
        or any(one.deviations > HARMLESS for one in result.criticisms)
        or odd > ODD * (np.count_nonzero(kept) + elsewhere)
    )
    return CalibrationStatus.DOUBTFUL if doubtful else CalibrationStatus.FOUND


def _covariance_of(problem: FitProblem, triangle: Array, slopes: Array) -> tuple[Array, int]:
    """Covariance (P, P) of the values, and its rank; the variance of an unobserved value without prior is infinite."""
    scale = problem.scale
    _, sizes, rows = np.linalg.svd(append_rows(triangle * scale, problem.parameters.prior_root * scale))
    observable = sizes > OPEN * sizes[0]
    unit = rows[: len(observable)][observable].T / sizes[observable] * (scale * slopes)[:, None]
    covariance: Array = unit @ unit.T
    null = rows[np.concatenate((~observable, np.ones(len(rows) - len(observable), dtype=np.bool_)))]
    unknown = np.flatnonzero((np.abs(null) > LITTLE).any(axis=0))
    covariance[unknown, unknown] = np.inf
    return covariance, int(np.count_nonzero(observable))


def _is_doubtful(chi_squared: float, free: int, readings: NDArray[np.integer], *, robust: bool) -> bool:
    """True if the residuals are too large or too small for the deviations of the sensors."""
    # Poses that fit badly are not counted. The expected sum of squares of a counted pose with r readings is therefore
    # the mean of a chi squared distribution that is truncated at c: r F(c; r + 2)/F(c; r).
    if free <= 0:
        return False
    cut = 0.0
    if robust:
        limit = exceeded_with(1.0 - QUANTILE, readings)
        cut = float(np.sum(readings * (1.0 - chdtr(readings + 2, limit) / QUANTILE)))
    ratio = chi_squared / max(free - cut, 1.0)
    return bool(chdtrc(free, chi_squared + cut) < DOUBTFUL and ratio > TOLERATED)


def _provenance_of(
    parameters: Parameters, standard_error: Array, status: CalibrationStatus, log: str, date: str
) -> Provenance:
    """Provenance of a calibrated robot with log, date (ISO 8601) and the standard errors (P,) of the values."""
    note = "" if status is CalibrationStatus.FOUND else status.text
    return Provenance(log, date, parameters.by_quantity(standard_error), note)


def _with_fixed_parameters(problem: FitProblem, unknowns: Sequence[Unknown]) -> FitProblem:
    """Problem with all observable parameters: first the estimated parameters, then the fixed parameters."""
    # The fixed parameters are all kinds that the robot has and the readings observe, with one value per cable.
    robot = problem.robot if problem.robot.winches is not None else problem.robot.replace(winches=Winch())
    every, sensors, counted = list(unknowns), problem.sensors, problem.parameters.counted
    for name, kind in KINDS.items():
        if name in problem.parameters.names or (kind.needs == "motion" and problem.log.motion is None):
            continue
        other = Unknown(name, shared=False if kind.each else None)
        try:
            parameters = parameters_of(robot, [other], sensors, counted=counted)
        except InvalidValueError:
            continue
        if not (parameters.logarithmic & (parameters.prior <= 0.0)).any() and (parameters.prior_deviation > 0.0).all():
            every.append(other)
    return problem._replace(robot=robot, parameters=parameters_of(robot, every, sensors, counted=counted))


def _last_readings(problem: FitProblem, wider: FitProblem, fit: Fit) -> tuple[Array, Array]:
    """Residuals and triangular factor at the end of a fit; wider: problem that also has the F fixed parameters."""
    # The residuals have the shape (N, 2 m + 6) [m, N, m, rad]; a missing residual is NaN. The factor has at most P + F
    # + 1 rows, one column for each of the P + F parameters, and a column for the misfit.
    fitted = fit.state
    machine = fitted.machine.with_parameters(wider.parameters)
    numbers = np.concatenate((fitted.numbers, wider.prior[len(fitted.numbers) :]))
    state, residuals = fitted._replace(numbers=numbers, machine=machine), []
    triangle = np.zeros((0, numbers.size + 1))
    for part in blocks(len(state.poses), BLOCK):
        reported = problem.reported_lengths(machine, part)
        rows = whitened_at(wider, state, reported, part, free_of_noise=True)
        residuals.append(np.hstack((reported - state.lengths[part], rows.residual)))
        columns = np.concatenate((rows.matrix, rows.misfit[..., None]), axis=-1)
        triangle = append_rows(triangle, columns * np.sqrt(fit.normal.weights[part])[:, None, None])
    return np.concatenate(residuals), triangle


def _criticism(
    problem: FitProblem, wider: FitProblem, fit: Fit, triangle: Array, covariance: Array
) -> tuple[Array, tuple[Criticism, ...]]:
    """Covariance (P, P) due to tolerances of fixed parameters (Schmidt); fixed parameters that readings contradict."""
    # The readings contradict a fixed parameter if chi squared would fall significantly when it is estimated. The test
    # is the score test with the priors of the fixed parameters. Each kind of parameter is tested with one value per
    # cable and with one common value. Gains and biases of load cells are also tested for single cables. For each kind,
    # the test with the best information criterion (AIC) is reported. The largest reduction comes first. triangle:
    # factor of `_last_readings`; covariance: covariance of the estimated parameters.
    count, parameters = len(problem.parameters.names), wider.parameters
    priors = np.zeros((count, triangle.shape[1]))
    priors[:, :count] = problem.parameters.prior_root
    priors[:, -1] = -problem.parameters.missed(fit.state.numbers)
    whole, scale = np.vstack((triangle, priors)), problem.scale
    left, sizes, right = np.linalg.svd(whole[:, :count] * scale, full_matrices=False)
    seen = sizes > OPEN * sizes[0]
    left, known_part = left[:, seen], left[:, seen].T @ whole[:, count:]
    rest = whole[:, count:] - left @ known_part  # effects that no change of the estimated parameters reproduces
    steps = scale[:, None] * (right[seen].T / sizes[seen] @ known_part[:, :-1])
    shifts = -fit.state.machine.slopes[:, None] * steps  # derivatives of the P values by the fixed parameters
    stated, deviation = np.flatnonzero(parameters.stated[count:]), wider.parameters.internal_deviation[count:]
    effect = shifts[:, stated] * deviation[stated]
    considered = np.asarray(effect @ effect.T)
    standard_error = np.sqrt(np.diagonal(covariance + considered))
    groups, best = list(_groups(parameters, count)), dict[str, tuple[float, Criticism]]()
    for kind, name, which, common in groups:
        columns = np.ones((which.size, 1)) if common else np.eye(which.size)
        slopes, prior = rest[:, which] @ columns, deviation[which][: columns.shape[1]]
        score = slopes.T @ rest[:, -1]
        step = np.linalg.solve(slopes.T @ slopes + np.diag(1.0 / prior**2), score)
        fall = max(float(score @ step), 0.0)
        chance, worth = float(chdtrc(step.size, fall)), fall - 2.0 * step.size
        if chance < CHANCE / len(groups) and (kind not in best or worth > best[kind][0]):
            shift = shifts[:, which] @ columns @ step
            moved = np.divide(np.abs(shift), standard_error, out=np.zeros(count), where=standard_error > 0.0)
            most = int(np.argmax(moved))
            label = parameters.labels[most]
            best[kind] = worth, Criticism(name, kind, fall, chance, label, float(shift[most]), float(moved[most]))
    return considered, tuple(one for _, one in sorted(best.values(), key=lambda pair: -pair[0]))


def _groups(parameters: Parameters, first: int) -> Iterator[tuple[str, str, Indices, bool]]:
    """Kind, name and indices of each tested group of fixed parameters; True if the group has one common value."""
    names, cables = np.array(parameters.names[first:]), parameters.cables[first:]
    for name in dict.fromkeys(names.tolist()):
        which = np.flatnonzero(names == name)
        yield name, name, which, False
        if KINDS[name].each and len(KINDS[name].axes) == 1:
            yield name, f"{name} common to all cables", which, True
        if name in OF_CELLS:  # gains and biases are also tested for single cables
            for k in which:
                yield name, f"{name}[{cables[k]}]", np.array([k]), False
