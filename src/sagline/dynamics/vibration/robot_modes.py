"""Modes of a robot with cable mass, by component mode synthesis. An exact count checks the number of modes."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Final

import numpy as np

from sagline.core.arrays import Array
from sagline.core.errors import InvalidValueError, SaglineError
from sagline.dynamics.vibration.component_modes import CableComponents
from sagline.dynamics.vibration.dynamic_stiffness import Damping, taut_stiffness
from sagline.kernels.dynamics import string as columns
from sagline.robot.batch import first_of
from sagline.robot.equilibrium import Equilibrium
from sagline.statics.slopes import cable_slopes, motions_of_ends
from sagline.statics.stiffness import UNSTABLE, mass_matrix, natural_frequency
from sagline.statics.strings import COUNTING, Strings, strings_of

KEPT = 1.05  # fixed-end modes up to this factor times the requested frequency are unknowns
LEVELS = 4  # number of matched pairs of moments (Krylov) of the higher modes
_TINY = 1e-300


class VibrationModel:
    """Stiffness, mass and cables of N states, for the computation of vibrations."""

    def __init__(self, state: Equilibrium) -> None:
        """Model of one equilibrium or of N equilibria. The arrays have a leading axis in both cases."""
        slopes = cable_slopes(state)
        matrix = slopes.matrix.reshape(-1, 6, 6)
        levers = slopes.levers.reshape(len(matrix), -1, 3)
        # strings: data of the cables
        # ends: matrices that map the platform motion to the motion of the platform ends, shape (N, m, 3, 6)
        # freedom: matrix that selects the free motions, shape (n, 6)
        self.strings, self.ends, self.freedom = (
            strings_of(state),
            motions_of_ends(levers),
            first_of(state.robot).freedom,
        )
        # stiffness: stiffness of the platform, symmetric, shape (N, 6, 6)
        # mass: mass matrix of the platform, shape (N, 6, 6)
        self.stiffness, self.mass = 0.5 * (matrix + np.swapaxes(matrix, -1, -2)), mass_matrix(state).reshape(-1, 6, 6)

    def massless_modes(self, row: int) -> tuple[Array, Array]:
        """Natural frequencies with massless cables (n,) [Hz], and unstable directions of the platform (6, d)."""
        freedom = self.freedom
        upper = np.linalg.inv(np.linalg.cholesky(freedom @ self.mass[row] @ freedom.T)).T
        squares, vectors = np.linalg.eigh(upper.T @ freedom @ self.stiffness[row] @ freedom.T @ upper)
        return natural_frequency(squares), freedom.T @ (upper @ vectors[:, squares < -UNSTABLE * np.abs(squares).max()])

    def modes_below(self, row: int, frequency: float) -> int:
        """Number of the robot's modes with cable mass below `frequency` [Hz]."""
        # Wittrick-Williams count: number of fixed-end modes of the taut cables, plus number of negative eigenvalues of
        # the platform's dynamic stiffness
        taut, found, counts = taut_stiffness(self.strings, row, np.array([frequency]), None, COUNTING)
        moving = np.zeros((self.strings.taut.shape[1], 3, 3))
        moving[taut] = found[0].real
        matrix = _dynamic_matrix(self, row, moving, 2.0 * np.pi * frequency)
        return int(counts.sum()) + int((np.linalg.eigvalsh(matrix) < 0.0).sum())

    def checked_count(self, row: int, frequency: float, item: str) -> int:
        """Number of modes below `frequency` [Hz]; rejects the argument `item` if the number is too large."""
        count = self.modes_below(row, frequency)
        if count > MOST_MODES:
            value = f"{frequency:g} Hz, below which the robot has {count:,} modes"
            raise InvalidValueError(item, value, f"a frequency with up to {MOST_MODES:,} modes below it", "Lower it.")
        return count

    def modes(self, row: int, up_to: float) -> StateModes:
        """Modes of the state `row` below `up_to` [Hz]. The exact count checks the number of modes."""
        _check_string_count(self.strings, row, up_to)
        count = self.checked_count(row, up_to, "up_to")
        problem = ReducedModel(self, row, up_to)
        square, vectors = np.linalg.eigh(problem.matrix)
        frequency = np.sqrt(np.maximum(square, 0.0)) / (2.0 * np.pi)
        border = np.searchsorted(frequency, (up_to * (1.0 - BORDER), up_to * (1.0 + BORDER)))
        if not border[0] <= count <= border[1]:
            text = f"vibration up to {up_to:g} Hz: {border[0]} modes were found; the exact count is {count}"
            raise SaglineError(f"{text}. Use another up_to, and report the robot and its pose.")
        # cable mass has no static effect, so that the number of modes at exactly 0 Hz does not change
        if count and frequency[0] < SLOW * up_to:
            frequency[: np.count_nonzero(self.massless_modes(row)[0] == 0.0)] = 0.0
        vectors = vectors[:, :count]
        platform = problem.platform @ vectors[: problem.platform.shape[1]]
        return StateModes(frequency[:count], platform, self.ends[row] @ platform, problem, vectors)


