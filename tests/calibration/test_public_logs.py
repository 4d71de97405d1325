"""Comparison with published measurements, on files of the same form with known content."""

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.io import savemat
from scipy.spatial.transform import Rotation

import sagline as sl
from benchmarks.measured import main
from benchmarks.public_logs import DIAMONDS, REPOSITORIES, SWINGS, frequencies_of
from sagline.core.arrays import Array

RADIUS = 0.02
UP = np.array([0.02, -0.03, 1.0]) / np.linalg.norm([0.02, -0.03, 1.0])
LEVEL = Rotation.align_vectors([[0.0, 0.0, 1.0]], [UP])[0]  # from the axes of the files to z up


def suspended(m: int) -> sl.Robot:
    """Platform under m cables, with pulleys that swivel about horizontal axes."""
    angle = 2.0 * np.pi * np.arange(m) / m + 0.2
    return sl.Robot(
        "made",
        np.stack((1.4 * np.cos(angle), 1.1 * np.sin(angle), 0.6 + 0.05 * np.cos(2.0 * angle)), axis=1),
        np.stack((0.2 * np.cos(angle), 0.15 * np.sin(angle), np.full(m, 0.26)), axis=1),
        sl.Cable(1e-3, 1e5),
        1.0 if m == 3 else 13.0,
        np.diag([0.017, 0.022, 0.033]),
        center_of_mass=(0.002, -0.003, 0.2),
        gravity=9.80665,
        winches=sl.Winch(np.full(m, RADIUS), swivel_axis=across(m)),
    )


def across(m: int) -> Array:
    """Horizontal swivel axes (m, 3), along the rim of the frame."""
    angle = 2.0 * np.pi * np.arange(m) / m + 0.2
    return np.stack((-np.sin(angle), np.cos(angle), np.zeros(m)), axis=1)


def table_of(folder: Path, capsys: pytest.CaptureFixture[str]) -> dict[str, tuple[list[float], list[float]]]:
    """Numbers of authors and of sagline in each row of the printed table, by the start of the row."""
    main([str(folder)])
    lines = [line.split("|")[1:4] for line in capsys.readouterr().out.splitlines() if line.startswith("| ")]
    number = r"[-−+]?\d+\.?\d*"
    return {
        head.strip(): tuple([float(each.replace("−", "-")) for each in re.findall(number, text)] for text in texts)  # type: ignore[misc]
        for head, *texts in lines[1:]
    }


def row_of(table: dict[str, tuple[list[float], list[float]]], words: str) -> tuple[list[float], list[float]]:
    (found,) = [numbers for head, numbers in table.items() if words in head]
    return found


def swing_signals(frequency: Array, seed: int) -> Array:
    """Motion of five markers (15, 1000), sampled at 100 Hz."""
    rng = np.random.default_rng(seed)
    time = 0.01 * np.arange(1000)
    modes = np.exp(-0.02 * 2.0 * np.pi * frequency[:, None] * time) * np.cos(2.0 * np.pi * frequency[:, None] * time)
    return np.asarray(rng.normal(0.0, 0.02, (15, len(frequency))) @ modes + rng.normal(0.0, 1e-4, (15, 1000)))


def write_swings(folder: Path) -> None:
    robot = suspended(3)
    assert robot.winches is not None
    entry, axis = (LEVEL.inv().apply(each)[..., None].tolist() for each in (robot.frame_anchors.copy(), across(3)))
    active = [
        {
            "active": True,
            "pulley": {"radius": RADIUS, "pos_OD_glob": entry[i], "vers_k": axis[i]},
            "winch": {"pos_PA_loc": [[float(x)] for x in robot.platform_anchors[i]]},
        }
        for i in range(3)
    ]
    platform = {
        "mass": 1,
        "gravity_axis": [[float(x)] for x in UP],
        "inertia_mat_G_loc": robot.inertia.tolist(),
        "pos_PG_loc": [[float(x)] for x in robot.center_of_mass],
    }
    (folder / "config").mkdir(parents=True)
    unused = {**active[0], "active": False}
    given = {"actuator": [active[0], unused, *active[1:]], "platform": platform}
    (folder / "config/Grab_prototype_33.json").write_text(json.dumps(given))
    (folder / SWINGS).mkdir(parents=True)
    for i, place in enumerate([(0.1, 0.0, -0.7), (-0.2, 0.2, -0.9), (0.0, -0.1, -0.5)]):
        plan = sl.inverse(robot, place)
        pose = plan.state.pose
        frequency = np.sort(sl.modes(plan.state).frequency)[:3] / 0.98
        angles = (LEVEL.inv() * pose.rotation).as_euler("XYZ")
        res = {
            "l": plan.unstrained_length,
            "pose": np.concatenate((LEVEL.inv().apply(pose.position.copy()), angles)),
            "f": 1.05 * frequency[::-1],
        }
        savemat(folder / SWINGS / f"vicon_data_f_{i + 1}.mat", {"res": res})
        signals = swing_signals(frequency, i)
        markers = np.array([(part,) for part in np.split(signals, 5)], dtype=[("p", object)])
        savemat(folder / SWINGS / f"vicon_markers_{i + 1}.mat", {"m": markers})


