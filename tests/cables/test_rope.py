"""The catalogue of ropes, computed by hand from its sources."""

import numpy as np
import pytest

from sagline import InvalidValueError
from sagline.cables.cable import ROPES
from tests.refusal import refused


def test_steel_ropes_of_10_mm_by_the_factors_of_en_12385_4() -> None:
    """W d^2 [kg/100 m], K d^2 1770 MPa [kN] and 100 GPa on the metallic section C d^2."""
    for name, mass, force, section in (("steel-6x19", 40.0, 63.0, 0.449), ("steel-7x19", 38.1, 64.1, 0.418)):
        rope = ROPES[name]
        assert 100.0 * rope.cable(0.01).linear_density == pytest.approx(mass, rel=1e-3)
        assert 1e-3 * rope.breaking_force(0.01) == pytest.approx(force, rel=2e-3)
        assert rope.cable(0.01).axial_stiffness == pytest.approx(100e9 * section * 1e-4, rel=1e-12)


@pytest.mark.parametrize(
    ("name", "modulus", "strength"), [("dyneema-sk78", 109e9, 3.3e9), ("dyneema-sk62", 65e9, 2.4e9)]
)
def test_a_braid_is_two_thirds_fiber_at_half_its_modulus(name: str, modulus: float, strength: float) -> None:
    fiber = 2.0 / 3.0 * np.pi * 0.003**2  # of a circle of 6 mm
    cable = ROPES[name].cable(0.006)
    assert cable.linear_density == pytest.approx(975.0 * fiber, rel=1e-12)
    assert cable.axial_stiffness == pytest.approx(0.5 * modulus * fiber, rel=1e-12)
    assert ROPES[name].breaking_force(0.006) == pytest.approx(0.55 * strength * fiber, rel=1e-12)


def test_a_diameter_is_one_positive_number() -> None:
    for wrong in (0.0, -1.0, np.nan):
        with refused("diameter", f"{wrong:g} m", "> 0 m, finite", kind=InvalidValueError):
            ROPES["steel-6x19"].cable(wrong)
