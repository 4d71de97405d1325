"""What encoders and load cells read of a robot that is simulated; seeded, and into memory of their own."""

from __future__ import annotations

from typing import Any

import numpy as np

from sagline.core.arrays import Array, locked
from sagline.kernels.dynamics.period import read_cells, read_encoders
from sagline.kernels.jit import machine_code
from sagline.robot.drum import drums_of
from sagline.robot.robot import Robot

COUNTED = ("drum_radius", "groove_pitch", "counts_per_turn", "length_zero")  # what an encoder's counts need


class Encoders:
    """Encoders on drums.

    Attributes:
        counts: Whole counts, as floats, (m,).
    """

    def __init__(self, robot: Robot, wound: Array, stretch: Array) -> None:
        """Look at the drums of a robot that has all that counts need.

        Args:
            robot: The robot.
            wound: Where its lengths off the drums will be [m], (m,).
            stretch: From these to those along the path of winding, (m,).
        """
        drums, m = drums_of(robot), robot.cable_count
        zero, rate = drums.zero_and_rate()
        self.counts = np.empty(m)
        offset = drums.winches.count_zero + zero * rate
        given = ((drums.table, drums.starts), wound, locked(stretch), locked(offset), locked(rate * 1.0))
        self._arguments: tuple[Any, ...] = (*given, np.empty((3, 1, m)), self.counts)
        self._read: Any = machine_code(read_encoders, self._arguments)

    @staticmethod
    def are_on(robot: Robot) -> bool:
        """Whether a robot's winches and cables have all that counts need."""
        winch = robot.winches
        known = winch is not None and all(getattr(winch, name) is not None for name in COUNTED)
        return known and robot.cables.diameter is not None

    def read(self) -> None:
        """Fill the counts."""
        self._read(*self._arguments)


class LoadCells:
    """Load cells at the frame ends of the cables.

    Attributes:
        reading: [N], (m,).
        generator: Of the noise.
    """

    def __init__(self, robot: Robot, seed: int, tension: Array) -> None:
        """Make the load cells of a robot; without winches they read what is there.

        Args:
            robot: The robot.
            seed: Of the noise.
            tension: Where the tensions behind the filter will be [N], (m,).
        """
        m, winch = robot.cable_count, robot.winches
        cells = np.array([np.ones(m), np.zeros(m), np.zeros(m), np.full(m, np.inf)])
        if winch is not None:
            cells[:3] = winch.load_cell_gain, winch.load_cell_bias, winch.load_cell_deviation
            if winch.load_cell_range is not None:
                cells[3] = winch.load_cell_range
        self.generator, self.reading = np.random.default_rng(seed), np.empty(m)
        self._noise = np.empty(m)
        self._arguments: tuple[Any, ...] = (tension, locked(cells), self._noise, self.reading)
        self._read: Any = machine_code(read_cells, self._arguments)

    def read(self) -> None:
        """Fill the readings."""
        self.generator.standard_normal(out=self._noise)
        self._read(*self._arguments)
