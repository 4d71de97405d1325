"""Forces of all cables of one pose at their unstrained lengths; docs/model.md, section 10.

Most calls are for a pose close to the previous pose. Two Halley steps from the previous parameter h therefore solve
ordinary catenaries. The cables that have not converged are then solved one by one, without the previous h.

A cable over a pulley is replaced by an equivalent cable without a pulley, which starts where the chord touches the
pulley. The cable between the drum and the start of the chord is not part of the equivalent cable. The stretch of that
part is included, which makes the equivalent cable softer. In the next pass, span and rise are corrected by the error of
the platform end. The next pose starts with the corrections of the last pose, so that a nearby pose needs only one or
two passes. Each loop has one result and no branches, so that the compiler vectorizes it.
"""

from __future__ import annotations

import math

from sagline.core.arrays import Array
from sagline.kernels import codes, tables
from sagline.kernels.algebra import functions
from sagline.kernels.algebra.factors import copy
from sagline.kernels.cable import geometry as g
from sagline.kernels.cable.models import (
    CLOSE,
    ORDINARY,
    SMALL_HALLEY_STEP,
    catenary_end,
    from_length,
    from_tension,
    halley_step,
    relative_excess,
)
from sagline.kernels.cable.pulley import (
    Wrap,
    behind_cable,
    energy_behind,
    free_rise,
    free_span,
    from_axis,
    pulley_at,
    softness,
    straight_behind,
)
from sagline.kernels.cable.swivel import energy_of_swivel, solve_swivels
from sagline.kernels.cable.terms import Material, Model, PlaneStiffness, chord_at, material_at
from sagline.kernels.jit import formula, glue

LEAST_FREE = 1e-3  # shortest equivalent cable, relative to the cable's length
TINY = 1e-300  # [N]; avoids a division by zero force
ORDINARY_END = math.sqrt(
    functions.EXCESS_LIMIT
)  # largest u = wL/(T_A + T_B) for which P1 uses a polynomial instead of the series


@formula
def _wrap_at(rows: Array, i: int) -> Wrap:
    """Wrap of cable `i` on its pulley, after `_update_from_equivalent_cables`."""
    return Wrap(rows[g.WRAP_SINE, i], rows[g.WRAP_COSINE, i], rows[g.WRAP, i])


@glue
def _start_passes(cables: Array, rows: Array) -> None:
    """Fill the lengths between chords and drums. Cables without a previous solution begin with zero corrections."""
    for i in range(rows.shape[1]):
        rows[g.BEHIND, i] = straight_behind(pulley_at(cables, i), chord_at(rows, i))
    for i in range(rows.shape[1]):
        if math.isnan(rows[g.PARAMETER, i]) or math.isnan(rows[g.OFF_X, i] + rows[g.OFF_Z, i] + rows[g.OFF_LENGTH, i]):
            rows[g.OFF_X, i] = rows[g.OFF_Z, i] = rows[g.OFF_LENGTH, i] = 0.0


@glue
def _fill_equivalent_cables(model: Model, cables: Array, rows: Array) -> None:
    """Fill the equivalent cables, which replace the cables over pulleys."""
    m = rows.shape[1]
    for i in range(m):
        length = rows[g.LENGTH, i]
        rows[g.ASKED_LENGTH, i] = max(length - rows[g.BEHIND, i], LEAST_FREE * length)
    for i in range(m):
        rows[g.SOFT, i] = cables[i, tables.STIFFNESS] / (1.0 + rows[g.BEHIND, i] / rows[g.ASKED_LENGTH, i])
    if model.code == codes.CATENARY:
        for i in range(m):
            rows[g.ASKED_SPAN, i] = rows[g.SPAN, i] + rows[g.OFF_X, i]
        for i in range(m):
            half = 0.5 * cables[i, tables.DENSITY] * model.gravity * rows[g.ASKED_LENGTH, i]
            lift = rows[g.BEHIND, i] * half / cables[i, tables.STIFFNESS]
            rows[g.ASKED_RISE, i] = rows[g.RISE, i] + (lift + rows[g.OFF_Z, i])
    else:
        copy(rows[g.SPAN], rows[g.ASKED_SPAN])
        copy(rows[g.RISE], rows[g.ASKED_RISE])
        for i in range(m):
            rows[g.ASKED_LENGTH, i] += rows[g.OFF_LENGTH, i]


