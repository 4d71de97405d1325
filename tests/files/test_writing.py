import contextlib
import os
import resource
import socket
import stat
from collections.abc import Callable
from pathlib import Path

import pytest
from syrupy.assertion import SnapshotAssertion

from sagline import FileError
from sagline.files.writing import (
    atomic_file,
    atomic_files,
    check_folder,
    create_folder,
    finished_files,
    write_text,
)
from tests.files.wording import wording
from tests.refusal import refused


def test_a_file_appears_when_it_is_complete(tmp_path: Path) -> None:
    file = tmp_path / "run.nc"
    with atomic_file(file) as partial:
        partial.write_bytes(b"half")
        assert not file.exists()
    assert file.read_bytes() == b"half"
    assert [entry.name for entry in tmp_path.iterdir()] == ["run.nc"]


@pytest.mark.parametrize("trouble", [KeyboardInterrupt, ValueError, OSError(28, "No space left on device")])
def test_an_error_keeps_the_existing_file(tmp_path: Path, trouble: BaseException | type[BaseException]) -> None:
    file = tmp_path / "run.nc"
    file.write_bytes(b"before")

    def write() -> None:
        with atomic_file(file) as partial:
            partial.write_bytes(b"half")
            raise trouble

    with pytest.raises((KeyboardInterrupt, ValueError, FileError)):
        write()
    assert file.read_bytes() == b"before"
    assert [entry.name for entry in tmp_path.iterdir()] == ["run.nc"]


def test_a_full_disk_is_named(tmp_path: Path, snapshot: SnapshotAssertion) -> None:
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (1000, hard))
    try:
        with (
            refused(kind=FileError, file=tmp_path / "run.nc") as caught,
            atomic_file(tmp_path / "run.nc") as partial,
        ):
            partial.write_bytes(bytes(5000))
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    assert wording(caught.value, tmp_path) == snapshot
    assert not list(tmp_path.iterdir())


def test_paths_that_cannot_be_written(tmp_path: Path, snapshot: SnapshotAssertion) -> None:
    (tmp_path / "file").touch()
    entered: list[Path] = []
    for place in (tmp_path, tmp_path / "missing" / "run.nc", tmp_path / "file" / "run.nc"):
        with refused(kind=FileError, file=place) as caught, atomic_file(place):
            entered.append(place)
        assert (caught.value.reason, caught.value.next_step.replace(str(tmp_path), "FOLDER")) == snapshot
    assert entered == []


def test_a_folder_is_checked_without_creating_it(tmp_path: Path, snapshot: SnapshotAssertion) -> None:
    (tmp_path / "file").touch()
    check_folder(tmp_path / "new" / "deep")
    assert not (tmp_path / "new").exists()
    for make in (check_folder, create_folder):
        with refused(kind=FileError, file=tmp_path / "file" / "deep") as caught:
            make(tmp_path / "file" / "deep")
        assert wording(caught.value, tmp_path) == snapshot
    assert create_folder(tmp_path / "new" / "deep").is_dir()


