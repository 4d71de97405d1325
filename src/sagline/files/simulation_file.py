"""Simulations in NetCDF: every number with its unit, where the energy went, what happened, and the robot inside."""

from __future__ import annotations

import os
from pathlib import Path as FilePath
from typing import TYPE_CHECKING, Any

import numpy as np

from sagline.arguments import file_path, instance
from sagline.arrays import locked
from sagline.dynamics.damping import Damping
from sagline.dynamics.drives import SecondOrder, Winches
from sagline.dynamics.simulation import EnergyBalance, Occurrence, Simulation
from sagline.errors import FileError
from sagline.files.content import Content
from sagline.files.dataset import read_dataset, told_of, write_dataset
from sagline.files.robot_file import dump_robot, parse_robot
from sagline.files.simulation_checks import EVENT_ROWS, ROWS, check_simulation, has_events
from sagline.files.simulation_layout import EVENTS, LAG, LAGGING, LARGEST, LOSSES, NO_CABLE, NODES, SAMPLES, STEP, TIME
from sagline.files.variables import PARTS, Quantity
from sagline.robot.pose import Pose
from sagline.robot.robot import Robot

if TYPE_CHECKING:
    from xarray import Dataset

CONTENT = Content(
    name="simulation",
    made="simulation of sagline",
    give="Give the .nc file that a simulation's save wrote.",
    again="Save the simulation again, or take the file from where it came.",
    key="sagline_simulation_format",
    format=1,
)


def save_simulation(simulation: Simulation, file: os.PathLike[str] | str) -> None:
    """Write a simulation to a NetCDF file, whole or not at all.

    Dimensions are time, cable, node (of cables with mass) and event (where something happened). A digest over all
    values and attributes stands at the end, behind what NetCDF reads, and shows when anything has changed.

    Args:
        simulation: The simulation.
        file: The file, "sim.nc" for instance; a regular file that exists is replaced, anything else is refused.

    Raises:
        InvalidValueError: If its values are none that `simulate` gives.
        FileError: If the file cannot be written; what was there before is untouched.
    """
    data = _dataset(instance(simulation, Simulation, "simulation"))
    check_simulation(data, simulation.robot.cable_count)
    write_dataset(data, file_path(file))


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
    path = file_path(file)
    data, found = read_dataset(path, CONTENT)
    CONTENT.format_of(path, data.attrs)
    CONTENT.check_sealed(path, found)
    with told_of(path):
        return _simulation(path, data, parse_robot(str(data.attrs["robot"]), f"{path}, robot"))


def _dataset(simulation: Simulation) -> Dataset:
    from xarray import Coordinates, Dataset

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
    used = {part for quantity in quantities for part in quantity.parts} & PARTS.keys()
    coordinates: dict[str, Any] = {part: (part, list(PARTS[part])) for part in sorted(used)}
    cables = np.arange(simulation.robot.cable_count)
    coordinates["cable"] = ("cable", cables, {"long_name": "cable, counted from 0"})
    coordinates[TIME.name] = (ROWS, TIME.of(simulation), TIME.attributes)
    labels = Coordinates(coordinates, indexes={})  # whoever reads the file builds what indexes they need
    return Dataset(variables, labels, _attributes(simulation))


def _written(value: Any) -> Any:
    return NO_CABLE if value is None else value


def _attributes(simulation: Simulation) -> dict[str, Any]:
    return {
        **CONTENT.attributes(f"Motion of {simulation.robot.name} in time"),
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


def _simulation(path: FilePath, data: Dataset, robot: Robot) -> Simulation:
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
