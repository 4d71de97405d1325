"""The cables of one pose over pulleys, of given unstrained lengths; docs/model.md, section 10.

A cable is solved as one that starts where its chord touches the pulley, is shorter by what is behind that point and
softer by the share it has of the stretch. What that one misses is added to what is asked for, pass by pass; from a pose
close by it was missed there already, and one or two passes do.
"""

from __future__ import annotations

import math

from sagline.arrays import Array
from sagline.kernels import tables
from sagline.kernels.cable import geometry as g
from sagline.kernels.cable import rows as t
from sagline.kernels.cable.catenary import catenary_end
from sagline.kernels.cable.models import from_tension
from sagline.kernels.cable.pulley import (
    Behind,
    Pulley,
    Wrap,
    behind_cable,
    energy_behind,
    from_axis,
    pulley_at,
    softness,
    straight_behind,
    wrap_of_chord,
    wrap_of_force,
)
from sagline.kernels.cable.terms import Chord, Material, Model, PlaneStiffness
from sagline.kernels.codes import CATENARY, ELASTIC
from sagline.kernels.jit import formula, glue

LEAST_FREE = 1e-3  # of a cable's length: what is asked for is never shorter


@formula
def material_at(cables: Array, i: int) -> Material:
    """What one cable of the cable_table is made of."""
    return Material(cables[i, tables.DENSITY], cables[i, tables.STIFFNESS])


@formula
def weight_of(model: Model, material: Material) -> float:
    """Weight per length that the part behind P has [N/m]: the exact cable's alone."""
    return material.density * model.gravity if model.code == CATENARY else 0.0


@formula
def chord_at(rows: Array, i: int) -> Chord:
    """The chord of one cable of a pose."""
    return Chord(rows[g.CHORD, i], rows[g.SINE, i], rows[g.COSINE, i])


@glue
def forget_misses(rows: Array) -> None:
    """Start anew where the pose before left no parameter, and so no misses."""
    for i in range(rows.shape[1]):
        if math.isnan(rows[t.PARAMETER, i]) or math.isnan(rows[t.OFF_X, i] + rows[t.OFF_Z, i] + rows[t.OFF_LENGTH, i]):
            rows[t.OFF_X, i] = rows[t.OFF_Z, i] = rows[t.OFF_LENGTH, i] = 0.0


@glue
def ask(model: Model, cables: Array, rows: Array) -> None:
    """Fill the cables that are solved in the stead of those over pulleys."""
    for i in range(cables.shape[0]):
        material = material_at(cables, i)
        length = rows[t.LENGTH, i]
        behind = straight_behind(pulley_at(cables, i), chord_at(rows, i))
        free = max(length - behind, LEAST_FREE * length)
        rows[t.SOFT, i] = material.stiffness / (1.0 + behind / free)
        rows[t.ASKED_SPAN, i] = rows[g.SPAN, i]
        rows[t.ASKED_RISE, i] = rows[g.RISE, i]
        rows[t.ASKED_LENGTH, i] = free
        if weight_of(model, material) > 0.0:
            lift = 0.5 * behind * weight_of(model, material) * free / material.stiffness
            rows[t.ASKED_SPAN, i] += rows[t.OFF_X, i]
            rows[t.ASKED_RISE, i] += lift + rows[t.OFF_Z, i]
        else:
            rows[t.ASKED_LENGTH, i] += rows[t.OFF_LENGTH, i]


@glue
def settle(model: Model, cables: Array, rows: Array) -> float:
    """Fill the forces and free spans from those of the cables asked for; returns the largest miss, of the length.

    A miss is added to what is asked for next time: of the exact cable by how much its platform end is missed, of the
    shallow ones by how much their length.
    """
    largest = 0.0
    for i in range(cables.shape[0]):
        material, pulley, chord = material_at(cables, i), pulley_at(cables, i), chord_at(rows, i)
        weight, length = weight_of(model, material), rows[t.LENGTH, i]
        horizontal = rows[t.HORIZONTAL, i]
        wrap = wrap_of_chord(pulley, chord)
        rows[t.FREE_SPAN, i] = rows[g.SPAN, i]
        rows[t.FREE_RISE, i] = rows[g.RISE, i]
        miss = 0.0
        if weight > 0.0:
            vertical_a = rows[t.VERTICAL, i] - weight * rows[t.ASKED_LENGTH, i]
            tension = math.sqrt(horizontal * horizontal + vertical_a * vertical_a)
            if tension > 0.0 and pulley.radius > 0.0:
                wrap = wrap_of_force(pulley, horizontal, vertical_a)
            wrapped, dead = behind_cable(model, material, pulley, tension, wrap)
            free = length - (wrapped + dead)
            vertical = vertical_a + weight * free
            x, z = catenary_end(horizontal, vertical, free, weight, material.stiffness)
            rows[t.FREE_SPAN, i] += pulley.radius * (wrap.cosine - pulley.entry * chord.sine)
            rows[t.FREE_RISE, i] += pulley.radius * (pulley.entry * (chord.cosine - wrap.sine))
            miss_x, miss_z = rows[t.FREE_SPAN, i] - x, rows[t.FREE_RISE, i] - z
            rows[t.OFF_X, i] += miss_x
            rows[t.OFF_Z, i] += miss_z
            rows[t.VERTICAL, i] = vertical
            if rows[g.SPAN, i] > 0.0:
                rows[t.TENSION, i] = horizontal * chord.length / rows[g.SPAN, i]
            miss = math.sqrt(miss_x * miss_x + miss_z * miss_z)
        else:
            tension = rows[t.TENSION, i]
            wrapped, dead = behind_cable(model, material, pulley, tension, wrap)
            free = length - (wrapped + dead)
            if model.code != ELASTIC and model.code != CATENARY and tension > 0.0:
                miss = free - from_tension(model, chord, material, tension)[0]
                rows[t.OFF_LENGTH, i] += miss
        rows[t.FREE_LENGTH, i] = free
        rows[t.WRAP, i] = math.atan2(wrap.sine, wrap.cosine)
        if not abs(miss) <= largest * length:
            largest = abs(miss) / length
    return largest


