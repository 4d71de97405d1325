"""Simulations and frequency maps in NetCDF: every quantity with its unit, events, and the robot."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path as FilePath
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from sagline.core.arguments import choice, instance
from sagline.core.arrays import Array, number, refuse_first
from sagline.core.errors import InvalidValueError
from sagline.dynamics.simulation.results import EnergyBalance, Occurrence, Simulation
from sagline.dynamics.simulation.winches import SecondOrder
from sagline.dynamics.vibration.dynamic_stiffness import Damping
from sagline.dynamics.vibration.frequency_map import FrequencyMap
from sagline.dynamics.vibration.vibration import VibrationStatus
from sagline.files import variables as v
from sagline.files.netcdf import Format, index_coordinate, robot_of
from sagline.files.variables import NONE, SOMEWHERE, STEP, Quantity
from sagline.robot.pose import Pose

if TYPE_CHECKING:
    from xarray import Dataset

TURN: Final = ("quaternion_part",)
TIME: Final = Quantity("time", (), "s", "time")
# variables of every sample; a broken cable has no length, and no nodes between its pieces
SAMPLES: Final = (
    Quantity("position", ("axis",), "m", "position of the platform origin in the world", "pose.position"),
    Quantity("quaternion", TURN, "1", "rotation from platform to world, scalar last", "pose.quaternion"),
    Quantity("twist", ("twist_part",), "m/s, rad/s", "velocity of the platform origin, angular velocity"),
    Quantity("tensions", ("cable",), "N", "tension at the frame end", low=0.0),
    Quantity("length", ("cable",), "m", "unstrained length off the drum; none once broken", known=SOMEWHERE, low=0.0),
    Quantity("kinetic_energy", (), "J", "kinetic energy", "energy.kinetic", low=0.0),
    Quantity("potential_energy", (), "J", "energy of weight and strain", "energy.potential"),
    Quantity("energy_supplied", (), "J", "work done on the robot since the start", "energy.supplied"),
    Quantity("energy_lost", (), "J", "work of damping and friction since the start", "energy.lost"),
    Quantity("energy_removed", (), "J", "energy of broken cables and dropped loads", "energy.removed"),
    Quantity("energy_error", (), "J", "error of the integrator since the start", "energy.error"),
)
# one value per cable, in files that contain it
LARGEST: Final = Quantity("largest_tension", ("cable",), "N", "largest tension at the frame end at any step", low=0.0)
# variables of cables with mass
NODE: Final = ("cable", "node", "axis")
NODES: Final = Quantity("node_position", NODE, "m", "position of the cables at their nodes", "nodes", SOMEWHERE)
# variables of each event, which are the attributes of `Occurrence`
EVENT: Final = ("event",)
INDEX: Final = "index of the cable or winch, from 0; -1 for the platform"
EVENTS: Final = (
    Quantity("event_time", EVENT, "s", "time of the event", "time"),
    Quantity("event_kind", EVENT, "", "kind of the event", "kind", values=str),
    Quantity("event_cable", EVENT, "", INDEX, "cable", SOMEWHERE, values=int),
    Quantity("event_tension_before", EVENT, "N", "largest tension before the event", "tension_before", SOMEWHERE, 0.0),
    Quantity("event_tension_after", EVENT, "N", "largest tension after the event", "tension_after", SOMEWHERE, 0.0),
    Quantity("event_limit", EVENT, "", "active limits of the drive", "limit", SOMEWHERE, values=str),
)
LIMITS: Final = ("", "torque", "speed", "torque and speed")
CABLE_MASS: Final = ("none", "lumped", "modal")
INTEGRATORS: Final = ("splitting", "runge-kutta", "exact")
WINDINGS: Final = ("constant", "remembered")
LAGGING: Final = "second-order"
WINCHES: Final = ("ideal", "robot", LAGGING)
# numeric attributes and their units
LAG: Final = {"bandwidth": "Hz", "damping_ratio": "1"}
LOSSES: Final = {"loss_time": "s", "air_damping": "N s/m^2", "modal_damping": "1"}
# kinds of events of a cable or winch, kinds of events of the platform, and all kinds
OF_CABLES: Final = ("break", "stall", "saturate", "slack")
OF_PLATFORM: Final = ("drop", "pick up")
OF_EITHER: Final = ("brake",)


ROWS: Final = "time"
ROUNDING: Final = 1e-12  # tolerance of energies, as a share of the largest energy


def _check_simulation(data: Dataset, cables: int) -> None:
    """Refuse a data set that is not a simulation of a robot with this number of cables."""
    _check_settings(data.attrs)
    time = data.variables[TIME.name].values
    sizes = {"cable": cables, ROWS: time.size, **{name: data.sizes.get(name, 0) for name in ("node", "event")}}
    nodes = (NODES,) if NODES.name in data.variables else ()
    v.check_variables(data, (TIME, *SAMPLES, *nodes), sizes, (ROWS,))
    v.check_anchors(data, cables)
    if LARGEST.name in data.variables:
        v.check_variables(data, (LARGEST,), sizes)
    _check_times(time)
    if bool(nodes) != (data.attrs["cable_mass"] != "none"):
        allowed = "given for cables with mass only"
        raise InvalidValueError(NODES.name, "given" if nodes else "not given", allowed, STEP)
    broken = np.full(cables, np.inf)
    if _has_events(data):
        v.check_variables(data, _event_variables(data), sizes)
        broken = _check_events(data, time, cables)
    for name in ("length", *(one.name for one in nodes)):
        _check_gaps(name, data.variables[name].values, time[:, None] > broken)
    _check_balance(data)


def _event_variables(data: Dataset) -> list[Quantity]:
    """Variables of the events. Limits of drives are missing in older files, and in files without such events."""
    return [one for one in EVENTS if one.place != "limit" or one.name in data.variables]


def _has_events(data: Dataset) -> bool:
    return any(quantity.name in data.variables for quantity in EVENTS)


def _check_settings(attributes: Any) -> None:
    kinds = {"cable_mass": CABLE_MASS, "integrator": INTEGRATORS, "winches": WINCHES, "winding": WINDINGS}
    for name, allowed in kinds.items():
        choice(attributes[name], name, allowed)
    number(attributes["step"], "step", "s", above=0.0)
    for name in (*LOSSES, *(LAG if attributes["winches"] == LAGGING else ())):
        number(attributes[name], name, "", low=0.0)
    if (attributes["cable_mass"] == "modal") != (attributes["integrator"] == "exact"):
        found = f"{attributes['integrator']} for cable_mass {attributes['cable_mass']}"
        raise InvalidValueError("integrator", found, "exact with modal only", STEP)


def _check_times(time: Array) -> None:
    if time.size < 2:
        raise InvalidValueError("time", f"of {time.size} samples", "at least the start and the end", STEP)
    late = np.append(False, ~(np.diff(time) > 0.0))
    refuse_first(late, "time", time, "s", "> {limit:g} s", STEP, np.roll(time, 1))


def _check_events(data: Dataset, time: Array, cables: int) -> Array:
    """Check the events, and return the time at which each cable breaks [s]; infinite if it does not break."""
    columns = (data.variables[f"event_{name}"].values.tolist() for name in ("time", "kind", "cable"))
    before, broken = float(time[0]), np.full(cables, np.inf)
    for k, (at, kind, cable) in enumerate(zip(*columns, strict=True)):
        choice(kind, f"event_kind[{k}]", (*OF_CABLES, *OF_PLATFORM, *OF_EITHER))
        if not before <= at <= time[-1]:
            allowed = f"{before:g} to {time[-1]:g} s, in order"
            raise InvalidValueError(f"event_time[{k}]", f"{at:g} s", allowed, STEP)
        low = 0 if kind in OF_CABLES else NONE
        high = NONE if kind in OF_PLATFORM else cables - 1
        if not low <= cable <= high:
            allowed = f"{low} to {high} for {kind!r}" if low < high else f"{low} for {kind!r}"
            raise InvalidValueError(f"event_cable[{k}]", cable, allowed, STEP)
        again = kind == "break" and data.attrs["cable_mass"] == "lumped"  # a piece of a broken cable can break
        if cable != NONE and broken[cable] < np.inf and not again:
            allowed = f"an unbroken cable: {cable} broke at {broken[cable]:g} s"
            raise InvalidValueError(f"event_cable[{k}]", f"{cable} at {at:g} s", allowed, STEP)
        if kind == "break":
            broken[cable] = min(broken[cable], at)
        before = at
    for k, limit in enumerate(data.variables["event_limit"].values if "event_limit" in data.variables else ()):
        choice(limit, f"event_limit[{k}]", LIMITS)
    return broken


def _check_gaps(name: str, values: Array, gone: Any) -> None:
    """Refuse lengths of broken cables, and missing values of intact cables; `gone`: flags (samples, cables)."""
    missing = np.isnan(values)
    gone = gone.reshape(gone.shape + (1,) * (values.ndim - 2))
    wrong = missing != gone
    if values.ndim > 2:  # a broken cable has nodes, except between its pieces
        wrong &= ~gone | missing.any(axis=-1, keepdims=True)
    for index in np.argwhere(wrong)[:1].tolist():
        k, cable = index[:2]
        there = "nan: its cable has broken" if gone[k, cable].all() else "a number: its cable has not broken"
        raise InvalidValueError(f"{name}{index}", f"{values[tuple(index)]:g}", there, STEP)


def _check_balance(data: Dataset) -> None:
    names = ("kinetic_energy", "potential_energy", "energy_supplied", "energy_lost", "energy_removed", "energy_error")
    kinetic, potential, supplied, lost, removed, error = (data.variables[name].values for name in names)
    total = kinetic + potential - supplied + lost + removed
    size = max(float(np.abs(part).max()) for part in (kinetic, potential, supplied, lost, removed))
    for k in np.flatnonzero(~(np.abs(total - total[0] - error) <= ROUNDING * size))[:1].tolist():
        allowed = f"{total[k] - total[0]:g} J, from the other energies"
        raise InvalidValueError(f"energy_error[{k}]", f"{error[k]:g} J", allowed, STEP)


def load_simulation(file: os.PathLike[str] | str) -> Simulation:
    """Read a simulation from a file of `Simulation.save`; all numbers are restored exactly.

    Args:
        file: The NetCDF file.

    Returns:
        The simulation.

    Raises:
        FileError: If the file is missing, not a simulation, of a newer format, or changed after it was written.

    Examples:
        >>> import sagline as sl
        >>> robot = sl.load_robot("cogiro")
        >>> pose = sl.Pose((1.0, 0.5, 2.0))
        >>> motion = sl.simulate(sl.inverse(robot, pose).state, duration=0.5)
        >>> motion.save("motion.nc")
        >>> sl.load_simulation("motion.nc").robot.cable_count
        8
    """
    return FORMAT.load(file)


def _attributes_with_units(source: Any, units: Mapping[str, str | None]) -> dict[str, Any]:
    """Numeric attributes of `source`. An attribute with the unit follows each attribute whose unit is not None."""
    found: dict[str, Any] = {}
    for name, unit in units.items():
        found |= {name: float(getattr(source, name)), **({} if unit is None else {f"{name}_units": unit})}
    return found


def _pack(simulation: Simulation) -> Dataset:
    """Create the data set of a simulation. Dimensions: time, cable and event; for cables with mass, node."""
    variables = v.variables_of_result(simulation, (*SAMPLES, NODES), (ROWS,)) | v.variables_of_result(
        simulation, (LARGEST, *v.ANCHORS)
    )
    if simulation.events:
        some = any(event.limit for event in simulation.events)
        variables |= v.record_variables(simulation.events, EVENTS if some else EVENTS[:-1])
    cables = simulation.robot.cable_count
    coordinates = {"cable": index_coordinate("cable", cables), **v.variables_of_result(simulation, (TIME,), (ROWS,))}
    winches = simulation.winches
    lagging = isinstance(winches, SecondOrder)
    attributes = {
        "cable_mass": simulation.cable_mass,
        "integrator": simulation.integrator,
        **_attributes_with_units(simulation, {"step": "s"}),
        **({"winches": LAGGING, **_attributes_with_units(winches, LAG)} if lagging else {"winches": winches}),
        "winding": simulation.winding,
        FORMAT.key: FORMAT.version - (simulation.anchors is None),
        **_attributes_with_units(instance(simulation.damping, Damping, "damping"), LOSSES),
    }
    robot = simulation.robot
    data = FORMAT.dataset(f"Motion of {robot.name} in time", robot, attributes, variables, coordinates)
    _check_simulation(data, cables)
    return data


def _unpack(path: FilePath, data: Dataset) -> Simulation:
    robot = robot_of(path, data)
    _check_simulation(data, robot.cable_count)
    attributes, found = data.attrs, v.fields_of(data, (TIME, *SAMPLES, NODES, LARGEST))
    winches: Any = attributes["winches"]
    if winches == LAGGING:
        winches = SecondOrder(**{name: float(attributes[name]) for name in LAG})
    settings = {name: attributes[name] for name in ("cable_mass", "integrator", "winding")}
    events = v.records_of(data, _event_variables(data)) if _has_events(data) else ()
    return Simulation(
        robot=robot,
        pose=Pose.from_quaternion(**found.pop("pose")),
        energy=EnergyBalance(**found.pop("energy")),
        events=tuple(Occurrence(**row) for row in events),
        step=float(attributes["step"]),
        winches=winches,
        damping=Damping(**{name: float(attributes[name]) for name in LOSSES}),
        anchors=v.anchors_of(data),
        **settings,
        **found,
    )


FORMAT: Final = Format(
    kind=Simulation,
    name="simulation",
    made="simulation of sagline",
    give="Give a .nc file of Simulation.save.",
    again="Save the simulation again, or get the original file.",
    key="sagline_simulation_format",
    version=2,  # version 2 added moving anchors, which other simulations do not need
    pack=_pack,
    unpack=_unpack,
)


FREQUENCIES: Final = (
    Quantity("position", ("axis",), "m", "position of the platform origin in the world", "pose.position"),
    Quantity("quaternion", ("quaternion_part",), "1", "rotation from platform to world", "pose.quaternion"),
    Quantity("status", (), "", "status of the vibration analysis", codes=VibrationStatus),
    Quantity("frequency", (), "Hz", "lowest frequency with cable mass", known=SOMEWHERE),
    Quantity("massless_frequency", (), "Hz", "lowest frequency, massless cables"),
    Quantity("platform_share", (), "1", "platform's share of the lowest mode with cable mass"),
    Quantity("peak", (), "m/N", "largest response to a force, with cable mass"),
    Quantity("peak_frequency", (), "Hz", "frequency of the largest response"),
)


def _pack_frequencies(found: FrequencyMap) -> Dataset:
    attributes = _attributes_with_units(found, {"up_to": "Hz"})
    attributes |= _attributes_with_units(
        found.damping, {"loss_time": "s", "air_damping": "N s/m2", "modal_damping": None}
    )
    variables = v.variables_of_result(found, FREQUENCIES, ("pose",))
    return FREQUENCY_MAP.dataset(f"Frequencies of {found.robot.name} over poses", found.robot, attributes, variables)


FREQUENCY_MAP: Final = Format(
    kind=FrequencyMap,
    name="map of frequencies",
    made="map of sagline",
    give="Give a .nc file that the save method of a map wrote.",
    again="Make the map again, or get the original file.",
    key="sagline_frequency_map_format",
    pack=_pack_frequencies,
)
