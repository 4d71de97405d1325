"""Modes of every cable with both ends held, and how its platform end drives them: what a robot's modes are made of.

Modes above the cut are not dropped: what they answer to slow motions is kept in a few motions of each cable, which
match the first moments of all of them together (Krylov).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from sagline.arrays import Array, Flags, Indices
from sagline.dynamics.lobatto import lobatto
from sagline.kernels.dynamics import string as columns
from sagline.kernels.dynamics.spectral import interpolate, node_counts, spectral_matrices, stretch_matrices
from sagline.statics.strings import Strings

BEYOND = 1.15  # of the frequency asked for: modes below are kept as they are
LEVELS = 2  # moments, in pairs, of those above
_TINY = 1e-300


class Components(NamedTuple):
    """Motions of the taut cables of one state with both ends held, K_c together.

    Attributes:
        square: Of their angular frequencies [1/s^2], shape (K_c,).
        cable: Whose they are, shape (K_c,).
        participation: P, by which an acceleration of the platform end drives them, world axes, shape (K_c, 3)
            [sqrt(kg)].
        still: M_0, mass of every cable as its platform end moves it at rest, world axes, shape (m, 3, 3) [kg].
        plane: Of the motions in the cables' planes.
        normal: Of those normal to them.
        mesh: Where they are known.
    """

    square: Array
    cable: Indices
    participation: Array
    still: Array
    plane: Motions
    normal: Motions
    mesh: Mesh


class Mesh(NamedTuple):
    """Nodes of the taut cables.

    Attributes:
        taut: Indices of the cables, t of them.
        table: Their rows of the table of strings, shape (t, STRING_COLUMNS).
        axes: Level along the plane, normal to it, and up, shape (t, 3, 3).
        omega: Angular frequency whose waves they carry [rad/s].
        points: Material point [m], mass [kg] and integrals of C at the nodes, shape (t, nodes, 6).
    """

    taut: Indices
    table: Array
    axes: Array
    omega: float
    points: Array

    @property
    def density(self) -> Array:
        """Of the cables [kg/m], shape (t,)."""
        return np.asarray(self.table[:, columns.DENSITY])


class Motions(NamedTuple):
    """Motions of the taut cables in one plane; each times the roots of the nodes' masses.

    Attributes:
        rest: Of the nodes with the platform end displaced at rest, shape (t, u, d).
        square: Angular frequencies squared [1/s^2], shape (t, k).
        kept: Which are among the components, shape (t, k).
        shape: Of the nodes, shape (t, u, k).
        drive: By the platform end, shape (t, k, d).
    """

    rest: Array
    square: Array
    kept: Flags
    shape: Array
    drive: Array


def component_modes(strings: Strings, row: int, up_to: float) -> Components:
    """Motions of the cables of one state from which the robot's modes below a frequency are made.

    Args:
        strings: Of N states.
        row: Which of them.
        up_to: That frequency [Hz].

    Returns:
        Components.
    """
    omega = 2.0 * np.pi * BEYOND * up_to
    taut = np.flatnonzero(strings.taut[row])
    table, axes = np.ascontiguousarray(strings.table[row, taut]), strings.axes[row, taut]
    counts = np.empty(taut.size, dtype=np.int64)
    node_counts(table, omega, counts)
    n = int(counts.max(initial=2))
    points, carried, mass = np.empty((taut.size, n, 6)), np.empty((taut.size, n, 5)), np.empty((taut.size, 4))
    plane, normal = np.empty((taut.size, 2 * n, 2 * n)), np.empty((taut.size, n, n))
    spectral_matrices(table, omega, lobatto(), points, plane, normal, carried, mass)
    free = np.arange(n) < counts[:, None] - 1  # the platform end is held
    inside = _motions(plane, carried[:, :, :4].reshape(-1, 2 * n, 2), np.repeat(free, 2, axis=1), omega)
    aside = _motions(normal, carried[:, :, 4:], free, omega)
    owner, side = np.nonzero(inside.kept)[0], np.nonzero(aside.kept)[0]
    drive = inside.drive[inside.kept]
    swings = drive[:, :1] * axes[owner, 0] + drive[:, 1:] * axes[owner, 2]
    sways = aside.drive[aside.kept] * axes[side, 1]
    return Components(
        np.concatenate((inside.square[inside.kept], aside.square[aside.kept])),
        taut[np.concatenate((owner, side))],
        np.concatenate((swings, sways)),
        _still(mass, axes, taut, strings.taut.shape[1]),
        inside,
        aside,
        Mesh(taut, table, axes, omega, points),
    )


def _motions(matrix: Array, rest: Array, free: Flags, omega: float) -> Motions:
    """Modes below a frequency, and the few motions that stand for those above."""
    square, shape = np.linalg.eigh(matrix)
    drive = np.swapaxes(shape, -1, -2) @ (rest * free[..., None])
    low = square < omega * omega
    reach = int(low.sum(axis=1).max(initial=0))  # ascending: the modes that are kept come first
    above = np.where(low[..., None], 0.0, drive) / square[..., None]
    chain = [above]
    for _ in range(LEVELS - 1):
        chain.append(chain[-1] / square[..., None])
    scaled = [one / np.maximum(np.linalg.norm(one, axis=-2, keepdims=True), _TINY) for one in chain]
    basis = np.linalg.qr(np.concatenate(scaled, axis=-1))[0]
    slow, turn = np.linalg.eigh(np.swapaxes(basis, -1, -2) @ (square[..., None] * basis))
    basis = basis @ turn
    beyond = np.swapaxes(basis, -1, -2)
    return Motions(
        rest,
        np.concatenate((square[:, :reach], slow), axis=1),
        np.concatenate((low[:, :reach], np.ones(slow.shape, dtype=np.bool_)), axis=1),
        np.concatenate((shape[:, :, :reach], shape @ basis), axis=-1),
        np.concatenate((drive[:, :reach], beyond @ np.where(low[..., None], 0.0, drive)), axis=1),
    )


def _still(mass: Array, axes: Array, taut: Indices, count: int) -> Array:
    """Masses xx, xz, zz, yy of the taut cables in their axes as matrices in the world, (m, 3, 3)."""
    own = np.zeros((taut.size, 3, 3))
    own[:, 0, 0], own[:, 0, 2], own[:, 2, 0], own[:, 2, 2], own[:, 1, 1] = mass[:, [0, 1, 1, 2, 3]].T
    still = np.zeros((count, 3, 3))
    still[taut] = np.swapaxes(axes, -1, -2) @ own @ axes
    return still


def field(components: Components, ends: Array, amplitudes: Array) -> tuple[Array, Array]:
    """Motion of the nodes times the roots of their masses: in the planes and normal to them.

    Args:
        components: Of the cables.
        ends: Displacements of all platform ends in K modes, world axes, shape (m, 3, K).
        amplitudes: Of the components, shape (K_c, K).

    Returns:
        Shapes (t, 2 nodes, K) and (t, nodes, K).
    """
    mesh = components.mesh
    own = mesh.axes @ ends[mesh.taut]
    inside = int(components.plane.kept.sum())
    parts = []
    for motions, end, given in (
        (components.plane, own[:, ::2], amplitudes[:inside]),
        (components.normal, own[:, 1:2], amplitudes[inside:]),
    ):
        spread = np.zeros((*motions.kept.shape, amplitudes.shape[1]))
        spread[motions.kept] = given
        parts.append(motions.rest @ end + motions.shape @ spread)
    return parts[0], parts[1]


def cable_shapes(components: Components, ends: Array, amplitudes: Array, count: int) -> Array:
    """Displacements of all cables at equally spaced material points, from frame to platform end.

    Args:
        components: Of the cables.
        ends: As of `field`.
        amplitudes: As of `field`.
        count: How many points.

    Returns:
        World axes, shape (K, m, count, 3); zero for cables that are not taut.
    """
    mesh = components.mesh
    n, k = mesh.points.shape[1], ends.shape[2]
    values = np.empty((mesh.taut.size, count, n))
    interpolate(mesh.table, mesh.omega, lobatto(), mesh.points, values)
    plane, normal = field(components, ends, amplitudes)
    inside = plane.reshape(mesh.taut.size, n, 2, k)  # there may be no mode
    behind = mesh.table[:, [columns.BEHIND_X, columns.BEHIND_Z]]
    slide = np.hypot(*behind.T)  # a frame end that gives way has one motion in the plane
    direction = behind / np.maximum(slide, _TINY)[:, None]
    inside[:, 0] = direction[:, :, None] * inside[:, 0, :1]
    own = np.stack((inside[:, :, 0], normal, inside[:, :, 1]), axis=-2)
    moved = (values @ own.reshape(mesh.taut.size, n, 3 * k)).reshape(mesh.taut.size, count, 3, k)
    shapes = np.zeros((k, ends.shape[0], count, 3))
    shapes[:, mesh.taut] = np.einsum("tij,tpik->ktpj", mesh.axes, moved, optimize=True)
    return shapes


def stretch(components: Components, ends: Array, amplitudes: Array) -> Array:
    """Twice the energy of stretch in each mode of unit modal mass.

    Args:
        components: Of the cables.
        ends: As of `field`.
        amplitudes: As of `field`.

    Returns:
        Of the taut cables, shape (t, K) [1/s^2].
    """
    plane, _ = field(components, ends, amplitudes)
    return np.asarray(np.einsum("tik,tik->tk", plane, _stretch_matrices(components.mesh) @ plane))


def stretch_of_motions(components: Components) -> Array:
    """Stiffness of stretch between displacements of the platform end at rest and the motions in the plane.

    Args:
        components: Of the cables.

    Returns:
        Symmetric, shape (t, 2 + k, 2 + k).
    """
    motions = components.plane
    basis = np.concatenate((motions.rest, motions.shape), axis=2)
    return np.asarray(np.swapaxes(basis, -1, -2) @ _stretch_matrices(components.mesh) @ basis)


def _stretch_matrices(mesh: Mesh) -> Array:
    n = mesh.points.shape[1]
    matrices = np.empty((mesh.taut.size, 2 * n, 2 * n))
    stretch_matrices(mesh.table, mesh.omega, lobatto(), mesh.points, matrices)
    return matrices
