"""The study of Table 2: its machines have pulleys, whose kernels only the second tier compiles."""

from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import least_squares

import sagline as sl
from sagline.article.explanations import (
    ANCHORS,
    DEAD,
    DENSITY,
    DRUM,
    HEIGHT,
    LOAD,
    MODULUS,
    PARAMETERS,
    PULLEY,
    WIDTH,
    ZERO,
    explanations,
    rest_positions,
)
from sagline.article.ten_poses import METHOD, TenPoses
from sagline.core.arrays import Array
from tests.tiers import extended

pytestmark = extended

ROBOT = sl.load_robot("article-prototype")


@pytest.fixture(scope="module")
def study() -> TenPoses:
    return TenPoses()


def left(study: TenPoses, pulley: float, zero: float, dead: float = 0.0) -> Array:
    """Measured minus predicted positions [m] of a robot written out here: R, zero and dead length in meters."""
    robot = ROBOT.replace(winches=sl.Winch(pulley_radius=pulley, dead_cable=dead))
    over, bare = (
        sl.inverse(one, study.home.state.pose, tension=METHOD).unstrained_length
        for one in (robot, ROBOT.replace(winches=None))
    )
    lengths = study.plan.unstrained_length + zero + (over - bare)
    found = sl.forward(robot, lengths, start=study.plan.state.pose)
    assert found.solved.all()
    return study.table.actual - found.pose.position


def test_the_empirical_model_is_not_the_cause(study: TenPoses) -> None:
    assert np.linalg.norm(study.model_error, axis=1).max() == pytest.approx(0.59e-3, abs=0.02e-3)
    assert study.plan.feasible.all()


def test_the_platform_is_too_high_at_low_positions(study: TenPoses) -> None:
    slope, _ = np.polyfit(study.table.desired[:, 2], study.table.error[:, 2], 1)
    assert 1e3 * slope == pytest.approx(-18.17, abs=0.01)
    assert study.height_slope(study.table.error) == pytest.approx(1e3 * slope, rel=1e-12)
    assert (study.table.error[:, 2] > 0.0).all()


@pytest.mark.parametrize(
    ("name", "slope"),
    [
        (MODULUS, 18.2),  # opposite to the measurement
        (DENSITY, -0.32),
        (LOAD, 4.21),
        (ANCHORS, 0.21),
        (DRUM, -9.89),
        (ZERO, 7.75),
        (PULLEY, -17.65),
        (DEAD, -5.06),
        (WIDTH, 0.81),
        (HEIGHT, 0.94),
    ],
)
def test_one_parameter_off_at_a_time(study: TenPoses, name: str, slope: float) -> None:
    assert study.height_slope(study.trends[name]) == pytest.approx(slope, rel=0.02)


def test_raised_anchors_lift_the_platform_equally(study: TenPoses) -> None:
    np.testing.assert_allclose(study.trends[ANCHORS] - study.model_error, [[0.0, 0.0, 0.02]] * 10, atol=1e-7)


def test_errors_after_homing_vanish_at_the_home_pose(study: TenPoses) -> None:
    """A wrong drum, pulley or dead length; the effect of a thin pulley or a short dead length is small everywhere."""
    errors = [{}, {DRUM: 2.0}, {PULLEY: 40.0}, {DEAD: 3.0}, {PULLEY: 40.0, DEAD: 3.0}]
    right, *wrong = rest_positions(ROBOT, study.home, study.home, errors)
    np.testing.assert_allclose(wrong[0], right, atol=1e-9)
    for one in wrong[1:]:  # the plan of the home pose uses the empirical model, with a length error of 0.2 mm
        np.testing.assert_allclose(one, right, atol=3e-5)
    right, *thin = rest_positions(ROBOT, study.plan, study.home, [{}, {PULLEY: 1e-3}, {DEAD: 1e-5}])
    np.testing.assert_allclose(thin, [right] * 2, atol=2e-6)


def test_a_batch_of_machines_agrees_with_single_machines(study: TenPoses) -> None:
    errors = [{p.name: p.typical, PULLEY: 10.0 * k} for k, p in enumerate(PARAMETERS)]
    together = rest_positions(ROBOT, study.plan, study.home, errors)
    for one, some in zip(errors, together, strict=True):
        np.testing.assert_allclose(rest_positions(ROBOT, study.plan, study.home, [one])[0], some, atol=1e-9)


