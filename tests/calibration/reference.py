"""Readings of the sensors of a robot and their slopes by differences, through public functions only."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.transform import Rotation

import sagline as sl
from sagline.calibration.parameters import KINDS, Parameters
from sagline.core.arrays import Array, locked
from sagline.kernels.calibration import kinds
from sagline.robot.drum import Drums

# steps of the differences in meters, newtons and radians; relative steps for parameters with a logarithm
STEPS = {
    kinds.FRAME: 1e-4,
    kinds.PLATFORM: 1e-4,
    kinds.ZERO: 1e-4,
    kinds.DRUM: 1e-5,
    kinds.DENSITY: 2e-2,
    kinds.STIFFNESS: 1e-2,
    kinds.RADIUS: 5e-5,
    kinds.DEAD: 1e-4,
    kinds.GAIN: 1e-2,
    kinds.BIAS: 1e-1,
    kinds.MASS: 2e-3,
    kinds.CENTER: 5e-4,
    kinds.SHIFT: 1e-2,
    kinds.TURN: 1e-3,
    kinds.TARGET: 1e-2,
    kinds.SCALE: 1e-5,
}
FIRST = tuple(STEPS)  # first row of each kind
_WINCH = {kinds.RADIUS: "pulley_radius", kinds.DEAD: "dead_cable", kinds.GAIN: "load_cell_gain"}
_WINCH |= {kinds.BIAS: "load_cell_bias", kinds.ZERO: "length_zero", kinds.DRUM: "drum_radius"}


@dataclass(frozen=True)
class Machine:
    """A robot with its sensors; `offset` and `scale` are errors of the lengths if no counts are read, (m,)."""

    robot: sl.Robot
    sensors: sl.Sensors
    offset: Array
    scale: Array | float = 1.0

    @property
    def counting(self) -> bool:
        """True if counts determine the lengths."""
        winches = self.robot.winches
        return winches is not None and winches.drum_radius is not None and winches.length_zero is not None

    def believed(self, lengths: Array) -> Array:
        """Counts before rounding, or measured lengths, at true lengths (N, m)."""
        if not self.counting:
            return (lengths - self.offset) / self.scale
        return counts_of(self.robot, lengths)

    def lengths(self, believed: Array) -> Array:
        """True lengths (N, m) of counts or lengths."""
        if not self.counting:
            return self.scale * believed + self.offset
        return sl.lengths_from_counts(self.robot, believed)

    def changed(self, row: int, cable: int, by: float) -> Machine:
        """The machine with a changed parameter of `kinds`; the change is relative for parameters with a logarithm."""
        robot, sensors, winches = self.robot, self.sensors, self.robot.winches
        if row == kinds.SCALE:
            return replace(self, scale=_added(self.scale * np.ones(robot.cable_count), cable, by))
        if row >= kinds.TARGET:
            return Machine(robot, sensors.replace(target=_added(sensors.target, row - kinds.TARGET, by)), self.offset)
        if row >= kinds.TURN:
            turn = Rotation.from_rotvec(_added(np.zeros(3), row - kinds.TURN, by))
            frame = sl.Pose(sensors.frame.position, (turn * _rotation(sensors.frame)).as_matrix())
            return Machine(robot, sensors.replace(frame=frame), self.offset)
        if row >= kinds.SHIFT:
            frame = sl.Pose(_added(sensors.frame.position, row - kinds.SHIFT, by), sensors.frame.matrix)
            return Machine(robot, sensors.replace(frame=frame), self.offset)
        if row >= kinds.CENTER:
            moved = _added(robot.center_of_mass, row - kinds.CENTER, by)
            return Machine(robot.replace(center_of_mass=moved), sensors, self.offset)
        if row == kinds.MASS:
            return Machine(robot.replace(mass=robot.mass * np.exp(by)), sensors, self.offset)
        if row in (kinds.DENSITY, kinds.STIFFNESS):
            name = "linear_density" if row == kinds.DENSITY else "axial_stiffness"
            value = _added(np.log(getattr(robot.cables, name)), cable, by)
            return Machine(robot.replace(cables=robot.cables.replace(**{name: np.exp(value)})), sensors, self.offset)
        if row == kinds.ZERO and not self.counting:
            return Machine(robot, sensors, _added(self.offset, cable, by))
        if row in _WINCH:
            assert winches is not None
            value = getattr(winches, _WINCH[row])
            value = value * np.exp(_added(0.0 * value, cable, by)) if row == kinds.DRUM else _added(value, cable, by)
            return Machine(robot.replace(winches=winches.replace(**{_WINCH[row]: value})), sensors, self.offset)
        name, axis = ("frame_anchors", row) if row < kinds.PLATFORM else ("platform_anchors", row - kinds.PLATFORM)
        anchors = getattr(robot, name).copy()
        anchors[cable, axis] += by
        return Machine(robot.replace(**{name: anchors}), sensors, self.offset)

    @property
    def gain_and_bias(self) -> tuple[Array | float, Array | float]:
        """Gain and bias of the load cells, (m,)."""
        winches = self.robot.winches
        return (1.0, 0.0) if winches is None else (winches.load_cell_gain, winches.load_cell_bias)


def counts_of(robot: sl.Robot, lengths: Array) -> Array:
    """Counts at unstrained lengths (N, m), not rounded, unlike `encoder_counts`."""
    drums = Drums(robot)
    return drums.counts(lengths * (1.0 + drums.rest_strain))


def pose_rows(pose: sl.Pose) -> Array:
    """Positions and quaternions, (N, 7)."""
    return locked(np.hstack((np.atleast_2d(pose.position), np.atleast_2d(pose.quaternion))))


def _added(value: Array, index: int, by: float) -> Array:
    out: Array = np.array(value, dtype=float)
    out[index] += by
    return out


def _rotation(pose: sl.Pose) -> Rotation:
    return Rotation.from_quat(pose.quaternion.copy())


def readings(machine: Machine, lengths: Array, start: sl.Pose, model: sl.CableModel) -> tuple[Array, Rotation]:
    """Readings of load cells and measured positions, (N, m + 3), and measured rotations."""
    found = sl.forward(machine.robot, lengths, start, model)
    assert found.stable.all()
    gain, bias = machine.gain_and_bias
    axes = _rotation(machine.sensors.frame).inv()
    rotation = _rotation(found.pose)
    point = found.pose.position + rotation.apply(machine.sensors.target.copy())
    position = axes.apply(point - machine.sensors.frame.position)
    return np.hstack((gain * found.state.cables.frame_end_tension + bias, position)), axes * rotation


def by_lengths(machine: Machine, pose: sl.Pose, lengths: Array, model: sl.CableModel) -> Array:
    """Slopes of the readings by the true lengths, (N, m + 6, m) [N/m, m/m, rad/m]."""
    m = machine.robot.cable_count
    columns = []
    for cable in range(m):
        moved = [lengths + step * np.eye(m)[cable] for step in _stencil(STEPS[kinds.ZERO])]
        columns.append(_differences([machine] * 6, moved, pose, model, STEPS[kinds.ZERO]))
    return np.stack(columns, axis=-1)


def slopes(
    machine: Machine, pose: sl.Pose, lengths: Array, row: int, cable: int, model: sl.CableModel | None = None
) -> Array:
    """Slopes of the readings by a number of `kinds`, lengths following what the machine believes of them.

    Args:
        machine: Robot and sensors.
        pose: Equilibria, N of them.
        lengths: All cable off the drums there [m], (N, m).
        row: Of `kinds`.
        cable: Its cable; 0 for what the platform or the measuring system has.
        model: Cable model.

    Returns:
        Of load cells, position and rotation in the measuring system's axes, (N, m + 6).
    """
    step = STEPS[max(first for first in FIRST if first <= row)]
    believed = machine.believed(lengths)
    machines = [machine.changed(row, cable, by) for by in _stencil(step)]
    return _differences(machines, [one.lengths(believed) for one in machines], pose, model or sl.Catenary(), step)


def _stencil(step: float) -> tuple[float, ...]:
    return tuple(sign * multiple * step for multiple in (1.0, 2.0, 3.0) for sign in (1.0, -1.0))


def _differences(
    machines: list[Machine], lengths: list[Array], pose: sl.Pose, model: sl.CableModel, step: float
) -> Array:
    """Central differences of one, two and three steps, extrapolated: the error has the sixth order of the step."""
    read = [readings(one, own, pose, model) for one, own in zip(machines, lengths, strict=True)]
    found: Array = np.zeros(())
    for multiple, weight in zip((1, 2, 3), (1.5, -0.6, 0.1), strict=True):
        (after, turned), (before, straight) = read[2 * multiple - 2 : 2 * multiple]
        turn = (turned * straight.inv()).as_rotvec()
        found = found + weight / (2.0 * multiple * step) * np.hstack((after - before, turn))
    return found


def parameters(machine: Machine, names: tuple[str, ...], shared: tuple[str, ...] = ()) -> Parameters:
    """Parameters of some kinds, one per cable except for shared ones, with usual priors."""
    m = machine.robot.cable_count
    where = np.full((kinds.KIND_ROWS, m), -1)
    each: list[tuple[str, str, str, int, float, float, bool]] = []
    for name in names:
        kind = KINDS[name]
        count = m if kind.each and name not in shared else 1
        for cable in range(count):
            for axis, direction in enumerate(kind.axes):
                where[kind.first + axis, slice(None) if name in shared else cable] = len(each)
                value = value_of(machine, name, axis, cable)
                deviation = kind.deviation * (abs(value) if kind.logarithmic else 1.0)
                label = f"{name}[{cable}]" if count > 1 else name
                label += f".{direction}" if direction else ""
                one = cable if count > 1 else -1
                each.append((name, label, kind.unit, one, value, deviation, kind.logarithmic))
    kind_names, labels, units, cables, values, deviations, logs = zip(*each, strict=True)
    stated = np.zeros(len(each), dtype=bool)
    columns = (np.array(values), np.array(deviations), stated, np.array(logs))
    return Parameters(kind_names, labels, units, np.array(cables), where, *columns, machine.counting)


def value_of(machine: Machine, name: str, axis: int, cable: int) -> float:
    """Value of a parameter in a machine."""
    robot, sensors, winches = machine.robot, machine.sensors, machine.robot.winches
    if name == "measuring_frame":
        return float(sensors.frame.position[axis]) if axis < 3 else 0.0
    if name in ("target", "center_of_mass"):
        return float((sensors.target if name == "target" else robot.center_of_mass)[axis])
    if name == "mass":
        return robot.mass
    if name == "length_zero" and not machine.counting:
        return float(machine.offset[cable])
    if name in ("linear_density", "axial_stiffness"):
        return float(getattr(robot.cables, name)[cable])
    if name in ("frame_anchors", "platform_anchors"):
        return float(getattr(robot, name)[cable, axis])
    if winches is None:
        return float(name == "load_cell_gain")
    return float(getattr(winches, name)[cable])
