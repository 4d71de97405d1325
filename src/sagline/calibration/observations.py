"""The lengths that the winches say are off their drums, and how these follow zeros, drum radii and stiffness."""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from sagline.cables.cable import Cable
from sagline.cables.model import CableModel
from sagline.calibration.log import Sensors
from sagline.calibration.parameters import Parameters, Unknown, parameters_of, slopes_of_values
from sagline.core.arrays import Array, kernel_input, locked
from sagline.core.progress import blocks
from sagline.kernels.calibration import kinds
from sagline.kernels.calibration.observe import observe
from sagline.kernels.calibration.terms import BESIDE, Readings, SensingArrays
from sagline.kernels.forward.problem import ForwardTerms
from sagline.kernels.memory import memory_for
from sagline.robot.drum import Drums, drums_of
from sagline.robot.robot import Robot
from sagline.robot.several import anything_behind
from sagline.robot.winch import Winch
from sagline.statics.tables import body_table, cable_table, pose_rows

STEP = 1e-4  # of a drum radius or a zero, for differences: lengths are all but linear in both, but for a slanted exit
SLOPES = 3  # by length_zero, drum_radius and axial_stiffness, in the order of `kernels.calibration.observe`


def lengths_at_counts(drums: Drums, counts: Array) -> Array:
    """Unstrained lengths off the drums at counts [m], both of shape (N, m).

    Raises:
        InvalidValueError: If the winches lack what is needed, or counts run off a drum; the message names it.
    """
    lengths: Array = drums.lengths_at(counts) / (1.0 + drums.rest_strain)
    return lengths


def has_drum_data(robot: Robot) -> bool:
    """Whether a robot's winches know enough to tell lengths from counts."""
    winches = robot.winches
    known = winches is not None and winches.drum_radius is not None and winches.groove_pitch is not None
    return winches is not None and known and winches.counts_per_turn is not None and winches.length_zero is not None


def counts_of(drums: Drums, lengths: Array) -> Array:
    """Counts, not rounded, at unstrained lengths off the drums [m], both of shape (N, m).

    Raises:
        InvalidValueError: As of `paid_out`.
    """
    return drums.counts(lengths * (1.0 + drums.rest_strain))


def winch_slopes(robot: Robot, parameters: Parameters, counts: Array | None, lengths: Array) -> Array:
    """How lengths that the winches say follow the winches' data.

    Args:
        robot: The robot.
        parameters: What is looked for; slopes by drum_radius are zero where that is not.
        counts: What they follow from, (N, m); None where lengths are read.
        lengths: The lengths [m], (N, m).

    Returns:
        By length_zero, by drum_radius, by axial_stiffness [m/N], (3, N, m).
    """
    slopes = np.zeros((SLOPES, *lengths.shape))
    if counts is None or robot.winches is None:
        slopes[0] = 1.0
        return slopes
    drum = bool((parameters.where[kinds.DRUM] >= 0).any())
    winches, stiffness = robot.winches, robot.cables.axial_stiffness
    strain = winches.winding_tension / stiffness
    slopes[2] = lengths * strain / (stiffness * (1.0 + strain))
    if winches.drum_distance is None and (winches.layers == 1.0).all():  # every turn is as long as the others
        slopes[0] = 1.0 / (1.0 + strain)
        if drum:
            slopes[1] = _turns_let_out(winches, counts) * _turn_slope(robot, winches) / (1.0 + strain)
        return slopes
    slopes[0] = _difference(robot, winches, counts, "length_zero")
    if drum:
        slopes[1] = _difference(robot, winches, counts, "drum_radius")
    return slopes


def _turns_let_out(winches: Winch, counts: Array) -> Array:
    """Since the zero of the counts, (N, m)."""
    per_turn = _given(winches, "counts_per_turn")
    turns: Array = (counts - winches.count_zero) / (winches.gear * per_turn)
    return turns


