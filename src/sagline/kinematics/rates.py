"""Rates of lengths along a plan, computed from the motion shortly before and after each sample."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from sagline.core.arrays import Array, Flags, locked
from sagline.kernels import tables
from sagline.kinematics.inverse_rows import solve_inverse_rows
from sagline.motion.path import Path, spline_rates
from sagline.robot.batch import Robots, first_of
from sagline.robot.equilibrium import Equilibrium, cables_of_results
from sagline.robot.pose import Pose
from sagline.robot.reach import is_underconstrained
from sagline.robot.routing import with_routing
from sagline.statics.balance import inertial_wrench
from sagline.statics.tables import pose_rows
from sagline.tension.method import TensionMethod, kernel_options, shared_tension
from sagline.tension.methods import Closest

SHARE = 1e-5  # step relative to the time scale of the motion; central differences are then accurate to 1e-9
# factor of the step for one-sided differences, whose rounding errors are four times as large; accurate to 1e-8
ONE_SIDED = 4.0
LONGEST = 1e-2  # largest step relative to the time between samples
_CONSTANT = 1e-9  # smaller differences of a wrench, relative to its largest component, count as zero


def length_rate(state: Equilibrium, path: Path, tension: TensionMethod, feasible: Flags) -> Array:
    """Rate of the unstrained lengths along the path with the planned tension distribution.

    Geometry and tensions both change: L(t) = L(pose(t), tau(t)). The tensions of most methods depend only on the pose.
    They are computed again shortly before and after each sample, at poses that the path's twist, twist rate and jerk
    determine. `Closest` depends on its previous tensions. It is solved again one and two steps after each sample, both
    times relative to the tensions at the sample.

    state: robot, poses, wrench and cables along the path; path: the path; if its jerk is unknown, a spline through its
    accelerations supplies the jerk; feasible: True for samples with a solution, shape (N,). Returns dL/dt [m/s], shape
    (N, m), accurate to 1e-8 of its largest value; NaN where the plan has no solution. At a discontinuity of the rate,
    for example where a cable reaches a limit, the value belongs to one side of the discontinuity. The rates
    of an underconstrained platform follow from a spline through its lengths.

    Source:
        docs/model.md, section 7.
    """
    kept, rates = np.flatnonzero(feasible), np.full(state.cables.shape, np.nan)
    if is_underconstrained(first_of(state.robot)):  # the platform also turns, and the path does not contain this turn
        for part in np.split(kept, np.flatnonzero(np.diff(kept) > 1) + 1):
            if len(part) > 1:
                rates[part] = spline_rates(path.time[part], state.unstrained_length[part])[0]
        return locked(rates)
    closest = isinstance(tension, Closest)
    motion, step = _motion_near(state.robot, path, state.wrench, ONE_SIDED if closest else 1.0)
    options = kernel_options(state.robot, state.cables.model, tension)
    reference = shared_tension(state, tension.variable) if closest else np.full(state.cables.shape[-1], np.nan)

    def lengths(h: float) -> Array:
        """Unstrained lengths (N, m) at the time `h` after each sample, with the guides and friction of the state."""
        pose, wrench = motion(h)
        found = solve_inverse_rows(state.robot, tension, options, pose_rows(pose), locked(wrench), reference)
        if state.contact is None:
            bare: Array = found.results[tables.LENGTH]
            return bare
        reached = cables_of_results(state.robot, state.cables.model, found.results, found.cable_status, pose.shape)
        return with_routing(Equilibrium(state.robot, pose, wrench, *reached), state.contact.winding).unstrained_length

    now, after = state.unstrained_length, lengths(step)
    if closest:  # a backward step would cross the active limits
        later = lengths(2.0 * step)
        best = (4.0 * after - later - 3.0 * now) / (2.0 * step)
    else:
        best = (after - lengths(-step)) / (2.0 * step)
    if np.isnan(best[kept]).any():  # at the border of feasibility, only one side has a solution
        for one_sided in ((after - now) / step, (now - lengths(-step)) / step):
            best = np.where(np.isnan(best), one_sided, best)
    rates[kept] = best[kept]
    return locked(rates)


def _motion_near(
    robot: Robots, path: Path, wrench: Array, longer: float
) -> tuple[Callable[[float], tuple[Pose, Array]], float]:
    """Function that gives poses and wrenches at a time after each sample of `path`, and a time step [s]."""
    # wrench: external plus inertial wrench at the samples (N, 6), whose external part is interpolated by a spline;
    # longer: factor of the step
    jerk = path.jerk if path.jerk is not None else _rate(path.time, path.twist_rate)
    external = wrench - inertial_wrench(robot, path.pose, path.twist, path.twist_rate)
    changing = float(np.ptp(external, axis=0).max()) > _CONSTANT * float(np.abs(wrench).max())
    external_rate = _rate(path.time, external) if changing else np.zeros_like(external)

    def at(h: float) -> tuple[Pose, Array]:
        pose = _poses_later(path, jerk, h)
        twist = path.twist + h * (path.twist_rate + 0.5 * h * jerk)
        inertial = inertial_wrench(robot, pose, twist, path.twist_rate + h * jerk)
        return pose, inertial + external + h * external_rate

    # a small share of the time for a change by 1 m or 1 rad, and of the time between samples
    sizes = (float(np.abs(rate).max()) for rate in (path.twist, path.twist_rate, jerk))
    quickest = max(size ** (1.0 / order) for order, size in enumerate(sizes, start=1))
    between = float(np.diff(path.time).min()) if len(path) > 1 else 1.0
    return at, min(LONGEST * between, longer * SHARE / quickest if quickest > 0.0 else np.inf)


def _rate(time: Array, values: Array) -> Array:
    return spline_rates(time, values)[0] if len(time) > 1 else np.zeros_like(values)


def _poses_later(path: Path, jerk: Array, h: float) -> Pose:
    """Poses after the time `h`: third order in position, second order in orientation (third for a fixed axis)."""
    from scipy.spatial.transform import Rotation  # this import takes a third of the load time of sagline

    move = h * (path.twist + 0.5 * h * (path.twist_rate + h / 3.0 * jerk))
    turned = path.pose.quaternion
    if path.twist[:, 3:].any() or path.twist_rate[:, 3:].any():
        turned = (Rotation.from_rotvec(move[:, 3:]) * path.pose.rotation).as_quat()
    return Pose.from_quaternion(path.pose.position + move[:, :3], turned)
