import os
from pathlib import Path

import pytest

from sagline.errors import FileError
from sagline.files.text import exists, read_bytes, read_text


@pytest.mark.parametrize("mark", [b"", b"\xef\xbb\xbf"])
def test_text_in_utf_8(tmp_path: Path, mark: bytes) -> None:
    file = tmp_path / "a.txt"
    file.write_bytes(mark + "Größe\r\n".encode())
    assert read_text(file, 1.0) == "Größe\r\n"


@pytest.mark.parametrize(
    ("data", "message"),
    [
        ("name: a\n".encode("utf-16"), r"is UTF-16 text, not UTF-8 text\. Save it again as UTF-8"),
        ("name: a\n".encode("utf-16-be"), "holds zero bytes"),
        ("name: a\n".encode("utf-32"), "UTF-16 text"),
        ("a\nb\nGröße\n".encode("latin-1"), r"is not UTF-8 text \(line 3\)"),
        (b"a\0", "holds zero bytes"),
        (b"\xed\xa0\x80", "is not UTF-8 text"),  # a surrogate
        (b"a" * 1_000_001, r"has 1 MB; allowed: 1 MB"),
        (b"a" * 3_000_000, r"has 3 MB; allowed: 1 MB"),
    ],
)
def test_what_is_no_such_text(tmp_path: Path, data: bytes, message: str) -> None:
    file = tmp_path / "a.txt"
    file.write_bytes(data)
    with pytest.raises(FileError, match=message):
        read_text(file, 1.0)


def test_what_is_no_regular_file_is_not_opened(tmp_path: Path) -> None:
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    for path in (pipe, Path("/dev/zero"), Path("/dev/stdin")):
        with pytest.raises(FileError, match=r"is a (pipe|device|socket), not a file|cannot be read"):
            read_bytes(path, 1.0)
    with pytest.raises(FileError, match=r"is a folder\. Give the name of a file in it"):
        read_bytes(tmp_path, 1.0)


@pytest.mark.parametrize("name", ["none", "a" * 300, "a\0b", "a\ud800b", "a/" * 3000])
def test_names_that_no_file_has(tmp_path: Path, name: str) -> None:
    path = tmp_path / name
    assert not exists(path)
    with pytest.raises(FileError, match="cannot be read") as caught:
        read_bytes(path, 1.0)
    assert len(str(caught.value)) < 300


def test_a_file_that_grows_without_saying_its_size_ends() -> None:
    if not Path("/proc/self/pagemap").exists():
        pytest.skip("only Linux has one")
    with pytest.raises(FileError):
        read_text(Path("/proc/self/pagemap"), 1.0)
