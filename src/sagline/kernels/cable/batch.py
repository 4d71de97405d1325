"""Loops over many cables: states, shapes, sags, closure errors, creep, and points for drawings.

Operands of length 1 apply to all cables.
"""

from __future__ import annotations

import math

from sagline.core.arrays import Array, Codes, Flags
from sagline.kernels import codes, tables
from sagline.kernels.algebra.functions import angle
from sagline.kernels.cable import models
from sagline.kernels.cable.geometry import AZIMUTH_X, AZIMUTH_Y, cable_geometry
from sagline.kernels.cable.pulley import pulley_at
from sagline.kernels.cable.states import solve_cable_state
from sagline.kernels.cable.terms import Chord, Material, Model, Terms, chord_at, material_at, model_of
from sagline.kernels.jit import entry, glue, kernel

# operands in Python's order: span, rise, linear density, axial stiffness, and the given tension or length
Operands = tuple[Array, Array, Array, Array, Array]
# span, rise, linear density, axial stiffness, unstrained length, T_x, T_z and chord tension
States = tuple[Array, Array, Array, Array, Array, Array, Array, Array]


@kernel
def _copy_chunk(source: Array, start: int, stop: int, target: Array) -> None:
    """Copy the entries `start` to `stop` - 1 of `source` to `target`, or repeat the only value of `source`."""
    if source.shape[0] == 1:
        for i in range(stop - start):
            target[i] = source[0]
    else:
        for i in range(stop - start):
            target[i] = source[start + i]


@entry
def batch_from_tension(terms: Terms, cables: Operands, found: tuple[Array, Array, Array, Codes], buffer: Array) -> None:
    """Length, forces on the platform end and status of every cable at its chord tension."""
    # Loops without branches solve all cables of a chunk as ordinary catenaries. The cables that are not ordinary are
    # then solved again, one by one. Each loop has one result, because the compiler vectorizes only such loops.
    # `cables`: span, rise, density, axial stiffness and chord tension. `found`: filled with length, T_x, T_z and
    # status. `buffer`: work array, (BUFFERS, CHUNK).
    model = model_of(terms)
    span, rise, density, stiffness, tension = cables
    length_out, horizontal_out, vertical_out, status_out = found
    count = length_out.shape[0]
    x, z, rho, ea, tau = buffer[0], buffer[1], buffer[2], buffer[3], buffer[4]
    chord, sine, cosine, half = buffer[5], buffer[6], buffer[7], buffer[8]
    ratio, sag_force = buffer[9], buffer[10]
    for start in range(0, count, tables.CHUNK):
        stop = min(start + tables.CHUNK, count)
        size = stop - start
        _copy_chunk(span, start, stop, x)
        _copy_chunk(rise, start, stop, z)
        _copy_chunk(density, start, stop, rho)
        _copy_chunk(stiffness, start, stop, ea)
        _copy_chunk(tension, start, stop, tau)
        for i in range(size):
            chord[i] = math.sqrt(x[i] * x[i] + z[i] * z[i])
        for i in range(size):
            sine[i] = z[i] / chord[i]
        for i in range(size):
            cosine[i] = x[i] / chord[i]
        for i in range(size):
            half[i] = 0.5 * rho[i] * model.gravity * chord[i] / tau[i]
        if model.code == codes.CATENARY:
            for i in range(size):
                ratio[i] = models.ordinary_length_ratio(half[i], sine[i], cosine[i], tau[i] / ea[i])
            stretched = 0
            for i in range(size):
                stretched += 1 if tau[i] > models.TAUT_STRAIN * ea[i] else 0
            if stretched > 0:
                for i in range(size):
                    ratio[i] = models.ordinary_length_ratio_near(half[i], sine[i], cosine[i], tau[i] / ea[i], ratio[i])
            for i in range(size):
                sag_force[i] = models.ordinary_sag_force_ratio(half[i], sine[i], tau[i] / ea[i], ratio[i]) * tau[i]
            for i in range(size):
                ratio[i] *= chord[i]
        for i in range(size):
            status = codes.CABLE_SOLVED
            if model.code != codes.CATENARY or not models.is_ordinary(half[i], tau[i] / ea[i]):
                line = Chord(chord[i], sine[i], cosine[i])
                ratio[i], sag_force[i], status = models.from_tension(model, line, Material(rho[i], ea[i]), tau[i])
            status_out[start + i] = status
        for i in range(size):
            length_out[start + i] = ratio[i]
        for i in range(size):
            horizontal_out[start + i] = tau[i] * cosine[i]
        for i in range(size):
            vertical_out[start + i] = tau[i] * sine[i] + sag_force[i]


