"""The robot on cables with mass, in few unknowns: motions of the platform and modes of its cables."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from sagline.core.arrays import Array, Flags
from sagline.dynamics.component_modes import Components, component_modes
from sagline.robot.equilibrium import Equilibrium
from sagline.robot.several import first_of
from sagline.statics.slopes import cable_slopes
from sagline.statics.stiffness import UNSTABLE, mass_matrix, natural_frequency
from sagline.statics.strings import Strings, strings_of

KEPT = 1.05  # of the frequency asked for: the cables' modes up to there are unknowns
LEVELS = 4  # pairs of moments of those above that are matched
_TINY = 1e-300


class Setting(NamedTuple):
    """What N states are, for their vibrations.

    Attributes:
        strings: Their cables.
        ends: Of each cable, what takes a motion of the platform to that of the platform end, shape (N, m, 3, 6).
        stiffness: Of the platform, symmetric, shape (N, 6, 6).
        mass: Of the platform, shape (N, 6, 6).
        freedom: Rows that pick the free motions, shape (n, 6).
    """

    strings: Strings
    ends: Array
    stiffness: Array
    mass: Array
    freedom: Array

    def at(self, row: int) -> Setting:
        """One of them, with a leading axis 1."""
        part = slice(row, row + 1)
        strings = Strings(self.strings.table[part], self.strings.axes[part], self.strings.taut[part])
        return Setting(strings, self.ends[part], self.stiffness[part], self.mass[part], self.freedom)


class Reduced(NamedTuple):
    """The eigenproblem of one state.

    Attributes:
        matrix: Symmetric, shape (n + k, n + k): first the platform, then motions of the cables [1/s^2].
        platform: Its first unknowns to motions of the platform, shape (6, n).
        driven: The same to what the motions are driven by, shape (k, n).
        kept: Which components of the cables are motions by themselves, the first of the k, shape (T,).
        beyond: The others by the last of the k, shape (T - those, b).
        components: Of the cables.
    """

    matrix: Array
    platform: Array
    driven: Array
    kept: Flags
    beyond: Array
    components: Components

    def amplitudes(self, vectors: Array) -> Array:
        """Amplitudes of the components beside their motion at rest.

        Args:
            vectors: Of the eigenproblem, shape (n + k, K).

        Returns:
            Shape (T, K).
        """
        n = self.platform.shape[1]
        own = vectors[n:] - self.driven @ vectors[:n]
        found = np.empty((self.kept.size, vectors.shape[1]))
        count = len(own) - self.beyond.shape[1]
        found[self.kept] = own[:count]
        found[~self.kept] = self.beyond @ own[count:]
        return found


def setting_of(state: Equilibrium) -> Setting:
    """What is needed of an equilibrium.

    Args:
        state: Single or N of them; arrays have a leading axis in either case.

    Returns:
        Setting; its stiffness NaN where the state has no lengths.
    """
    slopes = cable_slopes(state)
    matrix = slopes.matrix.reshape(-1, 6, 6)
    levers = slopes.levers.reshape(len(matrix), -1, 3)
    ends = np.zeros((*levers.shape, 6))
    ends[..., :3] = np.eye(3)
    for a, b, c in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):  # u = q_1 + q_2 x r
        ends[..., a, 3 + b] = levers[..., c]
        ends[..., a, 3 + c] = -levers[..., b]
    return Setting(
        strings_of(state),
        ends,
        0.5 * (matrix + np.swapaxes(matrix, -1, -2)),
        mass_matrix(state).reshape(-1, 6, 6),
        first_of(state.robot).freedom,
    )


def reduced(setting: Setting, row: int, up_to: float) -> Reduced:
    """The eigenproblem of one state for its modes below a frequency.

    The cables' modes a little above it are its unknowns; what those beyond answer to slow motions of the platform is
    kept in a few motions of all together, which match the first moments (Krylov). With amplitudes counted from the
    frame the mass is that of the platform, with what these leave of the cables' mass at rest, and one for each.

    Args:
        setting: Of N states.
        row: Which of them.
        up_to: The frequency [Hz].

    Returns:
        Reduced.
    """
    components = component_modes(setting.strings, row, KEPT * up_to)
    freedom, ends = setting.freedom, setting.ends[row]
    drives = (components.participation[:, None] @ ends[components.cable])[:, 0] @ freedom.T
    kept = components.square < (2.0 * np.pi * KEPT * up_to) ** 2
    beyond, slow = _slow_motions(components.square[~kept], drives[~kept])
    square, count = components.square[kept], int(kept.sum())
    drives = np.concatenate((drives[kept], beyond.T @ drives[~kept]))
    at_rest = freedom @ (setting.mass[row] + _on_platform(components.still, ends)) @ freedom.T
    upper = np.linalg.inv(np.linalg.cholesky(at_rest - drives.T @ drives)).T
    driven = drives @ upper
    pulled = np.concatenate((square[:, None] * driven[:count], slow @ driven[count:]))
    n = len(freedom)
    matrix = np.zeros((n + len(driven), n + len(driven)))
    stiffness = freedom @ setting.stiffness[row] @ freedom.T
    matrix[:n, :n] = upper.T @ stiffness @ upper + driven.T @ pulled
    matrix[n:, :n] = -pulled
    matrix[:n, n:] = -pulled.T
    np.fill_diagonal(matrix[n : n + count, n : n + count], square)
    matrix[n + count :, n + count :] = slow
    return Reduced(matrix, freedom.T @ upper, driven, kept, beyond, components)


def _slow_motions(square: Array, drives: Array) -> tuple[Array, Array]:
    """Motions that stand for many: orthonormal columns of amplitudes, and the stiffness between them."""
    chain = [drives / square[:, None]]
    for _ in range(LEVELS - 1):
        chain.append(chain[-1] / square[:, None])
    scaled = np.concatenate([one / np.maximum(np.linalg.norm(one, axis=0), _TINY) for one in chain], axis=1)
    basis = np.linalg.qr(scaled)[0]
    return basis, basis.T @ (square[:, None] * basis)


def massless(setting: Setting, row: int) -> tuple[Array, Array]:
    """Vibrations of the platform alone, and how it leaves an unstable equilibrium.

    Args:
        setting: Of N states.
        row: Which of them.

    Returns:
        Frequencies as those of `modes` [Hz], shape (n,); motions in which the equilibrium is left, of unit modal mass,
        one a column, shape (6, d).
    """
    freedom = setting.freedom
    upper = np.linalg.inv(np.linalg.cholesky(freedom @ setting.mass[row] @ freedom.T)).T
    squares, vectors = np.linalg.eigh(upper.T @ freedom @ setting.stiffness[row] @ freedom.T @ upper)
    return natural_frequency(squares), freedom.T @ (upper @ vectors[:, squares < -UNSTABLE * np.abs(squares).max()])


def dynamic_matrix(setting: Setting, row: int, moving: Array, omega: float) -> Array:
    """D: what a force on the free motions takes for a vibration, exactly.

    Args:
        setting: Of N states.
        row: Which of them.
        moving: What the cables' vibration adds to their stiffness, world axes, shape (m, 3, 3) [N/m].
        omega: Angular frequency [rad/s].

    Returns:
        Shape (n, n).
    """
    matrix = setting.stiffness[row] + _on_platform(moving, setting.ends[row]) - omega**2 * setting.mass[row]
    return np.asarray(setting.freedom @ matrix @ setting.freedom.T)


def _on_platform(of_cables: Array, ends: Array) -> Array:
    """Matrices (m, 3, 3) of platform ends as one of the platform, (6, 6)."""
    return np.asarray((np.swapaxes(ends, -1, -2) @ of_cables @ ends).sum(axis=0))
