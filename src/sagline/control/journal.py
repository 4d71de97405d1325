"""What happened, for who asks afterwards and for who looks on."""

from __future__ import annotations

from collections.abc import Callable

from sagline.control.events import Event
from sagline.control.recording import Recorder


class Journal:
    """Events as they come, and one who is told of everything.

    Attributes:
        events: So far.
    """

    def __init__(self, record: Recorder | None) -> None:
        """Nothing has happened.

        Args:
            record: Who looks on.
        """
        self.events: list[Event] = []
        self._record = record

    @property
    def watched(self) -> bool:
        """Whether somebody looks on."""
        return self._record is not None

    def add(self, event: Event) -> str:
        """Keep an event.

        Args:
            event: What happened.

        Returns:
            As of `tell`.
        """
        self.events.append(event)
        return self.tell(lambda record: record.event(event))

    def tell(self, what: Callable[[Recorder], object]) -> str:
        """Tell the one who looks on, and nobody any more once that raises.

        Args:
            what: Calls a method of it.

        Returns:
            What to say of it where it has raised; "" where it has not.
        """
        if self._record is None:
            return ""
        try:
            what(self._record)
        except Exception as error:
            self._record = None
            why = f"{type(error).__name__}: {' '.join(str(error).split())[:160]}"
            return f"recording has stopped, as the recorder raised {why}. The motion goes on without it."
        return ""
