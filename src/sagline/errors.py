"""What sagline raises: one family of exceptions that carry their data."""

from __future__ import annotations

from pathlib import Path


class SaglineError(Exception):
    """Base of everything sagline raises on purpose; its text says what to do next."""


class SaglineWarning(UserWarning):
    """Something that stands, but is to be taken with care; its text says why and what to do."""


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
        """One sentence: item, value, allowed range, next step."""
        return f"{self.item} is {self.value}; allowed: {self.allowed}. {self.next_step}"


class CableGeometryError(InvalidValueError):
    """The two ends of a cable are placed where no cable can be."""


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
        """One sentence: file, reason, next step."""
        return f"{self.path}: {self.reason}. {self.next_step}"
