"""Messages of errors: one line of less than 300 characters, whatever they are about."""

from __future__ import annotations

import numpy as np
import pytest

from sagline.errors import FileError, InvalidValueError, shortened

SEED = 7


def test_a_short_message_is_left_alone() -> None:
    error = InvalidValueError("mass", "-1 kg", "> 0 kg", "Correct mass.")
    assert str(error) == "mass is -1 kg; allowed: > 0 kg. Correct mass."
    assert str(FileError("robot.yaml", "is empty", "Write it again.")) == "robot.yaml: is empty. Write it again."


@pytest.mark.parametrize("long", range(4))
def test_a_long_part_loses_its_middle_and_the_others_nothing(long: int) -> None:
    parts = ["the item", "the value", "what is allowed", "What to do."]
    parts[long] = f"begin{'x' * 5000}end"
    text = str(InvalidValueError(*parts))
    assert len(text) < 300
    assert all(part in text for k, part in enumerate(parts) if k != long)
    assert "beginx" in text
    assert "…x" in text
    assert "xend" in text


def test_what_does_not_print_is_written_out() -> None:
    text = str(InvalidValueError("robot\n\x1b[31mred", "\ud800", "\x00", "a\tb\u202e."))
    assert text == "robot \\x1b[31mred is \\ud800; allowed: \\x00. a b\\u202e."


def test_texts_of_any_length_fit_together() -> None:
    generator = np.random.default_rng(SEED)
    for _ in range(2000):
        parts = ["x" * int(size) for size in generator.integers(0, 400, size=generator.integers(1, 5))]
        fitted = shortened(parts, room=280)
        assert sum(map(len, fitted)) <= 280
        if sum(map(len, parts)) <= 280:
            assert fitted == parts
