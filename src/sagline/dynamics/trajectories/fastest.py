"""Fastest motion along the curve of a path within the tension limits."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Final

import numpy as np

from sagline.core.arguments import callback, instance
from sagline.core.arrays import Array, Progress, number
from sagline.core.errors import InvalidValueError
from sagline.dynamics.trajectories import profiles
from sagline.dynamics.trajectories.segments import Curve, RestToRestSegment, joined_path, sample_time, segments_of
from sagline.kinematics.inverse import inverse
from sagline.kinematics.plan import Plan
from sagline.kinematics.status import PoseStatus
from sagline.motion.path import Path
from sagline.robot.drum import drum_lever
from sagline.robot.robot import Robot
from sagline.statics.balance import inertial_wrench, structure_matrix

if TYPE_CHECKING:
    from scipy.interpolate import PPoly

_PLACES: Final = 201  # number of positions along a segment at which limits are evaluated
_ITERATIONS: Final = 8  # largest number of iterations for the sag forces
_CONVERGED: Final = 1e-7  # the iterations stop at a smaller relative change of the time
_INSTANTS: Final = 4001  # number of instants of a segment for the final check of the limits
# relative increase of the time after the first violation of a limit; each further violation multiplies it by four
_SLOWER: Final = 1e-6
_TRIES: Final = 12
_GENTLE: Final = 8  # number of initial attempts; each multiplies the time by the cube root of the excess speed
_ROUNDING: Final = 1e-12


def fastest(
    robot: Robot,
    path: Path,
    margin: float = 5.0,
    jerk: float | None = None,
    *,
    angular_jerk: float | None = None,
    progress: Progress | None = None,
) -> Path:
    """Fastest motion along the curve of a path within the tension limits; each segment is from rest to rest.

    The sagging cables satisfy the limits exactly: at each sample and at 4,000 instants of each segment, `inverse` finds
    tensions with the given margin to the limits. Without a jerk bound the acceleration is discontinuous, and winches
    cannot follow it. With a jerk bound, the curve parameter of each segment has 100 pieces with constant jerk. The
    duration of the segment is then about 0.1 % longer than the optimum, or less.

    Speed limits of the winches apply to the length changes due to the platform motion. With a jerk bound they also
    apply to the elastic length changes, which are computed with the method `Closest`.

    Args:
        robot: The robot. Its tension_min and tension_max apply to the tension named in tension_limits_of.
        path: Path that defines the curve and the poses at rest. Its times have no effect.
        margin: Distance from both limits [N], >= 0.
        jerk: Largest jerk of the platform's origin [m/s^3], > 0; None for no bound.
        angular_jerk: Largest second derivative of the angular velocity [rad/s^3], > 0; None for no bound.
        progress: Function that is called after each segment with two numbers: finished segments, all segments.

    Returns:
        Path at the sample rate of the given path. Its jerk is None without a jerk bound.

    Raises:
        InvalidValueError: If the path is in motion at an end or reverses in the middle of a curve. If the robot cannot
            hold a pose at rest with this margin: the message names the pose. If an argument is out of its range. If
            winches with a speed_limit have no drum_radius.

    Source:
        Pham & Pham, A new approach to time-optimal path parameterization based on reachability analysis, 2018;
        docs/howto/without-vibration.md.

    Examples:
        >>> import sagline as sl
        >>> robot = sl.load_robot("article-suspended")
        >>> path = sl.quintic_path([(0, 0, 1.5), (3, 0, 1.5)], durations=2.0)
        >>> quick = sl.fastest(robot, path, jerk=200.0)
        >>> plan = sl.inverse(robot, quick)
        >>> print(f"{quick.duration:.2f} s", plan.feasible.all())
        0.96 s True
    """
    inner = _with_margin(instance(robot, Robot, "robot"), number(margin, "margin", "N", low=0.0))
    sample_time(instance(path, Path, "path"))  # refuses a path of one sample
    limits = (
        np.inf if jerk is None else number(jerk, "jerk", "m/s^3", above=0.0),
        np.inf if angular_jerk is None else number(angular_jerk, "angular_jerk", "rad/s^3", above=0.0),
    )
    callback(progress, "progress")
    segments = segments_of(path)
    motions: list[PPoly | None] = []
    for k, segment in enumerate(segments):
        motions.append(None if segment.curve is None else _fastest_motion(inner, segment, segment.curve, limits))
        if progress is not None:
            progress(k + 1, len(segments))
    bounded = bool(np.isfinite(limits).any())
    for again in range(_TRIES):
        timed = [_timed(segment, motion) for segment, motion in zip(segments, motions, strict=True)]
        new = joined_path(path, timed, with_jerk=bounded)
        plan = inverse(inner, new)
        slower = 1.0 if plan.solved.all() else 1.0 + _SLOWER * 4.0**again
        if bounded and _has_speed_limits(robot):
            ratio = _speed_excess(plan)  # elastic terms are proportional to time^-3, the other terms to time^-1
            slower = max(slower, np.cbrt(ratio) if again < _GENTLE else ratio)
        if slower == 1.0:
            return new
        motions = [None if motion is None else profiles.slower(motion, slower) for motion in motions]
    raise _infeasible_error(f"of {len(segments)} moves", plan)


def _timed(segment: RestToRestSegment, motion: PPoly | None) -> RestToRestSegment:
    """The segment with a new motion; None for a segment at rest, which is unchanged."""
    if motion is None:
        return segment

    def rates(time: Array) -> Array:
        values = np.stack([motion(np.clip(time, 0.0, motion.x[-1]), order) for order in range(4)])
        values[0] = np.clip(values[0], 0.0, 1.0)
        return values

    return replace(segment, duration=float(motion.x[-1]), rates=rates)


def _with_margin(robot: Robot, margin: float) -> Robot:
    low, high = robot.tension_min + margin, robot.tension_max - margin
    if (low >= high).any():
        i = int(np.argmax(low >= high))
        most = f"< {0.5 * (robot.tension_max[i] - robot.tension_min[i]):g} N, half the range of cable {i}"
        raise InvalidValueError("margin", f"{margin:g} N", most, "Give a smaller margin.")
    return robot.replace(tension_min=low, tension_max=high)


def _fastest_motion(robot: Robot, segment: RestToRestSegment, curve: Curve, limits: tuple[float, float]) -> PPoly:
    """Fastest motion along one segment within the robot's limits."""
    where = f"from {segment.begin:g} s to {segment.begin + segment.duration:g} s"
    place = np.linspace(0.0, 1.0, _PLACES)
    jet = curve.at(place)
    rest = inverse(robot, jet.pose)
    if not rest.solved.all():
        raise _infeasible_error(f"{where} at rest", rest)
    balances, speeds = profiles.ForceBalance.at(robot, jet, rest), _winch_speed_bounds(robot, curve, place, rest)
    bounds, least = speeds(place), np.inf
    for _ in range(_ITERATIONS):
        motion = profiles.fastest_within(place, balances.half_planes().joined(bounds))
        if motion is None:
            raise _infeasible_error(f"{where} in motion", rest)
        before, least = least, float(motion.x[-1])
        if abs(least - before) <= _CONVERGED * least:
            break
        balances = balances.near_motion(np.stack((motion(motion.x, 2), motion(motion.x, 1) ** 2), axis=1))
    if np.isfinite(limits).any():
        motion = profiles.fastest_with_jerk(curve, robot, speeds, limits, least)
    if motion is None:
        raise _infeasible_error(f"{where} in motion", rest)
    return _within_limits(robot, segment, curve, motion, limits)


