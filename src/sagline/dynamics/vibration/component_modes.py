"""Component modes: modes of every cable with fixed ends, and their participation factors."""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.polynomial import legendre
from scipy.special import roots_jacobi

from sagline.core.arrays import Array, Flags, Indices, locked
from sagline.kernels.dynamics import spectral
from sagline.kernels.dynamics import string as columns
from sagline.statics.strings import Strings


@cache
def _lobatto() -> spectral.Lobatto:
    """Gauss-Lobatto nodes, weights and matrices."""
    n = spectral.LARGEST_DEGREE + 1
    rule = spectral.Lobatto(np.zeros((n, n)), np.zeros((n, n)), np.zeros((n, n, n)), np.zeros((n, n, n)))
    for p in range(2, n):
        nodes = np.concatenate(([-1.0], roots_jacobi(p - 1, 1.0, 1.0)[0], [1.0]))
        values = np.asarray(legendre.legvander(nodes, p + 1), dtype=np.float64)
        weights = np.asarray(2.0 / (p * (p + 1) * values[:, p] ** 2))
        rule.nodes[p, : p + 1], rule.weights[p, : p + 1] = nodes, weights
        rule.slopes[p, : p + 1, : p + 1] = _slopes(nodes, values[:, p])
        rule.integrals[p, : p + 1, : p + 1] = _integrals(weights, values)
    for field in rule:
        locked(field)
    return rule


def _slopes(nodes: Array, last: Array) -> Array:
    """Derivatives of the Lagrange polynomials at the nodes; `last`: values of the highest Legendre polynomial there."""
    apart = nodes[:, None] - nodes
    np.fill_diagonal(apart, 1.0)
    slopes = last[:, None] / last / apart
    np.fill_diagonal(slopes, 0.0)
    np.fill_diagonal(slopes, -slopes.sum(axis=1))  # a constant has zero derivative
    return np.asarray(slopes)


def _integrals(weights: Array, values: Array) -> Array:
    """Integrals of the Lagrange polynomials from -1 to the nodes, from Legendre polynomials up to degree p + 1."""
    p = weights.size - 1
    scale = np.arange(p + 1) + 0.5
    scale[p] = 0.5 * p  # the quadrature rule overestimates the square of the last polynomial
    shares = scale[:, None] * (values[:, : p + 1] * weights[:, None]).T  # Legendre coefficients, one node per column
    odd = 2.0 * np.arange(1, p + 1) + 1.0
    sums = np.column_stack((values[:, 0] + values[:, 1], (values[:, 2:] - values[:, :p]) / odd))
    return np.asarray(sums @ shares)


_TINY = 1e-300


class PlaneModes:
    """Fixed-end modes of the taut cables, either in the plane or normal to the plane, k modes per cable.

    The u unknowns of a cable are displacements times the root of the node's mass.
    """

    def __init__(self, matrix: Array, rest: Array, free: Flags, first: int) -> None:
        """Solve the eigenproblem without the unknowns that are fixed in all cables."""
        last = matrix.shape[1] - (2 if rest.shape[2] == 2 else 1)
        self.rest = rest  # quasi-static shape of the nodes for a displaced platform end, shape (t, u, d)
        # square: angular frequencies squared, ascending [1/s^2], shape (t, k)
        self.square, own = np.linalg.eigh(matrix[:, first:last, first:last])
        self.shape = np.zeros((*matrix.shape[:2], last - first))  # mode shapes at the nodes, shape (t, u, k)
        self.shape[:, first:last] = own
        # modal force per acceleration of the platform end, shape (t, k, d)
        self.drive = np.swapaxes(own, -1, -2) @ (rest * free)[:, first:last]