def test_a_folder_without_permission(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("os.access", lambda *_: False)  # the superuser may write anywhere, so the check is replaced
    with pytest.raises(FileError, match="permission"):
        check_folder(tmp_path / "new")


def test_the_content_is_on_the_disk_before_the_name(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    target, seen = tmp_path / "run.nc", []
    monkeypatch.setattr("os.fsync", lambda handle: seen.append((os.fstat(handle).st_size, target.exists())))
    write_text(target, "whole")
    assert seen == [(5, False)]  # all content, before the name
    assert target.read_text() == "whole"


def test_permissions_are_kept_and_links_keep_the_old_content(tmp_path: Path) -> None:
    file, other = tmp_path / "run.nc", tmp_path / "other.nc"
    file.write_text("before")
    file.chmod(0o640)
    other.hardlink_to(file)
    write_text(file, "after")
    assert (file.read_text(), other.read_text()) == ("after", "before")
    assert stat.S_IMODE(file.stat().st_mode) == 0o640


def test_names_of_other_things_are_refused_and_unchanged(tmp_path: Path, snapshot: SnapshotAssertion) -> None:
    reasons = []
    for place, is_there in no_files(tmp_path):
        with refused(kind=FileError) as caught:
            write_text(place, "text")
        reasons.append(wording(caught.value, tmp_path).replace(tmp_path.name, "FOLDER"))
        assert is_there()
    assert reasons == snapshot
    assert {entry.name for entry in tmp_path.iterdir()} == {
        "folder",
        "pipe",
        "socket",
        "device",
        "data",
        "to",
        "nowhere",
    }
    assert (tmp_path / "data").read_text() == "data"


def no_files(folder: Path) -> list[tuple[Path, Callable[[], bool]]]:
    """Names used by other things than files, with a check that they are unchanged."""
    names = ("folder", "pipe", "socket", "device", "data", "to", "nowhere")
    inside, pipe, plug, device, data, to, nowhere = (folder / name for name in names)
    inside.mkdir()
    os.mkfifo(pipe)
    with socket.socket(socket.AF_UNIX) as server, contextlib.chdir(folder):
        server.bind(plug.name)  # the name of a socket has at most about a hundred characters
    os.symlink(os.devnull, device)
    data.write_text("data")
    to.symlink_to(data)
    nowhere.symlink_to(folder / "missing")
    return [
        (inside, inside.is_dir),
        (pipe, pipe.is_fifo),
        (plug, plug.is_socket),
        (device, device.is_symlink),
        (Path(os.devnull), Path(os.devnull).is_char_device),
        (to, to.is_symlink),
        (nowhere, nowhere.is_symlink),
        *((place, folder.is_dir) for place in (folder / ".", folder / "..", Path("."), Path("/"))),
    ]


@pytest.mark.parametrize("name", ["a\0b", "\ud800", "x" * 300, "x" * 5000, "data/run.nc", "loop/run.nc"])
def test_impossible_names(tmp_path: Path, name: str) -> None:
    (tmp_path / "data").touch()
    (tmp_path / "loop").symlink_to(tmp_path / "loop")
    before = sorted(entry.name for entry in tmp_path.iterdir())
    for use, place in (
        (lambda place: write_text(place, "text"), tmp_path / name),
        (check_folder, tmp_path / name),
        (create_folder, tmp_path / name),
        (check_folder, tmp_path / name / "deep"),
    ):
        with refused(kind=FileError, file=place):
            use(place)
    assert sorted(entry.name for entry in tmp_path.iterdir()) == before


def test_names_of_the_largest_length(tmp_path: Path) -> None:
    write_text(tmp_path / ("x" * 255), "text")
    assert (tmp_path / ("x" * 255)).read_text() == "text"


def test_a_write_protected_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "run.nc").write_text("before")
    monkeypatch.setattr("os.access", lambda *_: False)  # the superuser may write all files
    with pytest.raises(FileError, match="permissions"):
        write_text(tmp_path / "run.nc", "after")
    assert (tmp_path / "run.nc").read_text() == "before"


def test_half_a_character_is_refused_first(tmp_path: Path) -> None:
    with refused(kind=FileError, file=tmp_path / "run.txt") as caught:
        write_text(tmp_path / "run.txt", "name: \ud800")
    assert "U+D800 in 'name: '" in caught.value.reason
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("trouble", [None, KeyboardInterrupt, OSError(28, "No space left on device")])
def test_groups_of_files(tmp_path: Path, trouble: BaseException | type[BaseException] | None) -> None:
    (tmp_path / "page.html").write_text("before")

    def write() -> None:
        with atomic_files(tmp_path, ["page.html", "page.json"]) as (page, data):
            page.write_text("after")
            if trouble is not None:
                raise trouble
            data.write_text("{}")

    if trouble is None:
        write()
        assert contents(tmp_path) == {"page.html": "after", "page.json": "{}"}
    else:
        with pytest.raises((KeyboardInterrupt, FileError)):
            write()
        assert contents(tmp_path) == {"page.html": "before"}


def test_the_failed_file_is_named(tmp_path: Path) -> None:
    def write() -> None:
        with atomic_files(tmp_path, ["page.html", "page.json"]) as (_, data):
            data.unlink()
            data.mkdir()
            data.open("rb+")

    with refused(kind=FileError, file=tmp_path / "page.json"):
        write()
    assert contents(tmp_path) == {}


def test_finished_files_can_be_named(tmp_path: Path) -> None:
    def write() -> None:
        write_text(tmp_path / "a.txt", "a")
        with atomic_files(tmp_path, ["b", "c"]):
            pass
        write_text(tmp_path / "missing" / "d.txt", "d")

    with finished_files() as finished, pytest.raises(FileError):
        write()
    write_text(tmp_path / "later.txt", "")
    assert [file.name for file in finished] == ["a.txt", "b", "c"]


def contents(folder: Path) -> dict[str, str]:
    return {entry.name: entry.read_text() for entry in folder.iterdir()}
