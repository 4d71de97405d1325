from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import sagline as sl
from sagline.files.yaml_text import parse_mapping
from tests.calibration.synthetic import with_drums


@cache
def chosen(count: int, drums: bool) -> sl.CalibrationPoses:
    robot = with_drums() if drums else sl.load_robot("cogiro")
    sensors = sl.Sensors(5e-4, 5.0)
    return sl.calibration_poses(robot, count, ("mass", "axial_stiffness"), sensors, candidates=40)


@pytest.mark.parametrize("drums", [True, False])
def test_the_file_contains_poses_with_lengths_and_counts(drums: bool, tmp_path: Path) -> None:
    plan = chosen(5, drums)
    plan.save(tmp_path / "poses.yaml")
    text = (tmp_path / "poses.yaml").read_text()
    assert text.startswith("# ")
    assert max(len(line) for line in text.splitlines() if line.startswith("#")) <= 120
    data: Any = parse_mapping(text, "poses.yaml")
    about, poses = data["calibration"], data["waypoints"]
    assert about["robot"] == "cogiro"
    assert about["source"] == f"sagline {sl.__version__}"
    assert about["sensors"] == {"length_deviation": 5e-4, "tension_deviation": 5.0}
    assert about["most_helpful"] == plan.most_helpful
    assert len(poses) == 5
    for k, pose in enumerate(poses):
        np.testing.assert_allclose(pose["frame_end_tension"], plan.frame_end_tension[k], atol=0.06)
        np.testing.assert_allclose(pose["unstrained_length"], plan.unstrained_length[k], atol=6e-6)
        assert ("counts" in pose) == drums
    if drums:
        counts = [pose["counts"] for pose in poses]
        lengths = sl.lengths_from_counts(plan.robot, np.asarray(counts, dtype=float))
        np.testing.assert_allclose(lengths, plan.unstrained_length, atol=1e-5)  # half a count is 4.6e-6 m
    np.testing.assert_allclose(list(about["expected_error"].values()), plan.expected_error, rtol=1e-3)
    assert "mass [kg]" in about["expected_error"]


def test_the_file_is_a_path_with_rests_at_all_poses(tmp_path: Path) -> None:
    plan = chosen(5, True)
    plan.save(tmp_path / "poses.yaml")
    path = sl.load_path(tmp_path / "poses.yaml")
    times = np.concatenate(([0.0], np.cumsum(parse_mapping((tmp_path / "poses.yaml").read_text(), "")["durations"])))
    for k, time in enumerate(times):
        at = int(np.argmin(np.abs(path.time - time)))
        assert path.time[at] == pytest.approx(time, abs=1e-9)
        np.testing.assert_allclose(path.pose.position[at], plan.poses.position[k], atol=6e-5)
        alike = np.abs(np.sum(path.pose.quaternion[at] * plan.poses.quaternion[k]))
        assert alike == pytest.approx(1.0, abs=1e-9)
        np.testing.assert_allclose(path.twist[at], 0.0, atol=1e-9)
    speeds = np.linalg.norm(path.twist[:, :3], axis=1), np.linalg.norm(path.twist[:, 3:], axis=1)
    assert max(speeds[0]) <= 0.2 * (1.0 + 1e-9)
    assert max(speeds[1]) <= 0.1 * (1.0 + 1e-9)
    assert np.diff(times).min() >= 2.0


def test_a_single_pose_is_saved_without_a_path(tmp_path: Path) -> None:
    chosen(1, False).save(tmp_path / "poses.yaml")
    assert len(parse_mapping((tmp_path / "poses.yaml").read_text(), "")["waypoints"]) == 1
    with pytest.raises(sl.FileError, match=r"poses\.yaml"):
        sl.load_path(tmp_path / "poses.yaml")


def test_a_file_that_cannot_be_written_is_unchanged(tmp_path: Path) -> None:
    (tmp_path / "poses.yaml").mkdir()
    with pytest.raises(sl.FileError, match="folder"):
        chosen(1, False).save(tmp_path / "poses.yaml")