@glue
def _update_from_equivalent_cables(model: Model, cables: Array, rows: Array) -> float:
    """Fill forces and free spans from the equivalent cables. Returns the largest error, relative to the cable length.

    The error of an exact cable is that of its platform end; the error of a shallow cable is that of its length.
    """
    if model.code == codes.CATENARY:
        _exit_points_from_forces(model, cables, rows)
        _fill_free_span_ends(model, cables, rows)
        return _end_errors(rows)
    return _length_errors(model, cables, rows)


@glue
def _exit_points_from_forces(model: Model, cables: Array, rows: Array) -> None:
    """For exact cables over pulleys, fill exit points, free spans and free lengths from T_x and T_zA."""
    m = rows.shape[1]
    for i in range(m):  # T_zA
        rows[g.VERTICAL, i] -= cables[i, tables.DENSITY] * model.gravity * rows[g.ASKED_LENGTH, i]
    for i in range(m):
        x, z = rows[g.HORIZONTAL, i], rows[g.VERTICAL, i]
        rows[g.LEAVING, i] = math.sqrt(x * x + z * z)
    for i in range(m):
        rows[g.WRAP_SINE, i] = rows[g.HORIZONTAL, i] / (rows[g.LEAVING, i] + TINY)
    for i in range(m):
        rows[g.WRAP_COSINE, i] = pulley_at(cables, i).entry * rows[g.VERTICAL, i] / (rows[g.LEAVING, i] + TINY)
    for i in range(m):
        rows[g.WRAP, i] = functions.angle(rows[g.WRAP_SINE, i] + TINY, rows[g.WRAP_COSINE, i])
    for i in range(m):
        material = material_at(cables, i)
        wrapped, dead = behind_cable(model, material, pulley_at(cables, i), rows[g.LEAVING, i], _wrap_at(rows, i))
        rows[g.FREE_LENGTH, i] = rows[g.LENGTH, i] - (wrapped + dead)
    for i in range(m):  # T_z
        rows[g.VERTICAL, i] += cables[i, tables.DENSITY] * model.gravity * rows[g.FREE_LENGTH, i]
    for i in range(m):
        rows[g.FREE_SPAN, i] = free_span(pulley_at(cables, i), chord_at(rows, i), rows[g.WRAP_COSINE, i])
    for i in range(m):
        rows[g.FREE_RISE, i] = free_rise(pulley_at(cables, i), chord_at(rows, i), rows[g.WRAP_SINE, i])
    for i in range(m):
        if rows[g.SPAN, i] > 0.0:
            rows[g.TENSION, i] = rows[g.HORIZONTAL, i] / rows[g.COSINE, i]


