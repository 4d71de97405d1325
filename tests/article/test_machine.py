"""The prototype with parameter errors, and explanations of measured positions by these errors; without pulleys."""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import pytest

import sagline as sl
from sagline.article.explanations import (
    ANCHORS,
    DENSITY,
    DRUM,
    HEIGHT,
    LOAD,
    MODULUS,
    PARAMETERS,
    PULLEY,
    WIDTH,
    ZERO,
    Errors,
    Explanation,
    corrected_aic,
    explanations,
    rest_positions,
    robot_with_errors,
    wound_lengths,
)
from sagline.article.ten_poses import HOME, METHOD, Table2, tour
from sagline.core.arrays import Array
from tests.refusal import refused

ROBOT = sl.load_robot("article-prototype")
BY_NAME = {parameter.name: parameter for parameter in PARAMETERS}


class Planned(NamedTuple):
    """Plans of the ten poses and of the home pose."""

    plan: sl.Plan
    home: sl.Plan

    def error(self, errors: Sequence[Errors]) -> Array:
        """Actual minus desired positions [m]."""
        return rest_positions(ROBOT, self.plan, self.home, errors) - Table2().desired


@pytest.fixture(scope="module")
def study() -> Planned:
    plan, home = (
        sl.inverse(ROBOT, sl.Pose.from_euler(positions, 0.0, 0.0, 0.0), sl.Empirical(), METHOD)
        for positions in (Table2().desired, np.array([HOME]))
    )
    return Planned(plan, home)


def test_table_2_has_distances_for_errors() -> None:
    table = Table2()
    assert table.points == tuple(f"P{k}" for k in range(1, 11))
    assert table.desired[1] == pytest.approx([-0.13, 1.42, 0.68])
    assert table.actual[8] == pytest.approx([0.45, -1.734, 1.727])
    np.testing.assert_allclose(table.distance, table.printed_error, atol=5.1e-8)


def test_a_machine_with_errors_is_another_robot() -> None:
    errors = {p.name: p.typical for p in PARAMETERS}
    robot = robot_with_errors(ROBOT, errors)
    assert robot.winches is not None
    assert ROBOT.winches is not None
    np.testing.assert_allclose(robot.cables.axial_stiffness, 1.2 * 14000.0, rtol=1e-12)  # Table 1: 3.5 GPa, 4 mm²
    np.testing.assert_allclose(robot.cables.linear_density, 1.2 * 0.09, rtol=1e-12)
    assert robot.mass == pytest.approx(48.0)
    np.testing.assert_allclose(robot.frame_anchors - ROBOT.frame_anchors, [[0.0, 0.0, 0.02]] * 8, atol=1e-15)
    np.testing.assert_allclose(np.abs(robot.platform_anchors), [[0.16, 0.16, 0.26]] * 8, atol=1e-15)
    np.testing.assert_array_equal(robot.winches.pulley_radius, np.full(8, 0.03))
    np.testing.assert_array_equal(robot.winches.dead_cable, np.full(8, 0.2))
    assert robot.winches.drum_radius is not None
    np.testing.assert_array_equal(robot.winches.drum_radius, ROBOT.winches.drum_radius)
    bare = robot_with_errors(ROBOT.replace(winches=None), {PULLEY: 40.0})
    assert bare.winches is not None
    np.testing.assert_array_equal(bare.winches.pulley_radius, np.full(8, 0.04))


def test_wound_lengths_are_counted_from_the_home_pose(study: Planned) -> None:
    planned, home = study.plan.unstrained_length, study.home.unstrained_length
    np.testing.assert_array_equal(wound_lengths(study.plan, study.home, {}), planned)
    lengths = wound_lengths(study.plan, study.home, {DRUM: 2.0, ZERO: -5.0})
    np.testing.assert_allclose(lengths - home, 1.02 * (planned - home) - 0.005, atol=1e-12)


@pytest.mark.parametrize(
    ("name", "slope"),
    [
        (MODULUS, 18.2),
        (DENSITY, -0.32),
        (LOAD, 4.21),
        (ANCHORS, 0.21),
        (DRUM, -9.89),
        (ZERO, 7.75),
        (WIDTH, 0.81),
        (HEIGHT, 0.94),
    ],
)
def test_slope_of_the_vertical_error_over_the_height(study: Planned, name: str, slope: float) -> None:
    """Change of the vertical error [mm per m of height] due to a typical error of one parameter."""
    (error,) = study.error([{name: BY_NAME[name].typical}])
    assert np.polyfit(Table2().desired[:, 2], 1e3 * error[:, 2], 1)[0] == pytest.approx(slope, rel=0.02)


