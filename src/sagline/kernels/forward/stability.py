"""Stability of poses whose solution did not prove it: the smallest stiffness decides."""

from __future__ import annotations

import math

from sagline.core.arrays import Array, Codes, Indices
from sagline.kernels import codes, tables
from sagline.kernels.algebra.eigenvalues import extreme_eigenvalues
from sagline.kernels.balance.wrench import symmetric_part
from sagline.kernels.cable import geometry as g
from sagline.kernels.cable.geometry import CABLE_ROWS, cable_geometry
from sagline.kernels.cable.over_pulleys import material_at
from sagline.kernels.cable.pulley import pulley_at
from sagline.kernels.cable.terms import Model
from sagline.kernels.forward.forward import FLAT
from sagline.kernels.forward.platform import platform_stiffness
from sagline.kernels.forward.problem import ForwardTerms, fill_arcs, row_of
from sagline.kernels.jit import entry, glue
from sagline.kernels.memory import Memory, block


@glue
def _fill_rows(model: Model, cables: Array, results: Array, p: int, rows: Array) -> None:
    """Fill lengths and forces of the cables at pose `p` of a plan, after `cable_geometry`."""
    for k in range(tables.WRAP - tables.LENGTH):  # length and forces have the same order in both arrays
        for i in range(rows.shape[1]):
            rows[g.LENGTH + k, i] = results[tables.LENGTH + k, p, i]
    if model.behind is not None:
        for i in range(rows.shape[1]):
            rows[g.FREE_SPAN, i] = results[tables.SPAN, p, i]
            rows[g.FREE_RISE, i] = results[tables.RISE, p, i]
            rows[g.WRAP, i] = results[tables.WRAP, p, i]
            rows[g.FREE_LENGTH, i] = rows[g.LENGTH, i] - (results[tables.WRAPPED, p, i] + results[tables.DEAD, p, i])
        for i in range(rows.shape[1]):
            # tension and direction at the exit point; cables of the shallow models leave along their chord
            rows[g.LEAVING, i] = rows[g.TENSION, i]
            rows[g.WRAP_SINE, i] = rows[g.COSINE, i]
            rows[g.WRAP_COSINE, i] = pulley_at(cables, i).entry * rows[g.SINE, i]
            if model.code == codes.CATENARY:
                weight = material_at(cables, i).density * model.gravity
                x, z = rows[g.HORIZONTAL, i], rows[g.VERTICAL, i] - weight * rows[g.FREE_LENGTH, i]
                rows[g.LEAVING, i] = math.sqrt(x * x + z * z)
                rows[g.WRAP_SINE, i] = x / rows[g.LEAVING, i]
                rows[g.WRAP_COSINE, i] = pulley_at(cables, i).entry * z / rows[g.LEAVING, i]


@entry
def stabilities_of_poses(
    terms: ForwardTerms,
    robots: tuple[Array, Array, Array],
    poses: Array,
    which: Indices,
    memory: tuple[Array, Indices],
    results: Array,
    pose_statuses: Codes,
) -> None:
    """Decide whether the equilibria of solved poses are stable.

    Args:
        terms: Cable model, the empirical model's constants, and True if cables may have pulleys or dead lengths, else
            None. The stiffness of straight cables is undefined; poses with straight cables therefore count as solved.
        robots: Same as in `inverse_poses`.
        poses: Rows (N, POSE_COLUMNS).
        which: Indices of the poses, (K,).
        memory: Work arrays from `memory_for`, for the number of cables.
        results: Same as in `inverse_poses`, (RESULT_ROWS, N, m).
        pose_statuses: Statuses (N,), filled for these poses: POSE_UNSTABLE if some free motion does not have a positive
            stiffness, else POSE_SOLVED.
    """
    code, k_h, k_p, behind = terms
    freedom, bodies, tables_of_cables = robots
    n, m = freedom.shape[0], results.shape[2]
    rotation, rest = block(Memory(*memory), 3, 3)
    rows, rest = block(rest, CABLE_ROWS, m)
    stiffness, rest = block(rest, 6, 6)
    arcs, rest = block(rest, n, 6)
    matrix, rest = block(rest, n, n)
    work, rest = block(rest, 3, n)
    for p in which:
        pose_statuses[p] = codes.POSE_SOLVED
        if code == codes.STRAIGHT:
            continue
        body, cables = row_of(bodies, p), row_of(tables_of_cables, p)
        model = Model(code, k_h, k_p, body[tables.GRAVITY], behind)
        cable_geometry(cables, body, poses[p], rotation, rows)
        _fill_rows(model, cables, results, p, rows)
        platform_stiffness(model, cables, rows, stiffness)
        fill_arcs(freedom, cables, body, arcs)
        symmetric_part(arcs, stiffness, matrix)
        low, high = extreme_eigenvalues(matrix, work[0], work[1], work[2], FLAT)
        if not low > FLAT * high:
            pose_statuses[p] = codes.POSE_UNSTABLE
