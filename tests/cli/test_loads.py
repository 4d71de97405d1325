"""Wrenches, payloads, lengths and tables as inputs and outputs of the commands."""

from __future__ import annotations

import csv
import json
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

import sagline as sl
from sagline.cli.main import app
from tests.tiers import extended

SHORT = "durations: 2\nrate: 5\nwaypoints: [{position: [0, 0, 1.5]}, {position: [1, 0.5, 1.5]}]\n"
FAR = SHORT.replace("[1, 0.5, 1.5]", "[7.2, 3, 1.5]")
WRENCH = np.array([20.0, -10.0, -60.0, 1.0, 2.0, -3.0])
LOADS = ("--wrench", "20,-10,-60,1,2,-3", "--payload", "5 kg")


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "short.yaml").write_text(SHORT)
    (tmp_path / "far.yaml").write_text(FAR)
    return tmp_path


def sagline(*words: str) -> Any:
    return CliRunner().invoke(app, words)


def loaded() -> sl.Robot:
    """The robot with an additional mass of five kilograms."""
    robot = sl.load_robot("article-suspended")
    return robot.replace(mass=55.0, inertia=robot.inertia * 1.1)


def test_track_takes_a_wrench_and_a_payload() -> None:
    result = sagline("track", "article-suspended", "short.yaml", "--no-figures", *LOADS)
    assert result.exit_code == 0, result.output
    plan = sl.load_plan("output/article-suspended-catenary.nc")
    expected = sl.inverse(loaded(), sl.load_path("short.yaml"), wrench=WRENCH)
    np.testing.assert_array_equal(plan.unstrained_length, expected.unstrained_length)
    plain = sl.inverse(sl.load_robot("article-suspended"), sl.load_path("short.yaml"))
    assert np.abs(plan.unstrained_length - plain.unstrained_length).max() > 1e-4
    assert plan.state.one_robot.mass == 55.0


def test_forward_takes_a_wrench_and_a_payload() -> None:
    pose = sl.Pose([[0.5, 0.2, 2.0]], [np.eye(3)])
    plan = sl.inverse(loaded(), pose, wrench=WRENCH)
    Path("lengths.csv").write_text(
        ",".join(f"L{k}" for k in range(8)) + "\n" + ",".join(map(repr, plan.unstrained_length[0].tolist())) + "\n"
    )
    found = json.loads(sagline("forward", "article-suspended", "lengths.csv", "--json", *LOADS).stdout)["poses"][0]
    np.testing.assert_allclose([found[axis] for axis in "xyz"], [0.5, 0.2, 2.0], atol=1e-9)
    other = json.loads(sagline("forward", "article-suspended", "lengths.csv", "--json").stdout)["poses"][0]
    assert abs(other["z"] - 2.0) > 1e-4


def test_tension_takes_a_wrench_and_a_payload() -> None:
    words = ("tension", "article-suspended", "--pose", "0.5,0.2,2", "--no-figures", "--json")
    found = json.loads(sagline(*words, *LOADS).stdout)["tensions"]["MinimumNorm"]["chord_tension"]
    plan = sl.inverse(loaded(), sl.Pose([0.5, 0.2, 2.0], np.eye(3)), tension=sl.MinimumNorm(), wrench=WRENCH)
    np.testing.assert_allclose(found, plan.chord_tension, rtol=1e-12)
    force = json.loads(sagline(*words, "--wrench", "20,-10,-60").stdout)["tensions"]["MinimumNorm"]["chord_tension"]
    alone = sl.inverse(
        sl.load_robot("article-suspended"), plan.state.pose, tension=sl.MinimumNorm(), wrench=[20, -10, -60, 0, 0, 0]
    )
    np.testing.assert_allclose(force, alone.chord_tension, rtol=1e-12)


