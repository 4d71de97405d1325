"""Stiffness, sensitivities and stability of platforms in equilibrium."""

from __future__ import annotations

import math

from sagline.core.arrays import Array, Codes, Indices
from sagline.kernels import codes, tables
from sagline.kernels.algebra.factors import copy, extreme_eigenvalues
from sagline.kernels.cable import geometry as g
from sagline.kernels.cable.forces import forces_from_lengths
from sagline.kernels.cable.geometry import CABLE_ROWS, cable_geometry
from sagline.kernels.cable.pulley import pulley_at
from sagline.kernels.cable.stiffness import force_of, force_slopes, plane_of, slopes_over
from sagline.kernels.cable.swivel import force_slopes_of_swivel
from sagline.kernels.cable.terms import Model, PlaneVector, material_at
from sagline.kernels.forward import platform as f
from sagline.kernels.forward.forward import FLAT
from sagline.kernels.jit import entry, formula, glue
from sagline.kernels.memory import Memory, block, vector
from sagline.kernels.statics import symmetric_part

# index of the quantity with respect to which the force is differentiated
BY_LENGTH, BY_DENSITY, BY_STIFFNESS, BY_RADIUS, BY_DEAD = 0, 1, 2, 3, 4
DATA = 5


@formula
def _fill_in_world_axes(pair: PlaneVector, rows: Array, i: int, vector: Array) -> None:
    """Fill `vector` (3,) in world axes from its components `pair` in the plane of cable `i`."""
    vector[0] = pair.x * rows[g.AZIMUTH_X, i]
    vector[1] = pair.x * rows[g.AZIMUTH_Y, i]
    vector[2] = pair.z


@glue
def _describe_cable(
    model: Model, cables: Array, rows: Array, i: int, block: Array, slopes: Array, lever: Array
) -> None:
    """Fill `block` (3, 3), `slopes` (DATA, m, 3) and `lever` (3,) of cable `i`, after `platform_stiffness`."""
    across = f.end_stiffness(cables, rows, i)
    for j in range(3):
        block[0, j] = across[0][j]
        block[1, j] = across[1][j]
        block[2, j] = across[2][j]
        lever[j] = rows[g.LEVER_X + j, i]
    if model.behind is not None and tables.SWIVELS and cables.shape[1] > tables.CABLE_COLUMNS:
        force_slopes_of_swivel(model, cables, rows, i, slopes)
        return
    span, rise, length = rows[g.SPAN, i], rows[g.RISE, i], rows[g.LENGTH, i]
    material, force, plane = material_at(cables, i), force_of(rows, i), plane_of(rows, i)
    free = length if model.behind is None else rows[g.FREE_LENGTH, i]
    over = slopes_over(model, material, pulley_at(cables, i), free, force, plane)
    own = over if model.behind is not None else force_slopes(model, span, rise, material, length, force, plane)
    _fill_in_world_axes(over.by_radius, rows, i, slopes[BY_RADIUS, i])
    _fill_in_world_axes(over.by_dead, rows, i, slopes[BY_DEAD, i])
    _fill_in_world_axes(own.by_length, rows, i, slopes[BY_LENGTH, i])
    _fill_in_world_axes(own.by_density, rows, i, slopes[BY_DENSITY, i])
    _fill_in_world_axes(own.by_stiffness, rows, i, slopes[BY_STIFFNESS, i])


