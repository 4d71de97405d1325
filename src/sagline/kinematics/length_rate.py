"""How fast a plan's winches wind: the time derivative of its unstrained lengths."""

from __future__ import annotations

import numpy as np

from sagline.core.arrays import Array, Flags, Indices, locked
from sagline.kernels import tables
from sagline.kinematics.hung import hung_cables
from sagline.kinematics.instants import Instant, Instants, instants
from sagline.kinematics.inverse_rows import Found, solve_rows
from sagline.kinematics.tension_rate import closest_rates, placed
from sagline.motion.path import Path
from sagline.robot.behind import with_behind
from sagline.robot.equilibrium import Equilibrium
from sagline.robot.several import anything_behind, first_of, robot_at
from sagline.statics.tables import pose_rows
from sagline.tension.method import TensionMethod, shared_tension
from sagline.tension.methods import Closest
from sagline.tension.options import kernel_options


def length_rate(state: Equilibrium, path: Path, tension: TensionMethod, feasible: Flags) -> Array:
    """Rate of the unstrained lengths while the platform follows the path and the load is shared as planned.

    Geometry and tensions both change: L(t) = L(pose(t), tau(t)). A method that depends on the pose alone is solved
    again an instant before and after each sample, where the path's twist, its rate and its jerk lead; `Closest` follows
    the tensions it has, so that its tensions' rates are solved for: of all that keep the balance, the smallest, with
    cables held at the limits that they would cross. Over pulleys the path is followed for two more steps instead.

    Args:
        state: Robot, poses, wrench and cables along the path.
        path: The path; where it knows no jerk, a spline through its accelerations gives it.
        tension: How the load was shared.
        feasible: Which samples have an answer, shape (N,).

    Returns:
        dL/dt [m/s], shape (N, m): good to 1e-8 of its largest value; NaN where the plan has no answer. Where the rate
        jumps, as where a cable reaches a limit, it is one of the two sides'.

    Source:
        docs/model.md, section 7.
    """
    near = instants(state.robot, path, state.wrench)
    kept = np.flatnonzero(feasible)
    rates = np.full(state.cables.shape, np.nan)
    if not isinstance(tension, Closest):
        rates[kept] = _solved_again(state, tension, near)[kept]
    elif state.contact is not None:
        rates[kept] = _walked(state, tension, near)[kept]
    elif kept.size:
        rates[kept] = _followed(state[kept], tension, near, kept)
    return locked(rates)


def _solved_again(state: Equilibrium, tension: TensionMethod, near: Instants) -> Array:
    """Rates from poses solved again an instant before and after; to one side, where the path leaves the feasible."""
    options, lengths = kernel_options(state.robot, state.cables.model, tension), state.unstrained_length
    none = np.full(first_of(state.robot).cable_count, np.nan)
    before, after = (
        _off_the_drums(
            state,
            moment,
            solve_rows(state.robot, tension, options, pose_rows(moment.pose), locked(moment.wrench), none),
        )
        for moment in (near.before, near.after)
    )
    sides = (after - before) / (2.0 * near.step)
    ahead, behind = (after - lengths) / near.step, (lengths - before) / near.step
    rates: Array = np.where(np.isnan(sides), np.where(np.isnan(ahead), behind, ahead), sides)
    return rates


def _walked(state: Equilibrium, tension: TensionMethod, near: Instants) -> Array:
    """Rates of `Closest` over pulleys, from two steps on: backward it would leave the limits that hold it."""
    options, lengths = kernel_options(state.robot, state.cables.model, tension), state.unstrained_length
    held, moments = shared_tension(state, tension.variable), (near.after, near.later)
    rows = np.stack([pose_rows(moment.pose) for moment in moments], axis=1)
    loads = np.stack([moment.wrench for moment in moments], axis=1)
    freedoms = first_of(state.robot).degrees_of_freedom
    steps = [Found.empty(len(held), held.shape[1], freedoms, anything_behind(state.robot)) for _ in moments]
    for i in range(len(held)):
        given = (robot_at(state.robot, i), tension, options, locked(rows[i].copy()), locked(loads[i].copy()))
        answer = solve_rows(*given, held[i].copy())
        for k, step in enumerate(steps):
            step.results[:, i], step.cable_status[i] = answer.results[:, k], answer.cable_status[k]
    after, later = (_off_the_drums(state, *pair) for pair in zip(moments, steps, strict=True))
    twice = (4.0 * after - later - 3.0 * lengths) / (2.0 * near.step)
    rates: Array = np.where(np.isnan(twice), (after - lengths) / near.step, twice)
    return rates


def _off_the_drums(state: Equilibrium, moment: Instant, found: Found) -> Array:
    """Unstrained lengths of answers, with the state's guides and friction."""
    if state.contact is None:
        lengths: Array = found.results[tables.LENGTH]
        return lengths
    cables, contact = hung_cables(state.robot, state.cables.model, found.results, found.cable_status, state.pose.shape)
    there = Equilibrium(state.robot, moment.pose, moment.wrench, cables, contact)
    return with_behind(there, state.contact.winding).unstrained_length


def _followed(state: Equilibrium, tension: TensionMethod, near: Instants, kept: Indices) -> Array:
    """Rates of `Closest`, at the samples that have an answer: the state is theirs."""
    before, after = (moment.part(kept) for moment in (near.before, near.after))
    rates = closest_rates(state, tension, before, after, near.step)
    lengths = [
        placed(state, moment.pose, state.cables.chord_tension + h * rates).cables.unstrained_length
        for moment, h in ((before, -near.step), (after, near.step))
    ]
    found: Array = (lengths[1] - lengths[0]) / (2.0 * near.step)
    return found
