"""Identification of the empirical model's constants for any cable and working range, as in the article."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from sagline.article.regressions import fit_factor
from sagline.cables.cable import Cable
from sagline.cables.models import Catenary, Empirical
from sagline.core.arguments import check_memory, instance
from sagline.core.arrays import Array, Flags, checked, number
from sagline.core.errors import InvalidValueError
from sagline.core.results import Result

CONFIDENCE = 0.95
POINT_BYTES = 400.0  # memory per combination of span, rise and tension during the fit


class Estimate(NamedTuple):
    """A fitted constant and its confidence interval."""

    # The residuals of the least-squares fit are errors of the model in the working range, not noise. The confidence
    # interval therefore shows how much the constant varies within the working range.
    value: float  # value of the constant
    low: float  # lower end of the 95 % interval
    high: float  # upper end of the 95 % interval


@dataclass(frozen=True, slots=True, eq=False)
class EmpiricalFit(Result):
    """An empirical model for one cable and one working range, and the errors of the model.

    The arrays have axes for s spans, r rises and t tensions, in ascending order. The position error |dx| + |dz| of
    equation (20) of the article is the distance between B_d and the end of an exact cable with the model's force and
    length.

    Attributes:
        model: The model to use.
        k_h: Intercept constant of the model [m/s^2].
        k_p: Sag constant of the model [m^2/s^4].
        cable: Material of the cable.
        gravity: Gravitational acceleration [m/s^2].
        spans: Sampled spans [m], shape (s,).
        rises: Sampled rises [m], shape (r,).
        tensions: Sampled T_x [N], shape (t,).
        force_residual: T_z of the model minus the exact value [N], shape (s, r, t).
        length_residual: L of the model minus the exact value [m], shape (s, r, t).
        position_error: Position error [m], shape (s, r, t).
        cable_weight: Cable weight w L [N], shape (s, r, t).
    """

    model: Empirical
    k_h: Estimate
    k_p: Estimate
    cable: Cable
    gravity: float
    spans: Array
    rises: Array
    tensions: Array
    force_residual: Array
    length_residual: Array
    position_error: Array
    cable_weight: Array

    def tension_min(self, tolerance: float) -> float:
        """Lowest tension T_x,min of the article [N]: all sampled cables with at least this T_x keep a tolerance.

        Args:
            tolerance: Allowed position error [m], > 0.

        Returns:
            The tension; NaN if the error at the highest sampled tension exceeds the tolerance.
        """
        worst = self.position_error.max(axis=(0, 1))
        return _first_of_good_tail(self.tensions, worst <= _tolerance(tolerance))

    def weight_max(self, tolerance: float, tension: float | None = None) -> float:
        """Largest weight w_max of the article [N]: all sampled cables up to this weight w L keep a tolerance.

        Args:
            tolerance: Allowed position error [m], > 0.
            tension: Smallest T_x of the considered cables [N]; None to consider all cables.

        Returns:
            The weight; NaN if the lightest cable exceeds the tolerance.
        """
        counted = self.tensions >= (0.0 if tension is None else number(tension, "tension", "N"))
        weight = self.cable_weight[..., counted].ravel()
        error = self.position_error[..., counted].ravel()
        order = np.argsort(-weight)
        return _first_of_good_tail(weight[order], error[order] <= _tolerance(tolerance))


def identify_empirical(
    cable: Cable, spans: ArrayLike, rises: ArrayLike, tensions: ArrayLike, gravity: float = 9.81
) -> EmpiricalFit:
    """Find the constants of the empirical model for a cable and its working range.

    T_z is linear in k_h, and L is linear in k_p. One linear least-squares fit per constant is therefore sufficient. The
    first fit determines k_h from T_z, with the slope tan phi. The second fit determines k_p from L by equation (48),
    with the k_h of the first fit.

    Args:
        cable: Material of a single cable with positive density.
        spans: Horizontal distances between the ends of the cable [m], shape (s,), > 0.
        rises: Heights of the platform end above the frame end [m], shape (r,); negative if the platform end is lower.
        tensions: T_x [N], shape (t,), > 0.
        gravity: Gravitational acceleration [m/s^2], > 0.

    Returns:
        The fit; its `model` can be used in `inverse`.

    Raises:
        InvalidValueError: If `cable` is not a single cable with weight, or if a value is out of range.
        CableGeometryError: If a span and a rise are both zero.

    Examples:
        >>> import sagline as sl
        >>> cable = sl.Cable(linear_density=0.067, axial_stiffness=44e3)
        >>> fit = sl.identify_empirical(
        ...     cable, [5.0, 10.0], [-4.0, -2.0], [50.0, 100.0]
        ... )
        >>> round(fit.model.k_h, 3)
        4.875

    Source:
        Gia Luan & Truong Thinh 2020, sections 3 to 5, in one step each; docs/article.md.
    """
    if instance(cable, Cable, "cable").linear_density.ndim or not cable.linear_density > 0.0:
        raise InvalidValueError(
            "cable", f"of linear density {cable.linear_density} kg/m", "one cable, > 0 kg/m", "Give a single cable."
        )
    axes = (
        np.unique(checked(spans, "spans", "m", shape=(None,), above=0.0)),
        np.unique(checked(rises, "rises", "m", shape=(None,))),
        np.unique(checked(tensions, "tensions", "N", shape=(None,), above=0.0)),
    )
    for name, axis in zip(("spans", "rises", "tensions"), axes, strict=True):
        if not axis.size:
            raise InvalidValueError(name, "empty", "at least one number", "Give the range in which the cable is used.")
    gravity = number(gravity, "gravity", "m/s^2", above=0.0)
    check_memory("spans, rises and tensions", POINT_BYTES * math.prod(map(len, axes)), "Give fewer values.")
    span, rise, tension = np.meshgrid(*axes, indexing="ij")
    chord_tension = tension * np.hypot(span, rise) / span
    exact = Catenary().from_tension(cable, span, rise, chord_tension, gravity)
    density, stiffness = cable.linear_density, cable.axial_stiffness
    k_h = _estimate(density * exact.chord, exact.vertical_force - rise / span * exact.horizontal_tension)
    stretch = 1.0 + np.hypot(tension, rise / span * tension + k_h.value * density * exact.chord) / stiffness
    shape = (density * exact.span**2 / tension) ** 2 / (exact.chord * stretch)  # (rho cos^2 phi/T_x)^2 D^3
    k_p = _estimate(shape, exact.unstrained_length - exact.chord / stretch)
    model = Empirical(k_h.value, k_p.value)
    found = model.from_tension(cable, span, rise, chord_tension, gravity)
    ends = Catenary().profile(cable, found, points=2)[..., -1, :]  # of exact cables
    return EmpiricalFit(
        *(model, k_h, k_p, cable, gravity, *axes),
        force_residual=found.vertical_force - exact.vertical_force,
        length_residual=found.unstrained_length - exact.unstrained_length,
        position_error=np.asarray(np.abs(ends[..., 0] - span) + np.abs(ends[..., 1] - rise)),
        cable_weight=exact.cable_weight,
    )


def _estimate(shape: Array, value: Array) -> Estimate:
    """Factor of the least-squares fit value = factor * shape, with its confidence interval."""
    from scipy.stats import t

    x, y = shape.ravel(), value.ravel()
    factor = float(fit_factor(x, y))
    freedom = max(x.size - 1, 1)
    spread = np.sqrt(np.sum((y - factor * x) ** 2) / freedom / np.sum(x**2))
    half = float(t.ppf(0.5 + 0.5 * CONFIDENCE, freedom) * spread)
    return Estimate(factor, factor - half, factor + half)


def _tolerance(tolerance: float) -> float:
    return number(tolerance, "tolerance", "m", above=0.0)


def _first_of_good_tail(values: Array, good: Flags) -> float:
    """First value after the last value that is not good; NaN if no good value follows."""
    bad = np.flatnonzero(~good)
    first = int(bad[-1]) + 1 if bad.size else 0
    return float(values[first]) if first < values.size else float("nan")