def test_the_best_explanations(study: TenPoses) -> None:
    one, two, three = (study.best(count) for count in (1, 2, 3))
    assert [len(group) for group in study.explanations] == [10, 45, 120]
    assert 1e3 * study.measured_rms == pytest.approx(13.5, abs=0.05)
    assert [p.name for p in one.parameters] == [ANCHORS]
    assert one.values == pytest.approx([17.75], abs=0.05)
    assert 1e3 * one.rms == pytest.approx(9.05, abs=0.02)
    second = study.explanations[1][1]
    assert second.names == {ANCHORS, PULLEY}
    assert second.values == pytest.approx([17.2, 28.5], abs=0.1)
    assert 1e3 * second.rms == pytest.approx(4.22, abs=0.02)
    assert three.names == {ANCHORS, ZERO, PULLEY}
    assert three.values == pytest.approx([-40.5, -23.8, 60.0], abs=0.1)
    assert [p.name for p, limit in zip(three.parameters, three.at_limit, strict=True) if limit] == [PULLEY]
    assert (1e3 * three.rms, 1e3 * three.left_out) == pytest.approx((3.32, 3.81), abs=0.02)
    assert min(study.explanation(name).rms for name in (MODULUS, DENSITY)) > 0.9 * study.measured_rms
    assert two.aicc < min(found.aicc for found in study.explanations[2] if not found.at_limit.any())
    assert all(found.names & {PULLEY, ANCHORS} for found in study.explanations[1] if found.rms < 6e-3)


def test_the_best_two_agree_with_an_independent_fit(study: TenPoses) -> None:
    """Levenberg-Marquardt of MINPACK with the robot written out again: 38(3) mm, −7(1) mm."""
    best = study.best(2)
    assert [p.name for p in best.parameters] == [ZERO, PULLEY]
    fit = least_squares(lambda x: 1e3 * left(study, 1e-3 * x[1], 1e-3 * x[0]).ravel(), [-5.0, 30.0], method="lm")
    np.testing.assert_allclose(best.values, fit.x, atol=0.02)
    scatter = 2.0 * fit.cost / 28.0
    deviation = np.sqrt(np.diag(np.linalg.inv(fit.jac.T @ fit.jac)) * scatter)
    np.testing.assert_allclose(best.deviation, deviation, rtol=0.01)
    assert best.values == pytest.approx([-7.1, 38.0], abs=0.5)
    assert best.deviation == pytest.approx([0.55, 2.7], abs=0.05)
    assert 1e3 * best.rms == pytest.approx(np.sqrt(2.0 * fit.cost / 30.0), rel=1e-4)
    assert 1e3 * best.rms == pytest.approx(3.9, abs=0.05)
    assert 1e3 * best.left_out == pytest.approx(4.5, abs=0.05)


def test_a_pose_left_out_is_predicted_by_fits_to_the_others(study: TenPoses) -> None:
    """Each fit uses nine poses and is nonlinear."""
    best, rest_of = study.best(2), []
    for pose in range(10):
        others = np.arange(10) != pose
        fit = least_squares(
            lambda x, kept=others: 1e3 * left(study, 1e-3 * x[1], 1e-3 * x[0])[kept].ravel(), best.values, method="lm"
        )
        rest_of.append(left(study, 1e-3 * fit.x[1], 1e-3 * fit.x[0])[pose])
    assert best.left_out == pytest.approx(np.sqrt(np.mean(np.square(rest_of))), rel=0.01)


def test_dead_length_modulus_and_load_explain_no_more(study: TenPoses) -> None:
    dead = study.explanation(ZERO, PULLEY, DEAD)
    fit = least_squares(
        lambda x: 1e3 * left(study, 1e-3 * x[1], 1e-3 * x[0], x[2]).ravel(), [-7.0, 38.0, 0.1], method="lm"
    )
    assert dead.values[:2] == pytest.approx(fit.x[:2], abs=0.02)
    assert dead.values[2] == pytest.approx(fit.x[2], abs=0.001)
    assert (dead.values[2], dead.deviation[2]) == pytest.approx((0.08, 0.06), abs=0.005)
    assert dead.aicc > study.best(2).aicc
    for name in (MODULUS, LOAD):
        found = study.explanation(ZERO, PULLEY, name)
        k = [p.name for p in found.parameters].index(name)
        assert abs(found.values[k]) < 1.2 * found.deviation[k]
        assert found.aicc > study.best(2).aicc