@glue
def _fill_free_span_ends(model: Model, cables: Array, rows: Array) -> None:
    """Fill the ends of the free spans of exact cables, like `catenary_end`, but in loops that vectorize."""
    m = rows.shape[1]
    for i in range(m):
        x, z = rows[g.HORIZONTAL, i], rows[g.VERTICAL, i]
        rows[g.TOTAL, i] = rows[g.LEAVING, i] + math.sqrt(x * x + z * z)
    for i in range(m):
        weight_length = cables[i, tables.DENSITY] * model.gravity * rows[g.FREE_LENGTH, i]
        u = weight_length / rows[g.TOTAL, i]
        gives = 1.0 / cables[i, tables.STIFFNESS] + 2.0 / rows[g.TOTAL, i] * (
            1.0 + functions.atanhc_excess_polynomial(u * u)
        )
        rows[g.END_X, i] = rows[g.HORIZONTAL, i] * rows[g.FREE_LENGTH, i] * gives
    for i in range(m):
        weight_length = cables[i, tables.DENSITY] * model.gravity * rows[g.FREE_LENGTH, i]
        gives = 1.0 / cables[i, tables.STIFFNESS] + 2.0 / rows[g.TOTAL, i]
        rows[g.END_Z, i] = (rows[g.VERTICAL, i] - 0.5 * weight_length) * rows[g.FREE_LENGTH, i] * gives
    for i in range(m):
        weight, free = cables[i, tables.DENSITY] * model.gravity, rows[g.FREE_LENGTH, i]
        if not weight * free <= ORDINARY_END * rows[g.TOTAL, i]:
            rows[g.END_X, i], rows[g.END_Z, i] = catenary_end(
                rows[g.HORIZONTAL, i], rows[g.VERTICAL, i], free, weight, cables[i, tables.STIFFNESS]
            )


@formula
def _larger(one: float, other: float) -> float:
    """Maximum of two numbers, NaN if one of them is NaN."""
    return other if not other <= one and not math.isnan(one) else one


@glue
def _end_errors(rows: Array) -> float:
    """Correct the equivalent cables by the platform-end errors. Returns the largest error relative to the length."""
    largest = 0.0
    for i in range(rows.shape[1]):
        x, z = rows[g.FREE_SPAN, i] - rows[g.END_X, i], rows[g.FREE_RISE, i] - rows[g.END_Z, i]
        rows[g.OFF_X, i] += x
        rows[g.OFF_Z, i] += z
        largest = _larger(largest, (abs(x) + abs(z)) / rows[g.LENGTH, i])
    return largest


@glue
def _length_errors(model: Model, cables: Array, rows: Array) -> float:
    """`_end_errors` of shallow and weightless cables, which leave a pulley along the chord; 0 for weightless cables."""
    largest = 0.0
    for i in range(rows.shape[1]):
        material, pulley, chord = material_at(cables, i), pulley_at(cables, i), chord_at(rows, i)
        tension = rows[g.TENSION, i]
        sine, cosine = chord.cosine, pulley.entry * chord.sine
        rows[g.LEAVING, i] = tension
        rows[g.WRAP_SINE, i] = sine
        rows[g.WRAP_COSINE, i] = cosine
        rows[g.WRAP, i] = functions.angle(sine, cosine)
        rows[g.FREE_SPAN, i] = rows[g.SPAN, i]
        rows[g.FREE_RISE, i] = rows[g.RISE, i]
        wrapped, dead = behind_cable(model, material, pulley, tension, _wrap_at(rows, i))
        free = rows[g.LENGTH, i] - (wrapped + dead)
        rows[g.FREE_LENGTH, i] = free
        if model.code != codes.ELASTIC and tension > 0.0:
            miss = free - from_tension(model, chord, material, tension)[0]
            rows[g.OFF_LENGTH, i] += miss
            largest = _larger(largest, abs(miss) / rows[g.LENGTH, i])
    return largest


@formula
def _weight_per_length(model: Model, material: Material) -> float:
    """Weight per length [N/m] of the cable between exit point P and drum; only the exact cable has weight there."""
    return material.density * model.gravity if model.code == codes.CATENARY else 0.0


@formula
def behind_at(model: Model, cables: Array, rows: Array, i: int) -> tuple[float, float]:
    """Unstrained length between the exit point P and the drum. Call `_update_from_equivalent_cables` before."""
    if tables.SWIVELS and cables.shape[1] > tables.CABLE_COLUMNS:
        return rows[g.WRAPPED, i], rows[g.LENGTH, i] - rows[g.FREE_LENGTH, i] - rows[g.WRAPPED, i]
    return behind_cable(model, material_at(cables, i), pulley_at(cables, i), rows[g.LEAVING, i], _wrap_at(rows, i))


