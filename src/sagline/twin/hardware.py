"""What the PLCs of a machine are wired to: drives, brakes, encoders and load cells, and the true robot behind them."""

from __future__ import annotations

from typing import Final

import numpy as np

from sagline.arrays import Array
from sagline.control.link import Whole
from sagline.dynamics.damping import Damping
from sagline.dynamics.drives import lever_of
from sagline.dynamics.simulator import Reading, Simulator
from sagline.robot.robot import Robot
from sagline.twin.start import Start

FILTER: Final = 0.05  # s, of the PLCs' filters of load cells


class Hardware:
    """Drives and sensors, and the plant.

    Attributes:
        length: Unstrained lengths off the drums, as nominal drums have them at what the encoders count [m], (m,).
        rate: Their change in the last period [m/s], (m,).
        torque: Of the motors at their shafts, positive where it lets cable out [N m], (m,).
        cells: What the load cells read [N], (m,).
        filtered: The same behind a filter [N], (m,).
        counts: Of the encoders, (m,).
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
        self._lever = lever_of(robot, reading.length) / np.abs(winch.gear)
        self._weight, self._gravity, self._slip = np.zeros(6), robot.gravity, np.zeros(m)
        self._wrong: dict[int, tuple[float, float]] = {}  # load cells: what counts of a reading, and what is added
        self._powered, self._mask = [False] * m, np.zeros(m)
        self._share = period / (FILTER + period)
        self.length, self.cells = np.zeros(m), np.zeros(m)
        self.filtered = np.array(reading.load_cell)
        self._read(reading)
        self.rate = np.zeros(m)

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
        self._read(self._simulator.step(targets, self._period, tension=np.array(tension), wrench=self._weight))

    def _switch(self, powered: list[bool]) -> None:
        """Give power to drives, or take it from them."""
        changed = [i for i, (now, before) in enumerate(zip(powered, self._powered, strict=True)) if now != before]
        if on := [i for i in changed if powered[i]]:
            self._simulator.release(*on)
        if off := [i for i in changed if not powered[i]]:
            self._simulator.hold(*off)
        self._powered, self._mask[:] = list(powered), powered

    def _read(self, reading: Reading) -> None:
        """Fill what encoders, drives and cells read."""
        counts = np.rint(self._true.counts(reading.length) + self._slip)
        length = self._nominal.lengths(counts)
        self.rate = (length - self.length) / self._period
        self.length, self.counts = length, counts.astype(np.int64)
        self.torque = reading.force * self._lever * self._mask
        self.cells = reading.load_cell.copy()
        for cell, (kept, added) in self._wrong.items():
            self.cells[cell] = kept * self.cells[cell] + added
        self.filtered += self._share * (self.cells - self.filtered)

    counts: Whole
    torque: Array

    @property
    def saturated(self) -> list[float]:
        """Which drives are at a limit, not 0 where they are."""
        found: list[float] = self._simulator.reading.saturated.tolist()
        return found

    def spoil_cell(self, cell: int, words: str | None, value: float) -> None:
        """Let a load cell be wrong in one of the ways of `KINDS`, or right again."""
        if words is None:
            self._wrong.pop(cell, None)
        elif words == "is wrong by # N":
            self._wrong[cell] = (1.0, value)
        else:
            fixed = {"sticks": self.cells[cell], "saturates": self._full[cell]}.get(words, value)
            self._wrong[cell] = (0.0, float(fixed))

    def break_cable(self, cable: int) -> None:
        """Let a cable break."""
        self._simulator.cut(cable)

    def shift_encoder(self, winch: int, length: float) -> None:
        """Let an encoder count so much more cable than there is [m]."""
        self._slip[winch] += np.rint(length * self._nominal.per_meter[winch])

    def limit_force(self, winch: int, force: float) -> None:
        """Let a drive give no more than so much at the cable [N]."""
        self._simulator.limit_force(force, winch)

    def load(self, mass: float) -> None:
        """Hang a weight to the platform's center of mass [kg]."""
        self._weight[2] -= mass * self._gravity
