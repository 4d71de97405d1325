"""Cable models: printed formulas, both directions, and inputs without a solution."""

import math

import pytest

from sagline.kernels.cable import models
from sagline.kernels.cable.terms import Chord, Material, Model
from sagline.kernels.codes import (
    CABLE_BELOW_VALIDITY,
    CABLE_NO_TENSION,
    CABLE_SLACK,
    CABLE_SOLVED,
    CABLE_TOO_SLACK,
    CATENARY,
    ELASTIC,
    EMPIRICAL,
    PARABOLIC,
    STRAIGHT,
)
from tests.kernels.cable.exact import length_and_pull
from tests.kernels.compiled import from_python

from_tension = from_python(models.from_tension)
from_length = from_python(models.from_length)
shallow_sag_force = from_python(models.shallow_sag_force)

GRAVITY = 9.81
K_H, K_P = 4.9, 4.0
STRAIGHT_MODEL, ELASTIC_MODEL, EMPIRICAL_MODEL, PARABOLIC_MODEL, EXACT = (
    Model(code, K_H, K_P, GRAVITY) for code in (STRAIGHT, ELASTIC, EMPIRICAL, PARABOLIC, CATENARY)
)
CABLE = Material(0.067, 44e3)
CHORD = Chord(5.0, 0.6, 0.8)
FALLING = Chord(8.0, -0.28, 0.96)


def test_sag_forces_of_first_order() -> None:
    for model, expected in (
        (STRAIGHT_MODEL, 0.0),
        (ELASTIC_MODEL, 0.0),
        (EMPIRICAL_MODEL, K_H * 0.067 * 5.0),
        (PARABOLIC_MODEL, 0.5 * 0.067 * GRAVITY * 5.0),
        (EXACT, 0.5 * 0.067 * GRAVITY * 5.0),
    ):
        assert shallow_sag_force(model, 5.0, 0.067) == pytest.approx(expected, rel=1e-15)


@pytest.mark.parametrize("chord", [CHORD, FALLING])
@pytest.mark.parametrize("tension", [30.0, 400.0])
def test_lengths_and_sag_forces_as_printed(tension: float, chord: Chord) -> None:
    d, sine, cosine = chord
    assert from_tension(STRAIGHT_MODEL, chord, CABLE, tension) == (d, 0.0, CABLE_SOLVED)
    assert from_tension(ELASTIC_MODEL, chord, CABLE, tension)[0] == pytest.approx(d / (1.0 + tension / 44e3), rel=1e-15)

    length, sag_force, status = from_tension(PARABOLIC_MODEL, chord, CABLE, tension)
    sag = (GRAVITY * 0.067 * d * cosine / tension) ** 2 / 24.0
    assert length == pytest.approx(d * (1.0 + sag) / (1.0 + tension / 44e3), rel=1e-15)
    assert sag_force == pytest.approx(0.5 * 0.067 * GRAVITY * d, rel=1e-15)
    assert status == CABLE_SOLVED

    length, sag_force, status = from_tension(EMPIRICAL_MODEL, chord, CABLE, tension)
    end = math.hypot(tension * cosine, tension * sine + K_H * 0.067 * d)
    sag = K_P * (0.067 * d * cosine / tension) ** 2
    assert length == pytest.approx(d * (1.0 + sag) / (1.0 + end / 44e3), rel=1e-15)
    assert sag_force == pytest.approx(K_H * 0.067 * d, rel=1e-15)
    assert status == CABLE_SOLVED

    length, sag_force, status = from_tension(EXACT, chord, CABLE, tension)
    expected = length_and_pull(d * cosine, d * sine, 0.067 * GRAVITY, 44e3, tension, (length, sag_force))
    assert length == pytest.approx(float(expected[0]), rel=6e-15)
    assert sag_force == pytest.approx(float(expected[1]), rel=6e-15, abs=1e-15 * tension)
    assert status == CABLE_SOLVED


@pytest.mark.parametrize("chord", [CHORD, FALLING, Chord(12.0, 0.0, 1.0)])
@pytest.mark.parametrize("model", [ELASTIC_MODEL, EMPIRICAL_MODEL, PARABOLIC_MODEL, EXACT])
def test_tensions_are_recovered_from_lengths(model: Model, chord: Chord) -> None:
    for tension in (4.0, 60.0, 2000.0):
        length, sag_force, status = from_tension(model, chord, CABLE, tension)
        force, again = from_length(model, chord.length * chord.cosine, chord.length * chord.sine, CABLE, length)
        assert again == status
        # the last digit of the length changes the tension of a taut cable by EA times as much
        assert force.tension == pytest.approx(tension, rel=1e-11, abs=44e3 * 4e-16)
        assert force.horizontal == pytest.approx(force.tension * chord.cosine, rel=1e-14)
        assert force.vertical - force.tension * chord.sine == pytest.approx(sag_force, rel=1e-11, abs=1e-11)


def test_inputs_without_a_solution() -> None:
    force, status = from_length(STRAIGHT_MODEL, 4.0, 3.0, CABLE, 5.0)
    assert status == CABLE_NO_TENSION
    assert math.isnan(force.tension)
    force, status = from_length(ELASTIC_MODEL, 4.0, 3.0, CABLE, 5.1)
    assert (force.tension, status) == (0.0, CABLE_SLACK)
    assert from_length(PARABOLIC_MODEL, 0.0, 3.0, CABLE, 3.5)[1] == CABLE_SLACK  # a vertical line has no sag
    for model in (PARABOLIC_MODEL, EMPIRICAL_MODEL, EXACT):
        length, sag_force, status = from_tension(model, CHORD, CABLE, 0.5 * 0.067 * GRAVITY * 5.0 / 501.0)
        assert status == CABLE_TOO_SLACK
        assert math.isnan(length)
        assert math.isnan(sag_force)


def test_the_empirical_model_is_valid_while_its_lowest_point_is_outside_the_span() -> None:
    bound = K_H * 0.067 * 5.0 / 0.6
    for chord in (CHORD, Chord(5.0, -0.6, 0.8)):
        assert from_tension(EMPIRICAL_MODEL, chord, CABLE, bound * 1.001)[2] == CABLE_SOLVED
        length, _, status = from_tension(EMPIRICAL_MODEL, chord, CABLE, bound * 0.999)
        assert status == CABLE_BELOW_VALIDITY
        assert from_length(EMPIRICAL_MODEL, 4.0, 5.0 * chord.sine, CABLE, length)[1] == CABLE_BELOW_VALIDITY


def test_a_weightless_cable_is_elastic_in_every_model() -> None:
    for model in (EMPIRICAL_MODEL, PARABOLIC_MODEL, EXACT):
        length, sag_force, _ = from_tension(model, CHORD, Material(0.0, 1e4), 50.0)
        assert length == pytest.approx(5.0 / 1.005, rel=1e-15)
        assert sag_force == 0.0
        force, status = from_length(model, 4.0, 3.0, Material(0.0, 1e4), length)
        assert force.tension == pytest.approx(50.0, rel=1e-11)
        assert status == CABLE_SOLVED
