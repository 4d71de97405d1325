"""Material of cables: density, stiffness, diameter and creep; a catalogue of ropes."""

from __future__ import annotations

import math
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any, ClassVar, Final

import numpy as np
from attrs import evolve, field, fields, frozen
from numpy.typing import ArrayLike, NDArray

from sagline.core.arguments import check_memory, choice, flag
from sagline.core.arrays import Array, broadcast_shape, checked, locked, spread
from sagline.core.errors import InvalidValueError
from sagline.core.fields import given, if_known, reduced, rule
from sagline.kernels import creep_strains


@frozen(eq=False, weakref_slot=False)
class Cable:
    """Material of one cable or of many cables. All known fields have the same shape.

    Attributes:
        linear_density: Mass per unstrained length [kg/m], shape (...), >= 0.
        axial_stiffness: Axial stiffness EA, Young's modulus times section area [N], shape (...), > 0.
        diameter: Diameter of the rope [m], shape (...), > 0; None if not known. Only drums need the diameter.
        expansion: Coefficient of thermal expansion [1/K], shape (...), negative for most fibers; None if not known.

    Raises:
        InvalidValueError: If a density is negative; if a stiffness or diameter is not positive; if the shapes do not
            broadcast.

    Examples:
        A cable with 67 g/m and EA = 44 kN, then two cables in one object:

        >>> import sagline as sl
        >>> cable = sl.Cable(linear_density=0.067, axial_stiffness=44e3)
        >>> state = sl.Catenary().from_tension(cable, 12.0, -4.0, chord_tension=100.0)
        >>> print(f"{state.unstrained_length:.4f} m, {1e3 * state.sag:.1f} mm")
        12.6237 m, 131.2 mm
        >>> sl.Cable([0.067, 0.1], 44e3).axial_stiffness
        array([44000., 44000.])
    """

    __slots__: ClassVar[tuple[str, ...]]  # field names in the order of the constructor

    linear_density: Array = field(converter=given, metadata=rule("kg/m", low=0.0))
    axial_stiffness: Array = field(converter=given, metadata=rule("N", above=0.0))
    diameter: Array | None = field(default=None, kw_only=True, converter=if_known, metadata=rule("m", above=0.0))
    expansion: Array | None = field(default=None, kw_only=True, converter=if_known, metadata=rule("1/K"))

    def __attrs_post_init__(self) -> None:
        """Check all fields, and broadcast the known fields to one shape."""
        values = {
            about.name: checked(value, about.name, **about.metadata)
            for about in fields(Cable)
            if (value := getattr(self, about.name)) is not None or about.default is not None
        }
        item = " and ".join(values)
        shape = broadcast_shape(item, *(value.shape for value in values.values()))
        check_memory(item, 8.0 * len(values) * math.prod(shape), "Give fewer cables.")
        for name, value in values.items():
            object.__setattr__(self, name, spread(value, shape))

    @classmethod
    def from_material(
        cls,
        linear_density: ArrayLike,
        youngs_modulus: ArrayLike,
        section_area: ArrayLike,
        *,
        diameter: ArrayLike | None = None,
        expansion: ArrayLike | None = None,
    ) -> Cable:
        """Create a cable from Young's modulus and section area; all arguments broadcast to one shape (...).

        Args:
            linear_density: Mass per unstrained length [kg/m], >= 0.
            youngs_modulus: Young's modulus E of the rope [Pa], > 0, which is less than the modulus of its fibers.
            section_area: Section area A for which E is stated [m^2], > 0; usually the area of fibers or wires alone.
            diameter: Diameter of the rope [m], > 0; None if unknown. The diameter does not determine the section area.
            expansion: Coefficient of thermal expansion [1/K], or None.

        Returns:
            Cable of axial stiffness EA.

        Raises:
            InvalidValueError: If a density is negative; if a modulus, area or diameter is not positive; if the shapes
                do not broadcast.

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
        return cls(linear_density, modulus * area, diameter=diameter, expansion=expansion)

    def replace(self, **changes: Any) -> Cable:
        """Copy of the cable with some fields changed; the constructor checks the copy.

        Args:
            changes: Fields of `Cable` and their new values.

        Returns:
            New cable; the original cable is unchanged.

        Raises:
            InvalidValueError: If a field does not exist, or the constructor does not accept the new values.

        Examples:
            >>> import sagline as sl
            >>> rope = sl.Cable(0.067, 44e3, diameter=0.006)
            >>> worn = rope.replace(axial_stiffness=0.9 * rope.axial_stiffness)
            >>> print(worn.axial_stiffness, worn.diameter)
            39600.0 0.006
        """
        for name in changes:
            choice(name, "field", self.__slots__)
        return evolve(self, **changes)

    def known(self) -> dict[str, Array]:
        """Names and values of the known fields.

        Returns:
            Dictionary of the fields that are not None.
        """
        return {name: value for name in self.__slots__ if (value := getattr(self, name)) is not None}

    def _part(self, index: int | slice | NDArray[Any], shape: tuple[int, ...]) -> Cable:
        """Material at `index` of a batch of shape `shape`; a material without batch axes is returned unchanged."""
        own = self.linear_density.shape
        if len(own) < len(shape):
            return self
        part = object.__new__(Cable)
        for name in self.__slots__:
            value = getattr(self, name)
            if value is not None:
                value = locked(np.broadcast_to(value, (shape[0], *own[1:]))[index, ...])
            object.__setattr__(part, name, value)
        return part

    __reduce__ = reduced


MOST_ELEMENTS = 2


@dataclass(frozen=True, slots=True, eq=False)
class Creep:
    """Creep of a cable: one or two Kelvin-Voigt elements (spring parallel to damper) in series with the cable.

    An elastic cable with one element is the standard linear solid. An elastic cable with two elements is the
    five-element model of polymer ropes. The creep is recoverable: without tension, the creep strain returns to zero.

    Attributes:
        axial_stiffness: Stiffness k of each element [N], > 0, shape (1,) or (2,). Under a constant tension T, the
            strain of an element approaches T/k.
        time: Retardation time of each element [s], > 0, shape (1,) or (2,). After this time, the strain of an element
            is 63 % (1 - 1/e) of T/k.

    Examples:
        Strain of a fiber rope under 1 kN after a second, a minute and an hour:

        >>> import sagline as sl
        >>> creep = sl.Creep(axial_stiffness=[1e6, 4e5], time=[30.0, 1200.0])
        >>> strain = creep.strain([0.0, 1.0, 60.0, 3600.0], [1000.0] * 4)
        >>> print((1e3 * strain).round(3), "mm/m")
        [0.    0.035 0.987 3.376] mm/m

    Source:
        Adv. Mech. Eng. 2017, doi 10.1177/1687814017737199 (five elements); exact step in docs/model.md, section 10.
    """

    axial_stiffness: Array
    time: Array

    def __init__(self, axial_stiffness: ArrayLike, time: ArrayLike) -> None:
        """Check stiffness and retardation time of all elements.

        Args:
            axial_stiffness: Stiffness of each element [N], > 0: a number, or a list of one or two numbers.
            time: Retardation time of each element [s], > 0: a number, or a list of one or two numbers.

        Raises:
            InvalidValueError: If a number is not positive, or if there are more than two elements.
        """
        stiffness = checked(axial_stiffness, "axial_stiffness", "N", above=0.0)
        delay = checked(time, "time", "s", above=0.0)
        shape = broadcast_shape("axial_stiffness and time", (1,), stiffness.shape, delay.shape)
        if len(shape) > 1 or not 1 <= shape[0] <= MOST_ELEMENTS:
            raise InvalidValueError(
                "axial_stiffness and time", f"of shape {shape}", "shape (), (1,) or (2,)", "Give one or two elements."
            )
        for name, values in (("axial_stiffness", stiffness), ("time", delay)):
            object.__setattr__(self, name, locked(np.array(np.broadcast_to(values, shape))))

    def strain(self, time: ArrayLike, tension: ArrayLike, *, settled: bool = False) -> Array:
        """Creep strain for a time series of tensions. Creep changes an unstrained length L to L (1 + strain).

        The strain is exact for tensions that vary linearly between samples.

        Args:
            time: Times of the samples [s], increasing, shape (N,).
            tension: Tensions [N], shape (N,) or (N, m); NaN at a sample without a solution.
            settled: True if the first tension has acted for a long time before; False if the initial strain is zero.

        Returns:
            Strain in the shape of `tension`; NaN where the tension is NaN.

        Raises:
            InvalidValueError: If the times do not increase, or if the shapes of `time` and `tension` do not fit.
        """
        clock = checked(time, "time", "s", shape=(None,))
        force = checked(tension, "tension", "N", missing=True)
        if clock.ndim != 1 or force.ndim not in (1, 2) or len(force) != len(clock):
            shapes = f"of shapes {clock.shape} and {force.shape}"
            raise InvalidValueError("time and tension", shapes, "(N,) and (N,) or (N, m)", "Give one row per sample.")
        if (late := np.diff(clock) <= 0.0).any():
            k = int(np.argmax(late)) + 1
            allowed = f"more than {clock[k - 1]:g} s"
            raise InvalidValueError(f"time[{k}]", f"{clock[k]:g} s", allowed, "Give the samples in order of time.")
        rows = force.reshape(len(clock), -1)
        found, state = np.empty(rows.shape), locked(np.array([flag(settled, "settled")], dtype=np.bool_))
        creep_strains(clock, rows, self.axial_stiffness, self.time, state, found)
        return locked(found.reshape(force.shape))

    def __reduce__(self) -> tuple[Any, tuple[Array, Array]]:
        """Pickle the object as a call of the constructor, which checks the loaded elements."""
        return Creep, (self.axial_stiffness, self.time)


SAFETY = 5.0  # safety factor: breaking force divided by the largest allowed tension, usual for general lifting


@dataclass(frozen=True, slots=True)
class Rope:
    """Type of rope in the catalogue, with properties that are proportional to the square of the diameter.

    Attributes:
        name: Name in the catalogue.
        description: Description of the rope.
        density_factor: Linear density divided by the squared diameter [kg/m^3].
        stiffness_factor: Axial stiffness divided by the squared diameter [Pa].
        strength_factor: Breaking force divided by the squared diameter [Pa].
        source: Document from which the numbers are taken.
        assumed: Values that are assumed, with reasons.
    """

    name: str
    description: str
    density_factor: float
    stiffness_factor: float
    strength_factor: float
    source: str
    assumed: str

    def cable(self, diameter: float) -> Cable:
        """Material of a cable of this rope type with the diameter `diameter` [m]."""
        square = float(checked(diameter, "diameter", "m", shape=(), above=0.0)) ** 2
        return Cable(self.density_factor * square, self.stiffness_factor * square, diameter=diameter)

    def breaking_force(self, diameter: float) -> float:
        """Minimum breaking force [N] of a new rope of this type with the diameter `diameter` [m]."""
        return self.strength_factor * diameter**2


def _steel(name: str, construction: str, mass: float, section: float, strength: float) -> Rope:
    """Steel rope with the factors of EN 12385-4: length mass W [kg/(100 m mm^2)], metallic section C, strength K."""
    return Rope(
        name=name,
        description=f"steel wire rope {construction}, grade 1770",
        density_factor=1e4 * mass,
        stiffness_factor=_STEEL_MODULUS * section,
        strength_factor=1.77e9 * strength,
        source=f"EN 12385-4, calculation factors of {construction}: W = {mass}, C = {section}, K = {strength}",
        assumed="modulus 100 GPa on the metallic section, usual after run-in; manufacturers state their own values",
    )


def _braid(name: str, fiber: str, modulus: float, strength: float, source: str) -> Rope:
    """Braided rope of a fiber with the modulus `modulus` [Pa] and the strength `strength` [Pa]."""
    section = 0.7853981633974483 * _BRAID_FILL
    return Rope(
        name=name,
        description=f"12-strand braid of {fiber}",
        density_factor=_POLYETHYLENE * section,
        stiffness_factor=0.5 * modulus * section,
        strength_factor=0.55 * strength * section,
        source=source,
        assumed="fiber fills two thirds of the rope's circle, and the braid keeps 50 % of its modulus and 55 % of its "
        "strength: usual values for a braid after run-in; manufacturers state their own values",
    )


_STEEL_MODULUS = 100e9  # [Pa], modulus that refers to the metallic section
_BRAID_FILL = 2.0 / 3.0  # fiber area divided by the area of the circle with the nominal diameter
_POLYETHYLENE = 975.0  # [kg/m^3], assumed density of the fiber
_DSM = "DSM Dyneema, fact sheet UHMWPE fiber, CIS YA100 (2010): {}; density 975 kg/m^3 assumed"

ROPES: Final = MappingProxyType(
    {
        rope.name: rope
        for rope in (
            _braid("dyneema-sk78", "Dyneema SK78", 109e9, 3.3e9, _DSM.format("SK78 at least 109 GPa, 3.3 GPa")),
            _braid("dyneema-sk62", "Dyneema SK62", 65e9, 2.4e9, _DSM.format("SK62 at least 65 GPa, 2.4 GPa")),
            _steel("steel-6x19", "6x19 with a steel core (IWRC)", 0.400, 0.449, 0.356),
            _steel("steel-7x19", "7x19 (6x19M with a strand core, WSC)", 0.381, 0.418, 0.362),
        )
    }
)
