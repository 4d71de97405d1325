"""Sources of set points: constant, along a plan, along a ramp to rest, and jogs."""

from __future__ import annotations

from math import ceil
from typing import Final, NamedTuple, Protocol, TypeVar

import numpy as np
from scipy.spatial.transform import Rotation

from sagline.cables.model import CableModel
from sagline.control.checks import Motion, check_lead
from sagline.control.link import RAMP
from sagline.control.null_space import NullSpace, null_space
from sagline.control.states import RefusedError
from sagline.core.arrays import Array, Flags
from sagline.kinematics.forward import forward
from sagline.kinematics.inverse_solver import InverseSolver
from sagline.kinematics.status import STABLE, ForwardStatus, PoseStatus
from sagline.robot.drum import drum_tension
from sagline.robot.equilibrium import Equilibrium
from sagline.robot.pose import Pose
from sagline.robot.robot import Robot
from sagline.tension.method import TensionMethod

LEAD_SPEED: Final = 0.01  # [m/s], largest rate in the transition from the lengths at rest to the lengths of a plan
WHOLE: Final = 1e-9  # tolerance of the time on the path, in rows


class SetPoint(NamedTuple):
    """Set point for the end of a cycle."""

    length: Array  # unstrained lengths off the drums in the model [m], shape (m,)
    rate: Array  # rates of these lengths [m/s], shape (m,)
    tension: Array  # T_A planned for the set point [N], shape (m,); NaN if unknown
    drum_tension: Array  # expected tension at the drums [N], shape (m,)
    wrench: Array | None  # external plus inertial wrench on the platform [N, N m], shape (6,); None for zero
    row: NullSpace | None  # matrices of the tension loop at the set point; None without matrices
    clock: float  # time since the start of the plan [s]; NaN outside a plan
    done: bool  # True for the last set point of a source
    enable: Flags | None = None  # drives that may move, shape (m,); None for all drives
    # True during the transition from the lengths at rest to the lengths of a plan. The tensions then differ from the
    # planned tensions.
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
        row = null_space(state) if redundant else None
        length, tension, drum = state.unstrained_length, state.cables.frame_end_tension, drum_tension(state)
        return cls(SetPoint(length, np.zeros(len(length)), tension, drum, None, row, np.nan, True), state.pose)

    def step(self) -> SetPoint:
        """Return the constant set point."""
        return self._point


def standing_at(robot: Robot, length: Array, start: Pose | None, model: CableModel) -> Standing | ForwardStatus:
    """Constant set point for `length` [m], (m,), with its pose. If no pose is found, the status of the search."""
    found = forward(robot, length, start, model)
    return Standing.at(found.state) if found.status in STABLE else ForwardStatus(int(found.status))


class _Fade:
    """Smooth transition from the lengths at rest to the lengths of a plan."""

    def __init__(self, lead: Array, period: float) -> None:
        """Begin with the whole difference `lead` [m], (m,); `period` [s]."""
        largest = float(np.abs(lead).max())
        self._lead, self._period = lead, period
        self._cycle, self._cycles = 0, ceil(max(RAMP, 1.5 * largest / LEAD_SPEED) / period) if largest > 0.0 else 0

    @property
    def done(self) -> bool:
        return self._cycle >= self._cycles

    def step(self) -> tuple[Array, Array] | None:
        """Remaining difference [m] at the end of the next cycle, and its rate [m/s], (m,) each; None if it is zero."""
        self._cycle += 1
        if self.done:
            return None
        share = self._cycle / self._cycles
        fall = _smooth_slope(share) / (self._cycles * self._period)
        return (1.0 - _smooth(share)) * self._lead, -fall * self._lead


class Along:
    """Set points along a motion, on a clock that can slow down, stop and continue."""

    def __init__(self, motion: Motion, period: float, lead: Array) -> None:
        """Begin at the first row of `motion`. The offset `lead` [m], (m,), decreases to zero; `period` [s]."""
        self.motion = motion
        self._period, self._last = period, len(motion) - 1
        self._row = 0.0
        self._speed = self._wanted = 1.0
        self._change = period / RAMP
        self._fade = _Fade(lead, period)

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
    """Ramp l' = l'_0 (1 - t/t_s) that reduces all rates to zero in the same time; their ratios are constant."""

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


def _smooth(share: _Real) -> _Real:
    """Cubic function from 0 to 1, with a slope of zero at both ends and of at most 1.5 between them."""
    return share * share * (3.0 - 2.0 * share)


def _smooth_slope(share: _Real) -> _Real:
    return 6.0 * share * (1.0 - share)


WINCH_SPEED: Final = 0.01  # speed of a winch jog [m/s]
PLATFORM_SPEED: Final = 0.02  # speed of a platform jog [m/s]
PLATFORM_TURNING: Final = 0.05  # angular speed of a platform jog [rad/s]
SHORTEST: Final = 0.4  # shortest duration of a jog [s]


def _winch_lengths(length: Array, winch: int, by: float, period: float) -> tuple[Array, Array]:
    """Lengths and rates (N, m) of a jog from `length` [m], one row per `period` [s]. `by`: change of `winch` [m]."""
    count = ceil(max(SHORTEST, 1.5 * abs(by) / WINCH_SPEED) / period)
    share = np.arange(count + 1) / count
    lengths, rates = np.repeat(length[None], count + 1, axis=0), np.zeros((count + 1, len(length)))
    lengths[:, winch] += by * _smooth(share)
    rates[:, winch] = by * _smooth_slope(share) / (count * period)
    return lengths, rates