def _turn_slope(robot: Robot, winches: Winch) -> Array:
    """How the length of a turn, a helix, follows the radius of its drum, (m,)."""
    circle = 2.0 * np.pi * (_given(winches, "drum_radius") + 0.5 * _given(robot.cables, "diameter"))
    slope: Array = 2.0 * np.pi * circle / np.hypot(circle, _given(winches, "groove_pitch"))
    return slope


def _difference(robot: Robot, winches: Winch, counts: Array, name: str) -> Array:
    value = _given(winches, name)
    step = STEP * value
    low, high = (
        lengths_at_counts(drums_of(robot.replace(winches=winches.replace(**{name: value + sign * step}))), counts)
        for sign in (-1.0, 1.0)
    )
    slope: Array = (high - low) / (2.0 * step)
    return slope


def _given(of: Winch | Cable, name: str) -> Array:
    """A field that `drums_of` has found to be there."""
    value: Array = getattr(of, name)
    return value


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


def sensor_arrays(robot: Robot, sensors: Sensors) -> SensingArrays:
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
        (model.code, *model.parameters, anything_behind(robot) or _seeks_routing(parameters) or None),
        body_table(robot),
        cable_table(robot),
        sensor_arrays(robot, sensors),
        slopes_of_values(robot, parameters),
    )


def _seeks_routing(parameters: Parameters) -> bool:
    """Whether pulleys or dead cable are looked for: a robot that has none yet has their slopes all the same."""
    return bool((parameters.where[[kinds.RADIUS, kinds.DEAD]] >= 0).any())


def whitened_rows(
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


def placeholder_readings(lengths: Array) -> Readings:
    """Readings of every sensor, where slopes alone are wanted; lengths are the true ones [m], (N, m)."""
    count = len(lengths)
    aligned = np.tile([0.0, 0.0, 0.0, 1.0], (count, 1))
    return Readings(lengths, np.zeros(lengths.shape), np.zeros((count, 3)), aligned)


def predicted_rows(
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
    paid = winch_slopes(robot, parameters, counts, lengths)
    rows = whitened_rows(machine, parameters, placeholder_readings(lengths), paid, poses, lengths)
    return rows._replace(misfit=np.where(np.isnan(rows.misfit), np.nan, 0.0))


_KNOWN: Final = 1e-10  # m: of lengths that are known so well, whitening does nothing


class Slopes(NamedTuple):
    """Slopes of load cells, position and rotation, at N equilibria.

    Attributes:
        by_values: By the values of the parameters, lengths following, (N, m + 6, P).
        by_length: By the true lengths, (N, m + 6, m).
    """

    by_values: Array
    by_length: Array


def unwhitened_slopes(
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
        paid = winch_slopes(robot, parameters, counts, own)
        rows = whitened_rows(machine, parameters, placeholder_readings(own), paid, poses[part], own)
        by_values[part] = rows.matrix / machine.slopes
        by_length[part] = np.swapaxes(rows.back, 1, 2) / _KNOWN**2
    return Slopes(by_values, by_length)


class Reference(NamedTuple):
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


def reference_of(robot: Robot, model: CableModel, sensors: Sensors) -> Reference:
    """A robot and its sensors, to compare readings with."""
    sharp = _sharp(sensors)
    parameters = parameters_of(robot, (Unknown("mass", deviation=1.0),), sharp, counted=False)
    machine = machine_of(robot, model, parameters, sharp, np.zeros(robot.cable_count))
    return Reference(robot, model, machine, parameters)


def misfit_at(bench: Reference, readings: Readings, pose: Array, lengths: Array) -> tuple[Array, Array]:
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
    rows = whitened_rows(bench.machine, bench.parameters, readings, paid, pose, lengths)
    return rows.residual[0], rows.back[0].T / _KNOWN**2


def _sharp(sensors: Sensors) -> Sensors:
    """Sensors of which all read, in units of their own."""
    return Sensors(_KNOWN, 1.0, 1.0, 1.0, frame=sensors.frame, target=sensors.target)
