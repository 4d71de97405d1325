"""What sagline raises: one family of exceptions that carry their data."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

MOST = 298  # characters of a message
LEAST = 30  # of each of its parts that are kept, whatever the others take


class SaglineError(Exception):
    """Base of everything sagline raises on purpose; its text says what to do next."""


class InvalidValueError(SaglineError, ValueError):
    """A value that cannot be worked with.

    Attributes:
        item: What the value belongs to, in the reader's words ("cable 3: linear_density").
        value: The offending value, as text, with its unit.
        allowed: The range or the kind of value that would do.
        next_step: What to do about it.
    """

    def __init__(self, item: str, value: object, allowed: str, next_step: str) -> None:
        """Compose the message from its four parts."""
        super().__init__(item, value, allowed, next_step)
        self.item = item
        self.value = value
        self.allowed = allowed
        self.next_step = next_step

    def __str__(self) -> str:
        """One sentence: item, value, allowed range, next step; one line, however long its parts are."""
        parts = (str(self.item), str(self.value), str(self.allowed), str(self.next_step))
        item, value, allowed, next_step = shortened(parts, room=MOST - len(" is ; allowed: . "))
        return f"{item} is {value}; allowed: {allowed}. {next_step}"


class CableGeometryError(InvalidValueError):
    """The two ends of a cable are placed where no cable can be."""


class NoSuchEntryError(InvalidValueError, IndexError):
    """An index that names no entry of a batch."""


class NoBatchError(InvalidValueError, TypeError):
    """A single pose, cable or equilibrium that was taken for a batch of them."""


class FileError(SaglineError):
    """A file that cannot be read or written.

    Attributes:
        path: The file or folder.
        reason: What is wrong with it.
        next_step: What to do about it.
    """

    def __init__(self, path: Path | str, reason: str, next_step: str) -> None:
        """Compose the message from its three parts."""
        super().__init__(path, reason, next_step)
        self.path = Path(path)
        self.reason = reason
        self.next_step = next_step

    def __str__(self) -> str:
        """One sentence: file, reason, next step; one line, however long its parts are."""
        path, reason, next_step = shortened((str(self.path), self.reason, self.next_step), room=MOST - len(": . "))
        return f"{path}: {reason}. {next_step}"


def shortened(parts: Sequence[str], room: int) -> list[str]:
    """Texts on one line that fit together: what does not print is written out, the middle of the longest left out.

    Args:
        parts: The texts.
        room: Characters they may have together.

    Returns:
        As many texts.
    """
    texts = [printable(part) for part in parts]
    while (excess := sum(map(len, texts)) - room) > 0:
        longest = max(range(len(texts)), key=lambda k: len(texts[k]))
        others = sorted(map(len, texts))[-2] if len(texts) > 1 else 0
        size = max(len(texts[longest]) - excess, min(others, len(texts[longest]) - 1), LEAST)
        texts[longest] = (
            f"{texts[longest][: size // 2 - 1]}…{texts[longest][len(texts[longest]) - (size - size // 2) :]}"
        )
    return texts


def printable(text: str) -> str:
    """A text on one line without control characters, lone surrogates and the like: those are written as escapes.

    Args:
        text: The text; line breaks become spaces.

    Returns:
        The text itself, where it is one.
    """
    if text.isprintable():
        return text
    flat = " ".join(text.split())
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode("ascii") for c in flat)
