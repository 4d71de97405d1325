"""Hardware of a machine: initial state, drives, brakes, encoders and load cells, and the true robot."""

from __future__ import annotations

import math
from typing import Any, Final

import numpy as np

from sagline.control.link import HEARTBEAT
from sagline.core.arrays import Array
from sagline.core.errors import InvalidValueError
from sagline.dynamics.simulation.simulate import highest_frequency
from sagline.dynamics.simulation.simulator import Reading, Simulator
from sagline.dynamics.simulation.winches import drive_data
from sagline.dynamics.vibration.dynamic_stiffness import Damping
from sagline.kernels.dynamics import drives as d
from sagline.kinematics.forward import forward
from sagline.kinematics.inverse import inverse
from sagline.robot.batch import dead_cable
from sagline.robot.drum import Drums, drum_lever
from sagline.robot.equilibrium import Equilibrium
from sagline.robot.pose import Pose, single_pose
from sagline.robot.robot import Robot
from sagline.twin.plc_program import LEFT, PlcLimits


class _EncoderScale:
    """Conversion between lengths and encoder counts: by the turns of known drums, otherwise with a constant radius."""

    def __init__(self, robot: Robot, length: Array, counts: Array) -> None:
        """Store lengths [m], (m,), and the encoder counts, (m,), at these lengths, as a reference."""
        winch = robot.winches
        if winch is None or winch.counts_per_turn is None:
            step = "Give counts_per_turn in the robot file, or with robot.replace(winches=Winch(counts_per_turn=...))."
            raise InvalidValueError("winches: counts_per_turn", "not given", "known if encoder counts are used", step)
        stretch = 1.0 + winch.winding_tension / robot.cables.axial_stiffness
        each = winch.gear * winch.counts_per_turn
        # per_meter: counts per meter of unstrained paid-out cable, at the reference lengths, (m,)
        self.per_meter = each * stretch / (2.0 * np.pi * drum_lever(robot, length))
        self._drums: Drums | None = None
        if winch.groove_pitch is not None and robot.cables.diameter is not None:
            self._drums = drums = Drums(robot)
            self._stretch, self._each = stretch, each
            self._at_no_turns = counts + each * drums.turns((length * stretch)[None])[0][0]
        else:
            self._at_no_length = counts - length * self.per_meter

    def counts(self, length: Array) -> Array:
        """Convert unstrained lengths off the drums [m] to counts of the encoders, not rounded."""
        if self._drums is None:
            return np.asarray(length * self.per_meter + self._at_no_length)
        turns, _ = self._drums._turns((length * self._stretch)[None])
        return np.asarray(self._at_no_turns - turns[0] * self._each)

    def lengths(self, counts: Array) -> Array:
        """Convert counts of the encoders to unstrained lengths off the drums [m]."""
        if self._drums is None:
            return np.asarray((counts - self._at_no_length) / self.per_meter)
        turns = (self._at_no_turns - counts) / self._each
        return np.asarray(self._drums.lengths(turns[None])[0] / self._stretch)


SHARE: Final = 0.2  # largest phase of the highest mode in a step [rad]
NEAR: Final = 1e-6  # largest deviation from a whole number of steps, in periods
REACH: Final = 2.0  # default of cable_length, divided by the largest distance of two frame anchors


def _initial_state(
    true: Robot, nominal: Robot, start: Any, surveyed: bool
) -> tuple[Equilibrium, _EncoderScale, _EncoderScale]:
    """True equilibrium at the start, and the conversions between lengths and counts: in the PLCs, by the true drums."""
    pose = _start_pose(nominal, start)
    planned = _feasible_lengths(inverse(nominal, pose).unstrained_length, nominal, "start")
    counts = np.zeros(nominal.cable_count)
    scale = _EncoderScale(nominal, planned, counts)
    if (winch := nominal.winches) is not None and winch.length_zero is not None:
        stretch = 1.0 + winch.winding_tension / nominal.cables.axial_stiffness
        counts = np.rint(winch.count_zero - scale.counts(winch.length_zero / stretch))
        scale = _EncoderScale(nominal, planned, counts)
    if surveyed:
        state = inverse(true, pose).state
        _feasible_lengths(state.unstrained_length, true, "start")
    else:
        routed = _routed_length(true, pose) - _routed_length(nominal, pose)  # without wrapped and dead lengths
        state = _rest_at(true, planned + routed + _zero_errors(true, nominal), pose)
    return state, scale, _EncoderScale(true, state.unstrained_length, counts)


