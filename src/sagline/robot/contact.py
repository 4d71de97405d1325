"""What lies behind the free spans of cables that run over pulleys, or have dead cable behind their frame anchors."""

from __future__ import annotations

from dataclasses import dataclass

from sagline.core.arrays import Array, locked
from sagline.core.results import Result
from sagline.robot.several import Index


@dataclass(frozen=True, slots=True, eq=False)
class Contact(Result):
    """Where cables leave their pulleys, and what of them is behind; fields of shape (m,) or (N, m).

    Attributes:
        wrap_angle: Psi, the angle over which a cable lies on its pulley [rad].
        wrapped_length: Unstrained length on the pulley [m].
        dead_length: Unstrained length between pulley and drum [m].
        chord_tension: T_x/cos phi along the chord that touches the pulley and ends at the platform end [N]: the tension
            that is shared and limited. The free span's own chord starts where the cable really leaves.
        chord_sine: sin phi of that chord.
        winding: The direction of friction: +1 winding in, -1 paying out, 0 standing; None: nothing rubs.
    """

    wrap_angle: Array
    wrapped_length: Array
    dead_length: Array
    chord_tension: Array
    chord_sine: Array
    winding: Array | None = None

    def part(self, index: Index) -> Contact:
        """That of a part of a batch.

        Args:
            index: As of an array.

        Returns:
            Contact of the poses that the index names.
        """
        known = {name: field for name in self.__slots__ if (field := getattr(self, name)) is not None}
        return Contact(**{name: locked(field[index, ...]) for name, field in known.items()})