@entry
def describe_states(
    model: f.ForwardTerms,
    given: f.SampleArrays,
    memory: tuple[Array, Indices],
    matrices: Array,
    blocks: Array,
    slopes: Array,
    levers: Array,
) -> None:
    """Stiffness and sensitivities of N samples, NaN for straight cables and for lengths that are NaN.

    The arguments are the same as in `forward_poses`, with equilibria as initial poses. To be filled:

    `matrices`: stiffness of the platform, (N, 6, 6). `blocks`: stiffness of every cable's platform end in world axes,
    (N, m, 3, 3). `slopes`: derivatives of the force T of every cable with respect to its data, (N, DATA, m, 3).
    `levers`: vectors from the center of mass to the platform ends, (N, m, 3).
    """
    batch = f.ForwardSamples(*given)
    code, k_h, k_p, behind = model
    count, m = batch.lengths.shape
    rotation, rest = block(Memory(*memory), 3, 3)
    rows, rest = block(rest, CABLE_ROWS, m)
    gradient, rest = vector(rest, 6)
    for p in range(count):
        if code == codes.STRAIGHT or math.isnan(batch.lengths[p, 0]):
            matrices[p] = math.nan
            blocks[p] = math.nan
            slopes[p] = math.nan
            levers[p] = math.nan
            continue
        body, cables = f.row_of(batch.bodies, p), f.row_of(batch.robots, p)
        placed = Model(code, k_h, k_p, body[tables.GRAVITY], behind)
        for i in range(m):
            rows[g.LENGTH, i] = batch.lengths[p, i]
            rows[g.PARAMETER, i] = math.nan  # a result must not depend on the previous sample
        f.unbalance(placed, cables, body, f.row_of(batch.wrenches, p), batch.starts[p], rotation, rows, gradient)
        f.platform_stiffness(placed, cables, rows, matrices[p])
        for i in range(m):
            _describe_cable(placed, cables, rows, i, blocks[p, i], slopes[p], levers[p, i])


@glue
def _fill_rows(model: Model, cables: Array, results: Array, p: int, rows: Array) -> None:
    """Fill lengths and forces of the cables at pose `p` of a plan, after `cable_geometry`."""
    for k in range(tables.WRAP - tables.LENGTH):  # length and forces have the same order in both arrays
        copy(results[tables.LENGTH + k, p], rows[g.LENGTH + k])
    if model.behind is not None:
        for i in range(rows.shape[1]):
            rows[g.FREE_SPAN, i] = results[tables.SPAN, p, i]
            rows[g.FREE_RISE, i] = results[tables.RISE, p, i]
            rows[g.WRAP, i] = results[tables.WRAP, p, i]
            rows[g.FREE_LENGTH, i] = rows[g.LENGTH, i] - (results[tables.WRAPPED, p, i] + results[tables.DEAD, p, i])
        for i in range(rows.shape[1]):
            # tension and direction at the exit point; a cable of a shallow model leaves its pulley along the chord
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
    terms: f.ForwardTerms,
    robots: tuple[Array, Array, Array],
    poses: Array,
    which: Indices,
    memory: tuple[Array, Indices],
    results: Array,
    pose_statuses: Codes,
) -> None:
    """Decide whether the equilibria of solved poses are stable.

    The arguments are the same as in `inverse_poses` and `forward_poses`; `which` (K,) are the indices of the poses. The
    status of each becomes POSE_SOLVED if every free motion has a positive stiffness, else POSE_UNSTABLE. The stiffness
    of straight cables is undefined. Poses with straight cables therefore count as solved.
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
        body, cables = f.row_of(bodies, p), f.row_of(tables_of_cables, p)
        model = Model(code, k_h, k_p, body[tables.GRAVITY], behind)
        cable_geometry(cables, body, poses[p], rotation, rows)
        if tables.SWIVELS and cables.shape[1] > tables.CABLE_COLUMNS:
            copy(results[tables.LENGTH, p], rows[g.LENGTH])
            rows[g.PARAMETER] = math.nan
            forces_from_lengths(model, cables, rows, behind)
        else:
            _fill_rows(model, cables, results, p, rows)
        f.platform_stiffness(model, cables, rows, stiffness)
        f.fill_arcs(freedom, cables, body, arcs)
        symmetric_part(arcs, stiffness, matrix)
        low, high = extreme_eigenvalues(matrix, work[0], work[1], work[2], FLAT)
        if not low > FLAT * high:
            pose_statuses[p] = codes.POSE_UNSTABLE
