"""Density and stiffness of a real cable from measured lengths and tensions."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Literal, get_args

import numpy as np
from numpy.typing import ArrayLike

from sagline.cables.cable import Cable
from sagline.cables.models import Catenary
from sagline.core.arguments import brief, choice, optional
from sagline.core.arrays import Array, checked, locked, number
from sagline.core.errors import InvalidValueError
from sagline.core.numbers import n
from sagline.core.results import Result

TensionAt = Literal["frame_end", "platform_end", "chord"]
UNITS = {"linear_density": "kg/m", "axial_stiffness": "N", "length_offset": "m"}
TOO_LOOSE = 0.5  # largest relative standard error of a value that counts as determined
TOO_CLOSE = 0.95  # largest correlation of two values that count as separable
ITERATIONS = 30  # largest number of iterations of the chord tension for a measured tension at an end
WEIGHTINGS = 3  # number of computations of the weights, which depend slightly on the solution
_BOUNDS = {  # of the solver's unknowns, wide enough for every rope: 1 mg/m to 1 t/m, and 1 N to 1 PN
    "linear_density": (np.log(1e-6), np.log(1e3)),
    "axial_stiffness": (0.0, np.log(1e15)),
    "length_offset": (-np.inf, np.inf),
}
_ADVICE = {
    "linear_density": "measure at lower tensions or longer spans, to increase the sag",
    "axial_stiffness": "measure at higher tensions, to increase the stretch",
}


@dataclass(frozen=True, slots=True, eq=False)
class CableFit(Result):
    """Result of `identify_cable`.

    Attributes:
        cable: The identified cable.
        names: Names of the unknowns in the order of `values`: "linear_density" [kg/m], "axial_stiffness" [N],
            "length_offset" [m]. A positive offset means that the measured lengths are too long.
        values: Estimates, shape (k,).
        covariance: Covariance of the values, shape (k, k), computed from the given standard errors.
        residuals: Measured minus predicted length [m], shape (n,).
        chi_squared: Sum of squares of the residuals in standard errors, divided by the degrees of freedom. The value is
            about 1 if the cable model and the standard errors are correct, and much larger if one of them is wrong.
    """

    cable: Cable
    names: tuple[str, ...]
    values: Array
    covariance: Array
    residuals: Array
    chi_squared: float

    @property
    def standard_error(self) -> Array:
        """Standard error of each value, in its unit, shape (k,)."""
        return np.sqrt(np.diag(self.covariance))

    @property
    def correlation(self) -> Array:
        """Correlations between the values, shape (k, k)."""
        error = self.standard_error
        return np.asarray(self.covariance / np.outer(error, error))

    @property
    def warnings(self) -> tuple[str, ...]:
        """Texts about values that the measurements do not determine or do not separate; may be empty."""
        found = []
        for name, value, error in zip(self.names, self.values, self.standard_error, strict=True):
            if name != "length_offset" and error > TOO_LOOSE * value:
                found.append(
                    f"{name} is not determined: {n(value, unit=UNITS[name], uncertainty=error)}; {_ADVICE[name]}"
                )
        correlation = self.correlation
        for i, first in enumerate(self.names):
            for j, second in enumerate(self.names[:i]):
                if abs(correlation[i, j]) > TOO_CLOSE:
                    found.append(
                        f"{second} and {first} cannot be separated (correlation {correlation[i, j]:+.3f}); "
                        "measure over a wider range of tensions"
                    )
        return tuple(found)


def identify_cable(
    span: ArrayLike,
    rise: ArrayLike,
    unstrained_length: ArrayLike,
    tension: ArrayLike,
    *,
    length_error: float = 1e-3,
    tension_error: float = 1.0,
    tension_at: TensionAt = "frame_end",
    unknowns: Sequence[str] = ("linear_density", "axial_stiffness"),
    start: Cable | None = None,
    gravity: float = 9.81,
) -> CableFit:
    """Find a cable's density and stiffness from measured lengths and tensions by weighted least squares.

    An exact cable with the measured tension gives the predicted length. The residual, measured minus predicted length,
    is divided by its standard error, which includes the errors of length and tension.

    Args:
        span: Horizontal distance between the ends of the cable [m], shape (n,), > 0.
        rise: Height of the platform end above the frame end [m], shape (n,).
        unstrained_length: Measured unstrained length, for example from an encoder [m], shape (n,), > 0.
        tension: Measured tension [N], shape (n,), > 0.
        length_error: Standard error of a length [m], > 0.
        tension_error: Standard error of a tension [N], > 0.
        tension_at: Kind of the measured tension: "frame_end" (load cell at the winch), "platform_end" or "chord".
        unknowns: Names of the unknowns: "linear_density", "axial_stiffness", "length_offset", or some of these.
        start: Cable with initial values of unknowns and values of known parameters; None for 0.1 kg/m and 100 kN.
        gravity: Gravitational acceleration [m/s^2], > 0.

    Returns:
        The fit, with covariance and `.warnings`.

    Raises:
        InvalidValueError: If there are fewer measurements than unknowns, or a value is out of range.

    Examples:
        >>> import sagline as sl
        >>> cable = sl.Cable(linear_density=0.067, axial_stiffness=44e3)
        >>> span, rise, tension = [8.0, 9.0, 10.0], [1.0, 2.0, 3.0], [60.0, 90.0, 200.0]
        >>> state = sl.Catenary().from_tension(cable, span, rise, tension)
        >>> fit = sl.identify_cable(
        ...     span, rise, state.unstrained_length, state.frame_end_tension
        ... )
        >>> round(float(fit.cable.linear_density), 4)
        0.067
    """
    names = _checked_unknowns(unknowns)
    choice(tension_at, "tension_at", get_args(TensionAt))
    data = (
        checked(span, "span", "m", shape=(None,), above=0.0),
        checked(rise, "rise", "m", shape=(None,)),
        checked(unstrained_length, "unstrained_length", "m", shape=(None,), above=0.0),
        checked(tension, "tension", "N", shape=(None,), above=0.0),
    )
    acceleration = number(gravity, "gravity", "m/s^2", above=0.0)
    sizes = {array.shape for array in data}
    if len(sizes) > 1 or data[0].size < len(names):
        allowed = f"four arrays of equal length, at least {len(names)}"
        step = "Give span, rise, length and tension of at least one measurement per unknown."
        raise InvalidValueError("the measurements", f"of shapes {sorted(sizes)}", allowed, step)
    errors = (
        number(length_error, "length_error", "m", above=0.0),
        number(tension_error, "tension_error", "N", above=0.0),
    )
    predicted = partial(_predicted_length, span=data[0], rise=data[1], tension_at=tension_at, gravity=acceleration)
    return _fit(predicted, *data[2:], names, _checked_start(start), *errors)


def _predicted_length(
    cable: Cable, tension: Array, *, span: Array, rise: Array, tension_at: TensionAt, gravity: float
) -> Array:
    """Lengths [m] of exact cables that have the tension `tension` [N] at the place `tension_at`."""
    chord = np.hypot(span, rise)
    half = 0.5 * cable.linear_density * gravity * chord
    side = {"frame_end": 1.0, "platform_end": -1.0, "chord": 0.0}[tension_at]
    across = half * span / chord if side else 0.0
    floor = 1e-3 * tension  # lower limit: half of the cable's weight can exceed the measured tension
    tau = np.maximum(side * half * rise / chord + np.sqrt(np.maximum(tension**2 - across**2, 0.0)), floor)
    state = Catenary().from_tension(cable, span, rise, tau, gravity)
    for _ in range(ITERATIONS if side else 0):
        measured = state.frame_end_tension if side > 0.0 else state.platform_end_tension
        step = tension - measured
        tau = np.maximum(tau + step, floor)
        state = Catenary().from_tension(cable, span, rise, tau, gravity)
        if np.abs(step).max() <= 1e-10 * tension.max():
            break
    return state.unstrained_length


def _fit(
    predicted: Callable[[Cable, Array], Array],
    length: Array,
    tension: Array,
    names: tuple[str, ...],
    known: Cable,
    length_error: float,
    tension_error: float,
) -> CableFit:
    from scipy.optimize import least_squares

    # The solver's unknowns are logarithms of density and stiffness, which keep both positive, and the offset in mm.
    scale = np.array([1e-3 if name == "length_offset" else 1.0 for name in names])
    unknown = np.array([0.0 if name == "length_offset" else np.log(float(getattr(known, name))) for name in names])
    spread, bounds = np.full(length.size, length_error), np.transpose([_BOUNDS[name] for name in names])

    def cable_of(x: Array) -> tuple[Cable, float]:
        given = dict(zip(names, x, strict=True))
        offset = 1e-3 * float(given.pop("length_offset", 0.0))
        return known.replace(**{name: np.exp(logarithm) for name, logarithm in given.items()}), offset

    def residuals(x: Array) -> Array:
        cable, offset = cable_of(x)
        return length - offset - predicted(cable, tension)

    for _ in range(WEIGHTINGS):
        found = least_squares(lambda x: residuals(x) / spread, unknown, x_scale="jac", bounds=bounds)  # noqa: B023
        unknown = found.x
        cable, offset = cable_of(unknown)
        higher, lower = (predicted(cable, f * tension) for f in (1.0 + 1e-4, 1.0 - 1e-4))
        slope = (higher - lower) / (2e-4 * tension)
        spread = np.hypot(length_error, slope * tension_error)
    # the covariance uses the weights of the last iteration
    jacobian = found.jac
    covariance = np.linalg.pinv(jacobian.T @ jacobian, rcond=1e-14)
    values = np.array([offset if name == "length_offset" else float(getattr(cable, name)) for name in names])
    unit = np.where(scale < 1.0, scale, values)  # derivative of the value by the solver's unknown
    freedom = max(length.size - len(names), 1)
    rest = residuals(unknown)
    chi_squared = float(np.sum((rest / spread) ** 2) / freedom)
    covariance = covariance * np.outer(unit, unit)
    return CableFit(cable, names, locked(values), locked(covariance), locked(rest), chi_squared)


def _checked_start(start: Cable | None) -> Cable:
    known = optional(start, Cable, "start") or Cable(0.1, 1e5)
    if known.linear_density.ndim or not known.linear_density > 0.0:
        value = f"of linear density {brief(known.linear_density)} kg/m"
        raise InvalidValueError("start", value, "one cable, > 0 kg/m", "Give a single cable.")
    return known


def _checked_unknowns(unknowns: Sequence[str]) -> tuple[str, ...]:
    if not isinstance(unknowns, list | tuple) or not unknowns:
        allowed = f"one to three of {', '.join(UNITS)}"
        raise InvalidValueError("unknowns", brief(unknowns), allowed, "Give a list of unknowns.")
    names = tuple(choice(name, "unknowns", UNITS) for name in unknowns)
    if len(set(names)) != len(names):
        raise InvalidValueError("unknowns", brief(names), "each name once", "Give each name once.")
    return names
