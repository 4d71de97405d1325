"""What the page says to the server beside viser's own words, and hears from it; browser/channel.js is the other end.

A hidden text field brings what is said, hidden pieces of HTML what is heard: viser replays those to who comes later.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from html import escape
from typing import Any, Final

import viser

Heard = Callable[[Any, int], None]

NAME: Final = "sagline"
LONGEST: Final = 10_000  # characters of what a page may say at once


def chosen_by(topic: str, value: str | int) -> str:
    """Attributes of an HTML element that tells a value under a topic when it is chosen, by browser/choices.js."""
    return f'data-send="{topic}" data-value="{escape(str(value))}"'


class Told:
    """What pages are told about topics; values are what JSON knows."""

    def __init__(self, gui: viser.GuiApi) -> None:
        """Begin with nothing."""
        self._gui = gui
        self._told: dict[str, Any] = {}  # HTML, by topic

    def tell(self, topic: str, value: Any) -> None:
        """Tell something about a topic, in place of what was told before."""
        content = f"{NAME}:{topic}:{json.dumps(value, separators=(',', ':'), allow_nan=False)}"
        if topic not in self._told:
            self._told[topic] = self._gui.add_html(content, visible=False)
        elif self._told[topic].content != content:
            self._told[topic].content = content


class Channel(Told):
    """Topics that pages tell something about, and are told something about."""

    def __init__(self, gui: viser.GuiApi, soon: Callable[[Callable[[], None]], None]) -> None:
        """Open it."""
        super().__init__(gui)
        self._soon = soon
        self._heard: dict[str, Heard] = {}
        self._clients: dict[int, Told] = {}  # by number
        self._field = gui.add_text(NAME, "", visible=False)

        @self._field.on_update
        async def _(event: Any) -> None:  # in the order in which it is said: viser's threads would not keep it
            self._hear(event.target.value, event.client_id)

    def on(self, topic: str, heard: Heard) -> None:
        """Have the serving thread hear what pages tell about a topic."""
        self._heard[topic] = heard

    def answer(self, client: int, topic: str, value: Any) -> None:
        """Tell one client something about a topic; one that has left hears it no more."""
        told = self._clients.get(client)
        if told is not None:
            told.tell(topic, value)

    async def welcome(self, client: viser.ClientHandle) -> None:
        """Tell a client that it is heard from now on; what it says earlier, viser hands to nobody.

        Awaits nothing: viser calls it before it hears what the client says next, as its threads would not.
        """
        told = self._clients[client.client_id] = Told(client.gui)
        told.tell("welcome", True)

    async def part(self, client: viser.ClientHandle) -> None:
        """Forget a client that has left."""
        self._clients.pop(client.client_id, None)

    def _hear(self, text: Any, client: int | None) -> None:
        """Leave something said to the serving thread; what is no message of ours is not heard."""
        if client is None or not isinstance(text, str) or len(text) > LONGEST:
            return
        try:
            said = json.loads(text)
            topic, value = said["topic"], said["value"]
            heard = self._heard[topic]
            json.dumps(value, ensure_ascii=False, allow_nan=False).encode()  # half a character cannot be told on
        except (ValueError, TypeError, KeyError, RecursionError):
            return
        self._soon(lambda: heard(value, client))
