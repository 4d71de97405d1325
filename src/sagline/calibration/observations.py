"""Predicted readings at equilibria, residuals, derivatives by the parameters, and lengths at encoder counts."""

from __future__ import annotations

from copy import copy
from dataclasses import replace
from typing import Final, NamedTuple

import numpy as np

from sagline.cables.cable import Cable
from sagline.cables.model import CableModel
from sagline.calibration.further import frequency_rows, swivel_rows, whitened_further
from sagline.calibration.log import Sensors, WinchLog, load_cells_of, measures_yaw, reading_deviations
from sagline.calibration.parameters import Parameters, slopes_of_values
from sagline.core.arrays import Array, blocks, kernel_input, locked
from sagline.kernels import tables
from sagline.kernels.calibration import kinds
from sagline.kernels.calibration.observe import SWIVEL_NUMBERS, observe, swivel_readings
from sagline.kernels.calibration.terms import BESIDE, PoseReadings, SensingArrays
from sagline.kernels.forward.platform import ForwardTerms
from sagline.kernels.memory import memory_for
from sagline.robot.batch import has_routing, refuse_slanted
from sagline.robot.drum import Drums
from sagline.robot.robot import Robot
from sagline.robot.winch import Winch
from sagline.statics.tables import body_table, cable_table, pose_rows, slanted_rows

STEP: Final = 1e-4  # relative step of a drum radius or length zero for difference quotients; lengths are nearly linear
# length_zero, drum_radius, axial_stiffness, length_scale and clock_offset, as in `kernels.calibration.observe`
SLOPES: Final = 5
LENGTH_KINDS: Final = (kinds.ZERO, kinds.DRUM, kinds.STIFFNESS, kinds.SCALE, kinds.CLOCK)  # the same as rows of `kinds`
FREQUENCY_STEP: Final = 1e-5  # step of difference quotients of frequencies, relative to deviations of unknown values
BLOCK: Final = 1 << 9  # number of poses per kernel call; its work arrays take about 10 MB
EXACT: Final = 1e-10  # [m], standard deviation of lengths that is too small to affect the whitening
POSE_SENSORS: Final = Sensors(EXACT, 1.0, 1.0, 1.0)  # pose of the platform in the world, with deviations of 1
NO_LOAD: Final = locked(np.zeros((1, 6)))  # no external wrench: only cable forces and weight act on the platform


def lengths_at_counts(drums: Drums, counts: Array) -> Array:
    """Unstrained lengths off the drums [m], shape (N, m), from counts of the same shape."""
    return np.asarray(drums.lengths_at(counts) / (1.0 + drums.rest_strain))


def counts_at(drums: Drums, lengths: Array) -> Array:
    """Counts (not rounded) at unstrained lengths off the drums [m], both (N, m)."""
    return drums.counts(lengths * (1.0 + drums.rest_strain))


def _known_field(of: Winch | Cable, name: str) -> Array:
    """Value of a field of the winches; `Drums` has checked that the field is not None."""
    return np.asarray(getattr(of, name))


class Readings(NamedTuple):
    """Readings at N poses; NaN for a missing reading."""

    lengths: Array  # reported lengths [m], (N, m)
    cells: Array  # readings of the load cells [N], (N, m)
    positions: Array  # measured positions [m], (N, 3)
    rotations: Array  # measured rotations, unit quaternions, scalar last, (N, 4)
    swivels: Array | None = None  # swivel angles [rad], (N, m); None for readings that equal the predictions
    frequencies: Array | None = None  # natural frequencies [Hz], (N, K); None without frequencies
    counts: Array | None = None  # encoder counts, (N, m), from which the lengths follow; None if lengths are read
    # speed [m/s] and acceleration [m/s^2] of the reported lengths, (2, N, m); None if clock_offset is not estimated
    motion: Array | None = None

    @classmethod
    def of(cls, log: WinchLog) -> Readings:
        """Readings of a log."""
        count, m = log.readings.shape
        columns = ((log.unstrained_length, m), (log.load_cells, m), (log.position, 3), (log.rotation, 4))
        read = (np.broadcast_to(np.nan, (count, width)) if own is None else own for own, width in columns)
        lengths, cells, positions, rotations = read
        return cls(lengths, cells, positions, rotations, log.swivel, log.frequency, log.counts)


