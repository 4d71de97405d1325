"""The robot on cables with mass, in few unknowns: motions of the platform and modes of its cables."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from sagline.arrays import Array
from sagline.dynamics.component_modes import Components, component_modes
from sagline.robot.equilibrium import Equilibrium
from sagline.robot.several import first_of
from sagline.statics.slopes import cable_slopes
from sagline.statics.stiffness import mass_matrix
from sagline.statics.strings import Strings, strings_of

UNSTABLE = 1e-10  # of the largest: a stiffness that is less negative is rounding


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


class Reduced(NamedTuple):
    """The eigenproblem of one state.

    Attributes:
        matrix: Symmetric, shape (n + K_c, n + K_c): first the platform, then the components of the cables [1/s^2].
        platform: Its first unknowns to motions of the platform, shape (6, n).
        driven: The same to what the components are driven by, shape (K_c, n).
        components: Of the cables.
    """

    matrix: Array
    platform: Array
    driven: Array
    components: Components


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

    With the amplitudes z of the cables' modes counted from the frame, the mass is that of the platform, with what the
    components leave of the cables' mass at rest, and one for each component.

    Args:
        setting: Of N states.
        row: Which of them.
        up_to: The frequency [Hz].

    Returns:
        Reduced.
    """
    components = component_modes(setting.strings, row, up_to)
    freedom, ends = setting.freedom, setting.ends[row]
    drives = np.einsum("ka,kab->kb", components.participation, ends[components.cable]) @ freedom.T
    at_rest = freedom @ (setting.mass[row] + _on_platform(components.still, ends)) @ freedom.T
    upper = np.linalg.inv(np.linalg.cholesky(at_rest - drives.T @ drives)).T
    driven = drives @ upper
    pulled = components.square[:, None] * driven
    n = len(freedom)
    matrix = np.zeros((n + len(driven), n + len(driven)))
    stiffness = freedom @ setting.stiffness[row] @ freedom.T
    matrix[:n, :n] = upper.T @ stiffness @ upper + driven.T @ pulled
    matrix[n:, :n] = -pulled
    matrix[:n, n:] = -pulled.T
    np.fill_diagonal(matrix[n:, n:], components.square)
    return Reduced(matrix, freedom.T @ upper, driven, components)


def negative_directions(setting: Setting, row: int) -> Array:
    """Motions of the platform in which an unstable equilibrium is left.

    Args:
        setting: Of N states.
        row: Which of them.

    Returns:
        Of unit modal mass of the platform alone, one a column, shape (6, d).
    """
    freedom = setting.freedom
    upper = np.linalg.inv(np.linalg.cholesky(freedom @ setting.mass[row] @ freedom.T)).T
    squares, vectors = np.linalg.eigh(upper.T @ freedom @ setting.stiffness[row] @ freedom.T @ upper)
    lost = squares < -UNSTABLE * np.abs(squares).max()
    return np.asarray(freedom.T @ upper @ vectors[:, lost])


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
