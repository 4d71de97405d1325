"""Jogging of one winch, or of the platform along a straight line."""

from __future__ import annotations

from math import ceil
from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from sagline.cables.model import CableModel
from sagline.control.checks import Motion, check_lead
from sagline.control.set_points import Fade, SetPoint, smooth, smooth_slope
from sagline.control.states import RefusedError
from sagline.core.arguments import whole_number
from sagline.core.arrays import Array, checked, number
from sagline.core.errors import InvalidValueError
from sagline.kinematics.forward import forward
from sagline.kinematics.inverse_solver import InverseSolver
from sagline.kinematics.status import ForwardStatus, PoseStatus
from sagline.robot.drum import drum_tension
from sagline.robot.pose import Pose
from sagline.robot.robot import Robot
from sagline.tension.method import TensionMethod

WINCH_SPEED: Final = 0.01  # speed of a winch jog [m/s]
PLATFORM_SPEED: Final = 0.02  # speed of a platform jog [m/s]
PLATFORM_TURNING: Final = 0.05  # angular speed of a platform jog [rad/s]
SHORTEST: Final = 0.4  # shortest duration of a jog [s]
MOST_WINCH: Final = 0.1  # largest jog of a winch [m]
MOST_PLATFORM: Final = 0.2  # largest jog of the platform [m or rad]


def checked_winch(robot: Robot, winch: int, by: float) -> tuple[int, float]:
    """Check the index `winch`, and the change `by` of its length [m]. Paid-out cable is positive."""
    chosen = whole_number(winch, "winch", 0, robot.cable_count - 1)
    return chosen, _at_most(number(by, "by", "m"), "m", MOST_WINCH)


def winch_lengths(length: Array, winch: int, by: float, period: float) -> tuple[Array, Array]:
    """Lengths and rates (N, m) of a jog from `length` [m]; `winch` changes by `by` [m]. One row per `period` [s]."""
    count = ceil(max(SHORTEST, 1.5 * abs(by) / WINCH_SPEED) / period)
    share = np.arange(count + 1) / count
    lengths, rates = np.repeat(length[None], count + 1, axis=0), np.zeros((count + 1, len(length)))
    lengths[:, winch] += by * smooth(share)
    rates[:, winch] = by * smooth_slope(share) / (count * period)
    return lengths, rates


def winch_jog(
    robot: Robot, length: Array, here: Pose, winch: int, by: float, period: float, model: CableModel
) -> Motion:
    """Plan and check a jog of `winch` by `by` [m], from `length` at rest [m], (m,). The jog moves the platform."""
    lengths, rates = winch_lengths(length, winch, by, period)
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
    return Motion(
        period=period,
        plan=None,
        state=found.state,
        length=lengths,
        rate=rates,
        tension=found.state.cables.frame_end_tension,
        drum_tension=drum_tension(found.state),
        wrench=np.zeros((len(lengths), 6)),
        gains=None,
    )


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
        """Prepare the solver and check the last pose; `by`: displacement, rotation [m, rad], (6,); `period` [s]."""
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
        self._fade = Fade(lead, period)

    def step(self) -> SetPoint:
        """Set point of the next cycle. If its pose has no solution: the last set point; `failed` is then the reason."""
        self._cycle = min(self._cycle + 1, self._count)
        share = self._cycle / self._count
        found = self._solver.step(*self._at(smooth(share)))
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
        half = 0.5 * float(np.linalg.norm(by[3:]))
        x, y, z = 0.5 * np.sinc(half / np.pi) * by[3:]
        w = np.cos(half)
        a, b, c, d = self._pose.quaternion
        turned = np.array(
            [
                w * a + x * d + y * c - z * b,
                w * b - x * c + y * d + z * a,
                w * c + x * b - y * a + z * d,
                w * d - x * a - y * b - z * c,
            ]
        )
        return self._pose.position + by[:3], turned / np.linalg.norm(turned)


def checked_displacement(by: ArrayLike) -> Array:
    """Check `by`: a displacement, with or without a rotation vector. Return both, (6,); a missing rotation is zero."""
    given = checked(by, "by", "m or rad")
    if given.shape not in ((3,), (6,)):
        step = "Give a displacement, or a displacement and a rotation vector."
        raise InvalidValueError("by", f"of shape {given.shape}", "shape (3,) or (6,)", step)
    whole = np.zeros(6)
    whole[: given.size] = given
    for part, unit in ((whole[:3], "m"), (whole[3:], "rad")):
        _at_most(float(np.linalg.norm(part)), unit, MOST_PLATFORM)
    return whole


def _at_most(by: float, unit: str, most: float) -> float:
    if abs(by) <= most:
        return by
    raise InvalidValueError("by", f"{by:g} {unit}", f"up to {most:g} {unit} at a time", "Jog in parts, or use go_to.")
