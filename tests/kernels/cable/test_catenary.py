"""One exact cable in multi-precision arithmetic: all branches of the kernel, and the changes between them."""

import math
from decimal import Decimal, localcontext

import numpy as np
import pytest

from sagline.kernels.cable import models as c
from sagline.kernels.codes import CABLE_SLACK, CABLE_SOLVED, CABLE_TOO_SLACK
from tests.kernels.cable.exact import exact_end, length_and_pull
from tests.kernels.compiled import from_python

is_ordinary = from_python(c.is_ordinary)
ordinary_length_ratio = from_python(c.ordinary_length_ratio)
ordinary_length_ratio_near = from_python(c.ordinary_length_ratio_near)
ordinary_sag_force_ratio = from_python(c.ordinary_sag_force_ratio)
length_ratio = from_python(c.length_ratio)
sag_force_ratio = from_python(c.sag_force_ratio)
catenary_from_length = from_python(c.catenary_from_length)
catenary_end = from_python(c.catenary_end)

SLOPES = (-0.999, -0.6, -0.01, 0.0, 0.3, 0.9)
LAST_DIGITS = 6e-15  # relative, rounding of a dozen products and a polynomial


def exact(half_weight: float, sine: float, strain: float, near: tuple[float, float]) -> tuple[float, float, float]:
    """L/D and (T_z - tau sin phi)/tau of a cable with D = 1 and tau = 1 (multi-precision), and cos phi in doubles."""
    cosine = math.sqrt(1.0 - sine * sine)
    size = math.hypot(cosine, sine)
    # D = size instead of 1 in the last digit: X and e belong to tau = 1
    length, sag_force = length_and_pull(
        cosine, sine, 2.0 * half_weight / size, 1.0 / strain, 1.0, (near[0] * size, near[1])
    )
    return float(length / Decimal(size)), float(sag_force), cosine


@pytest.mark.parametrize("sine", SLOPES)
@pytest.mark.parametrize("strain", [1e-7, 1e-4, 0.0099, 0.0101, 0.05, 0.0999, 0.1001, 0.4])
@pytest.mark.parametrize("half_weight", [1e-6, 1e-3, 0.1, 1.0, 1.999, 2.001, 6.0, 40.0])
def test_length_and_sag_force_at_a_chord_tension(half_weight: float, strain: float, sine: float) -> None:
    cosine = math.sqrt(1.0 - sine * sine)
    ratio, status = length_ratio(half_weight, sine, cosine, strain)
    assert status == CABLE_SOLVED
    sag_force = sag_force_ratio(half_weight, sine, strain, ratio)
    length, force, _ = exact(half_weight, sine, strain, (ratio, sag_force))
    # the length of a very slack cable grows like exp X, and rounding of X with it
    assert ratio == pytest.approx(length, rel=LAST_DIGITS * max(1.0, half_weight))
    assert sag_force == pytest.approx(force, rel=LAST_DIGITS * max(1.0, half_weight), abs=1e-15)


@pytest.mark.parametrize("sine", SLOPES)
@pytest.mark.parametrize("half_weight", [1e-6, 1e-3, 0.1, 1.0, 1.999])
def test_ordinary_cables_without_branches(half_weight: float, sine: float) -> None:
    for strain in (1e-7, 1e-4, c.TAUT_STRAIN, 0.0101, 0.03, 0.07, c.ORDINARY_STRAIN):
        cosine = math.sqrt(1.0 - sine * sine)
        assert is_ordinary(half_weight, strain)
        ratio = ordinary_length_ratio(half_weight, sine, cosine, strain)
        if strain > c.TAUT_STRAIN:
            ratio = ordinary_length_ratio_near(half_weight, sine, cosine, strain, ratio)
        sag_force = ordinary_sag_force_ratio(half_weight, sine, strain, ratio)
        length, force, _ = exact(half_weight, sine, strain, (ratio, sag_force))
        assert ratio == pytest.approx(length, rel=LAST_DIGITS)
        assert sag_force == pytest.approx(force, rel=LAST_DIGITS, abs=1e-15)


@pytest.mark.parametrize("sine", SLOPES)
@pytest.mark.parametrize("strain", [1e-5, 1e-3, 0.01, 0.05, 0.099])
def test_one_step_from_a_close_tension(strain: float, sine: float) -> None:
    cosine = math.sqrt(1.0 - sine * sine)
    # the remainder is quadratic in the change, or rounding for a taut cable or a small change
    for change, half_weight, left in ((1e-3, 5e-3, 0.0), (1e-7, 1.999, 0.0), (1e-3, 0.3, 1e-11), (1e-3, 1.999, 3e-8)):
        there = length_ratio(half_weight, sine, cosine, strain)[0]
        for factor in (1.0 - change, 1.0 + change):
            close = length_ratio(half_weight * factor, sine, cosine, strain / factor)[0]
            again = ordinary_length_ratio_near(half_weight, sine, cosine, strain, close)
            assert again == pytest.approx(there, rel=LAST_DIGITS + left)


