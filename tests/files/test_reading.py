import os
import re
from pathlib import Path

import pytest
from syrupy.assertion import SnapshotAssertion

from sagline import FileError
from sagline.files.reading import HDF_BEGIN, read_bytes, read_text
from tests.files.wording import wording
from tests.refusal import refused


@pytest.mark.parametrize("mark", [b"", b"\xef\xbb\xbf"])
def test_text_in_utf_8(tmp_path: Path, mark: bytes) -> None:
    file = tmp_path / "a.txt"
    file.write_bytes(mark + "Größe\r\n".encode())
    assert read_text(file, 1.0) == "Größe\r\n"


@pytest.mark.parametrize(
    "data",
    [
        "name: a\n".encode("utf-16"),
        "name: a\n".encode("utf-16-be"),
        "name: a\n".encode("utf-32"),
        "a\nb\nGröße\n".encode("latin-1"),
        b"a\0",
        b"\xed\xa0\x80",
        b"a" * 1_000_001,
        b"a" * 3_000_000,
        HDF_BEGIN + b"a" * 3_000_000,
    ],
    ids=["UTF-16", "UTF-16 without a mark", "UTF-32", "Latin-1", "zero byte", "surrogate", "1 MB", "3 MB", "NetCDF"],
)
def test_other_content_is_refused(tmp_path: Path, data: bytes, snapshot: SnapshotAssertion) -> None:
    file = tmp_path / "a.txt"
    file.write_bytes(data)
    with refused(kind=FileError, file=file) as caught:
        read_text(file, 1.0)
    assert wording(caught.value, tmp_path) == snapshot


def test_special_files_are_not_opened(tmp_path: Path) -> None:
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    for path in (pipe, Path("/dev/zero"), Path("/dev/stdin")):
        with refused(kind=FileError, file=path) as caught:
            read_bytes(path, 1.0)
        assert re.search("pipe|device|socket|read", caught.value.reason)
    with pytest.raises(FileError, match="folder"):
        read_bytes(tmp_path, 1.0)


@pytest.mark.parametrize("name", ["none", "a" * 300, "a\0b", "a\ud800b", "a/" * 3000])
def test_impossible_names(tmp_path: Path, name: str) -> None:
    path = tmp_path / name
    assert not os.path.exists(path)
    with refused(kind=FileError, file=path) as caught:
        read_bytes(path, 1.0)
    assert len(str(caught.value)) < 300


def test_a_growing_file_is_refused() -> None:
    if not Path("/proc/self/pagemap").exists():
        pytest.skip("only Linux has one")
    with pytest.raises(FileError):
        read_text(Path("/proc/self/pagemap"), 1.0)
