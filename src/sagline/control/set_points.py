"""Sources of set points: constant, along a plan, and along a ramp to rest."""

from __future__ import annotations

from math import ceil
from typing import Final, NamedTuple, Protocol, TypeVar

import numpy as np

from sagline.cables.model import CableModel
from sagline.control.checks import Motion
from sagline.control.link import RAMP
from sagline.control.null_space import NullSpace, null_space
from sagline.core.arrays import Array, Flags
from sagline.kinematics.forward import forward
from sagline.kinematics.status import STABLE, ForwardStatus
from sagline.robot.drum import drum_tension
from sagline.robot.equilibrium import Equilibrium
from sagline.robot.pose import Pose
from sagline.robot.robot import Robot

LEAD_SPEED: Final = 0.01  # [m/s], largest rate of the transition from lengths at rest to the lengths of a plan
WHOLE: Final = 1e-9  # tolerance of the time, in rows


class SetPoint(NamedTuple):
    """Set point for the end of a cycle.

    Attributes:
        length: Unstrained lengths off the drums in the model [m], shape (m,).
        rate: Rates of these lengths [m/s], shape (m,).
        tension: T_A planned for the set point [N], shape (m,); NaN if unknown.
        drum_tension: Expected tension at the drums [N], shape (m,).
        wrench: External plus inertial wrench on the platform [N, N m], shape (6,); None for zero.
        row: Matrices of the tension loop at the set point; None without matrices.
        clock: Time since the start of the plan [s]; NaN outside a plan.
        done: True if the source ends here.
        enable: Drives that may move, shape (m,); None for all.
        leading: True during the transition from the lengths at rest to the lengths of a plan. The tensions then differ
            from the planned tensions.
    """

    length: Array
    rate: Array
    tension: Array
    drum_tension: Array
    wrench: Array | None
    row: NullSpace | None
    clock: float
    done: bool
    enable: Flags | None = None
    leading: bool = False


class SetPointSource(Protocol):
    """Source of one set point in each cycle."""

    def step(self) -> SetPoint:
        """Next set point; after the end, the last set point with zero rates."""


class Standing:
    """Constant set point."""

    def __init__(self, point: SetPoint, pose: Pose | None = None) -> None:
        """Begin at a set point."""
        self.pose = pose
        self._point = point._replace(rate=np.zeros(len(point.length)), clock=np.nan, done=True)

    @classmethod
    def at(cls, state: Equilibrium) -> Standing:
        """Constant set point for a single equilibrium."""
        robot = state.one_robot
        redundant = robot.cable_count > robot.degrees_of_freedom
        length = state.unstrained_length
        row = null_space(state) if redundant else None
        return cls(
            SetPoint(
                length,
                np.zeros(len(length)),
                state.cables.frame_end_tension,
                drum_tension(state),
                None,
                row,
                np.nan,
                True,
            ),
            state.pose,
        )

    def step(self) -> SetPoint:
        """Return the constant set point."""
        return self._point


def standing_at(robot: Robot, length: Array, start: Pose | None, model: CableModel) -> Standing | ForwardStatus:
    """Constant set point for `length` [m], (m,), and its pose. If no pose is found: the status of the search."""
    found = forward(robot, length, start, model)
    return Standing.at(found.state) if found.status in STABLE else ForwardStatus(int(found.status))


class Fade:
    """Smooth transition from the lengths at rest to the lengths of a plan."""

    def __init__(self, lead: Array, period: float) -> None:
        """Begin with the whole difference `lead` [m], (m,); `period` [s]."""
        largest = float(np.abs(lead).max())
        self._lead, self._period = lead, period
        self._cycle, self._cycles = 0, ceil(max(RAMP, 1.5 * largest / LEAD_SPEED) / period) if largest > 0.0 else 0

    @property
    def done(self) -> bool:
        """True if the difference is zero."""
        return self._cycle >= self._cycles

    def step(self) -> tuple[Array, Array] | None:
        """Remaining difference at the end of the next cycle [m], and its rate [m/s], both (m,); None if it is zero."""
        self._cycle += 1
        if self.done:
            return None
        share = self._cycle / self._cycles
        fall = smooth_slope(share) / (self._cycles * self._period)
        return (1.0 - smooth(share)) * self._lead, -fall * self._lead


