import os
import signal
import subprocess
import sys
import tempfile
from pathlib import Path

import pytest

from sagline.files.writing import LOCK, staging, write_text

WRITER = """
import sys, time
from pathlib import Path
from sagline.files.writing import atomic_file
with atomic_file(Path(sys.argv[1])) as partial:
    partial.write_text("half")
    print("writing", flush=True)
    time.sleep(60.0)
"""


@pytest.fixture
def writer(tmp_path: Path) -> "subprocess.Popen[str]":
    """A process during the writing of a file."""
    command = [sys.executable, "-c", WRITER, str(tmp_path / "other.nc")]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None
    assert process.stdout.readline() == "writing\n"
    return process


def ended(process: "subprocess.Popen[str]") -> None:
    process.send_signal(signal.SIGKILL)
    process.communicate()


def names(folder: Path) -> list[str]:
    return sorted(entry.name for entry in folder.iterdir())


def test_remains_of_a_killed_process_are_removed_with_the_next_file(
    tmp_path: Path, writer: "subprocess.Popen[str]"
) -> None:
    ended(writer)
    assert len(names(tmp_path)) == 1
    write_text(tmp_path / "run.nc", "whole")
    assert names(tmp_path) == ["run.nc"]


def test_files_of_a_running_process_are_kept(tmp_path: Path, writer: "subprocess.Popen[str]") -> None:
    try:
        before = names(tmp_path)
        write_text(tmp_path / "run.nc", "whole")
        assert names(tmp_path) == sorted([*before, "run.nc"])
    finally:
        ended(writer)


def test_two_files_at_once_in_one_process(tmp_path: Path) -> None:
    with staging(tmp_path) as one, staging(tmp_path) as other:
        assert one != other
        assert one.is_dir()
    assert names(tmp_path) == []


def test_remains_in_any_state_are_removed(tmp_path: Path) -> None:
    empty, without_lock, full = (tmp_path / f".sagline-{name}.part" for name in ("empty", "data", "full"))
    for place in (empty, without_lock, full):
        place.mkdir()
    (without_lock / "0.part").write_text("half")
    (full / LOCK).touch()
    (full / "0.part").write_text("half")
    with staging(tmp_path) as place:
        assert names(tmp_path) == [place.name]
    assert names(tmp_path) == []


def test_files_similar_to_remains_are_kept(tmp_path: Path) -> None:
    kept = tmp_path / "kept"
    kept.mkdir()
    (kept / "data").write_text("data")
    (tmp_path / ".sagline-link.part").symlink_to(kept)
    (tmp_path / ".sagline-file.part").write_text("data")
    (tmp_path / ".sagline-mine").mkdir()
    planted = tmp_path / ".sagline-pipe.part"
    planted.mkdir()
    os.mkfifo(planted / LOCK)  # opening it for writing would wait for a reader
    write_text(tmp_path / "run.nc", "whole")
    assert (kept / "data").read_text() == "data"
    assert names(kept) == ["data"]
    assert {".sagline-link.part", ".sagline-file.part", ".sagline-mine"} < set(names(tmp_path))


def test_a_folder_removed_by_another_process_is_created_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    made, original = [], tempfile.mkdtemp

    def taken_away_twice(**keywords: object) -> str:
        place = original(**keywords)  # type: ignore[call-overload]
        made.append(place)
        if len(made) < 3:
            os.rmdir(place)
        return str(place)

    monkeypatch.setattr(tempfile, "mkdtemp", taken_away_twice)
    with staging(tmp_path) as place:
        assert str(place) == made[2]


@pytest.mark.parametrize("error", [OSError(37, "No locks available")])
def test_without_locks_files_are_written_and_remains_are_kept(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, error: OSError
) -> None:
    def none(*_: object) -> None:
        raise error

    monkeypatch.setattr("fcntl.flock", none)
    (tmp_path / ".sagline-other.part").mkdir()
    write_text(tmp_path / "run.nc", "whole")
    assert (tmp_path / "run.nc").read_text() == "whole"
    assert (tmp_path / ".sagline-other.part").is_dir()
