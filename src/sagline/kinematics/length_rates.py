"""Rates of the unstrained lengths along a path, by differences near the samples; docs/model.md, section 7."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from sagline.core.arrays import Array, locked
from sagline.kernels import tables
from sagline.kinematics.inverse_rows import solve_inverse_rows
from sagline.motion.anchors import AnchorMotion
from sagline.motion.path import Path, spline_rates
from sagline.robot.batch import Robots, first_of, has_slanted_axes
from sagline.robot.equilibrium import Equilibrium, cables_of_results
from sagline.robot.pose import Pose
from sagline.robot.reach import is_underconstrained
from sagline.robot.robot import with_anchors
from sagline.robot.routing import with_routing
from sagline.statics.balance import inertial_wrench
from sagline.statics.tables import pose_rows, robot_terms
from sagline.tension.method import TensionMethod, kernel_options, shared_tension
from sagline.tension.methods import Closest

if TYPE_CHECKING:
    from sagline.kinematics.plan import Plan

SHARE = 1e-5  # step relative to the time scale of the motion; central differences are then accurate to 1e-9
# factor of the step for one-sided differences, because their rounding errors are four times as large; they are accurate
# to 1e-8
ONE_SIDED = 4.0
LONGEST = 1e-2  # largest step relative to the time between samples
_CONSTANT = 1e-9  # differences of a wrench below this share of its largest component count as zero


def length_rates(plan: Plan, path: Path) -> Array:
    """Rates of the unstrained lengths (N, m) along `path`; NaN where the plan has no solution.

    The rates are accurate to 1e-8 of the largest rate. At the border of feasibility, the rates have first order.
    """
    # Geometry and tensions both change: L(t) = L(pose(t), tau(t)). The tensions of most methods depend only on the
    # pose. They are computed again shortly before and after each sample, at poses that follow from twist, twist rate
    # and jerk of the path. `Closest` depends on its previous tensions. It is solved again one step and two steps after
    # each sample, in both cases relative to the tensions at the sample. At a discontinuity of the rate, for example
    # where a cable reaches a limit, the value belongs to one side of the discontinuity. The rates of an
    # underconstrained platform follow from a spline through its lengths. See docs/model.md, section 7.
    state, tension, anchors = plan.state, plan.tension, plan.anchors
    kept, rates = np.flatnonzero(plan.feasible), np.full(state.cables.shape, np.nan)
    # the platform also turns by an angle that the path does not contain, or the exit points need passes of their own
    if is_underconstrained(first_of(state.robot)) or has_slanted_axes(state.robot):
        for part in np.split(kept, np.flatnonzero(np.diff(kept) > 1) + 1):
            if len(part) > 1:
                rates[part] = spline_rates(path.time[part], state.unstrained_length[part])[0]
        return locked(rates)
    closest = isinstance(tension, Closest)
    robot = state.robot if anchors is None else plan.robot
    motion, step = _motion_near(robot, path, state.wrench, ONE_SIDED if closest else 1.0, anchors)
    reference = shared_tension(state, tension.variable) if closest else np.full(state.cables.shape[-1], np.nan)

    def lengths(h: float) -> Array:
        """Unstrained lengths (N, m) at the time `h` after each sample."""
        places = None if anchors is None else anchors._interpolated(path.time + h, 0)
        return lengths_near(state, tension, *motion(h), reference, places)

    now, after = state.unstrained_length, lengths(step)
    if closest:  # a step backward would cross active limits
        best = (4.0 * after - lengths(2.0 * step) - 3.0 * now) / (2.0 * step)
        one_sided = [after - now]
    else:
        before = lengths(-step)
        best = (after - before) / (2.0 * step)
        one_sided = [after - now, now - before]
    for change in one_sided:  # first order, at the border of feasibility: only one side has a solution
        best = np.where(np.isnan(best), change / step, best)
    rates[kept] = best[kept]
    return locked(rates)


def lengths_near(
    state: Equilibrium, tension: TensionMethod, pose: Pose, wrench: Array, reference: Array, places: Array | None = None
) -> Array:
    """Unstrained lengths (N, m) at poses near a state, with its guides and friction."""
    # reference: for `Closest`; places: positions of moving anchors (N, m, 3)
    robot = state.robot if places is None else first_of(state.robot)
    options, terms = kernel_options(robot, state.cables.model, tension), robot_terms(robot, anchors=places)
    found = solve_inverse_rows(robot, tension, options, pose_rows(pose), locked(wrench), reference, terms=terms)
    if state.contact is None:
        bare: Array = found.results[tables.LENGTH]
        return bare
    reached = cables_of_results(robot, state.cables.model, found.results, found.cable_status, pose.shape)
    placed = robot if places is None else with_anchors(first_of(robot), places)
    return with_routing(Equilibrium(placed, pose, wrench, *reached), state.contact.winding).unstrained_length


def _motion_near(
    robot: Robots, path: Path, wrench: Array, longer: float, anchors: AnchorMotion | None
) -> tuple[Callable[[float], tuple[Pose, Array]], float]:
    """A function that returns poses and wrenches at a time after each sample of `path`, and a time step [s] for it."""
    # wrench: external plus inertial wrench at the samples, (N, 6); a spline interpolates its external part; longer:
    # factor of the step
    jerk = path.jerk if path.jerk is not None else _rate(path.time, path.twist_rate)
    external = wrench - inertial_wrench(robot, path.pose, path.twist, path.twist_rate)
    changing = float(np.ptp(external, axis=0).max()) > _CONSTANT * float(np.abs(wrench).max())
    external_rate = _rate(path.time, external) if changing else np.zeros_like(external)

    def at(h: float) -> tuple[Pose, Array]:
        pose = _poses_later(path, jerk, h)
        twist = path.twist + h * (path.twist_rate + 0.5 * h * jerk)
        inertial = inertial_wrench(robot, pose, twist, path.twist_rate + h * jerk)
        return pose, inertial + external + h * external_rate

    # a small share of two times: for a change by 1 m or 1 rad, and between samples
    moved = [[path.twist, path.twist_rate, jerk]]
    if anchors is not None:
        moved.append([anchors._interpolated(path.time, order) for order in (1, 2, 3)])
    sizes = (max(float(np.abs(rate).max()) for rate in rates) for rates in zip(*moved, strict=True))
    quickest = max(size ** (1.0 / order) for order, size in enumerate(sizes, start=1))
    between = float(np.diff(path.time).min()) if len(path) > 1 else 1.0
    return at, min(LONGEST * between, longer * SHARE / quickest if quickest > 0.0 else np.inf)


def _rate(time: Array, values: Array) -> Array:
    return spline_rates(time, values)[0] if len(time) > 1 else np.zeros_like(values)


def _poses_later(path: Path, jerk: Array, h: float) -> Pose:
    """Poses after the time `h`. The order is 3 for positions, and 2 for orientations (3 if the axis is constant)."""
    from scipy.spatial.transform import Rotation  # this import takes a third of the load time of sagline

    move = h * (path.twist + 0.5 * h * (path.twist_rate + h / 3.0 * jerk))
    turned = path.pose.quaternion
    if path.twist[:, 3:].any() or path.twist_rate[:, 3:].any():
        turned = (Rotation.from_rotvec(move[:, 3:]) * path.pose.rotation).as_quat()
    return Pose.from_quaternion(path.pose.position + move[:, :3], turned)
