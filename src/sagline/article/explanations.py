"""Errors of the prototype's parameters: robots with such errors, and fits of the errors to measured positions."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from itertools import combinations
from typing import Any, NamedTuple, TypeAlias

import numpy as np

import sagline as sl
from sagline.core.arrays import Array, Flags
from sagline.core.numbers import n
from sagline.robot.batch import has_routing

MODULUS, DENSITY, LOAD = "Young's modulus E", "linear density ρ", "load"
ANCHORS, DRUM, ZERO = "anchor height", "drum radius", "zero of the lengths"
PULLEY, DEAD = "pulley radius", "dead cable"
WIDTH, HEIGHT = "platform anchors, outward", "platform anchors, up and down"
Errors: TypeAlias = Mapping[str, float]  # parameter name: error in the unit of the parameter; a missing error is zero


class Parameter(NamedTuple):
    """Parameter of the prototype that may differ from Table 1, with the same error for all cables."""

    name: str
    unit: str  # unit of the error
    typical: float  # typical error, in this unit
    plausible: float  # largest plausible error, in this unit; an assumption, because the article does not state errors
    positive: bool = False  # True if the error can only be positive


PARAMETERS = (
    Parameter(MODULUS, "%", 20.0, 50.0),
    Parameter(DENSITY, "%", 20.0, 30.0),
    Parameter(LOAD, "kg", -2.0, 5.0),
    Parameter(ANCHORS, "mm", 20.0, 50.0),
    Parameter(DRUM, "%", -1.0, 3.0),
    Parameter(ZERO, "mm", -10.0, 50.0),
    Parameter(PULLEY, "mm", 30.0, 60.0, positive=True),
    Parameter(DEAD, "m", 0.2, 4.0, positive=True),
    Parameter(WIDTH, "mm", 10.0, 20.0),
    Parameter(HEIGHT, "mm", 10.0, 20.0),
)


def robot_with_errors(robot: sl.Robot, errors: Errors) -> sl.Robot:
    """Robot with the errors `errors` of anchors, cables, routing and load."""
    off = {parameter.name: 0.0 for parameter in PARAMETERS} | dict(errors)
    cables, winches, outward = robot.cables, robot.winches, np.sign(robot.platform_anchors)
    changes: dict[str, Any] = {}  # only parts with errors are copied, because a fit needs a thousand robots
    if off[MODULUS] or off[DENSITY]:
        changes["cables"] = cables.replace(
            axial_stiffness=cables.axial_stiffness * (1.0 + 0.01 * off[MODULUS]),
            linear_density=cables.linear_density * (1.0 + 0.01 * off[DENSITY]),
        )
    if off[PULLEY] or off[DEAD]:
        winches = sl.Winch() if winches is None else winches
        changes["winches"] = winches.replace(
            pulley_radius=winches.pulley_radius + 1e-3 * off[PULLEY], dead_cable=winches.dead_cable + off[DEAD]
        )
    return robot.replace(
        mass=robot.mass + off[LOAD],
        frame_anchors=robot.frame_anchors + np.array([0.0, 0.0, 1e-3 * off[ANCHORS]]),
        platform_anchors=robot.platform_anchors + 1e-3 * outward * [off[WIDTH], off[WIDTH], off[HEIGHT]],
        **changes,
    )


def wound_lengths(plan: sl.Plan, home: sl.Plan, errors: Errors) -> Array:
    """Actual lengths of the cables if the winches follow the lengths of `plan` after homing at `home`."""
    from_home = plan.unstrained_length - home.unstrained_length
    return plan.unstrained_length + 0.01 * errors.get(DRUM, 0.0) * from_home + 1e-3 * errors.get(ZERO, 0.0)


def rest_positions(robot: sl.Robot, plan: sl.Plan, home: sl.Plan, errors: Sequence[Errors]) -> Array:
    """Equilibrium positions (K, N, 3) [m] of K robots with `errors` that execute `plan`, a plan without errors."""
    # At home, the encoders are set to the planned lengths. A constant length on or behind the pulleys therefore has no
    # effect.
    robots = [robot_with_errors(robot, one) for one in errors]
    off_drum = np.stack([wound_lengths(plan, home, one) for one in errors]) + _not_counted(robots, home)[:, None]
    count, poses, m = off_drum.shape
    repeated = [one for one in robots for _ in range(poses)]
    found = sl.forward(repeated, off_drum.reshape(-1, m), start=plan.state.pose[np.tile(np.arange(poses), count)])
    if not found.solved.all():
        index = int(np.argmin(found.solved))
        without, step = f"without a stable equilibrium at pose {index % poses}", "Reduce the change of the robot."
        raise sl.InvalidValueError("the changed robot", without, "smaller changes", step)
    return found.pose.position.reshape(count, poses, 3)


def _not_counted(robots: Sequence[sl.Robot], home: sl.Plan) -> Array:
    """Cable lengths on the pulleys plus dead lengths, at the home pose [m], shape (K, m)."""
    added = np.zeros((len(robots), home.unstrained_length.shape[-1]))
    behind = [index for index, robot in enumerate(robots) if has_routing(robot)]
    if behind:
        pose = home.state.pose[np.zeros(len(behind), dtype=int)]
        there = [robots[index] for index in behind]
        bare = [robot.replace(winches=None) for robot in there]
        with_them, without = (sl.inverse(some, pose, tension=home.tension).unstrained_length for some in (there, bare))
        added[behind] = with_them - without
    return added


STEP = 0.01  # step of the difference quotients, relative to the upper limit of the parameter's error
ITERATIONS = 20
CONVERGED = 1e-5  # largest motion of the platform [m] in the last step of a converged fit; Table 2 is in millimeters
NEAR = 1e-3  # largest distance from a limit, relative to the upper limit, of a value that counts as at the limit

Model: TypeAlias = tuple[Parameter, ...]
ErrorOf: TypeAlias = Callable[[Sequence[Errors]], Array]  # gives actual minus desired positions [m], (K, N, 3)


class Explanation:
    """Best fit of the errors of k parameters, within plausible limits, to the measured positions."""

    def __init__(self, model: Model, values: Array, slopes: Array, predicted: Array, measured: Array) -> None:
        """Evaluate the fitted `values`; `slopes`: derivatives of the positions."""
        rest = measured - predicted
        # values: errors of the parameters in their units, shape (k,)
        # predicted: actual minus desired position with these errors [m], shape (N, 3)
        self.parameters, self.values, self.predicted = model, values, predicted
        # rms: root mean square of measured minus predicted position, over all coordinates [m]
        # worst: largest distance of measured and predicted position [m]
        self.rms, self.worst = float(np.sqrt(np.mean(rest**2))), float(np.linalg.norm(rest, axis=1).max())
        low, high = _limits(model)
        # errors that are at their plausible limit, shape (k,)
        self.at_limit: Flags = (values >= (1.0 - NEAR) * high) | (values <= low + NEAR * high)
        # standard deviations of the errors in their units, shape (k,); NaN at a limit
        self.deviation = _deviation(slopes, ~self.at_limit, rest)
        # Akaike's information criterion, corrected for few measurements. Smaller values are better. A difference of 2
        # is not significant
        self.aicc = corrected_aic(self.rms, rest.size, len(model))
        # as `rms`, but the prediction of each pose comes from a fit to all other poses [m]
        self.left_out = _left_out(model, values, slopes, rest)

    @property
    def names(self) -> frozenset[str]:
        """Names of the parameters."""
        return frozenset(parameter.name for parameter in self.parameters)

    def place(self, name: str) -> int:
        """Index of the parameter with the name `name`."""
        return [parameter.name for parameter in self.parameters].index(name)

    def value(self, name: str) -> str:
        """Text of the value of `name` with its standard uncertainty; a value at a limit has the mark "(limit)"."""
        k = self.place(name)
        number, unit = self.values[k], self.parameters[k].unit
        if self.at_limit[k]:
            return f"{n(number, '+.3g', unit)} (limit)"
        return n(number, unit=unit, uncertainty=self.deviation[k])

    @property
    def text(self) -> str:
        """Names and values of all parameters."""
        return ", ".join(f"{parameter.name} {self.value(parameter.name)}" for parameter in self.parameters)


def explanations(error_of: ErrorOf, measured: Array, models: Sequence[Model]) -> tuple[Explanation, ...]:
    """Fit every model to the measured positions by Gauss-Newton steps, with errors within plausible limits."""
    values, slopes = _start(error_of, measured, models)
    steps = [np.zeros(len(model)) for model in models]
    moving = list(range(len(models)))
    for _ in range(ITERATIONS):
        near = tangents(error_of, [models[i] for i in moving], [values[i] for i in moving])
        far = []
        for i, (error, slope) in zip(moving, near, strict=True):
            right = measured.ravel() - error + slope @ values[i]
            step = _bounded_least_squares(models[i], slope, right) - values[i]
            if step @ steps[i] < 0.0:  # the steps oscillate about the solution
                step *= 0.5
            values[i], steps[i], slopes[i] = values[i] + step, step, slope
            if np.abs(slope @ step).max() > CONVERGED:
                far.append(i)
        moving = far
        if not moving:
            break
    else:
        names = ", ".join(parameter.name for parameter in models[moving[0]])
        raise sl.InvalidValueError(
            f"the fit of {names}", f"still moving after {ITERATIONS} steps", "fits that converge", "Omit this model."
        )
    found = error_of([_errors(*of) for of in zip(models, values, strict=True)])
    return tuple(Explanation(*of, measured) for of in zip(models, values, slopes, found, strict=True))


def subsets(parameters: Sequence[Parameter], most: int) -> list[Model]:
    """All sets of one to `most` parameters, each of which is a model."""
    return [model for count in range(1, most + 1) for model in combinations(parameters, count)]


def tangents(error_of: ErrorOf, models: Sequence[Model], values: Sequence[Array]) -> list[tuple[Array, Array]]:
    """Position errors (3 N,) [m] and derivatives (3 N, k) [m per unit] for each pair of `models` and `values`."""
    # near an upper limit, the step of the finite difference is negative
    points, steps = [], []
    for model, x in zip(models, values, strict=True):
        high = _limits(model)[1]
        step = np.where(x > (1.0 - STEP) * high, -STEP, STEP) * high
        points.append(np.vstack((x, x + np.diag(step))))
        steps.append(step)
    rows = [_errors(model, row) for model, some in zip(models, points, strict=True) for row in some]
    found = error_of(rows).reshape(len(rows), -1)
    parts = np.split(found, np.cumsum([len(some) for some in points])[:-1])
    return [(part[0], ((part[1:] - part[0]) / step[:, None]).T) for part, step in zip(parts, steps, strict=True)]


def _limits(model: Model) -> tuple[Array, Array]:
    """Lower and upper limits of the plausible errors of a model's parameters in their units, shape (k,)."""
    high = np.array([parameter.plausible for parameter in model])
    return np.where([parameter.positive for parameter in model], 0.0, -high), high


