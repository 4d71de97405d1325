"""Exact dynamic stiffness of one cable, and number of its natural frequencies below a given frequency.

Elements are joined one by one, starting at the frame end; docs/model.md, section 11. The transfer matrix of an element
follows from u' = C f, f' = -mu u about the state of rest, by collocation at eight Gauss points. The motion normal to
the cable's plane has one component, and the motion in the plane has two; the same code solves both. The numbers are
real without damping and complex with damping.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from sagline.core.arrays import Array, Indices, locked
from sagline.kernels.dynamics.string import (
    BEHIND_X,
    BEHIND_Y,
    BEHIND_Z,
    String,
    element_length,
    is_at_end,
    shortest_wave,
    string_at,
    vertical_at,
)
from sagline.kernels.jit import entry, formula, glue, kernel

Numbers = Any  # an array of float64 or complex128
STAGES = 8


def _gauss() -> tuple[Array, Array, Array]:
    """Nodes and weights of Gauss collocation on [0, 1], and integrals from 0 to the nodes."""
    nodes, weights = np.polynomial.legendre.leggauss(STAGES)
    basis = [np.polynomial.legendre.Legendre.basis(k) for k in range(STAGES)]
    values = np.array([one(nodes) for one in basis])
    integrals = np.array([one.integ(lbnd=-1.0)(nodes) for one in basis])
    scale = np.arange(STAGES) + 0.5
    lagrange = values * weights * scale[:, None]  # Legendre polynomials, one node per column
    return 0.5 * (nodes + 1.0), 0.5 * weights, np.ascontiguousarray(0.5 * (integrals.T @ lagrange))


NODES, WEIGHTS, INTEGRALS = (locked(values) for values in _gauss())  # compiled kernels contain them as constants


class _Wave(NamedTuple):
    """Terms of the two wave equations at a frequency: mu, and factors of C for transverse and longitudinal waves."""

    mu: Any
    across: Any
    along: Any


@glue
def _fill_flexibility(string: String, wave: _Wave, start: float, size: float, normal: bool, c: Numbers) -> None:
    """Fill C at the stages of an element, (STAGES, 3): xx, xz, zz. For motion normal to the plane, only xx is used."""
    for k in range(STAGES):
        vertical = vertical_at(string, start + NODES[k] * size)
        square = string.horizontal * string.horizontal + vertical * vertical
        turn = wave.across * (1.0 / math.sqrt(square) + 1.0 / string.stiffness)
        if normal:
            c[k, 0] = turn
        else:
            less = (wave.along / string.stiffness - turn) / square
            c[k, 0] = turn + less * string.horizontal * string.horizontal
            c[k, 1] = less * string.horizontal * vertical
            c[k, 2] = turn + less * vertical * vertical


@glue
def _fill_integral(c: Numbers, size: float, d: int, phi: Numbers) -> None:
    """Fill the integral of C over an element, (d, d)."""
    for a in range(d):
        for b in range(d):
            total = 0.0 * c[0, 0]
            for k in range(STAGES):
                total += WEIGHTS[k] * c[k, a + b]
            phi[a, b] = size * total


@glue
def _fill_stages(c: Numbers, mu: Any, size: float, d: int, system: Numbers) -> None:
    """Fill the matrix (STAGES d, STAGES d) of the equations of u at the stages, and right sides for u and f at 0."""
    scale = size * size * mu
    n = STAGES * d
    for i in range(STAGES):
        for a in range(d):
            row = system[i * d + a]
            row[:n] = 0.0
            for b in range(d):
                row[n + b] = 1.0 if a == b else 0.0
                total = 0.0 * mu
                for k in range(STAGES):
                    weighted = INTEGRALS[i, k] * c[k, a + b]
                    total += weighted
                    weighted *= scale
                    for j in range(STAGES):
                        row[j * d + b] += weighted * INTEGRALS[k, j]
                row[n + d + b] = size * total
            row[i * d + a] += 1.0


@glue
def _solve_in_place(system: Numbers, n: int, columns: int) -> None:
    """Solve `n` equations in place. The right sides are the columns after the matrix."""
    for k in range(n):
        best = k
        for i in range(k + 1, n):
            if abs(system[i, k]) > abs(system[best, k]):
                best = i
        if best != k:
            for j in range(k, columns):
                system[k, j], system[best, j] = system[best, j], system[k, j]
        inverse = 1.0 / system[k, k]
        for i in range(k + 1, n):
            ratio = system[i, k] * inverse
            for j in range(k + 1, columns):
                system[i, j] -= ratio * system[k, j]
    for r in range(n):
        i = n - 1 - r
        for k in range(i + 1, n):
            ratio = system[i, k]
            for j in range(n, columns):
                system[i, j] -= ratio * system[k, j]
        inverse = 1.0 / system[i, i]
        for j in range(n, columns):
            system[i, j] *= inverse


@glue
def _transfer(c: Numbers, mu: Any, size: float, d: int, system: Numbers, phi: Numbers) -> None:
    """Fill the transfer matrix (2 d, 2 d) of an element, which gives (u, f) at its end from (u, f) at its start."""
    n = STAGES * d
    _fill_stages(c, mu, size, d, system)
    _solve_in_place(system, n, n + 2 * d)
    for column in range(2 * d):
        for a in range(d):
            phi[a, column] = 1.0 if a == column else 0.0
            phi[d + a, column] = 1.0 if d + a == column else 0.0
        for k in range(STAGES):
            for b in range(d):
                force = 0.0 * mu + (1.0 if d + b == column else 0.0)
                for j in range(STAGES):
                    force -= size * mu * INTEGRALS[k, j] * system[j * d + b, n + column]
                for a in range(d):
                    phi[a, column] += size * WEIGHTS[k] * c[k, a + b] * force
                phi[d + b, column] -= size * mu * WEIGHTS[k] * system[k * d + b, n + column]


# columns of a wave's table: omega; omega^2; i omega c; factors of C for transverse and longitudinal waves
OMEGA, SQUARE, DRAG, ACROSS, ALONG = 0, 1, 2, 3, 4
WAVE_COLUMNS = 5
ROOM = (5 * STAGES, 20)  # shape of the work array
# largest number of meshes; the next mesh is tried if a joint is near a vibration node of the cable up to this joint
MESHES = 8
SHORTER = 0.0618034  # relative decrease of the element length from mesh to mesh; not a ratio of small integers
ROUNDING = 2.0**-52  # increase of mu from mesh to mesh, because omega may be exactly a frequency of a fixed cable
CLEAR = 1e-6  # least motion of a joint, relative to its static motion; a smaller motion is not accurate
# columns of a cable's result: in its plane, and normal to it
XX, XZ, ZZ, YY = 0, 1, 2, 3
FOUND = 4
MOST_ELEMENTS = 10_000
SINGULAR, TOO_MANY = -1, -2  # returned instead of a count


@glue
def _transfer_stiffness(phi: Numbers, d: int, k: Numbers, moved: Numbers) -> None:
    """Fill `moved`: displacements and forces at an element's end. The start has unit displacements u and forces k u."""
    for a in range(d):
        for b in range(d):
            end, force = phi[a, b], phi[d + a, b]
            for j in range(d):
                end += phi[a, d + j] * k[j, b]
                force += phi[d + a, d + j] * k[j, b]
            moved[a, b] = end
            moved[2 + a, b] = force


