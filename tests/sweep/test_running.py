"""Sweeps in one process: stopped or damaged sweeps continue exactly, and no task is computed twice."""

from __future__ import annotations

import errno
import os
import shutil
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from syrupy.assertion import SnapshotAssertion

import sagline as sl
from sagline.sweep import folder as sweep_folder
from sagline.sweep import result as sweep_result
from sagline.sweep import running, work
from tests.refusal import refused
from tests.sweep.requests import bits, chunks, in_tasks, marked, planar
from tests.tiers import extended, wide

SIZE = (8, 10)  # 5 x 3 tasks of `planar()`
INSTALL = 'Install it: pip install "sagline[sweep]".'


class Stop:
    """Replacement of Ctrl-C after a number of tasks."""

    def __init__(self, after: int) -> None:
        self.after = after

    def __call__(self, done: int, total: int) -> None:
        if done >= self.after:
            raise KeyboardInterrupt


@pytest.fixture(scope="module")
def reference(tmp_path_factory: pytest.TempPathFactory) -> dict[str, bytes]:
    """Numbers of the sweep by one run without a stop."""
    folder = in_tasks(tmp_path_factory.mktemp("reference") / "sweep", planar(), SIZE)
    return bits(sl.sweep.run(planar(), folder, workers=1))


def test_a_sweep_agrees_with_its_parts(tmp_path: Path, reference: dict[str, bytes]) -> None:
    told: list[tuple[int, int]] = []
    found = sl.sweep.run(planar(), tmp_path / "sweep", workers=1, progress=lambda *now: told.append(now))
    assert bits(found)["status"] == reference["status"]
    assert bits(found)["tension"] == reference["tension"]
    assert (found.done, found.complete, found.folder) == (found.tasks, True, tmp_path / "sweep")
    assert sum(found.counts) == len(planar())
    assert found.counts.lost == found.counts.open == 0
    assert told == [(k, found.tasks) for k in range(found.tasks + 1)]


@pytest.mark.parametrize("after", wide([1, 14]))
def test_a_stopped_sweep_continues_exactly(tmp_path: Path, reference: dict[str, bytes], after: int) -> None:
    folder = in_tasks(tmp_path / "sweep", planar(), SIZE)
    with pytest.raises(KeyboardInterrupt):
        sl.sweep.run(planar(), folder, workers=1, progress=Stop(after))
    part = sl.sweep.load(folder)
    assert (part.done, part.complete, part.tasks) == (after, False, 15)
    status = part.values("status")
    assert np.count_nonzero(status == -1) == len(planar()) - sum(part.counts)
    before = chunks(folder, planar())
    found = sl.sweep.run(planar(), folder, workers=1)
    assert found.complete
    assert bits(found) == reference
    assert {name: when for name, when in chunks(folder, planar()).items() if name in before} == before
    assert sorted(marked(folder)) == list(range(15))
    assert sum(found.counts) == len(planar())


