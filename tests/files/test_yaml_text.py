import math
import re
from pathlib import Path

import pytest
import yaml
from syrupy.assertion import SnapshotAssertion

from sagline import FileError
from sagline.files.yaml_text import dump_mapping, parse_mapping
from tests.effort import least_seconds
from tests.files.wording import wording
from tests.refusal import refused
from tests.tiers import extended


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("10", 10),
        ("+010", 10),  # YAML 1.1 reads 8
        ("-2.50", -2.5),
        ("1e3", 1000.0),  # YAML 1.1 reads text
        (".5E-1", 0.05),
        ("2.", 2.0),
        (".inf", math.inf),
        ("-inf", -math.inf),
        ("!!float 2", 2),
        # YAML 1.1 reads 90, 1000, 16, 5, 3, 2020-01-01, True, False, True
        ("1:30", "1:30"),
        ("1_000", "1_000"),
        ("0x10", "0x10"),
        ("0b101", "0b101"),
        ("0o3", "0o3"),
        ("2020-01-01", "2020-01-01"),
        ("yes", "yes"),
        ("off", "off"),
        ("On", "On"),
        ("٣", "٣"),
        ("1,5", "1,5"),
        ("'5'", "5"),
        ('"5"', "5"),
        ("!!str 5", "5"),
        ("!!int 0x10", "0x10"),
        ("true", True),
        ("null", None),
        ("", None),
        ("=", "="),
        ("1e400", 1.7976931348623157e308),
        ("9" * 70, "9" * 70),
    ],
)
def test_a_number_is_a_plain_number_and_a_word_is_a_word(text: str, value: object) -> None:
    found = parse_mapping(f"a: {text}", "x.yaml")["a"]
    assert found == value
    assert type(found) is type(value)


def test_limited_aliases_and_merges() -> None:
    text = "base: &b {x: 1, y: [1, 2]}\nsame: *b\nmore: {<<: *b, x: 3}\n"
    assert parse_mapping(text, "x.yaml")["more"] == {"x": 3, "y": [1, 2]}
    assert parse_mapping(text, "x.yaml")["same"] == {"x": 1, "y": [1, 2]}


def _bomb(first: str, item: str, between: str) -> str:
    lines = [f"a: &a {first}"]
    lines += [f"{c}: &{c} {item.format(between.join(['*' + chr(ord(c) - 1)] * 9))}" for c in "bcdefghi"]
    return "\n".join(lines)


@pytest.mark.parametrize(
    "text",
    [
        _bomb("[x, x, x, x, x, x, x, x, x]", "[{}]", ","),
        _bomb("{k: x}", "{{<<: [{}]}}", ","),
        _bomb("x", "{{p: [{0}], q: [{0}]}}", ","),
        "a: &a [*a]",
        "a: &a {b: *a}",
        "a: &a {<<: *a}",
        "a: &a\n  ? *a\n  : 1",
        pytest.param("a: &a0 [x]\n" + "".join(f"b{k}: &a{k} [*a{k - 1}]\n" for k in range(1, 3000)), marks=extended),
        pytest.param("a: " + "[" * 100_000, marks=extended),
        "a: " + "{a: " * 30_000,
        "- " * 50_000,
        "? " * 50_000,
        "a: " + "[" * 21 + "]" * 21,
        "".join(" " * k + "a:\n" for k in range(700)),
        pytest.param("a: [" + "1," * 100_000 + "]", marks=extended),
        pytest.param("a: [" + "[]," * 100_000, marks=extended),
    ],
)
def test_reading_does_not_expand_the_text(text: str) -> None:
    def read() -> None:
        with pytest.raises(FileError) as caught:
            parse_mapping(text, "x.yaml")
        told.append(str(caught.value))

    told: list[str] = []
    assert least_seconds(read, 2.0) < 2.0
    assert re.search(r"alias|20 levels", told[0])


@pytest.mark.parametrize(
    "text",
    [
        "a: 1\nb: 2\na: 3",
        'a: 1\n"a": 3',
        "<<: {a: 1}\n<<: {a: 2}",
        "a: !!python/object/apply:os.system [ls]",
        "a: !!binary eA==",
        "a: !!set {b, c}",
        "a: !!map [b]",
        "{[a]: 1}",
        'a: "\\UFFFFFFFF"',
        "a: b\x1b",
        "a: b\n\n\x00",
        "--- {a: 1}\n--- {b: 1}",
        "a: &b 1\nc: &b 2",
        "a: *b",
        "a: !mine 3",
        "a: 1\n? [b]\n: 2",
        "a:\n\tb: 1",
        "a:\n  - b\n\t- c",
        "a: b: c\nd: e",
        "a: [1, 2\nb: 3\nc: 4",
        "a: @b\nc: 1",
        "a: [1, 2",
        "a: 'b\n\n",
        "a: 1\nb",
        "- a",
        "a",
        "# nothing",
    ],
    ids=range(27),
)
def test_other_yaml_is_refused(text: str, snapshot: SnapshotAssertion) -> None:
    with refused(kind=FileError, file="x.yaml") as caught:
        parse_mapping(text, "x.yaml")
    assert wording(caught.value, Path()) == snapshot


WORDS = (
    *[
        "1e5",
        "NAN",
        "nan",
        ".nan",
        "NaN",
        "inf",
        "-inf",
        "Inf",
        "+.INF",
        "12",
        "-0.5",
        "1.",
        ".5",
        "+3",
        "010",
        "1_000",
        "0x10",
        "1:30",
        "2024-05-01",
        "yes",
        "no",
        "on",
        "off",
        "y",
    ],
    *[
        "true",
        "False",
        "TRUE",
        "null",
        "~",
        "<<",
        "=",
        "#a",
        "&a",
        "*a",
        "!a",
        "[a",
        "{a",
        "%a",
        "@a",
        "`a",
        "?",
        ":",
        "-",
        "µ",
        "名",
        "1e400",
    ],
    *("", " ", " a ", "1e5 ", "- a", "a: b", "a #b", "'", '"', "a\nb", "a\tb", "9" * 60, "9" * 61),
)


@pytest.mark.parametrize("word", WORDS)
def test_texts_are_kept(word: str) -> None:
    data = {"name": word, word: [word, {"in": word}]}
    for given in (data, {"outer": data}):
        text = dump_mapping(given)
        assert parse_mapping(text, "here") == given
        assert yaml.safe_load(text) == given
        assert "!!" not in text


def test_numbers_are_kept() -> None:
    numbers = [1e5, -0.0, 0.1 + 0.2, 1e-320, 1e22, 1e300, 5e-324, float("inf"), 12, -7, True, False, None]
    found = parse_mapping(dump_mapping({"numbers": numbers}), "here")["numbers"]
    assert repr(found) == repr(numbers)
