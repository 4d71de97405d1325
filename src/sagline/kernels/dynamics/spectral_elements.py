"""Spectral elements of a cable: where they are, and what each adds to the cable's stiffness and mass.

Nodes are those of Gauss and Lobatto, so that the mass is diagonal. An element is as long as what the cable is made of
is smooth over it, and of the degree that the waves in it need; docs/model.md, section 11.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from sagline.core.arrays import Array
from sagline.kernels.dynamics.string import String, element_length, slowness, vertical_at
from sagline.kernels.jit import formula, kernel

LARGEST_DEGREE = 48
LEAST_DEGREE = 6
HALF_WAVE = 1.5  # degrees that a half wave needs
ALWAYS = 7.0  # and those beside them
MOST_PHASE = math.pi * (LARGEST_DEGREE - ALWAYS) / HALF_WAVE

Rule = tuple[Array, Array, Array, Array]


class Lobatto(NamedTuple):
    """Nodes on [-1, 1] and what belongs to them, by degree: each of LARGEST_DEGREE + 1 rows, what is unused zero.

    Attributes:
        nodes: (p, i).
        weights: (p, i).
        slopes: Derivative of the polynomial that is 1 at node i, at node q, (p, q, i).
        integrals: Integral from -1 to node q of that polynomial, (p, q, i).
    """

    nodes: Array
    weights: Array
    slopes: Array
    integrals: Array


class _Element(NamedTuple):
    """A part of a cable: where it begins and its length [m], its first node, and its degree."""

    start: float
    size: float
    first: int
    degree: int


@formula
def element_from(string: String, omega: float, start: float, first: int) -> _Element:
    """The element that begins at a material point and a node."""
    size = element_length(string, start, omega, MOST_PHASE)
    vertical = vertical_at(string, start + 0.5 * size)
    force = math.sqrt(string.horizontal * string.horizontal + vertical * vertical)
    waves = omega * size * slowness(string, force) / math.pi
    degree = min(max(math.ceil(HALF_WAVE * waves + ALWAYS), LEAST_DEGREE), LARGEST_DEGREE)
    return _Element(start, size, first, degree)


@formula
def _element_flexibility(string: String, s: float) -> tuple[float, float, float, float, float, float, float]:
    """C^-1 and C at a material point: xx, xz, zz of each, and C normal to the plane."""
    vertical = vertical_at(string, s)
    square = string.horizontal * string.horizontal + vertical * vertical
    across = 1.0 / math.sqrt(square) + 1.0 / string.stiffness
    along = 1.0 / string.stiffness
    xx, xz = string.horizontal * string.horizontal / square, string.horizontal * vertical / square
    zz = vertical * vertical / square
    stiff, more, less = 1.0 / across, string.stiffness - 1.0 / across, along - across
    return stiff + more * xx, more * xz, stiff + more * zz, across + less * xx, less * xz, across + less * zz, across


@kernel
def add_element(string: String, part: _Element, lobatto: Lobatto, plane: Array, normal: Array) -> None:
    """Add the stiffness of an element: to plane with two unknowns a node, to normal with one."""
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
def add_sums(string: String, part: _Element, lobatto: Lobatto, points: Array) -> None:
    """Fill of an element's nodes: s, the mass (added), and the integral of C from the frame end on."""
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
def add_stretch(string: String, part: _Element, lobatto: Lobatto, plane: Array) -> None:
    """Add that of one element."""
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
def lagrange(lobatto: Lobatto, degree: int, place: float, values: Array) -> None:
    """Fill the polynomials that are 1 at one node at a place on [-1, 1], by barycentric weights."""
    total = 0.0
    sign = 1.0
    for i in range(degree + 1):
        apart = place - lobatto.nodes[degree, i]
        if abs(apart) < 1e-14:
            for j in range(degree + 1):
                values[j] = 0.0
            values[i] = total = 1.0
            break
        values[i] = sign * math.sqrt(lobatto.weights[degree, i]) / apart
        total += values[i]
        sign = -sign
    for i in range(degree + 1):
        values[i] /= total
