"""The state of a cable that hangs between two points."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from sagline.arrays import Array, Codes, kernel_input, locked
from sagline.cables.cable import Cable
from sagline.kernels.cable import shape

if TYPE_CHECKING:
    from sagline.cables.model import CableModel

_ARRAYS = (
    "span",
    "rise",
    "unstrained_length",
    "horizontal_tension",
    "vertical_force",
    "chord_tension",
    "status",
)


@dataclass(frozen=True, slots=True, eq=False)
class CableState:
    """Where a cable's ends are, what it carries and how long it is: results of a cable model.

    Every array has shape (...), one entry a cable. Forces act on the cable at its platform end. A batch is indexed
    along its first axis, by a number, a slice, or an array of numbers or booleans; slices share its memory.

    Attributes:
        model: The cable model that was solved.
        cable: Material; its fields broadcast with shape (...).
        gravity: Gravitational acceleration [m/s^2].
        span: Horizontal distance from frame end to platform end [m].
        rise: Height of the platform end above the frame end [m].
        unstrained_length: L [m].
        horizontal_tension: T_x [N], >= 0.
        vertical_force: T_z [N], up positive.
        chord_tension: tau = T_x/cos phi [N].
        status: Codes of `CableStatus`; where it is not SOLVED, SLACK or BELOW_VALIDITY the answer is NaN.
    """

    model: CableModel
    cable: Cable
    gravity: float
    span: Array
    rise: Array
    unstrained_length: Array
    horizontal_tension: Array
    vertical_force: Array
    chord_tension: Array
    status: Codes

    @property
    def shape(self) -> tuple[int, ...]:
        """Shape of every array."""
        return self.unstrained_length.shape

    def __len__(self) -> int:
        """Length of the first axis."""
        if not self.shape:
            raise TypeError("the state of a single cable has no length")
        return self.shape[0]

    def __getitem__(self, index: int | slice | NDArray[Any]) -> CableState:
        """The state of a part of the cables, along the first axis.

        Args:
            index: A number, which may count from the end; a slice; or an array of numbers or booleans.

        Raises:
            TypeError: If the state is that of a single cable.
            IndexError: If there is no such entry.
        """
        if not self.shape:
            raise TypeError("the state of a single cable cannot be indexed")
        arrays: dict[str, Any] = {name: locked(getattr(self, name)[index, ...]) for name in _ARRAYS}
        return replace(self, cable=self.cable._part(index, self.shape), **arrays)

    def __iter__(self) -> Iterator[CableState]:
        """The entries along the first axis, one by one."""
        return (self[i] for i in range(len(self)))

    @property
    def chord(self) -> Array:
        """D, distance between the two ends [m]."""
        return np.hypot(self.span, self.rise)

    @property
    def adjusting_length(self) -> Array:
        """The article's d = L - D [m]."""
        return self.unstrained_length - self.chord

    @property
    def cable_weight(self) -> Array:
        """Weight of the whole cable [N] as its model sees it: zero for the weightless models."""
        if self.model.weightless:
            return np.zeros(self.shape)
        return self.cable.linear_density * self.gravity * self.unstrained_length

    @property
    def frame_end_tension(self) -> Array:
        """Tension at the frame end, where a winch's load cell sits [N]."""
        return np.hypot(self.horizontal_tension, self.vertical_force - self.cable_weight)

    @property
    def platform_end_tension(self) -> Array:
        """Tension at the platform end [N]."""
        return np.hypot(self.horizontal_tension, self.vertical_force)

    @property
    def sag(self) -> Array:
        """Largest vertical drop below the chord [m]; on a vertical chord, below the lower end."""
        out = np.empty(self.unstrained_length.size)
        shape.sags(self.model.terms(self.gravity), *self._columns(), out)
        return out.reshape(self.shape)

    @property
    def closure_residual(self) -> Array:
        """By how much the state misses its own model's equations [m]."""
        out = np.empty(self.unstrained_length.size)
        shape.closures(self.model.terms(self.gravity), *self._columns(), out)
        return out.reshape(self.shape)

    def points(self, count: int) -> Array:
        """Points along the cable in its own vertical plane, frame end first, shape (..., count, 2) [m]."""
        out = np.empty((self.unstrained_length.size, count, 2))
        shape.shape_points(self.model.terms(self.gravity), *self._columns(), out)
        return locked(out.reshape(*self.shape, count, 2))

    def _columns(self) -> tuple[Array, Array, Array, Array, Array, Array, Array, Array]:
        flat = (kernel_input(field, self.shape).reshape(-1) for field in self._fields())
        span, rise, density, stiffness, length, horizontal, vertical, tension = flat
        return span, rise, density, stiffness, length, horizontal, vertical, tension

    def _fields(self) -> tuple[Array, ...]:
        return (
            self.span,
            self.rise,
            self.cable.linear_density,
            self.cable.axial_stiffness,
            self.unstrained_length,
            self.horizontal_tension,
            self.vertical_force,
            self.chord_tension,
        )
