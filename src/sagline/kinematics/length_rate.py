"""How fast a plan's winches wind: the time derivative of its unstrained lengths."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from sagline.arrays import Array, Indices, locked
from sagline.kinematics.instants import Instants, instants
from sagline.kinematics.tension_rate import closest_rates, placed
from sagline.motion.path import Path
from sagline.tension.closest import Closest

if TYPE_CHECKING:
    from sagline.kinematics.plan import Plan


def length_rate(plan: Plan, path: Path) -> Array:
    """Rate of the unstrained lengths while the platform follows the path and the load is shared as planned.

    Geometry and tensions both change: L(t) = L(pose(t), tau(t)). A method that depends on the pose alone is solved
    again an instant before and after each sample, where the path's twist, its rate and its jerk lead; `Closest` follows
    the tensions it has, so that its tensions' rates are solved for: of all that keep the balance, the smallest, with
    cables held at the limits that they would cross.

    Args:
        plan: A plan along the path.
        path: The path; where it knows no jerk, a spline through its accelerations gives it.

    Returns:
        dL/dt [m/s], shape (N, m): good to 1e-8 of its largest value; NaN where the plan has no answer. Where the rate
        jumps, as where a cable reaches a limit, it is one of the two sides'.

    Source:
        docs/model.md, section 7.
    """
    near = instants(plan.state.robot, path, plan.state.wrench)
    kept = np.flatnonzero(plan.feasible)
    rates = np.full(plan.unstrained_length.shape, np.nan)
    if isinstance(plan.tension, Closest):
        if kept.size:
            rates[kept] = _followed(plan, near, kept)
    else:
        rates[kept] = _solved_again(plan, near)[kept]
    return locked(rates)


def _solved_again(plan: Plan, near: Instants) -> Array:
    """Rates of a method without memory; to one side, where the path leaves the feasible poses at the other."""
    from sagline.kinematics.inverse import inverse  # which makes plans

    state = plan.state
    before, after = (
        inverse(state.robot, moment.pose, state.cables.model, plan.tension, moment.wrench).unstrained_length
        for moment in (near.before, near.after)
    )
    sides = (after - before) / (2.0 * near.step)
    ahead, behind = (after - plan.unstrained_length) / near.step, (plan.unstrained_length - before) / near.step
    return np.where(np.isnan(sides), np.where(np.isnan(ahead), behind, ahead), sides)


def _followed(plan: Plan, near: Instants, kept: Indices) -> Array:
    """Rates of `Closest`, at the samples that have an answer."""
    state = plan.state[kept]
    before, after = (moment.part(kept) for moment in (near.before, near.after))
    rates = closest_rates(state, plan.tension, before, after, near.step)
    lengths = [
        placed(state, moment.pose, state.cables.chord_tension + h * rates).cables.unstrained_length
        for moment, h in ((before, -near.step), (after, near.step))
    ]
    found: Array = (lengths[1] - lengths[0]) / (2.0 * near.step)
    return found
