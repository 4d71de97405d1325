"""The material of a cable: what it weighs and how stiff it is."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sagline.arrays import Array, broadcast_shape, checked, locked
from sagline.memory import check_memory


@dataclass(frozen=True, slots=True, eq=False)
class Cable:
    """One cable's material, or that of many: both fields share one shape.

    Attributes:
        linear_density: Mass per unstrained length [kg/m], shape (...), >= 0.
        axial_stiffness: Young's modulus times section area EA [N], shape (...), > 0.

    Examples:
        Braided fiber of 67 g/m and 44 kN, and two cables at once:

        >>> import sagline as sl
        >>> cable = sl.Cable(linear_density=0.067, axial_stiffness=44e3)
        >>> state = sl.Catenary().from_tension(cable, 12.0, -4.0, chord_tension=100.0)
        >>> print(f"{state.unstrained_length:.4f} m, {1e3 * state.sag:.1f} mm")
        12.6237 m, 131.2 mm
        >>> sl.Cable([0.067, 0.1], 44e3).axial_stiffness
        array([44000., 44000.])
    """

    linear_density: Array
    axial_stiffness: Array

    def __init__(self, linear_density: ArrayLike, axial_stiffness: ArrayLike) -> None:
        """Check and broadcast the two fields.

        Args:
            linear_density: Mass per unstrained length [kg/m], shape (...), >= 0.
            axial_stiffness: EA [N], > 0; a shape that broadcasts with that of linear_density.

        Raises:
            InvalidValueError: If a density is negative, a stiffness not positive, or the shapes do not broadcast.
        """
        density = checked(linear_density, "linear_density", "kg/m", low=0.0)
        stiffness = checked(axial_stiffness, "axial_stiffness", "N", above=0.0)
        shape = broadcast_shape("linear_density and axial_stiffness", density.shape, stiffness.shape)
        check_memory("linear_density and axial_stiffness", 16.0 * math.prod(shape), "Give fewer cables.")
        for name, field in (("linear_density", density), ("axial_stiffness", stiffness)):
            object.__setattr__(self, name, locked(np.array(np.broadcast_to(field, shape), order="C")))

    @classmethod
    def from_material(cls, linear_density: ArrayLike, youngs_modulus: ArrayLike, section_area: ArrayLike) -> Cable:
        """A cable from its Young's modulus and section area; all three arguments broadcast to one shape (...).

        Args:
            linear_density: Mass per unstrained length [kg/m], >= 0.
            youngs_modulus: E [Pa], > 0: of the rope as a whole, which is below that of its fibers or wires.
            section_area: A [m^2], > 0: what E was measured on, for a rope usually its fibers or metal alone.

        Returns:
            Cable of axial stiffness EA.

        Raises:
            InvalidValueError: If a density is negative, a modulus or area not positive, or the shapes do not broadcast.

        Examples:
            >>> import sagline as sl
            >>> cable = sl.Cable.from_material(
            ...     linear_density=0.067, youngs_modulus=2e9, section_area=22e-6
            ... )
            >>> print(f"{cable.axial_stiffness:.0f} N")
            44000 N
        """
        modulus = checked(youngs_modulus, "youngs_modulus", "Pa", above=0.0)
        area = checked(section_area, "section_area", "m^2", above=0.0)
        broadcast_shape("youngs_modulus and section_area", modulus.shape, area.shape)
        return cls(linear_density, modulus * area)

    def _part(self, index: int | slice | NDArray[Any], shape: tuple[int, ...]) -> Cable:
        """The material of a part of a batch of that shape; one without the batch's first axis stays what it is."""
        own = self.linear_density.shape
        if len(own) < len(shape):
            return self
        part = object.__new__(Cable)
        for name in ("linear_density", "axial_stiffness"):
            field = np.broadcast_to(getattr(self, name), (shape[0], *own[1:]))
            object.__setattr__(part, name, locked(field[index, ...]))
        return part

    def __reduce__(self) -> tuple[type[Cable], tuple[Array, Array]]:
        """Pickle through the constructor, so that a loaded cable is checked and locked too."""
        return Cable, (self.linear_density, self.axial_stiffness)
