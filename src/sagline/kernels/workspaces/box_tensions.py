"""Tensions for a box of poses: limits that hold all over it, and tensions well inside them at its middle."""

from __future__ import annotations

import math
from typing import NamedTuple

from sagline.core.arrays import Array
from sagline.kernels import tables
from sagline.kernels.cable import geometry as g
from sagline.kernels.cable.sag_forces import LOOSEST, Curves, sag_forces_at
from sagline.kernels.codes import CATENARY, LIMITS_OF_CHORD
from sagline.kernels.jit import formula, glue, kernel
from sagline.kernels.workspaces.centered import FARTHEST, Centered, fill_imbalance, find_center
from sagline.kernels.workspaces.pose_box import MOTIONS, CablesInBox, PoseRange
from sagline.kernels.workspaces.sag_force_bounds import has_sag, most_pull, pull_slope

SMOOTHNESS = 0.01  # of how far the demand goes over a box: so much of it the smoothing leaves
SLACK = 0.45  # X at a limit of the frame end beyond which it may move faster than the pull
LEAST_ROOM = 0.05  # share of their range that a set of wrenches leaves to the tensions in the search for a center
ROUNDS = 2  # of tensions and their pulls
LEAST_WAY = 1e-4  # of a chord: a smaller box is smoothed as one so large


class Ranges(NamedTuple):
    """Limits of the chord tensions that hold all over a box [N].

    Attributes:
        low: What no limit exceeds, (m,): for inside.
        high: What no limit falls below, nor stretches a cable to more than twice its length; may be infinite.
        lowest: What no limit falls below: for outside.
        highest: What no limit exceeds, or no load can cause; may be infinite.
        pull: Pulls at the centered tensions.
    """

    low: Array
    high: Array
    lowest: Array
    highest: Array
    pull: Array


@kernel
def set_ranges(quantity: int, place: CablesInBox, curves: Curves, ranges: Ranges) -> None:
    """Fill the limits that hold all over a box from those at its middle."""
    cables = curves.cables
    for i in range(place.way.size):
        low, high = cables.low[i], cables.high[i]
        ranges.low[i] = ranges.lowest[i] = low
        ranges.high[i] = ranges.highest[i] = high
        if has_sag(curves, i):
            loosest = cables.half_weight[i] / LOOSEST
            if quantity != LIMITS_OF_CHORD:
                _move_limits(place, curves, i, ranges)
            ranges.lowest[i] = max(ranges.lowest[i], loosest)
            ranges.low[i] = max(ranges.low[i], loosest)
            ranges.high[i] = min(ranges.high[i], cables.stiffness[i])


@kernel
def _move_limits(place: CablesInBox, curves: Curves, i: int, ranges: Ranges) -> None:
    """Take the limits of a cable's frame end, as chord limits at the middle, apart by how far they move in a box.

    They move as its pull does where it is not slack. A limit that is, anywhere in the box, is the least of those that
    are not for what has to keep it, and none at all for the proof that nothing does.
    """
    cables = curves.cables
    way = place.way[i]
    tight = cables.half_weight[i] * (1.0 + way / cables.chord[i]) / SLACK
    low, high = max(cables.low[i], tight), max(cables.high[i], tight)
    moves = way * pull_slope(curves, i, way, tight)
    ranges.low[i] = low + moves
    ranges.lowest[i] = low - moves if cables.low[i] - moves > tight else 0.0
    if high < math.inf:
        ranges.high[i] = high - moves if cables.high[i] - moves > tight else 0.0
        ranges.highest[i] = high + moves


@kernel
def tighten(freedom: Array, place: CablesInBox, curves: Curves, upward: float, ranges: Ranges) -> None:
    """Take from the largest tensions what no load on cables that all pull up could cause.

    Along the vertical they balance weight, load and pulls, of which each is at most the rest.

    Args:
        freedom: Rows that pick the free motions, (n, 6).
        place: Where the cables stand.
        curves: They.
        upward: Most vertical force that the cables have to give beside their pulls [N].
        ranges: Theirs.
    """
    free = 0.0
    for k in range(freedom.shape[0]):
        free += freedom[k, 2] * freedom[k, 2]
    total = upward
    least = math.inf
    for i in range(place.way.size):
        up = place.full[2, i] - place.turned[i]
        least = min(least, up)
        moves = place.way[i] * pull_slope(curves, i, place.way[i], ranges.lowest[i])
        total += most_pull(curves, i, ranges.lowest[i]) + moves - up * ranges.lowest[i]
    if free > 1.0 - 1e-12 and least > 0.0:
        for i in range(place.way.size):
            most = ranges.lowest[i] + max(total, 0.0) / (place.full[2, i] - place.turned[i])
            ranges.highest[i] = min(ranges.highest[i], most * (1.0 + 1e-9))


