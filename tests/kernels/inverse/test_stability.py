"""Bounds of the compliances of single cables, compared with the stiffness of their platform ends."""

from __future__ import annotations

import numpy as np
import pytest

import sagline as sl
from sagline.core.arrays import Array
from sagline.kernels.cable import models
from sagline.kernels.cable.stiffness import cable_stiffness
from sagline.kernels.cable.terms import Chord, Force, Material, Model, new_cables
from sagline.kernels.inverse.stability import _fill_compliances, new_stability_arrays
from tests.kernels.compiled import from_python, memory

COUNT = 400
MODELS = {model.code: model for model in (sl.Catenary(), sl.Elastic(), sl.Parabolic(), sl.Empirical())}


def bounds_and_stiffness(code: int, gravity: float) -> tuple[Array, Array, Array]:
    """Bounds c (N,), chords u (N, 2) and symmetric parts of the stiffness (N, 2, 2) of random cables."""
    rng = np.random.default_rng(code)
    model = Model(code, *MODELS[code].parameters, gravity, None)
    cables, _ = from_python(new_cables)(memory(40 * COUNT), COUNT, False)
    work, _ = from_python(new_stability_arrays)(memory(40 * COUNT), COUNT, 3)
    cables.chord[:] = rng.uniform(1.0, 20.0, COUNT)
    angle = rng.uniform(-1.55, 1.55, COUNT)
    cables.sine[:], cables.cosine[:] = np.sin(angle), np.cos(angle)
    cables.density[:] = 10.0 ** rng.uniform(-2.0, 0.0, COUNT)
    cables.stiffness[:] = 10.0 ** rng.uniform(3.0, 6.0, COUNT)
    weight = cables.density * 9.81 * cables.chord
    cables.tau[:] = weight * 10.0 ** rng.uniform(0.0, 2.0, COUNT)
    plane = np.empty((COUNT, 2, 2))
    from_tension, stiffness = from_python(models.from_tension), from_python(cable_stiffness)
    for i in range(COUNT):
        chord = Chord(cables.chord[i], cables.sine[i], cables.cosine[i])
        material = Material(cables.density[i], cables.stiffness[i])
        length, cables.sag_force[i], _ = from_tension(model, chord, material, cables.tau[i])
        cables.ratio[i] = length / chord.length
        force = Force(cables.tau[i] * chord.cosine, cables.tau[i] * chord.sine + cables.sag_force[i], cables.tau[i])
        span, rise = chord.length * chord.cosine, chord.length * chord.sine
        plane[i] = np.reshape(stiffness(model, span, rise, material, length, force), (2, 2))
    from_python(_fill_compliances)(model, cables, work)
    chords = np.column_stack((cables.cosine, cables.sine))
    return work.compliance.copy(), chords, 0.5 * (plane + plane.transpose(0, 2, 1))


@pytest.mark.parametrize("gravity", [9.81, 0.0])
@pytest.mark.parametrize("code", MODELS, ids=lambda code: type(MODELS[code]).__name__)
def test_a_cable_is_at_least_as_stiff_as_the_bound(code: int, gravity: float) -> None:
    compliance, chord, stiffness = bounds_and_stiffness(code, gravity)
    known = np.isfinite(compliance)
    assert known.mean() > 0.8
    rest = (stiffness - chord[:, :, None] * chord[:, None, :] / compliance[:, None, None])[known]
    scale = np.linalg.norm(stiffness[known], axis=(1, 2))
    low, high = np.linalg.eigvalsh(rest).T
    assert (low >= -1e-12 * scale).all()
    # the bound is the largest one: without it, no stiffness is left in one direction
    assert np.quantile(low / high, 0.9) < (1e-9 if code in (sl.Catenary.code, sl.Elastic.code) else 0.02)
