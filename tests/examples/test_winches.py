"""The example log contains readings of the true robot, and a calibration with the log finds that robot."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from scipy.stats import chi2

import sagline as sl
from sagline.calibration.diagnostics import diagnose_log
from sagline.calibration.screening import screen
from sagline.core.arrays import Array
from tests.calibration.example_log import EXAMPLES, example_log, example_truth, text_of
from tests.tiers import extended

DRAWN, LOG, TRUTH = (EXAMPLES / f"winches{end}" for end in ("_robot.yaml", ".csv", "_truth.yaml"))


def numbers(robot: sl.Robot) -> Array:
    """Default unknowns of a robot without the load cells, in their order."""
    assert robot.winches is not None
    assert robot.winches.length_zero is not None
    shared = [robot.cables.axial_stiffness[0], robot.mass]
    return np.concatenate((robot.frame_anchors.ravel(), robot.winches.length_zero, shared, robot.center_of_mass))


def test_the_truth_is_the_drawing_with_errors() -> None:
    made, drawn = sl.load_robot(TRUTH), sl.load_robot(DRAWN)
    np.testing.assert_allclose(numbers(made), numbers(example_truth().robot), rtol=1e-12)
    off = np.linalg.norm(made.frame_anchors - drawn.frame_anchors, axis=1)
    assert off.min() > 0.02
    assert off.max() < 0.055
    assert abs(made.cables.axial_stiffness[0] / drawn.cables.axial_stiffness[0] - 1.1) < 0.01


def test_the_log_contains_the_readings_of_the_true_robot(tmp_path: Path) -> None:
    """To one step of the written digits: another machine may round the last digit differently."""
    file = tmp_path / "again.csv"
    file.write_text(text_of(example_log(sl.load_robot(TRUTH)).log))
    log, again = sl.load_log(LOG), sl.load_log(file)
    assert file.read_text().splitlines()[:4] == LOG.read_text().splitlines()[:4]
    assert log.counts is not None
    assert again.counts is not None
    assert log.load_cells is not None
    assert again.load_cells is not None
    assert log.commanded is not None
    assert again.commanded is not None
    np.testing.assert_allclose(again.counts, log.counts, rtol=0.0, atol=1.0)
    assert np.count_nonzero(again.counts != log.counts) <= 2
    np.testing.assert_allclose(again.load_cells, log.load_cells, rtol=0.0, atol=0.1 + 1e-9)
    assert np.count_nonzero(again.load_cells != log.load_cells) <= 2
    np.testing.assert_allclose(again.commanded.position, log.commanded.position, rtol=0.0, atol=0.01 + 1e-9)
    np.testing.assert_allclose(again.commanded.quaternion, log.commanded.quaternion, rtol=0.0, atol=2e-3)


@extended
def test_all_rows_fit_and_no_diagnostic_is_raised() -> None:
    robot, log = sl.load_robot(DRAWN), sl.load_log(LOG)
    assert len(screen(robot, log)[0]) == len(log) == 60
    assert diagnose_log(robot, log) == ()


@extended
def test_the_calibration_finds_the_truth() -> None:
    found = sl.calibrate(sl.load_robot(DRAWN), sl.load_log(LOG), folds=0)
    assert found.status == sl.CalibrationStatus.FOUND
    off = found.values - np.concatenate((numbers(sl.load_robot(TRUTH)), np.ones(8), np.zeros(8)))
    assert off @ np.linalg.solve(found.covariance, off) < chi2.ppf(0.99, len(off))
    assert found.outliers == ()
    mass, deviation = found.value_of("mass")
    assert 0.02 < deviation / 91.44 < 0.04  # the prior of the common gain of the load cells is 5 %
    assert abs(mass - 91.44) < 3.0 * deviation
    asked = dict.fromkeys(name for name in found.parameters.names if not name.startswith("load_cell"))
    assumed = sl.calibrate(sl.load_robot(DRAWN), sl.load_log(LOG), [*asked], folds=0)
    assert assumed.value_of("mass")[1] < 0.3
