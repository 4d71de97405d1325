"""What encoders and load cells read of a robot that is simulated; seeded, and into memory of their own."""

from __future__ import annotations

import numpy as np

from sagline.arrays import Array
from sagline.kernels.cable.drum import turns_of_lengths
from sagline.robot.drum import Drums, drums_of
from sagline.robot.robot import Robot

COUNTED = ("drum_radius", "groove_pitch", "counts_per_turn", "length_zero")  # what an encoder's counts need


class Encoders:
    """Encoders on drums.

    Attributes:
        counts: Whole counts, as floats, (m,).
    """

    def __init__(self, robot: Robot) -> None:
        """Look at the drums of a robot that has all that counts need."""
        self._drums: Drums = drums_of(robot)
        self._winches = self._drums.winches
        zero, self._rate = self._drums._zero()
        self._offset: Array = self._winches.count_zero + zero * self._rate
        self._turns, self._travel = np.empty((1, robot.cable_count)), np.empty((1, robot.cable_count))
        self.counts = self._turns[0]

    @staticmethod
    def are_on(robot: Robot) -> bool:
        """Whether a robot's winches and cables have all that counts need."""
        winch = robot.winches
        known = winch is not None and all(getattr(winch, name) is not None for name in COUNTED)
        return known and robot.cables.diameter is not None

    def read(self, path: Array) -> None:
        """Fill the counts at lengths off the drums along the path of winding [m], (1, m)."""
        turns_of_lengths(self._drums.table, self._drums.starts, path, self._turns, self._travel)
        np.multiply(self.counts, self._rate, out=self.counts)
        np.subtract(self._offset, self.counts, out=self.counts)
        np.rint(self.counts, out=self.counts)


class LoadCells:
    """Load cells at the frame ends of the cables.

    Attributes:
        reading: [N], (m,).
        generator: Of the noise.
    """

    def __init__(self, robot: Robot, seed: int) -> None:
        """Make the load cells of a robot; without winches they read what is there."""
        m, winch = robot.cable_count, robot.winches
        none, one = np.zeros(m), np.ones(m)
        self._gain = one if winch is None else winch.load_cell_gain
        self._bias = none if winch is None else winch.load_cell_bias
        self._deviation = none if winch is None else winch.load_cell_deviation
        most = None if winch is None else winch.load_cell_range
        self._range = np.full(m, np.inf) if most is None else most
        self.generator = np.random.default_rng(seed)
        self.reading = np.empty(m)
        self._noise = np.empty(m)

    def read(self, tension: Array) -> None:
        """Fill the readings at tensions behind the filter [N], (m,): gain, bias and noise, within the range."""
        self.generator.standard_normal(out=self._noise)
        np.multiply(self._noise, self._deviation, out=self._noise)
        np.multiply(tension, self._gain, out=self.reading)
        np.add(self.reading, self._bias, out=self.reading)
        np.add(self.reading, self._noise, out=self.reading)
        np.minimum(self.reading, self._range, out=self.reading)
