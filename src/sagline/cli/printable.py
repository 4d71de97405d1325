"""Texts from anywhere, as a terminal may be given them."""

from __future__ import annotations

import unicodedata


def printable(text: str, kept: str = "") -> str:
    r"""A text in which control characters, and all else that is not seen, are written out as in Python: `\x1b`.

    Args:
        text: From wherever.
        kept: Characters that may stay.
    """
    if text.isprintable():
        return text
    return "".join(c if c in kept or is_seen(c) else c.encode("unicode_escape").decode() for c in text)


def is_seen(character: str) -> bool:
    """Whether a character shows, or is a space of any width."""
    return character.isprintable() or unicodedata.category(character) == "Zs"
