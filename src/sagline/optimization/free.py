"""Design variables with bounds: choice of a cable from a catalogue, and tension limits."""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, Final, NamedTuple, TypeAlias

import numpy as np
from attrs import field, frozen

from sagline.cables.cable import Cable
from sagline.core.arguments import brief, choice, elements, instance, integer, label
from sagline.core.arrays import Array, Indices, number
from sagline.core.errors import InvalidValueError
from sagline.core.fields import check_fields, checked_by, reduced
from sagline.core.results import ByFields, set_fields
from sagline.kernels import tables
from sagline.robot.robot import Robot


class DesignVariable(NamedTuple):
    """One scalar design variable with its bounds.

    Attributes:
        name: Name in messages and tables.
        unit: Unit of the variable; "" for a variable that is the index of a choice.
        low: Lower bound [unit].
        high: Upper bound [unit].
        start: Value in the initial robot [unit], within the bounds.
        choices: Number of choices with the indices 0, 1, ...; 0 for a continuous variable.
    """

    name: str
    unit: str
    low: float
    high: float
    start: float
    choices: int = 0


# K design variables, and a function that writes values (N, K) of these variables into cable tables (N, m,
# CABLE_COLUMNS), in place.
Bound: TypeAlias = tuple[tuple[DesignVariable, ...], Callable[[Array, Array], None]]


class Free(ByFields):
    """Interface of groups of design variables: `FreeAnchors`, `FreeCable` and `FreeLimit`."""

    __slots__ = ()

    def bound(self, robot: Robot, item: str) -> Bound:
        """Design variables of this group for an initial robot.

        Args:
            robot: Initial robot of the search.
            item: Name of this group in messages.

        Returns:
            The design variables, and a function that writes values of the variables into cable tables.

        Raises:
            InvalidValueError: If the robot does not have a variable, or if the robot's value is outside the bounds.
        """
        raise NotImplementedError


def check_order(low: Array, high: Array, unit: str, *, strictly: bool = False) -> None:
    """Reject bounds (K,) in which `low` is above `high`; with `strictly`, equal bounds are also rejected."""
    for k in np.flatnonzero(low >= high if strictly else low > high):
        where = f"[{k}]" if len(low) > 1 else ""
        allowed = f"< high{where}, {high[k]:g} {unit}" if strictly else f"<= high{where}, {high[k]:g} {unit}"
        raise InvalidValueError(f"low{where}", f"{low[k]:g} {unit}", allowed, "Exchange low and high.")


def cable_numbers(cables: Any) -> tuple[int, ...]:
    """Checked cable indices without repetitions; None, which means all cables, becomes an empty array."""
    if cables is None:
        return ()
    step = "Number the cables from 0, or leave out `cables` for all cables."
    found = [integer(one) for one in elements(cables, (), "cables", step)]
    if not found or any(one is None or not 0 <= one <= sys.maxsize for one in found) or len(set(found)) < len(found):
        raise InvalidValueError("cables", brief(cables), "different numbers of cables", step)
    return tuple(one for one in found if one is not None)


def cables_of_robot(cables: tuple[int, ...], robot: Robot, item: str) -> Indices:
    """Cable indices, each of which exists in `robot`; all cables if `cables` is empty."""
    wrong = [one for one in cables if one >= robot.cable_count]
    if wrong:
        step = f"{robot.name} has {robot.cable_count} cables, numbered from 0."
        raise InvalidValueError(item, wrong[0], f"0 to {robot.cable_count - 1}", step)
    return np.array(cables or range(robot.cable_count), dtype=np.int64)


def whose_text(cables: Indices, count: int) -> str:
    """Suffix of a variable's name with the indices of the cables; empty if the variable is for all cables."""
    return "" if len(cables) == count else f"[{' '.join(map(str, cables))}]"


SAME: Final = 1e-9  # relative tolerance of the comparison between the robot's cable and cables of the catalogue


def _one_cable(value: Any, item: str) -> Cable:
    """Checked material of a single cable: every field is a number."""
    cable = instance(value, Cable, item)
    if cable.linear_density.shape != ():
        shape = f"of shape {cable.linear_density.shape}"
        raise InvalidValueError(item, shape, "the material of one cable, as numbers", "Give Cable(0.067, 44e3).")
    if not float(cable.linear_density) > 0.0:
        raise InvalidValueError(f"{item}: linear_density", "0 kg/m", "> 0 kg/m", "Give the mass per length.")
    return cable


@frozen(eq=False, weakref_slot=False)
class CableChoice:
    """Cable in the catalogue of a design search.

    Attributes:
        name: Name in messages and files.
        cable: Material of the cable; every field is a number.
        cost: Cost per meter, in any currency, >= 0. May be None if no goal needs the cost.
        tension_max: Upper tension limit [N], > 0; None for the limits of the robot.

    Raises:
        InvalidValueError: If the material has values for several cables, or if an argument has a wrong type.
    """

    name: str = field(metadata=checked_by(label))
    cable: Cable = field(metadata=checked_by(_one_cable))
    cost: float | None = field(default=None, kw_only=True, metadata=checked_by(number, "per m", low=0.0))
    tension_max: float | None = field(default=None, kw_only=True, metadata=checked_by(number, "N", above=0.0))

    __attrs_post_init__ = check_fields
    __reduce__ = reduced


