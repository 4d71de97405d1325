"""Planned motions, and checks of a motion before its first set point is sent."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from sagline.cables.model import CableModel
from sagline.control.null_space import Gains, gains_along
from sagline.control.states import RefusedError
from sagline.core.arrays import Array, locked
from sagline.kinematics.inverse import inverse
from sagline.kinematics.plan import Plan
from sagline.kinematics.status import PoseStatus
from sagline.motion.path import Path
from sagline.robot.drum import drum_lever, drum_tension
from sagline.robot.equilibrium import Equilibrium
from sagline.robot.robot import Robot
from sagline.tension.method import TensionMethod

ON_TICK: Final = 1e-6  # largest distance of a sample from a tick, as a share of a period
LARGEST_LEAD: Final = 5e-3  # [m], largest distance of a plan's first lengths from the lengths at rest
ROUNDING: Final = 5e-6  # [m], allowed difference between lengths and integrated rates if the accelerations are zero
LARGEST_STEP: Final = 1e-3  # [m], larger steps count as a jump of an encoder
AT_REST: Final = 1e-3  # [m/s] and [rad/s], largest speed at both ends of a path; the winches tolerate such a jump


@dataclass(frozen=True, slots=True, eq=False)
class Motion:
    """Checked plan, with one row of set points for each cycle.

    Attributes:
        period: Period of a cycle and time between two rows [s].
        plan: Plan at the ticks. The last tick is at the end of the path or less than a period later. None for a jog.
        state: Robot, poses and cables at the rows.
        length: Unstrained lengths off the drums [m], shape (N, m).
        rate: Rates of these lengths [m/s], shape (N, m); zero in the last row.
        tension: T_A, tension at the frame ends [N], shape (N, m).
        drum_tension: Tension at the drums [N], shape (N, m).
        wrench: External plus inertial wrench on the platform [N, N m], shape (N, 6).
        gains: Gains of the tension loop; None for a robot without redundancy.
    """

    period: float
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

    @property
    def robot(self) -> Robot:
        """Robot of the plan."""
        return self.state.one_robot


def plan_motion(
    robot: Robot,
    path: Path,
    period: float,
    model: CableModel,
    method: TensionMethod,
    previous: Plan | Array | None = None,
) -> Motion:
    """Plan `path` for cycles of `period` [s], and check the plan completely. `previous`: as in `inverse`."""
    _check_rest(path)
    ticked = _at_ticks(path, period)
    plan = inverse(robot, ticked, model, method, previous=previous)
    _check_feasible(plan, ticked)
    rate, drum = plan.length_rate, drum_tension(plan.state)
    if rate is None:
        raise RefusedError("the path", "the plan has no rates of the lengths", "Give a path with times and twists.")
    _check_winches(robot, ticked, plan.unstrained_length, rate, drum)
    _check_steps(np.minimum(ticked.time, path.time[-1] - path.time[0]), plan.unstrained_length, rate)
    last = np.array(rate)
    last[-1] = 0.0
    state, length, tension = plan.state, plan.unstrained_length, plan.state.cables.frame_end_tension
    return Motion(period, plan, state, length, locked(last), tension, drum, state.wrench, gains_along(plan))


def check_lead(what: str, lead: Array) -> None:
    """Reject a plan if its first lengths differ too much from the lengths at rest. `lead`: differences [m], (m,)."""
    i = int(np.argmax(np.abs(lead)))
    if not abs(lead[i]) <= LARGEST_LEAD:
        away, allowed = f"{1e3 * lead[i]:+.3g} mm", f"{1e3 * LARGEST_LEAD:g} mm"
        reason = f"the length of winch {i} differs by {away} from the plan; allowed: {allowed}"
        raise RefusedError(what, reason, "Jog the winches back, or home again.")


def _at_ticks(path: Path, period: float) -> Path:
    """Samples of `path` at the ticks, one tick per `period` [s]. The end pose is held until the tick after it."""
    time = path.time - path.time[0]
    count = int(np.floor(time[-1] / period + ON_TICK)) + 1
    ticks = np.asarray(period * np.arange(count), dtype=np.float64)
    chosen = np.minimum(np.searchsorted(time, ticks - ON_TICK * period), len(time) - 1)
    missing = np.abs(time[chosen] - ticks) > ON_TICK * period
    if missing.any():
        at = float(ticks[np.argmax(missing)])
        reason = f"it has no sample at {at:g} s; every cycle of {1e3 * period:g} ms needs a sample"
        raise RefusedError("the path", reason, f"Make the path with rate={1.0 / period:g}, or a multiple of it.")
    if time[-1] - ticks[-1] > ON_TICK * period:
        chosen, ticks = np.append(chosen, len(time) - 1), np.append(ticks, [period * count])
    if len(ticks) < 2:
        raise RefusedError("the path", f"it takes {time[-1]:g} s, less than a cycle", "Give a longer path.")
    jerk = None if path.jerk is None else path.jerk[chosen]
    return Path(ticks, path.pose[chosen], path.twist[chosen], path.twist_rate[chosen], jerk)


def _check_rest(path: Path) -> None:
    for end, row in (("begins", 0), ("ends", -1)):
        speed = float(np.abs(path.twist[row]).max())
        if not speed <= AT_REST:
            reason = f"it {end} at {speed:.3g} m/s or rad/s; allowed: {AT_REST:g}"
            raise RefusedError("the path", reason, "Make a path from rest to rest, for example with quintic_path.")


def _check_feasible(plan: Plan, path: Path) -> None:
    gaps = plan.gaps
    if not gaps:
        return
    gap = gaps[0]
    place = ", ".join(f"{x:.3f}" for x in plan.state.pose.position[gap.first])
    more = f" and {len(gaps) - 1} more sections" if len(gaps) > 1 else ""
    reason = f"at {path.time[gap.first]:.2f} s, ({place}) m,{more} its status is {PoseStatus(gap.status).name}"
    cables = f", cables {', '.join(map(str, gap.cables))} at their limits" if gap.cables else ""
    raise RefusedError("the path", reason + cables, "Change the path, make it slower, or check it with inverse().")


def _check_winches(robot: Robot, path: Path, length: Array, rate: Array, drum: Array) -> None:
    """Reject speeds and torques above the known limits of the winches."""
    winches = robot.winches
    lever = drum_lever(robot, length)  # the conversion raises an error if data of the winches are missing
    if winches is None:
        return
    ratio = np.abs(winches.gear) / lever  # rotation of the motor per length of cable [rad/m]
    speed, step = winches.speed_limit, np.diff(length, axis=0) / np.diff(path.time)[:, None]
    _refuse_beyond(path, "turn at", rate * ratio, speed, "rad/s")
    _refuse_beyond(path, "turn at", step * 0.5 * (ratio[1:] + ratio[:-1]), speed, "rad/s")
    if winches.inertia is not None:
        acceleration = np.gradient(rate, path.time, axis=0)
        force = winches.inertia * ratio**2 * acceleration + winches.friction * np.sign(rate) - drum
        _refuse_beyond(path, "give", force / ratio, winches.torque_limit, "N m")


def _check_steps(time: Array, length: Array, rate: Array) -> None:
    """Reject a path whose twists contradict its poses, because then the rates do not agree with the lengths."""
    # Within a step h, the rate is assumed to be between the rates at both ends. The change of length then differs from
    # h times the mean rate by at most h/2 times the difference of the rates. The largest difference of the rates in
    # this step and its two neighbors is used. A deviation above the allowed jump of an encoder is never accepted. The
    # steps are between the samples of the path. Ticks are not used, because the path may end before a tick.
    h = np.diff(time)[:, None]
    off = np.abs(np.diff(length, axis=0) - 0.5 * h * (rate[1:] + rate[:-1]))
    change = np.abs(np.diff(rate, axis=0))
    near = np.concatenate((change[:1], change, change[-1:]))
    largest = np.maximum(np.maximum(near[:-2], near[1:-1]), near[2:])
    allowed = np.minimum(ROUNDING + 0.5 * h * largest, LARGEST_STEP)
    if not (off > allowed).any():
        return
    k, i = (int(index) for index in np.unravel_index(np.argmax(off / allowed), off.shape))
    reason = (
        f"from {time[k]:g} s to {time[k + 1]:g} s the length of cable {i} differs from its rate by "
        f"{1e3 * off[k, i]:.3g} mm; allowed: {1e3 * allowed[k, i]:.3g} mm"
    )
    raise RefusedError("the path", reason, "Use path_from_samples, because poses jump, or twists do not match them.")


def _refuse_beyond(path: Path, verb: str, values: Array, limit: Array | None, unit: str) -> None:
    if limit is None or (np.abs(values) <= limit).all():
        return
    k, i = (int(index) for index in np.unravel_index(np.argmax(np.abs(values) / limit), values.shape))
    reason = f"at {path.time[k]:.2f} s the motor of winch {i} would {verb} {abs(values[k, i]):.3g} {unit}"
    raise RefusedError("the path", f"{reason}; allowed: {limit[i]:.3g} {unit}", "Move slower, or with a smaller mass.")