def test_limit_of_ordinary_cables() -> None:
    assert is_ordinary(2.0, 0.1)
    assert not is_ordinary(2.0001, 0.1)
    assert not is_ordinary(2.0, 0.1001)
    assert not is_ordinary(math.nan, 0.01)


def test_a_cable_that_is_too_slack_has_no_length() -> None:
    assert length_ratio(130.0, 0.2, math.sqrt(0.96), 1e-6)[1] == CABLE_SOLVED
    ratio, status = length_ratio(500.0, 0.2, math.sqrt(0.96), 1e-6)
    assert math.isnan(ratio)
    assert status == CABLE_TOO_SLACK
    assert length_ratio(math.nan, 0.2, math.sqrt(0.96), 1e-6)[1] == CABLE_TOO_SLACK


# span, rise, length [m], weight per length [N/m], axial stiffness [N]
HANGING = [
    (5.0, 1.0, 5.05, 0.66, 44e3),
    (5.0, -1.0, 5.2, 0.66, 44e3),
    (8.0, 3.0, 8.3, 0.66, 44e3),  # shorter than its chord
    (8.0, 3.0, 60.0, 20.0, 1e5),
    (0.3, 9.0, 9.2, 0.66, 44e3),
    (0.01, 2.0, 9.0, 5.0, 1e5),
    (10.0, 0.0, 9.9, 1e-6, 1e4),
]


@pytest.mark.parametrize("case", HANGING)
def test_forces_at_a_length_give_the_position_of_the_end(case: tuple[float, ...]) -> None:
    span, rise, length, weight, stiffness = case
    force, status = catenary_from_length(*case)
    assert status == CABLE_SOLVED
    chord = math.hypot(span, rise)
    sag_force = force.vertical - force.tension * rise / chord
    found, exact_pull = length_and_pull(span, rise, weight, stiffness, force.tension, (length, sag_force))
    assert force.horizontal == pytest.approx(force.tension * span / chord, rel=1e-14)
    assert force.vertical == pytest.approx(float(exact_pull) + force.tension * rise / chord, rel=1e-12)
    # the tension to its last digits: a change by 1e-13 is visible in the length
    slightly, _ = length_and_pull(span, rise, weight, stiffness, force.tension * (1.0 + 1e-13), (length, sag_force))
    assert abs(found - Decimal(length)) <= max(abs(slightly - found), Decimal(4e-16 * length))


def test_a_vertical_cable() -> None:
    force, status = catenary_from_length(0.0, 3.0, 2.99, 0.66, 44e3)
    assert status == CABLE_SOLVED
    # suspended at its upper end with a force at its lower end: stretch (height - L)/L = (T_z - wL/2)/EA
    assert force.vertical == pytest.approx(44e3 * 0.01 / 2.99 + 0.5 * 0.66 * 2.99, rel=1e-13)
    assert force.horizontal == 0.0
    force, status = catenary_from_length(0.0, -3.0, 2.99, 0.66, 44e3)
    assert force.vertical == pytest.approx(-44e3 * 0.01 / 2.99 + 0.5 * 0.66 * 2.99, rel=1e-13)
    assert catenary_from_length(0.0, 3.0, 4.0, 0.66, 44e3)[1] == CABLE_SLACK


@pytest.mark.parametrize("forces", [(300.0, 400.0), (5.0, -3.0), (1e-3, 4.0), (0.5, 2.9), (1e4, 1.0)])
def test_the_end_of_a_cable_of_given_forces(forces: tuple[float, float]) -> None:
    rest = (9.0, 0.66, 44e3)
    with localcontext() as context:
        context.prec = 50
        expected = exact_end(*(Decimal(v) for v in (*forces, *rest)))
    np.testing.assert_allclose(catenary_end(*forces, *rest), [float(v) for v in expected], rtol=4e-15, atol=1e-15)


def test_a_cable_without_forces_or_weight_ends_where_it_begins() -> None:
    assert catenary_end(0.0, 0.0, 9.0, 0.0, 44e3) == (0.0, 0.0)
    x, z = catenary_end(0.0, 9.0, 9.0, 1.0, 44e3)
    assert x == 0.0
    assert z == pytest.approx(9.0 + 0.5 * 81.0 / 44e3, rel=1e-15)
