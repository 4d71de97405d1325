"""From the tensions at the frame ends of cables to all cable off their drums."""

from __future__ import annotations

import math
from typing import NamedTuple

from sagline.core.arrays import Array
from sagline.kernels import tables
from sagline.kernels.algebra.angle import angle
from sagline.kernels.cable.geometry import CHORD, COSINE, SINE, cable_geometry
from sagline.kernels.cable.pulley import Pulley, Wrap, behind_cable, pulley_at
from sagline.kernels.cable.states import chord_tension_at_frame_end, solve_cable_state
from sagline.kernels.cable.terms import Chord, Material, Model, Terms, model_of
from sagline.kernels.codes import CATENARY, ELASTIC, STRAIGHT
from sagline.kernels.jit import entry, kernel


class _CableAtTension(NamedTuple):
    """A cable that is held at a pose: all of it off the drum [m], what it pulls with [N], and at its frame end [N]."""

    length: float
    pull: float
    tension: float


@kernel
def hold_cable(model: Model, chord: Chord, material: Material, pulley: Pulley, tau: float) -> _CableAtTension:
    """A cable at a chord tension, with what is on its pulley and behind it; pull: T_z - tau sin phi."""
    weightless = model.code == STRAIGHT or model.code == ELASTIC
    weight = 0.0 if weightless else material.density * model.gravity
    length, pull, _status = solve_cable_state(model, chord, material, pulley, tau)
    horizontal, vertical = tau * chord.cosine, tau * chord.sine + pull - weight * length
    tension = math.sqrt(horizontal * horizontal + vertical * vertical)
    # cables of the shallow models leave along their chord, and have its tension behind it
    sine, cosine, there = chord.cosine, pulley.entry * chord.sine, tau
    if model.code == CATENARY:
        there = tension
        sine, cosine = horizontal / there, pulley.entry * vertical / there
    rest = behind_cable(model, material, pulley, there, Wrap(sine, cosine, angle(sine, cosine)))
    return _CableAtTension(length + (rest.wrapped + rest.dead), pull, tension)


@entry
def lengths_at_frame_ends(
    terms: Terms,
    cables: Array,
    body: Array,
    pose: Array,
    tension: Array,
    tension_out: Array,
    length_out: Array,
    rotation: Array,
    geometry: Array,
) -> None:
    """Unstrained lengths off the drums [m] of cables that are held at a pose, each by itself.

    Args:
        terms: Of the cable model.
        cables: Row of the cable_table, (m, CABLE_COLUMNS).
        body: Row of the body_table.
        pose: Pose row.
        tension: At the frame ends [N], (m,).
        tension_out: What they are at these lengths: others, where no cable hangs with so little [N], (m,).
        length_out: (m,).
        rotation: Work array, (3, 3).
        geometry: Work array, (GEOMETRY_ROWS, m).
    """
    model = model_of(terms)
    cable_geometry(cables, body, pose, rotation, geometry)
    for i in range(tension.size):
        chord = Chord(geometry[CHORD, i], geometry[SINE, i], geometry[COSINE, i])
        material, pulley = Material(cables[i, tables.DENSITY], cables[i, tables.STIFFNESS]), pulley_at(cables, i)
        tau = chord_tension_at_frame_end(model, chord, material, pulley, tension[i])
        held = hold_cable(model, chord, material, pulley, tau)
        tension_out[i], length_out[i] = held.tension, held.length