class WhitenedRows(NamedTuple):
    """Whitened observations at N equilibria: the rows are independent, each with a standard deviation of 1."""

    # The number of rows R of a pose is m + 6, or m if neither positions nor rotations are measured; with further
    # readings, more.

    # Derivatives by the internal parameters, (N, R, P), after elimination of the true lengths. Rows without a reading
    # are zero. Where `logarithmic` is True, the internal parameter is the logarithm.
    matrix: Array
    misfit: Array  # readings minus predictions, (N, R)
    # residuals [N, m, rad, Hz] at the given lengths, (N, m + 6), and with further readings more; NaN if missing
    residual: Array
    back: Array  # change of the true lengths [m] per unit of misfit, (N, m, R)
    # Motion of the platform's center of mass [m, rad], world axes, (N, m + 1, 6). Each of the first m rows is the
    # motion per unit of a true length. The last row is the motion for a step along a direction. Without a direction, it
    # has no rows.
    motion: Array
    more: Array | int = 0  # straight cables: lengths minus observed motions of the pose, which are eliminated, (N,)


def _locked_view(array: Array) -> Array:
    """Read-only contiguous view of an array, as the compiled kernels require."""
    return locked(np.ascontiguousarray(array).view())


def _sensor_arrays(robot: Robot, sensors: Sensors) -> SensingArrays:
    """Arrays of the sensors for the kernel; a missing sensor has an infinite standard deviation."""
    m, (gain, bias) = robot.cable_count, load_cells_of(robot)

    def spread(value: Array | None, count: int) -> Array:
        return kernel_input(np.inf if value is None else value, (count,))

    return (
        kernel_input(gain, (m,)),
        kernel_input(bias, (m,)),
        spread(sensors.tension_deviation, m),
        spread(sensors.length_deviation, m),
        spread(sensors.position_deviation, 3),
        spread(sensors.rotation_deviation, 3),
        kernel_input(pose_rows(sensors.frame)[0], (7,)),
        kernel_input(sensors.target, (3,)),
    )


class MachineTerms:
    """A robot with parameter values and its sensors, as arrays for the kernel."""

    def __init__(
        self,
        robot: Robot,
        model: CableModel,
        parameters: Parameters,
        sensors: Sensors,
        offset: Array | float = 0.0,
        scale: Array | float = 1.0,
        late: Array | float = 0.0,
        swivel_zero: Array | float = 0.0,
    ) -> None:
        """Arrays of a robot and its sensors; raises an error if counts need drum data that are missing."""
        if sensors.swivel_deviation is not None:  # an angle about an axis that rotates with the platform
            refuse_slanted(robot, only_platform=True)
        self.robot, self.model, given = robot, model, (offset, scale, late, swivel_zero)
        # offset [m], scale and lateness [s] of reported lengths; swivel_zero: angles of cables along x [rad]; (m,) each
        self.offset, self.scale, self.late, self.swivel_zero = (np.broadcast_to(x, robot.cable_count) for x in given)
        self.drums = Drums(robot) if parameters.counted else None  # needed for counts
        self.terms: ForwardTerms = (model.code, *model.parameters, has_routing(robot) or None)
        self.body, self.cables = body_table(robot), cable_table(robot, slanted=True)
        self._take_sensors(sensors)
        self._take_parameters(parameters)

    def with_parameters(self, parameters: Parameters) -> MachineTerms:
        """The machine with other unknowns."""
        other = copy(self)
        other._take_parameters(parameters)
        return other

    def _take_parameters(self, parameters: Parameters) -> None:
        """Store the unknowns. Unknown pulley radii and dead lengths need routing, even if zero."""
        routed = self.terms[-1] or bool((parameters.where[[kinds.RADIUS, kinds.DEAD]] >= 0).any())
        self.terms, winches = (*self.terms[:-1], routed or None), self.robot.winches
        radii, plain = (parameters.where[kinds.RADIUS] >= 0).any(), self.cables.shape[2] == tables.CABLE_COLUMNS
        if radii and plain and winches is not None and winches.swivel_axis[:, :2].any():
            self.cables = locked(slanted_rows(self.robot)[None])  # eyelets that may become pulleys
        # slopes: derivatives of the values by the internal parameters, (P,)
        self.parameters, self.slopes = parameters, slopes_of_values(self.robot, parameters)

    def with_sensors(self, sensors: Sensors) -> MachineTerms:
        """The machine with other sensors."""
        other = copy(self)
        other._take_sensors(sensors)
        return other

    def _take_sensors(self, sensors: Sensors) -> None:
        self.sensors, self.sensing = sensors, _sensor_arrays(self.robot, sensors)

    def with_unit_sensors(self) -> MachineTerms:
        """The machine with exact lengths; its other sensors have standard deviations of 1 in SI units."""
        sensors = self.sensors
        rotation = [1.0, 1.0, 1.0 if sensors.rotation_deviation is None or measures_yaw(sensors) else np.inf]
        names = ("swivel_deviation", "frequency_deviation")
        further = {name: None if getattr(sensors, name) is None else 1.0 for name in names}
        exact = Sensors(EXACT, 1.0, 1.0, rotation, **further, frame=sensors.frame, target=sensors.target)
        return self.with_sensors(exact)

    def winch_slopes(self, lengths: Array, counts: Array | None = None) -> Array:
        """Derivatives of reported lengths (N, m) [m] by the unknowns of `SLOPES`, (5, N, m); zero for clock_offset."""
        # counts: read counts (N, m); None to compute the counts from the lengths.
        slopes = np.zeros((SLOPES, *lengths.shape))
        if self.drums is None:
            slopes[0], slopes[3] = 1.0, (lengths - self.offset) / self.scale
            return slopes
        counts = counts_at(self.drums, lengths) if counts is None else counts
        with_radius = bool((self.parameters.where[kinds.DRUM] >= 0).any())
        robot, winches = self.robot, self.drums.winches
        stiffness = robot.cables.axial_stiffness
        strain = winches.winding_tension / stiffness
        slopes[2] = lengths * strain / (stiffness * (1.0 + strain))
        alike = winches.drum_distance is None and (winches.layers == 1.0).all()
        if alike:  # all turns on the drum have the same length
            slopes[0] = 1.0 / (1.0 + strain)
            if with_radius:
                radius, pitch = _known_field(winches, "drum_radius"), _known_field(winches, "groove_pitch")
                circle = 2.0 * np.pi * (radius + 0.5 * _known_field(robot.cables, "diameter"))
                turn_slope = 2.0 * np.pi * circle / np.hypot(circle, pitch)  # derivative of one turn by the radius
                turns = (counts - winches.count_zero) / (winches.gear * _known_field(winches, "counts_per_turn"))
                slopes[1] = turns * turn_slope / (1.0 + strain)
            return slopes
        for row, name in ((0, "length_zero"), (1, "drum_radius"))[: 1 + with_radius]:
            value = _known_field(winches, name)
            step = STEP * value
            ends = (robot.replace(winches=winches.replace(**{name: value + sign * step})) for sign in (-1.0, 1.0))
            low, high = (lengths_at_counts(Drums(end), counts) for end in ends)
            slopes[row] = (high - low) / (2.0 * step)
        return slopes


