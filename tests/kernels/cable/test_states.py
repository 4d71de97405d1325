"""All cables of one pose compared with single cables and with multi-precision arithmetic."""

import math

import numpy as np
import pytest

from sagline.core.arrays import Array, Codes
from sagline.kernels.cable import models
from sagline.kernels.cable import states as h
from sagline.kernels.cable.models import ORDINARY_STRAIN, TAUT_STRAIN
from sagline.kernels.cable.terms import Cables, Chord, Material, Model, Pulley, new_cables
from sagline.kernels.codes import CABLE_SOLVED, CABLE_TOO_SLACK, CATENARY, ELASTIC, EMPIRICAL, PARABOLIC, STRAIGHT
from tests.kernels.cable.exact import length_and_pull
from tests.kernels.compiled import from_python, memory

solve_cable_states = from_python(h.solve_cable_states)
frame_end_tension = from_python(h.frame_end_tension)
chord_tension_at_frame_end = from_python(h.chord_tension_at_frame_end)
taut_at_frame_end = from_python(h.taut_at_frame_end)
from_tension = from_python(models.from_tension)
room_for = from_python(new_cables)

GRAVITY = 9.81
EXACT = Model(CATENARY, 0.0, 0.0, GRAVITY)
LAST_DIGITS = 6e-15
NO_PULLEY = Pulley(0.0, 1.0, 0.0, 0.0)


def cables_of(density: Array, stiffness: Array, chord: Array, sine: Array, tau: Array) -> Cables:
    cables: Cables = room_for(memory(), tau.size, False)[0]
    cables.density[:], cables.stiffness[:], cables.chord[:] = density, stiffness, chord
    cables.sine[:], cables.cosine[:], cables.tau[:] = sine, np.sqrt(1.0 - sine * sine), tau
    cables.half_weight[:] = 0.5 * density * GRAVITY * chord
    return cables


def hang(cables: Cables, model: Model = EXACT, near: bool = False) -> tuple[int, Codes]:
    statuses = np.full(cables.tau.size, -1, dtype=np.int8)
    return solve_cable_states(model, cables, not near, near, statuses)[0], statuses


def assert_exact(cables: Cables) -> None:
    for i in range(cables.tau.size):
        chord, tau = cables.chord[i], cables.tau[i]
        x, z = chord * cables.cosine[i], chord * cables.sine[i]
        length, sag_force = length_and_pull(
            x, z, cables.density[i] * GRAVITY, cables.stiffness[i], tau, (cables.ratio[i] * chord, cables.sag_force[i])
        )
        heavy = max(1.0, cables.half_weight[i] / tau)  # the length of a very slack cable grows like exp X
        assert cables.ratio[i] * chord == pytest.approx(float(length), rel=LAST_DIGITS * heavy)
        assert cables.sag_force[i] == pytest.approx(float(sag_force), rel=LAST_DIGITS * heavy, abs=1e-15 * tau)


def at_strains(strains: Array) -> Cables:
    """Ordinary cables, X from 0.002 to 2, at given strains."""
    m = strains.size
    rng = np.random.default_rng(1)
    chord, tau = rng.uniform(1.0, 20.0, m), rng.uniform(5.0, 500.0, m)
    density = 2.0 * tau * np.geomspace(0.002, 1.99, m) / (GRAVITY * chord)
    return cables_of(density, tau / strains, chord, rng.uniform(-0.99, 0.99, m), tau)


def test_taut_cables() -> None:
    cables = at_strains(np.geomspace(1e-6, TAUT_STRAIN * 0.999, 24))
    gravest, statuses = hang(cables)
    assert gravest == CABLE_SOLVED
    assert (statuses == CABLE_SOLVED).all()
    assert_exact(cables)


def test_strains_between_one_and_ten_percent() -> None:
    cables = at_strains(np.linspace(TAUT_STRAIN * 1.001, ORDINARY_STRAIN * 0.999, 24))
    assert hang(cables)[0] == CABLE_SOLVED
    assert_exact(cables)


@pytest.mark.parametrize("place", [0, 3, 7])
def test_one_cable_with_a_large_strain_among_taut_ones(place: int) -> None:
    strains = np.full(8, 1e-3)
    strains[place] = 0.09
    cables = at_strains(strains)
    hang(cables)
    assert_exact(cables)


def test_ordinary_and_extreme_cables_together() -> None:
    cables = at_strains(np.array([1e-3, 0.02, 0.11, 0.3, 1e-4, 0.05]))
    cables.density[4] *= 30.0  # a very slack one
    cables.half_weight[4] *= 30.0
    gravest, statuses = hang(cables)
    assert gravest == CABLE_SOLVED
    assert (statuses == CABLE_SOLVED).all()
    assert_exact(cables)


def test_the_most_severe_status_is_returned_and_each_cable_has_its_own() -> None:
    cables = at_strains(np.full(4, 1e-3))
    cables.density[1] *= 1e5
    cables.half_weight[1] *= 1e5
    gravest, statuses = hang(cables)
    assert gravest == CABLE_TOO_SLACK
    assert list(statuses) == [CABLE_SOLVED, CABLE_TOO_SLACK, CABLE_SOLVED, CABLE_SOLVED]


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_converging_iterations_end_in_the_last_digit(sign: float) -> None:
    cables = at_strains(np.geomspace(1e-5, 0.099, 24))
    hang(cables)
    for change in (0.99 * h.NEAR, 1e-6, 1e-9):
        cables.tau[:] *= 1.0 + sign * change
        hang(cables, near=True)
    assert_exact(cables)


