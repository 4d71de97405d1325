"""What the kernels answer about cables, as the state of their free spans and what is behind them."""

from __future__ import annotations

import numpy as np

from sagline.cables.model import CableModel, CableState
from sagline.core.arrays import Array, Codes, locked
from sagline.kernels import tables
from sagline.robot.contact import Contact
from sagline.robot.several import Robots, anything_behind, cables_of, first_of


def hung_cables(
    robot: Robots, model: CableModel, results: Array, status: Codes, shape: tuple[int, ...]
) -> tuple[CableState, Contact | None]:
    """The cables of solved poses.

    Args:
        robot: The robot, or one a pose.
        model: Cable model.
        results: Rows as in `sagline.kernels.tables`, (RESULT_ROWS, N, m).
        status: How each cable's calculation ended, (N, m).
        shape: () for a single pose, (N,) for a batch.

    Returns:
        The free spans, which are the cables where nothing is behind any; and what is behind them, or None.
    """
    m = results.shape[2]

    def row(which: int) -> Array:
        return locked(results[which].reshape(*shape, m))

    span, rise, length, tension = (row(k) for k in (tables.SPAN, tables.RISE, tables.LENGTH, tables.TENSION))
    contact = None
    if anything_behind(robot):
        rows = (tables.WRAP, tables.WRAPPED, tables.DEAD, tables.TENSION, tables.SINE)
        contact = Contact(*(row(k) for k in rows))
        length = locked(length - (contact.wrapped_length + contact.dead_length))
        tension = locked(_own_tension(span, rise, row(tables.HORIZONTAL), tension))
    cables = CableState(
        model=model,
        cable=cables_of(robot),
        gravity=first_of(robot).gravity,
        span=span,
        rise=rise,
        unstrained_length=length,
        horizontal_tension=row(tables.HORIZONTAL),
        vertical_force=row(tables.VERTICAL),
        chord_tension=tension,
        status=locked(status.reshape(*shape, m)),
    )
    return cables, contact


def _own_tension(span: Array, rise: Array, horizontal: Array, tension: Array) -> Array:
    """Tensions along the free spans' own chords; a plumb one has that of the chord given."""
    level = np.where(span > 0.0, span, 1.0)
    own: Array = np.where(span > 0.0, horizontal * (np.hypot(span, rise) / level), tension)
    return own
