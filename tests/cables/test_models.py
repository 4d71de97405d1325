"""The five cable models compared with independent programs and with each other."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from sagline import (
    Cable,
    CableGeometryError,
    CableModel,
    CableState,
    CableStatus,
    Catenary,
    Elastic,
    Empirical,
    InvalidValueError,
    Parabolic,
    Straight,
)
from tests.refusal import refused

CABLE = Cable(linear_density=0.067, axial_stiffness=44e3)  # simulation of the article
WEIGHTED = [Empirical(), Parabolic(), Catenary()]
TENSIONED = [Elastic(), *WEIGHTED]

spans = st.floats(0.05, 30.0)
rises = st.floats(-20.0, 20.0)
densities = st.floats(1e-6, 2.0)
stiffnesses = st.floats(5e3, 1e8)
# chord tension as a multiple of half the weight of the cable, from very slack to very taut
tautness = st.floats(0.15, 1e4)


def catenary_case(span: float, rise: float, density: float, stiffness: float, ratio: float) -> tuple[Cable, CableState]:
    cable = Cable(density, stiffness)
    tension = min(ratio * 0.5 * density * 9.81 * math.hypot(span, rise), 0.05 * stiffness)
    return cable, Catenary().from_tension(cable, span, rise, tension)


def test_profile_solves_the_differential_equation_of_a_cable() -> None:
    """dx/ds = (T_x/T)(1 + T/EA), dz/ds = (V/T)(1 + T/EA), dV/ds = w, integrated by another program."""
    cable = Cable(0.5, 2e4)
    weight = 0.5 * 9.81
    for span, rise, tension in [(10.0, 4.0, 30.0), (8.0, -6.0, 12.0), (0.5, 3.0, 40.0), (12.0, 0.0, 900.0)]:
        state = Catenary().from_tension(cable, span, rise, tension)
        length, pull = float(state.unstrained_length), float(state.horizontal_tension)
        bottom = float(state.vertical_force) - weight * length

        def slope(s: float, _: object, pull: float = pull, bottom: float = bottom) -> tuple[float, float]:
            vertical = bottom + weight * s
            tension = math.hypot(pull, vertical)
            stretch = (1.0 + tension / 2e4) / tension
            return pull * stretch, vertical * stretch

        places = np.linspace(0.0, length, 9)
        path = solve_ivp(slope, (0.0, length), (0.0, 0.0), t_eval=places, rtol=1e-11, atol=1e-12).y.T
        np.testing.assert_allclose(Catenary().profile(cable, state, 9), path, atol=2e-8)
        np.testing.assert_allclose(Catenary().profile(cable, state, 2)[1], (span, rise), atol=1e-12)


@given(spans, rises, densities, stiffnesses, tautness)
@settings(deadline=None, max_examples=200, derandomize=True)
def test_length_and_tension_are_inverse(span: float, rise: float, rho: float, ea: float, ratio: float) -> None:
    cable, state = catenary_case(span, rise, rho, ea, ratio)
    back = Catenary().from_length(cable, span, rise, state.unstrained_length)
    # a change of the length by one ulp changes the force by this amount, the conditioning of the problem
    up = Catenary().from_length(cable, span, rise, np.nextafter(state.unstrained_length, np.inf))
    ulp = abs(float(up.chord_tension - back.chord_tension))
    assert abs(float(back.chord_tension - state.chord_tension)) <= 8.0 * ulp + 1e-14 * float(state.chord_tension)
    assert state.closure_residual < 1e-13 * (1.0 + float(state.unstrained_length))


@given(spans, rises, densities, stiffnesses, tautness)
@settings(deadline=None, max_examples=100, derandomize=True)
def test_a_cable_seen_from_its_other_end_is_the_same(
    span: float, rise: float, rho: float, ea: float, ratio: float
) -> None:
    _, state = catenary_case(span, rise, rho, ea, ratio)
    _, mirrored = catenary_case(span, -rise, rho, ea, ratio)
    scale = float(state.frame_end_tension + state.platform_end_tension)
    np.testing.assert_allclose(mirrored.unstrained_length, state.unstrained_length, rtol=2e-15)
    np.testing.assert_allclose(mirrored.frame_end_tension, state.platform_end_tension, atol=1e-14 * scale)
    np.testing.assert_allclose(mirrored.sag, state.sag, atol=1e-13 * float(state.unstrained_length))


@given(spans, rises, densities, stiffnesses, tautness, st.floats(0.1, 20.0))
@settings(deadline=None, max_examples=100, derandomize=True)
def test_length_scales_with_size_and_forces(
    span: float, rise: float, rho: float, ea: float, ratio: float, factor: float
) -> None:
    """Twice the size with twice the forces and stiffness, the same weight per length: twice the length."""
    cable, state = catenary_case(span, rise, rho, ea, ratio)
    larger = Cable(cable.linear_density, factor * cable.axial_stiffness)
    scaled = Catenary().from_tension(larger, factor * span, factor * rise, factor * state.chord_tension)
    np.testing.assert_allclose(scaled.unstrained_length, factor * state.unstrained_length, rtol=1e-14)


@pytest.mark.parametrize("direction", ["from_tension", "from_length"])
def test_a_weightless_catenary_is_the_elastic_cable(direction: str) -> None:
    given_value = 200.0 if direction == "from_tension" else 4.98
    elastic = getattr(Elastic(), direction)(Cable(0.0, 44e3), 3.0, 4.0, given_value)
    for rho, tolerance in [(0.0, 1e-15), (1e-12, 1e-12), (1e-6, 1e-6)]:
        state = getattr(Catenary(), direction)(Cable(rho, 44e3), 3.0, 4.0, given_value)
        np.testing.assert_allclose(state.chord_tension, elastic.chord_tension, rtol=tolerance)
        np.testing.assert_allclose(state.unstrained_length, elastic.unstrained_length, rtol=tolerance)
        np.testing.assert_allclose(state.vertical_force, elastic.vertical_force, rtol=tolerance)


def test_an_inextensible_catenary_has_the_textbook_length() -> None:
    """L^2 = (2a sinh(x/2a))^2 + z^2 with a = T_x/w."""
    cable = Cable(0.3, 1e16)
    span, rise, tension = 10.0, -3.0, 25.0
    state = Catenary().from_tension(cable, span, rise, tension)
    a = float(state.horizontal_tension) / (0.3 * 9.81)
    np.testing.assert_allclose(state.unstrained_length, math.hypot(2 * a * math.sinh(span / (2 * a)), rise), rtol=1e-14)


def test_parabolic_length_converges_in_the_fourth_order_of_the_sag_and_empirical_does_not() -> None:
    tension = np.array([50.0, 100.0, 200.0, 400.0])
    stiff = Cable(0.067, 1e12)
    exact = Catenary().from_tension(stiff, 10.0, 4.0, tension).unstrained_length
    parabolic = Parabolic().from_tension(stiff, 10.0, 4.0, tension).unstrained_length
    empirical = Empirical().from_tension(stiff, 10.0, 4.0, tension).unstrained_length
    orders = np.log2(np.abs(parabolic - exact)[:-1] / np.abs(parabolic - exact)[1:])
    np.testing.assert_allclose(orders, 4.0, atol=0.1)
    # erratum 6: the published constant is larger by 4.385/(g^2/24) - 1 = 9.4 %
    excess = (empirical - exact) / (exact - np.hypot(10.0, 4.0))
    np.testing.assert_allclose(excess[-1], 24 * 4.385 / 9.81**2 - 1, atol=2e-3)


def test_parabolic_sag_force_converges_in_the_first_order_of_slackness() -> None:
    """T_z - tau sin(phi) -> wD/2 for large tau; the error halves if tau doubles, and is zero on a level chord."""
    tension = np.array([200.0, 400.0, 800.0, 1600.0])
    stiff = Cable(0.067, 1e12)
    half_weight = 0.5 * 0.067 * 9.81 * math.hypot(10.0, 4.0)
    exact, shallow = (model.from_tension(stiff, 10.0, 4.0, tension) for model in (Catenary(), Parabolic()))
    np.testing.assert_allclose(shallow.vertical_force - tension * 4.0 / math.hypot(10.0, 4.0), half_weight)
    error = np.abs(exact.vertical_force - shallow.vertical_force)
    np.testing.assert_allclose(np.log2(error[:-1] / error[1:]), 1.0, atol=0.02)
    level = [model.from_tension(stiff, 10.0, 0.0, 50.0) for model in (Catenary(), Parabolic())]
    assert abs(float(level[0].vertical_force / level[1].vertical_force) - 1.0) < 1e-3


def test_empirical_is_the_articles_formula_as_printed() -> None:
    """(21), (27), (28), (48) written out in T_x as in the article."""
    span, rise, horizontal = 6.0, -3.5, 120.0
    rho, ea, k_h, k_p = 0.067, 44e3, 4.845, 4.385
    chord, slope = math.hypot(span, rise), rise / span
    vertical = slope * horizontal + k_h * rho * chord
    cosine = math.cos(math.atan(slope))
    magnitude = math.hypot(horizontal, vertical)
    length = (k_p * ea * rho**2 * cosine**4 * chord**3 + ea * chord * horizontal**2) / (
        horizontal**2 * (ea + magnitude)
    )
    state = Empirical().from_tension(CABLE, span, rise, horizontal / cosine)
    np.testing.assert_allclose(state.unstrained_length, length, rtol=1e-14)
    np.testing.assert_allclose(state.vertical_force, vertical, rtol=1e-14)
    np.testing.assert_allclose(state.horizontal_tension, horizontal, rtol=1e-14)


@pytest.mark.parametrize("model", TENSIONED, ids=lambda model: type(model).__name__)
@pytest.mark.parametrize(("span", "rise"), [(0.0, 4.0), (0.0, -4.0), (5.0, 0.0), (3.0, 4.0), (3.0, -4.0), (1e-9, 2.0)])
def test_every_model_inverts_itself(model: CableModel, span: float, rise: float) -> None:
    tension = np.array([8.0, 50.0, 400.0, 2000.0])
    state = model.from_tension(CABLE, span, rise, tension)
    back = model.from_length(CABLE, span, rise, state.unstrained_length)
    np.testing.assert_allclose(back.chord_tension, tension, rtol=2e-11)
    np.testing.assert_allclose(back.vertical_force, state.vertical_force, rtol=2e-11, atol=1e-10)
    assert np.max(state.closure_residual) < 1e-13
    assert np.max(back.closure_residual) < 1e-13


@pytest.mark.parametrize("model", WEIGHTED, ids=lambda model: type(model).__name__)
def test_sag_is_the_largest_drop_of_the_profile(model: CableModel) -> None:
    for span, rise, tension in [(10.0, 4.0, 30.0), (8.0, -6.0, 12.0), (12.0, 0.0, 900.0), (2.0, 7.0, 4.0)]:
        state = model.from_tension(CABLE, span, rise, tension)
        points = model.profile(CABLE, state, 20001)
        drop = points[:, 0] * rise / span - points[:, 1]
        np.testing.assert_allclose(state.sag, drop.max(), rtol=1e-6, atol=1e-9)


def test_a_slack_vertical_cable_folds_below_its_lower_end() -> None:
    state = Catenary().from_length(CABLE, 0.0, 2.0, 5.0)
    weight = 0.067 * 9.81
    # 3 m too long: two strands share the slack, 1.5 m below the frame end except for their small stretch
    np.testing.assert_allclose(state.sag, 1.5, atol=1e-4)
    np.testing.assert_allclose(state.vertical_force, weight * 3.5, rtol=1e-4)
    assert float(state.chord_tension) == 0.0
    assert CableStatus(int(state.status)) is CableStatus.SLACK


def test_statuses_name_the_error() -> None:
    assert Straight().from_length(CABLE, 3.0, 4.0, 5.2).status == CableStatus.NO_TENSION
    np.testing.assert_allclose(Straight().from_length(CABLE, 3.0, 4.0, 5.2).closure_residual, 0.2)
    assert Elastic().from_length(CABLE, 3.0, 4.0, 5.2).status == CableStatus.SLACK
    assert Elastic().from_length(CABLE, 3.0, 4.0, 5.2).chord_tension == 0.0
    assert Catenary().from_tension(CABLE, 3.0, 4.0, 1e-6).status == CableStatus.TOO_SLACK
    assert math.isnan(float(Catenary().from_tension(CABLE, 3.0, 4.0, 0.0).unstrained_length))
    # (54): valid while the lowest point is outside of the span, w D/(2 |sin phi|) in chord tension
    bound = 4.845 * 0.067 * 5.0 / 0.8
    assert Empirical().from_tension(CABLE, 3.0, 4.0, 1.001 * bound).status == CableStatus.SOLVED
    assert Empirical().from_tension(CABLE, 3.0, 4.0, 0.999 * bound).status == CableStatus.BELOW_VALIDITY


@pytest.mark.parametrize("rise", [4.0, -4.0])
def test_from_length_of_the_empirical_model_reports_its_range(rise: float) -> None:
    """(54) again, for the lengths of the tensions on both sides of the bound."""
    bound = 4.845 * 0.067 * 5.0 / 0.8
    state = Empirical().from_tension(CABLE, 3.0, rise, bound * np.array([0.5, 0.999, 1.001, 2.0]))
    back = Empirical().from_length(CABLE, 3.0, rise, state.unstrained_length)
    below, solved = CableStatus.BELOW_VALIDITY, CableStatus.SOLVED
    assert back.status.tolist() == [below, below, solved, solved]
    np.testing.assert_allclose(back.chord_tension, state.chord_tension, rtol=1e-9)


def test_every_argument_broadcasts() -> None:
    cable = Cable(np.array([0.05, 0.1]), 5e4)
    tension = np.array([[20.0], [50.0], [90.0]])
    state = Catenary().from_tension(cable, 4.0, np.array([1.0, -2.0]), tension)
    assert state.shape == (3, 2)
    single = Catenary().from_tension(Cable(0.1, 5e4), 4.0, -2.0, 50.0)
    assert state.unstrained_length[1, 1] == single.unstrained_length
    assert state.sag[1, 1] == single.sag
    assert state.frame_end_tension[1, 1] == single.frame_end_tension
    np.testing.assert_array_equal(state.points(5)[1, 1], single.points(5))


def test_a_batch_solves_ordinary_and_extreme_cables() -> None:
    """The vectorized path, the path with brackets, and the change between them inside of a chunk."""
    rng = np.random.default_rng(4)
    count = 1000
    span, rise = rng.uniform(0.0, 12.0, count), rng.uniform(-8.0, 8.0, count)
    tension = 10.0 ** rng.uniform(-1.0, 4.0, count)
    state = Catenary().from_tension(CABLE, span, rise, tension)
    odd = 0.5 * 0.067 * 9.81 * np.hypot(span, rise) / tension > 2.0
    assert 20 < odd.sum() < 980
    assert np.max(state.closure_residual / state.unstrained_length) < 2e-14
    for i in (0, 255, 256, 999):
        alone = Catenary().from_tension(CABLE, span[i], rise[i], tension[i])
        np.testing.assert_allclose(state.unstrained_length[i], alone.unstrained_length, rtol=1e-15)


@pytest.mark.parametrize(
    ("change", "error", "parts"),
    [
        ({"span": -1.0}, CableGeometryError, ("span", "-1 m", ">= 0 m, finite")),
        ({"span": 0.0, "rise": 0.0}, CableGeometryError, ("span and rise", "both 0 m")),
        ({"chord_tension": [1.0, math.nan]}, InvalidValueError, ("chord_tension[1]", "nan N")),
        ({"chord_tension": -3.0}, InvalidValueError, ("chord_tension", "-3 N", ">= 0 N, finite")),
        ({"rise": math.inf}, InvalidValueError, ("rise", "inf m", "finite")),
        ({"gravity": -9.81}, InvalidValueError, ("gravity", "-9.81 m/s^2", ">= 0 m/s^2, finite")),
        (
            {"span": [1.0, 2.0], "rise": [1.0, 2.0, 3.0]},
            InvalidValueError,
            ("span, rise, tension or length, and cable", "not of one shape, but (2,) and (3,) and ()"),
        ),
        ({"span": "far"}, CableGeometryError, ("span", "'far'", "numbers")),
    ],
)
def test_bad_arguments_are_named(change: dict[str, object], error: type[Exception], parts: tuple[str, ...]) -> None:
    arguments: dict[str, object] = {"span": 3.0, "rise": 4.0, "chord_tension": 100.0}
    with refused(*parts, kind=error):
        Catenary().from_tension(CABLE, **{**arguments, **change})  # type: ignore[arg-type]


def test_bad_material_is_named() -> None:
    with refused("axial_stiffness", "0 N", "> 0 N, finite", kind=InvalidValueError):
        Cable(0.1, 0.0)
    with refused("linear_density[1]", "-0.1 kg/m", kind=InvalidValueError):
        Cable([0.1, -0.1], 1e4)
    with refused("unstrained_length", "0 m", kind=InvalidValueError):
        Catenary().from_length(CABLE, 3.0, 4.0, 0.0)
    with refused("k_p", "-1 m^2/s^4", kind=InvalidValueError):
        Empirical(k_p=-1.0)


def test_results_are_read_only_copies() -> None:
    span = np.array([3.0, 4.0])
    state = Catenary().from_tension(CABLE, span, 1.0, 50.0)
    span[0] = 99.0
    assert state.span[0] == 3.0
    with pytest.raises(ValueError, match="read-only"):
        state.unstrained_length[0] = 1.0