class CableComponents:
    """Fixed-end modes of the t taut cables of one state: T modes, in-plane modes first."""

    def __init__(self, strings: Strings, row: int, up_to: float) -> None:
        """Cable modes of the state `row`, accurate up to `up_to` [Hz]. Higher modes only complete the basis."""
        # taut: indices of the taut cables, shape (t,)
        # omega: highest angular frequency for which the nodes are dense enough [rad/s]
        self.omega, self.taut = 2.0 * np.pi * up_to, np.flatnonzero(strings.taut[row])
        # rows of the taut cables in the table of strings, shape (t, STRING_COLUMNS)
        self.table = np.ascontiguousarray(strings.table[row, self.taut])
        # horizontal in the plane, normal to the plane, and upward, shape (t, 3, 3)
        self.axes = axes = strings.axes[row, self.taut]
        counts = np.empty(self.taut.size, dtype=np.int64)
        spectral.node_counts(self.table, self.omega, counts)
        t, n = self.taut.size, int(counts.max(initial=2))
        # points: material point [m], mass [kg] and integrals of C at the nodes, shape (t, nodes, 6)
        self.points, carried, mass = np.empty((t, n, 6)), np.empty((t, n, 5)), np.empty((t, 4))
        plane, normal = np.empty((t, 2 * n, 2 * n)), np.empty((t, n, n))
        spectral.spectral_matrices(self.table, self.omega, _lobatto(), self.points, plane, normal, carried, mass)
        free = (np.arange(n) < counts[:, None] - 1)[..., None]  # the platform end is fixed
        first = 0 if self.table[:, columns.BEHIND_X :].any() else 1  # a frame end without compliance is also fixed
        inside = PlaneModes(plane, carried[:, :, :4].reshape(t, 2 * n, 2), np.repeat(free, 2, axis=1), 2 * first)
        aside = PlaneModes(normal, carried[:, :, 4:], free, first)
        # plane: modes in the cables' planes, grouped by cable
        # normal: modes normal to the planes
        self.plane, self.normal = inside, aside
        # squared angular frequencies [1/s^2], shape (T,)
        self.square = np.concatenate((inside.square.reshape(-1), aside.square.reshape(-1)))
        # cable index of each mode, shape (T,)
        self.cable = np.concatenate([np.repeat(self.taut, modes.square.shape[1]) for modes in (inside, aside)])
        swings, sways = inside.drive @ axes[:, ::2], aside.drive @ axes[:, 1:2]
        # modal force per acceleration of the platform end, world axes, shape (T, 3) [sqrt(kg)]
        self.participation = np.concatenate((swings.reshape(-1, 3), sways.reshape(-1, 3)))
        # M_0, mass of every cable for quasi-static motion of its end, world axes, shape (m, 3, 3) [kg]
        self.still = _still(mass, axes, self.taut, strings.taut.shape[1])

    @property
    def density(self) -> Array:
        """Linear density of the taut cables [kg/m], shape (t,)."""
        return np.asarray(self.table[:, columns.DENSITY])

    def planes(self, ends: Array, amplitudes: Array) -> tuple[tuple[PlaneModes, Array, Array], ...]:
        """In-plane modes and normal modes, each with the part of K motions that belongs to it."""
        # shapes: ends (m, 3, K), world axes; amplitudes (T, K). returns for both: modes; displacements of the platform
        # ends along their directions (t, d, K); amplitudes (t, k, K)
        own, inside = self.axes @ ends[self.taut], self.plane.square.size
        swing = amplitudes[:inside].reshape(*self.plane.square.shape, ends.shape[2])
        sway = amplitudes[inside:].reshape(*self.normal.square.shape, ends.shape[2])
        return (self.plane, own[:, ::2], swing), (self.normal, own[:, 1:2], sway)

    def _node_motion(self, ends: Array, amplitudes: Array) -> tuple[Array, Array]:
        """Displacements of the nodes in the cables' planes and normal to them, times the root of the node's mass."""
        # shapes: ends (m, 3, K); amplitudes (T, K); returns (t, 2 nodes, K)
        plane, normal = (
            motions.rest @ end + motions.shape @ given for motions, end, given in self.planes(ends, amplitudes)
        )
        return plane, normal

    def shapes(self, ends: Array, amplitudes: Array, count: int) -> Array:
        """Displacements of all cables at equally spaced material points, frame end first, (K, m, count, 3)."""
        t, n, k = self.taut.size, self.points.shape[1], ends.shape[2]
        values = np.empty((t, count, n))
        spectral.interpolate(self.table, self.omega, _lobatto(), self.points, values)
        plane, normal = self._node_motion(ends, amplitudes)
        inside = plane.reshape(t, n, 2, k)
        behind = self.table[:, [columns.BEHIND_X, columns.BEHIND_Z]]
        slide = np.hypot(*behind.T)  # an elastic frame end has one motion in the plane
        inside[:, 0] = (behind / np.maximum(slide, _TINY)[:, None])[:, :, None] * inside[:, 0, :1]
        own = np.concatenate((inside, normal[:, :, None]), axis=2)
        turned = np.swapaxes(self.axes[:, None, [0, 2, 1]], -1, -2) @ own
        shapes = (values @ turned.reshape(t, n, 3 * k)).reshape(t, count, 3, k)
        if t < ends.shape[0]:
            moved, shapes = shapes, np.zeros((ends.shape[0], count, 3, k))
            shapes[self.taut] = moved
        return np.moveaxis(shapes, -1, 0)

    def stretch_energy(self, ends: Array, amplitudes: Array) -> Array:
        """Twice the stretch energy of each cable in each mode of unit modal mass, (t, K) [1/s^2]."""
        plane, _ = self._node_motion(ends, amplitudes)
        return np.asarray(np.einsum("tik,tik->tk", plane, self._stretch_matrices() @ plane))

    def stretch_stiffness(self) -> Array:
        """Stretch stiffness matrix of the quasi-static displacements of the platform end and the in-plane modes."""
        # returns (t, 2 + k, 2 + k)
        motions = self.plane
        basis = np.concatenate((motions.rest, motions.shape), axis=2)
        return np.asarray(np.swapaxes(basis, -1, -2) @ self._stretch_matrices() @ basis)

    def _stretch_matrices(self) -> Array:
        n = self.points.shape[1]
        matrices = np.empty((self.taut.size, 2 * n, 2 * n))
        spectral.stretch_matrices(self.table, self.omega, _lobatto(), self.points, matrices)
        return matrices


def _still(mass: Array, axes: Array, taut: Indices, count: int) -> Array:
    """Mass matrices of all cables in world axes, (m, 3, 3), zero for slack cables."""
    # mass: elements xx, xz, zz, yy of each taut cable's mass matrix, in the axes of the cable
    own = np.zeros((taut.size, 3, 3))
    own[:, 0, 0], own[:, 0, 2], own[:, 2, 0], own[:, 2, 2], own[:, 1, 1] = mass[:, [0, 1, 1, 2, 3]].T
    still = np.zeros((count, 3, 3))
    still[taut] = np.swapaxes(axes, -1, -2) @ own @ axes
    return still