class ReducedModel:
    """Eigenproblem of one state for its modes below a frequency."""

    def __init__(self, model: VibrationModel, row: int, up_to: float) -> None:
        """Reduce the state `row` of the model, for modes below `up_to` [Hz]."""
        # The unknowns are the modes of the cables up to slightly above this frequency. A few joint motions represent
        # the response of the higher modes to slow platform motions; they match the first moments (Krylov). Amplitudes
        # are relative to the frame. The mass of the platform unknowns is the platform mass plus the remaining
        # quasi-static mass of the cables. The mass of each mode is 1.
        components = CableComponents(model.strings, row, KEPT * up_to)
        freedom, ends = model.freedom, model.ends[row]
        drives = (components.participation[:, None] @ ends[components.cable])[:, 0] @ freedom.T
        kept = components.square < (2.0 * np.pi * KEPT * up_to) ** 2
        beyond, slow = _slow_motions(components.square[~kept], drives[~kept])
        square, count = components.square[kept], int(kept.sum())
        drives = np.concatenate((drives[kept], beyond.T @ drives[~kept]))
        at_rest = freedom @ (model.mass[row] + _on_platform(components.still, ends)) @ freedom.T
        upper = np.linalg.inv(np.linalg.cholesky(at_rest - drives.T @ drives)).T
        driven = drives @ upper
        pulled = np.concatenate((square[:, None] * driven[:count], slow @ driven[count:]))
        n = len(freedom)
        matrix = np.zeros((n + len(driven), n + len(driven)))
        stiffness = freedom @ model.stiffness[row] @ freedom.T
        matrix[:n, :n] = upper.T @ stiffness @ upper + driven.T @ pulled
        matrix[n:, :n] = -pulled
        matrix[:n, n:] = -pulled.T
        np.fill_diagonal(matrix[n : n + count, n : n + count], square)
        matrix[n + count :, n + count :] = slow
        # matrix: symmetric, shape (n + k, n + k): first the platform, then the cable modes [1/s^2]
        # platform: matrix that maps the first n unknowns to platform motions, shape (6, n)
        # driven: matrix that maps the first n unknowns to the excitation of the cable modes, shape (k, n)
        self.matrix, self.platform, self.driven = matrix, freedom.T @ upper, driven
        # kept: mask of the components that are unknowns themselves, shape (T,)
        # beyond: other components as combinations of the last b unknowns, shape (T - kept, b)
        # components: fixed-end modes of the cables
        self.kept, self.beyond, self.components = kept, beyond, components

    def amplitudes(self, vectors: Array) -> Array:
        """Amplitudes (T, K) of the components in addition to quasi-static motion, from vectors (n + k, K)."""
        n = self.platform.shape[1]
        own = vectors[n:] - self.driven @ vectors[:n]
        found = np.empty((self.kept.size, vectors.shape[1]))
        count = len(own) - self.beyond.shape[1]
        found[self.kept] = own[:count]
        found[~self.kept] = self.beyond @ own[count:]
        return found


def _slow_motions(square: Array, drives: Array) -> tuple[Array, Array]:
    """A few joint motions that represent many modes: orthonormal columns of amplitudes, and stiffness matrix."""
    chain = [drives / square[:, None]]
    for _ in range(LEVELS - 1):
        chain.append(chain[-1] / square[:, None])
    scaled = np.concatenate([one / np.maximum(np.linalg.norm(one, axis=0), _TINY) for one in chain], axis=1)
    basis = np.linalg.qr(scaled)[0]
    return basis, basis.T @ (square[:, None] * basis)


def _dynamic_matrix(model: VibrationModel, row: int, moving: Array, omega: float) -> Array:
    """Dynamic stiffness D for the free motions, exact."""
    # shapes: moving (m, 3, 3) [N/m]; omega [rad/s]; returns (n, n)
    matrix = model.stiffness[row] + _on_platform(moving, model.ends[row]) - omega**2 * model.mass[row]
    return np.asarray(model.freedom @ matrix @ model.freedom.T)


