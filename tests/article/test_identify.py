import numpy as np
import pytest
import scipy.stats

import sagline as sl
from tests.article.hanging import end_of
from tests.refusal import refused
from tests.tiers import extended

CABLE = sl.Cable.from_material(0.067, 2e9, 22e-6)
SPANS, RISES, TENSIONS = np.linspace(2.0, 12.0, 6), np.linspace(-4.0, 3.0, 5), np.linspace(20.0, 400.0, 39)


@pytest.fixture(scope="module")
def fit() -> sl.EmpiricalFit:
    return sl.identify_empirical(CABLE, SPANS, RISES, TENSIONS)


def test_the_constants_agree_with_least_squares(fit: sl.EmpiricalFit) -> None:
    span, rise, tension = np.meshgrid(SPANS, RISES, TENSIONS, indexing="ij")
    exact = sl.Catenary().from_tension(CABLE, span, rise, tension * np.hypot(span, rise) / span)

    def squares(k_h: float, k_p: float) -> tuple[float, float]:
        found = sl.Empirical(k_h, k_p).from_tension(CABLE, span, rise, exact.chord_tension)
        force = found.vertical_force - exact.vertical_force
        return float(np.sum(force**2)), float(np.sum((found.unstrained_length - exact.unstrained_length) ** 2))

    k_h, k_p = fit.k_h.value, fit.k_p.value
    best = squares(k_h, k_p)
    for step in (-0.01, 0.01):
        assert squares(k_h + step, k_p)[0] > best[0]
        assert squares(k_h, k_p + step)[1] > best[1]
    assert np.sum(fit.force_residual**2) == pytest.approx(best[0], rel=1e-12)
    assert np.sum(fit.length_residual**2) == pytest.approx(best[1], rel=1e-12)
    assert fit.k_h.low < k_h < fit.k_h.high
    assert fit.k_p.low < k_p < fit.k_p.high
    assert (fit.model.k_h, fit.model.k_p) == (k_h, k_p)
    assert k_h == pytest.approx(4.878, abs=0.01)
    assert k_p == pytest.approx(4.01, abs=0.03)


def test_the_interval_holds_the_intercept_with_95_percent(fit: sl.EmpiricalFit) -> None:
    """By least squares of NumPy and the interval of Student's distribution."""
    span, rise, tension = np.meshgrid(SPANS, RISES, TENSIONS, indexing="ij")
    chord = np.hypot(span, rise)
    exact = sl.Catenary().from_tension(CABLE, span, rise, tension * chord / span)
    shape, value = (0.067 * chord).ravel(), (exact.vertical_force - tension * rise / span).ravel()
    factor, rest, _, _ = np.linalg.lstsq(shape[:, None], value)
    error = np.sqrt(rest[0] / (value.size - 1) / (shape @ shape))
    low, high = scipy.stats.t.interval(0.95, value.size - 1, loc=factor[0], scale=error)
    assert tuple(fit.k_h) == pytest.approx((factor[0], low, high), rel=1e-9)


def test_the_position_error_is_that_of_the_articles_own_equations(fit: sl.EmpiricalFit) -> None:
    for index in ((0, 0, 0), (3, 2, 5), (5, 4, 0)):
        span, rise, tension = SPANS[index[0]], RISES[index[1]], TENSIONS[index[2]]
        state = fit.model.from_tension(CABLE, span, rise, tension * np.hypot(span, rise) / span)
        x, z = end_of(tension, float(state.vertical_force), float(state.unstrained_length), 0.067 * 9.81, 44e3)
        assert fit.position_error[index] == pytest.approx(abs(x - span) + abs(z - rise), abs=1e-9)


@pytest.mark.parametrize("tolerance", [2e-3, 5e-3, 1e-2])
def test_the_validity_limits_keep_the_error(fit: sl.EmpiricalFit, tolerance: float) -> None:
    lowest, heaviest = fit.tension_min(tolerance), fit.weight_max(tolerance)
    assert fit.position_error[..., lowest <= TENSIONS].max() <= tolerance
    assert fit.position_error[..., lowest - 10.1 <= TENSIONS].max() > tolerance
    light = fit.cable_weight <= heaviest
    assert fit.position_error[light].max() <= tolerance
    heavier = fit.cable_weight[~light].min()
    assert fit.position_error[fit.cable_weight <= heavier].max() > tolerance
    assert fit.weight_max(tolerance, lowest) == fit.cable_weight[..., lowest <= TENSIONS].max()


