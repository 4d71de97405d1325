"""What is checked of a path before its first set point goes out, and the set points that follow from it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from sagline.arrays import Array, Indices, locked
from sagline.cables.model import CableModel
from sagline.control.gains import Gains, gains_along
from sagline.control.states import RefusedError
from sagline.dynamics.drives import lever_of
from sagline.kinematics.inverse import inverse
from sagline.kinematics.plan import Plan
from sagline.kinematics.status import PoseStatus
from sagline.motion.path import Path
from sagline.robot.drum import drum_tension
from sagline.robot.equilibrium import Equilibrium
from sagline.robot.pose import Pose
from sagline.robot.robot import Robot
from sagline.tension.method import TensionMethod

START: Final = 2e-3  # m: so far may a path begin from where the platform is
ON_TICK: Final = 1e-6  # of a period: so far may a sample be from it
AT_REST: Final = 1e-3  # m/s and rad/s: a path that begins or ends faster would strike the winches


@dataclass(frozen=True, slots=True, eq=False)
class Motion:
    """A plan that was checked whole, one row a cycle: what set points are taken from.

    Attributes:
        plan: At the ticks, the last of them at or after the path's end; None for a jog.
        state: Robot, poses and cables at the rows.
        length: Unstrained lengths off the drums [m], shape (N, m).
        rate: Their rates [m/s], shape (N, m); zero in the last row.
        tension: T_A, at the frame ends [N], shape (N, m).
        drum_tension: Where the cables leave the drums [N], shape (N, m).
        wrench: External plus inertial, on the platform [N, N m], shape (N, 6).
        gains: Of the tension loop; None for a robot without redundancy.
    """

    plan: Plan | None
    state: Equilibrium
    length: Array
    rate: Array
    tension: Array
    drum_tension: Array
    wrench: Array
    gains: Gains | None

    def __len__(self) -> int:
        """Number of rows N."""
        return len(self.length)


def motion_along(
    robot: Robot,
    path: Path,
    period: float,
    model: CableModel,
    method: TensionMethod,
    previous: Plan | None = None,
) -> Motion:
    """Plan a path and check all of it.

    Args:
        robot: The robot as the controller knows it.
        path: From rest to rest, with a sample at every tick.
        period: Of a cycle [s].
        model: Of the cables.
        method: How the load is shared.
        previous: The plan that is held now, which `Closest` goes on from.

    Returns:
        The motion.

    Raises:
        RefusedError: If the path has no samples at the ticks, does not begin and end at rest, a pose has no tensions
            within the limits, or a winch would have to be too fast or too strong; it says where, and the next step.
        InvalidValueError: If data of the winches are missing.
    """
    _check_rest(path)
    ticked = _at_ticks(path, period)
    plan = inverse(robot, ticked, model, method, previous=previous)
    _check_feasible(plan)
    rate, drum = plan.length_rate, drum_tension(plan.state)
    assert rate is not None
    _check_winches(plan, rate, drum)
    last = np.array(rate)
    last[-1] = 0.0
    return Motion(
        plan=plan,
        state=plan.state,
        length=plan.unstrained_length,
        rate=locked(last),
        tension=plan.state.cables.frame_end_tension,
        drum_tension=drum,
        wrench=plan.state.wrench,
        gains=gains_along(plan),
    )


def check_start(robot: Robot, here: Pose, start: Pose) -> None:
    """Refuse a motion that begins elsewhere.

    Args:
        robot: The robot.
        here: Where the platform is.
        start: Where the motion begins.

    Raises:
        RefusedError: If a platform anchor or the origin would jump by more than 2 mm.
    """
    points = np.vstack((np.zeros(3), robot.platform_anchors))
    jump = float(np.linalg.norm(start.transform(points) - here.transform(points), axis=1).max())
    if not jump <= START:
        place = ", ".join(f"{x:.4f}" for x in here.position)
        away = f"it begins {1e3 * jump:.3g} mm from where the platform is; allowed: {1e3 * START:g} mm"
        raise RefusedError("the path", away, f"Go to its first pose, or begin it at ({place}) m.")


def _at_ticks(path: Path, period: float) -> Path:
    """The samples of a path at the ticks, and its end held until the next one."""
    time = path.time - path.time[0]
    count = int(np.floor(time[-1] / period + ON_TICK)) + 1
    ticks = np.asarray(period * np.arange(count), dtype=np.float64)
    chosen = np.minimum(np.searchsorted(time, ticks - ON_TICK * period), len(time) - 1)
    missing = np.abs(time[chosen] - ticks) > ON_TICK * period
    if missing.any():
        at = float(ticks[np.argmax(missing)])
        reason = f"it has no sample at {at:g} s; a cycle takes {1e3 * period:g} ms, and asks for one at each"
        raise RefusedError("the path", reason, f"Make it with rate={1.0 / period:g}, or a multiple of it.")
    if time[-1] - ticks[-1] > ON_TICK * period:
        chosen, ticks = np.append(chosen, len(time) - 1), np.append(ticks, [period * count])
    if len(ticks) < 2:
        raise RefusedError("the path", f"it takes {time[-1]:g} s, no cycle", "Give one that moves.")
    return _taken(path, chosen, ticks)


def _taken(path: Path, chosen: Indices, time: Array) -> Path:
    jerk = None if path.jerk is None else path.jerk[chosen]
    return Path(time, path.pose[chosen], path.twist[chosen], path.twist_rate[chosen], jerk)


def _check_rest(path: Path) -> None:
    for end, row in (("begins", 0), ("ends", -1)):
        speed = float(np.abs(path.twist[row]).max())
        if not speed <= AT_REST:
            reason = f"it {end} at {speed:.3g} m/s or rad/s; allowed: {AT_REST:g}"
            raise RefusedError("the path", reason, "Make it from rest to rest, with quintic_path for instance.")


def _check_feasible(plan: Plan) -> None:
    gaps = plan.gaps
    if not gaps:
        return
    gap = gaps[0]
    assert plan.path is not None
    place = ", ".join(f"{x:.3f}" for x in plan.state.pose.position[gap.first])
    more = f" and {len(gaps) - 1} more stretches" if len(gaps) > 1 else ""
    reason = f"at {plan.path.time[gap.first]:.2f} s, ({place}) m,{more} its status is {PoseStatus(gap.status).name}"
    cables = f", cables {', '.join(map(str, gap.cables))} at their limits" if gap.cables else ""
    raise RefusedError("the path", reason + cables, "Lead it elsewhere, make it slower, or check it with inverse().")


def _check_winches(plan: Plan, rate: Array, drum: Array) -> None:
    """Refuse what a winch cannot do, where its limits are known."""
    robot, path = plan.state.one_robot, plan.path
    winches = robot.winches
    assert winches is not None
    assert path is not None
    ratio = np.abs(winches.gear) / lever_of(robot, plan.unstrained_length)  # radians of the motor for a meter of cable
    _refuse_beyond(path, "turn at", rate * ratio, winches.speed_limit, "rad/s")
    if winches.inertia is not None:
        acceleration = np.gradient(rate, path.time, axis=0)
        force = winches.inertia * ratio**2 * acceleration + winches.friction * np.sign(rate) - drum
        _refuse_beyond(path, "give", force / ratio, winches.torque_limit, "N m")


def _refuse_beyond(path: Path, verb: str, values: Array, limit: Array | None, unit: str) -> None:
    if limit is None or not (np.abs(values) > limit).any():
        return
    k, i = (int(index) for index in np.unravel_index(np.argmax(np.abs(values) / limit), values.shape))
    reason = f"at {path.time[k]:.2f} s the motor of winch {i} would {verb} {abs(values[k, i]):.3g} {unit}"
    raise RefusedError("the path", f"{reason}; allowed: {limit[i]:.3g} {unit}", "Make it slower, or lighter.")