class Along:
    """Set points along a motion, on a clock that can slow down and continue."""

    def __init__(self, motion: Motion, period: float, lead: Array) -> None:
        """Begin at the first row. The offset `lead` [m], (m,), decreases to zero. `period` is in s."""
        self.motion = motion
        self._period, self._last = period, len(motion) - 1
        self._row = 0.0
        self._speed = self._wanted = 1.0
        self._change = period / RAMP
        self._fade = Fade(lead, period)

    @property
    def clock(self) -> float:
        """Time since the start of the plan [s]."""
        return self._row * self._period

    @property
    def pose(self) -> Pose:
        """Pose of the nearest row."""
        return self.motion.state.pose[round(self._row)]

    @property
    def at_end(self) -> bool:
        """True if the end is reached."""
        return self._row >= self._last and self._fade.done

    def pause(self) -> None:
        """Slow the clock down to zero within the time of a ramp."""
        self._wanted = 0.0

    def resume(self) -> None:
        """Accelerate the clock to its full speed within the time of a ramp."""
        self._wanted = 1.0

    def step(self) -> SetPoint:
        """The set point at the end of the next cycle."""
        before, change = self._speed, self._change
        if before != self._wanted:
            self._speed = max(before - change, 0.0) if self._wanted < before else min(before + change, 1.0)
            if abs(self._speed - self._wanted) < WHOLE:
                self._speed = self._wanted
        self._row = row = min(self._row + 0.5 * (before + self._speed), float(self._last))
        left = self._fade.step()
        motion, k = self.motion, int(row)
        share = row - k
        if share < WHOLE:
            length, rate = motion.length[k], motion.rate[k]
            tension, drum = motion.tension[k], motion.drum_tension[k]
            if self._speed != 1.0:
                rate = self._speed * rate
        else:
            length, rate, tension, drum = self._between(k, share)
        if left is not None:
            length, rate = length + left[0], rate + left[1]
        done = self.at_end or (self._wanted == 0.0 and self._speed == 0.0)
        clock, gains = self.clock, motion.gains
        at = None if gains is None else gains.at(clock)
        on_plan = clock if motion.plan is not None else np.nan  # None for a jog
        return SetPoint(length, rate, tension, drum, motion.wrench[k], at, on_plan, done, None, left is not None)

    def _between(self, k: int, u: float) -> tuple[Array, Array, Array, Array]:
        """Interpolation between two rows: cubic in lengths and rates, linear in tensions."""
        motion, h = self.motion, self._period
        step = motion.length[k + 1] - motion.length[k]
        begin, end = h * motion.rate[k] - step, h * motion.rate[k + 1] - step
        length = motion.length[k] + u * step + u * (1.0 - u) * ((1.0 - u) * begin - u * end)
        slope = step + (1.0 - u) * (1.0 - 3.0 * u) * begin + u * (3.0 * u - 2.0) * end
        tension = (1.0 - u) * motion.tension[k] + u * motion.tension[k + 1]
        drum = (1.0 - u) * motion.drum_tension[k] + u * motion.drum_tension[k + 1]
        return length, (self._speed / h) * slope, tension, drum


class Ramp:
    """Ramp that reduces all rates to zero in the same time: l' = l'_0 (1 - t/t_s). The direction is preserved."""

    def __init__(self, point: SetPoint, period: float) -> None:
        """Begin at `point`, the last set point; `period` [s]."""
        self._begin = point
        self._share, self._cycle = period / RAMP, 0

    def step(self) -> SetPoint:
        """The set point at the end of the next cycle."""
        self._cycle += 1
        u = self._cycle * self._share
        done = u > 1.0 - WHOLE
        u = 1.0 if done else u
        begin = self._begin
        length = begin.length + (RAMP * (u - 0.5 * u * u)) * begin.rate
        return begin._replace(length=length, rate=(1.0 - u) * begin.rate, done=done)


_Real = TypeVar("_Real", float, Array)


def smooth(share: _Real) -> _Real:
    """Cubic from 0 to 1. Its slope is zero at both ends and at most 1.5."""
    return share * share * (3.0 - 2.0 * share)


def smooth_slope(share: _Real) -> _Real:
    """Derivative of `smooth`."""
    return 6.0 * share * (1.0 - share)
