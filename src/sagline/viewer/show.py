"""Something beside the robot that follows what is shown."""

from __future__ import annotations

from typing import Protocol

from sagline.viewer.view import View


class Show(Protocol):
    """A part of the page; all of it belongs to the thread that serves."""

    @property
    def moving(self) -> bool:
        """Whether pictures follow each other without anybody's doing."""

    @property
    def waiting(self) -> bool:
        """Whether something is to come without anybody's doing."""

    def follow(self, view: View) -> None:
        """Something is shown."""

    def tick(self) -> None:
        """Some time has passed."""
