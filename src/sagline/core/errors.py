"""Exceptions and warnings of sagline: one family, each with its data and a message of one line."""

from __future__ import annotations

import unicodedata
from collections.abc import Iterable, Sequence
from difflib import get_close_matches
from pathlib import Path
from typing import Final

_WORD: Final = 60  # letters of what was given that are looked at for a word that was meant
LONGEST: Final = 299  # characters of a line on a terminal; more is not read, and floods it
HEAD: Final = "Error: "  # prefix of a message
MOST: Final = LONGEST - len(HEAD)  # characters of a message
LEAST: Final = 30  # of each of its parts that are kept, whatever the others take


class SaglineError(Exception):
    """Base of everything sagline raises on purpose; its text says what to do next."""


class SaglineWarning(UserWarning):
    """Something that stands, but is to be taken with care; its text says why and what to do."""


class InvalidValueError(SaglineError, ValueError):
    """A value that cannot be worked with.

    Attributes:
        item: Item of the value, in the user's words ("cable 3: linear_density").
        value: The offending value, as text, with its unit.
        allowed: The range or the kind of value that would do.
        next_step: Next step for the user.
    """

    def __init__(self, item: str, value: object, allowed: str, next_step: str) -> None:
        """Compose the message from its four parts."""
        super().__init__(item, value, allowed, next_step)
        self.item = item
        self.value = value
        self.allowed = allowed
        self.next_step = next_step

    def __str__(self) -> str:
        """One line: item, value, allowed range, next step."""
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
        reason: Description of the problem.
        next_step: Action that solves it.
        item: Part of the file that is wrong ("cable 3: linear_density", "line 12"); the path if it is the whole file.
        value: Value of the item, as text with its unit; the reason if the value is not known.
        allowed: Allowed values of the item; empty if not known.
    """

    def __init__(self, path: Path | str, reason: str, next_step: str, *, item: str | None = None) -> None:
        """Compose the message from its three parts."""
        super().__init__(path, reason, next_step)
        self.path = Path(path)
        self.reason = reason
        self.next_step = next_step
        self.item = str(path) if item is None else item
        self.value = reason
        self.allowed = ""

    @classmethod
    def of(cls, path: Path | str, error: InvalidValueError) -> FileError:
        """The error of a value in a file.

        Args:
            path: The file.
            error: The error of a value in it.

        Returns:
            The error, to be raised.
        """
        found = cls(path, f"{error.item} is {error.value}; allowed: {error.allowed}", error.next_step)
        found.item, found.value, found.allowed = str(error.item), str(error.value), str(error.allowed)
        return found

    @classmethod
    def not_installed(cls, package: str | None, needed: str, extra: str) -> FileError:
        """A package that is not there, and how to have it.

        Args:
            package: Its name.
            needed: By whom, "Meshes need it" for instance.
            extra: The extra of sagline that brings it.

        Returns:
            The error, to be raised.
        """
        return cls(f"package {package}", "is not installed", f'{needed}: pip install "sagline[{extra}]"')

    def __str__(self) -> str:
        """One line: file, reason, next step."""
        path, reason, next_step = shortened((str(self.path), self.reason, self.next_step), room=MOST - len(": . "))
        return f"{path}: {reason}. {next_step}"


def printable(text: str, kept: str = "") -> str:
    r"""A text as a terminal may be given it: nothing in it moves the cursor, hides a letter or cannot be written.

    text: any text, from a file for instance; kept: characters that may stay, line ends for instance. Returns the text,
    with control characters, line ends, lone surrogates and all else that is not seen written out as Python writes them.

    Examples:
        >>> from sagline.core.errors import printable
        >>> print(printable("a\x1b[31m\nb"))
        a\x1b[31m\nb
    """
    if text.isprintable():
        return text
    return "".join(c if c in kept or is_seen(c) else c.encode("unicode_escape").decode() for c in text)


def is_seen(character: str) -> bool:
    """True for a character that is visible, or a space of any width.

    Invisible formatting marks, such as U+200E and U+200B, are not printed.
    """
    return character.isprintable() or unicodedata.category(character) == "Zs"


def nearest(word: str, known: Iterable[str]) -> str | None:
    """The known word that was probably meant, for "Did you mean".

    Returns the nearest known word; None where none is near.

    Examples:
        >>> from sagline.core.errors import nearest
        >>> nearest("cogero", ["cogiro", "fast"]), nearest("nothere", ["cogiro", "fast"])
        ('cogiro', None)
    """
    folded = {other.lower(): other for other in known}
    near = get_close_matches(word[:_WORD].lower(), folded, n=1)
    return folded[near[0]] if near else None


def shortened(parts: Sequence[str], room: int) -> list[str]:
    """Texts that fit together on one line: what does not print is written out, the middle of the longest left out."""
    texts = [printable(part) for part in parts]
    while (excess := sum(map(len, texts)) - room) > 0:
        k = max(range(len(texts)), key=lambda k: len(texts[k]))
        others = max((len(text) for other, text in enumerate(texts) if other != k), default=0)
        size = max(len(texts[k]) - excess, min(others, len(texts[k]) - 1), LEAST)
        end = size // 2
        texts[k] = f"{texts[k][: size - end - 1]}…{texts[k][-end:]}"
    return texts
