"""Proofs that all poses of a box are wrench-feasible, or that all are infeasible; docs/model.md, section 13.

The proof of INSIDE is a formula that gives, at every pose and for every wrench of the set, balancing tensions within
the limits. The proof of OUTSIDE is one wrench of the set and a direction that depends on the pose. Along this
direction, all cables together contribute less than this wrench demands.
"""

from __future__ import annotations

import numpy as np

from sagline.core.arrays import Array, Codes, Indices
from sagline.kernels import tables
from sagline.kernels.algebra.factors import copy
from sagline.kernels.cable import geometry as g
from sagline.kernels.cable.geometry import cable_geometry
from sagline.kernels.cable.sag_forces import Curves, new_curves
from sagline.kernels.cable.states import TensionLimits
from sagline.kernels.cable.terms import new_cables
from sagline.kernels.inverse.poses import LimitTerms, ModelTerms, Robots, model_at
from sagline.kernels.jit import entry, glue
from sagline.kernels.memory import Memory, block
from sagline.kernels.statics import place_cables
from sagline.kernels.workspaces import box_tensions
from sagline.kernels.workspaces.box_proofs import Precision, proves_inside, proves_outside
from sagline.kernels.workspaces.pose_box import CablesInBox, PoseRange, new_cables_in_box, set_cables_in_box
from sagline.kernels.workspaces.wrench_set import Loads, farthest, reach_of_loads

OPEN, INSIDE, OUTSIDE = 0, 1, 2  # verdicts
BOX_COLUMNS = 11  # pose row, half edges, turn
ATTEMPTS = 3  # alternating computations of the tensions and of their limits, which the set of wrenches narrows

LoadTerms = tuple[Array, Array, Array, Array, Indices]  # Loads
PrecisionTerms = tuple[float, float]  # Precision


def memory_for_proofs(cables: int) -> tuple[Array, Indices]:
    """Work arrays of the proofs, for a number of cables."""
    return np.empty(14 * cables * cables + 500 * cables + 800), np.empty(10 * cables + 40, dtype=np.int64)


@entry
def prove_boxes(
    model_terms: ModelTerms,
    limit_terms: LimitTerms,
    robot_terms: Robots,
    load_terms: LoadTerms,
    boxes: Array,
    precision_terms: PrecisionTerms,
    memory: tuple[Array, Indices],
    answers: tuple[Codes, Codes],
) -> None:
    """Try to prove for each of N boxes that all its poses are wrench-feasible, or that all are infeasible."""
    # model_terms: Cable model: code, k_h, k_p.
    # limit_terms: Limits of the tensions: `TensionLimits`.
    # robot_terms: Rows that select the free motions, (n, 6); body_table (1, BODY_COLUMNS); cable_table, (1, m,
    #   CABLE_COLUMNS), of a robot without pulleys.
    # load_terms: The wrenches to balance: `Loads`.
    # boxes: Rows: pose at the middle, half edges [m], largest rotation from the middle [rad], (N, BOX_COLUMNS).
    # precision_terms: `Precision`.
    # memory: `proof_memory` for the number of cables.
    # answers: Filled with OPEN, INSIDE or OUTSIDE, (N,); and a work array of statuses, (m,).
    limits, loads, precision = TensionLimits(*limit_terms), Loads(*load_terms), Precision(*precision_terms)
    freedom, bodies, robots = robot_terms
    verdicts, statuses = answers
    body, robot = bodies[0], robots[0]
    n, m = freedom.shape[0], robot.shape[0]
    model = model_at(model_terms, body)
    cables, rest = new_cables(Memory(*memory), m, False)
    place, rest = new_cables_in_box(rest, m, n)
    centered, rest = box_tensions.new_centered(rest, m, n)
    curves, rest = new_curves(model, cables, statuses, rest)
    rows, rest = block(rest, g.GEOMETRY_ROWS + 6, m)
    small, rest = block(rest, 6, 6)
    geometry, spans = rows[: g.GEOMETRY_ROWS], rows[g.GEOMETRY_ROWS :]
    ranges, taken = box_tensions.Ranges(spans[0], spans[1], spans[2], spans[3], spans[4]), spans[5]
    rotation, center, wrench, direction = small[:3, :3], small[3, :3], small[4], small[5]
    several = loads.segments.shape[0] + loads.ellipsoids.shape[0] + loads.sizes.size > 0
    copy(body[tables.CENTER_X : tables.CENTER_X + 3], center)
    for p in range(boxes.shape[0]):
        verdicts[p] = OPEN
        box = PoseRange(boxes[p, 7:10], boxes[p, 10])
        cable_geometry(robot, body, boxes[p], rotation, geometry)
        placed = place_cables(model, limits, robot, geometry, cables)
        if not (placed and set_cables_in_box(freedom, geometry, rotation, center, box, place)):
            continue
        box_tensions.set_ranges(limits.quantity, place, curves, ranges)
        size = _tighten_by_load(freedom, body, loads, place, curves, direction, ranges)
        copy(loads.center, wrench)
        taken[:] = 0.0
        if not box_tensions.search_limits(ranges, taken, size, centered):
            continue
        outside = box_tensions.center_tensions(place, curves, geometry, body, wrench, centered, ranges)
        beyond = outside  # of the last search, whose limits the set of wrenches narrows
        for _ in range(0 if outside else ATTEMPTS if several else 1):
            if proves_inside(place, box, curves, loads, centered, ranges, precision, rest):
                verdicts[p] = INSIDE
                break
            if beyond:
                break
            if several:
                copy(centered.give, taken)
                box_tensions.search_limits(ranges, taken, size, centered)
                beyond = box_tensions.center_tensions(place, curves, geometry, body, wrench, centered, ranges)
        if several and verdicts[p] == OPEN:
            box_tensions.in_wrench_space(place.rows, centered.left, direction)
            farthest(loads, direction, wrench)
            taken[:] = 0.0
            box_tensions.search_limits(ranges, taken, size, centered)
            outside = box_tensions.center_tensions(place, curves, geometry, body, wrench, centered, ranges)
        if outside and proves_outside(place, box, curves, centered, ranges, precision, rest):
            verdicts[p] = OUTSIDE


@glue
def _tighten_by_load(
    freedom: Array,
    body: Array,
    loads: Loads,
    place: CablesInBox,
    curves: Curves,
    direction: Array,
    ranges: box_tensions.Ranges,
) -> float:
    """Reduce the largest tensions to the values that the load can cause. Returns the sum of all forces [N]."""
    # `direction` (6,) is overwritten.
    direction[:] = 0.0
    direction[2] = 1.0
    upward = body[tables.MASS] * body[tables.GRAVITY] - loads.center[2] + reach_of_loads(loads, direction)
    box_tensions.tighten(freedom, place, curves, upward, ranges)
    size = abs(upward)
    for a in range(6):
        size += abs(loads.center[a])
    for i in range(ranges.low.size):
        size += ranges.low[i] + curves.cables.half_weight[i]
    return size
