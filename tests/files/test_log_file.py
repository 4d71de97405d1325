"""Logs of winches in CSV: written logs are read exactly, and errors are reported with their line."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from syrupy.assertion import SnapshotAssertion

import sagline as sl
from sagline.files.log_file import _dump_log
from tests.calibration.synthetic import log_of, true_robot, usual_sensors, with_drums
from tests.files.wording import wording
from tests.refusal import refused

SENSORS = usual_sensors(
    length_deviation=[4e-4, *[5e-4] * 7],
    position_deviation=[1e-3, 1e-3, 2e-3],
    rotation_deviation=1e-3,
    frame=sl.Pose.from_euler([1.0, -2.0, 0.3], 0.4, 0.0, 0.1),
    target=[0.1, 0.0, -0.2],
)


def read(folder: Path, text: str, sensors: sl.Sensors | None = None) -> sl.WinchLog:
    file = folder / "log.csv"
    file.write_text(text)
    return sl.load_log(file, sensors)


@pytest.mark.parametrize("robot", [sl.load_robot("cogiro"), with_drums()], ids=["lengths", "counts"])
@pytest.mark.parametrize("measured", [0, 4])
def test_a_saved_log_is_read_exactly(robot: sl.Robot, measured: int, tmp_path: Path) -> None:
    truth = true_robot(robot, seed=2, sensors=SENSORS)
    log = log_of(truth, 12, seed=2, positions=measured, rotations=measured).log
    assert log.load_cells is not None
    cells = log.load_cells.copy()
    cells[:, 3] = np.nan
    log = log.replace(load_cells=cells)
    log.save(tmp_path / "log.csv")
    again = sl.load_log(tmp_path / "log.csv")
    for name in ("counts", "unstrained_length", "load_cells", "position", "rotation", "time"):
        one, other = getattr(again, name), getattr(log, name)
        assert (one is None) == (other is None), name
        if other is not None:
            np.testing.assert_array_equal(one, other, err_msg=name)
    assert log.commanded is not None
    assert again.commanded is not None
    np.testing.assert_array_equal(again.commanded.position, log.commanded.position)
    np.testing.assert_array_equal(again.commanded.quaternion, log.commanded.quaternion)
    for name in ("length_deviation", "tension_deviation", "position_deviation", "rotation_deviation", "target"):
        np.testing.assert_array_equal(getattr(again.sensors, name), getattr(SENSORS, name))
    np.testing.assert_array_equal(again.sensors.frame.position, SENSORS.frame.position)
    np.testing.assert_array_equal(again.sensors.frame.quaternion, SENSORS.frame.quaternion)
    assert again.source == str(tmp_path / "log.csv")
    assert _dump_log(again) == (tmp_path / "log.csv").read_text()


WHOLE = """\
# Winches of the shelf, read by hand: a comment of a person.
# name: shelf
# length_deviation: 0.4 mm
# tension_deviation: [5, 0.006 kN]
#position_deviation: [1 mm, 0.001, 2 mm]
# frame: {position: [1, 0, 500 mm], euler: {alpha: 90 deg}}
# target: [0, 0, 0.1]
# rotation_deviation: 0.1 deg

"load_cell_0 [kN]",length_1 [mm],length_0,z [mm],alpha [deg],beta,gamma,x_commanded,y_commanded [mm],z_commanded
0.41,2001.5,3,1012.5,90,0,0,1,2500,3

 ,2002,3.5,,,,,1,2500,3