def _on_platform(of_cables: Array, ends: Array) -> Array:
    """Combine the matrices of all platform ends (m, 3, 3) into a matrix of the platform, (6, 6)."""
    return np.asarray((np.swapaxes(ends, -1, -2) @ of_cables @ ends).sum(axis=0))


MOST_MODES: Final = 2_000
_CERTAIN: Final = 1.5  # an estimate above this factor times MOST_MODES is certainly too large, in spite of its error
_STEEP: Final = 1e-6  # horizontal tension of a vertical cable, relative to the vertical force
_EVEN: Final = 1e-9  # range of q below which the tension of a cable counts as constant
_POINTS: Final = 201
SLOW: Final = 1e-2  # smallest ratio of a frequency to up_to; a lower frequency may belong to a motion without stiffness
BORDER: Final = 1e-6  # relative accuracy of a frequency in the count


@dataclass(frozen=True, eq=False)
class StateModes:
    """Modes of one state below a frequency."""

    frequency: Array  # [Hz], shape (K,); K is the exact count
    platform: Array  # platform motion, shape (6, K)
    ends: Array  # displacements of the platform ends, shape (m, 3, K)
    problem: ReducedModel  # reduced model of the modes
    vectors: Array  # eigenvectors of the reduced model, shape (n + k, K)

    @property
    def components(self) -> CableComponents:
        """Fixed-end modes of the cables."""
        return self.problem.components

    @cached_property
    def amplitudes(self) -> Array:
        """Amplitudes of the fixed-end modes in addition to quasi-static motion, shape (T, K)."""
        return self.problem.amplitudes(self.vectors)

    def cable_shares(self) -> Array:
        """Cable shares of the kinetic energy of each mode, (m, K)."""
        parts, ends, own = self.components, self.ends, self.amplitudes
        shares = np.asarray((ends * (parts.still @ ends)).sum(axis=1))
        for motions, end, given in parts.planes(ends, own):
            shares[parts.taut] += (given * (given + 2.0 * (motions.drive @ end))).sum(axis=1)
        return shares

    def damping_ratios(self, density: Array, shares: Array, damping: Damping) -> Array:
        """Damping ratio of each mode, to first order: lost power divided by the lost power of critical damping."""
        # shapes: density (m,) [kg/m]; returns (K,)
        omega = 2.0 * np.pi * self.frequency
        lost = np.zeros(omega.size)
        if damping.air_damping > 0.0:
            lost += damping.air_damping * (shares / density[:, None]).sum(axis=0)
        if damping.loss_time > 0.0:
            lost += damping.loss_time * self.components.stretch_energy(self.ends, self.amplitudes).sum(axis=0)
        ratio = np.where(lost > 0.0, lost / (2.0 * np.where(omega > 0.0, omega, np.nan)), 0.0)
        return np.asarray(damping.modal_damping + ratio)


def _check_string_count(strings: Strings, row: int, up_to: float) -> None:
    """Reject `up_to` [Hz] before the exact count if the cables have far too many modes below it."""
    # In each of two directions, N half waves of a cable have the phase pi N. This phase is the integral of omega
    # sqrt(rho/T) along the cable. The tension is T_x cosh(q) at the point with the vertical force T_x sinh(q).
    table = strings.table[row, strings.taut[row]]
    level = np.maximum(table[:, columns.HORIZONTAL], _STEEP * np.abs(table[:, columns.VERTICAL]))
    top, hanging = table[:, columns.VERTICAL], table[:, columns.WEIGHT] * table[:, columns.LENGTH]
    first, last = np.arcsinh((top - hanging) / level), np.arcsinh(top / level)
    q = np.linspace(first, last, _POINTS)
    even = table[:, columns.LENGTH] / np.sqrt(level * np.cosh(last))  # of a cable without weight
    slow = np.trapezoid(np.sqrt(level * np.cosh(q)), q, axis=0) / np.maximum(table[:, columns.WEIGHT], _TINY)
    time = np.sqrt(table[:, columns.DENSITY]) * np.where(last - first > _EVEN, slow, even)  # of a wave along the cable
    count = float(4.0 * up_to * time.sum())
    if count > _CERTAIN * MOST_MODES:
        value = f"{up_to:g} Hz, below which the cables have about {count:,.0f} modes"
        step = "Lower it, or shorten the slack cables."
        raise InvalidValueError("up_to", value, f"a frequency with up to {MOST_MODES:,} modes below it", step)
