"""Potential energy of one cable, whose gradient is the force on its platform end; docs/model.md, section 6.

The weightless and the exact cable have one. The shallow models have none: their forces are not the
gradient of anything (the curl of the parabolic one is of the order of its own error), so there is no energy
to go downhill in, and their equilibria are reached from the exact cable's.
"""

from __future__ import annotations

import math

from sagline.core.arrays import Array
from sagline.kernels.cable import geometry as g
from sagline.kernels.cable import rows as t
from sagline.kernels.cable.over_pulleys import energy_over, material_at
from sagline.kernels.cable.stiffness import force_of, series_excess
from sagline.kernels.cable.terms import Force, Material, Model
from sagline.kernels.codes import CATENARY, ELASTIC
from sagline.kernels.jit import formula


@formula
def catenary_energy(span: float, rise: float, length: float, force: Force, weight: float, stiffness: float) -> float:
    """V = T.B - C(T) [J] of the exact cable, strain and height of its mass included, frame end at height 0."""
    horizontal, vertical, _ = force
    weight_length = weight * length
    vertical_a = vertical - weight_length
    square = horizontal * horizontal
    tension_a = math.sqrt(square + vertical_a * vertical_a)
    tension_b = math.sqrt(square + vertical * vertical)
    total = tension_a + tension_b
    half_mean = tension_a + vertical * (2.0 * vertical - weight_length) / total
    if horizontal != 0.0:
        excess = series_excess(horizontal, vertical_a, vertical, tension_a, tension_b, weight_length)
        half_mean += 2.0 * square / total * (1.0 + excess)
    strain = square + vertical * (vertical - weight_length) + weight_length * weight_length / 3.0
    return horizontal * span + vertical * rise - 0.5 * length * (strain / stiffness + half_mean)


@formula
def elastic_energy(chord: float, length: float, tension: float, stiffness: float) -> float:
    """Strain energy [J] of the weightless cable; zero where it is slack."""
    return 0.5 * tension * (chord - length) if tension > 0.0 else 0.0


@formula
def _cable_energy(model: Model, span: float, rise: float, material: Material, length: float, force: Force) -> float:
    """Energy [J] of a cable of the exact or the weightless model; NaN for the others."""
    weight = material.density * model.gravity
    if model.code == CATENARY and weight > 0.0:
        return catenary_energy(span, rise, length, force, weight, material.stiffness)
    if model.code in (CATENARY, ELASTIC) or weight == 0.0:
        return elastic_energy(math.sqrt(span * span + rise * rise), length, force.tension, material.stiffness)
    return math.nan


@formula
def energy_of_cables(model: Model, cables: Array, rows: Array, behind: bool | None) -> tuple[float, float]:
    """Energy [J] of all cables of a pose, and the sum of the parts that cancel in it.

    Args:
        model: Cable model.
        cables: Rows of the cable_table, (m, CABLE_COLUMNS).
        rows: As in `sagline.kernels.cable.rows`, (CABLE_ROWS, m), after `cable_forces`.
        behind: That of the model, by itself, so that what it rules out is not compiled.
    """
    x = g.SPAN if behind is None else t.FREE_SPAN
    z = g.RISE if behind is None else t.FREE_RISE
    whole = t.LENGTH if behind is None else t.FREE_LENGTH
    energy = 0.0
    size = 0.0
    for i in range(cables.shape[0]):
        span, rise, length = rows[x, i], rows[z, i], rows[whole, i]
        force = force_of(rows, i)
        energy += _cable_energy(model, span, rise, material_at(cables, i), length, force)
        size += abs(force.horizontal * span) + abs(force.vertical * rise)
        if behind is not None:
            more = energy_over(model, cables, rows, i)
            energy += more
            size += abs(more)
    return energy, size
