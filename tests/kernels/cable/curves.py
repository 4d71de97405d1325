"""Cables of one pose as kernel arguments, and their sag forces one by one as the reference of their curves."""

from __future__ import annotations

import numpy as np

from sagline.core.arrays import Array
from sagline.kernels.cable import models, sag_forces
from sagline.kernels.cable.sag_forces import TURN_ROWS, Curves
from sagline.kernels.cable.terms import Chord, Material, Model
from sagline.kernels.codes import CATENARY
from tests.kernels.cable.plain import plain_cables
from tests.kernels.compiled import compiled, from_python, memory

GRAVITY = 9.81

find_extrema = from_python(sag_forces.find_extrema)
sag_force_range = from_python(sag_forces.sag_force_range)


def random_curves(rng: np.random.Generator, m: int, model: int = CATENARY) -> Curves:
    """Chords of 1 to 100 m at any slope, X = wD/(2 tau) up to 3 at the least tension, strains up to a hundredth."""
    chord, slope = 10 ** rng.uniform(0, 2, m), rng.uniform(-np.pi / 2, np.pi / 2, m)
    density = 10 ** rng.uniform(-2, 1, m)
    half_weight = 0.5 * density * GRAVITY * chord
    low = half_weight / 10 ** rng.uniform(-2.5, 0.5, m)
    high = low * 10 ** rng.uniform(0.3, 3, m)
    stiffness = high / 10 ** rng.uniform(-5, -2, m)
    sine = np.where(rng.uniform(size=m) < 0.05, -1.0, np.sin(slope))
    cables = plain_cables(
        m, np.nan, density=density, stiffness=stiffness, half_weight=half_weight, chord=chord, sine=sine,
        cosine=np.sqrt(1 - sine * sine), low=low, high=high,
    )  # fmt: skip
    turned = np.full((TURN_ROWS, m), np.nan)
    return Curves(Model(model, 4.9, 4.0, GRAVITY), cables, turned, np.zeros(m, dtype=np.int8))


def with_turns(curves: Curves) -> Curves:
    """The same with extrema of sag forces."""
    find_extrema(curves, curves.cables.low, curves.cables.high, memory())
    return curves


def pulls_of(curves: Curves, i: int, tensions: Array) -> Array:
    """Sag forces of cable i, one by one."""
    cables = curves.cables
    chord = Chord(float(cables.chord[i]), float(cables.sine[i]), float(cables.cosine[i]))
    material = Material(float(cables.density[i]), float(cables.stiffness[i]))
    found = np.empty(len(tensions))
    each_pull(curves.model, chord, material, tensions, found)
    return found


@compiled
def each_pull(model: Model, chord: Chord, material: Material, tensions: Array, found: Array) -> None:
    """The same, into an array."""
    for k in range(tensions.size):
        found[k] = models.from_tension(model, chord, material, tensions[k])[1]