@entry
def batch_from_length(terms: Terms, cables: Operands, found: tuple[Array, Array, Array, Codes]) -> None:
    """Fill `found`: chord tension, T_x, T_z and status of every cable at its unstrained length (last of `cables`)."""
    model = model_of(terms)
    span, rise, density, stiffness, length = cables
    tension_out, horizontal_out, vertical_out, status_out = found
    x = min(span.shape[0] - 1, 1)
    z = min(rise.shape[0] - 1, 1)
    d = min(density.shape[0] - 1, 1)
    e = min(stiffness.shape[0] - 1, 1)
    n = min(length.shape[0] - 1, 1)
    for i in range(tension_out.shape[0]):
        material = Material(density[i * d], stiffness[i * e])
        force, status = models.from_length(model, span[i * x], rise[i * z], material, length[i * n])
        horizontal_out[i], vertical_out[i], tension_out[i] = force
        status_out[i] = status


@kernel
def catenary_point(
    fraction: float, horizontal: float, vertical: float, length: float, weight: float, stiffness: float
) -> tuple[float, float]:
    """Point at the share `fraction` of the unstrained length, measured from the frame end."""
    part = fraction * length
    return models.catenary_end(horizontal, vertical - weight * (length - part), part, weight, stiffness)


@entry
def shape_points(terms: Terms, cables: States, points_out: Array) -> None:
    """Points (cables, points, 2) at equal steps of unstrained length. Shallow models give parabolas."""
    model = model_of(terms)
    span, rise, density, stiffness, length, horizontal, vertical, tension = cables
    count = points_out.shape[1]
    for i in range(points_out.shape[0]):
        for k in range(count):
            t = k / (count - 1)
            if model.code == codes.CATENARY and density[i] * model.gravity > 0.0:
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
    """Vertical distance below the chord [m] at the share `t` of the chord: b D t (1 - t)/tau with the sag force b."""
    if model.code == codes.STRAIGHT or model.code == codes.ELASTIC or tension == 0.0:
        return 0.0
    chord = math.hypot(span, rise)
    sag_force = vertical - tension * rise / chord
    return sag_force * chord * t * (1.0 - t) / tension


@kernel
def _catenary_sag(
    span: float, rise: float, length: float, horizontal: float, vertical: float, weight: float, stiffness: float
) -> float:
    """Largest vertical distance [m] of a cable below its chord, or below its lower end if the chord is vertical."""
    slope = rise / span if span > 0.0 else 0.0
    # length from the frame end to the point whose tangent is parallel to the chord, or to the turning point if the
    # chord is vertical
    part = length - (vertical - horizontal * slope) / weight
    part = min(max(part, 0.0), length)
    x, z = models.catenary_end(horizontal, vertical - weight * (length - part), part, weight, stiffness)
    if span > 0.0:
        return max(slope * x - z, 0.0)
    return max(min(0.0, rise) - z, 0.0)


@entry
def largest_sags(terms: Terms, cables: States, sag_out: Array) -> None:
    """Largest vertical distance of every cable below its chord."""
    model = model_of(terms)
    span, rise, density, stiffness, length, horizontal, vertical, tension = cables
    for i in range(sag_out.shape[0]):
        weight = density[i] * model.gravity
        if model.code == codes.CATENARY and weight > 0.0:
            sag_out[i] = _catenary_sag(span[i], rise[i], length[i], horizontal[i], vertical[i], weight, stiffness[i])
        else:
            sag_out[i] = _shallow_drop(0.5, model, span[i], rise[i], vertical[i], tension[i])


@entry
def closures(terms: Terms, cables: States, residual_out: Array) -> None:
    """Error [m] of each cable in its model's equations: error of a catenary's platform end, else of the length."""
    model = model_of(terms)
    span, rise, density, stiffness, length, horizontal, vertical, tension = cables
    for i in range(residual_out.shape[0]):
        chord = math.hypot(span[i], rise[i])
        if model.code == codes.STRAIGHT:
            residual_out[i] = abs(length[i] - chord)
        elif model.code == codes.CATENARY and density[i] * model.gravity > 0.0:
            x, z = models.catenary_end(horizontal[i], vertical[i], length[i], density[i] * model.gravity, stiffness[i])
            residual_out[i] = math.hypot(x - span[i], z - rise[i])
        elif tension[i] == 0.0:  # slack: any length above the chord is a solution
            residual_out[i] = max(chord - length[i], 0.0)
        else:
            sine = rise[i] / chord
            cosine = span[i] / chord
            weightless = model.code == codes.ELASTIC or density[i] * model.gravity == 0.0
            sag = 0.0 if weightless else models.sag_of_shallow(model, density[i] * chord * cosine)
            sag_force = vertical[i] - tension[i] * sine if model.code == codes.EMPIRICAL else 0.0
            ratio = models.shallow_length_ratio(tension[i], sine, cosine, sag_force, sag, stiffness[i])
            residual_out[i] = abs(length[i] - chord * ratio)


