"""Base class of status codes: an integer that kernels return, with a sentence about it."""

from __future__ import annotations

from enum import IntEnum
from typing import Self


class Status(IntEnum):
    """End of a calculation; a member is written as its code and its sentence.

    Attributes:
        text: Meaning and next step, one sentence.
    """

    text: str

    def __new__(cls, code: int, text: str = "") -> Self:
        """A member that is the code."""
        member = int.__new__(cls, code)
        member._value_ = code
        member.text = text
        return member
