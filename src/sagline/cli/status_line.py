"""The last line of a terminal, which shows how things are while lines are typed above it."""

from __future__ import annotations

import shutil
import sys
import time
from typing import Final, Self

EVERY: Final = 0.2  # s between two looks
PROMPT: Final = "> "


class StatusLine:
    """Lines above scroll without it: the terminal's last line is taken out of what scrolls, and given back.

    Where nobody watches it does nothing.
    """

    def __init__(self, *, shown: bool) -> None:
        """Take a terminal.

        Args:
            shown: Whether somebody types; then it is shown, if stdout is a terminal.
        """
        self._shown = shown and sys.stdout is not None and sys.stdout.isatty()
        self._next, self._size = 0.0, (0, 0)

    def __enter__(self) -> Self:
        """Begin."""
        if self._shown:
            self._fit()
        return self

    def __exit__(self, *failure: object) -> None:
        """Give the last line back."""
        if self._shown:
            _, rows = self._size
            self._say(f"\x1b7\x1b[r\x1b[{rows};1H\x1b[2K\x1b8")

    def update(self, text: str) -> None:
        """Show a text, if it is time to.

        Args:
            text: The text; what is too long for the line is left out.
        """
        if not self._shown or time.monotonic() < self._next:
            return
        self._next = time.monotonic() + EVERY
        if shutil.get_terminal_size() != self._size:
            self._fit()
        columns, rows = self._size
        shown = text if len(text) < columns else text[: columns - 2] + "…"
        self._say(f"\x1b7\x1b[{rows};1H\x1b[7m{shown.ljust(columns - 1)}\x1b[0m\x1b8")

    def ask(self) -> None:
        """Ask for a line."""
        if self._shown:
            self._say(f"\r\x1b[K{PROMPT}")

    def clear(self) -> None:
        """Make room for something to be told in place of the prompt."""
        if self._shown:
            self._say("\r\x1b[K")

    def _fit(self) -> None:
        """Let all lines but the last scroll."""
        self._size = shutil.get_terminal_size()
        rows = self._size[1]
        self._say(f"\n\x1b7\x1b[1;{max(rows - 1, 1)}r\x1b8\x1b[A")

    def _say(self, text: str) -> None:
        sys.stdout.write(text)
        sys.stdout.flush()