0.43,,nan,1013, , ,,1,2500,3.5
"""


def test_columns_in_any_order_with_units_and_gaps(tmp_path: Path) -> None:
    log = read(tmp_path, WHOLE)
    nan = np.nan
    assert log.counts is None
    assert log.time is None
    sensors, lengths, turned = log.sensors, log.unstrained_length, log.rotation
    assert lengths is not None
    assert log.position is not None
    assert turned is not None
    assert sensors.rotation_deviation is not None
    np.testing.assert_allclose(lengths, [[3.0, 2.0015], [3.5, 2.002], [nan, nan]], rtol=1e-15)
    np.testing.assert_array_equal(log.load_cells, [[410.0, nan], [nan, nan], [430.0, nan]])
    np.testing.assert_allclose(log.position, [[nan, nan, 1.0125], [nan] * 3, [nan, nan, 1.013]], rtol=1e-15)
    np.testing.assert_allclose(turned, [[0, 0, 0.5**0.5, 0.5**0.5], [nan] * 4, [nan] * 4], atol=1e-15)
    assert log.commanded is not None
    np.testing.assert_array_equal(log.commanded.position, [[1, 2.5, 3], [1, 2.5, 3], [1, 2.5, 3.5]])
    np.testing.assert_array_equal(log.commanded.quaternion, [[0, 0, 0, 1]] * 3)
    assert float(sensors.length_deviation) == 0.4e-3
    np.testing.assert_array_equal(sensors.tension_deviation, [5.0, 6.0])
    np.testing.assert_array_equal(sensors.position_deviation, [1e-3, 1e-3, 2e-3])
    np.testing.assert_allclose(sensors.rotation_deviation, np.pi / 1800, rtol=1e-15)
    np.testing.assert_allclose(sensors.frame.matrix @ [1, 0, 0], [0, 1, 0], atol=1e-15)
    np.testing.assert_array_equal(sensors.frame.position, [1, 0, 0.5])
    np.testing.assert_array_equal(sensors.target, [0, 0, 0.1])


def test_given_sensors_replace_those_of_the_comments(tmp_path: Path) -> None:
    given = sl.Sensors(tension_deviation=1.0, position_deviation=1.0, rotation_deviation=1.0)
    assert read(tmp_path, WHOLE, given).sensors is given
    with refused("sensors: tension_deviation", "of shape (3,)", kind=sl.InvalidValueError):
        read(tmp_path, WHOLE, given.replace(tension_deviation=np.ones(3)))
    with refused("sensors", kind=sl.InvalidValueError):
        read(tmp_path, WHOLE, 5.0)  # type: ignore[arg-type]


def test_a_log_with_only_counts_needs_no_comment(tmp_path: Path) -> None:
    log = read(tmp_path, "count_0,count_1,time [ms]\n1,2,0\n-3,4.5,500\r\n")
    np.testing.assert_array_equal(log.counts, [[1, 2], [-3, 4.5]])
    np.testing.assert_array_equal(log.time, [0.0, 0.5])
    assert float(log.sensors.length_deviation) == 5e-4


ROWS = "length_0,length_1,load_cell_0\n3,2,40\n3,2,41\n"
CELLS = "# tension_deviation: 5\n"
COMMANDED = "length_0,x_commanded,y_commanded,z_commanded"


@pytest.mark.parametrize(
    ("text", "parts"),
    [
        (
            ROWS,
            (
                "tension_deviation",
                "does not give the tension_deviation of a sensor with readings",
                None,
                (
                    "Write a comment above the columns, for instance '# tension_deviation: "
                    "5 N', or give sensors (--tension-deviation)."
                ),
            ),
        ),
        ("length_0,z\n3,1\n", ("position_deviation", "does not give the position_deviation of a sensor with readings")),
        (
            "length_0,alpha,beta,gamma\n3,1,0,0\n",
            ("rotation_deviation", "does not give the rotation_deviation of a sensor with readings"),
        ),
        ("# length_deviation: 1\n", ("columns",)),
        ("load_cell_0\n1\n", ("line 1", "neither columns count_0, ... nor length_0, ...", "one of the two")),
        ("length_0,count_0\n1,1\n", ("line 1", "columns of counts and of lengths", "one of the two")),
        ("length_0,length_2\n1,1\n", ("line 1", "missing column length_1; the last is length_2")),
        ("count_1,count_2\n1,1\n", ("line 1", "missing column count_0; the last is count_2")),
        ("count_9999\n1\n", ("line 1", "unknown column 'count_9999' (did you mean count_999?)")),
        ("count_99999999999\n1\n", ("line 1", "unknown column 'count_99999999999'")),
        ("L0,length_0\n1,1\n", ("line 1", "column length_0 is given twice", "once")),
        ("count_0,C0\n1,1\n", ("line 1", "column count_0 is given twice")),
        ("count_0,load_cell_1\n1,1\n", ("line 1", "unknown column 'load_cell_1' (did you mean load_cell_0?)")),
        ("count_0,load_cel_0\n1,1\n", ("line 1", "unknown column 'load_cel_0' (did you mean load_cell_0?)")),
        ("count_0;count_1\n1;2,x\n", ("line 2", "count_1 is 2,x", "a number")),
        ("count_0\n", ("line 1", "no rows below the names of the columns")),
        ("count_0,count_1\n# time: 5\n1,2\n", ("line 2", "a comment", "comments above the names of the columns")),
        ("# a word\n\ncount_0 [mm]\n1\n", ("line 3", "the unit of count_0 is [mm]", "none")),
        ("length_0 [N]\n1\n", ("line 1", "the unit of length_0 is [N]")),
        ("length_0\n1\ninf\n", ("line 3", "length_0 is inf m", "a finite number")),
        ("length_0\n1\n1e60\n", ("line 3", "length_0 is 1e+60 m")),
        ("length_0\n1\ntwo\n", ("line 3", "length_0 is two", "a number")),
        ("length_0,length_1\n1,2\n1,2,3\n", ("line 3", "3 columns", "2, as in the header")),
        ("time,length_0\n0,1\n,2\n", ("line 3", "time is empty", "a number")),
        ("time,length_0\n0,1\nnan,2\n", ("line 3", "time is nan s", "a finite number")),
        (f"{COMMANDED}\n1,1,1,1\n1,1,,1\n", ("line 3", "y_commanded is empty")),
        ("length_0,x_commanded\n1,1\n", ("line 1", "missing column y_commanded, z_commanded beside x_commanded")),
        (
            "length_0,alpha_commanded,beta_commanded,gamma_commanded\n1,1,1,1\n",
            ("line 1", "missing column x_commanded beside commanded rotations"),
        ),
        ("length_0,qx,qy,qz\n1,0,0,0\n", ("line 1", "missing column qw beside qx, qy, qz")),
        (
            "length_0,qx,qy,qz,qw\n1,0,0,0,1\n1,0,0,0,\n",
            ("line 3", "one of qx, qy, qz, qw is nan", "all of them, or blanks in all"),
        ),
        ("length_0,qx,qy,qz,qw\n1,0,0,1,1\n", ("line 2", "the length of qx, qy, qz, qw is 1.41421356237")),
        ("length_0,qx,qy,qz,qw,alpha,beta,gamma\n1,0,0,1,1,0,0,0\n", ("line 1", "columns alpha beside qx", "one way")),
        (
            "# lenght_deviation: 1 mm\n" + ROWS,
            ("lenght_deviation", "an unknown key", None, "Did you mean length_deviation?"),
        ),
        (
            "# length deviation: 1 mm\n" + ROWS,
            ("length deviation", "an unknown key", None, "Did you mean length_deviation?"),
        ),
        ("# targets: 1 mm\n" + ROWS, ("targets", "an unknown key", None, "Did you mean target?")),
        (
            "# tension_deviation: 5 m\n" + ROWS,
            ("tension_deviation", "'5 m'", 'a number in N, or text with a unit that converts to it, such as "1.5 N"'),
        ),
        ("# tension_deviation: -5\n" + ROWS, ("tension_deviation", "-5 N", "> 0 N, finite")),
        (
            "# tension_deviation: [1, 2, 3]\n" + ROWS,
            ("sensors: tension_deviation", "of shape (3,)", "shape () or (2,)"),
        ),
        ("# tension_deviation: [1, 2\n" + ROWS, ("line 1",)),
        (CELLS + CELLS + ROWS, ("line 2", "line 2: key tension_deviation is given twice")),
        (CELLS + "# frame: [0, 0, 0]\n" + ROWS, ("frame", "[0, 0, 0]", "keys position, euler, quaternion")),
        (CELLS + "# frame: {position: [0, 0]}\n" + ROWS, ("frame.position", "of shape (2,)")),
        (CELLS + "# target: [0, 0]\n" + ROWS, ("target", "of shape (2,)", "shape (3,)")),
    ],
)
def test_errors_are_reported_with_line_or_key(text: str, parts: tuple[str, ...], tmp_path: Path) -> None:
    with refused(*parts, kind=sl.FileError, file=tmp_path / "log.csv") as caught:
        read(tmp_path, text)
    assert len(str(caught.value)) < 300


def test_a_log_is_written_atomically(tmp_path: Path, snapshot: SnapshotAssertion) -> None:
    log = sl.WinchLog(counts=[[1.0]])
    (tmp_path / "taken").mkdir()
    for place in (tmp_path / "taken", tmp_path / "none" / "log.csv"):
        with refused(kind=sl.FileError, file=place) as caught:
            log.save(place)
        assert wording(caught.value, tmp_path) == snapshot
    with refused("log", kind=sl.InvalidValueError):
        _dump_log("a log")  # type: ignore[arg-type]
    odd: Any = sl.WinchLog(counts=[[-0.0, 1e-300, 1 / 3]])
    odd.save(tmp_path / "odd.csv")
    again = sl.load_log(tmp_path / "odd.csv").counts
    assert again is not None
    assert again.tobytes() == odd.counts.tobytes()


def test_quaternions_with_few_decimals_are_normalized(tmp_path: Path) -> None:
    comment = "# rotation_deviation: 0.1 deg\n"
    turned = read(tmp_path, f"{comment}length_0,qx,qy,qz,qw\n1,0.5001,0.5,0.5,0.5\n").rotation
    assert turned is not None
    given = np.array([[0.5001, 0.5, 0.5, 0.5]])
    np.testing.assert_allclose(turned, given / np.linalg.norm(given), rtol=1e-14)


@pytest.mark.parametrize(
    "text",
    [
        "time [s];L0 [mm];length_1;load_cell_1\n0;2500,5;2,5e0;100\n1,5;2600;2,75;\n",
        "time [s]\tlength_0 [mm]\tL1\tload_cell_1\n0\t2500.5\t2.5\t1e2\n1.5\t2600\t2,75\t\n",
        "time [s],length_0 [mm],length_1,load_cell_1\n0,2500.5,2.5,100\n1.5,2600,2.75,\n",
    ],
)
def test_semicolons_tabs_decimal_commas_and_short_names_are_read(tmp_path: Path, text: str) -> None:
    file = tmp_path / "own.csv"
    file.write_text("# tension_deviation: 5 N\n" + text, encoding="utf-8")
    log = sl.load_log(file)
    assert log.unstrained_length is not None
    assert log.load_cells is not None
    assert log.time is not None
    np.testing.assert_array_equal(log.unstrained_length, [[2.5005, 2.5], [2.6, 2.75]])
    np.testing.assert_array_equal(log.load_cells, [[np.nan, 100.0], [np.nan, np.nan]])
    np.testing.assert_array_equal(log.time, [0.0, 1.5])


def test_pitch_and_roll_without_yaw_are_inclinations(tmp_path: Path) -> None:
    comment = "# rotation_deviation: 0.1 deg\n"
    log = read(tmp_path, f"{comment}length_0,beta [deg],gamma [deg]\n1,30,20\n2,,\n")
    assert "1 measured inclination" in str(log)
    turned, deviation = log.rotation, log.sensors.rotation_deviation
    assert turned is not None
    assert deviation is not None
    down = Rotation.from_quat(turned[0]).as_matrix()[2]
    pitch, roll = np.radians([30, 20])
    wanted = [-np.sin(pitch), np.cos(pitch) * np.sin(roll), np.cos(pitch) * np.cos(roll)]
    np.testing.assert_allclose(down, wanted, atol=1e-15)
    assert np.isnan(turned[1]).all()
    np.testing.assert_allclose(deviation, [np.pi / 1800, np.pi / 1800, np.inf])
    log.save(tmp_path / "again.csv")
    again = sl.load_log(tmp_path / "again.csv")
    np.testing.assert_array_equal(again.sensors.rotation_deviation, deviation)
    assert again.rotation is not None
    np.testing.assert_allclose(again.rotation, turned, rtol=1e-15)
    with refused(kind=sl.FileError) as caught:
        read(tmp_path, f"{comment}length_0,beta\n1,0.1\n")
    assert "alpha, gamma" in str(caught.value)
