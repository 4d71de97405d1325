"""A controller that executes the calls of a test only."""

from __future__ import annotations

from functools import cache

import numpy as np

import sagline as sl
from sagline import Plan
from sagline.control import Command, Link, Missing, Mode, Sample
from sagline.core.arrays import Array
from tests.control.protocol import HEARTBEAT

HOME = sl.Pose.from_euler([0.0, 0.0, 1.5], 0.0, 0.0, 0.0)


class Pilot:
    """Sends commands over a link, one per cycle."""

    def __init__(self, link: Link, plan: Plan, owner: int = 77) -> None:
        """Take a plan, a single pose or along a path."""
        self.link, self.owner, self.counter, self.valid_for = link, owner, 0, HEARTBEAT
        self.length = np.atleast_2d(plan.unstrained_length)
        self.tension = np.atleast_2d(plan.state.cables.frame_end_tension)
        self.rate = np.zeros_like(self.length) if plan.length_rate is None else plan.length_rate
        self.enable = np.ones(self.length.shape[1], dtype=np.bool_)
        self.at = 0

    def send(self, mode: Mode, length: Array | None = None, rate: Array | None = None) -> Sample:
        """Send one command, by default for the present point of the plan; return the following sample."""
        self.counter += 1
        length = self.length[self.at] if length is None else length
        rate = np.zeros_like(length) if rate is None else rate
        command = Command(
            self.counter, self.owner, mode, self.valid_for, length, rate, self.tension[self.at], self.enable
        )
        return self._sample(self.link.exchange(command))

    def look(self) -> Sample:
        """Let a cycle pass without a command; return the sample."""
        return self._sample(self.link.exchange(None))

    def wait(self, seconds: float) -> list[Sample]:
        """Send nothing for a duration; return the samples."""
        return [self.look() for _ in range(round(seconds / 0.01))]

    def hold(self, seconds: float) -> list[Sample]:
        """Hold for a duration; return the samples."""
        return [self.send(Mode.HOLD) for _ in range(round(seconds / 0.01))]

    def go(self, seconds: float) -> list[Sample]:
        """Follow the plan for a duration; return the samples."""
        samples = []
        for _ in range(round(seconds / 0.01)):
            self.at = min(self.at + 1, len(self.length) - 1)
            samples.append(self.send(Mode.FOLLOW, rate=self.rate[self.at]))
        return samples

    @staticmethod
    def _sample(found: Sample | Missing) -> Sample:
        assert isinstance(found, Sample)
        return found


P2 = (-0.13, 1.42, 0.68)  # m, of Table 2


@cache
def leg(robot: sl.Robot, speed: float) -> Plan:
    """A straight plan from home to the second of the ten poses, with a given speed in the middle [m/s]."""
    waypoints = [HOME, sl.Pose.from_euler(list(P2), 0.0, 0.0, 0.0)]
    return sl.inverse(robot, sl.quintic_path(waypoints, speed=speed))
