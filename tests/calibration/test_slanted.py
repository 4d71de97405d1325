"""Calibration of a platform on four cables over pulleys that swivel about horizontal axes; logs of a twin."""

from __future__ import annotations

from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from typer.testing import CliRunner

import sagline as sl
from sagline.cli.main import app
from sagline.core.arrays import Array
from tests.calibration.four_cables import (
    AXES,
    CENTER,
    DEFECTS,
    FRAME,
    MASS,
    STIFFNESS,
    Twin,
    at_rest,
    cable_vectors,
    drawn_robot,
    log_with_poses,
    pulleys_at,
    turn_of,
    twin_of,
)
from tests.calibration.machines import robots
from tests.tiers import extended

RADIUS = 0.03  # m
UP = (0.0, 0.0, 1.0)
TILT, TURN = 2e-3, 3e-3  # deviations of inclinometer and swivel angles [rad]
MEASURED = 1e-3  # deviation of measured frame anchors [m]
FOUND, DOUBTFUL = sl.CalibrationStatus.FOUND, sl.CalibrationStatus.DOUBTFUL


def robot_with(axes: Any = AXES, radius: float = RADIUS, anchors: float | None = None) -> sl.Robot:
    """The drawn robot with pulleys; anchors: tolerance of its frame anchors [m]."""
    robot = drawn_robot(winches=sl.Winch(radius, swivel_axis=axes))
    return robot if anchors is None else robot.replace(tolerances={**robot.tolerances, "frame_anchors": anchors})


def twin_with_pulleys(seed: int, defect: str | None = None, anchors: float | None = None) -> Twin:
    """A twin with pulleys; anchors: deviation of its frame anchors [m]."""
    twin = twin_of(seed, defect)._replace(radius=RADIUS)
    if anchors is None:
        return twin
    return twin._replace(frame=FRAME + anchors * np.random.default_rng((seed, 3)).normal(size=(4, 3)))


def log_of(
    twin: Twin, seed: int, *, cells: bool = True, swivel: bool = False, noise: float = 1.0
) -> tuple[sl.WinchLog, Array]:
    """Log with an inclinometer, and optionally swivel angles, and the zeros of these angles (4,) [rad]."""
    random = np.random.default_rng((seed, 2))
    log, angles, places = log_with_poses(twin, seed, noise=noise)
    turned = angles + noise * TILT * random.normal(size=angles.shape)
    turned[:, 0] = 0.0
    sensors = log.sensors.replace(rotation_deviation=noise * TILT * np.array([1.0, 1.0, np.inf]))
    log = log.replace(rotation=Rotation.from_euler("ZYX", turned).as_quat(), sensors=sensors)
    zeros = random.uniform(-np.pi, np.pi, 4)
    if swivel:
        read = zeros + np.array([_swivel_angles(twin, *at) for at in zip(places, angles, strict=True)])
        read += noise * TURN * random.normal(size=read.shape)
        sensors = sensors.replace(swivel_deviation=noise * TURN)
        log = log.replace(swivel=np.remainder(read, 2.0 * np.pi), sensors=sensors)
    if not cells:
        log = log.replace(load_cells=None, sensors=log.sensors.replace(tension_deviation=None))
    return log, zeros


def _swivel_angles(twin: Twin, place: Array, angles: Array) -> Array:
    """Angles of the pulleys about their axes (4,) [rad], from the upper side."""
    found = at_rest(twin, np.append(place, angles[0]))
    assert found is not None
    outward = pulleys_at(twin, found[6:].reshape(4, 3), found[2:6])[2]
    return np.asarray(np.arctan2(np.sum(outward * np.cross(AXES, UP), axis=1), outward[:, 2]))


def errors_of(found: sl.Calibration, twin: Twin) -> dict[str, float]:
    """Errors of values in standard errors."""
    at = dict(zip(found.parameters.labels, range(len(found.values)), strict=True))
    truth = {f"frame_anchors[{i}].{axis}": twin.frame[i, k] for i in range(4) for k, axis in enumerate("xyz")}
    truth |= {f"center_of_mass.{axis}": twin.center[k] for k, axis in enumerate("xyz")}
    truth |= {f"length_zero[{i}]": twin.zeros[i] for i in range(4)}
    truth |= {"mass": twin.mass}
    return {
        name: (found.values[at[name]] - value) / found.standard_error[at[name]]
        for name, value in truth.items()
        if name in at
    }


