"""Data of one cable, and of all cables of one pose.

Records of numbers cost no time in compiled code, because the compiler replaces a NamedTuple by separate numbers.
"""

from __future__ import annotations

from typing import NamedTuple

from sagline.core.arrays import Array
from sagline.kernels import tables
from sagline.kernels.cable import geometry as g
from sagline.kernels.jit import formula, glue
from sagline.kernels.memory import Memory, block

# a Model as Python passes it: a plain tuple, whose type numba identifies faster
Terms = tuple[int, float, float, float]


class Model(NamedTuple):
    """Cable model with the local gravity."""

    code: int  # code of the equations
    k_h: float  # the empirical model's constant of the sag force
    k_p: float  # the empirical model's constant of the sag
    gravity: float  # [m/s^2]
    # True if cables may have pulleys or dead lengths; if None, the code for pulleys is not compiled
    behind: bool | None = None


@glue
def model_of(terms: Terms) -> Model:
    """Convert the plain tuple `terms` from Python to a `Model`."""
    return Model(terms[0], terms[1], terms[2], terms[3], None)


class Material(NamedTuple):
    """Material of a cable."""

    density: float  # mass per length [kg/m]
    stiffness: float  # EA [N]


class Chord(NamedTuple):
    """The straight line from a cable's frame end to its platform end."""

    length: float  # D [m]
    sine: float  # sin phi
    cosine: float  # cos phi


class Force(NamedTuple):
    """Force on a cable at its platform end, in the cable's vertical plane."""

    horizontal: float  # T_x [N]
    vertical: float  # T_z [N], up positive
    tension: float  # chord tension tau [N]


class PlaneVector(NamedTuple):
    """Horizontal and vertical part in the cable's plane."""

    x: float
    z: float


class PlaneStiffness(NamedTuple):
    """Stiffness of a cable's platform end in the cable's vertical plane [N/m]; rows: force, columns: displacement."""

    xx: float
    xz: float
    zx: float
    zz: float


class Pulley(NamedTuple):
    """Pulley at one frame anchor, and dead length between pulley and drum."""

    radius: float  # R [m]; 0 for an eyelet
    entry: float  # s, +1 if the cable enters from below, -1 if from above
    dead: float  # length of the straight cable from drum to anchor [m]
    rise: float  # height of the anchor above the drum [m]


class Cables(NamedTuple):
    """Data of the cables of one pose, with m values per field."""

    # The free span of a cable is the part between the exit point at its pulley and its platform end. If no cable has a
    # pulley or dead length, each free span is the whole cable. Free spans and cables then share memory.

    machine: bool  # True if any cable has a pulley or dead length
    density: Array  # [kg/m]
    stiffness: Array  # EA [N]
    half_weight: Array  # wD/2 [N]
    chord: Array  # D [m]; for a cable over a pulley, length of the tangent from platform end to pulley
    sine: Array  # sin phi
    cosine: Array  # cos phi
    low: Array  # smallest admissible chord tension [N]
    high: Array  # largest admissible chord tension [N]; infinite only for straight cables
    tau: Array  # chord tension [N]
    ratio: Array  # L/D of the free span
    sag_force: Array  # T_z - tau sin phi [N]
    last_sag_force: Array  # sag force in the previous iteration [N]
    slackness: Array  # X = wD/(2 tau) of the free span
    strain: Array  # e = tau/EA of the free span
    free_half_weight: Array  # wD/2 of the free span [N]
    free_chord: Array  # D of the free span [m]
    free_sine: Array  # sin phi of the free span
    free_cosine: Array  # cos phi of the free span
    free_tau: Array  # chord tension of the free span [N]
    free_sag_force: Array  # T_z - tau sin phi of the free span [N]
    wrap_sine: Array  # sine of the wrap angle psi
    wrap_cosine: Array  # cosine of psi
    radius: Array  # pulley radius [m]
    entry: Array  # +1 if the cable enters its pulley from below, -1 if from above
    dead: Array  # dead length [m]
    rise: Array  # height of the frame anchor above the drum [m]


@glue
def new_cables(memory: Memory, m: int, machine: bool) -> tuple[Cables, Memory]:
    """Work arrays for m cables, with pulleys or dead lengths if `machine` is true, and the remaining memory."""
    own, memory = block(memory, 20, m)
    other, memory = block(memory, 6, m)
    free = other if machine else own[:6]
    cables = Cables(
        machine, own[6], own[7], own[0], own[1], own[2], own[3], own[8], own[9], own[4], own[10], own[5], own[11],
        own[12], own[13], free[0], free[1], free[2], free[3], free[4], free[5], own[18], own[19], own[14], own[15],
        own[16], own[17],
    )  # fmt: skip
    return cables, memory


@formula
def material_at(cables: Array, i: int) -> Material:
    """Material of cable `i` of the cable_table."""
    return Material(cables[i, tables.DENSITY], cables[i, tables.STIFFNESS])


@formula
def chord_at(rows: Array, i: int) -> Chord:
    """Chord of cable `i` at a pose."""
    return Chord(rows[g.CHORD, i], rows[g.SINE, i], rows[g.COSINE, i])


@glue
def chord_of(cables: Cables, i: int) -> Chord:
    """The chord of cable `i`."""
    return Chord(cables.chord[i], cables.sine[i], cables.cosine[i])


@glue
def free_chord_of(cables: Cables, i: int) -> Chord:
    """The chord of the free span of cable `i`."""
    return Chord(cables.free_chord[i], cables.free_sine[i], cables.free_cosine[i])


@glue
def pulley_of(cables: Cables, i: int) -> Pulley:
    """Pulley and dead length of cable `i`."""
    return Pulley(cables.radius[i], cables.entry[i], cables.dead[i], cables.rise[i])


@glue
def material_of(cables: Cables, i: int) -> Material:
    """Material of cable `i`."""
    return Material(cables.density[i], cables.stiffness[i])
