"""Whether a file's simulation hangs together: its times, what happened, what is left of the cables, its energies."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import numpy as np

from sagline.core.arguments import choice
from sagline.core.arrays import Array, number
from sagline.core.errors import InvalidValueError
from sagline.files.simulation_layout import (
    CABLE_MASS,
    EVENTS,
    INTEGRATORS,
    LAG,
    LAGGING,
    LARGEST,
    LOSSES,
    NO_CABLE,
    NODES,
    OF_CABLES,
    OF_EITHER,
    OF_PLATFORM,
    SAMPLES,
    TIME,
    WINCHES,
    WINDINGS,
)
from sagline.files.variable_checks import STEP, check_labels, check_variable

if TYPE_CHECKING:
    from xarray import Dataset

ROWS: Final = "time"
EVENT_ROWS: Final = "event"
ROUNDING: Final = 1e-12  # of the largest energy


def check_simulation(data: Dataset, cables: int) -> None:
    """Refuse a data set that is no simulation, whatever its file looked like.

    Args:
        data: The data set.
        cables: How many its robot has.

    Raises:
        KeyError: If a variable is missing.
        InvalidValueError: If one is not what the layout says; the message names its first wrong value.
    """
    _check_settings(data.attrs)
    check_labels(data)
    sizes = {"cable": cables, ROWS: data.variables[TIME.name].size, "node": data.sizes.get("node", 0)}
    everywhere = np.ones(sizes[ROWS], dtype=bool)
    nodes = (NODES,) if NODES.name in data.variables else ()
    for quantity in (TIME, *SAMPLES, *nodes):
        check_variable(quantity, data.variables[quantity.name], (ROWS,), sizes, everywhere)
    if LARGEST.name in data.variables:
        check_variable(LARGEST, data.variables[LARGEST.name], (), sizes, np.array(True))
    time = data.variables[TIME.name].values
    _check_times(time)
    if bool(nodes) != (data.attrs["cable_mass"] != "none"):
        allowed = "given for cables with mass, and for no others"
        raise InvalidValueError(NODES.name, "given" if nodes else "not given", allowed, STEP)
    broken = np.full(cables, np.inf)
    if has_events(data):
        sizes[EVENT_ROWS] = data.sizes[EVENT_ROWS]
        every = np.ones(sizes[EVENT_ROWS], dtype=bool)
        for quantity in EVENTS:
            check_variable(quantity, data.variables[quantity.name], (EVENT_ROWS,), sizes, every)
        broken = _check_events(data, time, cables)
    for quantity in (*(one for one in SAMPLES if one.name == "length"), *nodes):
        _check_gaps(quantity.name, data.variables[quantity.name].values, time[:, None] > broken)
    _check_balance(data)


def has_events(data: Dataset) -> bool:
    """Whether anything happened in a data set.

    Args:
        data: The data set.
    """
    return any(quantity.name in data.variables for quantity in EVENTS)


def _check_settings(attributes: Any) -> None:
    """How it was integrated; what damps and lags is looked at where it is made."""
    kinds = {"cable_mass": CABLE_MASS, "integrator": INTEGRATORS, "winches": WINCHES, "winding": WINDINGS}
    for name, allowed in kinds.items():
        choice(attributes[name], name, allowed)
    number(attributes["step"], "step", "s", above=0.0)
    for name in (*LOSSES, *(LAG if attributes["winches"] == LAGGING else ())):
        number(attributes[name], name, "", low=0.0)
    if (attributes["cable_mass"] == "modal") != (attributes["integrator"] == "exact"):
        told = f"{attributes['integrator']} for cable_mass {attributes['cable_mass']}"
        raise InvalidValueError("integrator", told, "exact for modal, and for no others", STEP)


def _check_times(time: Array) -> None:
    if time.size < 2:
        raise InvalidValueError("time", f"of {time.size} samples", "at least the start and the end", STEP)
    for k in np.flatnonzero(~(np.diff(time) > 0.0))[:1].tolist():
        raise InvalidValueError(f"time[{k + 1}]", f"{time[k + 1]:g} s", f"> {time[k]:g} s", STEP)


def _check_events(data: Dataset, time: Array, cables: int) -> Array:
    """Times at which cables break [s], infinite for those that do not."""
    columns = (data.variables[f"event_{name}"].values.tolist() for name in ("time", "kind", "cable"))
    before, broken = float(time[0]), np.full(cables, np.inf)
    for k, (at, kind, cable) in enumerate(zip(*columns, strict=True)):
        choice(kind, f"event_kind[{k}]", (*OF_CABLES, *OF_PLATFORM, *OF_EITHER))
        if not before <= at <= time[-1]:
            allowed = f"{before:g} to {time[-1]:g} s, in order"
            raise InvalidValueError(f"event_time[{k}]", f"{at:g} s", allowed, STEP)
        low = 0 if kind in OF_CABLES else NO_CABLE
        high = NO_CABLE if kind in OF_PLATFORM else cables - 1
        if not low <= cable <= high:
            allowed = f"{low} to {high} for {kind!r}" if low < high else f"{low} for {kind!r}"
            raise InvalidValueError(f"event_cable[{k}]", cable, allowed, STEP)
        if cable != NO_CABLE and broken[cable] < np.inf:
            allowed = f"a cable that is there: {cable} broke at {broken[cable]:g} s"
            raise InvalidValueError(f"event_cable[{k}]", f"{cable} at {at:g} s", allowed, STEP)
        if kind == "break":
            broken[cable] = at
        before = at
    return broken


def _check_gaps(name: str, values: Array, gone: Any) -> None:
    """There is a length, and there are nodes, exactly of the cables that have not broken."""
    missing = np.isnan(values)
    gone = gone.reshape(gone.shape + (1,) * (values.ndim - 2))
    for index in np.argwhere(missing != gone)[:1].tolist():
        k, cable = index[:2]
        there = "nan: its cable has broken" if gone[k, cable].all() else "a number: its cable has not broken"
        raise InvalidValueError(f"{name}{index}", f"{values[tuple(index)]:g}", there, STEP)


def _check_balance(data: Dataset) -> None:
    """The error is what the other energies leave."""
    names = ("kinetic_energy", "potential_energy", "energy_supplied", "energy_lost", "energy_removed", "energy_error")
    kinetic, potential, supplied, lost, removed, error = (data.variables[name].values for name in names)
    total = kinetic + potential - supplied + lost + removed
    size = max(float(np.abs(part).max()) for part in (kinetic, potential, supplied, lost, removed))
    for k in np.flatnonzero(~(np.abs(total - total[0] - error) <= ROUNDING * size))[:1].tolist():
        allowed = f"{total[k] - total[0]:g} J, what the other energies leave"
        raise InvalidValueError(f"energy_error[{k}]", f"{error[k]:g} J", allowed, STEP)
