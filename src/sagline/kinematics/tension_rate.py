"""The rates of tensions that follow their own past: `Closest` in the limit of many samples a second."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from sagline.cables.model import CableState
from sagline.core.arrays import Array, Flags
from sagline.kinematics.instants import Instant
from sagline.robot.equilibrium import Equilibrium, limited_tension
from sagline.robot.pose import Pose
from sagline.robot.several import anchors_of, bodies_of, first_of, limits_of
from sagline.tension.method import TensionMethod

TENSION_STEP = 1e-5  # of a tension, for slopes at a fixed place
LEAST_STEP = 1e-6  # N, where there is no tension
AT_LIMIT = 1e-8  # of a tension: as near to its limit it is at it
OUTWARD = 1e-9  # of the largest rate: a slower one does not leave a limit


class Placed(NamedTuple):
    """Cables of given chord tensions at given poses, and what they do to the platform.

    Attributes:
        cables: Their state, fields of shape (N, m).
        pull: T_z - tau sin phi [N], shape (N, m).
        structure: Structure matrix J, shape (N, n, m).
        hanging: The same for forces straight up, shape (N, n, m).
    """

    cables: CableState
    pull: Array
    structure: Array
    hanging: Array


def placed(state: Equilibrium, pose: Pose, chord_tension: Array) -> Placed:
    """The cables of a state, moved to other poses and tensions.

    Args:
        state: A batch of N: its robots and model.
        pose: N poses.
        chord_tension: tau [N], shape (N, m).

    Returns:
        Cables, and the matrices of their forces.
    """
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
    return Placed(cables, cables.vertical_force - chord_tension * rise / cables.chord, structure, hanging)


def closest_rates(state: Equilibrium, method: TensionMethod, before: Instant, after: Instant, step: float) -> Array:
    """Rates of the chord tensions of `Closest` as the platform moves on.

    Each set of tensions is the one nearest to the set before: in the limit, of all rates that keep the balance and do
    not leave the limits, the smallest in the sharing's variable. Where cables are at limits that the smallest rates
    would leave, they are held there, the worst first.

    Args:
        state: A batch of N with tensions.
        method: `Closest` with its variable and bound.
        before: Poses and wrenches a step before.
        after: The same, a step after.
        step: The step [s].

    Returns:
        d(tau)/dt [N/s], shape (N, m).
    """
    tension = state.cables.chord_tension
    change = np.maximum(TENSION_STEP * tension, LEAST_STEP)
    low, high = np.maximum(tension - change, 0.0), tension + change
    here = placed(state, state.pose, tension)
    by_tension = placed(state, state.pose, low), placed(state, state.pose, high), high - low
    by_time = placed(state, before.pose, tension), placed(state, after.pose, tension), np.full((1, 1), 2.0 * step)

    def slopes(values: Callable[[Placed], Array]) -> tuple[Array, Array]:
        """d/d(tau) at a held place, and d/dt at held tensions."""
        by_tau, drift = ((values(last) - values(first)) / by for first, last, by in (by_tension, by_time))
        return by_tau, drift

    gap, gaps = _nearest_limits(here, state, method)
    load = (after.wrench - before.wrench) @ first_of(state.robot).freedom.T
    drift = _supplied(by_time[1], tension) - _supplied(by_time[0], tension) + load
    pull_slope = slopes(lambda cables: cables.pull)[0]
    return _smallest(
        _Conditions(
            here.structure,
            here.structure - here.hanging * pull_slope[:, None],
            -drift / (2.0 * step),
            *slopes(lambda cables: _shared(cables.cables, method)),
            *slopes(gaps),
        ),
        np.abs(gap) <= AT_LIMIT * np.maximum(tension, 1.0),
    )


class _Conditions(NamedTuple):
    """What the rates x of the chord tensions must satisfy.

    Attributes:
        structure: J, whose rows the rates of the sharing's variable are made of, shape (N, n, m).
        matrix: The balance is kept where matrix x = right, shape (N, n, m).
        right: Shape (N, n).
        scale: The sharing's variable changes by scale x + drift, which is to be small, shape (N, m).
        drift: Shape (N, m).
        gap_slope: The distance to the nearest limit changes by gap_slope x + gap_drift, shape (N, m).
        gap_drift: Shape (N, m).
    """

    structure: Array
    matrix: Array
    right: Array
    scale: Array
    drift: Array
    gap_slope: Array
    gap_drift: Array

    def solved(self, held: Flags) -> Array:
        """The smallest rates, (N, m), while the cables held stay at their limits."""
        count, n, m = self.matrix.shape
        system, right = np.zeros((count, m + n, m + n)), np.empty((count, m + n))
        index = np.arange(m)
        # scale (scale x + drift) = J^T multipliers: the gradient of half the square is a combination of the rows
        system[:, :m, m:] = -np.swapaxes(self.structure, 1, 2)
        system[:, :m][held] = 0.0
        system[:, index, index] = np.where(held, self.gap_slope, self.scale**2)
        system[:, m:, :m] = self.matrix
        right[:, :m] = np.where(held, -self.gap_drift, -self.scale * self.drift)
        right[:, m:] = self.right
        try:
            found: Array = np.linalg.solve(system, right[..., None])[:, :m, 0]
        except np.linalg.LinAlgError:  # somewhere the balance itself determines a cable that is held
            found = (np.linalg.pinv(system) @ right[..., None])[:, :m, 0]
        return found


def _smallest(conditions: _Conditions, at_limit: Flags) -> Array:
    """The smallest rates that leave no limit; cables are held one by one, the one that would leave fastest first."""
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


def _shared(cables: CableState, method: TensionMethod) -> Array:
    """The sharing's variable."""
    if method.variable == "frame_end":
        return cables.frame_end_tension
    return cables.horizontal_tension if method.variable == "horizontal" else cables.chord_tension


def _supplied(cables: Placed, tension: Array) -> Array:
    """What the cables supply to the balance, (N, n)."""
    forces = cables.structure @ tension[..., None] - cables.hanging @ cables.pull[..., None]
    found: Array = forces[..., 0]
    return found


def _nearest_limits(here: Placed, state: Equilibrium, method: TensionMethod) -> tuple[Array, Callable[[Placed], Array]]:
    """How far each cable is from its nearest limit (N, m), and the function that gives that distance elsewhere."""
    limits = limits_of(state.robot)

    def gaps(at: Placed) -> Array:
        """Distances to all limits (N, m, 2 or 3), positive within."""
        cables = at.cables
        limited = limited_tension(state.robot, cables)
        found = [limited - limits.low, limits.high - limited]
        if method.lowest_point_margin is not None:
            with np.errstate(divide="ignore", invalid="ignore"):  # a level cable has no such bound
                weight = 0.5 * cables.cable.linear_density * cables.gravity * cables.chord
                bound = weight * cables.chord / np.abs(cables.rise)
                if method.lowest_point_margin > 0.0:  # on a vertical cable a bound of zero is zero
                    bound += method.lowest_point_margin * cables.chord / cables.span
            found.append(np.where(cables.rise == 0.0, np.inf, cables.chord_tension - bound))
        return np.stack(found, axis=-1)

    nearest = np.abs(gaps(here)).argmin(axis=-1)[..., None]

    def nearest_gap(at: Placed) -> Array:
        return np.take_along_axis(gaps(at), nearest, axis=-1)[..., 0]

    return nearest_gap(here), nearest_gap