def test_the_twin_is_the_robot_with_pulleys() -> None:
    twin = Twin(FRAME, MASS, CENTER, STIFFNESS, np.zeros(4), np.ones(4), np.zeros(4), RADIUS)
    _, angles, places = log_with_poses(twin, 0, poses=3)
    for place in np.column_stack((places, angles[:, 0])):
        found = at_rest(twin, place)
        assert found is not None
        force, turn = found[6:].reshape(4, 3), turn_of(found, place)
        lengths = found[2:6] + pulleys_at(twin, force, found[2:6])[1]
        state = sl.forward(robot_with(), lengths, sl.Pose(place[:3], turn)).state
        np.testing.assert_allclose(state.pose.position, place[:3], atol=2e-8)
        np.testing.assert_allclose(state.pose.matrix, turn, atol=2e-7)
        tension = cable_vectors(force, found[2:6], twin.stiffness)[1]
        np.testing.assert_allclose(state.cables.frame_end_tension, tension, atol=1e-4)


@pytest.mark.parametrize("cells", [True, False])
def test_a_log_is_found_with_the_true_axes(cells: bool) -> None:
    twin = twin_with_pulleys(3)
    log, _ = log_of(twin, 3, cells=cells)
    found = sl.calibrate(robot_with(), log, folds=0)
    assert found.status is FOUND
    off = np.array([*errors_of(found, twin).values()])
    assert np.sqrt((off**2).mean()) < 1.5
    assert np.abs(off).max() < 3.0
    np.testing.assert_array_equal(found.robot.winches.swivel_axis, AXES)  # type: ignore[union-attr]


@pytest.mark.parametrize("seed", [0, 1])
def test_vertical_axes_in_place_of_horizontal_axes_are_worse(seed: int) -> None:
    twin = twin_with_pulleys(seed, anchors=MEASURED)
    log = log_with_poses(twin, seed, noise=0.15)[0]
    right, wrong = (sl.calibrate(robot_with(axes, anchors=MEASURED), log, folds=0) for axes in (AXES, UP))
    assert right.status is FOUND
    assert wrong.chi_squared > 1.5 * right.chi_squared
    size = [np.sqrt(np.square([*errors_of(found, twin).values()]).mean()) for found in (right, wrong)]
    assert size[0] < 1.4
    assert size[1] > 2.0


@pytest.mark.parametrize("cells", [True, False])
def test_swivel_angles_about_horizontal_axes_are_readings(cells: bool) -> None:
    twin = twin_with_pulleys(6)
    log, zeros = log_of(twin, 6, cells=cells, swivel=True)
    found = sl.calibrate(robot_with(), log, folds=0)
    assert found.status is FOUND
    assert found.residuals.shape == (len(log), 18)
    off = np.angle(np.exp(1j * (found.swivel_zero - zeros)))
    errors = np.array([found.value_of(f"swivel_zero[{k}]")[1] for k in range(4)])
    assert (np.abs(off) < 2.5 * errors).all()
    assert not any("vertical" in way.name for way in found.gauge)  # the known axes fix the directions in the world
    assert np.sqrt(np.square([*errors_of(found, twin).values()]).mean()) < 1.5


def test_eyelets_become_pulleys_with_the_given_axes() -> None:
    twin = twin_with_pulleys(1, anchors=MEASURED)
    log = log_with_poses(twin, 1, noise=0.1)[0]
    asked: list[str | sl.Unknown] = ["default", sl.Unknown("pulley_radius", deviation=0.05)]
    found = sl.calibrate(robot_with(radius=0.0, anchors=MEASURED), log, asked, folds=0)
    radius, error = found.value_of("pulley_radius")
    assert found.status is FOUND
    assert error < 0.01
    assert abs(radius - RADIUS) < 2.5 * error


