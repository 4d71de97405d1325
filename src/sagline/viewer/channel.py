"""Messages between pages and server beside those of viser; browser/channel.js is the other end.

A hidden text field brings the messages of pages, hidden pieces of HTML those to them, which viser replays to later
clients.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from html import escape
from typing import Any, Final

import viser

Handler = Callable[[Any, int], None]

NAME: Final = "sagline"
LONGEST: Final = 10_000  # characters of a message of a page


def chosen_by(topic: str, value: str | int) -> str:
    """Attributes of an HTML element that tells a value under a topic when it is chosen, by browser/choices.js."""
    return f'data-send="{topic}" data-value="{escape(str(value))}"'


class Messages:
    """Messages to pages, the latest of each topic; values are those of JSON."""

    def __init__(self, gui: viser.GuiApi) -> None:
        """Begin with nothing."""
        self._gui = gui
        self._sent: dict[str, Any] = {}  # HTML, by topic

    def send(self, topic: str, value: Any) -> None:
        """Send a value under a topic, in place of the one before."""
        content = f"{NAME}:{topic}:{json.dumps(value, separators=(',', ':'), allow_nan=False)}"
        if topic not in self._sent:
            self._sent[topic] = self._gui.add_html(content, visible=False)
        elif self._sent[topic].content != content:
            self._sent[topic].content = content


class Channel(Messages):
    """Messages to and from pages."""

    def __init__(self, gui: viser.GuiApi, soon: Callable[[Callable[[], None]], None]) -> None:
        """Add the text field."""
        super().__init__(gui)
        self._soon = soon
        self._handlers: dict[str, Handler] = {}
        self._clients: dict[int, Messages] = {}  # by number
        self._field = gui.add_text(NAME, "", visible=False)

        @self._field.on_update
        async def _(event: Any) -> None:  # in the order in which it is said: viser's threads would not keep it
            self._receive(event.target.value, event.client_id)

    def on(self, topic: str, handler: Handler) -> None:
        """Have the serving thread call a handler with the messages of a topic."""
        self._handlers[topic] = handler

    def send_to(self, client: int, topic: str, value: Any) -> None:
        """Send a value to one client, unless it has left."""
        messages = self._clients.get(client)
        if messages is not None:
            messages.send(topic, value)

    async def connect(self, client: viser.ClientHandle) -> None:
        """Tell a client that it is heard from now on; what it says earlier, viser hands to nobody.

        Awaits nothing: viser calls it before it hears what the client says next, as its threads would not.
        """
        messages = self._clients[client.client_id] = Messages(client.gui)
        messages.send("welcome", True)

    async def disconnect(self, client: viser.ClientHandle) -> None:
        """Forget a client that has left."""
        self._clients.pop(client.client_id, None)

    def _receive(self, text: Any, client: int | None) -> None:
        """Leave a message to the serving thread; anything else is ignored."""
        if client is None or not isinstance(text, str) or len(text) > LONGEST:
            return
        try:
            said = json.loads(text)
            topic, value = said["topic"], said["value"]
            handler = self._handlers[topic]
            json.dumps(value, ensure_ascii=False, allow_nan=False).encode()  # half a character cannot be sent on
        except (ValueError, TypeError, KeyError, RecursionError):
            return
        self._soon(lambda: handler(value, client))
