"""Between the lengths off a robot's drums and what their encoders count."""

from __future__ import annotations

import numpy as np

from sagline.core.arrays import Array
from sagline.core.errors import InvalidValueError
from sagline.dynamics.drives import lever_of
from sagline.kernels.cable.drum import lengths_of_turns, turns_of_lengths
from sagline.robot.drum import drums_of
from sagline.robot.robot import Robot


class Scale:
    """Counts of lengths and lengths of counts, (m,); turn by turn where the drums are known, else by one radius each.

    Attributes:
        per_meter: Counts for a meter of unstrained cable let out, where it was made, (m,).
    """

    def __init__(self, robot: Robot, length: Array, counts: Array) -> None:
        """Take a robot's drums, and where their encoders stand.

        Args:
            robot: The robot; drums are known where its winches have groove_pitch and its cables a diameter.
            length: Unstrained lengths off the drums [m], (m,).
            counts: What the encoders read there, (m,).

        Raises:
            InvalidValueError: If the robot's winches have no drum_radius or no counts_per_turn, or the drums cannot
                hold what is left at these lengths.
        """
        winch = robot.winches
        if winch is None or winch.counts_per_turn is None:
            step = "Give it in the robot file, or with robot.replace(winches=Winch(counts_per_turn=...))."
            raise InvalidValueError("winches: counts_per_turn", "not given", "known where encoders count", step)
        stretch = 1.0 + winch.winding_tension / robot.cables.axial_stiffness
        each = winch.gear * winch.counts_per_turn
        self.per_meter = each * stretch / (2.0 * np.pi * lever_of(robot, length))
        self._drums = None
        if winch.groove_pitch is not None and robot.cables.diameter is not None:
            drums = drums_of(robot)
            self._drums = (drums.table, drums.starts)
            self._stretch, self._each, self._room = stretch, each, np.empty((3, 1, robot.cable_count))
            self._at_no_turns = counts + each * drums.turns((length * stretch)[None])[0][0]
        else:
            self._at_no_length = counts - length * self.per_meter

    def counts(self, length: Array) -> Array:
        """Of the encoders, not rounded, at unstrained lengths off the drums [m]."""
        if self._drums is None:
            found: Array = length * self.per_meter + self._at_no_length
            return found
        path, turns, travel = self._room
        np.multiply(length, self._stretch, out=path[0])
        turns_of_lengths(*self._drums, path, turns, travel)
        found = self._at_no_turns - turns[0] * self._each
        return found

    def lengths(self, counts: Array) -> Array:
        """Unstrained, off the drums [m], at counts of the encoders."""
        if self._drums is None:
            found: Array = (counts - self._at_no_length) / self.per_meter
            return found
        path, turns, _ = self._room
        np.divide(self._at_no_turns - counts, self._each, out=turns[0])
        lengths_of_turns(*self._drums, turns, path)
        found = path[0] / self._stretch
        return found