@glue
def _first_transfer(phi: Numbers, d: int, give: Numbers, lost: Any, k: Numbers, moved: Numbers) -> None:
    """`_transfer_stiffness` of the first element, which has a start with the compliance `give` * `lost`, (d, d)."""
    for a in range(d):
        for b in range(d):
            end, force = phi[a, d + b], phi[d + a, d + b]
            for j in range(d):
                end += phi[a, j] * lost * give[j, b]
                force += phi[d + a, j] * lost * give[j, b]
            moved[a, b] = end
            moved[2 + a, b] = force
    _stiffness_from_transfer(moved, d, k)


@formula
def _stiffness_from_transfer(moved: Numbers, d: int, k: Numbers) -> None:
    """Fill k = force end^-1; the rows of moved are the rows of end, followed by the rows of force."""
    if d == 1:
        k[0, 0] = moved[2, 0] / moved[0, 0]
    else:
        determinant = moved[0, 0] * moved[1, 1] - moved[0, 1] * moved[1, 0]
        for a in range(2):
            first, second = moved[2 + a, 0], moved[2 + a, 1]
            k[a, 0] = (first * moved[1, 1] - second * moved[1, 0]) / determinant
            k[a, 1] = (second * moved[0, 0] - first * moved[0, 1]) / determinant


@glue
def _negative_pivots(phi: Numbers, d: int, clear: float, moved: Numbers) -> int:
    """Number of negative eigenvalues of the pivot, the symmetric Phi_uf^-1 `moved`. SINGULAR if almost singular."""
    # At zero frequency, the determinant of the matrix `moved` is at least one. The determinant is zero if the joint is
    # at a vibration node of the cable between frame end and joint.
    if d == 1:
        pivot = moved[0, 0].real * phi[0, 1].real
        return SINGULAR if not abs(moved[0, 0]) > clear else int(pivot < 0.0)
    below = phi[0, 2].real * phi[1, 3].real - phi[0, 3].real * phi[1, 2].real
    one, other = moved[0, 0] * moved[1, 1], moved[0, 1] * moved[1, 0]
    if not abs(one - other) > clear:
        return SINGULAR
    determinant = (one - other).real * below
    first = (phi[1, 3].real * moved[0, 0].real - phi[0, 3].real * moved[1, 0].real) * below
    if determinant < 0.0:
        return 1
    return 2 if first < 0.0 else 0


@glue
def _negative_spring_pivots(phi: Numbers, d: int, give: Numbers) -> int:
    """Number of negative eigenvalues of the pivot 1/`give` + k00. The cable's start is flexible in one direction."""
    if d == 1:
        return int(1.0 + (give[0, 0] * phi[0, 0] / phi[0, 1]).real < 0.0)
    determinant = phi[0, 2] * phi[1, 3] - phi[0, 3] * phi[1, 2]
    total = 1.0 + 0.0 * give[0, 0]
    for b in range(2):
        top = (phi[1, 3] * phi[0, b] - phi[0, 3] * phi[1, b]) / determinant
        low = (phi[0, 2] * phi[1, b] - phi[1, 2] * phi[0, b]) / determinant
        total += give[0, b] * top + give[1, b] * low
    return int(total.real < 0.0)