class HomingJog:
    """Set points for a jog of one winch, while the pose of the platform is unknown."""

    def __init__(self, point: SetPoint, winch: int, by: float, period: float) -> None:
        """Begin at the present lengths of the winches. `by`: change of the length of `winch` [m]; `period` [s]."""
        self._lengths, self._rates = _winch_lengths(point.length, winch, by, period)
        self._row, self._point = 0, point
        self._enable = np.zeros(len(point.length), dtype=np.bool_)
        self._enable[winch] = True

    def step(self) -> SetPoint:
        """The set point at the end of the next cycle."""
        last = len(self._lengths) - 1
        self._row = min(self._row + 1, last)
        return self._point._replace(
            length=self._lengths[self._row], rate=self._rates[self._row], done=self._row == last, enable=self._enable
        )


def winch_jog(
    robot: Robot, length: Array, here: Pose, winch: int, by: float, period: float, model: CableModel
) -> Motion:
    """Plan and check a jog of `winch` by `by` [m], from `length` [m], (m,), at rest. The platform moves along."""
    lengths, rates = _winch_lengths(length, winch, by, period)
    found = forward(robot, lengths, here, model)
    what, step = f"a jog of winch {winch} by {1e3 * by:+g} mm", "Jog it by less, or jog another winch."
    if not found.solved.all():
        k = int(np.argmin(found.solved))
        reason = f"after {1e3 * abs(lengths[k, winch] - lengths[0, winch]):.2g} mm the platform has no equilibrium"
        raise RefusedError(what, f"{reason}: {ForwardStatus(found.status[k]).name}", step)
    tension = found.state.limited_tension
    for name, limit, wrong in (
        ("tension_min", robot.tension_min, tension < robot.tension_min),
        ("tension_max", robot.tension_max, tension > robot.tension_max),
    ):
        leaves = wrong & ~wrong[0]  # a cable beyond its limit may be jogged back
        if leaves.any():
            k, i = (int(index) for index in np.argwhere(leaves)[0])
            reason = f"cable {i} would have {tension[k, i]:.3g} N; allowed: its {name}, {limit[i]:.3g} N"
            raise RefusedError(what, reason, step)
    state, wrench = found.state, np.zeros((len(lengths), 6))
    tension, drum = state.cables.frame_end_tension, drum_tension(state)
    return Motion(period, None, state, lengths, rates, tension, drum, wrench, gains=None)


class PlatformJog:
    """Jog of the platform along a straight line. Each cycle computes the plan of one pose."""

    def __init__(
        self,
        robot: Robot,
        begin: SetPoint,
        pose: Pose,
        by: Array,
        period: float,
        model: CableModel,
        method: TensionMethod,
    ) -> None:
        """Prepare the solver, and check the last pose. `by`: displacement and rotation [m, rad], (6,); `period` [s]."""
        self._robot, self._pose, self._by, self._period = robot, pose, by, period
        self._solver = InverseSolver(robot, model, method)
        move, turn = float(np.linalg.norm(by[:3])), float(np.linalg.norm(by[3:]))
        lasting = max(SHORTEST, 1.5 * move / PLATFORM_SPEED, 1.5 * turn / PLATFORM_TURNING)
        self._count, self._cycle = ceil(lasting / period), 0
        self._weight = robot.cables.linear_density * robot.gravity
        self._point = begin
        self.failed, self.stops_hard = "", False
        end = self._solver.step(*self._at(1.0))
        if end.status is not PoseStatus.SOLVED:
            reason = f"the pose at its end is {end.status.name}"
            raise RefusedError("the jog", reason, "Jog by less, or in another direction.")
        self._solver.reset()
        first = self._solver.step(*self._at(0.0))
        lead = begin.length - first.unstrained_length
        check_lead("the jog", lead)
        self._fade = _Fade(lead, period)

    def step(self) -> SetPoint:
        """Set point of the next cycle, or the last set point if the next pose has no solution; see `failed`."""
        self._cycle = min(self._cycle + 1, self._count)
        share = self._cycle / self._count
        found = self._solver.step(*self._at(_smooth(share)))
        if found.status is not PoseStatus.SOLVED:
            self.failed = f"the jog ended after {1e2 * share:.0f} %: the next pose is {found.status.name}"
            self._point, self.stops_hard = self._point._replace(done=True), bool(self._point.rate.any())
            return self._point
        left = self._fade.step()
        length = found.unstrained_length if left is None else found.unstrained_length + left[0]
        rate = (length - self._point.length) / self._period
        hanging = found.vertical_force - self._weight * found.unstrained_length  # without pulleys and dead length
        tension = np.hypot(found.horizontal_tension, hanging)
        done = self._cycle == self._count and left is None
        self._point = self._point._replace(
            length=length,
            rate=np.zeros(len(rate)) if done else rate,
            tension=tension,
            drum_tension=tension,
            done=done,
            leading=left is not None,
        )
        return self._point

    def _at(self, share: float) -> tuple[Array, Array]:
        """Position and quaternion after the share `share` of the displacement."""
        by = share * self._by
        turned = Rotation.from_rotvec(by[3:]) * self._pose.rotation
        return self._pose.position + by[:3], turned.as_quat()
