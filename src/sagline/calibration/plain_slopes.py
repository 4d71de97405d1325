"""Slopes of readings and poses as they are, in SI units, not whitened."""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from sagline.cables.model import CableModel
from sagline.calibration.observing import BLOCK, Machine, any_readings, machine_of, observed_rows
from sagline.calibration.paid import SLOPES, counts_of, paid_slopes
from sagline.calibration.parameters import parameters_of
from sagline.calibration.sensors import Sensors
from sagline.calibration.unknowns import Parameters, Unknown
from sagline.core.arrays import Array
from sagline.core.progress import blocks
from sagline.kernels.calibration.terms import Readings
from sagline.robot.robot import Robot

_KNOWN: Final = 1e-10  # m: of lengths that are known so well, whitening does nothing


class Slopes(NamedTuple):
    """Slopes of load cells, position and rotation, at N equilibria.

    Attributes:
        by_values: By the values of the parameters, lengths following, (N, m + 6, P).
        by_length: By the true lengths, (N, m + 6, m).
    """

    by_values: Array
    by_length: Array


def plain_slopes(
    robot: Robot,
    model: CableModel,
    parameters: Parameters,
    sensors: Sensors,
    poses: Array,
    lengths: Array,
) -> Slopes:
    """Slopes of what load cells, positions and rotations would be read.

    Args:
        robot: The robot, whose values those of the parameters are.
        model: Cable model, exact or weightless.
        parameters: The unknowns.
        sensors: Where the measuring system stands, and its target; their deviations do not matter.
        poses: Pose rows (N, POSE_COLUMNS), equilibria.
        lengths: All cable off the drums there [m], (N, m).

    Returns:
        Slopes; NaN where the platform is not stable.
    """
    count, m = lengths.shape
    machine = machine_of(robot, model, parameters, _sharp(sensors), np.zeros(m))
    by_values, by_length = np.empty((count, m + 6, len(parameters.names))), np.empty((count, m + 6, m))
    for part in blocks(count, BLOCK):
        own = lengths[part]
        counts = None if machine.drums is None else counts_of(machine.drums, own)
        paid = paid_slopes(robot, parameters, counts, own)
        rows = observed_rows(machine, parameters, any_readings(own), paid, poses[part], own)
        by_values[part] = rows.matrix / machine.slopes
        by_length[part] = np.swapaxes(rows.back, 1, 2) / _KNOWN**2
    return Slopes(by_values, by_length)


class Bench(NamedTuple):
    """A robot and its sensors, to compare readings with.

    Attributes:
        robot: The robot.
        model: Cable model.
        machine: Both with the sensors, as kernels take them.
        parameters: Something unknown, of which nothing is asked.
    """

    robot: Robot
    model: CableModel
    machine: Machine
    parameters: Parameters


def bench_of(robot: Robot, model: CableModel, sensors: Sensors) -> Bench:
    """A robot and its sensors, to compare readings with."""
    sharp = _sharp(sensors)
    parameters = parameters_of(robot, (Unknown("mass", deviation=1.0),), sharp, counted=False)
    machine = machine_of(robot, model, parameters, sharp, np.zeros(robot.cable_count))
    return Bench(robot, model, machine, parameters)


def said_at(bench: Bench, readings: Readings, pose: Array, lengths: Array) -> tuple[Array, Array]:
    """What readings miss at one equilibrium, and how they follow the true lengths.

    Args:
        bench: The robot and its sensors.
        readings: Of one row.
        pose: (1, POSE_COLUMNS).
        lengths: True lengths [m], (1, m).

    Returns:
        Readings less predictions [N, m, rad], (m + 6,), NaN for none; their slopes, (m + 6, m), zero there.
    """
    paid = np.zeros((SLOPES, 1, lengths.shape[1]))
    rows = observed_rows(bench.machine, bench.parameters, readings, paid, pose, lengths)
    return rows.residual[0], rows.back[0].T / _KNOWN**2


def _sharp(sensors: Sensors) -> Sensors:
    """Sensors of which all read, in units of their own."""
    return Sensors(_KNOWN, 1.0, 1.0, 1.0, frame=sensors.frame, target=sensors.target)