def test_iterations_begin_at_the_last_ratio() -> None:
    cables = at_strains(np.full(6, 1e-3))
    hang(cables)
    expected = cables.ratio.copy()
    hang(cables, near=True)
    np.testing.assert_allclose(cables.ratio, expected, rtol=1e-15)
    cables.ratio[:] = np.nan
    hang(cables, near=True)
    assert np.isnan(cables.ratio).all()
    hang(cables)
    np.testing.assert_array_equal(cables.ratio, expected)


@pytest.mark.parametrize("code", [STRAIGHT, ELASTIC, EMPIRICAL, PARABOLIC, CATENARY])
def test_all_cables_agree_with_single_cables(code: int) -> None:
    model = Model(code, 4.9, 4.0, GRAVITY)
    cables = at_strains(np.geomspace(1e-5, 0.3, 12))
    _, statuses = hang(cables, model)
    for i in range(12):
        line = Chord(cables.chord[i], cables.sine[i], cables.cosine[i])
        length, sag_force, status = from_tension(
            model, line, Material(cables.density[i], cables.stiffness[i]), cables.tau[i]
        )
        assert cables.ratio[i] * cables.chord[i] == pytest.approx(length, rel=1e-15)
        assert cables.sag_force[i] == pytest.approx(sag_force, rel=1e-13)
        assert statuses[i] == status
    np.testing.assert_allclose(cables.slackness, cables.half_weight / cables.tau, rtol=1e-15)
    np.testing.assert_allclose(cables.strain, cables.tau / cables.stiffness, rtol=1e-15)


CABLES = [(0.067, 44e3, 5.0, 0.6), (0.5, 2e4, 12.0, -0.8), (2.0, 1e6, 30.0, 0.05), (0.2, 900.0, 4.0, 0.97)]


@pytest.mark.parametrize("case", CABLES)
@pytest.mark.parametrize("code", [EMPIRICAL, PARABOLIC, CATENARY])
def test_limits_of_the_frame_end_as_chord_tensions(code: int, case: tuple[float, ...]) -> None:
    density, stiffness, length, sine = case
    model, chord = Model(code, 4.9, 4.0, GRAVITY), Chord(length, sine, math.sqrt(1.0 - sine * sine))
    material = Material(density, stiffness)
    weight = density * GRAVITY
    least = 0.5 * weight * length * chord.cosine
    for tension in (1.5 * weight * length, 3.0 * weight * length, 300.0 * weight * length):
        tau = chord_tension_at_frame_end(model, chord, material, NO_PULLEY, tension)
        whole, sag_force, _ = from_tension(model, chord, material, tau)
        end = math.hypot(tau * chord.cosine, tau * sine + sag_force - weight * whole)  # tension at the frame end
        assert frame_end_tension(model, chord, material, NO_PULLEY, tau) == pytest.approx(end, rel=1e-14)
        assert end == pytest.approx(tension, rel=1e-12)
        assert tau > 0.5 * weight * length * sine  # the taut branch
    for tension in (0.0, 0.3 * least):  # below the tension of any cable
        met = max(0.5 * weight * length * sine, 0.0)
        assert chord_tension_at_frame_end(model, chord, material, NO_PULLEY, tension) == met
        assert taut_at_frame_end(model, chord, material, NO_PULLEY, tension, 7.0) == 7.0
    assert chord_tension_at_frame_end(model, chord, material, NO_PULLEY, math.inf) == math.inf


PULLEYS = [NO_PULLEY, Pulley(0.05, 1.0, 0.0, 0.0), Pulley(0.05, -1.0, 0.0, 0.0)]


@pytest.mark.parametrize("pulley", PULLEYS, ids=["eyelet", "from below", "from above"])
@pytest.mark.parametrize("case", [*CABLES[:3], (0.2, 40.0, 4.0, -0.97), (0.3, 30.0, 4.0, 0.9)])
def test_frame_end_limits_near_the_least_tension_of_a_cable(case: tuple[float, ...], pulley: Pulley) -> None:
    density, stiffness, length, sine = case
    chord, material = Chord(length, sine, math.sqrt(1.0 - sine * sine)), Material(density, stiffness)
    half = 0.5 * density * GRAVITY * length
    tensions = np.geomspace(0.2, 20.0, 4000) * half
    ends = [frame_end_tension(EXACT, chord, material, pulley, float(tau)) for tau in tensions]
    least, loosest = min(ends), tensions[np.argmin(ends)]
    digits = (
        1e-12 if pulley.radius == 0.0 else 1e-9
    )  # the exit point of a slack cable from its pulley requires iterations
    for share in (1.001, 1.01, 1.1, 2.0):
        tau = taut_at_frame_end(EXACT, chord, material, pulley, share * least, 0.0)
        assert frame_end_tension(EXACT, chord, material, pulley, tau) == pytest.approx(share * least, rel=digits)
        assert tau > loosest
    for share in np.linspace(0.1, 0.999, 40):
        assert taut_at_frame_end(EXACT, chord, material, pulley, float(share) * least, -1.0) == -1.0


def test_weightless_cables_have_one_tension() -> None:
    chord = Chord(5.0, 0.6, 0.8)
    for model, density in ((Model(ELASTIC, 0.0, 0.0, GRAVITY), 0.5), (EXACT, 0.0)):
        material = Material(density, 44e3)
        assert chord_tension_at_frame_end(model, chord, material, NO_PULLEY, 70.0) == 70.0
        assert frame_end_tension(model, chord, material, NO_PULLEY, 70.0) == pytest.approx(70.0, rel=1e-15)
