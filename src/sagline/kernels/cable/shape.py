"""Shape of a solved cable: points along it, its sag, and its closure error."""

from __future__ import annotations

import math

from sagline.core.arrays import Array
from sagline.kernels.cable.catenary import catenary_end
from sagline.kernels.cable.models import sag_of_shallow
from sagline.kernels.cable.shallow import shallow_length_ratio
from sagline.kernels.cable.terms import Model, Terms, model_of
from sagline.kernels.codes import CATENARY, ELASTIC, EMPIRICAL, STRAIGHT
from sagline.kernels.jit import entry, kernel


@kernel
def catenary_point(
    fraction: float, horizontal: float, vertical: float, length: float, weight: float, stiffness: float
) -> tuple[float, float]:
    """Point at a fraction of the unstrained length from the frame end: the end of the cable's first part."""
    part = fraction * length
    return catenary_end(horizontal, vertical - weight * (length - part), part, weight, stiffness)


@entry
def shape_points(
    terms: Terms,
    span: Array,
    rise: Array,
    density: Array,
    stiffness: Array,
    length: Array,
    horizontal: Array,
    vertical: Array,
    tension: Array,
    points_out: Array,
) -> None:
    """Points (cables, points, 2) at equal steps of unstrained length; the shallow models draw a parabola."""
    model = model_of(terms)
    count = points_out.shape[1]
    for i in range(points_out.shape[0]):
        for k in range(count):
            t = k / (count - 1)
            if model.code == CATENARY and density[i] * model.gravity > 0.0:
                x, z = catenary_point(
                    t, horizontal[i], vertical[i], length[i], density[i] * model.gravity, stiffness[i]
                )
            else:
                drop = _shallow_drop(t, model, span[i], rise[i], vertical[i], tension[i])
                x, z = t * span[i], t * rise[i] - drop
            points_out[i, k, 0] = x
            points_out[i, k, 1] = z


@kernel
def _shallow_drop(t: float, model: Model, span: float, rise: float, vertical: float, tension: float) -> float:
    """Drop below the chord [m] at a fraction t of it: b D t (1 - t)/tau, with b the pull on the end."""
    if model.code == STRAIGHT or model.code == ELASTIC or tension == 0.0:
        return 0.0
    chord = math.hypot(span, rise)
    pull = vertical - tension * rise / chord
    return pull * chord * t * (1.0 - t) / tension


@kernel
def _catenary_sag(
    span: float, rise: float, length: float, horizontal: float, vertical: float, weight: float, stiffness: float
) -> float:
    """Largest drop below the chord [m]; on a vertical chord, how far the cable hangs below its lower end."""
    slope = rise / span if span > 0.0 else 0.0
    # where the cable runs parallel to the chord (a vertical one: where it turns), as a length from the frame end
    part = length - (vertical - horizontal * slope) / weight
    part = min(max(part, 0.0), length)
    x, z = catenary_end(horizontal, vertical - weight * (length - part), part, weight, stiffness)
    if span > 0.0:
        return max(slope * x - z, 0.0)
    return max(min(0.0, rise) - z, 0.0)


@entry
def largest_sags(
    terms: Terms,
    span: Array,
    rise: Array,
    density: Array,
    stiffness: Array,
    length: Array,
    horizontal: Array,
    vertical: Array,
    tension: Array,
    sag_out: Array,
) -> None:
    """Largest drop below the chord of every cable."""
    model = model_of(terms)
    for i in range(sag_out.shape[0]):
        weight = density[i] * model.gravity
        if model.code == CATENARY and weight > 0.0:
            sag_out[i] = _catenary_sag(span[i], rise[i], length[i], horizontal[i], vertical[i], weight, stiffness[i])
        else:
            sag_out[i] = _shallow_drop(0.5, model, span[i], rise[i], vertical[i], tension[i])


@entry
def closures(
    terms: Terms,
    span: Array,
    rise: Array,
    density: Array,
    stiffness: Array,
    length: Array,
    horizontal: Array,
    vertical: Array,
    tension: Array,
    residual_out: Array,
) -> None:
    """By how much each cable misses its model's own equations [m].

    Catenary: distance of its computed end from the platform end. Others: the error in length.
    """
    model = model_of(terms)
    for i in range(residual_out.shape[0]):
        chord = math.hypot(span[i], rise[i])
        if model.code == STRAIGHT:
            residual_out[i] = abs(length[i] - chord)
        elif model.code == CATENARY and density[i] * model.gravity > 0.0:
            x, z = catenary_end(horizontal[i], vertical[i], length[i], density[i] * model.gravity, stiffness[i])
            residual_out[i] = math.hypot(x - span[i], z - rise[i])
        elif tension[i] == 0.0:  # slack: any length beyond the chord will do
            residual_out[i] = max(chord - length[i], 0.0)
        else:
            sine = rise[i] / chord
            cosine = span[i] / chord
            weightless = model.code == ELASTIC or density[i] * model.gravity == 0.0
            sag = 0.0 if weightless else sag_of_shallow(model, density[i] * chord * cosine)
            pull = vertical[i] - tension[i] * sine if model.code == EMPIRICAL else 0.0
            ratio = shallow_length_ratio(tension[i], sine, cosine, pull, sag, stiffness[i])
            residual_out[i] = abs(length[i] - chord * ratio)
