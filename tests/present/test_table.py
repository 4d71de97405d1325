"""Tables of results: the numbers of the result to the last bit, units in the header, and NaN as an empty cell."""

from __future__ import annotations

import csv
import sys
from collections.abc import Callable
from io import StringIO
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import sagline as sl
from tests.refusal import refused

ROBOT = sl.load_robot("article-suspended")
HERE = (1.0, 1.0, 1.5)
POSES = [HERE, (30.0, 0.0, 1.0), (0.0, 0.0, 1.0)]
PLAN = sl.inverse(ROBOT, POSES)
ONE = sl.inverse(ROBOT, HERE)
PATH = sl.quintic_path([(0, 0, 1.5), (1, 1, 2)], speed=1.5, rate=10.0)
LOG = sl.WinchLog(
    unstrained_length=np.full((2, 2), 3.0),
    load_cells=[[80.0, np.nan], [70.0, 75.0]],
    time=[0.0, 1.0],
    commanded=sl.Pose([HERE, HERE]),
    sensors=sl.Sensors(tension_deviation=1.0),
)
RESULTS: dict[str, tuple[Callable[[], Any], int, dict[str, str]]] = {  # result, rows, some units
    "plan": (lambda: PLAN, 3, {"x": "m", "L7": "m", "T0": "N", "qw": "", "status": ""}),
    "plan of a path": (lambda: sl.inverse(ROBOT, PATH), len(PATH), {"time": "s"}),
    "equilibrium": (lambda: ONE.state, 1, {"T7": "N"}),
    "path": (lambda: PATH, len(PATH), {"vx": "m/s", "wz": "rad/s"}),
    "forward": (lambda: sl.forward(ROBOT, ONE.unstrained_length), 1, {"force_residual": "N", "moment_residual": "N m"}),
    "confirmation": (lambda: sl.confirm(PLAN), 3, {"error_z": "m", "rotation_error": "rad"}),
    "simulation": (lambda: sl.simulate(ONE, duration=0.05), 6, {"time": "s", "T3": "N", "L3": "m"}),
    "vibration": (lambda: sl.vibration(ONE, up_to=2.0), 5, {"frequency": "Hz", "loss": ""}),
    "modes": (lambda: sl.modes(PLAN), 3, {"f5": "Hz"}),
    "map": (lambda: sl.frequency_map(ROBOT, [HERE, HERE], up_to=3.0), 2, {"peak": "m/N"}),
    "margin": (lambda: sl.margin(ROBOT, POSES), 3, {"value": "N"}),
    "polygon": (lambda: sl.tension_polygon(ROBOT, HERE), 4, {"T0": "N"}),
    "clearances": (lambda: sl.clearance(PLAN), 3, {"distance": "m", "low": "m", "d0": "m"}),
    "log": (lambda: LOG, 2, {"time": "s", "length_1": "m", "load_cell_0": "N", "x_commanded": "m"}),
    "equilibria": (lambda: sl.equilibria(ROBOT, ONE.unstrained_length, starts=3), 1, {"stiffness_min": "N/m"}),
}


@pytest.mark.parametrize("name", RESULTS)
def test_every_result_with_rows_is_a_table(name: str) -> None:
    make, rows, units = RESULTS[name]
    result = make()
    table = result.table()
    assert len(table) == rows
    assert {column: table.units[column] for column in units} == units
    frame = result.to_dataframe()
    assert list(frame.columns) == list(table.columns)
    assert frame.attrs["units"] == dict(table.units)
    assert rows in result.to_xarray().sizes.values() or rows == 1
    text = repr(table).splitlines()
    assert len(text) <= 12
    assert max(map(len, text)) <= 80


def test_the_table_of_a_plan_has_its_numbers() -> None:
    head, *body = csv.reader(StringIO(PLAN.to_csv()))
    assert [head[k] for k in (0, 3, 7, 15, 23)] == ["x [m]", "qx", "L0 [m]", "T0 [N]", "status"]
    read = np.array([[float(cell) if cell else np.nan for cell in row[:-1]] for row in body])
    pose = PLAN.state.pose
    expected = np.hstack((pose.position, pose.quaternion, PLAN.unstrained_length, PLAN.chord_tension))
    np.testing.assert_array_equal(read, expected)
    assert [row[-1] for row in body] == [sl.PoseStatus(code).name for code in PLAN.status]
    assert body[1][7] == ""  # infeasible: no length
    np.testing.assert_array_equal(PLAN.table()["T3"], PLAN.chord_tension[:, 3])


def test_parts_of_vectors_are_at_their_places() -> None:
    confirmed, moved = sl.confirm(sl.inverse(ROBOT, PATH, "elastic")), sl.margin(ROBOT, POSES)
    np.testing.assert_array_equal(confirmed.table()["error_z"], confirmed.position_error[:, 2])
    np.testing.assert_array_equal(PATH.table()["wy"], PATH.twist[:, 4])
    np.testing.assert_array_equal(moved.table()["value"], moved.value)


def test_a_table_is_written_to_a_file(tmp_path: Path) -> None:
    file = tmp_path / "plan.csv"
    assert PLAN.to_csv(file) is None
    assert file.read_text(encoding="utf-8") == PLAN.to_csv()
    with refused(kind=sl.FileError):
        PLAN.to_csv(tmp_path)


def test_the_data_set_of_a_plan_is_that_of_its_file(tmp_path: Path) -> None:
    data = PLAN.to_xarray()
    assert data["chord_tension"].dims == ("pose", "cable")
    assert data["chord_tension"].attrs["units"] == "N"
    np.testing.assert_array_equal(data["chord_tension"].values, PLAN.chord_tension)
    assert ONE.state.to_xarray()["T0"].attrs["units"] == "N"


def test_data_frames_need_pandas(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pandas", None)
    with refused(kind=sl.FileError) as caught:
        PLAN.to_dataframe()
    assert "install pandas" in str(caught.value)