@formula
def end_motion_per_length(model: Model, cables: Array, rows: Array, i: int) -> tuple[float, float, float]:
    """Motion of the platform end per meter of cable at a fixed force (x, z), and equivalent length per newton of H."""
    # An increase of H stretches the part between P and the drum. The platform end then moves as if cable were paid out.
    # The third value is the length of paid-out cable with this effect, per newton of H.
    material, pulley = material_at(cables, i), pulley_at(cables, i)
    wrap, tension = _wrap_at(rows, i), rows[g.LEAVING, i]
    weight = _weight_per_length(model, material)
    strained = 1.0 + tension / material.stiffness
    soft = softness(pulley, weight, material.stiffness, tension, wrap)
    along = pulley.entry * wrap.cosine
    more = strained / (1.0 + weight * along * strained * soft)
    return more * wrap.sine, more * along, soft * strained / more


@formula
def stiffness_in_series(model: Model, cables: Array, rows: Array, i: int, plane: PlaneStiffness) -> PlaneStiffness:
    """In-plane stiffness of cable `i`: free span in series with the cable between the exit point P and the drum."""
    if not rows[g.LEAVING, i] > 0.0:
        return plane
    x, z, gives = end_motion_per_length(model, cables, rows, i)
    left_x, left_z = plane.xx * x + plane.xz * z, plane.zx * x + plane.zz * z
    right_x, right_z = plane.xx * x + plane.zx * z, plane.xz * x + plane.zz * z
    share = gives / (1.0 + gives * (x * left_x + z * left_z))
    return PlaneStiffness(
        plane.xx - share * left_x * right_x,
        plane.xz - share * left_x * right_z,
        plane.zx - share * left_z * right_x,
        plane.zz - share * left_z * right_z,
    )


@formula
def across_pulley(cables: Array, rows: Array, i: int) -> float:
    """Stiffness of cable `i` normal to its plane [N/m]. The whole plane turns about the swivel axis."""
    pulley = pulley_at(cables, i)
    if pulley.radius == 0.0:
        return rows[g.TENSION, i] / rows[g.CHORD, i]
    return rows[g.HORIZONTAL, i] / from_axis(pulley, chord_at(rows, i))


@formula
def energy_over(model: Model, cables: Array, rows: Array, i: int) -> float:
    """Energy [J] of the cable between exit point P and drum, which is added to the energy of the free span."""
    if tables.SWIVELS and cables.shape[1] > tables.CABLE_COLUMNS:
        return energy_of_swivel(model, cables, rows, i)
    material, tension = material_at(cables, i), rows[g.LEAVING, i]
    weight, free = _weight_per_length(model, material), rows[g.FREE_LENGTH, i]
    return energy_behind(pulley_at(cables, i), weight, material.stiffness, tension, _wrap_at(rows, i), free)


PASSES = 30  # largest number of passes for cables over pulleys; from a nearby pose, one or two are sufficient
MISSED = 1e-13  # largest error of the platform end, relative to the cable's length


@formula
def _square_share(part: float, length: float) -> float:
    """The square of the ratio part/length."""
    ratio = part / length
    return ratio * ratio


# arrays (m,) of the cables that are solved: span, rise and unstrained length [m], EA [N]
_EquivalentCables = tuple[Array, Array, Array, Array]


@glue
def _two_halley_steps(gravity: float, cables: Array, asked: _EquivalentCables, rows: Array) -> None:
    """For every cable, two Halley steps from the stored parameter. The loop has one result, so that it vectorizes."""
    m = cables.shape[0]
    span, rise, length, stiffness = asked
    for i in range(m):
        rows[g.KAPPA, i] = 0.5 * cables[i, tables.DENSITY] * gravity * length[i] / stiffness[i]
    for i in range(m):
        rows[g.EXCESS, i] = relative_excess(span[i], rise[i], length[i])
    for i in range(m):
        xi2 = _square_share(span[i], length[i])
        zeta2 = _square_share(rise[i], length[i])
        rows[g.FIRST, i] = halley_step(rows[g.PARAMETER, i], xi2, zeta2, rows[g.KAPPA, i], rows[g.EXCESS, i])
    for i in range(m):
        xi2 = _square_share(span[i], length[i])
        zeta2 = _square_share(rise[i], length[i])
        rows[g.SECOND, i] = halley_step(rows[g.FIRST, i], xi2, zeta2, rows[g.KAPPA, i], rows[g.EXCESS, i])


