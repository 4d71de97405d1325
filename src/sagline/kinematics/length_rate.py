"""How fast a plan's winches wind: the time derivative of its unstrained lengths."""

from __future__ import annotations

import numpy as np

from sagline.arrays import Array, Flags, Indices, locked
from sagline.kernels import tables
from sagline.kinematics.instants import Instants, instants
from sagline.kinematics.inverse_rows import solve_rows
from sagline.kinematics.tension_rate import closest_rates, placed
from sagline.motion.path import Path
from sagline.robot.equilibrium import Equilibrium
from sagline.robot.several import first_of, robot_at
from sagline.statics.tables import pose_rows
from sagline.tension.closest import Closest
from sagline.tension.method import TensionMethod, shared_tension
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
        solve_rows(state.robot, tension, options, pose_rows(moment.pose), locked(moment.wrench), none).results[
            tables.LENGTH
        ]
        for moment in (near.before, near.after)
    )
    sides = (after - before) / (2.0 * near.step)
    ahead, behind = (after - lengths) / near.step, (lengths - before) / near.step
    rates: Array = np.where(np.isnan(sides), np.where(np.isnan(ahead), behind, ahead), sides)
    return rates


def _walked(state: Equilibrium, tension: TensionMethod, near: Instants) -> Array:
    """Rates of `Closest` over pulleys, from two steps on: backward it would leave the limits that hold it."""
    options, lengths = kernel_options(state.robot, state.cables.model, tension), state.unstrained_length
    held = shared_tension(state, tension.variable)
    rows = np.stack([pose_rows(moment.pose) for moment in (near.after, near.later)], axis=1)
    loads = np.stack([moment.wrench for moment in (near.after, near.later)], axis=1)
    rates = np.full(lengths.shape, np.nan)
    for i in np.flatnonzero(~np.isnan(lengths[:, 0])):
        given = (robot_at(state.robot, int(i)), tension, options, locked(rows[i].copy()), locked(loads[i].copy()))
        after, later = solve_rows(*given, held[i].copy()).results[tables.LENGTH]
        twice = (4.0 * after - later - 3.0 * lengths[i]) / (2.0 * near.step)
        rates[i] = np.where(np.isnan(twice), (after - lengths[i]) / near.step, twice)
    return rates


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
