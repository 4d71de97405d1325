"""Data of one pose: the cables, their limits, and the factored force balance.

Only this module prepares a pose. The tension distribution methods use the variable t = scale tau + offset, where tau is
the chord tension. The variable is a chord, horizontal or frame-end tension, possibly weighted. Limits and minimum-norm
tensions are stored as t - offset.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from sagline.core.arrays import Array
from sagline.kernels import codes, tables
from sagline.kernels.algebra.bounds import HIGH, LOW, START, STRIP_ROWS
from sagline.kernels.algebra.factors import factorize, minimum_norm, orthogonal_factor, pseudo_inverse
from sagline.kernels.balance.wrench import along_freedom, fill_structure_matrix, needed_wrench, rows_along_freedom
from sagline.kernels.cable import geometry as g
from sagline.kernels.cable.admissible import TensionLimits, fill_admissible_tensions, is_limited_by_strain
from sagline.kernels.cable.cables import Cables
from sagline.kernels.cable.geometry import cable_geometry
from sagline.kernels.cable.models import shallow_sag_force
from sagline.kernels.cable.pulley import pulley_at
from sagline.kernels.cable.terms import Model
from sagline.kernels.jit import glue
from sagline.kernels.memory import Memory, block, vector

SHORTEST_CHORD = 1e-9  # shortest chord [m]


class Platform(NamedTuple):
    """Platform and loads at one pose."""

    freedom: Array  # rows that select the platform's free motions, translations first, (n, 6)
    body: Array  # row of the body_table, (BODY_COLUMNS,)
    robot: Array  # rows of the cable_table, (m, CABLE_COLUMNS)
    pose: Array  # row of the poses, (POSE_COLUMNS,)
    wrench: Array  # external plus inertial wrench, about the center of mass, (6,)


class Balance(NamedTuple):
    """The balance of one pose, for m cables, n free motions and r = m - n redundant cables."""

    rotation: Array  # platform -> world, (3, 3)
    geometry: Array  # rows of `cable_geometry`, (GEOMETRY_ROWS, m)
    full: Array  # structure matrix, (6, m)
    matrix: Array  # structure matrix along the free motions, (n, m)
    # structure matrix for the distribution's variable, overwritten by its Householder reflections, (n, m)
    reduced: Array
    diagonals: Array  # diagonals of the QR factors, (2, n)
    q: Array  # orthogonal factor and one work row, (m + 1, m)
    inverse: Array  # transposed pseudo-inverse in the distribution's variable, (n, m)
    null: Array  # orthonormal null-space basis in the distribution's variable, one vector per row, (r, m)
    needed: Array  # wrench that the chord tensions must supply, (6,)
    right: Array  # components of `needed` along the free motions, (n,)
    scale: Array  # scale of the distribution's variable, (m,)
    offset: Array  # offset of the distribution's variable [N], (m,)
    bounds: Array  # minimum-norm tensions (row START) and limits, in the distribution's variable, (3, m)
    tension: Array  # distributed tensions, in the distribution's variable minus its offset [N], (m,)


@glue
def new_balance(memory: Memory, m: int, n: int) -> tuple[Balance, Memory]:
    """Work arrays for m cables and n free motions, and the remaining memory."""
    rotation, memory = block(memory, 3, 3)
    geometry, memory = block(memory, g.GEOMETRY_ROWS, m)
    full, memory = block(memory, 6, m)
    matrix, memory = block(memory, n, m)
    reduced, memory = block(memory, n, m)
    diagonals, memory = block(memory, 2, n)
    q, memory = block(memory, m + 1, m)
    inverse, memory = block(memory, n, m)
    null, memory = block(memory, max(m - n, 0), m)
    needed, memory = vector(memory, 6)
    right, memory = vector(memory, n)
    bounds, memory = block(memory, STRIP_ROWS, m)
    others, memory = block(memory, 3, m)
    scale, offset, tension = others[0], others[1], others[2]
    balance = Balance(
        rotation, geometry, full, matrix, reduced, diagonals, q, inverse, null, needed, right, scale, offset, bounds,
        tension,
    )  # fmt: skip
    return balance, memory


@glue
def set_pose(
    model: Model,
    limits: TensionLimits,
    variable: int,
    weight: Array,
    platform: Platform,
    cables: Cables,
    balance: Balance,
) -> int:
    """Fill `cables` and `balance` of one pose, with first-order sag forces. Returns POSE_SOLVED or a status of failure.

    weight: root weights of the cables in the distribution's variable, (m,).
    """
    cable_geometry(platform.robot, platform.body, platform.pose, balance.rotation, balance.geometry)
    if not place_cables(model, limits, platform.robot, balance.geometry, cables):
        return codes.POSE_NO_CHORD
    fill_structure_matrix(balance.geometry, balance.full)
    rows_along_freedom(platform.freedom, balance.full, balance.matrix)
    _choose_variable(variable, weight, cables, balance)
    return codes.POSE_SOLVED if factor_balance(balance) else codes.POSE_SINGULAR


@glue
def place_cables(model: Model, limits: TensionLimits, robot: Array, geometry: Array, cables: Cables) -> bool:
    """Fill chords, material, first-order sag forces and admissible tensions. False if a cable has no chord."""
    for i in range(robot.shape[0]):
        chord, sine = geometry[g.CHORD, i], geometry[g.SINE, i]
        if not chord >= SHORTEST_CHORD:
            return False
        cables.chord[i] = chord
        cables.sine[i] = sine
        cables.cosine[i] = geometry[g.COSINE, i]
        cables.density[i] = robot[i, tables.DENSITY]
        cables.stiffness[i] = robot[i, tables.STIFFNESS]
        behind = pulley_at(robot, i)
        cables.radius[i] = behind.radius
        cables.entry[i] = behind.entry
        cables.dead[i] = behind.dead
        cables.rise[i] = behind.rise
        cables.half_weight[i] = 0.5 * robot[i, tables.DENSITY] * model.gravity * chord
        cables.sag_force[i] = shallow_sag_force(model, chord, robot[i, tables.DENSITY])
        low, high = robot[i, tables.TENSION_MIN], robot[i, tables.TENSION_MAX]
        fill_admissible_tensions(model, limits, low, high, cables, i)
    return True


@glue
def _choose_variable(variable: int, weight: Array, cables: Cables, balance: Balance) -> None:
    """Fill scale, offset and limits of the variable of the tension distribution.

    The initial frame-end tension is its first-order value tau - wD/2 sin phi.
    """
    for i in range(weight.size):
        scale = weight[i]
        offset = 0.0
        if variable == codes.HORIZONTAL_TENSION:
            scale *= cables.cosine[i]
        elif variable == codes.FRAME_END_TENSION:
            offset = -cables.half_weight[i] * cables.sine[i]
        balance.scale[i] = scale
        balance.offset[i] = offset
        scale_limits(cables, balance, i)


@glue
def scale_limits(cables: Cables, balance: Balance, i: int) -> None:
    """Fill the limits of cable `i` in the distribution's variable. The limit of the strain is not included."""
    limited = cables.high[i] < math.inf and not is_limited_by_strain(cables, i)
    balance.bounds[LOW, i] = cables.low[i] * balance.scale[i]
    balance.bounds[HIGH, i] = cables.high[i] * balance.scale[i] if limited else math.inf


@glue
def factor_balance(balance: Balance) -> bool:
    """Fill pseudo-inverse and null space for the distribution's variable. False if the rank is not full."""
    n, m = balance.matrix.shape
    matrix, reduced, q = balance.matrix, balance.reduced, balance.q
    for i in range(m):
        back = 1.0 / balance.scale[i]
        for k in range(n):
            reduced[k, i] = matrix[k, i] * back
    if not factorize(reduced, balance.diagonals):
        return False
    orthogonal_factor(reduced, balance.diagonals, q)
    pseudo_inverse(reduced, balance.diagonals, q, balance.inverse)
    for k in range(m - n):
        for i in range(m):
            balance.null[k, i] = q[i, n + k]
    return True


@glue
def fill_needed_wrench(platform: Platform, cables: Cables, balance: Balance) -> None:
    """Fill the needed wrench with the present sag forces."""
    needed_wrench(balance.geometry, platform.body, platform.wrench, cables.sag_force, balance.needed)
    along_freedom(platform.freedom, balance.needed, balance.right)


@glue
def start_from_minimum_norm(balance: Balance) -> None:
    """Fill row START of the bounds with the minimum-norm tensions that supply the needed wrench."""
    minimum_norm(balance.inverse, balance.right, balance.bounds[START])
