"""What the PLCs of a machine are wired to: drives, brakes, encoders and load cells, and the true robot behind them."""

from __future__ import annotations

from typing import Final

import numpy as np

from sagline.core.arrays import Array
from sagline.dynamics.simulation.simulator import Reading, Simulator
from sagline.dynamics.vibration.dynamic_stiffness import Damping
from sagline.robot.drum import drum_lever
from sagline.robot.robot import Robot
from sagline.twin.start import Start

FILTER: Final = 0.05  # s, of the PLCs' filters of load cells
LENGTH, RATE, TORQUE, CELL, FILTERED = range(5)  # rows of what is read


class Hardware:
    """Drives and sensors, and the plant.

    Attributes:
        read: What a period ends with, in the rows LENGTH: unstrained, off the drums, as nominal drums have it at what
            the encoders count [m]; RATE: its change in the period [m/s]; TORQUE: of the motors at their shafts,
            positive where it lets cable out [N m]; CELL: what the load cells read [N]; FILTERED: the same behind a
            filter [N], (5, m).
        counts: Of the encoders, whole numbers as floats, (m,).
    """

    def __init__(self, robot: Robot, begin: Start, damping: Damping, step: float, period: float, seed: int) -> None:
        """Switch on, brakes on.

        Args:
            robot: The true robot.
            begin: Where it stands.
            damping: Of the cables.
            step: Of the plant [s].
            period: Of the PLCs [s].
            seed: Of the load cells' noise.
        """
        self._simulator = Simulator(robot, begin.state, winches="robot", step=step, damping=damping, seed=seed)
        self._simulator.hold()
        self._nominal, self._true, self._period = begin.nominal, begin.true, period
        m, winch, reading = robot.cable_count, robot.winches, self._simulator.reading
        assert winch is not None
        self._full = np.full(m, np.inf) if winch.load_cell_range is None else winch.load_cell_range
        self._lever = drum_lever(robot, reading.length) / np.abs(winch.gear)
        self._weight, self._gravity, self._slip = np.zeros(6), robot.gravity, np.zeros(m)
        self._wrong: dict[int, tuple[float, float]] = {}  # load cells: what counts of a reading, and what is added
        self._powered, self._torque_of_force = [False] * m, np.zeros(m)
        self._periods, self._shares = np.full(m, period), np.full(m, period / (FILTER + period))
        self._heavier = True  # whether the plant has not been told the weight
        self.read = np.zeros((5, m))
        self._rows = tuple(self.read)
        self.read[FILTERED] = reading.load_cell
        self._take(reading)
        self.read[RATE] = 0.0

    @property
    def reading(self) -> Reading:
        """What is true."""
        return self._simulator.reading

    def go_on(self, length: list[float], tension: list[float], powered: list[bool]) -> None:
        """Go on for a period, in which the drives' set points go straight to those that are given.

        Args:
            length: Unstrained, as nominal drums have it [m], of each winch.
            tension: Expected at the drums [N].
            powered: Which drives have power; the brakes of the others are on.
        """
        if powered != self._powered:
            self._switch(powered)
        counts = np.rint(self._nominal.counts(np.array(length)))
        targets = self._true.lengths(counts - self._slip)
        weight, self._heavier = self._weight if self._heavier else None, False
        self._take(self._simulator.step(targets, self._period, tension=tension, wrench=weight))

    def _switch(self, powered: list[bool]) -> None:
        """Give power to drives, or take it from them."""
        changed = [i for i, (now, before) in enumerate(zip(powered, self._powered, strict=True)) if now != before]
        if on := [i for i in changed if powered[i]]:
            self._simulator.release(*on)
        if off := [i for i in changed if not powered[i]]:
            self._simulator.hold(*off)
        self._powered, self._torque_of_force = list(powered), self._lever * powered

    def _take(self, reading: Reading) -> None:
        """Fill what encoders, drives and cells read."""
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
        """Which drives are at a limit of torque or speed, not 0 where they are, (m,)."""
        return self._simulator.reading.saturated

    def spoil_cell(self, cell: int, words: str | None, value: float) -> None:
        """Let a load cell be wrong in one of the ways of `KINDS`, or right again."""
        if words is None:
            self._wrong.pop(cell, None)
        elif words == "is wrong by #":
            self._wrong[cell] = (1.0, value)
        else:
            fixed = {"sticks": self.read[CELL, cell], "saturates": self._full[cell]}.get(words, value)
            self._wrong[cell] = (0.0, float(fixed))

    def break_cable(self, cable: int) -> None:
        """Let a cable break."""
        self._simulator.cut(cable)

    def shift_encoder(self, winch: int, length: float) -> None:
        """Let an encoder count so much more cable than there is [m]; its drive winds that in, as its gains say."""
        slip = np.rint(length * self._nominal.per_meter[winch])
        self._slip[winch] += slip
        self._simulator.shift(-slip / self._true.per_meter[winch], winch)

    def limit_force(self, winch: int, force: float) -> None:
        """Let a drive give no more than so much at the cable [N]."""
        self._simulator.limit_force(force, winch)

    def load(self, mass: float) -> None:
        """Hang a weight to the platform's center of mass [kg]."""
        self._weight[2] -= mass * self._gravity
        self._heavier = True
