"""Stiffness of a platform in equilibrium, and derivatives of the cable forces with respect to cable data."""

from __future__ import annotations

import math

from sagline.core.arrays import Array, Indices
from sagline.kernels import codes, tables
from sagline.kernels.cable import geometry as g
from sagline.kernels.cable.geometry import CABLE_ROWS
from sagline.kernels.cable.over_pulleys import material_at
from sagline.kernels.cable.pulley import pulley_at
from sagline.kernels.cable.slopes import PlaneVector, force_slopes, slopes_over
from sagline.kernels.cable.stiffness import force_of, plane_of
from sagline.kernels.cable.terms import Model
from sagline.kernels.forward.platform import end_stiffness, platform_stiffness, unbalance
from sagline.kernels.forward.problem import ForwardSamples, ForwardTerms, SampleArrays, row_of
from sagline.kernels.jit import entry, formula, glue
from sagline.kernels.memory import Memory, block, vector

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
    across = end_stiffness(rows, i)
    for j in range(3):
        block[0, j] = across[0][j]
        block[1, j] = across[1][j]
        block[2, j] = across[2][j]
        lever[j] = rows[g.LEVER_X + j, i]
    span, rise, length = rows[g.SPAN, i], rows[g.RISE, i], rows[g.LENGTH, i]
    material, force, plane = material_at(cables, i), force_of(rows, i), plane_of(rows, i)
    free = length if model.behind is None else rows[g.FREE_LENGTH, i]
    own, machine = slopes_over(model, material, pulley_at(cables, i), free, force, plane)
    if model.behind is None:
        own = force_slopes(model, span, rise, material, length, force, plane)
    _fill_in_world_axes(machine.by_radius, rows, i, slopes[BY_RADIUS, i])
    _fill_in_world_axes(machine.by_dead, rows, i, slopes[BY_DEAD, i])
    _fill_in_world_axes(own.by_length, rows, i, slopes[BY_LENGTH, i])
    _fill_in_world_axes(own.by_density, rows, i, slopes[BY_DENSITY, i])
    _fill_in_world_axes(own.by_stiffness, rows, i, slopes[BY_STIFFNESS, i])


@entry
def describe_states(
    model: ForwardTerms,
    given: SampleArrays,
    memory: tuple[Array, Indices],
    matrices: Array,
    blocks: Array,
    slopes: Array,
    levers: Array,
) -> None:
    """Stiffness and sensitivities of N samples; NaN for straight cables and if lengths are NaN.

    Args:
        model: Cable model, the empirical model's constants, and True if cables may have pulleys or dead lengths, else
            None.
        given: `ForwardSamples`, whose initial poses are the equilibria.
        memory: Work arrays from `memory_for`, for the number of cables.
        matrices: Filled with stiffness of the platform, (N, 6, 6).
        blocks: Filled with stiffness of every cable's platform end in world axes, (N, m, 3, 3).
        slopes: Filled with derivatives of the force T of every cable with respect to its data, (N, DATA, m, 3).
        levers: Filled with vectors from the center of mass to the platform ends, (N, m, 3).
    """
    batch = ForwardSamples(*given)
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
        body, cables = row_of(batch.bodies, p), row_of(batch.robots, p)
        placed = Model(code, k_h, k_p, body[tables.GRAVITY], behind)
        for i in range(m):
            rows[g.LENGTH, i] = batch.lengths[p, i]
            rows[g.PARAMETER, i] = math.nan  # a result must not depend on the previous sample
        unbalance(placed, cables, body, row_of(batch.wrenches, p), batch.starts[p], rotation, rows, gradient)
        platform_stiffness(placed, cables, rows, matrices[p])
        for i in range(m):
            _describe_cable(placed, cables, rows, i, blocks[p, i], slopes[p], levers[p, i])
