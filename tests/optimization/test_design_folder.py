"""The folder of a search: continued exactly after every interruption, and never with another search."""

from __future__ import annotations

import csv
import os
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import sagline as sl
from sagline import FileError, InvalidValueError
from sagline.core.arrays import Array
from sagline.optimization.folder import EVALUATIONS, REQUEST
from sagline.optimization.rating import Rating
from tests.optimization.pair import UNDER, apart, pair
from tests.refusal import refused
from tests.tiers import extended, wide

UP = sl.FreeAnchors("frame", -1.0, 1.0, along=[0, 0, 1], symmetry="together")


def search(folder: Path | None, robot: sl.Robot | None = None, **more: Any) -> sl.Front:
    given: dict[str, Any] = {"poses": UNDER, "evaluations": 120, "optimizer": "differential_evolution", **more}
    return sl.design(robot or pair(), [apart(), UP], ["least_margin", "largest_sag"], folder=folder, **given)


class StoppedError(Exception):
    """Replacement of an interrupt."""


def stopped_after(count: int) -> Any:
    def tell(done: int, total: int) -> None:
        if done >= count:
            raise StoppedError

    return tell


def same(one: sl.Front, other: sl.Front) -> bool:
    return (
        one.evaluated.tobytes() == other.evaluated.tobytes()
        and one.evaluated_values.tobytes() == other.evaluated_values.tobytes()
        and [sl.dump_robot(robot) for robot in one.robots] == [sl.dump_robot(robot) for robot in other.robots]
    )


@pytest.mark.parametrize("optimizer", wide(["differential_evolution", "cma", "nsga2"]))
def test_an_interrupted_search_gives_the_same_result(tmp_path: Path, optimizer: str) -> None:
    whole = search(None, optimizer=optimizer)
    kept = []
    for count in (1, 40, 80):
        with pytest.raises(StoppedError):
            search(tmp_path, optimizer=optimizer, progress=stopped_after(count))
        kept.append(len((tmp_path / EVALUATIONS).read_text().splitlines()))
    assert kept[0] > 1  # all computed values are kept
    assert kept == sorted(set(kept))
    assert same(search(tmp_path, optimizer=optimizer), whole)


def test_known_candidates_are_not_evaluated_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    whole = search(tmp_path)
    size = (tmp_path / EVALUATIONS).stat().st_size
    rate, rated = Rating.__call__, [0]

    def counted(self: Rating, values: Array) -> Array:
        rated[0] += len(values)
        return rate(self, values)

    monkeypatch.setattr(Rating, "__call__", counted)
    assert same(search(tmp_path), whole)
    assert rated[0] == 1  # the first robot, before the folder is opened
    assert (tmp_path / EVALUATIONS).stat().st_size == size


def test_more_evaluations_continue_the_search(tmp_path: Path) -> None:
    first = search(tmp_path, evaluations=60)
    further = search(tmp_path, evaluations=180)
    assert same(further, search(None, evaluations=180))
    assert further.evaluated[: len(first.evaluated)].tobytes() == first.evaluated.tobytes()


@pytest.mark.parametrize("lost", wide([30, 1, 200]))
def test_a_partial_last_row_is_computed_again(tmp_path: Path, lost: int) -> None:
    whole = search(tmp_path)
    file = tmp_path / EVALUATIONS
    file.write_bytes(file.read_bytes()[:-lost])
    assert same(search(tmp_path), whole)
    assert same(search(tmp_path), whole)  # appended rows are on new lines


def test_an_empty_file_starts_again(tmp_path: Path) -> None:
    whole = search(tmp_path)
    (tmp_path / EVALUATIONS).write_bytes(b"")
    assert same(search(tmp_path), whole)


def test_a_changed_line_is_reported(tmp_path: Path) -> None:
    search(tmp_path)
    file = tmp_path / EVALUATIONS
    lines = file.read_text().splitlines(keepends=True)
    lines[5] = lines[5].replace("1", "2", 1)
    file.write_text("".join(lines))
    with refused("line 6", kind=FileError, file=file):
        search(tmp_path)