def _start_pose(robot: Robot, start: Any) -> Pose:
    """Pose at which the encoders are set; by default the middle of the robot's test_box, without a rotation."""
    if start is not None:
        return single_pose(start, "start")
    if robot.test_box is None:
        allowed = f"a pose, because {robot.name} has no test_box"
        step = "Give the pose at which encoders are set: start=Pose.from_euler([0, 0, 1.5], 0, 0, 0)."
        raise InvalidValueError("start", "not given", allowed, step)
    return Pose(0.5 * (robot.test_box.low + robot.test_box.high))


def _winch_limits(robot: Robot, scale: _EncoderScale) -> PlcLimits:
    """Limits of a robot's winches in the PLCs. Each limit is a list with one number per winch."""
    winch, anchors = robot.winches, robot.frame_anchors
    assert winch is not None
    apart = np.linalg.norm(anchors[:, None] - anchors, axis=-1).max()
    dead = dead_cable(robot) + np.zeros(robot.cable_count)
    most = dead + REACH * apart if winch.cable_length is None else winch.cable_length
    speed = np.full(robot.cable_count, np.inf)
    if winch.speed_limit is not None and winch.counts_per_turn is not None:
        speed = winch.speed_limit * winch.counts_per_turn / (2.0 * math.pi * np.abs(scale.per_meter))
    tension = robot.tension_max + np.zeros(robot.cable_count)
    return PlcLimits(*(column.tolist() for column in (dead + LEFT, most, speed, tension)))


def _check_step(robot: Robot, state: Equilibrium, step: float, period: float) -> None:
    """Refuse a `step` [s] that is too long for the robot's modes. Refuse a `period` [s] out of range."""
    # the period must be a whole multiple of the step, and at most the heartbeat
    if not (parts := period / step) >= 0.5 or abs(parts - round(parts)) > NEAR * parts:
        raise InvalidValueError("period", f"{period:g} s", f"a whole multiple of {step:g} s, the step", "Correct it.")
    if period > HEARTBEAT:
        step_to = "Give 0.01, as in the article."
        raise InvalidValueError("period", f"{period:g} s", f"<= {HEARTBEAT:g} s, the heartbeat", step_to)
    length = state.unstrained_length
    pose = Pose.from_quaternion(state.pose.position[None], state.pose.quaternion[None])
    data = drive_data(robot, "robot", length, False)
    highest = highest_frequency(robot, pose, length[None], d.DRUMS, data)
    if step * highest > SHARE:
        limit, frequency = SHARE / highest, highest / (2.0 * math.pi)
        finer = 1e-3 / 2 ** math.ceil(math.log2(1e-3 / limit))
        allowed = f"<= {limit:.3g} s, {SHARE:g} rad of the highest mode, {frequency:.3g} Hz, cables taut"
        raise InvalidValueError("step", f"{step:g} s", allowed, f"Give step={finer:.6g}.")


def _feasible_lengths(length: Array, robot: Robot, item: str) -> Array:
    if np.isnan(length).any():
        allowed = f"a pose that {robot.name} can hold within its tension limits"
        raise InvalidValueError(item, "a pose that is not feasible", allowed, "Give another pose as start.")
    return length


def _rest_at(robot: Robot, length: Array, pose: Pose) -> Equilibrium:
    """Equilibrium of the true robot at given lengths, near a pose."""
    dead = dead_cable(robot) + np.zeros(robot.cable_count)
    found = forward(robot, length, start=pose) if (length > dead).all() else None
    if found is None or not found.stable:
        allowed, step = "a robot with an equilibrium near the start", "Change the robot by less, or give surveyed=True."
        raise InvalidValueError("robot", "without equilibrium at the nominal lengths", allowed, step)
    return found.state


def _zero_errors(true: Robot, nominal: Robot) -> Array:
    """Zero errors of the encoders [m], (m,): true length off the drum minus the length from the counts."""
    there, thought = (None if robot.winches is None else robot.winches.length_zero for robot in (true, nominal))
    return np.zeros(true.cable_count) if there is None or thought is None else there - thought


def _routed_length(robot: Robot, pose: Pose) -> Array:
    """For each cable, length on the pulley plus dead length [m], (m,)."""
    if robot.winches is None or not robot.winches.anything_behind:
        return np.zeros(robot.cable_count)
    whole, bare = (inverse(some, pose).unstrained_length for some in (robot, robot.replace(winches=None)))
    return _feasible_lengths(whole - bare, robot, "start")


def plc_limits(robot: Robot) -> PlcLimits:
    """Limits of a robot's winches in the PLCs. Each limit is a list with one number per winch."""
    planned = _feasible_lengths(inverse(robot, _start_pose(robot, None)).unstrained_length, robot, "test_box")
    return _winch_limits(robot, _EncoderScale(robot, planned, np.zeros(robot.cable_count)))


FILTER: Final = 0.05  # time constant of the PLCs' filters of load cells [s]
LENGTH, RATE, TORQUE, CELL, FILTERED = range(5)  # indices of the rows of the readings


