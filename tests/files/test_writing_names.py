import unicodedata
from hashlib import sha256

import hypothesis.strategies as st
import pytest
from hypothesis import example, given

import sagline as sl
from sagline.files.writing import file_stem

# reserved names of Windows, with any suffix: learn.microsoft.com, "Naming Files, Paths, Namespaces"
DEVICES = {"CON", "PRN", "AUX", "NUL", *(f"{port}{k}" for port in ("COM", "LPT") for k in "0123456789¹²³")}
ANY_TEXT = st.text(st.characters(exclude_categories=()), max_size=400)  # half characters as well


def digits(name: str) -> str:
    return sha256(name.encode("utf-8", "surrogatepass")).hexdigest()[:8]


@pytest.mark.parametrize("name", sl.robot_names())
def test_valid_names_are_unchanged(name: str) -> None:
    assert file_stem(name) == name
    assert file_stem(name, "poses") == f"{name}-poses"


@pytest.mark.parametrize(
    ("name", "stem"),
    [
        ("hall camera", "hall-camera"),
        ("机器人 v2.1_b", "机器人-v2.1_b"),
        ("e\u0301", "é"),
        ("../../evil", f"evil-{digits('../../evil')}"),
        ("", f"robot-{digits('')}"),
        ("\ud800", f"robot-{digits(chr(0xD800))}"),
        ("con.x", f"robot-con.x-{digits('con.x')}"),
        ("x" * 300, f"{'x' * 120}-{digits('x' * 300)}"),
        ("a/b", f"a-b-{digits('a/b')}"),
        ("a\\b", f"a-b-{digits(chr(97) + chr(92) + 'b')}"),
    ],
)
def test_other_names_are_converted(name: str, stem: str) -> None:
    assert file_stem(name) == stem
    assert file_stem(name, "catenary") == f"{stem}-catenary"


@given(ANY_TEXT)
@example("")
@example(".")
@example("..")
@example("-rf")
@example(".hidden")
@example("C:\\evil")
@example("NUL.yaml")
@example("Lpt1")
@example("a.")
@example("a\nb")
@example("a\u202eb")
@example("~root")
@example("\u0301")
@example("_")
@example("a\u200db")
def test_any_name_of_a_robot(name: str) -> None:
    stem = file_stem(name)
    assert len(stem.encode()) <= 140
    assert not set(stem) & {chr(code) for code in range(33)} | set(stem) & set('/\\:*?"<>|~$')
    assert all(c.isprintable() for c in stem)
    assert stem[0] not in ".-"
    assert stem[-1] not in "."
    assert stem.split(".")[0].upper() not in DEVICES


@given(ANY_TEXT, ANY_TEXT)
@example("a/b", "a b")
@example("a\0", "a")
@example("x" * 200 + "a", "x" * 200 + "b")
def test_two_robots_have_different_files(one: str, other: str) -> None:
    same = unicodedata.normalize("NFC", one).replace(" ", "-") == unicodedata.normalize("NFC", other).replace(" ", "-")
    assert (file_stem(one) == file_stem(other)) <= same
