"""A calibrated robot contains the provenance of its numbers."""

from pathlib import Path

import numpy as np
import pytest

import sagline as sl
from sagline import dump_robot
from sagline.calibration.evaluation import _provenance_of
from sagline.calibration.parameters import KINDS, parameters_of
from tests.calibration.machines import sensors, with_drums


@pytest.mark.parametrize("shared", [True, False])
@pytest.mark.parametrize("counted", [True, False])
def test_every_number_has_the_standard_error_of_its_parameter(shared: bool, counted: bool, tmp_path: Path) -> None:
    robot = with_drums(sl.load_robot("cogiro"))
    unknowns = [sl.Unknown(name, shared and KINDS[name].shared, 1.0) for name in KINDS]
    parameters = parameters_of(robot, unknowns, sensors(), counted=counted)
    errors = 1.0 + np.arange(float(len(parameters.names)))
    status = sl.CalibrationStatus.FOUND
    made = _provenance_of(parameters, errors, status, "winches.csv", "2026-03-01")
    kept = robot.replace(calibration=made).calibration
    assert kept is not None
    outside = {"measuring_frame", "length_scale", "clock_offset", "swivel_zero", "inertia", "target"}  # of the robot
    assert set(kept.standard_error) == set(KINDS) - outside - ({"length_zero"} if not counted else set())
    by_label = dict(zip(parameters.labels, errors, strict=True))
    for name, error in kept.standard_error.items():
        kind = KINDS[name]
        for index, value in np.ndenumerate(error):
            cable = f"[{index[0]}]" if kind.each and not (shared and kind.shared) else ""
            axis = f".{kind.axes[index[-1]]}" if len(kind.axes) > 1 else ""
            assert value == by_label[f"{name}{cable}{axis}"], (name, index)
    file = tmp_path / "robot.yaml"
    file.write_text(dump_robot(robot.replace(calibration=made)), encoding="utf-8")
    again = sl.load_robot(file).calibration
    assert again is not None
    assert (again.log, again.date, again.note) == ("winches.csv", "2026-03-01", "")


def test_doubtful_results_are_noted() -> None:
    robot = sl.load_robot("cogiro")
    parameters = parameters_of(robot, ["mass"], sensors(), counted=False)
    for status in (sl.CalibrationStatus.DOUBTFUL, sl.CalibrationStatus.NOT_CONVERGED):
        made = _provenance_of(parameters, np.ones(1), status, "", "2026-03-01")
        assert made.note == status.text
