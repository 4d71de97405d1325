"""Slopes of the force of a cable with respect to its data, compared with differences of the public models."""

import numpy as np
import pytest

import sagline as sl
from sagline.core.arrays import Array
from sagline.kernels.cable import stiffness
from sagline.kernels.cable.terms import Force, Material, Model
from tests.kernels.compiled import from_python

MODELS = [sl.Elastic(), sl.Parabolic(), sl.Empirical(), sl.Catenary()]
ENDS = [(4.0, 3.0, 4.97), (6.0, -2.0, 6.31), (5.0, 0.2, 4.99), (5.0, 1.0, 7.0)]  # the last one is very slack
DENSITY, AXIAL = 0.067, 44e3
cable_stiffness = from_python(stiffness.cable_stiffness)
force_slopes = from_python(stiffness.force_slopes)
force_by_length = from_python(stiffness.force_by_length)


def central(of: object, at: float, share: float) -> Array:
    """Slope of forces with respect to one datum, extrapolated from two steps."""

    def slope(h: float) -> Array:
        difference: Array = of(at + h) - of(at - h)  # type: ignore[operator]
        return difference / (2.0 * h)

    return (4.0 * slope(0.5 * share * at) - slope(share * at)) / 3.0


@pytest.mark.parametrize("model", MODELS, ids=lambda m: type(m).__name__)
@pytest.mark.parametrize("end", ENDS)
def test_slopes_by_length_density_and_stiffness(model: sl.CableModel, end: tuple[float, float, float]) -> None:
    span, rise, length = end

    def force(length: float = length, density: float = DENSITY, axial: float = AXIAL) -> Array:
        state = model.from_length(sl.Cable(density, axial), span, rise, length)
        return np.array([state.horizontal_tension, state.vertical_force], dtype=np.float64)

    state = model.from_length(sl.Cable(DENSITY, AXIAL), span, rise, length)
    forces = (state.horizontal_tension, state.vertical_force, state.chord_tension)
    given = (Model(*model.terms(9.81)), span, rise, Material(DENSITY, AXIAL), length, Force(*map(float, forces)))
    plane = cable_stiffness(*given)
    found = force_slopes(*given, plane)
    slopes = (found.by_length, found.by_density, found.by_stiffness)
    expected = (
        central(lambda v: force(length=v), length, 1e-5),
        central(lambda v: force(density=v), DENSITY, 1e-3),
        central(lambda v: force(axial=v), AXIAL, 1e-3),
    )
    for slope, right in zip(slopes, expected, strict=True):
        np.testing.assert_allclose(slope, right, rtol=1e-6, atol=1e-7 * np.abs(right).max())
    if isinstance(model, sl.Elastic | sl.Catenary):
        assert force_by_length(*given, plane) == found.by_length