@kernel
def _cable_stiffness_at(
    string: String, wave: _Wave, omega: float, phase: float, d: int, give: Numbers, room: Numbers, found: Numbers
) -> int:
    """Fill K(omega) - K(0) of a cable's platform end, (d, d). Returns the number of frequencies below `omega`."""
    # The natural frequencies are those of the cable with a fixed platform end. The result is SINGULAR if a joint is
    # close to a vibration node, and TOO_MANY if the number of elements is too large.
    c, system, phi = room[2 * STAGES : 3 * STAGES], room[: 2 * STAGES], room[3 * STAGES : 3 * STAGES + 4]
    rest, k = room[3 * STAGES + 4 :, :2], room[3 * STAGES + 4 :, 2:4]
    moved, whole = room[3 * STAGES :, 4:6], room[3 * STAGES :, 6:8]
    start = 0.0
    count = 0
    if shortest_wave(string, omega) * MOST_ELEMENTS < string.length:
        return TOO_MANY
    lost = wave.across if d == 1 else wave.along
    for number in range(MOST_ELEMENTS + 1):
        size = element_length(string, start, omega, phase)
        last = is_at_end(string, start + size)
        # at zero frequency, a unit force moves the end by the integral of C
        _fill_flexibility(string, _Wave(wave.mu, 1.0, 1.0), start, size, d == 1, c)
        _fill_integral(c, size, d, moved)
        for a in range(d):
            for b in range(d):
                whole[a, b] = moved[a, b] + (give[a, b] if number == 0 else whole[a, b])
        _fill_flexibility(string, wave, start, size, d == 1, c)
        _transfer(c, wave.mu, size, d, system, phi)
        if number == 0:
            count += _negative_spring_pivots(phi, d, give)
            _first_transfer(phi, d, give, lost, k, moved)
        else:
            _transfer_stiffness(phi, d, k, moved)
            below = _negative_pivots(phi, d, 0.0 if last else CLEAR, moved)
            if below == SINGULAR:
                return SINGULAR
            _stiffness_from_transfer(moved, d, k)
            count += below
        start += size
        if last:
            for a in range(d):
                for b in range(d):
                    moved[a, b] = whole[a, b]
                    moved[2 + a, b] = 1.0 if a == b else 0.0
            _stiffness_from_transfer(moved, d, rest)
            for a in range(d):
                for b in range(d):
                    found[a, b] = k[a, b] - rest[a, b]
            return count
    return TOO_MANY


@entry
def dynamic_stiffnesses(
    strings: Array, waves: Numbers, phase: float, room: Numbers, found: Numbers, counts: Indices
) -> None:
    """Dynamic part K(omega) - K(0) of the stiffness of m strings at N poses."""
    # strings: (N, m, STRING_COLUMNS).
    # waves: (1 or N, F, WAVE_COLUMNS), with the data type of room and found.
    # phase: Phase of a transverse wave in an element [rad], < pi.
    # room: Work array of shape ROOM.
    # found: Filled with K(omega) - K(0), (N, F, m, FOUND) [N/m]; NaN for a cable without force.
    # counts: Filled with the numbers of natural frequencies below omega, platform end fixed, in the plane and normal to
    #   it, (N, F, m, 2); negative if the cable has too many elements.
    give, block = room[4 * STAGES : 4 * STAGES + 2, :2], room[4 * STAGES : 4 * STAGES + 2, 2:4]
    for p in range(strings.shape[0]):
        for f in range(waves.shape[1]):
            row = waves[min(p, waves.shape[0] - 1), f]
            omega = row[OMEGA].real
            for i in range(strings.shape[1]):
                string = string_at(strings[p], i)
                wave = _Wave(string.density * row[SQUARE] - row[DRAG], row[ACROSS], row[ALONG])
                x, z, y = strings[p, i, BEHIND_X], strings[p, i, BEHIND_Z], strings[p, i, BEHIND_Y]
                give[0, 0], give[0, 1], give[1, 0], give[1, 1] = x * x, x * z, x * z, z * z
                for d in (2, 1):
                    count = SINGULAR
                    for mesh in range(MESHES):
                        other = _Wave(wave.mu * (1.0 + ROUNDING * mesh), wave.across, wave.along)
                        shorter = phase * (1.0 - SHORTER * mesh)
                        count = _cable_stiffness_at(string, other, omega, shorter, d, give, room, block)
                        if count != SINGULAR:
                            break
                    counts[p, f, i, 2 - d] = count
                    if d == 2:
                        found[p, f, i, XX], found[p, f, i, ZZ] = block[0, 0], block[1, 1]
                        found[p, f, i, XZ] = 0.5 * (block[0, 1] + block[1, 0])
                        give[0, 0] = y
                    else:
                        found[p, f, i, YY] = block[0, 0]
