"""A batch of cables to solve. Operands are checked and flattened, and results get the shape of the arguments."""

from __future__ import annotations

import math
from typing import NamedTuple, Self

import numpy as np
from numpy.typing import ArrayLike

from sagline.cables.cable import Cable
from sagline.core.arrays import Array, Codes, broadcast_shape, checked, kernel_input, locked, number
from sagline.core.errors import CableGeometryError, InvalidValueError
from sagline.core.memory import check_memory


class Problem(NamedTuple):
    """Checked operands of a batch."""

    shape: tuple[int, ...]  # the batch's shape, (...)
    gravity: float  # gravitational acceleration [m/s^2]
    span: Array  # horizontal distances between the ends [m]; broadcasts with the shape
    rise: Array  # heights of the platform ends above the frame ends [m]; broadcasts with the shape
    # span, rise, linear density, axial stiffness and the given quantity, flat; each has the length of the batch, or 1
    operands: tuple[Array, Array, Array, Array, Array]

    @classmethod
    def of(cls, cable: Cable, span: ArrayLike, rise: ArrayLike, given: Array, gravity: float) -> Self:
        """Check geometry and gravity, and broadcast all operands to one shape.

        Units: span [m]; rise [m]; given: chord tension [N] or unstrained length [m]; gravity [m/s^2].
        """
        span = _checked_span(span)
        rise = checked(rise, "rise", "m")
        gravity = number(gravity, "gravity", "m/s^2", low=0.0)
        item = "span, rise, tension or length, and cable"
        shape = broadcast_shape(item, span.shape, rise.shape, given.shape, cable.linear_density.shape)
        check_memory(item, 80.0 * math.prod(shape), "Give fewer cables at once.")
        if (span.size == 0 or span.min() == 0.0) and not np.all((span != 0.0) | (rise != 0.0)):
            raise CableGeometryError(
                "span and rise",
                "both 0 m",
                "two different ends",
                "Move one end: a cable between equal points has no chord.",
            )
        fields = (span, rise, cable.linear_density, cable.axial_stiffness, given)
        a, b, c, d, e = (_flat(field, shape) for field in fields)
        return cls(shape, gravity, span, rise, (a, b, c, d, e))

    def outputs(self) -> tuple[Array, Array, Array, Codes]:
        """Arrays for the results of kernels: three numbers and a status per cable."""
        size = math.prod(self.shape)
        return np.empty(size), np.empty(size), np.empty(size), np.empty(size, dtype=np.int8)

    def shaped(self, field: Array) -> Array:
        """The result or operand `field` in the shape of the batch, (...), write-locked."""
        whole = field.size == math.prod(self.shape)
        return locked(field.reshape(self.shape) if whole else np.broadcast_to(field, self.shape))


def _checked_span(span: ArrayLike) -> Array:
    try:
        return checked(span, "span", "m", low=0.0)
    except InvalidValueError as error:
        raise CableGeometryError(*error.args) from None


def _flat(field: Array, shape: tuple[int, ...]) -> Array:
    """Flatten the operand `field` to one axis. It has one value per cable of the batch, or a single value."""
    return field.reshape(1) if field.size == 1 else kernel_input(field, shape).reshape(-1)
