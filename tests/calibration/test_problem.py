"""Initial values of the search: the place of a measuring system without prior information."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import sagline as sl
from tests.calibration.synthetic import log_of, true_robot, usual_sensors
from tests.tiers import wide

ASKED = ("frame_anchors", "length_zero", "mass", "measuring_frame")
ERRORS = {"frame_anchors": 0.02, "length_zero": 0.02, "mass": 0.02}


@pytest.mark.parametrize(
    "vector", wide([pytest.param(vector) for vector in ((2.0, -2.0, 0.5), (0.0, 0.0, np.pi), (-1.2, 0.0, 1.2))])
)
@pytest.mark.parametrize(("positions", "rotations"), [(0, 20), (20, 0), (1, 20), (20, 20)])
def test_a_measuring_system_with_any_rotation_is_found(
    vector: tuple[float, float, float], positions: int, rotations: int
) -> None:
    turned = Rotation.from_rotvec(vector)
    really = usual_sensors(
        position_deviation=1e-3 if positions else None,
        rotation_deviation=1e-3 if rotations else None,
        frame=sl.Pose((5.0, -3.0, 1.0), turned),
    )
    robot = sl.load_robot("cogiro")
    truth = true_robot(robot, ERRORS, 1, really)
    log = log_of(truth, 20, 1, positions=positions, rotations=rotations).log
    believed = really.replace(frame=sl.Pose(np.zeros(3), np.eye(3)))
    found = sl.calibrate(robot, log.replace(sensors=believed), ASKED, folds=0)
    assert found.status == sl.CalibrationStatus.FOUND
    assert (found.sensors.frame.rotation * turned.inv()).magnitude() < 0.02  # rad: the world may be rotated with it
    if positions:
        assert np.linalg.norm(found.sensors.frame.position - truth.sensors.frame.position) < 0.15


def test_points_on_a_line_leave_their_rotation_undetermined() -> None:
    """A platform that moved along a line, measured in axes without prior information."""
    robot = sl.load_robot("cogiro")
    places = np.column_stack((np.linspace(-1.0, 1.0, 12), np.zeros(12), np.full(12, 1.5)))
    pose = sl.Pose(places, np.eye(3))
    plan = sl.inverse(robot, pose)
    log = sl.WinchLog(
        unstrained_length=plan.unstrained_length,
        load_cells=plan.state.cables.frame_end_tension,
        position=places,
        commanded=pose,
        sensors=usual_sensors(position_deviation=1e-3),
    )
    found = sl.calibrate(robot, log, ("mass", "measuring_frame"), folds=0)
    assert any("about x" in one.name for one in found.gauge)
    assert found.value_of("mass")[0] == pytest.approx(robot.mass, rel=1e-6)
