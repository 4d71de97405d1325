"""Programs of other vendors that contain sagline: `python -m benchmarks.hosts`; one core."""

from __future__ import annotations

import ctypes
import time
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import fmpy
import numpy as np
from fmpy.fmi3 import FMU3Slave

import sagline as sl
from benchmarks.measure import Row, best_of_calls, best_seconds, print_table
from sagline.robot.reach import home_pose
from tests.linuxcnc import Module, World

DURATION = 0.2  # s


def unit_of_cogiro(folder: Path) -> Any:
    """Initialized unit of co-simulation of CoGiRo, FMI 3."""
    unit = str(sl.export_fmu(sl.load_robot("cogiro"), folder / "cogiro.fmu", step=1e-3))
    given = {"modelIdentifier": "sagline", "unzipDirectory": fmpy.extract(unit, unzipdir=str(folder / "unit"))}
    fmu = FMU3Slave(guid=fmpy.read_model_description(unit).instantiationToken, instanceName="one", **given)
    fmu.instantiate()
    fmu.enterInitializationMode()
    fmu.exitInitializationMode()
    return fmu


def run(fmu: Any, period: float) -> None:
    """Simulate `DURATION` from the present state."""
    for k in range(round(DURATION / period)):
        fmu.doStep(currentCommunicationPoint=k * period, communicationStepSize=period)


def units() -> Iterator[Row]:
    """Speed of a unit of co-simulation with steps of 1 ms, and of `simulate`, in one run."""
    robot = sl.load_robot("cogiro")
    state = sl.inverse(robot, home_pose(robot)).state
    with TemporaryDirectory() as folder:
        start = time.perf_counter()
        fmu = unit_of_cogiro(Path(folder))
        yield Row("export and compilation of CoGiRo", "", f"{time.perf_counter() - start:.1f} s")
        for period in (1e-3, 1e-2):
            took = best_seconds(partial(run, fmu, period), repeats=50)
            name = f"unit of CoGiRo, called every {1e3 * period:g} ms: times real time"
            yield Row(name, "", f"{DURATION / took:.0f}")
        took = best_seconds(lambda: sl.simulate(state, duration=DURATION, step=1e-3, record=DURATION), repeats=50)
        yield Row("`simulate` with the same step: times real time", "", f"{DURATION / took:.0f}")


def modules() -> Iterator[Row]:
    """Times of a module of LinuxCNC for CoGiRo, compiled with the flags of LinuxCNC."""
    robot = sl.load_robot("cogiro")
    pose = home_pose(robot)
    lengths = sl.inverse(robot, pose).unstrained_length * 1e3
    with TemporaryDirectory() as folder:
        module = Module(robot, Path(folder))
        joints, world = np.zeros(8), World(*(1e3 * pose.position))
        inverse = partial(module.library.kinematicsInverse, ctypes.byref(world), joints.ctypes, None, None)
        yield Row("`kinematicsInverse` of CoGiRo, called by ctypes", "", f"{1e6 * best_of_calls(inverse):.1f} µs")
        forward = partial(module.library.kinematicsForward, lengths.ctypes, ctypes.byref(world), None, None)
        yield Row("`kinematicsForward` of CoGiRo, from the last pose", "", f"{1e6 * best_of_calls(forward):.1f} µs")


if __name__ == "__main__":
    print_table("Programs of other vendors that contain sagline", [units, modules])
