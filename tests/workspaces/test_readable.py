"""Interactive sessions show each result on workspaces in one line."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from syrupy.assertion import SnapshotAssertion

import sagline as sl
from sagline.workspaces.proof import Prover
from tests.tiers import extended

POSE = sl.Pose([[0.0, 0.0, 2.0], [1.0, 1.0, 3.0], [7.0, 5.4, 5.9]], np.eye(3))
BOX = sl.PoseBox([-2.0, -1.0, 1.0], [2.0, 1.0, 3.0])


@pytest.fixture(scope="module")
def robot() -> sl.Robot:
    return sl.load_robot("article-suspended")


def test_each_result_is_shown_in_a_line(robot: sl.Robot) -> None:
    loads = sl.WrenchBox(force=100.0, moment=20.0)
    space = sl.workspace(robot, BOX, loads, cells=4)
    empty = sl.workspace(robot, BOX, sl.WrenchBox(1e5), cells=4)
    state = sl.inverse(robot, POSE).state
    shown = [
        loads, loads + sl.Accelerations(1.0), space, space.components, space.surface, empty, empty.components,
        empty.surface, empty.nearest, sl.margin(robot, POSE, loads), sl.margin(robot, sl.Pose([0, 0, 2.0], np.eye(3))),
        sl.clearance(state), sl.sweep.Request(robot, POSE),
        sl.Mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]),
    ]  # fmt: skip
    for one in shown:
        assert_in_a_line(one)


@extended
def test_a_proof_is_shown_in_a_line(robot: sl.Robot) -> None:
    assert_in_a_line(sl.prove(robot, BOX, sl.WrenchBox(force=100.0, moment=20.0), budget=0.1))


def assert_in_a_line(one: object) -> None:
    text = repr(one)
    assert text.startswith(f"<{type(one).__name__}: "), text
    assert text.endswith(">")
    assert "\n" not in text
    assert "array" not in text
    assert len(text) < 250, text
    assert "Error" not in str(one)


def test_loads_are_shown_by_their_sizes(snapshot: SnapshotAssertion) -> None:
    assert repr(sl.WrenchBox(100.0, 20.0)).replace("\N{NO-BREAK SPACE}", " ") == "<WrenchBox: ±100 N, ±20 N m>"
    both = sl.WrenchPolytope([[0, 0, -9, 0, 0, 0]]) + sl.WrenchPolytope(np.eye(6)) + sl.WrenchEllipsoid(1.0)
    assert str(both).replace("\N{NO-BREAK SPACE}", " ") == snapshot


def test_margins_are_counted_by_their_status(robot: sl.Robot) -> None:
    many = sl.margin(robot, POSE, sl.WrenchBox(100.0))
    words = str(many)
    assert words.startswith("3 poses, ")
    for status in sl.MarginStatus:
        count = int((many.status == status).sum())
        assert (f"{count} {status.name}" in words) == bool(count)
    one = str(sl.margin(robot, sl.Pose([0, 0, 2.0], np.eye(3))))
    assert "FEASIBLE" in one
    assert "cable" in one
    at_anchor = sl.Pose(robot.frame_anchors[0] - robot.platform_anchors[0], np.eye(3))
    assert str(sl.margin(robot, at_anchor)).startswith("−inf N: NO_CHORD")


def test_a_sweep_shows_its_progress(robot: sl.Robot, tmp_path: Path) -> None:
    found = sl.sweep.run(sl.sweep.Request(robot, POSE), tmp_path / "sweep", workers=1)
    feasible = int(sl.inverse(robot, POSE).feasible.sum())
    numbers = [int(number) for number in re.findall(r"\d+", str(found))]
    assert numbers[:6] == [1, 3, 1, 1, 1, feasible]  # robots, poses, wrenches; finished tasks of all; feasible


def test_the_volume_of_a_box_inside_has_no_trailing_zeros(robot: sl.Robot) -> None:
    assert str(sl.workspace(robot, BOX, cells=4)).splitlines()[0].endswith(": 16 ± 0 m³")


@extended
def test_the_time_limit_of_a_proof_excludes_loading(robot: sl.Robot, monkeypatch: pytest.MonkeyPatch) -> None:
    clock = [0.0]
    real = Prover.verdicts

    def slow(self: Prover, *given: object) -> object:
        clock[0] += 10.0 if clock[0] == 0.0 else 1e-3  # the first call loads the kernel
        return real(self, *given)  # type: ignore[arg-type]

    monkeypatch.setattr(Prover, "verdicts", slow)
    monkeypatch.setattr("time.monotonic", lambda: clock[0])
    found = sl.prove(robot, sl.PoseBox([-4.0, -3.0, 1.0], [4.0, 3.0, 5.0]), sl.WrenchBox(50.0), budget=1.0)
    assert found.tried > 1
