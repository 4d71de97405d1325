"""Stiffness and energy of one cable compared with multi-precision derivatives and integrals, and with its forces."""

import math
from decimal import Decimal, localcontext

import numpy as np
import pytest

import sagline as sl
from sagline.core.arrays import Array
from sagline.kernels.cable import models, stiffness
from sagline.kernels.cable.terms import Force, Material, Model
from tests.kernels.cable.exact import exact_end
from tests.kernels.compiled import from_python

catenary_from_length = from_python(models.catenary_from_length)
catenary_energy = from_python(stiffness.catenary_energy)
elastic_energy = from_python(stiffness.elastic_energy)
cable_stiffness = from_python(stiffness.cable_stiffness)
catenary_stiffness = from_python(stiffness.catenary_stiffness)

# horizontal and vertical force at the platform end [N], length [m], weight per length [N/m], axial stiffness [N]
CABLES = {
    "taut, rising": (300.0, 400.0, 9.0, 0.66, 44e3),
    "taut, falling": (300.0, -250.0, 9.0, 0.66, 44e3),
    "level": (500.0, 3.0, 9.0, 0.66, 44e3),
    "light and stiff": (500.0, 200.0, 12.0, 1e-6, 1e8),
    "heavy": (2e5, 1.9e5, 300.0, 78.5, 1.7e8),
    "U-shaped": (2.0, 3.5, 12.0, 0.66, 44e3),
    "deep fold": (1e-3, 4.0, 12.0, 0.66, 44e3),
    "soft": (900.0, 700.0, 5.0, 3.0, 2e3),
    "steep": (1e-3, 300.0, 8.0, 0.66, 44e3),
}


@pytest.mark.parametrize("case", CABLES.values(), ids=CABLES.keys())
def test_catenary_stiffness_is_the_inverse_of_the_flexibility(case: tuple[float, ...]) -> None:
    with localcontext() as context:
        context.prec = 80
        t_x, t_z, *rest = (Decimal(v) for v in case)
        h = Decimal("1e-30")
        (a, c), (_, b) = (
            tuple(
                (above - below) / (2 * h)
                for above, below in zip(
                    exact_end(t_x + h * dx, t_z + h * dz, *rest),
                    exact_end(t_x - h * dx, t_z - h * dz, *rest),
                    strict=True,
                )
            )
            for dx, dz in ((1, 0), (0, 1))
        )
        determinant = a * b - c * c
        expected = [float(v / determinant) for v in (b, -c, a)]
    # each element relative to its size, so that a soft direction is visible beside a stiff one
    found = catenary_stiffness(*case)
    assert found.xz == found.zx
    np.testing.assert_allclose((found.xx, found.xz, found.zz), expected, rtol=3e-13)


def test_a_vertical_cable_has_equal_lateral_stiffnesses() -> None:
    (t_x, t_z, tension), _ = catenary_from_length(0.0, 3.0, 2.99, 0.66, 44e3)
    assert t_x == 0.0
    xx, xz, _, _ = catenary_stiffness(t_x, t_z, 2.99, 0.66, 44e3)
    assert xz == 0.0
    assert xx == pytest.approx(tension / 3.0, rel=1e-12)


@pytest.mark.parametrize("case", [c for c in CABLES.values() if c[0] > 1.0])
def test_catenary_energy_is_strain_and_height_of_its_mass(case: tuple[float, ...]) -> None:
    nodes, weights = np.polynomial.legendre.leggauss(40)
    with localcontext() as context:
        context.prec = 50
        t_x, t_z, length, w, ea = (Decimal(v) for v in case)
        x, z = exact_end(t_x, t_z, length, w, ea)
        expected = Decimal(0)
        for node, weight in zip(nodes, weights, strict=True):
            s = length * (1 + Decimal(node)) / 2
            sag_force = t_z - w * (length - s)
            _, height = exact_end(t_x, sag_force, s, w, ea)
            expected += Decimal(weight) * length / 2 * ((t_x**2 + sag_force**2) / (2 * ea) + w * height)
    found = catenary_energy(float(x), float(z), case[2], Force(case[0], case[1], math.nan), case[3], case[4])
    size = abs(case[0] * float(x)) + abs(case[1] * float(z))
    assert found == pytest.approx(float(expected), abs=2e-14 * size)


def test_elastic_energy() -> None:
    assert elastic_energy(5.05, 5.0, 100.0, 10e3) == pytest.approx(0.5 * 100.0 * 0.05)
    assert elastic_energy(4.0, 5.0, 0.0, 10e3) == 0.0


MODELS = [sl.Elastic(), sl.Parabolic(), sl.Empirical(), sl.Catenary()]
ENDS = [(4.0, 3.0, 4.97), (6.0, -2.0, 6.31), (5.0, 0.2, 4.99)]


def force(model: sl.CableModel, span: float, rise: float, length: float) -> Array:
    state = model.from_length(sl.Cable(0.067, 44e3), span, rise, length)
    return np.array([state.horizontal_tension, state.vertical_force], dtype=np.float64)


@pytest.mark.parametrize("model", MODELS, ids=lambda m: type(m).__name__)
@pytest.mark.parametrize("end", ENDS)
def test_stiffness_of_every_model_is_the_slope_of_its_forces(
    model: sl.CableModel, end: tuple[float, float, float]
) -> None:
    span, rise, length = end
    h = 1e-5
    by_x = (force(model, span + h, rise, length) - force(model, span - h, rise, length)) / (2 * h)
    by_z = (force(model, span, rise + h, length) - force(model, span, rise - h, length)) / (2 * h)
    state = model.from_length(sl.Cable(0.067, 44e3), span, rise, length)
    found = cable_stiffness(
        Model(*model.terms(9.81)),
        span,
        rise,
        Material(0.067, 44e3),
        length,
        Force(float(state.horizontal_tension), float(state.vertical_force), float(state.chord_tension)),
    )
    expected = np.array([by_x[0], by_z[0], by_x[1], by_z[1]])
    np.testing.assert_allclose(found, expected, rtol=1e-6, atol=1e-7 * np.abs(expected).max())


def test_a_slack_elastic_cable_has_no_stiffness() -> None:
    slack = Force(0.0, 0.0, 0.0)
    assert cable_stiffness(Model(*sl.Elastic().terms(9.81)), 3.0, 1.0, Material(0.1, 1e4), 5.0, slack) == (0, 0, 0, 0)
