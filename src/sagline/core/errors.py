"""Exceptions and warnings of sagline, which have data fields and a message of one line."""

from __future__ import annotations

import unicodedata
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from difflib import get_close_matches
from pathlib import Path
from typing import ClassVar, Final

_WORD: Final = 60  # number of first characters of a text that are compared with known words
LONGEST: Final = 299  # largest number of characters of a printed message; a longer message is shortened
HEAD: Final = "Error: "  # prefix of a printed message
MOST: Final = LONGEST - len(HEAD)  # largest number of characters of a message without prefix
LEAST: Final = 30  # smallest number of characters of each part of a shortened message


class SaglineError(Exception):
    """Base class of all exceptions that sagline raises on purpose; the text of each states the next step."""


class SaglineWarning(UserWarning):
    """Warning that a valid result needs attention; the text states the reason and the next step."""


class InvalidValueError(SaglineError, ValueError):
    """A value that is not allowed.

    Attributes:
        item: Name of the quantity as the user has written it, such as "cable 3: linear_density".
        value: The refused value, as text, with its unit.
        allowed: The allowed range or type of the value.
        next_step: Next step for the user.
    """

    def __init__(self, item: str, value: object, allowed: str, next_step: str) -> None:
        """Create an error with a message of four parts."""
        super().__init__(item, value, allowed, next_step)
        self.item = item
        self.value = value
        self.allowed = allowed
        self.next_step = next_step

    def __str__(self) -> str:
        """Message in one line: item, value, allowed range, next step."""
        others, room = [str(part) for part in (self.item, self.value, self.next_step)], MOST - len(" is ; allowed: . ")
        allowed = first_words(str(self.allowed), room - sum(map(len, others)))
        item, value, next_step, allowed = shortened((*others, allowed), room)
        return f"{item} is {value}; allowed: {allowed}. {next_step}"


class CableGeometryError(InvalidValueError):
    """The two ends of a cable are at impossible positions."""


class NoSuchEntryError(InvalidValueError, IndexError):
    """An index is outside a batch."""


class NoBatchError(InvalidValueError, TypeError):
    """A single pose, cable or equilibrium was used as a batch."""


class ThreePartError(SaglineError):
    """Base class of errors whose message is an item, a reason, and the next step for the reader."""

    _between: ClassVar[str] = ": "  # text between item and reason

    def __init__(self, item: str, reason: str, next_step: str) -> None:
        """Compose the message from its three parts."""
        super().__init__(item, reason, next_step)
        self.item, self.reason, self.next_step = item, reason, next_step

    def __str__(self) -> str:
        """One line: item, reason, next step."""
        room = MOST - len(f"{self._between}. ")
        item, reason, next_step = shortened((self.item, self.reason, self.next_step), room)
        return f"{item}{self._between}{reason}. {next_step}"


class FileError(SaglineError):
    """A file cannot be read or written.

    Attributes:
        path: The file or folder.
        reason: Description of the problem.
        next_step: Action that solves the problem.
        item: Wrong part of the file, such as "cable 3: linear_density"; the path if the whole file is wrong.
        value: Value of the item, as text with unit; the reason if the value is not known.
        allowed: Allowed values of the item; empty if not known.
    """

    def __init__(self, path: Path | str, reason: str, next_step: str, *, item: str | None = None) -> None:
        """Create an error with a message of three parts."""
        super().__init__(path, reason, next_step)
        self.path = Path(path)
        self.reason = reason
        self.next_step = next_step
        self.item = str(path) if item is None else item
        self.value = reason
        self.allowed = ""

    @classmethod
    def of(cls, path: Path | str, error: InvalidValueError) -> FileError:
        """Create a `FileError` from the error of a value in the file.

        Args:
            path: The file.
            error: The error of a value in the file.

        Returns:
            Error that the caller can raise.
        """
        found = cls(path, f"{error.item} is {error.value}; allowed: {error.allowed}", error.next_step)
        found.item, found.value, found.allowed = str(error.item), str(error.value), str(error.allowed)
        return found

    @classmethod
    def not_installed(cls, package: str | None, needed: str, extra: str) -> FileError:
        """Create the error of a missing package, with the command that installs the package.

        Args:
            package: Name of the package.
            needed: Reason why the package is needed, for example "Meshes need it".
            extra: Extra of sagline that installs the package.

        Returns:
            Error that the caller can raise.
        """
        return cls(f"package {package}", "is not installed", f'{needed}: pip install "sagline[{extra}]"')

    def __str__(self) -> str:
        """Message in one line: file, reason, next step."""
        path, reason, next_step = shortened((str(self.path), self.reason, self.next_step), room=MOST - len(": . "))
        return f"{path}: {reason}. {next_step}"


@contextmanager
def needed_packages(needed: str, extra: str) -> Iterator[None]:
    """Report a package that is imported in the `with` block and missing; arguments as in `FileError.not_installed`."""
    try:
        yield
    except ModuleNotFoundError as error:
        raise FileError.not_installed(str(error.name).partition(".")[0], needed, extra) from None


def printable(text: str, kept: str = "") -> str:
    r"""Text that a terminal can print: invisible characters are replaced by escape sequences.

    Control characters, line ends, lone surrogates and other invisible characters become Python escape sequences. kept:
    characters that stay unchanged, for instance line ends.

    Examples:
        >>> from sagline.core.errors import printable
        >>> print(printable("a\x1b[31m\nb"))
        a\x1b[31m\nb
    """
    if text.isprintable():
        return text
    return "".join(c if c in kept or is_seen(c) else c.encode("unicode_escape").decode() for c in text)


def is_seen(character: str) -> bool:
    """True for a visible character or a space; False for a formatting mark, such as U+200E or U+200B."""
    return character.isprintable() or unicodedata.category(character) == "Zs"


def nearest(word: str, known: Iterable[str]) -> str | None:
    """Word of `known` that is most similar to `word`, for the question "Did you mean"; None if no word is similar.

    Only the first `_WORD` characters are compared.

    Examples:
        >>> from sagline.core.errors import nearest
        >>> nearest("cogero", ["cogiro", "fast"]), nearest("nothere", ["cogiro", "fast"])
        ('cogiro', None)
    """
    folded = {other.lower(): other for other in known}
    near = get_close_matches(word[:_WORD].lower(), folded, n=1)
    return folded[near[0]] if near else None


def first_words(text: str, room: int) -> str:
    """A list of words in at most `room` characters: the first words and the number of the others."""
    count = text[: max(0, room - len(" and 999 more"))].count(", ")
    if len(text) <= room or count == 0:
        return text
    words = text.split(", ")
    return f"{', '.join(words[:count])} and {len(words) - count} more"


def did_you_mean(word: object, known: Iterable[str], otherwise: str) -> str:
    """Next step in a message about an unknown word: the most similar word of `known`, or `otherwise`."""
    near = nearest(word, known) if isinstance(word, str) else None
    return f"Did you mean {near}?" if near else otherwise


def shortened(parts: Sequence[str], room: int) -> list[str]:
    """Printable texts of `parts` with together at most `room` characters; long parts lose their middle."""
    texts = [printable(part) for part in parts]
    while (excess := sum(map(len, texts)) - room) > 0:
        k = max(range(len(texts)), key=lambda k: len(texts[k]))
        others = max((len(text) for other, text in enumerate(texts) if other != k), default=0)
        size = max(len(texts[k]) - excess, min(others, len(texts[k]) - 1), LEAST)
        end = size // 2
        texts[k] = f"{texts[k][: size - end - 1]}…{texts[k][-end:]}"
    return texts
