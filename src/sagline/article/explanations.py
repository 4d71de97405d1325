"""Least-squares fits of parameter errors to measured positions, with an information criterion for each fit."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import combinations
from typing import NamedTuple, TypeAlias

import numpy as np

import sagline as sl
from sagline.article.machine import Errors, Parameter
from sagline.core.arrays import Array, Flags

STEP = 0.01  # step of the difference quotients, relative to the typical error of the parameter
ITERATIONS = 20
CONVERGED = 1e-5  # a fit has converged if its last step moves the platform by less [m]; Table 2 has millimeters
NEAR = 1e-3  # a value is at its limit if its distance from the limit, relative to the typical error, is smaller

Model: TypeAlias = tuple[Parameter, ...]
ErrorOf: TypeAlias = Callable[[Sequence[Errors]], Array]  # actual minus desired positions of K machines [m], (K, N, 3)


class Explanation(NamedTuple):
    """Best fit to the measured positions by errors of some parameters; the errors are within plausible limits."""

    parameters: Model  # the parameters, k of them
    values: Array  # errors of the parameters in their units, shape (k,)
    deviation: Array  # standard deviations of the errors in their units, shape (k,); NaN at a limit
    at_limit: Flags  # True for errors that are at their plausible limit, shape (k,)
    predicted: Array  # actual minus desired position with these errors [m], shape (N, 3)
    rms: float  # root mean square of measured minus predicted position, over all coordinates [m]
    worst: float  # largest distance of measured and predicted position [m]
    # Akaike's information criterion, corrected for few measurements; smaller values are better, and a difference of 2
    # is small
    aicc: float
    # root mean square of measured minus predicted position over all coordinates [m]; the prediction of a pose is from a
    # fit to all other poses
    left_out: float

    @property
    def names(self) -> frozenset[str]:
        """Names of the parameters."""
        return frozenset(parameter.name for parameter in self.parameters)


class _Tangent(NamedTuple):
    """First-order model of the positions, about given errors of the parameters."""

    error: Array  # actual minus desired position, shape (3 N,) [m]
    slopes: Array  # derivatives with respect to each parameter, shape (3 N, k) [m per unit of the parameter]


def explanations(error_of: ErrorOf, measured: Array, models: Sequence[Model]) -> tuple[Explanation, ...]:
    """Fit all models together to measured positions, by Gauss-Newton steps within plausible limits."""
    values, slopes = _start(error_of, measured, models)
    steps = [np.zeros(len(model)) for model in models]
    moving = list(range(len(models)))
    for _ in range(ITERATIONS):
        near = tangents(error_of, [models[i] for i in moving], [values[i] for i in moving])
        far = []
        for i, one in zip(moving, near, strict=True):
            right = measured.ravel() - one.error + one.slopes @ values[i]
            step = _bounded_least_squares(models[i], one.slopes, right) - values[i]
            if step @ steps[i] < 0.0:  # opposite to the previous step: the steps oscillate about the solution
                step *= 0.5
            values[i], steps[i], slopes[i] = values[i] + step, step, one.slopes
            if np.abs(one.slopes @ step).max() > CONVERGED:
                far.append(i)
        moving = far
        if not moving:
            break
    else:
        names = ", ".join(parameter.name for parameter in models[moving[0]])
        raise sl.InvalidValueError(
            f"the fit of {names}",
            f"still moving after {ITERATIONS} steps",
            "fits that converge",
            "Omit this model.",
        )
    found = error_of([_errors(*of) for of in zip(models, values, strict=True)])
    return tuple(_explanation(*of, measured) for of in zip(models, values, slopes, found, strict=True))


def subsets(parameters: Sequence[Parameter], most: int) -> list[Model]:
    """All models with one parameter, with two parameters, and so on."""
    return [model for count in range(1, most + 1) for model in combinations(parameters, count)]


def tangents(error_of: ErrorOf, models: Sequence[Model], values: Sequence[Array]) -> list[_Tangent]:
    """First-order model of each fit at its values; the steps of finite differences are away from upper limits."""
    points, steps = [], []
    for model, x in zip(models, values, strict=True):
        high = limits(model)[1]
        step = np.where(x > (1.0 - STEP) * high, -STEP, STEP) * high
        points.append(np.vstack((x, x + np.diag(step))))
        steps.append(step)
    rows = [_errors(model, row) for model, some in zip(models, points, strict=True) for row in some]
    found = error_of(rows).reshape(len(rows), -1)
    parts = np.split(found, np.cumsum([len(some) for some in points])[:-1])
    return [
        _Tangent(part[0], ((part[1:] - part[0]) / step[:, None]).T) for part, step in zip(parts, steps, strict=True)
    ]


def limits(model: Model) -> tuple[Array, Array]:
    """Lower and upper limits of the plausible errors of a model's parameters in their units, shape (k,)."""
    high = np.array([parameter.plausible for parameter in model])
    return np.where([parameter.positive for parameter in model], 0.0, -high), high


