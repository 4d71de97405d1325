"""Proof that the equilibrium of a solved pose is stable, from values of its solution; docs/model.md, section 6.

The symmetric part of the stiffness of a platform end is at least u u^T/c, where u is the unit vector along the chord.
For exact and weightless cables, c is the compliance along u. With any right inverse A of the structure matrix J, the
inverse of J diag(1/c) J^T is at most A^T diag(c) A. Only the geometric stiffness G of the rotations can be negative.
The equilibrium is stable if 1 + L^T G L is positive definite, where L L^T is the part of A^T diag(c) A for the
rotations.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from sagline.core.arrays import Array
from sagline.kernels import codes
from sagline.kernels.algebra.factors import factor_positive
from sagline.kernels.algebra.functions import EXCESS_LIMIT, atanhc_excess_polynomial
from sagline.kernels.cable import geometry as g
from sagline.kernels.cable.models import sag_of_shallow
from sagline.kernels.cable.pulley import Wrap, softness
from sagline.kernels.cable.swivel import swivel_at
from sagline.kernels.cable.terms import Cables, Model, pulley_of
from sagline.kernels.inverse.exits import COSINE, SIDE, SINE, WRAP, Exits
from sagline.kernels.jit import formula, glue, independent
from sagline.kernels.memory import Memory, block
from sagline.kernels.statics import Balance, Platform

WEIGHT_ON_PULLEY = 0.1  # wR/T above which no proof is attempted for slanted swivel axes
MORE = 1.1  # factor of the compliance behind exit points, for slanted swivel axes
ROUNDING = 0.01  # a proof with a smaller margin is rejected, because of rounding errors


class StabilityArrays(NamedTuple):
    """Work arrays of the proof, for `m` cables and `k` free rotations."""

    compliance: Array  # bounds c of the compliances of the platform ends along their chords [m/N], (m,)
    coupling: Array  # shallow cables: stiffness along the chord that is lost by the transverse terms [N/m], (m,)
    torque: Array  # sum over cables of r T^T [N m], (3, 3); r: lever, T: force on a cable at its platform end
    geometric: Array  # geometric stiffness of the rotations [N m], (k, k)
    elastic: Array  # upper bound of the compliance of the rotations [1/(N m)], overwritten by its factor L, (k, k)
    proof: Array  # the matrices G L and 1 + L^T G L, one below the other, (2 k, k)


@glue
def new_stability_arrays(memory: Memory, m: int, k: int) -> tuple[StabilityArrays, Memory]:
    """Work arrays for m cables and k free rotations, and the remaining memory."""
    rows, memory = block(memory, 2, m)
    torque, memory = block(memory, 3, 3)
    squares, memory = block(memory, 4 * k, k)
    arrays = StabilityArrays(rows[0], rows[1], torque, squares[:k], squares[k : 2 * k], squares[2 * k :])
    return arrays, memory


@glue
def proves_stability(
    model: Model, exits: Exits | None, platform: Platform, cables: Cables, balance: Balance, work: StabilityArrays
) -> bool:
    """True if the equilibrium of a solved pose is proved stable, or its cables are straight, without a stiffness."""
    # `exits`: pulleys with swivel axes of any direction, if `cables` are those from eyelets
    k = work.geometric.shape[0]
    if model.code == codes.STRAIGHT or k == 0:
        return True
    _fill_geometric_stiffness(platform, cables, balance, work)
    least = 0.0  # bound of the eigenvalues by Gershgorin's circles
    for j in range(k):
        low = work.geometric[j, j]
        for i in range(k):
            if i != j:
                low -= abs(work.geometric[j, i])
        least = min(least, low)
    if exits is None:
        _fill_compliances(model, cables, work)
    else:
        _fill_compliances_of_slanted(model, exits, cables, balance, work.compliance)
    first = balance.inverse.shape[0] - k
    trace = 0.0
    for i in range(cables.tau.size):
        arm = 0.0
        for j in range(k):
            arm += balance.inverse[first + j, i] * balance.inverse[first + j, i]
        work.compliance[i] /= balance.scale[i] * balance.scale[i]  # `inverse` is that of the scaled matrix
        trace += work.compliance[i] * arm
    if trace * -least <= 1.0 - ROUNDING:
        return True
    return _compares_all_rotations(balance, work)


@glue
def _fill_geometric_stiffness(platform: Platform, cables: Cables, balance: Balance, work: StabilityArrays) -> None:
    """Fill the geometric stiffness of the free rotations: the symmetric part of r T^T - (r.T) 1."""
    xx, yy, zz, xy, xz, yz = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for i in range(cables.tau.size):
        level = cables.tau[i] * cables.cosine[i]
        tx, ty = level * balance.geometry[g.AZIMUTH_X, i], level * balance.geometry[g.AZIMUTH_Y, i]
        tz = cables.tau[i] * cables.sine[i] + cables.sag_force[i]
        x, y, z = balance.geometry[g.LEVER_X, i], balance.geometry[g.LEVER_Y, i], balance.geometry[g.LEVER_Z, i]
        xx -= y * ty + z * tz
        yy -= x * tx + z * tz
        zz -= x * tx + y * ty
        xy += 0.5 * (x * ty + y * tx)
        xz += 0.5 * (x * tz + z * tx)
        yz += 0.5 * (y * tz + z * ty)
    work.torque[0, 0], work.torque[1, 1], work.torque[2, 2] = xx, yy, zz
    work.torque[0, 1] = work.torque[1, 0] = xy
    work.torque[0, 2] = work.torque[2, 0] = xz
    work.torque[1, 2] = work.torque[2, 1] = yz
    k = work.geometric.shape[0]
    first = platform.freedom.shape[0] - k
    for j in range(k):
        for i in range(k):
            if k == 3:
                work.geometric[j, i] = work.torque[j, i]
                continue
            total = 0.0
            for a in range(3):
                for b in range(3):
                    total += platform.freedom[first + j, 3 + a] * work.torque[a, b] * platform.freedom[first + i, 3 + b]
            work.geometric[j, i] = total


@formula
def _bending(weight: float, x: float, z: float, cosine: float, sine: float) -> tuple[float, float, float]:
    """1/(T_A + T_B) [1/N], the part of the compliance along a direction that does not stretch the cable, and atanh."""
    # The part is in units of the length times the first result. `weight`: wL [N]. `x`, `z`: force at the platform end.
    # `cosine`, `sine`: horizontal and vertical component of the direction. The third result is atanh(u)/u - 1.
    za = z - weight
    at_end, at_frame = math.sqrt(x * x + z * z), math.sqrt(x * x + za * za)
    turn = 1.0 / (at_end + at_frame)
    inverse = 1.0 / (at_end * at_frame)
    u = weight * turn
    excess = atanhc_excess_polynomial(u * u) if u * u <= EXCESS_LIMIT else math.inf
    # q c^2 + 2 c s r + p s^2 of `catenary_stiffness`, as a square without cancellation
    level, mixed = (x * x - za * z) * inverse, x * (za + z) * inverse
    larger = 1.0 + abs(level)
    bend = mixed * cosine - larger * sine if level >= 0.0 else larger * cosine - mixed * sine
    return turn, 2.0 * excess * cosine * cosine + bend * bend / larger, excess


@glue
def _fill_compliances(model: Model, cables: Cables, work: StabilityArrays) -> None:
    """Fill upper bounds of the compliances c of the platform ends along their chords, (m,) [m/N]."""
    compliance = work.compliance
    shallow = model.code != codes.CATENARY and model.code != codes.ELASTIC
    if shallow:
        _fill_shallow_compliances(model, cables, work)
    else:
        _fill_exact_compliances(model, cables, compliance)
    if cables.machine:
        for i in independent(cables.tau.size):
            length = cables.ratio[i] * cables.free_chord[i]
            weight = cables.density[i] * model.gravity if model.code == codes.CATENARY else 0.0
            x, z = cables.tau[i] * cables.cosine[i], cables.tau[i] * cables.sine[i]
            za = z + (cables.sag_force[i] - weight * length if model.code == codes.CATENARY else 0.0)
            at_frame = math.sqrt(x * x + za * za)
            wrap = Wrap(cables.wrap_sine[i], cables.wrap_cosine[i], math.pi)  # psi at its largest value
            strained = 1.0 + at_frame / cables.stiffness[i]
            soft = strained * softness(pulley_of(cables, i), weight, cables.stiffness[i], at_frame, wrap)
            compliance[i] += strained * soft / (1.0 + weight * za / at_frame * soft)
    if shallow:
        for i in independent(cables.tau.size):
            left = 1.0 - compliance[i] * work.coupling[i]
            compliance[i] = compliance[i] / left if left > 0.0 else math.inf


@glue
def _fill_exact_compliances(model: Model, cables: Cables, compliance: Array) -> None:
    """Fill the compliances u.(dB/dT) u of exact or weightless cables without pulleys."""
    # For deep sag, beyond the range of the polynomial, the compliances are infinite.
    for i in independent(cables.tau.size):
        length = cables.ratio[i] * cables.free_chord[i]
        weight = cables.density[i] * model.gravity if model.code == codes.CATENARY else 0.0
        x, z = cables.tau[i] * cables.cosine[i], cables.tau[i] * cables.sine[i] + cables.sag_force[i]
        turn, bent, _excess = _bending(weight * length, x, z, cables.cosine[i], cables.sine[i])
        compliance[i] = length * (1.0 / cables.stiffness[i] + turn * bent)


@glue
def _fill_shallow_compliances(model: Model, cables: Cables, work: StabilityArrays) -> None:
    """Fill 1/a and the coupling of shallow cables without pulleys, where a is the stiffness along the chord."""
    # In the axes u and n (normal to the chord in the cable's plane), the stiffness is ((a, p), (q, tau/D)) from the
    # slopes of `_shallow_slopes`. Its symmetric part is at least (a - e^2 D/tau) u u^T with e = (p + q)/2. Cable behind
    # a pulley, in series, reduces tau/D by less than |p q|/a.
    for i in independent(cables.tau.size):
        tau, chord, sine, cosine = cables.tau[i], cables.chord[i], cables.sine[i], cables.cosine[i]
        density = cables.density[i] if model.gravity != 0.0 else 0.0  # without gravity, the cables are weightless
        stretched = cables.sag_force[i] if model.code == codes.EMPIRICAL else 0.0  # sag force that stretches the cable
        x, z = tau * cosine, tau * sine + stretched
        strain = cables.ratio[i] / (math.sqrt(x * x + z * z) * cables.stiffness[i])
        sag = sag_of_shallow(model, density * chord) / (tau * tau)
        share = sag * cosine * cosine
        slope = 1.0 / (chord * (strain * (tau + stretched * sine) + 2.0 * share / tau))
        unit = cables.sag_force[i] / chord
        along = slope * (1.0 + 3.0 * share - strain * (stretched + tau * sine) * stretched) + unit * sine
        p, q = -slope * cosine * (2.0 * sag * sine + strain * tau * stretched), unit * cosine
        across = tau / chord - abs(p * q) / along
        work.compliance[i] = 1.0 / along
        solvable = along > 0.0 and across > 0.0
        work.coupling[i] = 0.25 * (p + q) * (p + q) / across if solvable else math.inf


@glue
def _fill_compliances_of_slanted(
    model: Model, exits: Exits, cables: Cables, balance: Balance, compliance: Array
) -> None:
    """`_fill_compliances` along the first chords, for swivel axes of any direction."""
    # Behind the exit point, the cable is as soft as without weight, and the pulley swings about its axis. The weight
    # changes this by a share of about (wR/T)^2 + w(R psi + D)/EA; the bounds are larger by a tenth.
    rows, known, gravity = balance.geometry, exits.work, model.gravity if model.code == codes.CATENARY else 0.0
    for i in independent(cables.tau.size):
        swivel, length = swivel_at(exits.swivels, i, gravity), cables.ratio[i] * cables.chord[i]
        cx, cy = rows[g.AZIMUTH_X, i], rows[g.AZIMUTH_Y, i]
        ux, uy, uz = -balance.full[0, i], -balance.full[1, i], -balance.full[2, i]
        x, z = cables.tau[i] * cables.cosine[i], cables.tau[i] * cables.sine[i] + cables.sag_force[i]
        level, across = ux * cx + uy * cy, uy * cx - ux * cy
        turn, bent, excess = _bending(swivel.weight * length, x, z, level, uz)
        bent += 2.0 * (1.0 + excess) * (across * across)
        za = z - swivel.weight * length
        aside = ux * known[SIDE, i] + uy * known[SIDE + 1, i] + uz * known[SIDE + 2, i]
        swing = swivel.radius * known[SINE, i] / ((1.0 + known[COSINE, i]) * math.sqrt(x * x + za * za))
        behind = (swivel.radius * known[WRAP, i] + swivel.dead) / cables.stiffness[i] + swing * aside * aside
        light = swivel.weight * swivel.radius <= WEIGHT_ON_PULLEY * math.sqrt(x * x + za * za)
        share = MORE if light else math.inf
        compliance[i] = length * (1.0 / cables.stiffness[i] + turn * bent) + share * behind


@glue
def _compares_all_rotations(balance: Balance, work: StabilityArrays) -> bool:
    """True if 1 + L^T G L is positive definite."""
    k = work.geometric.shape[0]
    first = balance.inverse.shape[0] - k
    factor, product, proof = work.elastic, work.proof[:k], work.proof[k:]
    for j in range(k):
        for i in range(j + 1):
            total = 0.0
            for c in range(work.compliance.size):
                total += work.compliance[c] * balance.inverse[first + j, c] * balance.inverse[first + i, c]
            factor[j, i] = total
    if not factor_positive(factor, 0.0, factor):
        return False
    for j in range(k):
        for i in range(k):
            product[j, i] = 0.0
            for a in range(i, k):
                product[j, i] += work.geometric[j, a] * factor[a, i]
    for j in range(k):
        for i in range(j + 1):
            proof[j, i] = 1.0 - ROUNDING if i == j else 0.0
            for a in range(j, k):
                proof[j, i] += factor[a, j] * product[a, i]
    return factor_positive(proof, 0.0, proof)