def test_an_explanation_agrees_with_the_machine(study: TenPoses) -> None:
    for found in (study.best(count) for count in (1, 2, 3)):
        errors = dict(zip((p.name for p in found.parameters), found.values, strict=True))
        error = rest_positions(ROBOT, study.plan, study.home, [errors])[0] - study.table.desired
        np.testing.assert_allclose(error, found.predicted, atol=1e-9)
        remaining = study.table.error - error
        assert found.rms == pytest.approx(np.sqrt(np.mean(remaining**2)), rel=1e-9)
        assert found.worst == pytest.approx(np.linalg.norm(remaining, axis=1).max(), rel=1e-9)
        # the textbook form, n ln(RSS/n) in mm²
        unknown = len(found.values) + 1
        aicc = 30 * np.log(1e6 * np.sum(remaining**2) / 30) + 2 * unknown * 30 / (30 - unknown - 1)
        assert found.aicc == pytest.approx(aicc, rel=1e-9)
        for parameter in (p for p, limit in zip(found.parameters, found.at_limit, strict=True) if not limit):
            for step in (-0.02 * parameter.plausible, 0.02 * parameter.plausible):
                other = {**errors, parameter.name: errors[parameter.name] + step}
                off = rest_positions(ROBOT, study.plan, study.home, [other])[0] - study.table.actual
                assert np.sqrt(np.mean(off**2)) > found.rms


def test_more_parameters_never_increase_the_residual(study: TenPoses) -> None:
    found = [one for group in study.explanations for one in group]
    by_names = {one.names: one.rms for one in found}
    for one in found:
        for name in one.names if len(one.names) > 1 else ():
            assert one.rms <= by_names[one.names - {name}] * (1.0 + 1e-4)


def test_known_errors_are_estimated(study: TenPoses) -> None:
    """Positions computed for known errors replace the measured positions."""
    by_name = {p.name: p for p in PARAMETERS}
    for made in ({ZERO: -12.0, PULLEY: 45.0}, {MODULUS: -20.0, DEAD: 2.0}, {ANCHORS: 30.0, DRUM: 1.5, WIDTH: -8.0}):
        positions = rest_positions(ROBOT, study.plan, study.home, [made])[0]
        (found,) = explanations(
            lambda errors: rest_positions(ROBOT, study.plan, study.home, errors) - study.table.desired,
            positions - study.table.desired,
            [tuple(by_name[name] for name in made)],
        )
        assert found.values == pytest.approx(list(made.values()), rel=1e-4)
        assert found.left_out < 1e-6


def test_unidentifiable_parameters_of_ten_poses(study: TenPoses) -> None:
    """By differences of the robot written out here."""
    zero, pulley = 1e-3 * study.best(2).values

    def slope(ahead: Array, behind: Array, step: float) -> Array:
        return (behind - ahead).ravel() / (2.0 * step)

    by_pulley = slope(left(study, pulley + 1e-4, zero), left(study, pulley - 1e-4, zero), 1e-4)
    by_zero = slope(left(study, pulley, zero + 1e-4), left(study, pulley, zero - 1e-4), 1e-4)
    by_anchors = np.tile([0.0, 0.0, 1.0], 10)  # approximately: everything is lifted
    others = np.stack((by_zero, by_anchors), axis=1)
    part = others @ np.linalg.lstsq(others, by_pulley)[0]
    assert study.imitated == pytest.approx(np.linalg.norm(part) / np.linalg.norm(by_pulley), abs=5e-3)
    assert study.imitated == pytest.approx(0.99, abs=2e-3)
    robot = ROBOT.replace(winches=sl.Winch(pulley_radius=pulley))
    lengths = sl.inverse(robot, study.plan.state.pose, tension=METHOD).unstrained_length
    columns = []
    for step in np.eye(8) * 1e-5:
        ends = [sl.forward(robot, lengths + s * step, start=study.plan.state.pose).pose.position for s in (1.0, -1.0)]
        columns.append((ends[0] - ends[1]).ravel() / 2e-5)
    matrix = np.stack(columns, axis=1)
    scatter = study.best(2).rms * np.sqrt(30 / 22)
    deviation = scatter * np.sqrt(np.diag(np.linalg.inv(matrix.T @ matrix)))
    np.testing.assert_allclose(study.single_zero, deviation, rtol=1e-3)


def test_the_documentation_has_the_same_numbers(study: TenPoses) -> None:
    text = (Path(__file__).parents[2] / "docs" / "article.md").read_text(encoding="utf-8")
    flowing = " ".join(text.split())
    rows = [
        line.split("|")[1:-1] for line in text.splitlines() if line.startswith(("| anchor height", "| length zero"))
    ]
    told = [study.best(1), study.best(2), study.explanations[1][1], study.best(3)]
    for (_, *cells), found in zip(rows, told, strict=True):
        numbers = f"{1e3 * found.rms:.1f} mm", f"{1e3 * found.left_out:.1f} mm", f"{found.aicc:.1f}"
        assert tuple(cell.strip() for cell in cells) == numbers
    least, most = 1e3 * study.single_zero.min(), 1e3 * study.single_zero.max()
    assert f"{least:.0f} to {most:.0f} mm" in flowing
    assert f"reproduce {100.0 * study.imitated:.1f} % of" in flowing
    assert f"{sum(len(group) for group in study.explanations)} models" in flowing