def test_a_wrong_drum_changes_nothing_at_home(study: Planned) -> None:
    right, wrong = rest_positions(ROBOT, study.home, study.home, [{}, {DRUM: 2.0}])
    np.testing.assert_allclose(wrong, right, atol=1e-9)


def test_errors_of_the_machine_are_estimated(study: Planned) -> None:
    for made in ({ZERO: -12.0, LOAD: 2.0}, {ANCHORS: 30.0, DRUM: 1.5, WIDTH: -8.0}):
        model = tuple(BY_NAME[name] for name in made)
        (found,) = explanations(study.error, study.error([made])[0], [model])
        assert found.values == pytest.approx(list(made.values()), rel=1e-4)
        assert found.left_out < 1e-6


def linear(slopes: Array, measured: Array) -> Explanation:
    """Estimates of anchor height and zero from positions that depend on them linearly [m/mm]."""

    def error_of(errors: Sequence[Errors]) -> Array:
        return np.array([slopes @ [one.get(ANCHORS, 0.0), one.get(ZERO, 0.0)] for one in errors]).reshape(-1, 10, 3)

    return explanations(error_of, measured.reshape(10, 3), [(BY_NAME[ANCHORS], BY_NAME[ZERO])])[0]


def test_estimates_from_linear_positions_agree_with_least_squares() -> None:
    random = np.random.default_rng(2)
    slopes, scatter = 1e-3 * random.normal(size=(30, 2)), 1e-3 * random.normal(size=30)
    measured = slopes @ [4.0, -3.0] + scatter
    found = linear(slopes, measured)
    values, squares, _, _ = np.linalg.lstsq(slopes, measured)
    assert found.values == pytest.approx(values, rel=1e-9)
    deviation = np.sqrt(squares[0] / 28.0 * np.diag(np.linalg.inv(slopes.T @ slopes)))
    assert found.deviation == pytest.approx(deviation, rel=1e-9)
    assert found.rms == pytest.approx(np.sqrt(squares[0] / 30.0), rel=1e-9)
    left = measured - slopes @ values
    assert found.worst == pytest.approx(np.linalg.norm(left.reshape(10, 3), axis=1).max(), rel=1e-9)
    assert found.aicc == pytest.approx(30.0 * np.log(1e6 * squares[0] / 30.0) + 6.0 + 24.0 / 26.0, rel=1e-9)
    assert not found.at_limit.any()
    predicted = []
    for pose in range(10):
        others = np.arange(30) // 3 != pose
        fit = np.linalg.lstsq(slopes[others], measured[others])[0]
        predicted.append((measured - slopes @ fit)[~others])
    assert found.left_out == pytest.approx(np.sqrt(np.mean(np.square(predicted))), rel=1e-9)


def test_estimates_stay_within_plausible_limits() -> None:
    slopes = 1e-3 * np.random.default_rng(2).normal(size=(30, 2))
    highest = BY_NAME[ANCHORS].plausible
    found = linear(slopes, slopes @ [2.0 * highest, 3.0])
    assert found.values[0] == pytest.approx(highest, rel=1e-9)
    assert found.at_limit.tolist() == [True, False]
    assert np.isnan(found.deviation).tolist() == [True, False]


def test_a_fit_that_does_not_converge_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sagline.article.explanations.ITERATIONS", 1)
    pulley = BY_NAME[PULLEY]
    with refused("the fit of pulley radius", "still moving after 1 steps", kind=sl.InvalidValueError):
        explanations(
            lambda errors: np.array([np.full((10, 3), 1e-5 * one.get(PULLEY, 0.0) ** 2) for one in errors]),
            np.full((10, 3), 4e-3),
            [(pulley,)],
        )


def test_information_counts_parameters_and_scatter() -> None:
    assert corrected_aic(1e-3, 30, 0) == pytest.approx(2.0 + 4.0 / 28.0)  # ln 1 = 0, with one unknown: the scatter
    assert corrected_aic(math.e * 1e-3, 30, 2) == pytest.approx(60.0 + 6.0 + 24.0 / 26.0)


def test_the_path_stops_at_the_ten_poses() -> None:
    plan, stops = tour()
    path = plan.path
    assert path is not None
    for stop, desired in zip(stops, Table2().desired, strict=True):
        k = int(np.argmin(np.abs(path.time - stop)))
        assert path.pose.position[k] == pytest.approx(desired, abs=1e-3)
    assert plan.feasible.all()


def test_a_machine_without_equilibrium_is_an_error(study: Planned) -> None:
    with refused("the changed robot", kind=sl.InvalidValueError):
        rest_positions(ROBOT, study.plan, study.home, [{}, {ZERO: -1500.0}])
