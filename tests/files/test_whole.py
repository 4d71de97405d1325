import os
import resource
from pathlib import Path

import pytest

from sagline.errors import FileError
from sagline.files.whole import check_folder, made_folder, write_text, written_whole


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