@extended
def test_finished_tasks_are_not_repeated(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folder = in_tasks(tmp_path / "sweep", planar(), SIZE)
    first = sl.sweep.run(planar(), folder, workers=1)
    monkeypatch.setattr(running, "task", None)  # would fail
    again = sl.sweep.run(planar(), folder, workers=1)
    assert (again.counts, again.done, again.seconds) == (first.counts, first.done, first.seconds)


@pytest.mark.parametrize(
    ("index", "value"),
    wide([((0, 99), "99"), ((0, 0, 0, 0, 0), "(0, 0, 0, ...)"), (0.5, "0.5"), (None, "None"), ("x", "'x'")]),
)
def test_an_invalid_index_is_reported(tmp_path: Path, index: Any, value: str) -> None:
    found = sl.sweep.run(planar(2, 2), tmp_path / "sweep", workers=1)
    with refused("index", value=value, kind=sl.InvalidValueError):
        found.values("status", index)


DAMAGES: dict[str, Any] = {
    "cut off": lambda data: data[: len(data) // 2],
    "empty": lambda data: b"",
    "zeros": lambda data: bytes(len(data)),
    "a bit": lambda data: data[:9] + bytes([data[9] ^ 4]) + data[10:],
    "the checksum": lambda data: data[:-1] + bytes([data[-1] ^ 1]),
    "gone": lambda data: None,
}


@pytest.mark.parametrize(("damage", "variable"), wide(zip(DAMAGES, 3 * ("status", "tension"), strict=True)))
def test_a_damaged_chunk_is_computed_again(
    tmp_path: Path, reference: dict[str, bytes], damage: str, variable: str
) -> None:
    folder = in_tasks(tmp_path / "sweep", planar(), SIZE)
    sl.sweep.run(planar(), folder, workers=1)
    before = chunks(folder, planar())
    chunk = sorted(file for file in (folder / sweep_folder.GROUP / variable / "c").rglob("*") if file.is_file())[4]
    data = DAMAGES[damage](chunk.read_bytes())
    chunk.unlink() if data is None else chunk.write_bytes(data)
    if data is not None:
        with refused(kind=sl.FileError, file=folder) as caught:
            sl.sweep.load(folder).values(variable)
        assert caught.value.reason.startswith(f"{variable} ")
    found = sl.sweep.run(planar(), folder, workers=1)
    assert bits(found) == reference
    assert found.complete
    after = chunks(folder, planar())
    assert len([name for name in before if after[name] != before[name]]) <= len(sl.sweep.QUANTITIES["tension"])


@extended
@pytest.mark.parametrize("text", wide(["nonsense\n\0\xff\n3 0.1 1 2", "", "99 0.1 1 2 3 4 5\n-1 0 0 0 0 0 0\n"]))
def test_marks_agree_with_the_chunks_on_the_disk(tmp_path: Path, reference: dict[str, bytes], text: str) -> None:
    folder = in_tasks(tmp_path / "sweep", planar(), SIZE)
    first = sl.sweep.run(planar(), folder, workers=1)
    before = chunks(folder, planar())
    (folder / sweep_result.NAME).write_bytes(text.encode("latin-1"))
    found = sl.sweep.run(planar(), folder, workers=1)
    assert chunks(folder, planar()) == before
    assert (found.counts, found.done) == (first.counts, first.done)
    assert bits(found) == reference


@extended
def test_the_folder_of_another_sweep_is_refused(tmp_path: Path) -> None:
    folder, request = in_tasks(tmp_path / "sweep", planar(), SIZE), planar()
    others = [
        sl.sweep.Request(request.robots[0].replace(mass=10.5), request.poses, request.wrenches),
        sl.sweep.Request(request.robots, request.poses[:-1], request.wrenches),
        sl.sweep.Request(request.robots, request.poses, request.wrenches + 1e-13),
        sl.sweep.Request(request.robots, request.poses, request.wrenches, "length"),
        sl.sweep.Request(request.robots, request.poses, request.wrenches, model=sl.Straight()),
        sl.sweep.Request(request.robots, request.poses, request.wrenches, tension=sl.Centroid()),
        sl.sweep.Request(request.robots, request.poses, request.wrenches, around=sl.WrenchBox(1.0)),
        sl.sweep.Request(request.robots, request.poses, request.wrenches, moment_arm=0.5),
    ]
    for other in others:
        with pytest.raises(sl.FileError, match="1,000 requests"):
            sl.sweep.run(other, folder, workers=1)
    assert sl.sweep.load(folder).done == 0
    assert sl.sweep.run(request, folder, workers=1).complete


def test_a_request_is_saved_exactly(tmp_path: Path) -> None:
    given = planar()
    request = sl.sweep.Request(
        [given.robots[0], given.robots[0].replace(mass=11.0)],
        given.poses,
        given.wrenches,
        ("shortfall", "margin"),
        model=sl.Empirical(),
        tension=sl.QuadraticProgram(weights=[1.0, 2.0, 3.0, 4.0], target=50.0),
        around=sl.WrenchBox(5.0) + sl.WrenchEllipsoid([1, 2, 3], 0.5) + sl.WrenchPolytope(np.eye(6)),
        moment_arm=0.3,
    )
    found = sweep_folder.SweepFolder(in_tasks(tmp_path / "sweep", request, SIZE))
    assert sweep_folder.request_digest(found.request) == sweep_folder.request_digest(request) == found.digest
    for name in ("center", "segments", "ellipsoids", "corners", "sizes", "accelerations"):
        np.testing.assert_array_equal(getattr(found.request.around, name), getattr(request.around, name))
    assert [sl.dump_robot(one) for one in found.request.robots] == [sl.dump_robot(one) for one in request.robots]
    assert (found.request.quantities, found.request.model) == (request.quantities, request.model)


@pytest.mark.parametrize("what", ["a file", "a full folder", "no parent", "another sagline", "an edited request"])
def test_other_folders_are_not_changed(tmp_path: Path, what: str) -> None:
    folder = tmp_path / "sweep"
    if what == "a file":
        folder.write_text("mine")
    elif what == "a full folder":
        folder.mkdir()
        (folder / "mine").write_text("mine")
    elif what == "no parent":
        folder = tmp_path / "nowhere" / "sweep"
    else:
        attributes = in_tasks(folder, planar(), SIZE) / sweep_folder.GROUP / "zarr.json"
        old, new = ("sagline 0", "sagline 99.0") if what == "another sagline" else ("mass: 10", "mass: 11")
        attributes.write_text(attributes.read_text().replace(old, new))
    before = sorted(tmp_path.rglob("*"))
    with pytest.raises(sl.FileError) as error:
        sl.sweep.run(planar(), folder, workers=1)
    assert len(str(error.value)) < 300
    assert sorted(tmp_path.rglob("*")) == before


def test_one_process_at_a_time_works_on_a_sweep(tmp_path: Path, snapshot: SnapshotAssertion) -> None:
    folder = in_tasks(tmp_path / "sweep", planar(), SIZE)
    with sweep_result.open_marks(sweep_folder.SweepFolder(folder)), refused(kind=sl.FileError, file=folder) as caught:
        sl.sweep.run(planar(), folder, workers=1)
    assert str(caught.value).replace(str(folder), "FOLDER") == snapshot


@extended
def test_a_full_disk_loses_no_results(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, reference: dict[str, bytes]
) -> None:
    import zarr.storage._local as store

    folder, put, count = in_tasks(tmp_path / "sweep", planar(), SIZE), store._put, 0

    def full(*given: Any, **more: Any) -> Any:
        nonlocal count
        count += 1
        if count > 10:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        return put(*given, **more)

    with monkeypatch.context() as patched:
        patched.setattr(store, "_put", full)
        with pytest.raises(sl.FileError, match=os.strerror(errno.ENOSPC)):
            sl.sweep.run(planar(), folder, workers=1)
    assert 0 < sl.sweep.load(folder).done < 15
    assert bits(sl.sweep.run(planar(), folder, workers=1)) == reference


@pytest.mark.parametrize("same", [True, False])
def test_of_two_simultaneous_sweeps_the_later_one_uses_the_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, same: bool
) -> None:
    fill, folder = sweep_folder._fill, tmp_path / "sweep"

    def late(*arguments: Any) -> None:
        monkeypatch.setattr(sweep_folder, "_fill", fill)
        sl.sweep.run(planar(3, 2) if same else planar(4, 2), folder, workers=1)
        fill(*arguments)

    monkeypatch.setattr(sweep_folder, "_fill", late)
    if same:
        assert sl.sweep.run(planar(3, 2), folder, workers=1).complete
    else:
        with pytest.raises(sl.FileError, match="another sweep"):
            sl.sweep.run(planar(3, 2), folder, workers=1)
    assert [path.name for path in tmp_path.iterdir()] == ["sweep"]


def test_without_dask_tasks_run_in_order(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, reference: dict[str, bytes]
) -> None:
    monkeypatch.setattr(sweep_folder, "find_spec", lambda name: None if name == "distributed" else find_spec(name))
    folder, told = in_tasks(tmp_path / "sweep", planar(), SIZE), list[str]()
    assert bits(sl.sweep.run(planar(), folder, workers=2, tell=told.append)) == reference
    assert len(told) == 1
    assert '"sagline[sweep]"' in told[0]
    with refused("the package distributed", next_step=INSTALL, kind=sl.InvalidValueError):
        sl.sweep.run(planar(), folder, scheduler="tcp://127.0.0.1:1")


@pytest.mark.parametrize(
    "address",
    ["", "127.0.0.1:8786", "tcp://", "tcp://a", "tcp://a:0", "tcp://a:65536", "tcp://:1", "tcp://a b:1", "http://a:1",
     "tcp://a:1\n", "tcp://\x1b:1", "inproc://a:1", 3, None, b"tcp://a:1"],
)  # fmt: skip
def test_invalid_addresses_are_refused(address: object) -> None:
    with refused("scheduler", repr(address), "an address, tcp://HOST:PORT", kind=sl.InvalidValueError):
        running.check_address(address)


def test_a_missing_zarr_is_reported_with_the_next_step(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sweep_folder, "find_spec", lambda name: None)
    with refused("the package zarr", next_step=INSTALL, kind=sl.InvalidValueError):
        sl.sweep.run(planar(), tmp_path / "sweep")
    with refused("the package zarr", next_step=INSTALL, kind=sl.InvalidValueError):
        sl.sweep.load(tmp_path)


def test_tasks_have_the_intended_duration(monkeypatch: pytest.MonkeyPatch) -> None:
    times = iter(np.repeat(np.arange(0.0, 1e3, 0.01), 1))
    monkeypatch.setattr(work, "compute_variables", lambda request, part: {})
    monkeypatch.setattr("sagline.sweep.work.time.process_time", lambda: next(times))
    request = planar(2000, 1000)
    size = work.measured_size(request)  # 10 ms for 4,000 requests
    assert size[1] == 1000
    assert size[0] * size[1] * 0.01 / 4000 == pytest.approx(work.SECONDS, rel=0.05)


def test_the_folder_opens_with_xarray_and_units(tmp_path: Path) -> None:
    request = planar(quantities=("tension", "length", "margin"))
    found = sl.sweep.run(request, tmp_path / "sweep", workers=1)
    data = found.field
    assert dict(data.sizes) == {
        "robot": 1, "pose": 40, "wrench": 25, "cable": 4, "axis": 3, "quaternion_part": 4, "wrench_part": 6
    }  # fmt: skip
    assert {name: data[name].attrs["units"] for name in ("tension", "length", "margin", "proof", "position")} == {
        "tension": "N", "length": "m", "margin": "N", "proof": "N", "position": "m"
    }  # fmt: skip
    np.testing.assert_array_equal(data["tension"].values, found.values("tension"))
    np.testing.assert_array_equal(data["position"].values, request.poses.position)
    np.testing.assert_array_equal(data["wrench"].values, request.wrenches)
    assert data["status"].attrs["flag_meanings"].split()[:3] == ["unasked", "solved", "infeasible"]
    np.testing.assert_array_equal(found.values("tension", (0, slice(3), 2, 1)), found.values("tension")[0, :3, 2, 1])


@extended
def test_a_folder_can_be_moved(tmp_path: Path) -> None:
    found = sl.sweep.run(planar(), tmp_path / "sweep", workers=1)
    shutil.move(tmp_path / "sweep", tmp_path / "elsewhere")
    assert bits(sl.sweep.load(tmp_path / "elsewhere"))["status"] == found_bits(tmp_path / "elsewhere")
    assert found.complete


def found_bits(folder: Path) -> bytes:
    status: np.ndarray[Any, Any] = sweep_folder.SweepFolder(folder).group["status"][...]  # type: ignore[index,assignment]
    return status.tobytes()
