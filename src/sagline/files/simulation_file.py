"""Simulations in NetCDF: every quantity with its unit, the energy balance, the events, and the robot inside."""

from __future__ import annotations

import os
from pathlib import Path as FilePath
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from sagline.core.arguments import choice, instance
from sagline.core.arrays import Array, locked, number
from sagline.core.errors import FileError, InvalidValueError
from sagline.dynamics.damping import Damping
from sagline.dynamics.drives import SecondOrder, Winches
from sagline.dynamics.simulation import EnergyBalance, Occurrence, Simulation
from sagline.files.format import Format
from sagline.files.netcdf import labeled_dataset, numbered
from sagline.files.robot_file import dump_robot, parse_robot
from sagline.files.variables import STEP, Known, Quantity, check_labels, check_variable
from sagline.robot.pose import Pose

if TYPE_CHECKING:
    from xarray import Dataset

TIME: Final = Quantity("time", "time", (), "s", "time")
# of every sample; a cable that broke has no length any more, and no nodes
SAMPLES: Final = (
    Quantity("position", "pose.position", ("axis",), "m", "position of the platform origin in the world"),
    Quantity(
        "quaternion", "pose.quaternion", ("quaternion_part",), "1", "rotation from platform to world, scalar last"
    ),
    Quantity("twist", "twist", ("twist_part",), "m/s, rad/s", "velocity of the platform origin, angular velocity"),
    Quantity("tensions", "tensions", ("cable",), "N", "tension at the frame end", low=0.0),
    Quantity(
        "length",
        "length",
        ("cable",),
        "m",
        "unstrained length off the drum; none once broken",
        known=Known.SOMEWHERE,
        low=0.0,
    ),
    Quantity("kinetic_energy", "energy.kinetic", (), "J", "kinetic energy", low=0.0),
    Quantity("potential_energy", "energy.potential", (), "J", "energy of weight and strain"),
    Quantity("energy_supplied", "energy.supplied", (), "J", "work done on the robot since the start"),
    Quantity("energy_lost", "energy.lost", (), "J", "work of damping and friction since the start"),
    Quantity("energy_removed", "energy.removed", (), "J", "energy that left with broken cables and dropped loads"),
    Quantity("energy_error", "energy.error", (), "J", "what the integrator has invented since the start"),
)
# of every cable, where it is known
LARGEST: Final = Quantity(
    "largest_tension", "largest_tension", ("cable",), "N", "largest tension at the frame end at any step", low=0.0
)
# of cables with mass
NODES: Final = Quantity(
    "node_position",
    "nodes",
    ("cable", "node", "axis"),
    "m",
    "position of the cables at their nodes",
    known=Known.SOMEWHERE,
)
# one a row of what happened; a place is that of one occurrence
EVENTS: Final = (
    Quantity("event_time", "time", (), "s", "when it happened"),
    Quantity("event_kind", "kind", (), "", "what happened", values=str),
    Quantity("event_cable", "cable", (), "", "which cable or winch, counted from 0; -1 for the platform", values=int),
    Quantity(
        "event_tension_before", "tension_before", (), "N", "largest tension before it", known=Known.SOMEWHERE, low=0.0
    ),
    Quantity(
        "event_tension_after", "tension_after", (), "N", "largest tension after it", known=Known.SOMEWHERE, low=0.0
    ),
)
NO_CABLE: Final = -1
CABLE_MASS: Final = ("none", "lumped", "modal")
INTEGRATORS: Final = ("splitting", "runge-kutta", "exact")
WINDINGS: Final = ("constant", "remembered")
LAGGING: Final = "second-order"
WINCHES: Final = ("ideal", "robot", LAGGING)
# attributes that are numbers, and their units
STEP_UNIT: Final = {"step": "s"}
LAG: Final = {"bandwidth": "Hz", "damping_ratio": "1"}
LOSSES: Final = {"loss_time": "s", "air_damping": "N s/m^2", "modal_damping": "1"}
# what happens to a cable or winch, to the platform, and to either
OF_CABLES: Final = ("break", "stall", "saturate", "slack")
OF_PLATFORM: Final = ("drop", "pick up")
OF_EITHER: Final = ("brake",)


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


def load_simulation(file: os.PathLike[str] | str) -> Simulation:
    """Read a simulation that its `save` wrote: the same simulation to the last bit.

    Args:
        file: The NetCDF file.

    Returns:
        The simulation.

    Raises:
        FileError: If the file is missing, cut off, no NetCDF file, no simulation, of a newer format, or not as it was
            written: its digest, shapes, units and signs are checked.
    """
    return FORMAT.load(file)


