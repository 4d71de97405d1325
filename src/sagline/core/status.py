"""Base class of status codes. A code is an integer from a kernel, with an explanatory sentence."""

from __future__ import annotations

from enum import IntEnum
from typing import Self


class Status(IntEnum):
    """Outcome of a calculation. Each member has a code and an explanatory sentence.

    Attributes:
        text: Meaning of the outcome, and next step, in one sentence.
    """

    text: str

    def __new__(cls, code: int, text: str = "") -> Self:
        """Create a member with its code as value."""
        member = int.__new__(cls, code)
        member._value_ = code
        member.text = text
        return member
