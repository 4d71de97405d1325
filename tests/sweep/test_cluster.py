"""Sweeps with workers of Dask in real processes, one of which is killed."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import psutil
import pytest
from syrupy.assertion import SnapshotAssertion

import sagline as sl
from sagline.sweep import running
from tests.sweep.requests import bits, chunks, in_tasks, marked, planar
from tests.tiers import extended

pytestmark = extended

SIZE = (2, 5)  # 20 x 5 tasks of `planar()`
TASKS = 100


def worker_pids() -> list[int]:
    """Running child processes of this process."""
    children = psutil.Process().children(recursive=True)
    return [child.pid for child in children if "spawn_main" in " ".join(_command(child))]


def _command(process: psutil.Process) -> list[str]:
    with suppress(psutil.Error):
        return list(process.cmdline())
    return []


def listening() -> set[str]:
    """Addresses of the listening sockets of this process and its workers."""
    processes = [psutil.Process(), *psutil.Process().children(recursive=True)]
    found = [one for process in processes for one in process.net_connections("inet")]
    return {one.laddr.ip for one in found if one.status == psutil.CONN_LISTEN}


@pytest.fixture(scope="module")
def reference(tmp_path_factory: pytest.TempPathFactory) -> dict[str, bytes]:
    folder = in_tasks(tmp_path_factory.mktemp("reference") / "sweep", planar(), SIZE)
    return bits(sl.sweep.run(planar(), folder, workers=1))


def test_killed_workers_and_a_stop_lose_no_results(
    tmp_path: Path, reference: dict[str, bytes], capfd: pytest.CaptureFixture[str], snapshot: SnapshotAssertion
) -> None:
    """Both workers are killed by their pids; the sweep continues, is stopped, and is continued again."""
    folder, told, killed, heard = in_tasks(tmp_path / "sweep", planar(), SIZE), list[str](), list[int](), set[str]()

    def disturb(done: int, total: int) -> None:
        if done >= 10 and not killed:
            heard.update(listening())
            killed.extend(worker_pids())
            time.sleep(0.5)  # workers finish their tasks; the results are lost with them
            for pid in killed:
                os.kill(pid, signal.SIGKILL)
            time.sleep(0.5)
        if done >= 40:
            raise KeyboardInterrupt

    with warnings.catch_warnings():
        warnings.simplefilter("error")
        with pytest.raises(KeyboardInterrupt):
            sl.sweep.run(planar(), folder, workers=2, progress=disturb, tell=told.append)
        assert len(killed) == 2
        assert worker_pids() == []
        part = sl.sweep.load(folder)
        assert 40 <= part.done < 60  # tasks of the workers are finished
        before = chunks(folder, planar())
        found = sl.sweep.run(planar(), folder, workers=1)
    assert found.complete
    assert bits(found) == reference
    assert {name: when for name, when in chunks(folder, planar()).items() if name in before} == before
    assert sorted(marked(folder)) == list(range(TASKS))
    assert sum(found.counts) == len(planar())
    assert heard == {"127.0.0.1"}
    assert len(told) == 2
    assert "http://127.0.0.1:" in told[0]
    assert told[1] == snapshot
    assert capfd.readouterr() == ("", "")


@contextmanager
def scheduler(folder: Path, workers: int = 1) -> Iterator[tuple[str, Callable[[], None]]]:
    """A new scheduler with workers, and a function that kills it."""
    file = folder / "scheduler.json"
    file.unlink(missing_ok=True)
    here = [sys.executable, "-m", "distributed.cli.dask_scheduler", "--host", "127.0.0.1", "--port", "0"]
    there = [sys.executable, "-m", "distributed.cli.dask_worker", "--nthreads", "1", "--no-nanny", "--no-dashboard"]
    silence_dask = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    processes = [subprocess.Popen([*here, "--no-dashboard", "--scheduler-file", str(file)], **silence_dask)]  # type: ignore[call-overload]
    try:
        deadline = time.monotonic() + 60.0
        while not file.exists() and time.monotonic() < deadline:
            time.sleep(0.05)
        processes += [
            subprocess.Popen([*there, "--scheduler-file", str(file)], cwd=folder, **silence_dask)  # type: ignore[call-overload]
            for _ in range(workers)
        ]
        import json

        yield json.loads(file.read_text())["address"], processes[0].kill
    finally:
        for process in processes:
            process.kill()
            process.wait()


@pytest.mark.soak
def test_a_killed_scheduler_loses_no_results(tmp_path: Path, reference: dict[str, bytes]) -> None:
    folder = in_tasks(tmp_path / "sweep", planar(), SIZE)
    with scheduler(tmp_path, workers=2) as (address, kill):
        with pytest.raises(sl.SaglineError, match="is gone"):
            sl.sweep.run(planar(), folder, scheduler=address, progress=lambda done, of: kill() if done == 20 else None)
        assert 20 <= sl.sweep.load(folder).done < TASKS
        with pytest.raises(sl.SaglineError, match=address):
            sl.sweep.run(planar(), folder, scheduler=address)
    with scheduler(tmp_path, workers=1) as (address, _):
        assert bits(sl.sweep.run(planar(), folder, scheduler=address)) == reference


@pytest.mark.soak
def test_a_scheduler_without_workers_is_reported(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(running, "PATIENCE", 3.0)
    with (
        scheduler(tmp_path, workers=0) as (address, _),
        pytest.raises(sl.SaglineError, match=f"dask worker {address}"),
    ):
        sl.sweep.run(planar(), tmp_path / "sweep", scheduler=address)


def test_an_address_without_a_scheduler_is_reported(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(running, "PATIENCE", 0.5)
    with pytest.raises(sl.SaglineError, match=r"tcp://127\.0\.0\.1:9") as error:
        sl.sweep.run(planar(3, 2), tmp_path / "sweep", scheduler="tcp://127.0.0.1:9")
    assert len(str(error.value)) < 300
    assert list(tmp_path.iterdir()) == []


@pytest.mark.soak
def test_a_script_without_a_main_guard_is_reported(tmp_path: Path) -> None:
    script = "import sagline as sl\nfrom tests.sweep.requests import in_tasks, planar\nfrom pathlib import Path\n"
    script += "sl.sweep.run(planar(), Path('sweep'), workers=2)\n"
    in_tasks(tmp_path / "sweep", planar(), SIZE)
    (tmp_path / "script.py").write_text(script)
    root, source = Path(__file__).parents[2], Path(sl.__file__).parents[1]
    environment = {**os.environ, "PYTHONPATH": f"{source}{os.pathsep}{root}"}
    done = subprocess.run(
        [sys.executable, "script.py"], cwd=tmp_path, env=environment, capture_output=True, text=True, timeout=120
    )
    assert done.returncode == 1
    assert '__name__ == "__main__":' in done.stderr.splitlines()[-1]
