"""All cables of one pose: what they are, how they lie, and what they carry."""

from __future__ import annotations

from typing import NamedTuple

from sagline.arrays import Array
from sagline.kernels.cable.terms import Chord, Material
from sagline.kernels.jit import glue
from sagline.kernels.memory import Memory, block


class Cables(NamedTuple):
    """Words for the cables of one pose, each of m values.

    Attributes:
        density: [kg/m].
        stiffness: EA [N].
        half_weight: wD/2 [N].
        chord: D [m].
        sine: sin phi.
        cosine: cos phi.
        low: Lower limit of the chord tension [N].
        high: Upper limit of the chord tension [N], may be infinite.
        tau: Chord tension [N].
        ratio: L/D.
        pull: T_z - tau sin phi [N].
        last_pull: The same in the round before [N].
        slackness: X = wD/(2 tau).
        strain: e = tau/EA.
    """

    density: Array
    stiffness: Array
    half_weight: Array
    chord: Array
    sine: Array
    cosine: Array
    low: Array
    high: Array
    tau: Array
    ratio: Array
    pull: Array
    last_pull: Array
    slackness: Array
    strain: Array


@glue
def new_cables(memory: Memory, m: int) -> tuple[Cables, Memory]:
    """Room for m cables, and the memory that is left."""
    rows, at = block(memory.numbers, 0, 14, m)
    cables = Cables(
        rows[0], rows[1], rows[2], rows[3], rows[4], rows[5], rows[6],
        rows[7], rows[8], rows[9], rows[10], rows[11], rows[12], rows[13],
    )  # fmt: skip
    return cables, Memory(memory.numbers[at:], memory.counters)


@glue
def chord_of(cables: Cables, i: int) -> Chord:
    """The chord of one cable."""
    return Chord(cables.chord[i], cables.sine[i], cables.cosine[i])


@glue
def material_of(cables: Cables, i: int) -> Material:
    """What one cable is made of."""
    return Material(cables.density[i], cables.stiffness[i])
