"""What a name stands for where it is no regular file's, and what to name instead."""

from __future__ import annotations

import stat
from typing import NamedTuple


class Kind(NamedTuple):
    """What is no regular file.

    Attributes:
        text: What it is.
        next_step: What to do about it.
    """

    text: str
    next_step: str


_DEVICE = Kind("a device, not a file", "Name a file.")
_KINDS = {
    stat.S_IFDIR: Kind("a folder", "Give the name of a file in it."),
    stat.S_IFCHR: _DEVICE,
    stat.S_IFBLK: _DEVICE,
    stat.S_IFIFO: Kind("a pipe, not a file", "Name a file."),
    stat.S_IFSOCK: Kind("a socket, not a file", "Name a file."),
}


def kind_of(mode: int) -> Kind | None:
    """What something is that is no regular file.

    Args:
        mode: As `os.stat` gives it.

    Returns:
        What it is; None for a regular file.
    """
    return None if stat.S_ISREG(mode) else _KINDS.get(stat.S_IFMT(mode), Kind("no file", "Name a file."))