def test_swings_are_compared_with_both_models(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write_swings(tmp_path / "cdpr_matlab")
    table = table_of(tmp_path, capsys)
    authors, own = row_of(table, "median deviation of the model")
    assert authors[0] == pytest.approx(5.0, abs=0.3)
    assert own[0] == pytest.approx(-2.0, abs=0.3)
    assert int(next(iter(table)).split()[0]) == 9  # modes
    _, away = row_of(table, "pose at rest")
    _, tilted = row_of(table, "tilt at rest")
    assert away[0] <= 0.1
    assert tilted[0] <= 0.01


def test_frequencies_of_close_modes_are_separated() -> None:
    frequency = np.array([0.62, 0.71, 1.9, 2.4])
    np.testing.assert_allclose(frequencies_of(swing_signals(frequency, 8), 4), frequency, rtol=5e-3)


def test_a_session_is_predicted_and_calibrated(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    robot = suspended(4).replace(inertia=np.diag([0.2, 0.2, 0.3]))
    places = np.random.default_rng(2).uniform((-0.5, -0.4, -1.0), (0.5, 0.4, -0.6), (27, 3))
    plan = sl.inverse(robot, places)
    angles = plan.state.pose.rotation.as_euler("XYZ")
    cells: list[Any] = [
        {"r": RADIUS, "CableEnterPosition": anchor[:, None], "FixedFrame": objects((*np.eye(3)[:2], axis))}
        for anchor, axis in zip(robot.frame_anchors, across(4), strict=True)
    ]
    platform = {
        "m": robot.mass, "PtoG": robot.center_of_mass[:, None], "InertialMatrix": robot.inertia,
        "points": objects(robot.platform_anchors),
    }  # fmt: skip
    s = {"EndEffector": {"Platform": platform}, "Trasmission": {"Pulley": objects(cells)}}
    folder = tmp_path / "UACDPR_SelfCalibration"
    (folder / "libs/config").mkdir(parents=True)
    savemat(folder / "libs/config/IRMA4U_Mar25.mat", {"s": s})
    values = {
        "cable_length_meas": plan.unstrained_length.T + 1e-4 * np.array([[4.0], [-2.0], [3.0], [1.0]]),
        "loadcell_meas": plan.state.cables.frame_end_tension.T,
        "epsilon_meas": angles.T + np.radians([[1.0], [0.0], [0.0]]),
        "zeta_0_real": np.concatenate((plan.state.pose.position[0], angles[0])),
        "InitialPositionErrorNorm": 0.0051,
        "self_calib_comp_time": 123.4,
    }
    savemat(folder / "ws_selfcalibration_27_final.mat", values)
    table = table_of(tmp_path, capsys)
    _, tilt = row_of(table, "tilt from lengths")
    _, tension = row_of(table, "tensions from the balance")
    _, first = row_of(table, "first position from lengths")
    assert 0.6 < tilt[0] < 0.9  # roll with an error of 1°, pitch without
    assert tension[0] < 0.5
    assert 0.1 < first[0] < 3.0
    authors, own = row_of(table, "self-calibration of 27 poses")
    assert authors == [5.1, 123.0]
    assert own[0] < 2.0


def objects(values: Any) -> Any:
    """A cell array of MATLAB."""
    cell = np.empty(len(values), dtype=object)
    for i, value in enumerate(values):
        cell[i] = value
    return cell


def write_tracked(folder: Path) -> None:
    """A planar robot that moves for 26 s, with wrong zeros and scales of lengths and of the controller's estimate."""
    rng = np.random.default_rng(6)
    corners = np.array([[2.95, 0.02], [2.91, 2.36], [0.0, 2.40], [0.0, 0.0]])
    markers = np.array([[0.066, -0.06], [0.066, 0.06], [-0.066, 0.06], [-0.066, -0.06]])
    anchors = markers + np.array([[0.026], [0.026], [-0.026], [-0.026]]) * [1.0, 0.0]
    robot = sl.Robot(
        "planar", np.insert(corners, 1, 0.0, axis=1), np.insert(anchors, 1, 0.0, axis=1), sl.Cable(0.007, 1.4e4), 1.0,
        0.01 * np.eye(3), motion_pattern="1R2T", plane_normal=(0.0, 1.0, 0.0), tension_min=5.0,
    )  # fmt: skip

    def place(time: Any) -> Array:
        moving = np.clip(time - 1.0, 0.0, None)
        grown = np.minimum(moving / 20.0, 1.0)
        return np.stack((1.4 + 0.7 * grown * np.sin(2.0 * moving), 1.1 + 0.6 * grown * np.sin(3.0 * moving)), axis=1)

    own = place(0.01 * np.arange(2700))
    lengths = sl.inverse(robot, sl.Pose(np.insert(own, 1, 0.0, axis=1), np.eye(3))).unstrained_length
    lengths = lengths / 0.94 + np.array([0.05, -0.08, 0.03, 0.1]) + rng.normal(0.0, 5e-4, lengths.shape)
    text = ["Start"]
    for (x, y), row in zip(own * [1.05, 1.1], lengths, strict=True):
        cables = "".join(f"0 8 {-length:.4f} 0.0000\t|\t" for length in row)
        text.append(f"2: {x:.4f} {y:.4f} - {x:.4f} {y:.4f}\t|\t{cables}0")
    file = folder / DIAMONDS
    file.parent.mkdir(parents=True)
    file.with_suffix(".txt").write_text("\n".join([*text, text[-1][:40]]))
    time = np.arange(3400) / 120.0
    seen = place(time - 0.4)
    points = {"Rigid Body 2": seen}
    points |= {f"Rigid Body 2_{k + 1}": seen + markers[i] for k, i in enumerate((2, 0, 3, 1))}
    points |= {
        f"Marker_{name}": np.tile(corners[i], (len(time), 1)) for name, i in (("7", 2), ("9", 1), ("3", 0), ("5", 3))
    }
    names, columns = [], [np.arange(len(time)), time]
    for name, both in points.items():  # x is normal to the plane, y is up, z is to the right
        shifted = both + np.array([-1.45, 0.04]) + rng.normal(0.0, 2e-4, both.shape)
        names += [name] * 3
        columns += [np.full(len(time), -0.13), shifted[:, 1], shifted[:, 0]]
    head = ["Format Version,1.1", "", ",,kind", ",,", ",,", ",,", "Frame,Time"]
    for k, words in ((3, names), (5, ["Position"] * len(names)), (6, ["X", "Y", "Z"] * len(points))):
        head[k] = head[k].rstrip(",") + ("," if k == 6 else ",,") + ",".join(words)
    lines = [",".join(f"{value:.6f}" for value in row) for row in np.stack(columns, axis=1)]
    file.with_suffix(".csv").write_text("\n".join([*head, *lines]))


def test_a_planar_robot_is_calibrated_from_motion_capture(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write_tracked(tmp_path / "cable-robot")
    table = table_of(tmp_path, capsys)
    authors, own = row_of(table, "350 rows")
    assert authors[0] > 4.0
    assert own[0] < 1.0


def test_missing_repositories_are_named_with_their_addresses(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "UACDPR_SelfCalibration").mkdir()
    assert main([str(tmp_path)]) == 1
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == 3
    for name, line in zip(REPOSITORIES, lines, strict=True):
        assert name in line
    assert REPOSITORIES["cable-robot"] in lines[2]
    assert "IRMA4U_Mar25.mat" in lines[1]
    assert main([]) == 2
