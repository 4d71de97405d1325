"""Simulations in NetCDF: every number with its unit, where the energy went, what happened, and the robot inside."""

from __future__ import annotations

import os
from pathlib import Path as FilePath
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from sagline.core.arguments import instance
from sagline.core.arrays import locked
from sagline.core.errors import FileError
from sagline.dynamics.damping import Damping
from sagline.dynamics.drives import SecondOrder, Winches
from sagline.dynamics.simulation import EnergyBalance, Occurrence, Simulation
from sagline.files.dataset import labeled_dataset, numbered
from sagline.files.format import Format
from sagline.files.robot_file import dump_robot, parse_robot
from sagline.files.simulation_checks import EVENT_ROWS, ROWS, check_simulation, has_events
from sagline.files.simulation_layout import EVENTS, LAG, LAGGING, LARGEST, LOSSES, NO_CABLE, NODES, SAMPLES, STEP, TIME
from sagline.files.variables import Quantity
from sagline.robot.pose import Pose

if TYPE_CHECKING:
    from xarray import Dataset


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
        **_numbers(simulation, STEP),
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
