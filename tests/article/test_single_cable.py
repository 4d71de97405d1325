import numpy as np
import pytest

from sagline import Cable, InvalidValueError
from sagline.article.feasible_sets import FeasibleSets
from sagline.article.regressions import (
    SagStudy,
    Sampling,
    article_sampling,
    constants,
    fit_factor,
    fit_line,
    intercept_studies,
    published_range,
    published_sampling,
    stretch_study,
)
from tests.article.hanging import GRAVITY, end_of, length_and_force
from tests.refusal import refused
from tests.tiers import extended

CABLE = Cable.from_material(0.067, 2e9, 22e-6)
END = 7.0, 6.0


def test_lines_and_factors_agree_with_numpy() -> None:
    random = np.random.default_rng(1)
    x, y = random.normal(size=40), random.normal(size=(3, 40))
    slopes, intercepts = fit_line(x, y)
    for k in range(3):
        slope, intercept = np.polyfit(x, y[k], 1)
        assert slopes[k] == pytest.approx(slope, rel=1e-10)
        assert intercepts[k] == pytest.approx(intercept, rel=1e-10)
        assert fit_factor(x, y[k]) == pytest.approx(np.linalg.lstsq(x[:, None], y[k])[0][0], rel=1e-10)


def test_every_tension_on_the_outline_of_psi_misses_by_the_tolerance() -> None:
    study = FeasibleSets(CABLE, END, 0.01, np.linspace(10.0, 100.0, 5), np.array([15.0, 40.0]), points=16)
    for length, outline in zip(study.psi_lengths, study.psi, strict=True):
        for horizontal, vertical in outline:
            x, z = end_of(horizontal, vertical, length, 0.067 * GRAVITY, 44e3)
            assert abs(x - END[0]) + abs(z - END[1]) == pytest.approx(0.01, rel=1e-6)


def test_psi_shrinks_to_a_point_and_the_curve_runs_through_it() -> None:
    wide, narrow = (FeasibleSets(CABLE, END, e, np.array([80.0, 90.0]), np.array([80.0])) for e in (1e-3, 1e-5))
    assert np.ptp(wide.psi[0, :, 0]) / np.ptp(narrow.psi[0, :, 0]) == pytest.approx(100.0, rel=1e-3)
    assert narrow.psi[0, :, 0].mean() == pytest.approx(80.0, abs=0.02)
    assert narrow.psi[0, :, 1].mean() == pytest.approx(narrow.vertical[0], abs=0.02)


def test_the_projected_curve_is_nearly_the_line_pi() -> None:
    study = FeasibleSets(CABLE, END, 1e-3, np.linspace(50.0, 500.0, 40), np.array([80.0]))
    slope, intercept = study.line
    assert slope == pytest.approx(study.tangent, rel=1e-3)
    assert intercept == pytest.approx(study.half_weight, rel=0.02)
    assert np.abs(study.vertical - slope * study.tensions - intercept).max() < 0.02
    with refused("points", "10", "a multiple of 4", kind=InvalidValueError):
        FeasibleSets(CABLE, END, 1e-3, np.array([50.0, 60.0]), np.array([80.0]), points=10)


@pytest.fixture(scope="module")
def small() -> Sampling:
    return Sampling(
        np.array([0.3, 0.9]), np.array([3.0, 8.0, 14.0]), np.array([0.5, 1.5]), np.linspace(120.0, 900.0, 20)
    )


