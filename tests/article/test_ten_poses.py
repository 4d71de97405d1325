import numpy as np
import pytest

import sagline as sl
from sagline.article.machine import DENSITY, MODULUS, PARAMETERS, Machine, _exits
from sagline.article.table2 import table2
from sagline.article.ten_poses import TenPoses, ten_poses, tour

ROBOT = sl.load_robot("article-prototype")


@pytest.fixture(scope="module")
def study() -> TenPoses:
    return ten_poses()


def test_table_2_has_distances_for_errors() -> None:
    table = table2()
    assert table.points == tuple(f"P{k}" for k in range(1, 11))
    assert table.desired[1] == pytest.approx([-0.13, 1.42, 0.68])
    assert table.actual[8] == pytest.approx([0.45, -1.734, 1.727])
    np.testing.assert_allclose(table.distance, table.printed_error, atol=5.1e-8)


def test_the_empirical_model_is_not_the_cause(study: TenPoses) -> None:
    assert np.linalg.norm(study.model_error, axis=1).max() == pytest.approx(0.59e-3, abs=0.02e-3)
    assert study.plan.feasible.all()


def test_the_platform_sits_higher_the_lower_it_is(study: TenPoses) -> None:
    slope, _ = np.polyfit(study.table.desired[:, 2], study.table.error[:, 2], 1)
    assert 1e3 * slope == pytest.approx(-18.17, abs=0.01)
    assert study.height_line.slope == pytest.approx(slope, rel=1e-12)
    assert (study.table.error[:, 2] > 0.0).all()


@pytest.mark.parametrize(
    ("name", "slope"),
    [
        (MODULUS, 18.2),  # the opposite of what was measured
        (DENSITY, -0.32),
        ("load", 4.21),
        ("anchor height", 0.21),
        ("drum radius", -9.89),
        ("zero of the lengths", 7.75),
        ("pulley radius", -16.45),
        ("platform anchors, outward", 0.81),
        ("platform anchors, up and down", 0.94),
    ],
)
def test_one_parameter_off_at_a_time(study: TenPoses, name: str, slope: float) -> None:
    trend = next(t for t in study.trends if t.parameter.name == name)
    assert trend.height_slope == pytest.approx(slope, rel=0.02)


def test_anchors_raised_lift_the_platform_by_as_much(study: TenPoses) -> None:
    trend = next(t for t in study.trends if t.parameter.name == "anchor height")
    np.testing.assert_allclose(trend.error - study.model_error, [[0.0, 0.0, 0.02]] * 10, atol=1e-7)


def test_a_drum_error_is_nothing_at_home(study: TenPoses) -> None:
    wrong = Machine(ROBOT, drum_error=0.02).rest(study.home, study.home)
    right = Machine(ROBOT).rest(study.home, study.home)
    np.testing.assert_allclose(wrong, right, atol=1e-9)
    pulleys = Machine(ROBOT, pulley_radius=0.04).rest(study.home, study.home)
    np.testing.assert_allclose(pulleys, right, atol=3e-5)
    thin = Machine(ROBOT, pulley_radius=1e-6).rest(study.plan, study.home)
    np.testing.assert_allclose(thin, Machine(ROBOT).rest(study.plan, study.home), atol=2e-6)


def test_cables_leave_their_pulleys_along_the_tangent() -> None:
    pose, radius = sl.Pose.from_euler((0.3, -0.8, 1.1), 0.0, 0.0, 0.0), 0.06
    exits, wrapped = _exits(ROBOT, pose, radius)
    ends = pose.position + ROBOT.platform_anchors
    outward = (ends - ROBOT.frame_anchors) * [1.0, 1.0, 0.0]
    centers = ROBOT.frame_anchors + radius * outward / np.linalg.norm(outward, axis=1, keepdims=True)
    arms, cables = exits - centers, ends - exits
    np.testing.assert_allclose(np.linalg.norm(arms, axis=1), radius, rtol=1e-12)
    np.testing.assert_allclose(np.sum(arms * cables, axis=1), 0.0, atol=1e-12)
    assert (arms[:, 2] > 0.0).all()  # over the pulley
    start = ROBOT.frame_anchors - centers
    turned = np.arccos(np.sum(start * arms, axis=1) / radius**2)
    np.testing.assert_allclose(wrapped, radius * turned, rtol=1e-12)


def test_the_best_explanations(study: TenPoses) -> None:
    one, two, three = (group[0] for group in study.explanations)
    assert 1e3 * study.measured_rms == pytest.approx(13.5, abs=0.05)
    assert [p.name for p in one.parameters] == ["anchor height"]
    assert one.values == pytest.approx([17.75], abs=0.05)
    assert 1e3 * one.rms == pytest.approx(9.05, abs=0.02)
    assert [p.name for p in two.parameters] == ["zero of the lengths", "pulley radius"]
    assert two.values == pytest.approx([-6.89, 38.58], abs=0.05)
    assert 1e3 * two.rms == pytest.approx(4.21, abs=0.02)
    second = study.explanations[1][1]
    assert [p.name for p in second.parameters] == ["anchor height", "pulley radius"]
    assert second.values == pytest.approx([16.6, 29.0], abs=0.2)
    assert 1e3 * three.rms == pytest.approx(3.75, abs=0.05)
    assert three.at_limit
    assert study.unlimited.rms < three.rms
    assert len(study.explanations[0]) == len(PARAMETERS)
    alone = {found.parameters[0].name: found.rms for found in study.explanations[0]}
    assert min(alone[MODULUS], alone[DENSITY]) > 0.9 * study.measured_rms


def test_an_explanation_is_what_the_machine_does(study: TenPoses) -> None:
    for found in (group[0] for group in study.explanations):
        machine = Machine(ROBOT)
        for parameter, value in zip(found.parameters, found.values, strict=True):
            machine = parameter.changed(machine, float(value))
        error = machine.rest(study.plan, study.home) - study.table.desired
        np.testing.assert_allclose(error, found.predicted, atol=1e-9)
        rest = study.table.error - error
        assert found.rms == pytest.approx(np.sqrt(np.mean(rest**2)), rel=1e-9)
        for parameter, step in ((p, 0.02 * p.plausible) for p in found.parameters if not found.at_limit):
            for sign in (-1.0, 1.0):
                other = parameter.changed(machine, sign * step).rest(study.plan, study.home) - study.table.actual
                assert np.sqrt(np.mean(other**2)) > found.rms


def test_the_tour_stops_at_the_ten_poses() -> None:
    way = tour()
    path = way.plan.path
    assert path is not None
    for stop, desired in zip(way.stops, table2().desired, strict=True):
        k = int(np.argmin(np.abs(path.time - stop)))
        assert path.pose.position[k] == pytest.approx(desired, abs=1e-3)
    assert way.plan.feasible.all()


def test_a_machine_without_rest_says_so(study: TenPoses) -> None:
    with pytest.raises(sl.InvalidValueError, match="not held"):
        Machine(ROBOT, length_offset=-1.5).rest(study.plan, study.home)
