"""Bounds of changes of sag forces compared with sag forces of random cables."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from sagline.core.arrays import Array
from sagline.kernels.cable import models, states
from sagline.kernels.cable.states import LOOSEST
from sagline.kernels.cable.terms import Chord, Material, Model, Pulley
from sagline.kernels.workspaces import sag_force_bounds
from sagline.kernels.workspaces.box_tensions import SLACK
from tests.kernels.cable.curves import GRAVITY, random_curves
from tests.kernels.compiled import from_python

fall, rise = from_python(sag_force_bounds.fall), from_python(sag_force_bounds.rise)
fall_rate, rise_rate = from_python(sag_force_bounds.fall_rate), from_python(sag_force_bounds.rise_rate)
sag_force_slope, largest_sag_force = (
    from_python(sag_force_bounds.sag_force_slope),
    from_python(sag_force_bounds.largest_sag_force),
)
from_tension = from_python(models.from_tension)
chord_tension_at_frame_end = from_python(states.chord_tension_at_frame_end)
MODEL = Model(4, 0.0, 0.0, GRAVITY)


@pytest.mark.parametrize("soft", [False, True], ids=["", "strains to thirty"])
def test_tensions(soft: bool) -> None:
    rng = np.random.default_rng(1)
    tightest = 0.0
    for _ in range(100):
        curves = random_curves(rng, 8)
        cables: Any = curves.cables
        if soft:
            cables.stiffness[:] = cables.low / 10 ** rng.uniform(-2.0, 1.5, 8)
        for i in range(8):
            low = max(cables.low[i], cables.half_weight[i] / LOOSEST)
            high = low * 10 ** rng.uniform(0.01, 2)
            sag_forces = [_pull(cables, i, tau) for tau in (low, high, low * 1.0001)]
            tiny = 1e-12 * low
            assert (
                -rise(curves, i, low, high) - tiny <= sag_forces[0] - sag_forces[1] <= fall(curves, i, low, high) + tiny
            )
            assert sag_forces[0] <= largest_sag_force(curves, i, low) + tiny
            change = (sag_forces[0] - sag_forces[2]) / (1e-4 * low)
            assert -rise_rate(curves, i, low) - 1e-8 <= change <= fall_rate(curves, i, low) + 1e-8
            tightest = max(tightest, (sag_forces[0] - sag_forces[1]) / fall(curves, i, low, high))
    assert soft or tightest > 0.99  # and the bounds are not much larger than necessary


def test_positions() -> None:
    rng = np.random.default_rng(2)
    tightest = 0.0
    for _ in range(100):
        curves = random_curves(rng, 8)
        cables: Any = curves.cables
        for i in range(8):
            chord, sine, cosine = cables.chord[i], cables.sine[i], cables.cosine[i]
            tau = max(cables.low[i], cables.half_weight[i] / LOOSEST)
            step = rng.normal(size=2)
            step *= chord * 10 ** rng.uniform(-4, -0.5) / np.linalg.norm(step)
            span, height = chord * cosine + step[0], chord * sine + step[1]
            if span <= 0.0:
                continue
            way, there = float(np.hypot(*step)), float(np.hypot(span, height))
            material = Material(float(cables.density[i]), float(cables.stiffness[i]))
            moved = from_tension(MODEL, Chord(there, height / there, span / there), material, float(tau))[1]
            change = abs(moved - _pull(cables, i, tau))
            most = way * sag_force_slope(curves, i, way, tau)
            assert change <= most + 1e-12 * tau
            tightest = max(tightest, change / most)
    assert tightest > 0.95


def test_frame_end_limits_have_the_same_bounds() -> None:
    rng = np.random.default_rng(3)
    tightest = 0.0
    for _ in range(100):
        curves = random_curves(rng, 8)
        cables: Any = curves.cables
        for i in range(8):
            half, material = cables.half_weight[i], Material(float(cables.density[i]), float(cables.stiffness[i]))
            place = np.array([cables.chord[i] * cables.cosine[i], cables.chord[i] * cables.sine[i]])
            step = rng.normal(size=2)
            way = float(cables.chord[i] * 10 ** rng.uniform(-4, -1))
            there = place + step * way / np.linalg.norm(step)
            tight = half * (1.0 + way / cables.chord[i]) / SLACK
            limit = tight * 10 ** rng.uniform(0.2, 1.0)
            if there[0] <= 0.0:
                continue
            limits = [_chord_limit(at, material, float(limit)) for at in (place, there)]
            if min(limits) < tight:
                continue
            change, most = abs(limits[1] - limits[0]), way * sag_force_slope(curves, i, way, tight)
            assert change <= most + 1e-10 * limit
            tightest = max(tightest, change / most)
    assert tightest > 0.6


def _chord_limit(place: Array, material: Material, tension: float) -> float:
    length = float(np.linalg.norm(place))
    chord = Chord(length, float(place[1]) / length, float(place[0]) / length)
    return float(chord_tension_at_frame_end(MODEL, chord, material, Pulley(0.0, 1.0, 0.0, 0.0), tension))


def _pull(cables: Any, i: int, tau: float) -> float:
    chord = Chord(float(cables.chord[i]), float(cables.sine[i]), float(cables.cosine[i]))
    material = Material(float(cables.density[i]), float(cables.stiffness[i]))
    return float(from_tension(MODEL, chord, material, float(tau))[1])
