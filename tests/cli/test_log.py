"""`sagline log` and `sagline view run.mcap`: printed summary, written files and refusals."""

import json
import re
import threading
import time
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from typer.testing import CliRunner

import sagline as sl
from sagline import Plan
from sagline.cli import view
from sagline.cli.main import app
from sagline.cli.view import ServerOptions
from sagline.files.mcap_writer import Recorder
from tests.files.executions import cycles_of, events_of, execution, plan_of
from tests.files.test_mcap import assert_same
from tests.refusal import refused
from tests.tiers import extended, wide

NOWHERE = ServerOptions("", 0, True, 1, None, False)
ROBOT = sl.load_robot("article-prototype")


@pytest.fixture
def log(tmp_path: Path) -> Path:
    execution().save(tmp_path / "run.mcap")
    return tmp_path / "run.mcap"


def test_the_summary_has_states_largest_errors_lateness_and_events(log: Path) -> None:
    result = CliRunner().invoke(app, ["log", str(log)])
    assert result.exit_code == 0, result.output
    done, text = execution(), " ".join(result.stdout.split())
    assert re.match(r"article-prototype: 201 .*\b2 s, 4 ", text)
    assert "DONE: " in text
    assert re.search(r"MOVING 2\.01 201", text)
    off = np.abs(done.tension - done.planned_tension)
    row, cable = np.unravel_index(int(np.nanargmax(off)), off.shape)
    assert f" error {off[row, cable]:.3g} N {cable} {0.01 * row:.2f}" in text
    late = int(np.count_nonzero(done.late <= 1e-4))
    assert late == 201  # no cycle is later than 0.1 ms
    assert re.search(rf"up to 100 µs {late} █{{30}}", text)
    for event in events_of():
        assert event.text in text


@pytest.mark.parametrize("width", wide([60, 80, 120]))
def test_the_summary_fits_a_terminal(log: Path, width: int, monkeypatch: pytest.MonkeyPatch) -> None:
    from rich.console import Console

    console = Console(highlight=False, markup=False, emoji=False, width=width, force_terminal=True, no_color=True)
    monkeypatch.setattr("sagline.cli.terminal._out", console)
    result = CliRunner().invoke(app, ["log", str(log)])
    plain = re.sub(r"\x1b\[[0-9;]*m", "", result.stdout)
    assert max(map(len, plain.splitlines())) <= width
    assert "cell 3: 120.5 N" in " ".join(plain.split())


def test_json_has_the_numbers(log: Path) -> None:
    said = json.loads(CliRunner().invoke(app, ["log", str(log), "--json"]).stdout)
    assert (said["cycles"], said["cycles_without_answer"], said["status"]) == (201, 4, "DONE")
    assert said["states_s"] == {"MOVING": 2.01}
    assert said["late_s"]["p99.9"] == pytest.approx(np.quantile(execution().late, 0.999), rel=1e-12)
    assert [event["text"] for event in said["events"]] == [event.text for event in events_of()]


@extended
def test_a_data_set_has_every_number_and_the_plan(log: Path, tmp_path: Path) -> None:
    assert CliRunner().invoke(app, ["log", str(log), "--to", str(tmp_path / "run.nc")]).exit_code == 0
    done = execution()
    with xr.open_dataset(tmp_path / "run.nc", engine="h5netcdf", decode_times=False) as data:
        assert np.array_equal(data.tension, done.tension, equal_nan=True)
        assert np.array_equal(data.set_length, done.set_length, equal_nan=True)
        assert (data.tension.units, data.late.units, data.torque.units) == ("N", "s", "N m")
        assert data.state.flag_meanings.split()[data.state.values[0]] == "moving"
        assert data.event_text.values.tolist() == [event.text for event in events_of()]
        assert data.attrs["robot"] == sl.dump_robot(done.robot)
    with xr.open_dataset(tmp_path / "run.nc", group="plan", engine="h5netcdf", decode_times=False) as data:
        assert isinstance(done.plan, Plan)
        assert np.array_equal(data.unstrained_length, done.plan.unstrained_length)
        assert np.array_equal(data.horizontal_tension, done.plan.horizontal_tension)
    with refused(kind=sl.FileError, file=tmp_path / "run.nc"):
        sl.load_plan(tmp_path / "run.nc")