@kernel
def spread_of_slopes(place: CablesInBox, box: PoseRange, centered: Centered, ranges: Ranges, slopes: Array) -> None:
    """Fill how the wrench that the centered tensions and their pulls give goes with each motion, (MOTIONS, 6)."""
    m = place.way.size
    for motion in range(MOTIONS):
        for a in range(6):
            slopes[motion, a] = 0.0
        if motion >= 3 and box.turn == 0.0:
            continue
        columns = place.slopes[motion].reshape((6, m))
        for a in range(6):
            for i in range(m):
                slopes[motion, a] += centered.tau[i] * columns[a, i]
        for i in range(m):  # a pull's lever goes with rotation
            if motion == 3:
                slopes[motion, 3] += ranges.pull[i] * place.lever[2, i]
            elif motion == 4:
                slopes[motion, 4] += ranges.pull[i] * place.lever[2, i]
            elif motion == 5:
                slopes[motion, 3] -= ranges.pull[i] * place.lever[0, i]
                slopes[motion, 4] -= ranges.pull[i] * place.lever[1, i]


@formula
def in_wrench_space(rows: Array, vector: Array, full: Array) -> None:
    """Fill a direction in wrenches (6,) from one along the free motions (n,)."""
    for a in range(6):
        full[a] = 0.0
        for k in range(vector.size):
            full[a] += rows[k, a] * vector[k]


@kernel
def _fill_demand(
    curves: Curves, place: CablesInBox, center: Array, load: Array, centered: Centered, ranges: Ranges
) -> None:
    """Fill what the chord tensions have to supply, with the pulls at the present ones.

    Args:
        curves: The cables.
        place: Where they stand.
        center: Row of the body_table.
        load: Wrench, (6,).
        centered: Tensions; filled.
        ranges: Its pulls are filled.
    """
    n, m = place.matrix.shape
    sag_forces_at(curves, centered.tau, ranges.pull)
    z = center[tables.MASS] * center[tables.GRAVITY] - load[2]
    x, y = -load[3], -load[4]
    for i in range(m):
        z += ranges.pull[i]
        x += place.lever[1, i] * ranges.pull[i]
        y -= place.lever[0, i] * ranges.pull[i]
    for k in range(n):
        row = place.rows[k]
        centered.right[k] = (
            row[2] * z + row[3] * x + row[4] * y - row[0] * load[0] - row[1] * load[1] - row[5] * load[5]
        )


@glue
def _smoothing_of(place: CablesInBox, geometry: Array, tau: Array) -> float:
    """Smoothing for a box [N^2]: the square of a share of how far tensions' wrenches go in it."""
    square = 0.0
    for i in range(tau.size):
        change = tau[i] * max(place.way[i] / geometry[g.CHORD, i], LEAST_WAY)
        square += change * change
    return SMOOTHNESS * SMOOTHNESS * max(square, 1e-24)


@glue
def search_limits(ranges: Ranges, taken: Array, size: float, centered: Centered) -> bool:
    """Fill the limits between which tensions are sought: those of the box, less what is taken (m,).

    Returns:
        Whether there is room between them.
    """
    possible = True
    for i in range(taken.size):
        low = ranges.low[i]
        high = min(ranges.high[i], ranges.highest[i], low + FARTHEST * (size + low))
        possible = possible and low < high
        share = min(taken[i], 0.5 * (1.0 - LEAST_ROOM) * (high - low))
        centered.low[i] = low + share
        centered.high[i] = high - share
    return possible


@kernel
def center_tensions(
    place: CablesInBox, curves: Curves, geometry: Array, body: Array, wrench: Array, centered: Centered, ranges: Ranges
) -> tuple[float, float]:
    """Let tensions between the limits of the search balance a wrench (6,), with their own pulls.

    Returns:
        The square of what they leave [N^2], and the smoothing.
    """
    rounds = ROUNDS if curves.model.code == CATENARY else 1
    square, smoothing = 0.0, 0.0
    for i in range(centered.tau.size):
        if not centered.low[i] < centered.tau[i] < centered.high[i]:
            centered.tau[i] = 0.5 * (centered.low[i] + centered.high[i])
    for _ in range(rounds):
        _fill_demand(curves, place, body, wrench, centered, ranges)
        smoothing = _smoothing_of(place, geometry, centered.tau)
        find_center(place.matrix, smoothing, centered)
    _fill_demand(curves, place, body, wrench, centered, ranges)
    square = fill_imbalance(place.matrix, centered)
    return square, smoothing
