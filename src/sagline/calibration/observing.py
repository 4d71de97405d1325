"""What readings at equilibria say of the unknowns: residuals and slopes, in arrays."""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from sagline.cables.model import CableModel
from sagline.calibration.paid import counts_of, paid_slopes
from sagline.calibration.parameters import slopes_of_values
from sagline.calibration.sensors import Sensors
from sagline.calibration.unknowns import Parameters
from sagline.core.arrays import Array, kernel_input, locked
from sagline.kernels.calibration import kinds
from sagline.kernels.calibration.observe import observe
from sagline.kernels.calibration.terms import BESIDE, Readings, SensingArrays
from sagline.kernels.forward.problem import ForwardTerms
from sagline.kernels.memory import memory_for
from sagline.robot.drum import Drums, drums_of
from sagline.robot.robot import Robot
from sagline.robot.several import anything_behind
from sagline.statics.tables import body_table, cable_table, pose_rows

BLOCK: Final = 1 << 9  # poses at once: what is said of them takes some 10 MB
NO_LOAD: Final = locked(np.zeros((1, 6)))  # nothing pulls at the platform but its cables and its weight


class Observed(NamedTuple):
    """What N equilibria tell, whitened: every row one standard deviation, independent of the others.

    R is m + 6, or m where no system measures positions or rotations.

    Attributes:
        matrix: Slopes of what the readings say by the internal parameters (logarithms where `logarithmic`), with the
            lengths following, (N, R, P); rows without a reading are zero.
        misfit: Readings less predictions, (N, R).
        residual: As they are [N, m, rad], at the lengths given, (N, m + 6); NaN for none.
        back: What a misfit changes of the true lengths [m], (N, m, R).
        motion: Of the platform about its center of mass [m, rad], world axes: by each true length, the last row by the
            step along a direction, lengths following, (N, m + 1, 6); of no rows without a direction.
    """

    matrix: Array
    misfit: Array
    residual: Array
    back: Array
    motion: Array


def locked_view(array: Array) -> Array:
    """The same numbers, write-locked, in the layout that kernels are compiled for."""
    return locked(np.ascontiguousarray(array).view())


def sensing_of(robot: Robot, sensors: Sensors) -> SensingArrays:
    """Sensors as the kernel takes them; a deviation that is None is infinite: nothing is read."""
    m, winches = robot.cable_count, robot.winches

    def spread(value: Array | None, count: int) -> Array:
        return kernel_input(np.inf if value is None else value, (count,))

    return (
        kernel_input(1.0 if winches is None else winches.load_cell_gain, (m,)),
        kernel_input(0.0 if winches is None else winches.load_cell_bias, (m,)),
        spread(sensors.tension_deviation, m),
        spread(sensors.length_deviation, m),
        spread(sensors.position_deviation, 3),
        spread(sensors.rotation_deviation, 3),
        kernel_input(pose_rows(sensors.frame)[0], (7,)),
        kernel_input(sensors.target, (3,)),
    )


def table_of_kinds(parameters: Parameters, factor: Array) -> Array:
    """A number of each parameter, spread over the table of kinds, (KIND_ROWS, m); zero where nothing is looked for."""
    table: Array = np.where(parameters.where >= 0, factor[parameters.where], 0.0)
    return locked(table)


class Machine(NamedTuple):
    """A robot with some numbers and its sensors, as the kernel takes them.

    Attributes:
        robot: The robot, whose values those of the parameters are.
        sensors: What reads.
        offset: What is to be added to lengths that the machine believes [m], (m,).
        drums: Its drums, where counts are read; else None.
        terms: Cable model, as kernels know it.
        body: body_table.
        cables: cable_table.
        sensing: The sensors, as the kernel knows them.
        slopes: How its values change with what is looked for, (P,).
    """

    robot: Robot
    sensors: Sensors
    offset: Array
    drums: Drums | None
    terms: ForwardTerms
    body: Array
    cables: Array
    sensing: SensingArrays
    slopes: Array