@formula
def leaving(model: Model, material: Material, pulley: Pulley, rows: Array, i: int) -> tuple[float, Wrap]:
    """Tension at P and wrap angle of one cable, after `settle`."""
    if model.code != CATENARY:
        return rows[t.TENSION, i], wrap_of_chord(pulley, chord_at(rows, i))
    vertical_a = rows[t.VERTICAL, i] - material.density * model.gravity * rows[t.FREE_LENGTH, i]
    horizontal = rows[t.HORIZONTAL, i]
    return math.sqrt(horizontal * horizontal + vertical_a * vertical_a), wrap_of_force(pulley, horizontal, vertical_a)


@formula
def behind_at(model: Model, cables: Array, rows: Array, i: int) -> Behind:
    """Unstrained cable behind P, after `settle`."""
    material, pulley = material_at(cables, i), pulley_at(cables, i)
    tension, wrap = leaving(model, material, pulley, rows, i)
    return behind_cable(model, material, pulley, tension, wrap)


@formula
def series(model: Model, cables: Array, rows: Array, i: int, plane: PlaneStiffness) -> PlaneStiffness:
    """In-plane stiffness of a cable, whose free span's is given, with the part behind P that gives way along it."""
    material, pulley = material_at(cables, i), pulley_at(cables, i)
    tension, wrap = leaving(model, material, pulley, rows, i)
    if not tension > 0.0:
        return plane
    weight = weight_of(model, material)
    strained = 1.0 + tension / material.stiffness
    tx, tz = wrap.sine, pulley.entry * wrap.cosine
    soft = softness(pulley, weight, material.stiffness, tension, wrap)
    gives = strained * strained * soft / (1.0 + weight * tz * strained * soft)
    left_x, left_z = plane.xx * tx + plane.xz * tz, plane.zx * tx + plane.zz * tz
    right_x, right_z = plane.xx * tx + plane.zx * tz, plane.xz * tx + plane.zz * tz
    share = gives / (1.0 + gives * (tx * left_x + tz * left_z))
    return PlaneStiffness(
        plane.xx - share * left_x * right_x,
        plane.xz - share * left_x * right_z,
        plane.zx - share * left_z * right_x,
        plane.zz - share * left_z * right_z,
    )


@formula
def fed(model: Model, cables: Array, rows: Array, i: int) -> tuple[float, float]:
    """How the platform end moves at a fixed force for a meter of cable more, after `settle`."""
    material, pulley = material_at(cables, i), pulley_at(cables, i)
    tension, wrap = leaving(model, material, pulley, rows, i)
    if not tension > 0.0:
        return 0.0, 0.0
    weight = weight_of(model, material)
    strained = 1.0 + tension / material.stiffness
    tx, tz = wrap.sine, pulley.entry * wrap.cosine
    soft = softness(pulley, weight, material.stiffness, tension, wrap)
    more = strained / (1.0 + weight * tz * strained * soft)
    return more * tx, more * tz


@formula
def across_pulley(cables: Array, rows: Array, i: int) -> float:
    """Stiffness of a cable normal to its plane [N/m]: the whole plane turns about the swivel axis."""
    pulley = pulley_at(cables, i)
    if pulley.radius == 0.0:
        return rows[t.TENSION, i] / rows[g.CHORD, i]
    return rows[t.HORIZONTAL, i] / from_axis(pulley, chord_at(rows, i))


@formula
def energy_over(model: Model, cables: Array, rows: Array, i: int) -> float:
    """Energy [J] that the part behind P adds to that of the free span."""
    material, pulley = material_at(cables, i), pulley_at(cables, i)
    tension, wrap = leaving(model, material, pulley, rows, i)
    if not tension > 0.0:
        return 0.0
    weight = weight_of(model, material)
    return energy_behind(pulley, weight, material.stiffness, tension, wrap, rows[t.FREE_LENGTH, i])
