"""Rates of lengths and tensions along a plan, computed from the motion shortly before and after each sample."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from sagline.cables.model import CableState
from sagline.core.arrays import Array, Flags, Indices, locked
from sagline.kernels import tables
from sagline.kinematics.inverse_rows import InverseRows, solve_inverse_rows
from sagline.motion.path import Path
from sagline.motion.sampled import spline_rates
from sagline.robot.batch import Robots, anchors_of, bodies_of, first_of, has_routing, limits_of, robot_at
from sagline.robot.equilibrium import Equilibrium, cables_of_results, limited_tension
from sagline.robot.pose import Pose
from sagline.robot.reach import is_underconstrained
from sagline.robot.routing import with_routing
from sagline.statics.balance import inertial_wrench
from sagline.statics.tables import pose_rows
from sagline.tension.method import TensionMethod, kernel_options, shared_tension
from sagline.tension.methods import Closest

SHARE = 1e-5  # step relative to the time scale of the motion; finite differences are then accurate to 1e-9
LONGEST = 1e-2  # largest step relative to the time between samples
_CONSTANT = 1e-9  # smaller differences of a wrench, relative to its largest component, count as zero


class _Instant(NamedTuple):
    """Poses and external plus inertial wrenches (N, 6) at N times, each close to one sample."""

    pose: Pose
    wrench: Array

    def part(self, samples: Indices) -> _Instant:
        """Poses and wrenches of some of the samples, (k,)."""
        return _Instant(self.pose[samples], self.wrench[samples])


class _Instants(NamedTuple):
    """States of motion near every sample: one step [s] before it, one step after it, and two steps after it."""

    before: _Instant
    after: _Instant
    later: _Instant
    step: float


def _instants(robot: Robots, path: Path, wrench: Array) -> _Instants:
    """Poses and wrenches one step before and after each sample of `path`. The step depends on the speed.

    path: the path; if its jerk is unknown, a spline through its accelerations supplies the jerk; wrench: external plus
    inertial wrench at the samples (N, 6); the external part is interpolated by a spline.
    """
    jerk = path.jerk if path.jerk is not None else _rate(path.time, path.twist_rate)
    external = wrench - inertial_wrench(robot, path.pose, path.twist, path.twist_rate)
    changing = float(np.ptp(external, axis=0).max()) > _CONSTANT * float(np.abs(wrench).max())
    external_rate = _rate(path.time, external) if changing else np.zeros_like(external)
    step = _step(path, jerk)

    def at(h: float) -> _Instant:
        pose = _poses_later(path, jerk, h)
        twist = path.twist + h * (path.twist_rate + 0.5 * h * jerk)
        inertial = inertial_wrench(robot, pose, twist, path.twist_rate + h * jerk)
        return _Instant(pose, inertial + external + h * external_rate)

    return _Instants(at(-step), at(step), at(2.0 * step), step)


def _rate(time: Array, values: Array) -> Array:
    return spline_rates(time, values)[0] if len(time) > 1 else np.zeros_like(values)


def _step(path: Path, jerk: Array) -> float:
    """Step [s]: a small share of the time for a change by 1 m or 1 rad, and of the time between samples."""
    rates = (path.twist, path.twist_rate, jerk)
    quickest = max(float(np.abs(rate).max()) ** (1.0 / order) for order, rate in enumerate(rates, start=1))
    between = float(np.diff(path.time).min()) if len(path) > 1 else 1.0
    return min(LONGEST * between, SHARE / quickest if quickest > 0.0 else np.inf)


def _poses_later(path: Path, jerk: Array, h: float) -> Pose:
    """Poses after the time `h`: third order in position, second order in orientation (third for a fixed axis)."""
    from scipy.spatial.transform import Rotation  # this import takes a third of the load time of sagline

    move = h * (path.twist + 0.5 * h * (path.twist_rate + h / 3.0 * jerk))
    turned = path.pose.quaternion
    if path.twist[:, 3:].any() or path.twist_rate[:, 3:].any():
        turned = (Rotation.from_rotvec(move[:, 3:]) * path.pose.rotation).as_quat()
    return Pose.from_quaternion(path.pose.position + move[:, :3], turned)


TENSION_STEP = 1e-5  # relative step of a tension, for derivatives at a fixed pose
LEAST_STEP = 1e-6  # smallest step [N], used at zero tension
AT_LIMIT = 1e-8  # relative to the tension; a tension that is closer to a limit counts as at the limit
# relative to the largest rate; a tension that approaches its limit at a smaller rate does not cross the limit
OUTWARD = 1e-9


class _PlacedCables(NamedTuple):
    """Cables at given chord tensions and poses, and matrices that convert their forces to wrenches."""

    cables: CableState  # their state, fields of shape (N, m)
    pull: Array  # T_z - tau sin phi [N], shape (N, m)
    structure: Array  # structure matrix J, shape (N, n, m)
    hanging: Array  # wrench of unit vertical forces at the platform ends, shape (N, n, m)


def _cables_at(state: Equilibrium, pose: Pose, chord_tension: Array) -> _PlacedCables:
    """Cables of the batch `state` at the other poses `pose`, with other chord tensions `chord_tension` [N], (N, m)."""
    anchors, body, shared = anchors_of(state.robot), bodies_of(state.robot), first_of(state.robot)
    turn = np.swapaxes(pose.matrix, -1, -2)
    reach = pose.position[:, None] + anchors.platform @ turn - anchors.frame
    lever = (anchors.platform - body.center_of_mass[..., None, :]) @ turn
    span, rise = np.hypot(reach[..., 0], reach[..., 1]), reach[..., 2]
    cables = state.cables.model.from_tension(state.cables.cable, span, rise, chord_tension, shared.gravity)
    toward = -reach / cables.chord[..., None]
    up = np.broadcast_to((0.0, 0.0, 1.0), toward.shape)
    structure, hanging = (
        shared.freedom @ np.swapaxes(np.concatenate((force, np.cross(lever, force)), axis=-1), -1, -2)
        for force in (toward, up)
    )
    return _PlacedCables(cables, cables.vertical_force - chord_tension * rise / cables.chord, structure, hanging)


def _held_limit_rates(
    state: Equilibrium, method: TensionMethod, before: _Instant, after: _Instant, step: float
) -> Array:
    """Rates of the chord tensions of `Closest` along the path.

    `Closest` selects the tensions nearest to the previous tensions. In the limit of small steps, the rates of the
    tension variable are the smallest rates that keep the balance and do not cross a limit. Cables that would cross a
    limit are held at the limit, starting with the largest violation.

    step: the step [s]. Returns d(tau)/dt [N/s], shape (N, m).
    """
    tension = state.cables.chord_tension
    change = np.maximum(TENSION_STEP * tension, LEAST_STEP)
    low, high = np.maximum(tension - change, 0.0), tension + change
    here = _cables_at(state, state.pose, tension)
    by_tension = _cables_at(state, state.pose, low), _cables_at(state, state.pose, high), high - low
    by_time = (
        _cables_at(state, before.pose, tension),
        _cables_at(state, after.pose, tension),
        np.full((1, 1), 2.0 * step),
    )

    def slopes(values: Callable[[_PlacedCables], Array]) -> tuple[Array, Array]:
        """Derivatives of the values with respect to tau at a fixed pose, and with respect to time at fixed tensions."""
        by_tau, drift = ((values(last) - values(first)) / by for first, last, by in (by_tension, by_time))
        return by_tau, drift

    gap, gaps = _nearest_limits(here, state, method)
    load = (after.wrench - before.wrench) @ first_of(state.robot).freedom.T
    drift = _supplied_wrench(by_time[1], tension) - _supplied_wrench(by_time[0], tension) + load
    pull_slope = slopes(lambda cables: cables.pull)[0]
    return _smallest_rates(
        _RateConditions(
            here.structure,
            here.structure - here.hanging * pull_slope[:, None],
            -drift / (2.0 * step),
            *slopes(lambda cables: _variable_tension(cables.cables, method)),
            *slopes(gaps),
        ),
        np.abs(gap) <= AT_LIMIT * np.maximum(tension, 1.0),
    )


class _RateConditions(NamedTuple):
    """Conditions that the rates x of the chord tensions satisfy."""

    structure: Array  # structure matrix J, shape (N, n, m)
    matrix: Array  # balance condition: matrix x = right, shape (N, n, m)
    right: Array  # right side of the balance condition, shape (N, n)
    scale: Array  # the rate of the tension variable, scale x + drift, is minimized; shape (N, m)
    drift: Array  # shape (N, m)
    gap_slope: Array  # the distance to the nearest limit has the rate gap_slope x + gap_drift, shape (N, m)
    gap_drift: Array  # shape (N, m)

    def solved(self, held: Flags) -> Array:
        """The smallest rates (N, m) with some cables held at their limits."""
        count, n, m = self.matrix.shape
        system, right = np.zeros((count, m + n, m + n)), np.empty((count, m + n))
        index = np.arange(m)
        # scale (scale x + drift) = J^T multipliers, because the gradient of half the square is a combination of the
        # rows
        system[:, :m, m:] = -np.swapaxes(self.structure, 1, 2)
        system[:, :m][held] = 0.0
        system[:, index, index] = np.where(held, self.gap_slope, self.scale**2)
        system[:, m:, :m] = self.matrix
        right[:, :m] = np.where(held, -self.gap_drift, -self.scale * self.drift)
        right[:, m:] = self.right
        try:
            found: Array = np.linalg.solve(system, right[..., None])[:, :m, 0]
        except np.linalg.LinAlgError:  # at some sample the balance determines the tension of a held cable
            found = (np.linalg.pinv(system) @ right[..., None])[:, :m, 0]
        return found


def _smallest_rates(conditions: _RateConditions, at_limit: Flags) -> Array:
    """Smallest rates that cross no limit. Cables that would cross a limit are held one by one, the fastest first."""
    _, n, m = conditions.matrix.shape
    held = np.zeros_like(at_limit)
    rates = conditions.solved(held)
    for _ in range(m - n):
        leaving = -(conditions.gap_slope * rates + conditions.gap_drift)
        leaving = np.where(at_limit & ~held, leaving, 0.0)
        worst = leaving.argmax(axis=1)
        rows = np.flatnonzero(leaving.max(axis=1) > OUTWARD * np.abs(rates).max(axis=1))
        if not rows.size:
            break
        held[rows, worst[rows]] = True
        rates = conditions.solved(held)
    return rates


def _variable_tension(cables: CableState, method: TensionMethod) -> Array:
    """Tensions of `cables` in the variable of the tension distribution method."""
    if method.variable == "frame_end":
        return cables.frame_end_tension
    return cables.horizontal_tension if method.variable == "horizontal" else cables.chord_tension


def _supplied_wrench(cables: _PlacedCables, tension: Array) -> Array:
    """Wrench of the cables along the free motions, (N, n)."""
    forces = cables.structure @ tension[..., None] - cables.hanging @ cables.pull[..., None]
    found: Array = forces[..., 0]
    return found


def _nearest_limits(
    here: _PlacedCables, state: Equilibrium, method: TensionMethod
) -> tuple[Array, Callable[[_PlacedCables], Array]]:
    """Distance of each tension from its nearest limit (N, m), and a function that computes this distance."""
    limits = limits_of(state.robot)

    def gaps(at: _PlacedCables) -> Array:
        """Distances of the tensions from all limits (N, m, 2 or 3), positive within the limits."""
        cables = at.cables
        limited = limited_tension(state.robot, cables)
        found = [limited - limits.low, limits.high - limited]
        if method.lowest_point_margin is not None:
            with np.errstate(divide="ignore", invalid="ignore"):  # a horizontal cable has no such bound
                weight = 0.5 * cables.cable.linear_density * cables.gravity * cables.chord
                bound = weight * cables.chord / np.abs(cables.rise)
                if method.lowest_point_margin > 0.0:  # on a vertical cable, a bound of zero remains zero
                    bound += method.lowest_point_margin * cables.chord / cables.span
            found.append(np.where(cables.rise == 0.0, np.inf, cables.chord_tension - bound))
        return np.stack(found, axis=-1)

    nearest = np.abs(gaps(here)).argmin(axis=-1)[..., None]

    def nearest_gap(at: _PlacedCables) -> Array:
        return np.take_along_axis(gaps(at), nearest, axis=-1)[..., 0]

    return nearest_gap(here), nearest_gap


def length_rate(state: Equilibrium, path: Path, tension: TensionMethod, feasible: Flags) -> Array:
    """Rate of the unstrained lengths along the path with the planned tension distribution.

    Geometry and tensions both change: L(t) = L(pose(t), tau(t)). The tensions of most methods depend only on the pose.
    They are computed again shortly before and after each sample, at poses that the path's twist, twist rate and jerk
    determine. `Closest` depends on its previous tensions. Its rates are the smallest rates of the tensions that keep
    the balance. Cables that would cross a limit are held at the limit. If the robot has pulleys, `Closest` is solved
    again one and two steps after each sample.

    state: robot, poses, wrench and cables along the path; path: the path; if its jerk is unknown, a spline through its
    accelerations supplies the jerk; feasible: True for samples with a solution, shape (N,). Returns dL/dt [m/s], shape
    (N, m), accurate to 1e-8 of its largest value; NaN where the plan has no solution. At a discontinuity of the rate,
    for example where a cable reaches a limit, the value belongs to one side of the discontinuity. The rates
    of an underconstrained platform follow from a spline through its lengths.

    Source:
        docs/model.md, section 7.
    """
    kept = np.flatnonzero(feasible)
    rates = np.full(state.cables.shape, np.nan)
    if is_underconstrained(first_of(state.robot)):  # the platform also turns, and the path does not contain this turn
        for part in np.split(kept, np.flatnonzero(np.diff(kept) > 1) + 1):
            if len(part) > 1:
                rates[part] = spline_rates(path.time[part], state.unstrained_length[part])[0]
        return locked(rates)
    near = _instants(state.robot, path, state.wrench)
    if not isinstance(tension, Closest):
        rates[kept] = _resolved_rates(state, tension, near)[kept]
    elif state.contact is not None:
        rates[kept] = _one_sided_rates(state, tension, near)[kept]
    elif kept.size:
        rates[kept] = _closest_rates(state[kept], tension, near, kept)
    return locked(rates)


def _resolved_rates(state: Equilibrium, tension: TensionMethod, near: _Instants) -> Array:
    """Rates from solutions shortly before and after each sample; at the border of feasibility, from one side only."""
    options, lengths = kernel_options(state.robot, state.cables.model, tension), state.unstrained_length
    none = np.full(first_of(state.robot).cable_count, np.nan)
    before, after = (
        _total_lengths(
            state,
            moment,
            solve_inverse_rows(state.robot, tension, options, pose_rows(moment.pose), locked(moment.wrench), none),
        )
        for moment in (near.before, near.after)
    )
    sides = (after - before) / (2.0 * near.step)
    ahead, behind = (after - lengths) / near.step, (lengths - before) / near.step
    rates: Array = np.where(np.isnan(sides), np.where(np.isnan(ahead), behind, ahead), sides)
    return rates


def _one_sided_rates(state: Equilibrium, tension: TensionMethod, near: _Instants) -> Array:
    """Rates of `Closest` with pulleys, from two forward steps; a backward step would cross the active limits."""
    options, lengths = kernel_options(state.robot, state.cables.model, tension), state.unstrained_length
    held, moments = shared_tension(state, tension.variable), (near.after, near.later)
    rows = np.stack([pose_rows(moment.pose) for moment in moments], axis=1)
    loads = np.stack([moment.wrench for moment in moments], axis=1)
    freedoms = first_of(state.robot).degrees_of_freedom
    steps = [InverseRows.empty(len(held), held.shape[1], freedoms, has_routing(state.robot)) for _ in moments]
    for i in range(len(held)):
        given = (robot_at(state.robot, i), tension, options, locked(rows[i].copy()), locked(loads[i].copy()))
        answer = solve_inverse_rows(*given, held[i].copy())
        for k, step in enumerate(steps):
            step.results[:, i], step.cable_status[i] = answer.results[:, k], answer.cable_status[k]
    after, later = (_total_lengths(state, *pair) for pair in zip(moments, steps, strict=True))
    twice = (4.0 * after - later - 3.0 * lengths) / (2.0 * near.step)
    rates: Array = np.where(np.isnan(twice), (after - lengths) / near.step, twice)
    return rates


def _total_lengths(state: Equilibrium, moment: _Instant, found: InverseRows) -> Array:
    """Unstrained lengths of solved poses, with the guides and friction of the state."""
    if state.contact is None:
        lengths: Array = found.results[tables.LENGTH]
        return lengths
    cables, contact = cables_of_results(
        state.robot, state.cables.model, found.results, found.cable_status, state.pose.shape
    )
    there = Equilibrium(state.robot, moment.pose, moment.wrench, cables, contact)
    return with_routing(there, state.contact.winding).unstrained_length


def _closest_rates(state: Equilibrium, tension: TensionMethod, near: _Instants, kept: Indices) -> Array:
    """Rates of `Closest` at the samples with a solution; the state contains only these samples."""
    before, after = (moment.part(kept) for moment in (near.before, near.after))
    rates = _held_limit_rates(state, tension, before, after, near.step)
    lengths = [
        _cables_at(state, moment.pose, state.cables.chord_tension + h * rates).cables.unstrained_length
        for moment, h in ((before, -near.step), (after, near.step))
    ]
    found: Array = (lengths[1] - lengths[0]) / (2.0 * near.step)
    return found