def machine_of(robot: Robot, model: CableModel, parameters: Parameters, sensors: Sensors, offset: Array) -> Machine:
    """A robot and its sensors as the kernel takes them.

    Args:
        robot: The robot, whose values those of the parameters are.
        model: Cable model, exact or weightless.
        parameters: What is looked for.
        sensors: What reads.
        offset: What is to be added to lengths that the machine believes [m], (m,).

    Raises:
        InvalidValueError: If counts are read, and the robot does not know its drums.
    """
    return Machine(
        robot,
        sensors,
        offset,
        drums_of(robot) if parameters.counted else None,
        (model.code, *model.parameters, anything_behind(robot) or _behind_sought(parameters) or None),
        body_table(robot),
        cable_table(robot),
        sensing_of(robot, sensors),
        slopes_of_values(robot, parameters),
    )


def _behind_sought(parameters: Parameters) -> bool:
    """Whether pulleys or dead cable are looked for: a robot that has none yet has their slopes all the same."""
    return bool((parameters.where[[kinds.RADIUS, kinds.DEAD]] >= 0).any())


def observed_rows(
    machine: Machine,
    parameters: Parameters,
    readings: Readings,
    paid: Array,
    poses: Array,
    lengths: Array,
    direction: Array | None = None,
) -> Observed:
    """What readings at equilibria say, near them to first order.

    Args:
        machine: The robot and its sensors.
        parameters: What is looked for.
        readings: What was read.
        paid: Slopes of the lengths that the winches say, (3, N, m), of `paid_slopes`.
        poses: Pose rows (N, POSE_COLUMNS), equilibria.
        lengths: All cable off the drums there [m], (N, m).
        direction: A step of the internal parameters (P,): the slopes along it alone are filled then, P = 1.

    Returns:
        What they say; NaN where the platform is not stable.
    """
    count, m = lengths.shape
    factor, width = machine.slopes, len(parameters.names)
    where = locked(np.ascontiguousarray(parameters.where).view())
    if direction is not None:
        factor, width = factor * direction, 1
        where = locked(np.minimum(where, 0))
    given = machine.sensors
    measured = given.position_deviation is not None or given.rotation_deviation is not None
    rows = m + BESIDE if measured else m
    found = Observed(
        np.empty((count, rows, width)),
        np.empty((count, rows)),
        np.empty((count, m + BESIDE)),
        np.empty((count, m, rows)),
        np.empty((0 if direction is None else count, m + 1, 6)),
    )
    observe(
        machine.terms,
        (machine.robot.freedom, machine.body, machine.cables, locked_view(lengths), locked_view(poses), NO_LOAD),
        machine.sensing,
        (
            locked_view(readings.lengths),
            locked_view(readings.cells),
            locked_view(readings.positions),
            locked_view(readings.rotations),
        ),
        (where, table_of_kinds(parameters, factor), locked_view(paid)),
        memory_for(m),
        (*found, np.empty((rows + 6, width))),
    )
    return found


def any_readings(lengths: Array) -> Readings:
    """Readings of every sensor, where slopes alone are wanted; lengths are the true ones [m], (N, m)."""
    count = len(lengths)
    aligned = np.tile([0.0, 0.0, 0.0, 1.0], (count, 1))
    return Readings(lengths, np.zeros(lengths.shape), np.zeros((count, 3)), aligned)


def observed(
    robot: Robot, model: CableModel, parameters: Parameters, sensors: Sensors, poses: Array, lengths: Array
) -> Observed:
    """What readings by these sensors at equilibria would tell: `misfit` is zero.

    Args:
        robot: The robot, whose values those of the parameters are.
        model: Cable model, exact or weightless.
        parameters: What is looked for.
        sensors: What reads; a deviation that is None reads nothing.
        poses: Pose rows (N, POSE_COLUMNS), equilibria.
        lengths: All cable off the drums there [m], (N, m).

    Returns:
        What they tell.
    """
    offset = np.zeros(robot.cable_count)
    machine = machine_of(robot, model, parameters, sensors, offset)
    counts = None if machine.drums is None else counts_of(machine.drums, lengths)
    paid = paid_slopes(robot, parameters, counts, lengths)
    rows = observed_rows(machine, parameters, any_readings(lengths), paid, poses, lengths)
    return rows._replace(misfit=np.where(np.isnan(rows.misfit), np.nan, 0.0))
