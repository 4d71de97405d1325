"""Loops over many cables compared with single cables."""

from typing import NamedTuple

import numpy as np
import pytest

from sagline.core.arrays import Array, Codes
from sagline.kernels.cable import models
from sagline.kernels.cable.batch import batch_from_length, batch_from_tension
from sagline.kernels.cable.terms import Chord, Material, Model, Terms
from sagline.kernels.codes import CABLE_NO_TENSION, CATENARY, ELASTIC, EMPIRICAL, PARABOLIC, STRAIGHT
from sagline.kernels.tables import BUFFERS, CHUNK
from tests.kernels.cable.exact import length_and_pull
from tests.kernels.compiled import from_python

from_tension = from_python(models.from_tension)
from_length = from_python(models.from_length)

GRAVITY = 9.81
COUNT = CHUNK + 37


def cables(count: int, largest_strain: float) -> tuple[Array, Array, Array, Array, Array]:
    """Span, rise, density, stiffness and chord tension of cables from very taut to very slack."""
    rng = np.random.default_rng(1)
    span, rise = rng.uniform(0.5, 20.0, count), rng.uniform(-10.0, 10.0, count)
    tension = np.geomspace(5.0, 500.0, count)
    stiffness = tension / np.geomspace(1e-6, largest_strain, count)
    rng.shuffle(stiffness)
    density = 2.0 * tension * rng.uniform(0.001, 6.0, count) / (GRAVITY * np.hypot(span, rise))
    return span, rise, density, stiffness, tension


class Answer(NamedTuple):
    length: Array
    horizontal: Array
    vertical: Array
    status: Codes


def solve(
    terms: Terms, span: Array, rise: Array, density: Array, stiffness: Array, tension: Array, *, count: int
) -> Answer:
    length, horizontal, vertical = np.full((3, count), np.nan)
    status = np.full(count, -1, dtype=np.int8)
    buffer = np.full((BUFFERS, CHUNK), np.nan)
    batch_from_tension(terms, (span, rise, density, stiffness, tension), (length, horizontal, vertical, status), buffer)
    return Answer(length, horizontal, vertical, status)


@pytest.mark.parametrize("code", [STRAIGHT, ELASTIC, EMPIRICAL, PARABOLIC, CATENARY])
def test_many_at_their_tensions(code: int) -> None:
    terms = (code, 4.9, 4.0, GRAVITY)
    given = cables(COUNT, 0.3)
    length, horizontal, vertical, status = solve(terms, *given, count=COUNT)
    for i, (x, z, density, stiffness, tension) in enumerate(zip(*given, strict=True)):
        d = float(np.hypot(x, z))
        one, sag_force, verdict = from_tension(
            Model(*terms), Chord(d, z / d, x / d), Material(density, stiffness), tension
        )
        assert length[i] == pytest.approx(one, rel=1e-14)
        assert horizontal[i] == pytest.approx(tension * x / d, rel=1e-14)
        assert vertical[i] == pytest.approx(tension * z / d + sag_force, rel=1e-13, abs=1e-13 * tension)
        assert status[i] == verdict


@pytest.mark.parametrize("largest", [0.0099, 0.0999])
def test_ordinary_cables_are_equal_to_the_last_digit(largest: float) -> None:
    span, rise, density, stiffness, tension = cables(60, largest)
    density = density / 3.0  # X up to 2
    length, _, vertical, _ = solve((CATENARY, 0.0, 0.0, GRAVITY), span, rise, density, stiffness, tension, count=60)
    for i in range(60):
        sag_force = vertical[i] - tension[i] * rise[i] / np.hypot(span[i], rise[i])
        exact, _ = length_and_pull(
            span[i], rise[i], density[i] * GRAVITY, stiffness[i], tension[i], (length[i], sag_force)
        )
        assert length[i] == pytest.approx(float(exact), rel=1e-14)


def test_one_operand_for_all() -> None:
    terms = (CATENARY, 0.0, 0.0, GRAVITY)
    given = cables(COUNT, 0.05)
    for k in range(5):
        short, full = list(given), list(given)
        short[k], full[k] = given[k][:1].copy(), np.full(COUNT, given[k][0])
        for one, all_of_them in zip(solve(terms, *short, count=COUNT), solve(terms, *full, count=COUNT), strict=True):
            np.testing.assert_array_equal(one, all_of_them)


@pytest.mark.parametrize("code", [STRAIGHT, ELASTIC, EMPIRICAL, PARABOLIC, CATENARY])
def test_many_at_their_lengths(code: int) -> None:
    terms = (code, 4.9, 4.0, GRAVITY)
    span, rise, density, stiffness, tension = cables(40, 0.01)
    length, horizontal, vertical, _ = solve(terms, span, rise, density, stiffness, tension, count=40)
    found, pull_x, pull_z = np.full((3, 40), np.nan)
    status = np.full(40, -1, dtype=np.int8)
    batch_from_length(terms, (span, rise, density, stiffness, length), (found, pull_x, pull_z, status))
    if code == STRAIGHT:
        assert (status == CABLE_NO_TENSION).all()
        return
    np.testing.assert_allclose(found, tension, rtol=1e-9)
    np.testing.assert_allclose(pull_x, horizontal, rtol=1e-9)
    np.testing.assert_allclose(pull_z, vertical, rtol=1e-8, atol=1e-8)
    for k, operand in enumerate((span, rise, density, stiffness, length)):  # one for all
        short = [span, rise, density, stiffness, length]
        short[k] = operand[:1].copy()
        x_s, z_s, rho_s, ea_s, whole_s = short
        batch_from_length(terms, (x_s, z_s, rho_s, ea_s, whole_s), (found, pull_x, pull_z, status))
        for i in (0, 39):
            x, z, rho, ea, whole = (v[min(i, v.size - 1)] for v in short)
            force, verdict = from_length(Model(*terms), x, z, Material(rho, ea), whole)
            np.testing.assert_array_equal((pull_x[i], pull_z[i], found[i]), force)
            assert status[i] == verdict
