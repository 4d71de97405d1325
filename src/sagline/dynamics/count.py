"""How many natural frequencies a robot has below one: counted exactly, without any of them."""

from __future__ import annotations

import numpy as np

from sagline.core.arrays import Array
from sagline.dynamics.cable_dynamics import check_counts, in_world
from sagline.dynamics.reduced import Setting, dynamic_matrix
from sagline.kernels.dynamics import collocation
from sagline.kernels.dynamics.collocation import dynamic_stiffnesses
from sagline.statics.strings import COUNTING, undamped


def modes_below(setting: Setting, row: int, frequency: float) -> int:
    """Number of modes of the robot with its cables' mass below a frequency.

    By Wittrick and Williams: those that the taut cables have with both ends held, and the negative eigenvalues of what
    the platform then feels.

    Args:
        setting: Of N states.
        row: Which of them.
        frequency: [Hz], > 0.

    Returns:
        The number, which is no approximation.

    Raises:
        InvalidValueError: If the frequency is so high that a cable cannot be cut into its waves.
    """
    taut = np.flatnonzero(setting.strings.taut[row])
    given = np.array([frequency])
    found = np.empty((1, 1, taut.size, collocation.FOUND))
    counts = np.empty((1, 1, taut.size, 2), dtype=np.int64)
    table = np.ascontiguousarray(setting.strings.table[row : row + 1, taut])
    room = np.empty(collocation.ROOM)
    dynamic_stiffnesses(table, undamped(given[None]), COUNTING, room, found, counts)
    check_counts(counts, given)
    moving = np.zeros((setting.strings.taut.shape[1], 3, 3))
    moving[taut] = in_world(found[0], setting.strings.axes[row, taut])[0].real
    return int(counts.sum()) + _negatives(dynamic_matrix(setting, row, moving, 2.0 * np.pi * frequency))


def _negatives(matrix: Array) -> int:
    return int((np.linalg.eigvalsh(matrix) < 0.0).sum())