def test_the_viewer_takes_a_wrench_and_a_payload(monkeypatch: pytest.MonkeyPatch) -> None:
    taken: list[Any] = []

    class Page:
        def __init__(self, server: Any, features: Any, robot: sl.Robot, *, wrench: Any, **page: Any) -> None:
            taken.append((robot, wrench))

        def serve(self) -> None:
            raise KeyboardInterrupt

    server = SimpleNamespace(stop=int, url="", access=SimpleNamespace(local=True))
    monkeypatch.setattr("sagline.viewer.server.start_server", lambda *_, **__: server)
    monkeypatch.setattr("sagline.viewer.page.Page", Page)
    assert sagline("view", "article-suspended", "--no-browser", *LOADS).exit_code == 0
    (robot, wrench) = taken[0]
    assert robot.mass == 55.0
    np.testing.assert_allclose(robot.inertia, loaded().inertia)
    np.testing.assert_array_equal(wrench, WRENCH)


@extended
def test_forward_of_planned_lengths_gives_the_path() -> None:
    assert sagline("track", "article-suspended", "short.yaml", "--no-figures").exit_code == 0
    assert sagline("lengths", "output/article-suspended-catenary.nc", "--out", "lengths.csv").exit_code == 0
    printed = sagline("lengths", "output/article-suspended-catenary.nc").stdout
    assert printed == Path("lengths.csv").read_text()
    plan = sl.load_plan("output/article-suspended-catenary.nc")
    rows = np.array([[float(cell) for cell in row] for row in list(csv.reader(printed.splitlines()))[1:]])
    assert plan.path is not None
    np.testing.assert_array_equal(rows[:, 0], plan.path.time)  # equal to the last bit
    np.testing.assert_array_equal(rows[:, 1:], plan.unstrained_length)
    found = json.loads(sagline("forward", "article-suspended", "lengths.csv", "--json").stdout)["poses"]
    assert len(found) == len(plan.path)
    np.testing.assert_allclose(  # at rest at both ends, without inertia
        [[found[k][axis] for axis in "xyz"] for k in (0, -1)], [[0.0, 0.0, 1.5], [1.0, 0.5, 1.5]], atol=1e-9
    )


@extended
def test_lengths_of_infeasible_samples_are_omitted_and_counted() -> None:
    assert sagline("track", "article-suspended", "far.yaml", "--no-figures").exit_code == 1
    result = sagline("lengths", "output/article-suspended-catenary.nc")
    plan = sl.load_plan("output/article-suspended-catenary.nc")
    lost = int(np.sum(~plan.feasible))
    assert 0 < lost < plan.feasible.size
    assert result.exit_code == 1
    assert f" {lost} of {plan.feasible.size} " in result.stderr
    assert len(result.stdout.splitlines()) == 1 + plan.feasible.size - lost


@extended
def test_a_run_without_a_single_length_is_refused() -> None:
    poses = sl.Pose([[7.4, 5.4, 0.1]] * 2, [np.eye(3)] * 2)
    sl.inverse(sl.load_robot("article-suspended"), poses).save("run.nc")
    result = sagline("lengths", "run.nc", "--out", "lengths.csv")
    assert (result.exit_code, Path("lengths.csv").exists()) == (2, False)
    assert sagline("lengths", "run.nc", "--out", "run.nc").exit_code == 2


@extended
def test_track_writes_the_whole_plan_as_csv() -> None:
    assert sagline("track", "article-suspended", "far.yaml", "--no-figures", "--csv").exit_code == 1
    plan = sl.load_plan("output/article-suspended-catenary.nc")
    with open("output/article-suspended-catenary.csv", newline="") as stream:
        rows = list(csv.DictReader(stream))
    assert plan.path is not None
    assert len(rows) == len(plan.path)
    for k, row in enumerate(rows):
        assert float(row["time [s]"]) == plan.path.time[k]
        assert [float(row[f"{axis} [m]"]) for axis in "xyz"] == plan.state.pose.position[k].tolist()
        assert [float(row[f"q{axis}"]) for axis in "xyzw"] == plan.state.pose.quaternion[k].tolist()
        assert row["status"] == sl.PoseStatus(int(plan.status[k])).name
        for name, values in (("L{} [m]", plan.unstrained_length), ("T{} [N]", plan.chord_tension)):
            texts = [row[name.format(j)] for j in range(8)]
            if plan.feasible[k]:
                assert [float(text) for text in texts] == values[k].tolist()
            elif np.isnan(values[k]).all():
                assert texts == [""] * 8
