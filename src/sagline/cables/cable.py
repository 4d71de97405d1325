"""The material of a cable: what it weighs and how stiff it is."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sagline.arrays import Array, checked, locked
from sagline.errors import InvalidValueError


@dataclass(frozen=True, slots=True, eq=False)
class Cable:
    """One cable's material, or that of many: both fields share one shape.

    Attributes:
        linear_density: Mass per unstrained length [kg/m], shape (...), >= 0.
        axial_stiffness: Young's modulus times section area EA [N], shape (...), > 0.
    """

    linear_density: Array
    axial_stiffness: Array

    def __init__(self, linear_density: ArrayLike, axial_stiffness: ArrayLike) -> None:
        """Check and broadcast the two fields.

        Raises:
            InvalidValueError: If a density is negative, a stiffness not positive, or the shapes do not broadcast.
        """
        density = checked(linear_density, "linear_density", "kg/m", low=0.0)
        stiffness = checked(axial_stiffness, "axial_stiffness", "N", above=0.0)
        try:
            density, stiffness = np.broadcast_arrays(density, stiffness)
        except ValueError:
            raise InvalidValueError(
                "axial_stiffness",
                f"of shape {stiffness.shape}",
                f"a shape that broadcasts with linear_density's {density.shape}",
                "Give both for the same cables.",
            ) from None
        object.__setattr__(self, "linear_density", locked(np.array(density, order="C")))
        object.__setattr__(self, "axial_stiffness", locked(np.array(stiffness, order="C")))

    @classmethod
    def from_material(cls, linear_density: ArrayLike, youngs_modulus: ArrayLike, section_area: ArrayLike) -> Cable:
        """A cable from its Young's modulus [Pa] and section area [m^2]."""
        modulus = checked(youngs_modulus, "youngs_modulus", "Pa", above=0.0)
        area = checked(section_area, "section_area", "m^2", above=0.0)
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