def _bounded_least_squares(model: Model, slopes: Array, right: Array) -> Array:
    """Least-squares solution within the limits; the solver's unknowns are errors divided by their upper limits."""
    from scipy.optimize import lsq_linear

    low, high = _limits(model)
    return np.asarray(high * lsq_linear(slopes * high, right, bounds=(low / high, np.ones_like(high)), method="bvls").x)


def corrected_aic(rms: float, count: int, parameters: int) -> float:
    """Akaike's information criterion, corrected for a small number `count` of measurements; `rms` is in m."""
    # source: Hurvich and Tsai 1989, Biometrika 76(2), 297-307
    unknown = parameters + 1
    return float(
        2.0 * count * np.log(1e3 * rms) + 2.0 * unknown + 2.0 * unknown * (unknown + 1) / (count - unknown - 1)
    )


def _errors(model: Model, values: Array) -> Errors:
    return {parameter.name: float(value) for parameter, value in zip(model, values, strict=True)}


def _start(error_of: ErrorOf, measured: Array, models: Sequence[Model]) -> tuple[list[Array], list[Array]]:
    """Initial values for the fit of every model, and derivatives of the positions at zero errors."""
    alone: list[Model] = [(parameter,) for parameter in dict.fromkeys(p for model in models for p in model)]
    near = dict(zip(alone, tangents(error_of, alone, [np.zeros(1)] * len(alone)), strict=True))
    slopes = [np.hstack([near[(parameter,)][1] for parameter in model]) for model in models]
    values = [
        _bounded_least_squares(model, slope, measured.ravel() - near[model[:1]][0])
        for model, slope in zip(models, slopes, strict=True)
    ]
    return values, slopes


def _deviation(slopes: Array, free: Flags, rest: Array) -> Array:
    """Standard deviations of the values, computed from the residuals `rest`; NaN for values at a limit."""
    normal = slopes[:, free].T @ slopes[:, free]
    scatter = np.sum(rest**2) / (rest.size - free.sum())
    deviation = np.full(free.size, np.nan)
    deviation[free] = np.sqrt(scatter * np.diag(np.linalg.inv(normal)))
    return deviation


def _left_out(model: Model, values: Array, slopes: Array, rest: Array) -> float:
    """Cross-validation: rms error [m] if each pose is predicted by a linear fit to all other poses."""
    right, pose = rest.ravel() + slopes @ values, np.arange(rest.size) // rest.shape[1]
    left = [
        right[pose == k] - slopes[pose == k] @ _bounded_least_squares(model, slopes[pose != k], right[pose != k])
        for k in range(len(rest))
    ]
    return float(np.sqrt(np.mean(np.square(left))))
