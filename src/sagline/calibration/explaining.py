"""A pose of a log explained: the best fit where some lengths or readings are off by anything."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from sagline.calibration.observing import NO_LOAD
from sagline.calibration.plain_slopes import Bench, said_at
from sagline.core.arrays import Array, Flags, Indices, locked
from sagline.kernels.calibration.terms import Readings
from sagline.kinematics.forward_rows import solve_rows

_SETTLED: Final = 1e-3  # of a sum of squares
_HALVINGS: Final = 6


class Suspect(NamedTuple):
    """What may have gone wrong at a pose.

    Attributes:
        quantity: Of `Outlier`.
        cable: Its number, or None.
        which: Lengths, then readings that it changes, of 2 m + 6.
    """

    quantity: str
    cable: int | None
    which: Indices


class Explained(NamedTuple):
    """A pose, where some things are taken to be off by what fits best.

    Attributes:
        squares: Sum of squares that is left.
        sizes: By how much each thing is off.
        deviations: The same in standard deviations.
    """

    squares: float
    sizes: list[float]
    deviations: list[float]


class Stand(NamedTuple):
    """A pose of the log.

    Attributes:
        bench: What it is compared with.
        deviation: Of lengths and readings, (2 m + 6,).
        readings: What was read there, of one row.
        pose: Where it is, (1, POSE_COLUMNS).
        lengths: With which true lengths [m], (1, m).
    """

    bench: Bench
    deviation: Array
    readings: Readings
    pose: Array
    lengths: Array


class State(NamedTuple):
    """A platform at some lengths, beside what was read.

    Attributes:
        pose: (1, POSE_COLUMNS).
        lengths: [m], (1, m).
        residual: Readings less predictions, (m + 6,).
        by_length: Their slopes, (m + 6, m).
        squares: Sum of squares of all but what may be off.
    """

    pose: Array
    lengths: Array
    residual: Array
    by_length: Array
    squares: float

    @classmethod
    def of(cls, stand: Stand, counts: Flags, pose: Array, lengths: Array) -> State:
        """The platform at a pose."""
        residual, by_length = said_at(stand.bench, stand.readings, pose, lengths)
        missed = np.concatenate((stand.readings.lengths[0] - lengths[0], residual)) / stand.deviation
        return cls(pose, lengths, residual, by_length, float(np.sum(missed[counts] ** 2)))


def explained(stand: Stand, taken: Sequence[Suspect], there: Flags, rounds: int) -> Explained:
    """The best fit of a pose where some lengths and readings are off by anything, as the others are not.

    With one round it is that of the slopes, with more that of the pose itself.
    """
    which = np.concatenate([one.which for one in taken]).astype(np.int64) if taken else np.zeros(0, dtype=np.int64)
    counts = np.concatenate((np.ones(stand.lengths.shape[1], dtype=np.bool_), there))
    counts[which] = False
    state = State.of(stand, counts, stand.pose, stand.lengths)
    fit, wanted = _fitted(stand, state, taken, which, there)
    for _ in range(rounds - 1):
        better = _better(stand, state, counts, wanted)
        if better is None:
            break
        gained = state.squares - better.squares
        state = better
        fit, wanted = _fitted(stand, state, taken, which, there)
        if gained < _SETTLED:
            break
    return fit if rounds == 1 else fit._replace(squares=state.squares)


def _fitted(
    stand: Stand, state: State, taken: Sequence[Suspect], which: Indices, there: Flags
) -> tuple[Explained, Array]:
    """The best fit by the slopes at a state, and the true lengths that it asks for, (m,)."""
    m, said = state.lengths.shape[1], stand.readings.lengths[0]
    slopes, variance = state.by_length[there], stand.deviation[:m] ** 2
    missed = state.residual[there] - slopes @ (said - state.lengths[0])
    columns = np.hstack((-slopes, np.eye(m + 6)[there]))[:, which]
    factor = cho_factor(np.diag(stand.deviation[m:][there] ** 2) + (slopes * variance) @ slopes.T)
    inverse = np.linalg.pinv(columns.T @ cho_solve(factor, columns), hermitian=True)
    off = inverse @ (columns.T @ cho_solve(factor, missed))
    rest = missed - columns @ off
    slipped = np.zeros(2 * m + 6)
    slipped[which] = off
    wanted: Array = said - slipped[:m] + variance * (slopes.T @ cho_solve(factor, rest))
    sizes, deviations, first = [], [], 0
    for one in taken:
        part = slice(first, first + len(one.which))
        own, spread = off[part], np.linalg.pinv(inverse[part, part], hermitian=True)
        sizes.append(float(own[0]) if one.cable is not None else float(np.linalg.norm(own)))
        deviations.append(float(np.sqrt(max(own @ spread @ own, 0.0))))
        first = part.stop
    return Explained(float(rest @ cho_solve(factor, rest)), sizes, deviations), wanted


def _better(stand: Stand, state: State, counts: Flags, wanted: Array) -> State | None:
    """The state on the way to other lengths whose sum of squares is smaller; None if there is none."""
    for halving in range(_HALVINGS):
        lengths = state.lengths + 0.5**halving * (wanted - state.lengths)
        if (lengths <= 0.0).any():
            continue
        found = solve_rows(stand.bench.robot, stand.bench.model, locked(lengths), locked(state.pose.copy()), NO_LOAD)
        if found.stable[0]:
            new = State.of(stand, counts, found.poses, lengths)
            if new.squares < state.squares:
                return new
    return None
