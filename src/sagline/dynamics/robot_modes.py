"""Modes of one state of a robot whose cables have mass, as many as the exact count has."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Final

import numpy as np

from sagline.core.arrays import Array
from sagline.core.errors import InvalidValueError, SaglineError
from sagline.dynamics.component_modes import Components, stretch
from sagline.dynamics.count import modes_below
from sagline.dynamics.damping import Damping
from sagline.dynamics.reduced import Reduced, Setting, massless, reduced

MOST_MODES: Final = 2_000
SLOW: Final = 1e-2  # of up_to: lower frequencies may be those of motions that nothing holds
BORDER: Final = 1e-6  # of a frequency, within which the count says on which side of it a mode is


@dataclass(frozen=True, eq=False)
class Found:
    """Modes of one state below a frequency.

    Attributes:
        frequency: [Hz], shape (K,).
        platform: Motion of the platform, shape (6, K).
        ends: Displacements of the platform ends, shape (m, 3, K).
        number: How many, by the exact count.
        problem: Whose solutions they are.
        vectors: Solutions of the problem, shape (n + k, K).
    """

    frequency: Array
    platform: Array
    ends: Array
    number: int
    problem: Reduced
    vectors: Array

    @property
    def components(self) -> Components:
        """Of the cables."""
        return self.problem.components

    @cached_property
    def amplitudes(self) -> Array:
        """Of the cables' components beside their motion at rest, shape (T, K)."""
        return self.problem.amplitudes(self.vectors)


def modes_of(setting: Setting, row: int, up_to: float) -> Found:
    """Modes of one state below a frequency, as many as the exact count has.

    Args:
        setting: Of N states.
        row: Which of them; a stable one.
        up_to: The frequency [Hz].

    Returns:
        The modes.

    Raises:
        InvalidValueError: If there are too many.
        SaglineError: If modes and count disagree.
    """
    count = modes_below(setting, row, up_to)
    check_number(count, up_to, "up_to")
    problem = reduced(setting, row, up_to)
    square, vectors = np.linalg.eigh(problem.matrix)
    frequency = np.sqrt(np.maximum(square, 0.0)) / (2.0 * np.pi)
    border = np.searchsorted(frequency, (up_to * (1.0 - BORDER), up_to * (1.0 + BORDER)))
    if not border[0] <= count <= border[1]:
        text = f"vibration up to {up_to:g} Hz: {border[0]} modes were found where the exact count has {count}"
        raise SaglineError(f"{text}. Ask for another up_to, and report the robot and its pose.")
    if count and frequency[0] < SLOW * up_to:  # at rest the mass of the cables has no part: as many are exactly at 0 Hz
        frequency[: np.count_nonzero(massless(setting, row)[0] == 0.0)] = 0.0
    vectors = vectors[:, :count]
    platform = problem.platform @ vectors[: problem.platform.shape[1]]
    return Found(frequency[:count], platform, setting.ends[row] @ platform, count, problem, vectors)


def check_number(count: int, frequency: float, item: str) -> None:
    """Refuse more modes than somebody wants to wait for.

    Args:
        count: How many lie below a frequency.
        frequency: The frequency [Hz].
        item: What a message calls it.

    Raises:
        InvalidValueError: If there are too many.
    """
    if count > MOST_MODES:
        value = f"{frequency:g} Hz, below which the robot has {count:,} modes"
        raise InvalidValueError(item, value, f"a frequency with up to {MOST_MODES:,} modes below it", "Lower it.")


def cable_shares(setting: Setting, row: int, found: Found) -> Array:
    """Share of each mode's kinetic energy that is each cable's.

    Args:
        setting: Of N states.
        row: Which of them.
        found: Its modes.

    Returns:
        Shape (m, K).
    """
    parts, ends, own = found.components, found.ends, found.amplitudes
    shares = np.asarray((ends * (parts.still @ ends)).sum(axis=1))
    for motions, end, given in parts.planes(ends, own):
        shares[parts.mesh.taut] += (given * (given + 2.0 * (motions.drive @ end))).sum(axis=1)
    return shares


def loss(density: Array, found: Found, shares: Array, damping: Damping) -> Array:
    """Damping ratio of each mode, to first order: power lost over that of a critically damped one.

    Args:
        density: Of the cables [kg/m], shape (m,).
        found: The modes.
        shares: Their `cable_shares`.
        damping: What takes energy out of them.

    Returns:
        Shape (K,); NaN for a mode without frequency where something is lost.
    """
    omega = 2.0 * np.pi * found.frequency
    lost = np.zeros(omega.size)
    if damping.air_damping > 0.0:
        lost += damping.air_damping * (shares / density[:, None]).sum(axis=0)
    if damping.loss_time > 0.0:
        lost += damping.loss_time * stretch(found.components, found.ends, found.amplitudes).sum(axis=0)
    ratio = np.where(lost > 0.0, lost / (2.0 * np.where(omega > 0.0, omega, np.nan)), 0.0)
    return np.asarray(damping.modal_damping + ratio)
