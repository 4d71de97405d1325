"""Fixed parameters that contradict the readings: score tests compared with fits, coverage of standard errors."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import sagline as sl
from tests.calibration.synthetic import log_of, true_robot
from tests.tiers import extended

COGIRO = sl.load_robot("cogiro").replace(winches=sl.Winch())
ASKED = ("length_zero", "mass")
HONEST = {"length_zero": 0.03, "mass": 0.03}
ANCHORS_OFF = HONEST | {
    "axial_stiffness": 0.1,
    "center_of_mass": 0.02,
    "frame_anchors": 0.05,
    "platform_anchors": 0.005,
}


def with_cells(robot: sl.Robot, gain: Any = 1.0, bias: Any = 0.0) -> sl.Robot:
    winches = sl.Winch(load_cell_gain=gain, load_cell_bias=bias).per_cable(robot.cable_count)
    return robot.replace(winches=winches)


def found_with(truth: Any, seed: int = 0, asked: Any = ASKED, robot: sl.Robot = COGIRO, **settings: Any) -> Any:
    return sl.calibrate(robot, log_of(truth, 40, seed).log, asked, folds=0, **settings)


@pytest.mark.parametrize(
    ("name", "change"),
    [
        ("load_cell_gain[3]", lambda robot: with_cells(robot, gain=np.where(np.arange(8) == 3, 1.05, 1.0))),
        ("load_cell_bias common to all cables", lambda robot: with_cells(robot, bias=8.0)),
        ("center_of_mass", lambda robot: robot.replace(center_of_mass=[0.03, -0.02, 0.0])),
        (
            "axial_stiffness common to all cables",
            lambda robot: robot.replace(
                cables=robot.cables.replace(axial_stiffness=1.4 * robot.cables.axial_stiffness)
            ),
        ),
    ],
)
def test_a_wrong_fixed_value_is_named_and_its_estimation_gives_the_prediction(name: str, change: Any) -> None:
    truth = true_robot(COGIRO, HONEST, 1)
    truth = truth._replace(robot=change(truth.robot))
    found = found_with(truth, 1, robust=False)
    assert found.status is sl.CalibrationStatus.DOUBTFUL
    worst = found.criticisms[0]
    assert worst.name == name
    assert worst.chance < 1e-6
    again = found_with(
        truth, 1, (*ASKED, sl.Unknown(worst.kind, shared=True if "common" in name else None)), robust=False
    )
    assert again.status is sl.CalibrationStatus.FOUND
    assert not again.criticisms
    # the test is linear, and a single load cell has fewer parameters than all of them
    assert found.chi_squared - again.chi_squared == pytest.approx(worst.fall, rel=0.25)
    moved = again.value_of(worst.moves)[0] - found.value_of(worst.moves)[0]
    assert moved == pytest.approx(worst.change, rel=0.3, abs=1.5 * again.value_of(worst.moves)[1])
    assert worst.name in str(found)
    assert worst.moves in str(found)


def test_a_score_test_agrees_with_a_fit_of_a_linear_parameter() -> None:
    """Biases of the load cells without a change of the cables: only the mass is estimated."""
    truth = true_robot(COGIRO, {"mass": 0.03}, 2)
    truth = truth._replace(robot=with_cells(truth.robot, bias=np.linspace(-15.0, 15.0, 8)))
    found = found_with(truth, 2, ("mass",), robust=False)
    again = found_with(truth, 2, ("mass", "load_cell_bias"), robust=False)
    bias = next(one for one in found.criticisms if one.kind == "load_cell_bias")
    assert found.chi_squared - again.chi_squared == pytest.approx(bias.fall, rel=5e-3)


def test_logs_without_defects_are_found() -> None:
    statuses = [found_with(true_robot(COGIRO, HONEST, seed), seed).status for seed in range(30)]
    assert sum(status is sl.CalibrationStatus.FOUND for status in statuses) >= 28


@extended
def test_standard_errors_include_the_tolerances_of_values_that_were_not_estimated() -> None:
    """Platform anchors with errors of 5 mm: about two thirds of the true values are within one standard error."""
    shares = []
    for robot in (COGIRO, COGIRO.replace(tolerances={"platform_anchors": 0.005})):
        within = []
        for seed in range(40):
            truth = true_robot(COGIRO, ANCHORS_OFF, seed)
            asked = ("length_zero", "mass", "axial_stiffness", "center_of_mass", "frame_anchors")
            found = found_with(truth, seed, asked, robot)
            pairs = [("mass", truth.robot.mass)]
            pairs += [(f"center_of_mass.{axis}", x) for axis, x in zip("xyz", truth.robot.center_of_mass, strict=True)]
            pairs += [(f"length_zero[{i}]", x) for i, x in enumerate(truth.length_offset)]
            for label, true in pairs:
                value, error = found.value_of(label)
                within.append(abs(value - true) < error)
        shares.append(np.mean(within))
        if robot is not COGIRO:
            assert "tolerance: platform_anchors" in str(found)
    assert shares[0] < 0.55
    assert 0.6 < shares[1] < 0.78


def test_total_chi_squared_includes_poses_of_reduced_weight_and_no_outliers() -> None:
    log = log_of(true_robot(COGIRO, HONEST, 8), 60, 8, slips={(5, 2): 0.01}).log
    found = sl.calibrate(COGIRO, log, ASKED, folds=0)
    outlying = np.isin(found.rows, [one.row for one in found.outliers])
    assert found.outliers
    assert outlying.any()
    less = found.weights < 1.0
    assert (less & ~outlying).any()
    chi_squared, freedom = found.chi_squared_of_all
    more = found.chi_squared_of_pose[less & ~outlying].sum()
    assert chi_squared == pytest.approx(found.chi_squared + more)
    assert freedom == found.degrees_of_freedom + 8 * np.count_nonzero(less & ~outlying)
