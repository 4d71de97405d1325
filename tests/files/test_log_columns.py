"""Logs with other names: one log, written in several forms with a map of columns, is read with the same numbers."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from scipy.io import savemat

import sagline as sl
from sagline.core.arrays import Array
from tests.calibration.synthetic import log_of, true_robot, usual_sensors

ORDER = (2, 0, 1, 3, 7, 6, 5, 4)  # column of each cable in the file
FIELDS = ("unstrained_length", "load_cells", "position", "time")
MAP = """\
columns:
  time: {{name: {time}, unit: ms}}
  length: {{name: "{length}", unit: mm, scale: -1, cables: {cables}}}
  load_cell: {{name: "{cell}", unit: kN, cables: {cables}}}
  {position}
length_deviation: 0.5 mm
tension_deviation: 7 N
position_deviation: 2 mm
"""
MATRIX = "position: {name: mocap, unit: mm}"
THREE = "x: {name: mocap x, unit: mm}\n  y: {name: mocap y, unit: mm}\n  z: {name: mocap z, unit: mm}"


@pytest.fixture
def log() -> sl.WinchLog:
    """A log with a load cell without a reading and a position without a reading."""
    found = log_of(
        true_robot(sl.load_robot("cogiro"), seed=2, sensors=usual_sensors(position_deviation=1e-3)),
        6,
        seed=2,
        positions=6,
    ).log
    assert found.load_cells is not None
    assert found.position is not None
    cells, position = found.load_cells.copy(), found.position.copy()
    cells[4, 3] = position[2, 1] = np.nan
    return found.replace(load_cells=cells, position=position, commanded=None, time=np.arange(6.0))


def foreign(log: sl.WinchLog) -> dict[str, Array]:
    """Arrays of a log in other units, with another sign and with another order of the cables."""
    assert log.unstrained_length is not None
    assert log.load_cells is not None
    assert log.position is not None
    assert log.time is not None
    back = np.argsort(ORDER)
    return {
        "t": 1e3 * log.time,
        "lengths": -1e3 * log.unstrained_length[:, back],
        "force": 1e-3 * log.load_cells[:, back],
        "mocap": 1e3 * log.position,
    }


def as_npz(folder: Path, log: sl.WinchLog) -> tuple[Path, str]:
    np.savez(folder / "log.npz", note=np.array(["text"]), **foreign(log))  # type: ignore[arg-type]
    return folder / "log.npz", MAP.format(time="t", length="lengths", cell="force", cables=[*ORDER], position=MATRIX)


def as_mat(folder: Path, log: sl.WinchLog) -> tuple[Path, str]:
    arrays = foreign(log)
    savemat(folder / "log.mat", {"run": arrays | {"t": arrays["t"][:, None]}, "author": "text"})
    position = MATRIX.replace("mocap", "run.mocap")
    names = {"time": "run.t", "length": "run.lengths", "cell": "run.force"}
    return folder / "log.mat", MAP.format(**names, cables=[*ORDER], position=position)


def as_csv(folder: Path, log: sl.WinchLog) -> tuple[Path, str]:
    """Semicolons, decimal commas, a column of text, comments, and cables that are counted from 1."""
    arrays = foreign(log)
    head = [
        "t",
        "note",
        *(f"len{k + 1}" for k in range(8)),
        *(f"F{k + 1}" for k in range(8)),
        *map("mocap {}".format, "xyz"),
    ]
    table = np.column_stack([arrays["t"], arrays["lengths"], arrays["force"], arrays["mocap"]]).tolist()
    rows = [[("" if x != x else repr(x)).replace(".", ",") for x in row] for row in table]
    lines = ["# written by another program", ";".join(head), *(";".join([row[0], "rest", *row[1:]]) for row in rows)]
    (folder / "log.csv").write_text("\n".join(lines))
    cables = [k + 1 for k in ORDER]
    return folder / "log.csv", MAP.format(time="t", length="len{}", cell="F{}", cables=cables, position=THREE)


def as_long_csv(folder: Path, log: sl.WinchLog) -> tuple[Path, str]:
    """One row per cable; the cables of a pose are in any order."""
    arrays, rng = foreign(log), np.random.default_rng(0)
    lines = ["t,motor,length [mm],force,mocap x,mocap y,mocap z"]
    for row in range(6):
        for k in rng.permutation(8).tolist():
            numbers = [arrays["t"][row], k, arrays["lengths"][row, k], arrays["force"][row, k], *arrays["mocap"][row]]
            lines.append(",".join("" if x != x else repr(float(x)) for x in numbers))
    (folder / "long.csv").write_text("\n".join(lines))
    text = MAP.format(time="t", length="length", cell="force", cables=[*ORDER], position=THREE)
    return folder / "long.csv", text.replace(", unit: mm, scale", ", scale").replace(
        "columns:", "columns:\n  cable: motor"
    )


@pytest.mark.parametrize("write", [as_npz, as_mat, as_csv, as_long_csv])
def test_a_map_of_columns_restores_the_log(
    write: Callable[[Path, sl.WinchLog], tuple[Path, str]], log: sl.WinchLog, tmp_path: Path
) -> None:
    file, text = write(tmp_path, log)
    (tmp_path / "map.yaml").write_text(text)
    found = sl.load_log(file, columns=tmp_path / "map.yaml")
    for name in FIELDS:
        np.testing.assert_allclose(getattr(found, name), getattr(log, name), rtol=1e-15, err_msg=name)
    assert found.sensors.tension_deviation == 7.0
    assert found.sensors.position_deviation == 2e-3
    assert sl.load_log(file, log.sensors, tmp_path / "map.yaml").sensors is log.sensors


def test_arrays_with_the_names_of_a_log_need_no_map(log: sl.WinchLog, tmp_path: Path) -> None:
    assert log.unstrained_length is not None
    assert log.load_cells is not None
    assert log.position is not None
    np.savez(tmp_path / "log.npz", length=log.unstrained_length, load_cell=log.load_cells, position=log.position)
    found = sl.load_log(tmp_path / "log.npz", log.sensors)
    for name in FIELDS[:3]:
        np.testing.assert_array_equal(getattr(found, name), getattr(log, name))


LONG = "t,motor,length\n0,1,2.5\n0,2,2.6\n1,1,2.4\n1,2,2.7\n"
WIDE = "t,a1,a2,n\n0,2.5,2.6,ok\n1,2.4,x,ok\n"


@pytest.mark.parametrize(
    ("text", "columns", "item", "parts"),
    [
        (WIDE, "{length: a}", "columns.length", ["a[0]", "cables: "]),
        (WIDE, '{length: {name: "a{}", cables: [1, 3]}}', "columns.length", ["a3"]),
        (WIDE, '{length: {name: "a{}", cables: [1, 2]}}', "line 3", ["length_1 is x", "a number"]),
        (WIDE, "{lenght: a1}", "columns.lenght", ["length?"]),
        (WIDE, "{length_0: {name: a1, unity: mm}}", "columns.length_0.unity", ["unit?"]),
        (WIDE, "{length_0: {name: a1, unit: kg}}", "line 1", ["[kg]", "converts to m"]),
        (WIDE, "{length_0: {name: a1, scale: two}}", "columns.length_0.scale.int", ["'two'"]),
        (WIDE, "[length]", "columns", ["a mapping"]),
        (LONG, "{cable: motor, length: length}", "columns.pose", ["pose or time"]),
        (LONG, "{cable: motor, pose: p, length: length}", "columns", ["'p'", "motor"]),
        (LONG + "1,2,2.8\n", "{cable: motor, time: t, length: length}", "line 6", ["cable 2 is given twice"]),
        (LONG.replace("1,2,", "1,b,"), "{cable: motor, time: t, length: length}", "line 5", ["motor is b", "whole"]),
        (LONG + "2,1\n", "{cable: motor, time: t, length: length}", "line 6", ["2 columns", "3"]),
        ("", "{length: a}", "columns", ["no rows"]),
    ],
)
def test_faults_of_map_and_file_are_named(text: str, columns: str, item: str, parts: list[str], tmp_path: Path) -> None:
    (tmp_path / "log.csv").write_text(text)
    (tmp_path / "map.yaml").write_text(f"columns: {columns}\n")
    with pytest.raises(sl.FileError) as refused:
        sl.load_log(tmp_path / "log.csv", columns=tmp_path / "map.yaml")
    assert refused.value.item == item
    assert [part for part in parts if part not in str(refused.value)] == []


@pytest.mark.parametrize(
    ("name", "data", "part"),
    [
        ("log.npz", b"PK\x03\x04", "not an .npz file"),
        ("log.npz", b"", "not an .npz file"),
        ("log.mat", b"MATLAB 7.3 MAT-file", "not a .mat file"),
        ("log.mat", b"MATLAB 7.3 MAT-file".ljust(124) + b"\x00\x02IM" + bytes(400), "version 7.3"),
    ],
)
def test_damaged_array_files_are_refused(name: str, data: bytes, part: str, tmp_path: Path) -> None:
    (tmp_path / name).write_bytes(data)
    with pytest.raises(sl.FileError, match=part):
        sl.load_log(tmp_path / name)


def test_arrays_of_different_lengths_are_refused_with_their_lengths(tmp_path: Path) -> None:
    np.savez(tmp_path / "log.npz", length=np.ones((5, 2)), time=np.arange(4.0))
    with pytest.raises(sl.FileError, match=r"length_0 5.*time 4"):
        sl.load_log(tmp_path / "log.npz")