@formula
def _has_converged(rows: Array, i: int) -> bool:
    """True if the second step of cable `i` has full precision. False for NaN."""
    first, second, kappa = rows[g.FIRST, i], rows[g.SECOND, i], rows[g.KAPPA, i]
    near = abs(first - rows[g.PARAMETER, i]) <= CLOSE * (first + kappa)
    return near and abs(second - first) <= SMALL_HALLEY_STEP * (second + kappa) and 0.0 < second < ORDINARY


@formula
def forces_from_lengths(model: Model, cables: Array, rows: Array, behind: bool | None) -> None:
    """Fill T_x, T_z, tau and status of every cable of a pose from its geometry and length."""
    # `behind` is `Model.behind` as a separate argument. If `behind` is None, the code for pulleys is not compiled.
    if behind is None:
        bare = (rows[g.SPAN], rows[g.RISE], rows[g.LENGTH], cables[:, tables.STIFFNESS])
        _solve_equivalent_cables(model, cables, bare, rows)
    elif tables.SWIVELS and cables.shape[1] > tables.CABLE_COLUMNS:
        solve_swivels(model, cables, rows)
    else:
        asked = (rows[g.ASKED_SPAN], rows[g.ASKED_RISE], rows[g.ASKED_LENGTH], rows[g.SOFT])
        _start_passes(cables, rows)
        missed = math.inf
        for _ in range(PASSES):
            _fill_equivalent_cables(model, cables, rows)
            _solve_equivalent_cables(model, cables, asked, rows)
            missed = _update_from_equivalent_cables(model, cables, rows)
            if missed <= MISSED:
                break
        if not missed <= MISSED:
            for i in range(cables.shape[0]):
                rows[g.STATUS, i] = codes.CABLE_NOT_CONVERGED


@glue
def _solve_equivalent_cables(model: Model, cables: Array, asked: _EquivalentCables, rows: Array) -> None:
    """Fill T_x, T_z, tau and status of the cables given by `asked`."""
    exact = model.code == codes.CATENARY
    spans, rises, lengths, stiffness = asked
    if exact:
        _two_halley_steps(model.gravity, cables, asked, rows)
    for i in range(cables.shape[0]):
        span, rise, length = spans[i], rises[i], lengths[i]
        chord = math.sqrt(span * span + rise * rise)
        density = cables[i, tables.DENSITY]
        weight = density * model.gravity
        if exact and _has_converged(rows, i):
            h, kappa = rows[g.SECOND, i], rows[g.KAPPA, i]
            half = 0.5 * weight / (h + kappa)
            y = h * h
            tangent = h * functions.sinhc_polynomial(y) / functions.cosh_polynomial(y)
            rows[g.HORIZONTAL, i] = half * span
            rows[g.VERTICAL, i] = 0.5 * weight * (length + rise / (tangent + kappa))
            rows[g.TENSION, i] = half * chord
            rows[g.STATUS, i] = codes.CABLE_SOLVED
            rows[g.PARAMETER, i] = h
            continue
        force, status = from_length(model, span, rise, Material(density, stiffness[i]), length)
        rows[g.HORIZONTAL, i], rows[g.VERTICAL, i], rows[g.TENSION, i] = force
        rows[g.STATUS, i] = status
        # h from tau = wD/(2 (h + kappa)), for the next pose
        h = 0.5 * weight * chord / force.tension - rows[g.KAPPA, i] if force.tension > 0.0 else math.nan
        rows[g.PARAMETER, i] = h