def _within_limits(
    robot: Robot, segment: RestToRestSegment, curve: Curve, motion: PPoly, limits: tuple[float, float]
) -> PPoly:
    """The motion `motion`, slower if necessary, so that it violates no limit between the positions."""
    for again in range(_TRIES):
        timed = _timed(segment, motion)
        values = timed.rates(np.linspace(0.0, timed.duration, _INSTANTS))
        jet = curve.at(values[0])
        twists = jet.twists(values)
        plan = inverse(robot, jet.pose, wrench=inertial_wrench(robot, jet.pose, twists[0], twists[1]))
        sizes = (np.linalg.norm(twists[2][:, part], axis=1).max() for part in (slice(0, 3), slice(3, 6)))
        slower = max(1.0, *(np.cbrt(size / limit) for size, limit in zip(sizes, limits, strict=True)))
        if plan.solved.all() and slower <= 1.0 + _ROUNDING:
            return motion
        if not plan.solved.all():  # the limits hold at rest, and a slower motion changes the tensions less
            slower = max(slower, 1.0 + _SLOWER * 4.0**again)
        motion = profiles.slower(motion, slower)
    raise _infeasible_error("in motion", plan)


def _infeasible_error(item: str, plan: Plan) -> InvalidValueError:
    k = int(np.argmin(plan.solved))
    where = ", ".join(f"{x:.4g}" for x in plan.state.pose.position[k])
    status = PoseStatus(plan.status[k]).name.lower().replace("_", " ")
    value = f"{status} at ({where}) m" if not plan.solved[k] else "not found"
    allowed, step = "tensions within the limits reduced by the margin", "Give a smaller margin, or other poses."
    return InvalidValueError(f"the move {item}", value, allowed, step)


def _has_speed_limits(robot: Robot) -> bool:
    return robot.winches is not None and robot.winches.speed_limit is not None


def _winch_speed_bounds(robot: Robot, curve: Curve, place: Array, rest: Plan) -> profiles.Bounds:
    """Bounds on the squared speed of the curve parameter that follow from the speed limits of the winches."""
    if not _has_speed_limits(robot):
        return lambda parameter: profiles.HalfPlanes(np.zeros((parameter.size, 0, 2)), np.zeros((parameter.size, 0)))
    fastest_cable = fastest_rates(robot, rest.unstrained_length)

    def bounds(parameter: Array) -> profiles.HalfPlanes:
        jet = curve.at(parameter)
        lever = jet.pose.matrix @ robot.center_of_mass
        twist = jet.rates[0].copy()
        twist[:, :3] += np.cross(twist[:, 3:], lever)
        change = np.einsum("knm,kn->km", structure_matrix(robot, jet.pose), twist @ robot.freedom.T)
        limit = np.stack([np.interp(parameter, place, column) for column in fastest_cable.T], axis=1)
        return profiles.HalfPlanes(
            np.stack((np.zeros_like(change), (change / limit) ** 2), axis=-1), np.ones_like(change)
        )

    return bounds


def fastest_rates(robot: Robot, length: Array) -> Array:
    """Largest length rates of the winches [m/s], at the lengths `length` (N, m)."""
    winch = robot.winches
    assert winch is not None
    assert winch.speed_limit is not None
    stretch = 1.0 + winch.winding_tension / robot.cables.axial_stiffness
    return np.asarray(np.abs(winch.speed_limit / winch.gear) * drum_lever(robot, length) / stretch)


def _speed_excess(plan: Plan) -> float:
    """Largest ratio of a winch speed in `plan` to its limit, at least 1."""
    assert plan.length_rate is not None
    limits = fastest_rates(plan.robot, plan.unstrained_length)
    ratio = float(np.nanmax(np.abs(plan.length_rate) / limits))
    return ratio * (1.0 + _SLOWER) if ratio > 1.0 else 1.0
