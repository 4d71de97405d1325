from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

import sagline as sl
from sagline.article.models import MODELS, model_errors, sufficient_models
from sagline.article.simulation import ERROR_BAND, PathStudy, figures, low_tension_study, path_study
from tests.article.hanging import length_and_force


@pytest.fixture(scope="module")
def study() -> PathStudy:
    return path_study(sl.article_path(20.0))


def test_tensions_of_the_mixed_robot_are_about_twice_as_high(study: PathStudy) -> None:
    suspended, mixed = (figures(run) for run in study[sl.Empirical])
    assert mixed.tension_max / suspended.tension_max == pytest.approx(2.0755, abs=0.002)


@pytest.mark.parametrize(
    ("kind", "suspended", "mixed"),
    [
        (sl.Straight, 77.6, 303.8),
        (sl.Elastic, 9.94, 26.1),
        (sl.Empirical, 1.711, 1.131),
        (sl.Parabolic, 0.0363, 0.0353),
    ],
)
def test_each_models_position_error_in_millimeters(
    study: PathStudy, kind: type[sl.CableModel], suspended: float, mixed: float
) -> None:
    for run, expected in zip(study[kind], (suspended, mixed), strict=True):
        found = figures(run)
        assert 1e3 * found.error_max == pytest.approx(expected, rel=0.01)
        assert found.held == 1.0
        assert found.error_mean < found.error_max


def test_the_exact_model_has_no_error(study: PathStudy) -> None:
    assert max(figures(run).error_max for run in study[sl.Catenary]) < 1e-11


def test_the_empirical_model_stays_within_the_articles_band(study: PathStudy) -> None:
    for run in study[sl.Empirical]:
        found = figures(run)
        assert found.axis_error_max < ERROR_BAND / 4.0
        assert found.axis_error_max == np.abs(run.position_error).max()


def test_tensions_are_continuous_with_corners_that_do_not_grow() -> None:
    coarse, fine = (path_study(sl.article_path(rate), [sl.Empirical()]) for rate in (25.0, 100.0))
    for slow, fast in zip(coarse[sl.Empirical], fine[sl.Empirical], strict=True):
        assert figures(fast).step_max < 0.3 * figures(slow).step_max
        assert figures(fast).slope_jump < figures(slow).slope_jump * 1.05


def test_steps_slopes_and_corners_by_hand(study: PathStudy) -> None:
    time = sl.article_path(20.0).time
    for run in study[sl.Empirical]:
        tension = run.plan.horizontal_tension
        steps, slopes, corners = [], [], []
        for i in range(tension.shape[1]):
            slope = [(tension[k + 1, i] - tension[k, i]) / (time[k + 1] - time[k]) for k in range(len(time) - 1)]
            steps.append(max(abs(tension[k + 1, i] - tension[k, i]) for k in range(len(time) - 1)))
            slopes.append(max(map(abs, slope)))
            corners.append(max(abs(after - before) for before, after in pairwise(slope)))
        found = figures(run)
        assert found.step_max == pytest.approx(max(steps), rel=1e-12)
        assert found.slope_max == pytest.approx(max(slopes), rel=1e-12)
        assert found.slope_jump == pytest.approx(max(corners), rel=1e-12)
        mirrored = replace(run, plan=_reversed_signs(run.plan))
        assert figures(mirrored).slope_jump == pytest.approx(max(corners), rel=1e-12)


def _reversed_signs(plan: sl.Plan) -> sl.Plan:
    """The same plan with reversed signs of tension changes: the largest sizes stay the same."""
    cables = replace(plan.state.cables, horizontal_tension=-plan.horizontal_tension)
    return replace(plan, state=replace(plan.state, cables=cables))


def test_slack_cables_reduce_the_accuracy_and_bound_54_limits_it() -> None:
    (suspended, mixed), (_, mixed_bound) = low_tension_study(np.array([10.0, 25.0]), rate=5.0)
    assert mixed[0] > 0.1
    assert mixed[1] == pytest.approx(1.1e-3, rel=0.05)
    assert suspended[0] == suspended[1]  # no cable approaches its limit
    assert mixed_bound.axis_error_max < 2e-3
    assert mixed_bound.tension_min == pytest.approx(14.2, abs=0.3)


def test_model_errors_are_differences_from_the_exact_cable() -> None:
    axes = [5.0, 12.0], [-0.7, 0.2], [0.1, 0.8], [60.0, 400.0]
    length_error, force_error = model_errors(1e15, *axes)
    chord, angle, density, tension = np.meshgrid(*axes, indexing="ij")
    span, rise = chord * np.cos(angle), chord * np.sin(angle)
    length, vertical = length_and_force(span, rise, density, tension * np.cos(angle))
    names = [type(model).__name__ for model in MODELS]
    assert names == ["Straight", "Elastic", "Empirical", "Parabolic", "Catenary"]
    weight = density * 9.81
    sag = chord * (weight * chord * np.cos(angle)) ** 2 / (24.0 * tension**2)
    np.testing.assert_allclose(length_error[0], chord - length, rtol=1e-6, atol=1e-9)
    np.testing.assert_allclose(length_error[3], chord + sag - length, rtol=1e-5, atol=1e-9)
    pull = vertical - tension * np.sin(angle)
    np.testing.assert_allclose(force_error[2], 4.845 * density * chord - pull, rtol=1e-6, atol=1e-7)
    np.testing.assert_allclose(force_error[0], -pull, rtol=1e-7)
    assert np.abs(length_error[4]).max() == 0.0


def test_the_coarsest_sufficient_model_is_the_first_within_the_tolerance() -> None:
    length_error, _ = model_errors(44e3, [10.0], [-0.5], [0.067], np.geomspace(5.0, 2000.0, 30))
    for k, found in enumerate(sufficient_models(length_error, 1e-3)[0, 0, 0]):
        errors = np.abs(length_error[:, 0, 0, 0, k])
        assert errors[found] <= 1e-3
        assert (errors[:found] > 1e-3).all()
