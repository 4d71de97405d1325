import contextlib
import os
import resource
import socket
import stat
from collections.abc import Callable
from pathlib import Path

import pytest

from sagline.errors import FileError
from sagline.files.whole import (
    check_folder,
    finished_files,
    made_folder,
    write_text,
    written_together,
    written_whole,
)


def test_a_file_appears_when_it_is_complete(tmp_path: Path) -> None:
    file = tmp_path / "run.nc"
    with written_whole(file) as partial:
        partial.write_bytes(b"half")
        assert not file.exists()
    assert file.read_bytes() == b"half"
    assert [entry.name for entry in tmp_path.iterdir()] == ["run.nc"]


@pytest.mark.parametrize("trouble", [KeyboardInterrupt, ValueError, OSError(28, "No space left on device")])
def test_trouble_keeps_what_was_there(tmp_path: Path, trouble: BaseException | type[BaseException]) -> None:
    file = tmp_path / "run.nc"
    file.write_bytes(b"before")

    def write() -> None:
        with written_whole(file) as partial:
            partial.write_bytes(b"half")
            raise trouble

    with pytest.raises((KeyboardInterrupt, ValueError, FileError)):
        write()
    assert file.read_bytes() == b"before"
    assert [entry.name for entry in tmp_path.iterdir()] == ["run.nc"]


def test_a_full_disk_is_named(tmp_path: Path) -> None:
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (1000, hard))
    try:
        with (
            pytest.raises(FileError, match=r"run\.nc: cannot be written \(File too large\)\. Check the permissions"),
            written_whole(tmp_path / "run.nc") as partial,
        ):
            partial.write_bytes(bytes(5000))
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    assert not list(tmp_path.iterdir())