def test_a_log_without_its_end_is_reported_and_repaired(log: Path, tmp_path: Path) -> None:
    killed = tmp_path / "killed.mcap"
    killed.write_bytes(log.read_bytes()[:-20_000])
    result = CliRunner().invoke(app, ["log", str(killed), "--to", str(tmp_path / "mended.mcap")])
    assert result.exit_code == 0, result.output
    assert str(killed) in result.stderr
    mended = sl.load_execution(tmp_path / "mended.mcap")  # a warning would be an error here
    with pytest.warns(sl.SaglineWarning):
        assert_same(mended, sl.load_execution(killed))
    assert len(mended) == 100


@pytest.mark.parametrize("there", [None, b"", b"\x89MC"])
@pytest.mark.parametrize("name", ["run.mcap", "twin.mcap"])
def test_a_growing_log_is_awaited_until_its_first_bytes_exist(
    log: Path, name: str, there: bytes | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    with Recorder(log.parent / "twin.mcap", ROBOT) as recorder:
        recorder.truth(0.0, np.zeros(3), np.array([0.0, 0.0, 0.0, 1.0]))
    file = log.parent / name
    whole, looks = file.read_bytes(), []
    file.unlink() if there is None else file.write_bytes(there)

    def sleep(seconds: float) -> None:
        looks.append(seconds)
        if len(looks) == 3:
            file.write_bytes(whole)

    monkeypatch.setattr(view.time, "sleep", sleep)  # type: ignore[attr-defined]
    monkeypatch.setattr("sagline.cli.view.serve", lambda robot, address, *, played, **_: len(played.time))
    assert view._view_log(log, None, NOWHERE, live=True, truth=log.parent / "twin.mcap") == 201
    assert looks == [view.LOOK] * 3


@pytest.mark.parametrize("said", [b"no log at all", b"no", None])
def test_a_file_that_is_no_log_is_not_awaited(tmp_path: Path, said: bytes | None) -> None:
    file = tmp_path / "run.mcap"
    file.mkdir() if said is None else file.write_bytes(said)
    with refused(kind=sl.FileError, file=file):
        view._view_log(file, None, NOWHERE, live=True, truth=None)


@extended
def test_a_log_is_followed_before_it_exists(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Replacement of the page, which records the calls."""
    monkeypatch.setattr("sagline.cli.view.LOOK", 0.05)
    monkeypatch.setattr("sagline.files.mcap_writer.CHUNK", 0.2)
    lengths: list[int] = []
    file = tmp_path / "run.mcap"

    class Page:
        def extend(self, session: Any) -> None:
            lengths.append(len(session.time))

    def serve(robot: sl.Robot, address: ServerOptions, *, meanwhile: Any, played: Any, **page: Any) -> int:
        lengths.append(len(played.time))
        around: AbstractContextManager[None] = meanwhile(Page())
        with around:
            end = time.monotonic() + 20.0
            while lengths[-1] < 200 and time.monotonic() < end:
                time.sleep(0.02)
        return 0

    def write() -> None:
        time.sleep(0.2)
        with Recorder(file, ROBOT, epoch=0) as recorder:
            recorder.begins(plan_of())
            for cycle in cycles_of(plan_of(), 200):
                recorder.cycle(cycle)
                time.sleep(0.003)

    plan_of()
    writer = threading.Thread(target=write)
    monkeypatch.setattr("sagline.cli.view.serve", serve)
    writer.start()
    assert view._view_log(file, None, NOWHERE, live=True, truth=None) == 0
    writer.join()
    assert lengths == sorted(lengths)  # equal if an event arrived, or if a cycle was split
    assert lengths[-1] == 200
    assert len(set(lengths)) > 2
