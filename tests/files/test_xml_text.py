import re
from pathlib import Path

import pytest

from sagline.errors import FileError, InvalidValueError
from sagline.files.xml_text import number, numbers, read_xml


def written(folder: Path, text: bytes) -> Path:
    file = folder / "robot.xml"
    file.write_bytes(text)
    return file


def test_a_document_type_is_skipped_and_not_opened(tmp_path: Path) -> None:
    text = b'<!DOCTYPE cables SYSTEM "no_folder/cables.dtd" [<!ATTLIST a id ID #REQUIRED>]><cables><a>7</a></cables>'
    root = read_xml(written(tmp_path, text))
    assert number(root.findtext("a"), "a", "m") == 7.0


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (b'<!DOCTYPE a [<!ENTITY b "bbbb">]><a>&b;</a>', "declares the entity b"),
        (b'<!DOCTYPE a [<!ENTITY b SYSTEM "file:///etc/hostname">]><a>&b;</a>', "declares the entity b"),
        (b"<!DOCTYPE a [<!ENTITY % b \"<!ENTITY c 'd'>\"> %b;]><a/>", "declares the entity b"),
        (b"<a><b></a>", "is no complete XML"),
        (b"<a><b>", "is no complete XML"),
        (b"", "is empty"),
        (b"mass: 3", "is no XML file. Check"),
        (b'<?xml version="1.0" encoding="none-such"?><a/>', "is in an unknown encoding, none-such. Save it as UTF-8"),
        (b"<a>\xff\xfe</a>", "is not utf-8 text, as an XML file that says nothing must be. Save it as UTF-8"),
        (b'<?xml version="1.0" encoding="utf-8"?><a>\xe4</a>', "is not utf-8 text, as .* says so must be"),
        (b'<?xml version="1.0" encoding="us-ascii"?><a>\xe4</a>', "is not us-ascii text"),
        (b'<?xml version="1.0" encoding="UTF-16"?><a>x</a>', "is not UTF-16 text"),
        (b"<a><b></b>", "it may have been cut off"),
        (b"<a><b", "it may have been cut off"),
        (b"<a><!-- b", "it may have been cut off"),
        (b"<a><b></a>", "mismatched tag.*and correct it there"),
    ],
)
def test_what_is_refused(tmp_path: Path, text: bytes, message: str) -> None:
    with pytest.raises(FileError, match=message):
        read_xml(written(tmp_path, text))


def test_missing_file_and_folder(tmp_path: Path) -> None:
    for path, message in ((tmp_path / "none.xml", "cannot be read"), (tmp_path, "is a folder")):
        with pytest.raises(FileError, match=message):
            read_xml(path)


@pytest.mark.parametrize(
    ("text", "shown"),
    [(None, "missing"), ("  ", "missing"), ("1 2", "'1 2'"), ("1 2 x", "'1 2 x'"), ("1 nan 3", "'1 nan 3'")],
)
def test_numbers_that_are_none(text: str | None, shown: str) -> None:
    with pytest.raises(InvalidValueError, match=re.escape(f"place is {shown}; allowed: 3 numbers between blanks in m")):
        numbers(text, 3, "place", "m")