def test_places_that_cannot_be_written(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    places = {
        tmp_path: "is a folder. Give the name of a file in it",
        tmp_path / "missing" / "run.nc": "No such file or directory.*Create the folder .*missing first",
        tmp_path / "file" / "run.nc": "Not a directory",
    }
    for place, message in places.items():
        with pytest.raises(FileError, match=message), written_whole(place):
            pytest.fail("there was nothing to write to")


def test_a_folder_is_checked_without_being_made(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    check_folder(tmp_path / "new" / "deep")
    assert not (tmp_path / "new").exists()
    with pytest.raises(FileError, match="file is a file, not a folder"):
        check_folder(tmp_path / "file" / "deep")
    with pytest.raises(FileError, match=r"cannot be created \(Not a directory\)"):
        made_folder(tmp_path / "file" / "deep")
    assert made_folder(tmp_path / "new" / "deep").is_dir()


def test_a_folder_without_permission(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("os.access", lambda *_: False)  # root may write anywhere, so it cannot be tried for real
    with pytest.raises(FileError, match="no permission in"):
        check_folder(tmp_path / "new")


def test_what_takes_the_files_name_is_on_the_disk(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    target, seen = tmp_path / "run.nc", []
    monkeypatch.setattr("os.fsync", lambda handle: seen.append((os.fstat(handle).st_size, target.exists())))
    write_text(target, "whole")
    assert seen == [(5, False)]  # all of it, before the name
    assert target.read_text() == "whole"


def test_permissions_stay_and_other_names_keep_what_was_there(tmp_path: Path) -> None:
    file, other = tmp_path / "run.nc", tmp_path / "other.nc"
    file.write_text("before")
    file.chmod(0o640)
    other.hardlink_to(file)
    write_text(file, "after")
    assert (file.read_text(), other.read_text()) == ("after", "before")
    assert stat.S_IMODE(file.stat().st_mode) == 0o640


def test_what_is_no_file_is_refused_and_stays(tmp_path: Path) -> None:
    for place, message, is_there in no_files(tmp_path):
        with pytest.raises(FileError, match=message):
            write_text(place, "text")
        assert is_there()
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


def no_files(folder: Path) -> list[tuple[Path, str, Callable[[], bool]]]:
    """Names that are taken: what is said of each, and whether it is still what it was."""
    names = ("folder", "pipe", "socket", "device", "data", "to", "nowhere")
    inside, pipe, plug, device, data, to, nowhere = (folder / name for name in names)
    inside.mkdir()
    os.mkfifo(pipe)
    with socket.socket(socket.AF_UNIX) as server, contextlib.chdir(folder):
        server.bind(plug.name)  # the name of a socket may have no more than about a hundred letters
    os.symlink(os.devnull, device)
    data.write_text("data")
    to.symlink_to(data)
    nowhere.symlink_to(folder / "missing")
    return [
        (inside, "folder: is a folder. Give the name of a file in it", inside.is_dir),
        (pipe, "pipe: is a pipe, not a file. Name a file", pipe.is_fifo),
        (plug, "socket: is a socket, not a file", plug.is_socket),
        (device, "device: is a link, to /dev/null. Name the file itself, or remove the link", device.is_symlink),
        (Path(os.devnull), "/dev/null: is a device, not a file", Path(os.devnull).is_char_device),
        (to, "to: is a link, to .*data. Name the file itself", to.is_symlink),
        (nowhere, "nowhere: is a link, to .*missing. Name the file", nowhere.is_symlink),
        (folder / ".", "is a folder", folder.is_dir),
        (folder / "..", "is a folder", folder.is_dir),
        (Path("."), "is a folder", folder.is_dir),
        (Path("/"), "is a folder", folder.is_dir),
    ]


@pytest.mark.parametrize("name", ["a\0b", "\ud800", "x" * 300, "x" * 5000, "data/run.nc", "loop/run.nc"])
def test_names_that_no_file_can_have(tmp_path: Path, name: str) -> None:
    (tmp_path / "data").touch()
    (tmp_path / "loop").symlink_to(tmp_path / "loop")
    before = sorted(entry.name for entry in tmp_path.iterdir())
    with pytest.raises(FileError, match="cannot be written"):
        write_text(tmp_path / name, "text")
    with pytest.raises(FileError, match=r"cannot be (written|created)"):
        check_folder(tmp_path / name)
    with pytest.raises(FileError, match="cannot be created"):
        made_folder(tmp_path / name)
    with pytest.raises(FileError, match=r"cannot be (written|created)"):
        check_folder(tmp_path / name / "deep")
    assert sorted(entry.name for entry in tmp_path.iterdir()) == before


def test_names_as_long_as_the_file_system_takes(tmp_path: Path) -> None:
    write_text(tmp_path / ("x" * 255), "text")
    assert (tmp_path / ("x" * 255)).read_text() == "text"


def test_a_file_that_is_write_protected(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "run.nc").write_text("before")
    monkeypatch.setattr("os.access", lambda *_: False)  # root may write to all
    with pytest.raises(FileError, match=r"is write-protected\. Change its permissions"):
        write_text(tmp_path / "run.nc", "after")
    assert (tmp_path / "run.nc").read_text() == "before"


def test_half_a_character_is_refused_before_anything_is_written(tmp_path: Path) -> None:
    with pytest.raises(FileError, match=r"run\.txt: cannot hold half a character \(U\+D800 in 'name: '…\)"):
        write_text(tmp_path / "run.txt", "name: \ud800")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("trouble", [None, KeyboardInterrupt, OSError(28, "No space left on device")])
def test_files_that_belong_together(tmp_path: Path, trouble: BaseException | type[BaseException] | None) -> None:
    (tmp_path / "page.html").write_text("before")

    def write() -> None:
        with written_together(tmp_path, ["page.html", "page.json"]) as (page, data):
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


def test_the_file_that_failed_is_named(tmp_path: Path) -> None:
    def write() -> None:
        with written_together(tmp_path, ["page.html", "page.json"]) as (_, data):
            data.unlink()
            data.mkdir()
            data.open("rb+")

    with pytest.raises(FileError, match=r"page\.json: cannot be written \(Is a directory\)"):
        write()
    assert contents(tmp_path) == {}


def test_what_was_finished_can_be_named(tmp_path: Path) -> None:
    def write() -> None:
        write_text(tmp_path / "a.txt", "a")
        with written_together(tmp_path, ["b", "c"]):
            pass
        write_text(tmp_path / "missing" / "d.txt", "d")

    with finished_files() as finished, pytest.raises(FileError):
        write()
    write_text(tmp_path / "later.txt", "")
    assert [file.name for file in finished] == ["a.txt", "b", "c"]


def contents(folder: Path) -> dict[str, str]:
    return {entry.name: entry.read_text() for entry in folder.iterdir()}