@dataclass(frozen=True, slots=True, eq=False)
class FreeCable(Free):
    """Design variable: choice of one material for all cables from a catalogue.

    Attributes:
        catalogue: The cables, which should be sorted by weight because the search assumes that neighbors are similar.
    """

    catalogue: tuple[CableChoice, ...]

    def __init__(self, catalogue: Sequence[CableChoice]) -> None:
        """Check the catalogue.

        Args:
            catalogue: Two or more cables; one of them is the robot's own cable.

        Raises:
            InvalidValueError: If `catalogue` is not a sequence of `CableChoice`, or if two cables have the same name.
        """
        given: Any = catalogue
        if not isinstance(given, Sequence) or isinstance(given, str) or len(given) < 2:
            step = "Give [CableChoice(name, cable), ...]."
            raise InvalidValueError("catalogue", brief(given), "at least two cables", step)
        entries = tuple(instance(one, CableChoice, f"catalogue[{k}]") for k, one in enumerate(given))
        names = [one.name for one in entries]
        if twice := [name for name in names if names.count(name) > 1]:
            raise InvalidValueError("catalogue", f"with {twice[0]!r} twice", "different names", "Rename one of them.")
        object.__setattr__(self, "catalogue", entries)

    def bound(self, robot: Robot, item: str) -> Bound:
        """Design variables of this part, for a given robot."""
        own = robot.cables
        for k, one in enumerate(self.catalogue):
            pairs = ((own.linear_density, one.cable.linear_density), (own.axial_stiffness, one.cable.axial_stiffness))
            limits = one.tension_max is None or bool(np.allclose(robot.tension_max, one.tension_max, rtol=SAME))
            if limits and all(np.allclose(mine, its, rtol=SAME, atol=0.0) for mine, its in pairs):
                part = DesignVariable("cable", "", 0.0, float(len(self.catalogue) - 1), float(k), len(self.catalogue))
                return (part,), partial(_write_cables, self.catalogue)
        density, stiffness = own.linear_density[0], own.axial_stiffness[0]
        value = f"{1e3 * density:g} g/m, {stiffness:g} N, up to {robot.tension_max[0]:g} N"
        name, step = f"{item}: the robot's cable 0", "Add the robot's own cable, because the search begins with it."
        raise InvalidValueError(name, value, "equal for all cables, and in the catalogue", step)


def _write_cables(catalogue: tuple[CableChoice, ...], cables: Array, values: Array) -> None:
    """Write material and tension limit of the catalogue's entry with the index `values` into cable tables."""
    which = values[:, 0].astype(np.int64)
    for name, column in (("linear_density", tables.DENSITY), ("axial_stiffness", tables.STIFFNESS)):
        cables[:, :, column] = np.array([getattr(one.cable, name) for one in catalogue])[which, None]
    limits = np.array([np.nan if one.tension_max is None else one.tension_max for one in catalogue])
    given = ~np.isnan(limits[which])
    cables[given, :, tables.TENSION_MAX] = limits[which][given, None]


LIMITS: Final = {"tension_min": tables.TENSION_MIN, "tension_max": tables.TENSION_MAX}


@dataclass(frozen=True, slots=True, eq=False)
class FreeLimit(Free):
    """Design variable: tension limit that has the same value for all or some cables.

    Attributes:
        which: "tension_min" or "tension_max".
        low: Lower bound [N], >= 0.
        high: Upper bound [N].
        cables: Indices of the cables, from 0; empty for all.
    """

    which: str
    low: float
    high: float
    cables: tuple[int, ...]

    def __init__(self, which: str, low: float, high: float, *, cables: Sequence[int] | None = None) -> None:
        """Check limit, bounds and cables.

        Args:
            which: "tension_min" or "tension_max".
            low: Lower bound [N], >= 0.
            high: Upper bound [N].
            cables: Indices of the cables, from 0; None for all.

        Raises:
            InvalidValueError: If `low` is not below `high`, or if an argument has a wrong type.

        Examples:
            >>> import sagline as sl
            >>> print(sl.FreeLimit("tension_max", 500.0, 3000.0).high, "N")
            3000.0 N
        """
        lower, upper = number(low, "low", "N", low=0.0), number(high, "high", "N", low=0.0)
        check_order(np.array([lower]), np.array([upper]), "N", strictly=True)
        set_fields(self, which=choice(which, "which", LIMITS), low=lower, high=upper, cables=cable_numbers(cables))

    def bound(self, robot: Robot, item: str) -> Bound:
        """Design variables of this part, for a given robot."""
        cables = cables_of_robot(self.cables, robot, f"{item}: cables")
        own = getattr(robot, self.which)[cables]
        name = f"{self.which}{whose_text(cables, robot.cable_count)}"
        if len(set(own.tolist())) > 1:
            value = f"{own.min():g} to {own.max():g} N"
            step = "Give only cables with the same limit: FreeLimit(..., cables=[0, 1])."
            raise InvalidValueError(f"{item}: the robot's {name}", value, "the same for all of these cables", step)
        start = float(own[0])
        if not self.low <= start <= self.high:
            allowed, step = f"{self.low:g} to {self.high:g} N", "Widen the bounds, or correct the robot."
            raise InvalidValueError(f"{item}: the robot's {name}", f"{start:g} N", allowed, step)

        def write(tables_of_cables: Array, values: Array) -> None:
            tables_of_cables[:, cables, LIMITS[self.which]] = values

        return (DesignVariable(name, "N", self.low, self.high, start),), write