def test_both_studies_repeat_the_articles_regressions_on_textbook_catenaries(small: Sampling) -> None:
    angle, chord, density, tension = np.meshgrid(
        small.angles, small.chords, small.densities, small.tensions, indexing="ij"
    )
    length, vertical = length_and_force(chord * np.cos(angle), chord * np.sin(angle), density, tension)
    platform, frame = intercept_studies(small)
    for study, force in ((platform, vertical), (frame, vertical - density * GRAVITY * length)):
        for index in np.ndindex(2, 3, 2):
            _, intercept = np.polyfit(small.tensions, force[index], 1)
            assert study.intercept[index] == pytest.approx(intercept, rel=1e-6)
        h_b = np.linalg.lstsq(small.chords[:, None], study.intercept[1, :, 0])[0][0]
        assert study.h_b[1, 0] == pytest.approx(h_b, rel=1e-9)
    sag = SagStudy(small)
    np.testing.assert_allclose(sag.adjusting_length, length - chord, rtol=1e-7)
    a_d = np.linalg.lstsq(small.tensions[:, None] ** -2.0, (length - chord)[1, 2, 0])[0][0]
    assert sag.a_d[1, 2, 0] == pytest.approx(a_d, rel=1e-7)
    q_a = np.linalg.lstsq(small.chords[:, None] ** 3, sag.a_d[1, :, 0])[0][0]
    assert sag.q_a[1, 0] == pytest.approx(q_a, rel=1e-9)
    assert sag.p_q[0] == pytest.approx(
        np.linalg.lstsq(np.cos(small.angles)[:, None] ** 4, sag.q_a[:, 0])[0][0], rel=1e-9
    )
    assert sag.k_p == pytest.approx(np.linalg.lstsq(small.densities[:, None] ** 2, sag.p_q)[0][0], rel=1e-9)


def test_the_published_constants_come_from_tensions_of_97_n_to_12_900_n() -> None:
    found = published_range(article_sampling())
    assert found.k_h_frame == pytest.approx(-4.845, abs=1e-6)
    assert found.k_p == pytest.approx(4.385, abs=1e-6)
    assert found.lowest == pytest.approx(96.7, abs=0.1)
    assert found.highest == pytest.approx(12_900.0, abs=5.0)
    assert found.k_h_platform == pytest.approx(5.0234, abs=1e-4)


@extended
def test_the_constants_depend_on_the_tensions_and_tend_to_their_limits() -> None:
    sampling = published_sampling()
    assert constants(sampling.between(40.0, 12_900.0)).k_p == pytest.approx(6.62, abs=0.01)
    assert constants(sampling.between(60.0, 12_900.0)).k_p == pytest.approx(5.04, abs=0.01)
    published, four, taut = (constants(sampling.between(f * 96.7, f * 12_900.0)) for f in (1.0, 4.0, 64.0))
    assert taut.k_h_platform == pytest.approx(4.905, rel=1e-3)
    assert -taut.k_h_frame == pytest.approx(4.905, rel=1e-3)
    assert taut.k_p == pytest.approx(9.81**2 / 24.0, rel=1e-4)
    assert published.k_p > four.k_p > taut.k_p


def test_the_sag_of_a_taut_cable_is_proportional_to_the_fourth_power_of_the_cosine() -> None:
    """d = D (w D cos(phi))^2/(24 tau^2) with tau = T_x/cos(phi), the limit of the textbook catenary."""
    taut = published_sampling().between(10_000.0, 100_000.0)
    study = SagStudy(taut)
    limit = (GRAVITY * taut.densities) ** 2 / 24.0 * np.cos(taut.angles[:, None]) ** 4
    cubes = limit[:, None] * taut.chords[:, None] ** 3
    # rounding of a difference of lengths, and the next term of the series
    np.testing.assert_allclose(study.q_a, limit, rtol=1e-3)
    np.testing.assert_allclose(study.fitted_q_a, limit, rtol=1e-3)
    np.testing.assert_allclose(study.fitted_a_d, cubes, rtol=1e-3)
    np.testing.assert_allclose(study.fitted_length[..., 0], cubes / 10_000.0**2, rtol=1e-3)


def test_no_range_gives_the_published_constants_for_light_cables() -> None:
    with refused("the sampled cables", kind=InvalidValueError):
        published_range(Sampling(np.array([0.754]), np.array([2.0]), np.array([0.01]), np.linspace(100.0, 1e3, 10)))


def test_the_stretch_is_that_of_the_mean_tension() -> None:
    stiff, soft, printed, right = stretch_study(CABLE, END, np.linspace(200.0, 500.0, 4))
    excess = 0.067 * GRAVITY * np.hypot(*END) ** 2 * (END[1] / np.hypot(*END)) / (2.0 * 44e3)
    np.testing.assert_allclose(printed - right, excess, rtol=0.03)
    np.testing.assert_allclose(right, stiff.adjusting_length, atol=5e-6)
    assert (np.diff(stiff.adjusting_length) < 0.0).all()
    assert soft.adjusting_length[-1] < -0.1
