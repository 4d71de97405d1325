"""Base class of status codes. A code is an integer from a kernel, with an explanatory sentence."""

from __future__ import annotations

from enum import IntEnum
from typing import Self


class Status(IntEnum):
    """Outcome of a calculation, with a code and a sentence for each member.

    Attributes:
        text: Meaning and next step, one sentence.
    """

    text: str

    def __new__(cls, code: int, text: str = "") -> Self:
        """Create a member with its code as value."""
        member = int.__new__(cls, code)
        member._value_ = code
        member.text = text
        return member
