"""Cables from a catalogue."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final, NamedTuple

import numpy as np

from sagline.cables.cable import Cable
from sagline.core.arguments import brief, instance, label
from sagline.core.arrays import Array, number
from sagline.core.errors import InvalidValueError
from sagline.kernels import tables
from sagline.optimization.free import Bound, Free, Part
from sagline.robot.robot import Robot

SAME: Final = 1e-9  # relative: to which a robot's cable is one of a catalogue


@dataclass(frozen=True, slots=True, eq=False)
class CableChoice:
    """A cable of a catalogue.

    Attributes:
        name: What it is called.
        cable: Its material, one cable's.
        cost: Of a meter of it, in any currency; None where no goal asks.
        tension_max: What it carries [N]; None: the robot's limits stay.
    """

    name: str
    cable: Cable
    cost: float | None
    tension_max: float | None

    def __init__(self, name: str, cable: Cable, *, cost: float | None = None, tension_max: float | None = None) -> None:
        """Check them.

        Args:
            name: What it is called.
            cable: Its material, numbers and no arrays.
            cost: Of a meter, >= 0, or None.
            tension_max: What it carries [N], > 0, or None.

        Raises:
            InvalidValueError: If the material is that of several cables, or an argument is of the wrong kind.
        """
        if instance(cable, Cable, "cable").linear_density.shape != ():
            value = f"of shape {cable.linear_density.shape}"
            raise InvalidValueError("cable", value, "one cable's material, numbers", "Give Cable(0.067, 44e3).")
        if not float(cable.linear_density) > 0.0:
            raise InvalidValueError("cable: linear_density", "0 kg/m", "> 0 kg/m", "Give its mass per length.")
        limit = None if tension_max is None else number(tension_max, "tension_max", "N", above=0.0)
        price = None if cost is None else number(cost, "cost", "per m", low=0.0)
        values: dict[str, Any] = {"name": label(name, "name"), "cable": cable, "cost": price, "tension_max": limit}
        for field, value in values.items():
            object.__setattr__(self, field, value)


@dataclass(frozen=True, slots=True, eq=False)
class FreeCable(Free):
    """The material of all cables, from a catalogue.

    Attributes:
        catalogue: The cables, best in the order of their weight: neighbors are tried after each other.
    """

    catalogue: tuple[CableChoice, ...]

    def __init__(self, catalogue: Sequence[CableChoice]) -> None:
        """Check it.

        Args:
            catalogue: Two cables or more; the robot's own is among them.

        Raises:
            InvalidValueError: If it is none.
        """
        given: Any = catalogue
        if not isinstance(given, Sequence) or isinstance(given, str) or len(given) < 2:
            step = "Give [CableChoice(name, cable), ...]."
            raise InvalidValueError("catalogue", brief(given), "two cables or more", step)
        entries = tuple(instance(one, CableChoice, f"catalogue[{k}]") for k, one in enumerate(given))
        names = [one.name for one in entries]
        if twice := [name for name in names if names.count(name) > 1]:
            raise InvalidValueError("catalogue", f"with {twice[0]!r} twice", "names that differ", "Rename one of them.")
        object.__setattr__(self, "catalogue", entries)

    def bound(self, robot: Robot, item: str) -> Bound:
        """What it means for a robot."""
        own = robot.cables
        for k, one in enumerate(self.catalogue):
            pairs = ((own.linear_density, one.cable.linear_density), (own.axial_stiffness, one.cable.axial_stiffness))
            limits = one.tension_max is None or bool(np.allclose(robot.tension_max, one.tension_max, rtol=SAME))
            if limits and all(np.allclose(mine, its, rtol=SAME, atol=0.0) for mine, its in pairs):
                part = Part("cable", "", 0.0, float(len(self.catalogue) - 1), float(k), len(self.catalogue))
                return _Chosen((part,), self.catalogue)
        density, stiffness = own.linear_density[0], own.axial_stiffness[0]
        value = f"{1e3 * density:g} g/m, {stiffness:g} N, up to {robot.tension_max[0]:g} N"
        step = "Add the robot's own cable: the search begins with it."
        raise InvalidValueError(f"{item}: the robot's cable 0", value, "all cables alike, in the catalogue", step)


class _Chosen(NamedTuple):
    """A catalogue."""

    parts: tuple[Part, ...]
    catalogue: tuple[CableChoice, ...]

    def write(self, cables: Array, values: Array) -> None:
        """Set the material."""
        which = values[:, 0].astype(np.int64)
        density, stiffness = (
            np.array([getattr(one.cable, name) for one in self.catalogue])
            for name in ("linear_density", "axial_stiffness")
        )
        cables[:, :, tables.DENSITY] = density[which, None]
        cables[:, :, tables.STIFFNESS] = stiffness[which, None]
        limits = np.array([np.nan if one.tension_max is None else one.tension_max for one in self.catalogue])
        given = ~np.isnan(limits[which])
        cables[given, :, tables.TENSION_MAX] = limits[which][given, None]