def pack(simulation: Simulation) -> Dataset:
    """Data set of a simulation, with the dimensions time, cable, node (cables with mass) and event."""
    quantities = SAMPLES if simulation.nodes is None else (*SAMPLES, NODES)
    variables: dict[str, Any] = {
        quantity.name: ((ROWS, *quantity.parts), quantity.of(simulation), quantity.attributes)
        for quantity in quantities
    }
    if simulation.largest_tension is not None:
        variables[LARGEST.name] = (LARGEST.parts, LARGEST.of(simulation), LARGEST.attributes)
    for quantity in EVENTS if simulation.events else ():
        values = [_written(quantity.of(event)) for event in simulation.events]
        variables[quantity.name] = (EVENT_ROWS, np.array(values, dtype=quantity.type), quantity.attributes)
    coordinates = {
        "cable": numbered("cable", simulation.robot.cable_count),
        TIME.name: (ROWS, TIME.of(simulation), TIME.attributes),
    }
    data = labeled_dataset(variables, _attributes(simulation), coordinates)
    check_simulation(data, simulation.robot.cable_count)
    return data


def _written(value: Any) -> Any:
    return NO_CABLE if value is None else value


def _attributes(simulation: Simulation) -> dict[str, Any]:
    return {
        **FORMAT.attributes(f"Motion of {simulation.robot.name} in time"),
        "cable_mass": simulation.cable_mass,
        "integrator": simulation.integrator,
        **_numbers(simulation, STEP_UNIT),
        **_of_winches(simulation.winches),
        "winding": simulation.winding,
        **_numbers(instance(simulation.damping, Damping, "damping"), LOSSES),
        "robot": dump_robot(simulation.robot),
    }


def _numbers(source: Any, units: dict[str, str]) -> dict[str, Any]:
    """Attributes that are numbers, each followed by its unit."""
    found: dict[str, Any] = {}
    for name, unit in units.items():
        found |= {name: float(getattr(source, name)), f"{name}_units": unit}
    return found


def _of_winches(winches: Winches) -> dict[str, Any]:
    if isinstance(winches, SecondOrder):
        return {"winches": LAGGING, **_numbers(winches, LAG)}
    return {"winches": winches}


def _winches(attributes: Any) -> Winches:
    if attributes["winches"] == LAGGING:
        return SecondOrder(**{name: float(attributes[name]) for name in LAG})
    kind: Winches = attributes["winches"]
    return kind


def unpack(path: FilePath, data: Dataset) -> Simulation:
    """The simulation of a data set; its path is for messages."""
    robot = parse_robot(str(data.attrs["robot"]), f"{path}, robot")
    if data.sizes["cable"] != robot.cable_count:
        reason = f"has {data.sizes['cable']} cables, its robot {robot.cable_count}"
        raise FileError(path, reason, "Write it again.", item="cable")
    check_simulation(data, robot.cable_count)

    def values(quantity: Quantity) -> Any:
        return locked(np.asarray(data[quantity.name].values, order="C"))

    found = {quantity.place: values(quantity) for quantity in (TIME, *SAMPLES)}
    energy = {place.removeprefix("energy."): found.pop(place) for place in list(found) if place.startswith("energy.")}
    events = _occurrences(data) if has_events(data) else ()
    return Simulation(
        robot=robot,
        pose=Pose.from_quaternion(found.pop("pose.position"), found.pop("pose.quaternion")),
        **found,
        energy=EnergyBalance(**energy),
        events=events,
        cable_mass=data.attrs["cable_mass"],
        step=float(data.attrs["step"]),
        nodes=values(NODES) if NODES.name in data.variables else None,
        integrator=data.attrs["integrator"],
        winches=_winches(data.attrs),
        winding=data.attrs["winding"],
        damping=Damping(**{name: float(data.attrs[name]) for name in LOSSES}),
        largest_tension=values(LARGEST) if LARGEST.name in data.variables else None,
    )


def _occurrences(data: Dataset) -> tuple[Occurrence, ...]:
    columns = {quantity.place: data.variables[quantity.name].values.tolist() for quantity in EVENTS}
    columns["cable"] = [None if cable == NO_CABLE else cable for cable in columns["cable"]]
    return tuple(Occurrence(**dict(zip(columns, row, strict=True))) for row in zip(*columns.values(), strict=True))


FORMAT: Final = Format(
    kind=Simulation,
    name="simulation",
    made="simulation of sagline",
    give="Give the .nc file that a simulation's save wrote.",
    again="Save the simulation again, or take the file from where it came.",
    key="sagline_simulation_format",
    version=1,
    pack=pack,
    unpack=unpack,
)
save = FORMAT.save
