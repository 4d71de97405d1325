"""Messages of errors: one line of less than 300 characters for any content."""

from __future__ import annotations

import pickle

import numpy as np
import pytest

from sagline import FileError, InvalidValueError
from sagline.core.errors import MOST, nearest, printable, shortened

SEED = 7


def test_an_error_is_one_short_line_for_any_content() -> None:
    long = "x" * 5000
    for error in (
        InvalidValueError(long, long, long, long),
        InvalidValueError("mass", "\x1b[2J\r\n\0", "a\u2028b", "c\ud800d\u202ee"),
        FileError("folder/" + long, long, "Next."),
        FileError("a\nb\x07.yaml", "first\nsecond", "\x9b31mNext."),
    ):
        text = str(error)
        assert len(text) < 300
        assert text == printable(text)
        assert text.encode("utf-8").isascii() or "…" in text


def test_short_parts_are_kept_and_long_parts_are_cut() -> None:
    begin, end, step = "name is ", "; allowed: a word", "Correct name."
    text = str(FileError("robot.yaml", begin + "y" * 1000 + end, step))
    assert text.startswith(f"robot.yaml: {begin}yyy")
    assert text.endswith(f"yyy{end}. {step}")
    assert len(text) == MOST
    assert str(InvalidValueError("a", "b", "c", "D.")) == "a is b; allowed: c. D."


@pytest.mark.parametrize("long", range(4))
def test_a_long_part_loses_its_middle(long: int) -> None:
    parts = ["the item", "the value", "what is allowed", "What to do."]
    parts[long] = f"begin{'x' * 5000}end"
    text = str(InvalidValueError(*parts))
    assert len(text) == MOST
    assert all(part in text for k, part in enumerate(parts) if k != long)
    assert "beginx" in text
    assert "…x" in text
    assert "xend" in text


def test_texts_of_any_length_fit_together() -> None:
    generator = np.random.default_rng(SEED)
    for _ in range(400):
        parts = ["x" * int(size) for size in generator.integers(0, 400, size=generator.integers(1, 5))]
        fitted = shortened(parts, room=280)
        assert sum(map(len, fitted)) == min(280, sum(map(len, parts)))
        if sum(map(len, parts)) <= 280:
            assert fitted == parts


def test_attributes_of_errors_are_complete() -> None:
    error = InvalidValueError("mass", "z" * 1000, "> 0 kg", "Correct mass.")
    assert error.value == "z" * 1000
    again = pickle.loads(pickle.dumps(FileError.of("a.yaml", error)))
    assert (again.path.name, again.next_step) == ("a.yaml", "Correct mass.")
    assert (again.item, again.value, again.allowed) == ("mass", error.value, "> 0 kg")


@pytest.mark.parametrize(
    "text", ["", "plain", "Größe µ ² — …", "日本語", "a b\u00a0c\u202fd", "−7.1 µm · 3 × 4", "عربي"]
)
def test_printable_text_is_unchanged(text: str) -> None:
    assert printable(text) == text


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        ("\x1b]0;title\x07", r"\x1b]0;title\x07"),
        ("a\tb\nc\rd", r"a\tb\nc\rd"),
        ("\x9b31m\x7f", r"\x9b31m\x7f"),
        ("\ud83d", r"\ud83d"),
        ("\u202egnp.exe\u2066", r"\u202egnp.exe\u2066"),
        ("\u2028\u2029\ufeff\ufffe", r"\u2028\u2029\ufeff\ufffe"),
        ("\u200e\u200f\u061c\u200b\u200d", r"\u200e\u200f\u061c\u200b\u200d"),
        ("\ue000\U000e0001", r"\ue000\U000e0001"),
    ],
)
def test_unprintable_characters_are_escaped(text: str, shown: str) -> None:
    assert printable(text) == shown


def test_permitted_characters_are_unchanged() -> None:
    assert printable("a\nb\x1b", "\n") == "a\nb\\x1b"


def test_every_control_character_is_escaped() -> None:
    for code in [*range(0x20), *range(0x7F, 0xA0), 0xDCFF]:
        shown = printable(f"a{chr(code)}b")
        assert shown.isprintable(), hex(code)
        assert shown.startswith("a\\"), hex(code)


def test_only_similar_words_are_suggested() -> None:
    robots = ["article-mixed", "cogiro", "fast", "ipanema-1"]
    assert nearest("cogero", robots) == "cogiro"
    assert nearest("IPANEMA1", robots) == "ipanema-1"
    for word in ("nothere", "", "xyz", "robot", "c", "x" * 100_000):
        assert nearest(word, robots) is None
    assert nearest("cogiro", []) is None