def whitened_rows(
    machine: MachineTerms,
    readings: Readings,
    slopes: Array,
    poses: Array,
    lengths: Array,
    direction: Array | None = None,
) -> WhitenedRows:
    """Whitened readings and derivatives at equilibria; NaN where the equilibrium is not stable."""
    # slopes: derivatives of reported lengths (5, N, m) from `winch_slopes`. If `direction` (P,) is given, only the
    # slopes along this direction are computed, so that P is 1 in the result.
    found = _observed(machine, readings, slopes, poses, lengths, direction)
    if machine.sensors.swivel_deviation is None and readings.frequencies is None:
        return found
    return _with_further(machine, readings, slopes, poses, lengths, direction, found)


def _with_further(
    machine: MachineTerms,
    readings: Readings,
    slopes: Array,
    poses: Array,
    lengths: Array,
    direction: Array | None,
    found: WhitenedRows,
) -> WhitenedRows:
    """The whitened rows `found`, with those of further readings after them."""
    m, sensors, where = lengths.shape[1], machine.sensors, machine.parameters.where.copy()
    where[kinds.SHIFT : kinds.SCALE] = -1  # the measuring system does not move the platform
    parameters = replace(machine.parameters, where=locked(where))
    plain = machine.with_sensors(POSE_SENSORS)
    plain.parameters = parameters
    moves = _observed(plain, _no_readings(lengths), slopes, poses, lengths, direction)
    motion = moves.matrix[:, m:], np.swapaxes(moves.back, 1, 2)[:, m:] / EXACT**2
    factor = machine.slopes if direction is None else machine.slopes * direction
    scale, places = np.where(where >= 0, factor[where], 0.0), where if direction is None else np.minimum(where, 0)
    parts, modes, paid = [], 0, np.zeros((len(poses), m, motion[0].shape[2]))
    for row, change in zip((*LENGTH_KINDS,), slopes, strict=True):
        for i in np.flatnonzero(places[row] >= 0):
            paid[:, i, places[row, i]] += scale[row, i] * change[:, i]
    if sensors.swivel_deviation is not None:
        swivels, turned = (machine.swivel_zero, readings.swivels), _turned_pulleys(machine, poses, lengths)
        parts.append(swivel_rows(machine.robot, *swivels, poses, places, scale, motion, paid, turned))
    if readings.frequencies is not None:
        modes = readings.frequencies.shape[1]
        at = poses, lengths, places, scale, paid
        steps = _steps(machine) if direction is None else 1.0 / np.abs(direction / _steps(machine)).max(keepdims=True)
        parts.append(frequency_rows(machine.robot, machine.terms, machine.cables, readings.frequencies, *at, steps))
    residual, by_values, by_length = (np.concatenate(part, axis=1) for part in zip(*parts, strict=True))
    deviation, given = reading_deviations(sensors, m, modes), np.broadcast_to(sensors.length_deviation, m)
    off = readings.lengths - lengths
    rows, before = (residual, by_values, by_length), (found.matrix, found.misfit, found.back)
    more = whitened_further(rows, deviation[2 * m + 6 :], off, given**2, before)
    return found._replace(
        matrix=np.concatenate((found.matrix, more[0]), axis=1),
        misfit=np.concatenate((found.misfit, more[1]), axis=1),
        back=np.concatenate((found.back, more[2]), axis=2),
        residual=np.concatenate((found.residual, residual), axis=1),
    )