def test_a_tolerance_out_of_reach_has_no_limit(fit: sl.EmpiricalFit) -> None:
    assert np.isnan(fit.tension_min(1e-9))
    assert np.isnan(fit.weight_max(1e-9))


def test_a_weightless_cable_has_no_empirical_model() -> None:
    with refused("cable", allowed="one cable, > 0 kg/m", kind=sl.InvalidValueError):
        sl.identify_empirical(sl.Cable(0.0, 1e4), SPANS, RISES, TENSIONS)


def measured(
    lowest: float, highest: float, scatter: float = 1.0, seed: int = 5, count: int = 40
) -> tuple[tuple[np.ndarray, ...], sl.CableState]:
    random = np.random.default_rng(seed)
    span, rise = random.uniform(2.0, 12.0, count), random.uniform(-4.0, 2.0, count)
    state = sl.Catenary().from_tension(CABLE, span, rise, random.uniform(lowest, highest, count))
    length = state.unstrained_length + scatter * random.normal(0.0, 1e-3, count)
    return (span, rise, length, state.frame_end_tension + scatter * random.normal(0.0, 1.0, count)), state


def test_exact_measurements_give_the_true_cable() -> None:
    data, state = measured(20.0, 600.0, scatter=0.0)
    for place, tension in (
        ("frame_end", state.frame_end_tension),
        ("platform_end", state.platform_end_tension),
        ("chord", state.chord_tension),
    ):
        fit = sl.identify_cable(data[0], data[1], data[2], tension, tension_at=place)  # type: ignore[arg-type]
        assert fit.values == pytest.approx([0.067, 44e3], rel=1e-6)
        assert fit.warnings == ()
    shifted = sl.identify_cable(
        data[0], data[1], data[2] + 0.02, data[3], unknowns=("linear_density", "axial_stiffness", "length_offset")
    )
    assert shifted.values == pytest.approx([0.067, 44e3, 0.02], rel=1e-5)


@extended
def test_standard_errors_are_the_scatter_of_repeated_measurements() -> None:
    fits = [sl.identify_cable(*measured(20.0, 600.0, seed=k)[0]) for k in range(40)]
    values, errors = np.array([f.values for f in fits]), np.array([f.standard_error for f in fits])
    np.testing.assert_allclose(values.std(axis=0), errors.mean(axis=0), rtol=0.35)
    away = (values.mean(axis=0) - [0.067, 44e3]) / (errors.mean(axis=0) / np.sqrt(40.0))
    assert np.abs(away).max() < 3.5
    assert np.mean([f.chi_squared for f in fits]) == pytest.approx(1.0, abs=0.15)


def test_taut_cables_do_not_determine_their_weight_and_slack_ones_do() -> None:
    taut, loose = (sl.identify_cable(*measured(*limits)[0]) for limits in ((800.0, 1000.0), (15.0, 40.0)))
    assert [w.split()[0] for w in taut.warnings] == ["linear_density"]
    assert "lower tensions" in taut.warnings[0]
    assert loose.standard_error[0] < 0.1 * taut.standard_error[0]
    assert loose.standard_error[1] > 5.0 * taut.standard_error[1]


def test_stiffness_and_length_zero_are_unidentifiable_at_one_tension() -> None:
    span, tension = np.full(8, 8.0), np.linspace(300.0, 303.0, 8)
    state = sl.Catenary().from_tension(CABLE, span, 0.0, tension)
    fit = sl.identify_cable(
        span,
        np.zeros(8),
        state.unstrained_length,
        tension,
        tension_at="chord",
        unknowns=("axial_stiffness", "length_offset"),
        start=sl.Cable(0.067, 4e4),
    )
    assert abs(fit.correlation[0, 1]) > 0.99
    assert any(all(name in warning for name in fit.names) for warning in fit.warnings)


def test_bad_measurements_are_refused() -> None:
    data, _ = measured(20.0, 600.0)
    shapes = "four arrays of equal length, at least 2"
    with refused("the measurements", "of shapes [(1,)]", shapes, kind=sl.InvalidValueError):
        sl.identify_cable(*(values[:1] for values in data))
    with refused("the measurements", "of shapes [(5,), (40,)]", shapes, kind=sl.InvalidValueError):
        sl.identify_cable(data[0][:5], *data[1:])
    with refused("unknowns", "'mass'", kind=sl.InvalidValueError):
        sl.identify_cable(*data, unknowns=("mass",))
    with refused("tension_at", "'winch'", kind=sl.InvalidValueError):
        sl.identify_cable(*data, tension_at="winch")  # type: ignore[arg-type]
