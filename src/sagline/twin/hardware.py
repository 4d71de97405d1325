"""Hardware of a machine: drives, brakes, encoders and load cells, and the true robot."""

from __future__ import annotations

from typing import Final

import numpy as np

from sagline.core.arrays import Array
from sagline.dynamics.simulation.simulator import Reading, Simulator
from sagline.dynamics.vibration.dynamic_stiffness import Damping
from sagline.robot.drum import drum_lever
from sagline.robot.robot import Robot
from sagline.twin.start import Start

FILTER: Final = 0.05  # time constant of the PLCs' filters of load cells [s]
LENGTH, RATE, TORQUE, CELL, FILTERED = range(5)  # indices of the rows of the readings


class Hardware:
    """Drives, sensors and plant.

    Attributes:
        read: Readings at the end of a period, shape (5, m). The rows are LENGTH: unstrained lengths off the drums, from
            the encoder counts and the nominal drums [m]; RATE: mean rates of the lengths over the period [m/s]; TORQUE:
            torques of the motors at their shafts, positive torque pays out cable [N m]; CELL: readings
            of the load cells [N]; FILTERED: filtered readings [N].
        counts: Encoder counts, whole numbers as floats, shape (m,).
    """

    def __init__(self, robot: Robot, begin: Start, damping: Damping, step: float, period: float, seed: int) -> None:
        """Begin with brakes on; `step`: step of the plant [s]; `period`: period of the PLCs [s]."""
        self._simulator = Simulator(robot, begin.state, winches="robot", step=step, damping=damping, seed=seed)
        self._simulator.hold()
        self._nominal, self._true, self._period = begin.nominal, begin.true, period
        m, winch, reading = robot.cable_count, robot.winches, self._simulator.reading
        assert winch is not None
        self._full = np.full(m, np.inf) if winch.load_cell_range is None else winch.load_cell_range
        self._lever = drum_lever(robot, reading.length) / np.abs(winch.gear)
        self._weight, self._gravity, self._slip = np.zeros(6), robot.gravity, np.zeros(m)
        self._wrong: dict[int, tuple[float, float]] = {}  # factor and offset [N] of the readings of faulty load cells
        self._powered, self._torque_of_force = [False] * m, np.zeros(m)
        self._periods, self._shares = np.full(m, period), np.full(m, period / (FILTER + period))
        self._load_changed = True  # True until the simulator has the new load
        self.read = np.zeros((5, m))
        self._rows = tuple(self.read)
        self.read[FILTERED] = reading.load_cell
        self._take(reading)
        self.read[RATE] = 0.0

    @property
    def reading(self) -> Reading:
        """True state of the plant."""
        return self._simulator.reading

    def simulate_period(self, length: list[float], tension: list[float], powered: list[bool]) -> None:
        """Simulate a period. The set points change linearly to `length` [m] and `tension` [N]."""
        if powered != self._powered:
            self._switch(powered)
        counts = np.rint(self._nominal.counts(np.array(length)))
        targets = self._true.lengths(counts - self._slip)
        weight, self._load_changed = self._weight if self._load_changed else None, False
        self._take(self._simulator.step(targets, self._period, tension=tension, wrench=weight))

    def _switch(self, powered: list[bool]) -> None:
        """Switch the power of drives on or off."""
        changed = [i for i, (now, before) in enumerate(zip(powered, self._powered, strict=True)) if now != before]
        if on := [i for i in changed if powered[i]]:
            self._simulator.release(*on)
        if off := [i for i in changed if not powered[i]]:
            self._simulator.hold(*off)
        self._powered, self._torque_of_force = list(powered), self._lever * powered

    def _take(self, reading: Reading) -> None:
        """Update the readings of encoders, drives and cells."""
        length, rate, torque, tension, filtered = self._rows
        self.counts = np.rint(self._true.counts(reading.length) + self._slip)
        now = self._nominal.lengths(self.counts)
        np.subtract(now, length, out=rate)
        rate /= self._periods
        length[:] = now
        np.multiply(reading.force, self._torque_of_force, out=torque)
        tension[:] = reading.load_cell
        for cell, (kept, added) in self._wrong.items():
            tension[cell] = kept * tension[cell] + added
        filtered += self._shares * (tension - filtered)

    @property
    def saturated(self) -> Array:
        """Flags (m,) that are nonzero for drives at a limit of torque or speed."""
        return self._simulator.reading.saturated

    def spoil_cell(self, cell: int, words: str | None, value: float) -> None:
        """Give a load cell one of the faults of `KINDS`, or remove its fault."""
        if words is None:
            self._wrong.pop(cell, None)
            self.read[FILTERED, cell] = self.reading.load_cell[cell]  # the filter starts again
        elif words == "is wrong by #":
            self._wrong[cell] = (1.0, value)
        else:
            fixed = {"sticks": self.read[CELL, cell], "saturates": self._full[cell], "fails": np.nan}.get(words, value)
            self._wrong[cell] = (0.0, float(fixed))

    def break_cable(self, cable: int) -> None:
        """Break a cable."""
        self._simulator.cut(cable)

    def shift_encoder(self, winch: int, length: float) -> None:
        """Shift the count of an encoder by `length` of cable [m]. The drive then moves the cable by this length."""
        slip = np.rint(length * self._nominal.per_meter[winch])
        self._slip[winch] += slip
        self._simulator.shift(-slip / self._true.per_meter[winch], winch)

    def limit_force(self, winch: int, force: float) -> None:
        """Limit the cable force of the drive of `winch` to `force` [N]."""
        self._simulator.limit_force(force, winch)

    def add_load(self, mass: float) -> None:
        """Add a mass at the platform's center of mass [kg]."""
        self._weight[2] -= mass * self._gravity
        self._load_changed = True