def _turned_pulleys(machine: MachineTerms, poses: Array, lengths: Array) -> Array | None:
    """Directions of the pulleys and derivatives of their swivel angles; None if all swivel axes are vertical."""
    if machine.cables.shape[2] == tables.CABLE_COLUMNS:
        return None
    found = np.empty((*lengths.shape, SWIVEL_NUMBERS))
    given = machine.robot.freedom, machine.body, machine.cables, _locked_view(lengths), _locked_view(poses), NO_LOAD
    swivel_readings(machine.terms, given, memory_for(lengths.shape[1]), found)
    return found


def _steps(machine: MachineTerms) -> Array:
    """Steps (P,) of the internal parameters for difference quotients of frequencies."""
    return machine.parameters.usual_deviation * FREQUENCY_STEP


def _no_readings(lengths: Array) -> Readings:
    """Lengths (N, m) [m] with other readings that are not missing, for derivatives of predictions."""
    count = len(lengths)
    return Readings(lengths, np.zeros(lengths.shape), np.zeros((count, 3)), np.tile([0.0, 0.0, 0.0, 1.0], (count, 1)))


def _observed(
    machine: MachineTerms, readings: Readings, slopes: Array, poses: Array, lengths: Array, direction: Array | None
) -> WhitenedRows:
    """The whitened readings that the kernel knows."""
    count, m = lengths.shape
    parameters, factor, width = machine.parameters, machine.slopes, len(machine.slopes)
    where = locked(np.ascontiguousarray(parameters.where).view())
    if direction is not None:
        factor, width = factor * direction, 1
        where = locked(np.minimum(where, 0))
    measured = machine.sensors.position_deviation is not None or machine.sensors.rotation_deviation is not None
    rows = m + BESIDE if measured else m
    found = WhitenedRows(
        np.empty((count, rows, width)),
        np.empty((count, rows)),
        np.empty((count, m + BESIDE)),
        np.empty((count, m, rows)),
        np.empty((0 if direction is None else count, m + 1, 6)),
    )
    observe(
        machine.terms,
        (machine.robot.freedom, machine.body, machine.cables, _locked_view(lengths), _locked_view(poses), NO_LOAD),
        machine.sensing,
        PoseReadings(*map(_locked_view, readings[:4])),
        (where, locked(np.where(parameters.where >= 0, factor[parameters.where], 0.0)), _locked_view(slopes)),
        memory_for(m),
        (*found[:5], np.empty((rows + 6, width))),
    )
    return found


def predicted_rows(
    machine: MachineTerms, poses: Array, lengths: Array, frequencies: Array | None = None
) -> WhitenedRows:
    """Whitened slopes of the readings at equilibria with pose rows `poses` and unstrained lengths (N, m) [m]."""
    # frequencies: (N, K), NaN where no slopes are wanted, or None.
    readings = _no_readings(lengths)._replace(frequencies=frequencies)
    rows = whitened_rows(machine, readings, machine.winch_slopes(lengths), poses, lengths)
    return rows._replace(misfit=np.where(np.isnan(rows.misfit), np.nan, 0.0))


def unwhitened_slopes(
    machine: MachineTerms, poses: Array, lengths: Array, frequencies: Array | None = None
) -> tuple[Array, Array]:
    """Derivatives of load cells, position and rotation [SI]: (N, m + 6, P) by values, (N, m + 6, m) by lengths."""
    # The derivatives of swivel angles follow in m more rows, then those of frequencies (N, K), if given.
    (count, m), machine = lengths.shape, machine.with_unit_sensors()
    width = len(reading_deviations(machine.sensors, m, 0 if frequencies is None else frequencies.shape[1])) - m
    by_values, by_length = np.empty((count, width, len(machine.slopes))), np.empty((count, width, m))
    for part in blocks(count, BLOCK):
        some = None if frequencies is None else frequencies[part]
        rows = predicted_rows(machine, poses[part], lengths[part], some)
        by_values[part] = rows.matrix / machine.slopes
        by_length[part] = np.swapaxes(rows.back, 1, 2) / EXACT**2
    return by_values, by_length
