"""The interface all cable models share: from a tension, from a length, and the shape."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import ClassVar, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from sagline.arrays import Array, Codes, checked, kernel_input, locked
from sagline.cables.cable import Cable
from sagline.cables.state import CableState
from sagline.errors import CableGeometryError, InvalidValueError
from sagline.kernels.cable import batch
from sagline.kernels.cable.terms import Terms


@dataclass(frozen=True, slots=True)
class CableModel:
    """What a cable model is: a code and two parameters that the kernels understand.

    Attributes:
        code: Which equations the kernels use (`sagline.kernels.codes`).
        weightless: Whether the model ignores the cable's weight.
    """

    code: ClassVar[int]
    weightless: ClassVar[bool] = False

    @property
    def parameters(self) -> tuple[float, float]:
        """The article's k_h and k_p; zero where the model has none."""
        return 0.0, 0.0

    def terms(self, gravity: float) -> Terms:
        """The model as kernels take it, where gravity is as given [m/s^2]."""
        return self.code, *self.parameters, gravity

    def from_tension(
        self, cable: Cable, span: ArrayLike, rise: ArrayLike, chord_tension: ArrayLike, gravity: float = 9.81
    ) -> CableState:
        """Length and forces of cables held at given chord tensions.

        All arguments broadcast to one shape (...).

        Args:
            cable: Material.
            span: Horizontal distance between the ends [m], >= 0.
            rise: Height of the platform end above the frame end [m].
            chord_tension: tau = T_x/cos phi [N], >= 0.
            gravity: Gravitational acceleration [m/s^2], >= 0.

        Returns:
            State with fields of shape (...).

        Raises:
            CableGeometryError: If span is negative, or span and rise are both zero.
            InvalidValueError: If a tension or gravity is negative or not finite, or shapes do not broadcast.

        Source:
            Irvine 1981, ch. 2; docs/model.md, sections 2 (P3) and 3.
        """
        tension = checked(chord_tension, "chord_tension", "N", low=0.0)
        problem = _problem(cable, span, rise, tension, gravity)
        length, horizontal, vertical, status = _outputs(problem.size)
        batch.batch_from_tension(
            self.terms(problem.gravity),
            *problem.operands,
            length,
            horizontal,
            vertical,
            status,
            np.empty((batch.BUFFERS, batch.CHUNK)),
        )
        return problem.state(self, cable, length, horizontal, vertical, tension, status)

    def from_length(
        self, cable: Cable, span: ArrayLike, rise: ArrayLike, unstrained_length: ArrayLike, gravity: float = 9.81
    ) -> CableState:
        """Forces of cables of given unstrained lengths.

        All arguments broadcast to one shape (...).

        Args:
            cable: Material.
            span: Horizontal distance between the ends [m], >= 0.
            rise: Height of the platform end above the frame end [m].
            unstrained_length: L [m], > 0.
            gravity: Gravitational acceleration [m/s^2], >= 0.

        Returns:
            State with fields of shape (...).

        Raises:
            CableGeometryError: If span is negative, or span and rise are both zero.
            InvalidValueError: If a length is not positive, gravity is negative, or shapes do not broadcast.

        Source:
            Irvine 1981, ch. 2; docs/model.md, sections 2 (P2) and 3.
        """
        length = checked(unstrained_length, "unstrained_length", "m", above=0.0)
        problem = _problem(cable, span, rise, length, gravity)
        tension, horizontal, vertical, status = _outputs(problem.size)
        batch.batch_from_length(self.terms(problem.gravity), *problem.operands, tension, horizontal, vertical, status)
        return problem.state(self, cable, length, horizontal, vertical, tension, status)

    def profile(self, cable: Cable, state: CableState, points: int = 50) -> Array:
        """Points of a cable in its own vertical plane as this model draws it.

        Args:
            cable: Material.
            state: Ends, length and forces of the cable, shape (...).
            points: How many, at equal steps of unstrained length, >= 2.

        Returns:
            Horizontal and vertical coordinates from the frame end on [m], shape (..., points, 2).
        """
        if points < 2:
            raise InvalidValueError("points", points, ">= 2", "Ask for the two ends at least.")
        return replace(state, model=self, cable=cable).points(points)


class _Problem(NamedTuple):
    """Checked operands of a batch: flat, each as long as the batch or of length 1."""

    shape: tuple[int, ...]
    gravity: float
    span: Array
    rise: Array
    operands: tuple[Array, Array, Array, Array, Array]

    @property
    def size(self) -> int:
        return math.prod(self.shape)

    def state(
        self,
        model: CableModel,
        cable: Cable,
        length: Array,
        horizontal: Array,
        vertical: Array,
        tension: Array,
        status: Codes,
    ) -> CableState:
        """The solved batch in the caller's shape."""
        arrays = (self.span, self.rise, length, horizontal, vertical, tension)
        span, rise, length, horizontal, vertical, tension = (_shaped(array, self.shape) for array in arrays)
        return CableState(
            model=model,
            cable=cable,
            gravity=self.gravity,
            span=span,
            rise=rise,
            unstrained_length=length,
            horizontal_tension=horizontal,
            vertical_force=vertical,
            chord_tension=tension,
            status=locked(status.reshape(self.shape)),
        )


def _problem(cable: Cable, span: ArrayLike, rise: ArrayLike, given: Array, gravity: float) -> _Problem:
    """Check geometry and gravity and bring everything to one shape."""
    span = _checked_span(span)
    rise = checked(rise, "rise", "m")
    gravity = float(checked(gravity, "gravity", "m/s^2", low=0.0, shape=()))
    try:
        shape = np.broadcast_shapes(span.shape, rise.shape, given.shape, cable.linear_density.shape)
    except ValueError as error:
        raise InvalidValueError(
            "cable, span, rise and tension or length",
            f"not of one shape ({error})",
            "shapes that broadcast",
            "Give one value for each cable, or one for all.",
        ) from None
    if (span.size == 0 or span.min() == 0.0) and not np.all((span != 0.0) | (rise != 0.0)):
        raise CableGeometryError(
            "span and rise",
            "both 0 m",
            "two different ends",
            "Move one end: a cable between equal points has no chord.",
        )
    fields = (span, rise, cable.linear_density, cable.axial_stiffness, given)
    a, b, c, d, e = (_flat(field, shape) for field in fields)
    return _Problem(shape, gravity, span, rise, (a, b, c, d, e))


def _checked_span(span: ArrayLike) -> Array:
    try:
        return checked(span, "span", "m", low=0.0)
    except InvalidValueError as error:
        raise CableGeometryError(*error.args) from None


def _flat(field: Array, shape: tuple[int, ...]) -> Array:
    """One axis: the whole batch, or a single value that holds for all of it."""
    return field.reshape(1) if field.size == 1 else kernel_input(field, shape).reshape(-1)


def _shaped(field: Array, shape: tuple[int, ...]) -> Array:
    """The batch's shape, locked: results are reshaped, operands repeated without copying."""
    array = field.reshape(shape) if field.size == math.prod(shape) else np.broadcast_to(field, shape)
    return locked(array)


def _outputs(count: int) -> tuple[Array, Array, Array, Codes]:
    return np.empty(count), np.empty(count), np.empty(count), np.empty(count, dtype=np.int8)
