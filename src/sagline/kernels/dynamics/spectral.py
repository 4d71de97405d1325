"""Stiffness and mass matrices of one cable for its modes, with spectral elements; docs/model.md, section 11.

With Gauss-Lobatto nodes the mass matrix is diagonal. The length of an element is limited, so that the flexibility C of
the cable is smooth in the element. The degree of an element follows from the number of waves in it. Unknowns are scaled
by the square roots of their masses.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from sagline.core.arrays import Array, Indices
from sagline.kernels.dynamics.string import (
    BEHIND_X,
    BEHIND_Y,
    BEHIND_Z,
    String,
    element_length,
    is_at_end,
    slowness,
    string_at,
    vertical_at,
)
from sagline.kernels.jit import entry, formula, kernel

LARGEST_DEGREE = 48
LEAST_DEGREE = 6
HALF_WAVE = 1.5  # polynomial degree per half wavelength
ALWAYS = 7.0  # constant that is added to the polynomial degree for the waves
MOST_PHASE = math.pi * (LARGEST_DEGREE - ALWAYS) / HALF_WAVE

Rule = tuple[Array, Array, Array, Array]


class Lobatto(NamedTuple):
    """Gauss-Lobatto nodes on [-1, 1], weights, slopes and integrals; first axis: degree p; unused entries are 0."""

    nodes: Array  # (p, i)
    weights: Array  # (p, i)
    slopes: Array  # derivative at node q of the Lagrange polynomial of node i, (p, q, i)
    integrals: Array  # integral of the Lagrange polynomial of node i from -1 to node q, (p, q, i)


class _Element(NamedTuple):
    """A part of a cable: its start and its length [m], its first node, and its degree."""

    start: float
    size: float
    first: int
    degree: int


@formula
def _element_from(string: String, omega: float, start: float, first: int) -> _Element:
    """The element that starts at the material point `start` and the node `first`."""
    size = element_length(string, start, omega, MOST_PHASE)
    vertical = vertical_at(string, start + 0.5 * size)
    force = math.sqrt(string.horizontal * string.horizontal + vertical * vertical)
    waves = omega * size * slowness(string, force) / math.pi
    degree = min(max(math.ceil(HALF_WAVE * waves + ALWAYS), LEAST_DEGREE), LARGEST_DEGREE)
    return _Element(start, size, first, degree)


@formula
def _element_flexibility(string: String, s: float) -> tuple[float, float, float, float, float, float, float]:
    """Flexibility at the material point `s`: entries xx, xz, zz of C^-1 and then of C, and C normal to the plane."""
    vertical = vertical_at(string, s)
    square = string.horizontal * string.horizontal + vertical * vertical
    across = 1.0 / math.sqrt(square) + 1.0 / string.stiffness
    along = 1.0 / string.stiffness
    xx, xz = string.horizontal * string.horizontal / square, string.horizontal * vertical / square
    zz = vertical * vertical / square
    stiff, more, less = 1.0 / across, string.stiffness - 1.0 / across, along - across
    return stiff + more * xx, more * xz, stiff + more * zz, across + less * xx, less * xz, across + less * zz, across


@kernel
def _add_element(string: String, part: _Element, lobatto: Lobatto, plane: Array, normal: Array) -> None:
    """Add the stiffness of an element: to `plane` with two unknowns per node, to `normal` with one unknown per node."""
    n = part.degree + 1
    slopes = lobatto.slopes[part.degree]
    half = 0.5 * part.size
    for q in range(n):
        s = part.start + half * (1.0 + lobatto.nodes[part.degree, q])
        weight = lobatto.weights[part.degree, q] / half
        xx, xz, zz, _, _, _, across = _element_flexibility(string, s)
        xx, xz, zz, yy = xx * weight, xz * weight, zz * weight, weight / across
        row = slopes[q]
        for i in range(n):
            sx, sm, sz, sy = xx * row[i], xz * row[i], zz * row[i], yy * row[i]
            one, two = plane[2 * (part.first + i)], plane[2 * (part.first + i) + 1]
            only = normal[part.first + i]
            for j in range(n):
                at = part.first + j
                one[2 * at] += sx * row[j]
                one[2 * at + 1] += sm * row[j]
                two[2 * at] += sm * row[j]
                two[2 * at + 1] += sz * row[j]
                only[at] += sy * row[j]


@kernel
def _add_sums(string: String, part: _Element, lobatto: Lobatto, points: Array) -> None:
    """Fill s and the integral of C from the frame end to each node of an element, and add the mass at each node."""
    n = part.degree + 1
    half = 0.5 * part.size
    for q in range(n):
        at = part.first + q
        points[at, 0] = part.start + half * (1.0 + lobatto.nodes[part.degree, q])
        points[at, 1] += string.density * half * lobatto.weights[part.degree, q]
        for k in range(4):
            points[at, 2 + k] = points[part.first, 2 + k]
    for i in range(n):
        _, _, _, xx, xz, zz, yy = _element_flexibility(string, points[part.first + i, 0])
        for q in range(1, n):
            share = half * lobatto.integrals[part.degree, q, i]
            row = points[part.first + q]
            row[2] += share * xx
            row[3] += share * xz
            row[4] += share * zz
            row[5] += share * yy


@kernel
def _add_stretch(string: String, part: _Element, lobatto: Lobatto, plane: Array) -> None:
    """Add one element's stiffness against stretching to the in-plane stiffness `plane`."""
    n = part.degree + 1
    half = 0.5 * part.size
    for q in range(n):
        vertical = vertical_at(string, part.start + half * (1.0 + lobatto.nodes[part.degree, q]))
        square = string.horizontal * string.horizontal + vertical * vertical
        weight = string.stiffness * lobatto.weights[part.degree, q] / (half * square)
        row = lobatto.slopes[part.degree, q]
        for i in range(2 * n):
            one = string.horizontal if i % 2 == 0 else vertical
            for j in range(2 * n):
                other = string.horizontal if j % 2 == 0 else vertical
                plane[2 * part.first + i, 2 * part.first + j] += weight * row[i // 2] * row[j // 2] * one * other


@formula
def _lagrange(lobatto: Lobatto, degree: int, place: float, values: Array) -> None:
    """Fill the values of the Lagrange polynomials at `place` in [-1, 1], with barycentric weights."""
    total = 0.0
    sign = 1.0
    for i in range(degree + 1):
        apart = place - lobatto.nodes[degree, i]
        if abs(apart) < 1e-14:
            values[: degree + 1] = 0.0
            values[i] = total = 1.0
            break
        values[i] = sign * math.sqrt(lobatto.weights[degree, i]) / apart
        total += values[i]
        sign = -sign
    for i in range(degree + 1):
        values[i] /= total


@entry
def node_counts(strings: Array, omega: float, counts: Indices) -> None:
    """Fill the number of nodes (m,) that each cable needs for angular frequencies up to `omega` [rad/s]."""
    for i in range(strings.shape[0]):
        string = string_at(strings, i)
        start, nodes = 0.0, 0
        for _ in range(100_000):
            part = _element_from(string, omega, start, nodes)
            start, nodes = part.start + part.size, nodes + part.degree
            if is_at_end(string, start):
                break
        counts[i] = nodes + 1


@formula
def _fill_rest_shapes(points: Array, count: int, carried: Array, still: Array) -> None:
    """Fill static shapes xx, xz, zx, zz, yy times the roots of nodal masses, (nodes, 5), and effective masses, (4,)."""
    end = points[count - 1]
    determinant = end[2] * end[4] - end[3] * end[3]
    still[:] = 0.0
    for q in range(count):
        mass, xx, xz, zz = points[q, 1], points[q, 2], points[q, 3], points[q, 4]
        root = math.sqrt(mass)
        first, second = (xx * end[4] - xz * end[3]) / determinant, (xz * end[2] - xx * end[3]) / determinant
        third, fourth = (xz * end[4] - zz * end[3]) / determinant, (zz * end[2] - xz * end[3]) / determinant
        normal = points[q, 5] / end[5]
        row = carried[q]
        row[0], row[1], row[2], row[3] = root * first, root * second, root * third, root * fourth
        row[4] = root * normal
        still[0] += mass * (first * first + third * third)
        still[1] += mass * (first * second + third * fourth)
        still[2] += mass * (second * second + fourth * fourth)
        still[3] += mass * normal * normal


@formula
def _constrain_unknown(matrix: Array, unknown: int, stiffness: float) -> None:
    """Fix an unknown: decouple it from the other unknowns, and set its diagonal stiffness."""
    for j in range(matrix.shape[0]):
        matrix[unknown, j] = matrix[j, unknown] = 0.0
    matrix[unknown, unknown] = stiffness


@formula
def _scale_by_masses(matrix: Array, points: Array, used: int, each: int) -> None:
    """Divide a stiffness matrix by the square roots of the masses of rows and columns. `each`: unknowns per node."""
    for i in range(used):
        first = 1.0 / math.sqrt(points[i // each, 1])
        for j in range(used):
            matrix[i, j] *= first / math.sqrt(points[j // each, 1])


@formula
def _set_frame_end(strings: Array, i: int, count: int, plane: Array) -> None:
    """Set the only flexible direction of the frame end as its first unknown; its second unknown remains unused."""
    x, z = strings[i, BEHIND_X], strings[i, BEHIND_Z]
    square = x * x + z * z
    if square > 0.0:
        root = math.sqrt(square)
        x, z = x / root, z / root
        plane[0, 0] = x * x * plane[0, 0] + 2.0 * x * z * plane[0, 1] + z * z * plane[1, 1] + 1.0 / square
        for j in range(2, 2 * count):
            plane[0, j] = plane[j, 0] = x * plane[0, j] + z * plane[1, j]
    for j in range(2 * count):
        plane[1, j] = plane[j, 1] = 0.0
        if not square > 0.0:
            plane[0, j] = plane[j, 0] = 0.0


@entry
def spectral_matrices(
    strings: Array, omega: float, rule: Rule, points: Array, plane: Array, normal: Array, carried: Array, still: Array
) -> None:
    """Matrices of m cables, whose eigenvalues are the squared natural angular frequencies with both ends fixed."""
    # strings: (m, STRING_COLUMNS).
    # omega: Largest angular frequency whose waves the elements resolve [rad/s].
    # rule: `Lobatto`.
    # points: Filled with s, mass and integrals of C of every node, (m, nodes, 6); s is NaN for unused nodes.
    # plane: Filled with scaled stiffness in the plane, (m, 2 nodes, 2 nodes), node by node [1/s^2].
    # normal: Filled with scaled stiffness normal to the plane [1/s^2], (m, nodes, nodes).
    # carried: Filled with the static motion of each node per motion of the platform end, times the root of the node's
    #   mass, (m, nodes, 5).
    # still: Filled with effective masses [kg] of the cable in its static motion, (m, 4): xx, xz, zz, yy.
    lobatto = Lobatto(*rule)
    stiff = 1e6 * omega * omega
    for i in range(strings.shape[0]):
        string = string_at(strings, i)
        points[i] = 0.0
        plane[i] = 0.0
        normal[i] = 0.0
        carried[i] = 0.0
        x, z = strings[i, BEHIND_X], strings[i, BEHIND_Z]
        points[i, 0, 2], points[i, 0, 3], points[i, 0, 4], points[i, 0, 5] = x * x, x * z, z * z, strings[i, BEHIND_Y]
        start, first = 0.0, 0
        for _ in range(100_000):
            part = _element_from(string, omega, start, first)
            _add_sums(string, part, lobatto, points[i])
            _add_element(string, part, lobatto, plane[i], normal[i])
            start, first = part.start + part.size, first + part.degree
            if is_at_end(string, start):
                break
        count = first + 1
        _set_frame_end(strings, i, count, plane[i])
        if strings[i, BEHIND_Y] > 0.0:
            normal[i, 0, 0] += 1.0 / strings[i, BEHIND_Y]
        _scale_by_masses(plane[i], points[i], 2 * count, 2)
        _scale_by_masses(normal[i], points[i], count, 1)
        gives = x * x + z * z > 0.0
        _fill_rest_shapes(points[i], count, carried[i], still[i])
        if gives:  # the flexible direction of the frame end is the first unknown
            root = math.sqrt(x * x + z * z)
            for k in range(2):
                carried[i, 0, k] = (x * carried[i, 0, k] + z * carried[i, 0, 2 + k]) / root
                carried[i, 0, 2 + k] = 0.0
        else:
            _constrain_unknown(plane[i], 0, stiff)
        _constrain_unknown(plane[i], 1, stiff)
        if not strings[i, BEHIND_Y] > 0.0:
            _constrain_unknown(normal[i], 0, stiff)
        for unknown in range(2 * count - 2, plane.shape[1]):
            _constrain_unknown(plane[i], unknown, stiff)
        for unknown in range(count - 1, normal.shape[1]):
            _constrain_unknown(normal[i], unknown, stiff)
        points[i, count : points.shape[1], 0] = math.nan


@entry
def interpolate(strings: Array, omega: float, rule: Rule, points: Array, values: Array) -> None:
    """Fill matrices (m, count, nodes) that give displacements at equal steps of length from the scaled node motions."""
    lobatto = Lobatto(*rule)
    count = values.shape[1]
    for i in range(strings.shape[0]):
        string = string_at(strings, i)
        values[i] = 0.0
        part = _element_from(string, omega, 0.0, 0)
        for k in range(count):
            s = string.length * k / (count - 1)
            for _ in range(100_000):
                end = part.start + part.size
                if s <= end or is_at_end(string, end):
                    break
                part = _element_from(string, omega, end, part.first + part.degree)
            place = min(max(2.0 * (s - part.start) / part.size - 1.0, -1.0), 1.0)
            _lagrange(lobatto, part.degree, place, values[i, k, part.first : part.first + part.degree + 1])
            for q in range(part.first, part.first + part.degree + 1):
                values[i, k, q] /= math.sqrt(points[i, q, 1])


@entry
def stretch_matrices(strings: Array, omega: float, rule: Rule, points: Array, matrices: Array) -> None:
    """Fill the scaled in-plane stiffness against stretching alone, (m, 2 nodes, 2 nodes)."""
    lobatto = Lobatto(*rule)
    for i in range(strings.shape[0]):
        string = string_at(strings, i)
        matrix = matrices[i]
        matrix[:] = 0.0
        start, first = 0.0, 0
        for _ in range(100_000):
            part = _element_from(string, omega, start, first)
            _add_stretch(string, part, lobatto, matrix)
            start, first = part.start + part.size, first + part.degree
            if is_at_end(string, start):
                break
        _set_frame_end(strings, i, first + 1, matrix)
        _scale_by_masses(matrix, points[i], 2 * first + 2, 2)