@pytest.mark.parametrize(
    "other",
    wide(
        [
            {"robot": pair(1.5)},
            {"seed": 1},
            {"optimizer": "nsga2"},
            {"wrenches": sl.WrenchBox(1.0)},
            {"model": sl.Elastic()},
        ]
    ),
    ids=lambda other: next(iter(other)),
)
def test_another_search_is_refused(tmp_path: Path, other: dict[str, Any]) -> None:
    search(tmp_path)
    before = (tmp_path / EVALUATIONS).read_bytes()
    with refused("request", kind=FileError, file=tmp_path) as caught:
        search(tmp_path, **other)
    assert len(str(caught.value)) < 300
    assert (tmp_path / EVALUATIONS).read_bytes() == before


def test_a_folder_that_is_in_use_is_refused(tmp_path: Path) -> None:
    said = []

    def again(done: int, total: int) -> None:
        with pytest.raises(FileError, match="another process"):
            search(tmp_path)
        said.append(done)

    search(tmp_path, evaluations=60, progress=again)
    assert said


def test_evaluations_without_a_request_are_refused(tmp_path: Path) -> None:
    search(tmp_path)
    (tmp_path / REQUEST).unlink()
    with refused(kind=FileError, file=tmp_path / EVALUATIONS) as caught:
        search(tmp_path)
    assert REQUEST in caught.value.reason
    (tmp_path / REQUEST).write_text("[1, 2]")
    with refused(kind=FileError, file=tmp_path / REQUEST):
        search(tmp_path)


@extended
def test_rows_of_another_optimizer_are_reported(tmp_path: Path) -> None:
    """As by another version of an optimizer: the same request, other candidates."""
    search(tmp_path, seed=1, optimizer="cma")
    other = (tmp_path / EVALUATIONS).read_bytes()
    search(tmp_path / "own", optimizer="cma")
    (tmp_path / "own" / EVALUATIONS).write_bytes(other)
    with refused("row 2 of the folder", "another robot", kind=InvalidValueError):
        search(tmp_path / "own", optimizer="cma")


def test_a_full_disk_loses_no_results(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    whole, write = search(None), os.write
    written = [0]

    def full(handle: int, data: bytes) -> int:
        if written[0] > 3000:
            raise OSError(28, "No space left on device")
        part = write(handle, data[: max(1, len(data) // 2)])
        written[0] += part
        return part

    monkeypatch.setattr("os.write", full)
    with pytest.raises(FileError, match="No space"):
        search(tmp_path)
    monkeypatch.undo()
    assert len((tmp_path / EVALUATIONS).read_text()) > 3000
    assert same(search(tmp_path), whole)


@extended
def test_robots_and_table_are_saved(tmp_path: Path) -> None:
    front = search(None, optimizer="nsga2", evaluations=240)
    files = front.save(tmp_path / "front")
    with files[0].open(newline="") as table:
        heads, start, *rows = list(csv.reader(table))
    assert heads == ["robot", "least_margin [N]", "largest_sag [m]", "frame_anchors x [m]", "frame_anchors z [m]"]
    assert [float(x) for x in start[1:]] == [*front.start_values, 0.0, 0.0]
    assert len(rows) == len(front.robots) == len(files) - 1
    for row, values, changed, robot, file in zip(
        rows, front.values, front.changed, front.robots, files[1:], strict=True
    ):
        assert row[0] == robot.name == file.stem
        np.testing.assert_array_equal([float(x) for x in row[1:]], [*values, *changed])
        again = sl.load_robot(file)
        assert again.frame_anchors.tobytes() == robot.frame_anchors.tobytes()


def test_a_folder_is_created_without_its_parents(tmp_path: Path) -> None:
    inside = tmp_path / "missing" / "front"
    step = f"Create the folder {inside.parent} first, or name another."
    with refused(next_step=step, kind=FileError, file=inside):
        search(inside)
    front = search(None)
    with refused(next_step=step, kind=FileError, file=inside):
        front.save(inside)
    assert not inside.parent.exists()
    inside.parent.mkdir()
    assert search(inside).save(inside)[0].is_file()


def test_a_refused_search_leaves_no_folder(tmp_path: Path) -> None:
    endless = sl.load_robot("ipanema-1").replace(tension_max=np.inf)
    posts = sl.FreeAnchors("frame", -0.1, 0.1, along=[0, 0, 1], symmetry="together")
    for goal in ("cable_cost", "least_margin"):
        with pytest.raises(InvalidValueError):
            sl.design(
                endless, [posts], [goal], grid=(2, 2, 2), evaluations=16, folder=tmp_path / "front", model=sl.Straight()
            )
    with pytest.raises(InvalidValueError):
        search(tmp_path / "front", evaluations=3)
    assert not (tmp_path / "front").exists()