@entry
def creep_strains(
    time: Array, tension: Array, stiffness: Array, delay: Array, settled: Flags, strain_out: Array
) -> None:
    """Creep strain: sum of the strains of elements (spring parallel to damper). Exact for piecewise linear tensions."""
    # Samples whose tension is NaN are omitted. Between the neighbors of an omitted sample, the tension is linear in
    # time.
    # `time`: increasing [s], (N,). `tension`: (N, m) [N]. `stiffness`, `delay`: stiffness [N] and delay time [s] of
    # each element. `settled`: True if the first tension has acted for a long time, (1,); if False, the initial strain
    # is zero. `strain_out`: filled, (N, m).
    for i in range(tension.shape[1]):
        for p in range(tension.shape[0]):
            strain_out[p, i] = 0.0 if abs(tension[p, i]) < math.inf else math.nan
        for k in range(stiffness.shape[0]):
            before, strain = -1, 0.0
            for p in range(tension.shape[0]):
                if not abs(tension[p, i]) < math.inf:
                    continue
                if before < 0:
                    strain = tension[p, i] / stiffness[k] if settled[0] else 0.0
                else:
                    step = time[p] - time[before]
                    # remaining lag of the strain, after the initial transient
                    late = (tension[p, i] - tension[before, i]) / step * delay[k]
                    begin, end = tension[before, i] - late, tension[p, i] - late
                    strain = (end + (strain * stiffness[k] - begin) * math.exp(-step / delay[k])) / stiffness[k]
                strain_out[p, i] += strain
                before = p


@entry
def cable_courses(
    cables: Array, body: Array, pose: Array, tension: Array, wraps: int, rotation: Array, geometry: Array, points: Array
) -> None:
    """Points of exact cables from their frame anchors over their pulleys to their platform ends."""
    # A cable without a tension is drawn along its chord. If the platform end is too near to the pulley for a chord, a
    # straight line between the anchors is drawn.
    # `tension`: chord tensions [N], (m,); NaN for a cable without a tension. `wraps`: number of points on each pulley,
    # 0 or at least 2. Without a pulley, all are at the frame anchor. `rotation`, `geometry`: work arrays, (3, 3) and
    # (GEOMETRY_ROWS, m). `points`: filled with the points in world axes [m], (m, points, 3).
    gravity = body[tables.GRAVITY]
    model = Model(codes.CATENARY, 0.0, 0.0, gravity, None)
    cable_geometry(cables, body, pose, rotation, geometry)
    free = points.shape[1] - wraps - 1
    for i in range(tension.size):
        pulley, material, chord = pulley_at(cables, i), material_at(cables, i), chord_at(geometry, i)
        tau, weight = tension[i], 0.0
        sine, cosine = chord.cosine, pulley.entry * chord.sine  # sine and cosine of the wrap angle of a straight cable
        length, horizontal, vertical = 0.0, 0.0, 0.0
        if tau > 0.0:
            weight = material.density * gravity
            length, sag_force, _status = solve_cable_state(model, chord, material, pulley, tau)
            horizontal, vertical = tau * chord.cosine, tau * chord.sine + sag_force
            sine, cosine = horizontal, pulley.entry * (vertical - weight * length)
        wrapped = angle(sine, cosine) if pulley.radius > 0.0 and chord.length > 0.0 else 0.0
        x, z = 0.0, 0.0
        for k in range(wraps):
            part = wrapped * k / (wraps - 1)
            x, z = pulley.radius * (1.0 - math.cos(part)), pulley.radius * pulley.entry * math.sin(part)
            _write_point(cables, geometry, i, x, z, points, k)
        bx, by, bz = cables[i, tables.PLATFORM_X], cables[i, tables.PLATFORM_Y], cables[i, tables.PLATFORM_Z]
        dx = pose[0] + rotation[0, 0] * bx + rotation[0, 1] * by + rotation[0, 2] * bz - cables[i, tables.FRAME_X]
        dy = pose[1] + rotation[1, 0] * bx + rotation[1, 1] * by + rotation[1, 2] * bz - cables[i, tables.FRAME_Y]
        rise = pose[2] + rotation[2, 0] * bx + rotation[2, 1] * by + rotation[2, 2] * bz - cables[i, tables.FRAME_Z]
        span = math.sqrt(dx * dx + dy * dy)
        for k in range(free + 1):
            fraction = k / free
            along, up = (span - x) * fraction, (rise - z) * fraction
            if weight > 0.0:
                along, up = catenary_point(fraction, horizontal, vertical, length, weight, material.stiffness)
            _write_point(cables, geometry, i, x + along, z + up, points, wraps + k)


@glue
def _write_point(cables: Array, geometry: Array, i: int, x: float, z: float, points: Array, k: int) -> None:
    """Write point `k` of cable `i` in world axes [m]. `x`, `z`: position in its plane, relative to the frame anchor."""
    points[i, k, 0] = cables[i, tables.FRAME_X] + geometry[AZIMUTH_X, i] * x
    points[i, k, 1] = cables[i, tables.FRAME_Y] + geometry[AZIMUTH_Y, i] * x
    points[i, k, 2] = cables[i, tables.FRAME_Z] + z
