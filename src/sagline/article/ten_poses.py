"""Table 2 and figure 27: ten measured poses of the prototype, and what could be wrong with it."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import reduce
from itertools import combinations
from typing import NamedTuple

import numpy as np

from sagline.arrays import Array, locked
from sagline.article.fits import Line, fit_line
from sagline.article.machine import PARAMETERS, Machine, Parameter
from sagline.article.table2 import Table2, table2
from sagline.cables.empirical import Empirical
from sagline.files.robot_file import load_robot
from sagline.kinematics.inverse import inverse
from sagline.kinematics.plan import Plan
from sagline.motion.profile import QUINTIC
from sagline.motion.rest_to_rest import quintic_path
from sagline.robot.pose import Pose
from sagline.tension.minimum_norm import MinimumNorm

HOME = (0.0, 0.0, 1.5)  # m, the prototype's home position
METHOD = MinimumNorm("horizontal")
TOUR_SPEED = 0.2  # m/s, ours: the article says "low speed"
STEP = 0.01  # of a plausible error, for the slopes
NEWTON_STEPS = 8
SETTLED = 1e-3  # of a plausible error


class Trend(NamedTuple):
    """One parameter off by a typical error.

    Attributes:
        parameter: The parameter.
        error: Predicted actual less desired position [m], shape (10, 3).
        height_slope: Change of the vertical error with the height of the pose, mm per m; the measured one is negative.
        height_correlation: Correlation of the vertical error with the height.
    """

    parameter: Parameter
    error: Array
    height_slope: float
    height_correlation: float


class Tour(NamedTuple):
    """The prototype's way through the ten poses.

    Attributes:
        plan: Planned along it with the empirical model.
        stops: When it passes the ten poses [s], shape (10,).
    """

    plan: Plan
    stops: Array


class Guess(NamedTuple):
    """Errors of some parameters fitted with slopes at zero.

    Attributes:
        parameters: The parameters.
        values: Their errors, each in its unit, shape (k,).
        rms: Root mean square of measured less predicted position, over all coordinates [m].
    """

    parameters: tuple[Parameter, ...]
    values: Array
    rms: float


class Explanation(NamedTuple):
    """The errors of some parameters, none beyond what we think plausible, that fit the measured positions best.

    Attributes:
        parameters: The parameters.
        values: Their errors, each in its unit, shape (k,).
        predicted: Actual less desired position with these errors [m], shape (10, 3).
        rms: Root mean square of measured less predicted position, over all coordinates [m].
        worst: Largest distance of measured and predicted position [m].
        at_limit: Whether a value has run into the limit of what is plausible.
    """

    parameters: tuple[Parameter, ...]
    values: Array
    predicted: Array
    rms: float
    worst: float
    at_limit: bool


@dataclass(frozen=True, slots=True, eq=False)
class TenPoses:
    """The ten poses.

    Attributes:
        table: The article's Table 2.
        plan: The prototype's plan for them, with the empirical model.
        home: The plan of its home pose.
        model_error: Error that the empirical model itself makes at the ten poses [m], shape (10, 3).
        height_line: Line of least squares of the measured vertical error over the height of the pose.
        trends: One parameter off at a time.
        explanations: The best explanations by one, by two and by three parameters, best first within each.
        unlimited: The best fit by as many parameters as the last explanations have, whatever the values.
        measured_rms: Root mean square of the measured errors, over all coordinates [m].
    """

    table: Table2
    plan: Plan
    home: Plan
    model_error: Array
    height_line: Line
    trends: tuple[Trend, ...]
    explanations: tuple[tuple[Explanation, ...], ...]
    unlimited: Guess
    measured_rms: float


def ten_poses(parameters: Sequence[Parameter] = PARAMETERS, most: int = 3, best: int = 4) -> TenPoses:
    """Plan the prototype at the ten poses, and look for what explains its measured errors.

    Every combination of up to three parameters is fitted with slopes at zero, within what we think plausible; the best
    are then fitted with the whole model. Positions are printed in whole millimeters: no fit can be better than 0.3 mm.

    Args:
        parameters: What may be off.
        most: Largest number of parameters in an explanation.
        best: How many explanations by two or more parameters to keep; by one, all.

    Returns:
        The study.
    """
    table, machine = table2(), Machine(load_robot("article-prototype"))
    plan = _planned(machine, table.desired)
    home = _planned(machine, np.array([HOME]))
    nominal = machine.rest(plan, home)

    def error_of(chosen: Sequence[Parameter], values: Array) -> Array:
        changed = reduce(lambda m, pair: pair[0].changed(m, float(pair[1])), zip(chosen, values, strict=True), machine)
        return changed.rest(plan, home) - table.desired

    zero = np.zeros(1)
    slopes = {p.name: _slope([p], zero, 0, nominal - table.desired, error_of) for p in parameters}
    trends = [_trend(p, error_of([p], np.array([p.typical])), table) for p in parameters]
    missing = (table.actual - nominal).ravel()
    explanations = []
    for count in range(1, most + 1):
        guesses = [_guess(chosen, slopes, missing, limited=True) for chosen in combinations(parameters, count)]
        kept = len(guesses) if count == 1 else best
        ranked = sorted(guesses, key=lambda guess: guess.rms)[:kept]
        fitted = [_fitted(guess, error_of, table.error) for guess in ranked]
        explanations.append(tuple(sorted(fitted, key=lambda found: found.rms)))
    wild = [_guess(chosen, slopes, missing, limited=False) for chosen in combinations(parameters, most)]
    return TenPoses(
        table=table,
        plan=plan,
        home=home,
        model_error=nominal - table.desired,
        height_line=fit_line(table.desired[:, 2], table.error[:, 2]),
        trends=tuple(trends),
        explanations=tuple(explanations),
        unlimited=min(wild, key=lambda guess: guess.rms),
        measured_rms=float(np.sqrt(np.mean(table.error**2))),
    )


def tour(rate: float = 10.0) -> Tour:
    """The prototype's way from its home position through the ten poses and back, from rest to rest, without stops.

    Args:
        rate: Samples per second [1/s].

    Returns:
        The tour.
    """
    stops = [HOME, *table2().desired, HOME]
    path = quintic_path(stops, speed=TOUR_SPEED, rate=rate)
    plan = inverse(load_robot("article-prototype"), path, Empirical(), METHOD)
    way = np.linalg.norm(np.diff(np.asarray(stops), axis=0), axis=1)
    return Tour(plan, locked(np.cumsum(way * QUINTIC.peak_speed / TOUR_SPEED)[:-1]))


def _planned(machine: Machine, positions: Array) -> Plan:
    return inverse(machine.robot, Pose.from_euler(positions, 0.0, 0.0, 0.0), Empirical(), METHOD)


def _trend(parameter: Parameter, error: Array, table: Table2) -> Trend:
    height = table.desired[:, 2]
    line = fit_line(height, 1e3 * error[:, 2])
    return Trend(parameter, error, float(line.slope), float(np.corrcoef(height, error[:, 2])[0, 1]))


def _fitted(guess: Guess, error_of: Callable[[Sequence[Parameter], Array], Array], measured: Array) -> Explanation:
    """Least squares within the plausible errors by Gauss-Newton, from the guess on."""
    chosen, values = guess.parameters, guess.values
    low, high = _limits(chosen)
    predicted = error_of(chosen, values)
    for _ in range(NEWTON_STEPS):
        matrix = np.stack([_slope(chosen, values, k, predicted, error_of) for k in range(len(chosen))], axis=1)
        new = _bounded(matrix, (measured - predicted).ravel() + matrix @ values, low, high)
        step, values = float(np.abs((new - values) / high).max()), new
        predicted = error_of(chosen, values)
        if step < SETTLED:
            break
    rest = measured - predicted
    return Explanation(
        parameters=chosen,
        values=values,
        predicted=predicted,
        rms=float(np.sqrt(np.mean(rest**2))),
        worst=float(np.linalg.norm(rest, axis=1).max()),
        at_limit=bool(np.any((values <= 0.999 * low) & (low < 0.0) | (values >= 0.999 * high))),
    )


def _slope(
    chosen: Sequence[Parameter],
    values: Array,
    k: int,
    error: Array,
    error_of: Callable[[Sequence[Parameter], Array], Array],
) -> Array:
    """Change of the errors with the k-th value, shape (30,), by a difference away from its limit."""
    step = -STEP * chosen[k].plausible if values[k] > 0.0 else STEP * chosen[k].plausible
    moved = values.copy()
    moved[k] += step
    slope: Array = (error_of(chosen, moved) - error).ravel() / step
    return slope


def _guess(chosen: tuple[Parameter, ...], slopes: Mapping[str, Array], missing: Array, *, limited: bool) -> Guess:
    matrix = _matrix(chosen, slopes)
    values = _bounded(matrix, missing, *_limits(chosen)) if limited else np.asarray(np.linalg.lstsq(matrix, missing)[0])
    return Guess(chosen, values, float(np.sqrt(np.mean((missing - matrix @ values) ** 2))))


def _matrix(chosen: Sequence[Parameter], slopes: Mapping[str, Array]) -> Array:
    return np.stack([slopes[parameter.name] for parameter in chosen], axis=1)


def _limits(chosen: Sequence[Parameter]) -> tuple[Array, Array]:
    high = np.array([parameter.plausible for parameter in chosen])
    low = np.array([0.0 if parameter.positive else -parameter.plausible for parameter in chosen])
    return low, high


def _bounded(matrix: Array, right: Array, low: Array, high: Array) -> Array:
    """Least squares within bounds; each unknown is counted in its upper bound, which makes them comparable."""
    from scipy.optimize import lsq_linear

    values: Array = high * lsq_linear(matrix * high, right, bounds=(low / high, np.ones_like(high))).x
    return values