def _bounded_least_squares(model: Model, slopes: Array, right: Array) -> Array:
    """Least-squares solution within the limits; unknowns are divided by their upper limits."""
    from scipy.optimize import lsq_linear

    low, high = limits(model)
    values: Array = high * lsq_linear(slopes * high, right, bounds=(low / high, np.ones_like(high)), method="bvls").x
    return values


def corrected_aic(rms: float, count: int, parameters: int) -> float:
    """Akaike's information criterion, corrected for a small number of measurements."""
    # source: Hurvich and Tsai 1989, Biometrika 76(2), 297-307
    unknown = parameters + 1
    return float(
        2.0 * count * np.log(1e3 * rms) + 2.0 * unknown + 2.0 * unknown * (unknown + 1) / (count - unknown - 1)
    )


def _errors(model: Model, values: Array) -> Errors:
    return {parameter.name: float(value) for parameter, value in zip(model, values, strict=True)}


def _start(error_of: ErrorOf, measured: Array, models: Sequence[Model]) -> tuple[list[Array], list[Array]]:
    """Initial values and first-order model of every fit, from common derivatives at zero errors."""
    alone: list[Model] = [(parameter,) for parameter in dict.fromkeys(p for model in models for p in model)]
    near = {
        model[0]: one for model, one in zip(alone, tangents(error_of, alone, [np.zeros(1)] * len(alone)), strict=True)
    }
    slopes = [np.hstack([near[parameter].slopes for parameter in model]) for model in models]
    values = [
        _bounded_least_squares(model, one, measured.ravel() - near[model[0]].error)
        for model, one in zip(models, slopes, strict=True)
    ]
    return values, slopes


def _explanation(model: Model, values: Array, slopes: Array, predicted: Array, measured: Array) -> Explanation:
    rest = measured - predicted
    rms = float(np.sqrt(np.mean(rest**2)))
    low, high = limits(model)
    at_limit = (values >= (1.0 - NEAR) * high) | (values <= low + NEAR * high)
    return Explanation(
        parameters=model,
        values=values,
        deviation=_deviation(slopes, ~at_limit, rest),
        at_limit=at_limit,
        predicted=predicted,
        rms=rms,
        worst=float(np.linalg.norm(rest, axis=1).max()),
        aicc=corrected_aic(rms, rest.size, len(model)),
        left_out=_left_out(model, values, slopes, rest),
    )


def _deviation(slopes: Array, free: Flags, rest: Array) -> Array:
    """Standard deviations of the values from the residuals; NaN for values at a limit."""
    normal = slopes[:, free].T @ slopes[:, free]
    scatter = np.sum(rest**2) / (rest.size - free.sum())
    deviation = np.full(free.size, np.nan)
    deviation[free] = np.sqrt(scatter * np.diag(np.linalg.inv(normal)))
    return deviation


def _left_out(model: Model, values: Array, slopes: Array, rest: Array) -> float:
    """Cross-validation: rms error [m] of all poses, each of which a linear fit to all other poses predicts."""
    right, pose = rest.ravel() + slopes @ values, np.arange(rest.size) // rest.shape[1]
    left = [
        right[pose == k] - slopes[pose == k] @ _bounded_least_squares(model, slopes[pose != k], right[pose != k])
        for k in range(len(rest))
    ]
    return float(np.sqrt(np.mean(np.square(left))))
