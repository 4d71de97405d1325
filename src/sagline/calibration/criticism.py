"""Criticism of a fit: score tests of fixed parameters (not estimated), and their share of the covariance.

docs/model.md, section 14.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Final, NamedTuple

import numpy as np
from scipy.special import chdtrc

from sagline.calibration.findings import Criticism
from sagline.calibration.identifiability import OPEN, append_rows
from sagline.calibration.least_squares import whitened_at
from sagline.calibration.observations import BLOCK, with_slopes
from sagline.calibration.parameters import KINDS, OF_CELLS, Parameters, Unknown, parameters_of
from sagline.calibration.problem import Fit, FitProblem, reported_lengths
from sagline.core.arrays import Array, Indices
from sagline.core.errors import InvalidValueError
from sagline.core.progress import blocks
from sagline.robot.robot import Robot
from sagline.robot.winch import Winch

CHANCE: Final = 0.01  # probability that a log without errors fails a test


class FixedTerms(NamedTuple):
    """Readings of a fit as a linear problem in P estimated parameters and F fixed parameters.

    Attributes:
        parameters: All P + F parameters; the fixed parameters are the last F.
        deviation: Prior standard deviations of the internal fixed parameters, (F,).
        shifts: Change of the P values by the internal fixed parameters, (P, F).
        fixed: Derivatives of the rows by the fixed parameters, without the part that a step of the estimated parameters
            can reproduce, (K, F).
        misfit: Remaining misfit, (K,).
    """

    parameters: Parameters
    deviation: Array
    shifts: Array
    fixed: Array
    misfit: Array


def with_fixed_parameters(problem: FitProblem, unknowns: Sequence[Unknown]) -> FitProblem:
    """Problem with all observable parameters; the parameters that were not estimated are the last ones."""
    robot = problem.robot if problem.robot.winches is not None else problem.robot.replace(winches=Winch())
    others = list(_other_kinds(problem, robot))
    parameters = parameters_of(robot, [*unknowns, *others], problem.sensors, counted=problem.parameters.counted)
    return problem._replace(robot=robot, parameters=parameters)


def last_readings(problem: FitProblem, wider: FitProblem, fit: Fit) -> tuple[Array, Array]:
    """Residuals and triangular factor at the end of a fit; wider: problem with fixed parameters.

    The residuals have the shape (N, 2 m + 6) [m, N, m, rad]; they are NaN if missing. The columns of the factor are the
    weighted whitened slopes by all P + F parameters, and the misfit: (at most P + F + 1, P + F + 1).
    """
    fitted = fit.state
    machine = with_slopes(fitted.machine, wider.parameters)
    numbers = np.concatenate((fitted.numbers, wider.prior[len(fitted.numbers) :]))
    state, residuals = fitted._replace(numbers=numbers, machine=machine), []
    triangle = np.zeros((0, numbers.size + 1))
    for part in blocks(len(state.poses), BLOCK):
        reported = reported_lengths(problem, machine, part)
        rows = whitened_at(wider, state, reported, part, free_of_noise=True)
        residuals.append(np.hstack((reported - state.lengths[part], rows.residual)))
        columns = np.concatenate((rows.matrix, rows.misfit[..., None]), axis=-1)
        triangle = append_rows(triangle, columns * np.sqrt(fit.normal.weights[part])[:, None, None])
    return np.concatenate(residuals), triangle


def fixed_terms(problem: FitProblem, wider: FitProblem, fit: Fit, triangle: Array) -> FixedTerms:
    """Linear problem at the end of a fit, from the factor of `last_readings`."""
    count = len(problem.parameters.names)
    priors = np.zeros((count, triangle.shape[1]))
    priors[:, :count] = problem.prior_root
    priors[:, -1] = -problem.missed(fit.state.numbers)
    whole, scale = np.vstack((triangle, priors)), problem.scale
    left, sizes, right = np.linalg.svd(whole[:, :count] * scale, full_matrices=False)
    seen = sizes > OPEN * sizes[0]
    left, known_part = left[:, seen], left[:, seen].T @ whole[:, count:]
    rest = whole[:, count:] - left @ known_part
    steps = scale[:, None] * (right[seen].T / sizes[seen] @ known_part[:, :-1])
    shifts = -fit.state.machine.slopes[:, None] * steps
    return FixedTerms(wider.parameters, wider.prior_deviation[count:], shifts, rest[:, :-1], rest[:, -1])


def criticisms_of(terms: FixedTerms, standard_error: Array) -> tuple[Criticism, ...]:
    """Fixed parameters that the readings contradict: their estimation would reduce chi squared more than by chance.

    The test is the score test with the priors of the fixed parameters. A kind is tested with a value for each cable,
    and with a common value. Kinds of load cells are also tested for single cables. The test with the best information
    criterion (AIC) is kept. The largest reduction comes first.
    """
    groups = list(_groups(terms.parameters, len(terms.shifts)))
    best: dict[str, tuple[float, Criticism]] = {}
    for kind, name, which, common in groups:
        criticism, worth = _score_test(
            terms, standard_error, kind, name, which, np.ones((which.size, 1)) if common else np.eye(which.size)
        )
        if criticism.chance < CHANCE / len(groups) and (kind not in best or worth > best[kind][0]):
            best[kind] = worth, criticism
    return tuple(one for _, one in sorted(best.values(), key=lambda pair: -pair[0]))


def _score_test(
    terms: FixedTerms, standard_error: Array, kind: str, name: str, which: Indices, columns: Array
) -> tuple[Criticism, float]:
    """Result of the test of fixed parameters along directions (F, C), and minus its information criterion."""
    rows, prior = terms.fixed[:, which] @ columns, terms.deviation[which][: columns.shape[1]]
    score = rows.T @ terms.misfit
    step = np.linalg.solve(rows.T @ rows + np.diag(1.0 / prior**2), score)
    fall = max(float(score @ step), 0.0)
    shift = terms.shifts[:, which] @ columns @ step
    moved = np.divide(np.abs(shift), standard_error, out=np.zeros(len(shift)), where=standard_error > 0.0)
    most = int(np.argmax(moved))
    chance, label = float(chdtrc(step.size, fall)), terms.parameters.labels[most]
    return Criticism(name, kind, fall, chance, label, float(shift[most]), float(moved[most])), fall - 2.0 * step.size


def considered_covariance(terms: FixedTerms) -> Array:
    """Covariance of the values due to the stated tolerances of fixed parameters, (P, P) (Schmidt)."""
    stated = np.flatnonzero(terms.parameters.stated[len(terms.shifts) :])
    effect = terms.shifts[:, stated] * terms.deviation[stated]
    return np.asarray(effect @ effect.T)


def _other_kinds(problem: FitProblem, robot: Robot) -> Iterator[Unknown]:
    """Kinds that were not estimated, although the robot has them and the readings observe them; one value per cable."""
    for name, kind in KINDS.items():
        if name in problem.parameters.names:
            continue
        other = Unknown(name, shared=False if kind.each else None)
        try:
            parameters = parameters_of(robot, [other], problem.sensors, counted=problem.parameters.counted)
        except InvalidValueError:
            continue
        if not (parameters.logarithmic & (parameters.prior <= 0.0)).any() and (parameters.prior_deviation > 0.0).all():
            yield other


def _groups(parameters: Parameters, first: int) -> Iterator[tuple[str, str, Indices, bool]]:
    """Kind, name and indices of each group of fixed parameters; True if they have one value."""
    names, cables = np.array(parameters.names[first:]), parameters.cables[first:]
    for name in dict.fromkeys(names.tolist()):
        which = np.flatnonzero(names == name)
        yield name, name, which, False
        if KINDS[name].each and len(KINDS[name].axes) == 1:
            yield name, f"{name} common to all cables", which, True
        if name in OF_CELLS:  # also tested for single cables
            for k in which:
                yield name, f"{name}[{cables[k]}]", np.array([k]), False
