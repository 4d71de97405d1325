from pathlib import Path

import pytest
from syrupy.assertion import SnapshotAssertion

from sagline import FileError, InvalidValueError
from sagline.files.robot_xml import number_of_text, numbers_of_text, read_xml
from tests.files.wording import wording
from tests.refusal import refused


def written(folder: Path, text: bytes) -> Path:
    file = folder / "robot.xml"
    file.write_bytes(text)
    return file


def test_a_document_type_is_skipped_and_not_opened(tmp_path: Path) -> None:
    text = b'<!DOCTYPE cables SYSTEM "no_folder/cables.dtd" [<!ATTLIST a id ID #REQUIRED>]><cables><a>7</a></cables>'
    root = read_xml(written(tmp_path, text))
    assert number_of_text(root.findtext("a"), "a", "m") == 7.0


@pytest.mark.parametrize(
    "text",
    [
        b'<!DOCTYPE a [<!ENTITY b "bbbb">]><a>&b;</a>',
        b'<!DOCTYPE a [<!ENTITY b SYSTEM "file:///etc/hostname">]><a>&b;</a>',
        b"<!DOCTYPE a [<!ENTITY % b \"<!ENTITY c 'd'>\"> %b;]><a/>",
        b"<a><b></a>",
        b"<a><b>",
        b"",
        b"mass: 3",
        b'<?xml version="1.0" encoding="none-such"?><a/>',
        b"<a>\xff\xfe</a>",
        b'<?xml version="1.0" encoding="utf-8"?><a>\xe4</a>',
        b'<?xml version="1.0" encoding="us-ascii"?><a>\xe4</a>',
        b'<?xml version="1.0" encoding="UTF-16"?><a>x</a>',
        b"<a><b></b>",
        b"<a><b",
        b"<a><!-- b",
    ],
    ids=range(15),
)
def test_refusals(tmp_path: Path, text: bytes, snapshot: SnapshotAssertion) -> None:
    file = written(tmp_path, text)
    with refused(kind=FileError, file=file) as caught:
        read_xml(file)
    assert wording(caught.value, tmp_path) == snapshot


def test_missing_file_and_folder(tmp_path: Path) -> None:
    for path in (tmp_path / "none.xml", tmp_path):
        with refused(kind=FileError, file=path):
            read_xml(path)


@pytest.mark.parametrize(
    ("text", "shown"),
    [(None, "missing"), ("  ", "missing"), ("1 2", "'1 2'"), ("1 2 x", "'1 2 x'"), ("1 nan 3", "'1 nan 3'")],
)
def test_invalid_numbers(text: str | None, shown: str) -> None:
    with refused("place", shown, "3 numbers between blanks in m", kind=InvalidValueError):
        numbers_of_text(text, 3, "place", "m")
