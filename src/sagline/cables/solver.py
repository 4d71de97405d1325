"""States of a single cable, for a loop in Python that needs one state at a time."""

from __future__ import annotations

import struct
from math import inf
from typing import Any, Final, NamedTuple

import numpy as np

from sagline.cables.cable import Cable
from sagline.cables.model import CableModel, CableState, CableStatus
from sagline.cables.models import Catenary, model_of
from sagline.core.arguments import instance
from sagline.core.arrays import locked
from sagline.core.errors import InvalidValueError
from sagline.kernels import batch_from_length, batch_from_tension, tables
from sagline.kernels.jit import bound

_STATUSES: Final = tuple(sorted(CableStatus))  # status of each code; a lookup is faster than a conversion
_WRITE: Final = struct.Struct("3d").pack_into  # faster than an assignment to an array


class CableStep(NamedTuple):
    """State of one cable. All numbers that the cable model does not determine are NaN.

    Attributes:
        unstrained_length: L [m].
        chord_tension: tau = T_x/cos phi [N].
        horizontal_tension: T_x [N], >= 0.
        vertical_force: T_z on the cable at its platform end [N], up positive.
        status: SOLVED, or the reason why the cable has no state.
    """

    unstrained_length: float
    chord_tension: float
    horizontal_tension: float
    vertical_force: float
    status: CableStatus


class CableSolver:
    """Solver for successive states of one cable, prepared once.

    The results are those of `CableModel.from_tension` and `CableModel.from_length`. A call takes about a microsecond,
    because the solver owns its work arrays. Do not share a solver between threads.

    Examples:
        >>> import sagline as sl
        >>> solver = sl.CableSolver(sl.Cable(linear_density=0.067, axial_stiffness=44e3))
        >>> step = solver.from_tension(12.0, -4.0, 100.0)
        >>> print(f"{step.unstrained_length:.4f} m, {step.vertical_force:.3f} N")
        12.6237 m, -27.492 N
        >>> back = solver.from_length(12.0, -4.0, step.unstrained_length)
        >>> print(f"{back.chord_tension:.6f} N")
        100.000000 N
    """

    __slots__ = ("_cable", "_found", "_from_length", "_from_tension", "_given", "_gravity", "_model", "_status")

    def __init__(self, cable: Cable, model: CableModel | str | None = None, *, gravity: float = 9.81) -> None:
        """Prepare the arrays and the kernels.

        Args:
            cable: Material of one cable.
            model: Cable model; the default is the exact model.
            gravity: Gravitational acceleration [m/s^2], >= 0.

        Raises:
            InvalidValueError: If `cable` contains several cables. If `gravity` is negative. If an argument has the
                wrong type.
        """
        if shape := instance(cable, Cable, "cable").linear_density.shape:
            raise InvalidValueError("cable", f"of shape {shape}", "one cable", "Prepare one solver for each cable.")
        self._cable, self._model = cable, Catenary() if model is None else model_of(model)
        terms = self._model.terms(gravity)
        self._gravity = terms[-1]
        given, found, status = np.empty(3), np.empty(3), np.zeros(1, dtype=np.int8)
        span, rise, last = (locked(given[i : i + 1]) for i in range(3))
        cables = span, rise, cable.linear_density.reshape(1), cable.axial_stiffness.reshape(1), last
        results = (*(found[i : i + 1] for i in range(3)), status)
        self._given, self._found, self._status = given.data.cast("B"), found.data, status.data
        self._from_tension = bound(batch_from_tension, terms, cables, results, np.empty((tables.BUFFERS, tables.CHUNK)))
        self._from_length = bound(batch_from_length, terms, cables, results)

    def from_tension(self, span: float, rise: float, chord_tension: float) -> CableStep:
        """Compute the length and the forces at a chord tension.

        Args:
            span: Horizontal distance between the ends [m], >= 0.
            rise: Height of the platform end above the frame end [m].
            chord_tension: tau = T_x/cos phi [N], >= 0.

        Returns:
            The state of the cable.

        Raises:
            CableGeometryError: If `span` is negative, or `span` and `rise` are both zero.
            InvalidValueError: If an argument is not a finite number, or `chord_tension` is negative.
        """
        if not self._write(span, rise, chord_tension):
            return self._single(self._model.from_tension(self._cable, span, rise, chord_tension, self._gravity))
        self._from_tension()
        length, horizontal, vertical = self._found
        return CableStep(length, chord_tension, horizontal, vertical, _STATUSES[self._status[0]])

    def from_length(self, span: float, rise: float, unstrained_length: float) -> CableStep:
        """Compute the forces at an unstrained length.

        Args:
            span: Horizontal distance between the ends [m], >= 0.
            rise: Height of the platform end above the frame end [m].
            unstrained_length: L [m], > 0.

        Returns:
            The state of the cable.

        Raises:
            CableGeometryError: If `span` is negative, or `span` and `rise` are both zero.
            InvalidValueError: If an argument is not a finite number, or `unstrained_length` is not positive.
        """
        if not self._write(span, rise, unstrained_length):
            return self._single(self._model.from_length(self._cable, span, rise, unstrained_length, self._gravity))
        self._from_length()
        tension, horizontal, vertical = self._found
        return CableStep(unstrained_length, tension, horizontal, vertical, _STATUSES[self._status[0]])

    def _write(self, span: Any, rise: Any, last: Any) -> bool:
        """Write the operands of a kernel; False if they are not floats of an ordinary cable."""
        if not (isinstance(span, float) and isinstance(rise, float) and isinstance(last, float)):
            return False
        if not (0.0 < span < inf and -inf < rise < inf and 0.0 < last < inf):
            return False
        _WRITE(self._given, 0, span, rise, last)
        return True

    @staticmethod
    def _single(state: CableState) -> CableStep:
        """Values of a state that a model has checked and computed."""
        if state.shape:
            allowed, step = "single numbers", "Use the functions of the cable model for several cables."
            raise InvalidValueError("span, rise, tension or length", f"of shape {state.shape}", allowed, step)
        return CableStep(
            float(state.unstrained_length),
            float(state.chord_tension),
            float(state.horizontal_tension),
            float(state.vertical_force),
            _STATUSES[int(state.status)],
        )
