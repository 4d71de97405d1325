"""How a cable's force on its platform end follows its own data, the ends held: dT/dL, dT/d(rho), dT/d(EA)."""

from __future__ import annotations

import math

import numpy as np

from sagline.arrays import Array
from sagline.kernels import tables
from sagline.kernels.algebra.hyperbolic import atanhc_excess
from sagline.kernels.balance import geometry as g
from sagline.kernels.cable.catenary import slack_series
from sagline.kernels.cable.models import pull_of_shallow
from sagline.kernels.cable.stiffness import shallow_slopes
from sagline.kernels.cable.terms import Material, Model
from sagline.kernels.codes import CATENARY, ELASTIC, STRAIGHT
from sagline.kernels.forward.platform import end_stiffness, platform_stiffness, unbalance
from sagline.kernels.forward.problem import Problem, new_space
from sagline.kernels.jit import entry_with_memory, glue, kernel

# which datum changes
BY_LENGTH, BY_DENSITY, BY_STIFFNESS = 0, 1, 2


@kernel
def catenary_end_slopes(horizontal: float, vertical: float, length: float, weight: float, stiffness: float):  # type: ignore[no-untyped-def]
    """Derivatives of P1's end (x, z) by L, w and EA at fixed force, as three pairs.

    New length enters at the frame end, along the tangent there and stretched by T_A.
    """
    vertical_a = vertical - weight * length
    tension_a = math.hypot(horizontal, vertical_a)
    total = tension_a + math.hypot(horizontal, vertical)
    u = weight * length / total
    if u <= 0.5:
        excess = atanhc_excess(u)
    else:
        tension_b = total - tension_a
        excess = slack_series(horizontal, vertical_a, vertical, tension_a, tension_b) - 1.0
    grown = 1.0 / tension_a + 1.0 / stiffness
    total_w = -length * vertical_a / tension_a
    u_w = (length - u * total_w) / total
    if horizontal != 0.0:
        bend = (u * u / (1.0 - u * u) - excess) / u if u > 1e-8 else 2.0 / 3.0 * u
        x_w = 2.0 * horizontal * length * (bend * u_w - (1.0 + excess) * total_w / total) / total
    else:
        x_w = 0.0
    middle = vertical - 0.5 * weight * length
    z_w = -0.5 * length * length * (1.0 / stiffness + 2.0 / total) - 2.0 * middle * length * total_w / (total * total)
    soft = -length / (stiffness * stiffness)
    return (grown * horizontal, grown * vertical_a), (x_w, z_w), (soft * horizontal, soft * middle)


@kernel
def shallow_force_slopes(problem: Problem, i: int, span: float, rise: float, tension: float):  # type: ignore[no-untyped-def]
    """dT/dL, dT/d(rho), dT/d(EA) of a shallow cable in its plane, as three pairs."""
    material = Material(problem.cables[i, tables.DENSITY], problem.cables[i, tables.STIFFNESS])
    _, _, by_length, by_density, by_stiffness = shallow_slopes(
        problem.model, span, rise, material, problem.lengths[i], tension
    )
    chord = math.hypot(span, rise)
    cosine = span / chord
    sine = rise / chord
    pull = pull_of_shallow(problem.model, chord, 1.0)
    return (
        (by_length * cosine, by_length * sine),
        (by_density * cosine, by_density * sine + pull),
        (by_stiffness * cosine, by_stiffness * sine),
    )


@kernel
def elastic_force_slopes(span: float, rise: float, length: float, tension: float, stiffness: float):  # type: ignore[no-untyped-def]
    """The same of a weightless cable; zero where it is slack."""
    if tension == 0.0:
        return (0.0, 0.0), (0.0, 0.0), (0.0, 0.0)
    chord = math.hypot(span, rise)
    by_length = -stiffness / (length * length)  # of tau, over the chord's x and z
    by_stiffness = tension / (stiffness * chord)
    return (by_length * span, by_length * rise), (0.0, 0.0), (by_stiffness * span, by_stiffness * rise)


@glue
def describe_state(problem: Problem, pose: Array, matrix: Array, blocks: Array, slopes: Array, levers: Array) -> None:
    """Fill the platform's stiffness (6, 6) and what every cable does, in world axes.

    blocks: stiffness of its platform end (m, 3, 3); slopes: dT by its three data (3, m, 3); levers of its end (m, 3).
    """
    m = problem.cables.shape[0]
    space = new_space(m, problem.freedom.shape[0])
    unbalance(problem, pose, space)
    platform_stiffness(problem, space)
    matrix[:, :] = space.stiffness
    for i in range(m):
        rows = end_stiffness(problem, space, i)
        c, s = space.geometry[g.AZIMUTH_X, i], space.geometry[g.AZIMUTH_Y, i]
        for j in range(3):
            blocks[i, 0, j] = rows[0][j]
            blocks[i, 1, j] = rows[1][j]
            blocks[i, 2, j] = rows[2][j]
            levers[i, j] = space.geometry[g.LEVER_X + j, i]
        span, rise = space.geometry[g.SPAN, i], space.geometry[g.RISE, i]
        horizontal = space.result[tables.HORIZONTAL, i]
        vertical = space.result[tables.VERTICAL, i]
        tension = space.result[tables.TENSION, i]
        gravity = problem.model.gravity
        weight = problem.cables[i, tables.DENSITY] * gravity
        stiffness = problem.cables[i, tables.STIFFNESS]
        if problem.model.code == CATENARY and weight > 0.0:
            ends = catenary_end_slopes(horizontal, vertical, problem.lengths[i], weight, stiffness)
            for q in range(3):
                x, z = ends[q]
                unit = gravity if q == BY_DENSITY else 1.0
                for j in range(3):  # the force gives way to the end's own motion
                    slopes[q, i, j] = -unit * (rows[j][0] * c * x + rows[j][1] * s * x + rows[j][2] * z)
            continue
        if problem.model.code in (CATENARY, ELASTIC) or weight == 0.0:
            forces = elastic_force_slopes(span, rise, problem.lengths[i], tension, stiffness)
        else:
            forces = shallow_force_slopes(problem, i, span, rise, tension)
        for q in range(3):
            x, z = forces[q]
            slopes[q, i, 0] = x * c
            slopes[q, i, 1] = x * s
            slopes[q, i, 2] = z


@entry_with_memory
def describe_states(
    code: int,
    k_h: float,
    k_p: float,
    freedom: Array,
    bodies: Array,
    robots: Array,
    lengths: Array,
    poses: Array,
    wrenches: Array,
    matrices: Array,
    blocks: Array,
    slopes: Array,
    levers: Array,
) -> None:
    """`describe_state` of N samples: (N, 6, 6), (N, m, 3, 3), (N, 3, m, 3), (N, m, 3); NaN without lengths."""
    scale = np.ones(freedom.shape[0])  # no unit is needed here
    for p in range(lengths.shape[0]):
        if code == STRAIGHT or math.isnan(lengths[p, 0]):
            matrices[p] = math.nan
            blocks[p] = math.nan
            slopes[p] = math.nan
            levers[p] = math.nan
            continue
        body = bodies[min(p, bodies.shape[0] - 1)]
        problem = Problem(
            Model(code, k_h, k_p, body[tables.GRAVITY]),
            freedom,
            robots[min(p, robots.shape[0] - 1)],
            body,
            lengths[p],
            wrenches[min(p, wrenches.shape[0] - 1)],
            scale,
        )
        describe_state(problem, poses[p], matrices[p], blocks[p], slopes[p], levers[p])