def test_straight_cables_need_neither_load_cells_nor_forces() -> None:
    twin = twin_with_pulleys(4)._replace(stiffness=1e9)
    log, _, places = log_with_poses(twin, 4)
    noise = 1e-3 * np.random.default_rng(4).normal(size=places.shape)
    sensors = sl.Sensors(log.sensors.length_deviation, position_deviation=1e-3)
    measured = log.replace(load_cells=None, position=places + noise, sensors=sensors)
    found = sl.calibrate(robot_with(), measured, model=sl.Straight(), folds=0)
    assert found.status is FOUND
    off = np.array([*errors_of(found, twin).values()])
    assert off.size == 16
    assert np.sqrt((off**2).mean()) < 1.6


def test_the_command_line_calibrates_horizontal_axes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    log, _ = log_of(twin_with_pulleys(5), 5, swivel=True)
    Path("robot.yaml").write_text(sl.dump_robot(robot_with()))
    log.save("log.csv")
    result = CliRunner().invoke(app, ["calibrate", "robot.yaml", "log.csv", "--folds", "0", "--out", "found.yaml"])
    assert result.exit_code == 0, result.output
    assert "swivel_zero" in result.output
    winches = sl.load_robot("found.yaml").winches
    assert winches is not None
    np.testing.assert_array_equal(winches.swivel_axis, AXES)


@extended
def test_expected_errors_of_chosen_poses_are_those_of_a_calibration() -> None:
    robot, names = robots()["slanted"], ("frame_anchors", "length_zero")
    plan = sl.calibration_poses(robot, 12, names, sl.Sensors(1e-3, 5.0), candidates=60)
    noise = np.random.default_rng(3).normal(size=(2, *plan.unstrained_length.shape))
    assert robot.winches is not None
    cells = robot.winches.load_cell_gain * plan.frame_end_tension + robot.winches.load_cell_bias + 5.0 * noise[1]
    log = sl.WinchLog(
        unstrained_length=plan.unstrained_length + 1e-3 * noise[0],
        load_cells=cells,
        commanded=plan.poses,
        sensors=plan.sensors,
    )
    found = sl.calibrate(robot, log, names, folds=0)
    np.testing.assert_allclose(found.standard_error, plan.expected_error, rtol=0.1)


@pytest.mark.parametrize("seed", [0, 2])
def test_wrong_load_cells_widen_the_error_of_the_mass_or_are_doubtful(seed: int) -> None:
    assert _is_right(seed, DEFECTS[seed])


def _is_right(seed: int, defect: str) -> bool:
    """True if the default calibration is doubtful or within two standard errors of the mass."""
    twin = twin_with_pulleys(seed, defect)
    found = sl.calibrate(robot_with(), log_of(twin, seed)[0], folds=0)
    mass, error = found.value_of("mass")
    return found.status is DOUBTFUL or (found.status is FOUND and abs(mass - twin.mass) < 2.0 * error)


@pytest.mark.soak
def test_random_defects_give_true_or_doubtful_results_and_faultless_logs_are_found() -> None:
    right = np.mean([_is_right(seed, DEFECTS[seed % len(DEFECTS)]) for seed in range(200)])
    statuses: Counter[str] = Counter()
    off: list[float] = []
    for seed in range(1000, 1200):
        twin = twin_with_pulleys(seed)
        log, zeros = log_of(twin, seed, cells=seed % 4 > 0, swivel=seed % 2 == 0)
        found = sl.calibrate(robot_with(), log, folds=0)
        statuses[found.status.name] += 1
        off += errors_of(found, twin).values()
        if log.swivel is not None:
            errors = np.array([found.value_of(f"swivel_zero[{k}]")[1] for k in range(4)])
            off += (np.angle(np.exp(1j * (found.swivel_zero - zeros))) / errors).tolist()
    print(f"{100.0 * right:.1f} % of the defects, {statuses['FOUND'] / 2.0:.1f} % of the honest logs")
    print([float(np.mean(np.abs(off) < size)) for size in (1.0, 2.0)])
    assert right >= 0.95
    assert statuses["FOUND"] >= 188
    assert 0.62 < np.mean(np.abs(off) < 1.0) < 0.80
    assert 0.93 < np.mean(np.abs(off) < 2.0) < 0.99