class Hardware:
    """Drives, sensors and plant."""

    def __init__(
        self,
        robot: Robot,
        nominal: Robot,
        start: Any,
        surveyed: bool,
        damping: Damping,
        step: float,
        period: float,
        seed: int,
    ) -> None:
        """Begin with brakes on. `step`: time step of the simulation [s]. `period`: period of the PLCs [s]."""
        state, self._nominal, self._true = _initial_state(robot, nominal, start, surveyed)
        self.simulator = Simulator(robot, state, winches="robot", step=step, damping=damping, seed=seed)
        _check_step(robot, state, step, period)
        self.simulator.hold()
        self._period, self.limits = period, _winch_limits(nominal, self._nominal)
        m, winch, reading = robot.cable_count, robot.winches, self.simulator.reading
        assert winch is not None
        self._full = np.full(m, np.inf) if winch.load_cell_range is None else winch.load_cell_range
        self._lever = drum_lever(robot, reading.length) / np.abs(winch.gear)
        self._weight, self._gravity, self._slip = np.zeros(6), robot.gravity, np.zeros(m)
        self._wrong: dict[int, tuple[float, float]] = {}  # factor and offset [N] of the readings of faulty load cells
        self._powered, self._torque_of_force = [False] * m, np.zeros(m)
        self._periods, self._shares = np.full(m, period), np.full(m, period / (FILTER + period))
        self._load_changed = True  # True until the simulator has received the new load
        # read: readings at the end of a period, shape (5, m). The rows are LENGTH: unstrained lengths off the drums,
        # from the encoder counts and the nominal drums [m]; RATE: mean rates of the lengths over the period [m/s];
        # TORQUE: torques of the motors at their shafts, positive torque pays out cable [N m]; CELL: readings of the
        # load cells [N]; FILTERED: filtered readings [N].
        self.read = np.zeros((5, m))
        self._rows = tuple(self.read)
        self.read[FILTERED] = reading.load_cell
        self._take(reading)
        self.read[RATE] = 0.0

    def simulate_period(self, length: list[float], tension: list[float], powered: list[bool]) -> None:
        """Simulate a period. The set points change linearly to `length` [m] and `tension` [N]."""
        if powered != self._powered:
            self._switch(powered)
        counts = np.rint(self._nominal.counts(np.array(length)))
        targets = self._true.lengths(counts - self._slip)
        weight, self._load_changed = self._weight if self._load_changed else None, False
        self._take(self.simulator.step(targets, self._period, tension=tension, wrench=weight))

    def _switch(self, powered: list[bool]) -> None:
        changed = [i for i, (now, before) in enumerate(zip(powered, self._powered, strict=True)) if now != before]
        if on := [i for i in changed if powered[i]]:
            self.simulator.release(*on)
        if off := [i for i in changed if not powered[i]]:
            self.simulator.hold(*off)
        self._powered, self._torque_of_force = list(powered), self._lever * powered

    def _take(self, reading: Reading) -> None:
        length, rate, torque, tension, filtered = self._rows
        self.counts = np.rint(self._true.counts(reading.length) + self._slip)  # of the encoders, whole numbers
        now = self._nominal.lengths(self.counts)
        np.subtract(now, length, out=rate)
        rate /= self._periods
        length[:] = now
        np.multiply(reading.force, self._torque_of_force, out=torque)
        tension[:] = reading.load_cell
        for cell, (kept, added) in self._wrong.items():
            tension[cell] = kept * tension[cell] + added
        filtered += self._shares * (tension - filtered)

    def spoil_cell(self, cell: int, words: str | None, value: float) -> None:
        """Begin a fault of a load cell, one of `KINDS`, or remove the fault."""
        if words is None:
            self._wrong.pop(cell, None)
            self.read[FILTERED, cell] = self.simulator.reading.load_cell[
                cell
            ]  # the filter restarts from the next reading
        elif words == "is wrong by #":
            self._wrong[cell] = (1.0, value)
        else:
            fixed = {"sticks": self.read[CELL, cell], "saturates": self._full[cell], "fails": np.nan}.get(words, value)
            self._wrong[cell] = (0.0, float(fixed))

    def shift_encoder(self, winch: int, length: float) -> None:
        """Shift an encoder by the counts of `length` [m] of cable. The drive then moves the cable by this length."""
        slip = np.rint(length * self._nominal.per_meter[winch])
        self._slip[winch] += slip
        self.simulator.shift(-slip / self._true.per_meter[winch], winch)

    def add_load(self, mass: float) -> None:
        """Add a mass at the platform's center of mass [kg]."""
        self._weight[2] -= mass * self._gravity
        self._load_changed = True
