"""Messages between pages and server in addition to those of viser."""

import json
import re
from collections.abc import Iterator
from typing import Any

import pytest

from sagline.viewer.readout import chosen_by
from sagline.viewer.server import LONGEST, NAME, Channel, PageServer, start_server, stop_server
from tests.viewer.client import Client, await_that
from tests.viewer.shown import handle

NONSENSE = ("", "{", "[]", "3", '{"topic": "test"}', '{"topic": [], "value": 1}', "[" * 5000,
            '{"topic": "other", "value": 1}', '{"topic": "test", "value": NaN}', '{"topic": "test", "value": [1e400]}',
            '{"topic": "test", "value": {"a": "\\ud800"}}', '{"topic": "mode", "value": "\\ud800"}',
            '{"topic": "test", "value": "' + "x" * LONGEST + '"}')  # fmt: skip


@pytest.fixture(scope="module")
def server() -> Iterator[PageServer]:
    one = start_server(port=0)
    yield one
    stop_server(one)


@pytest.fixture(scope="module")
def channel(server: PageServer) -> Channel:
    """A channel whose tasks are done at once, by the thread that hears."""
    one = Channel(server.gui, lambda task: task())
    server.on_client_connect(one.connect)
    server.on_client_disconnect(one.disconnect)
    return one


def say(server: PageServer, client: Client, text: Any) -> None:
    client.set(handle(server, NAME), text)


def test_messages_are_processed_in_order_and_invalid_ones_ignored(server: PageServer, channel: Channel) -> None:
    heard: list[Any] = []
    channel.on("test", lambda value, client: heard.append((value, client)))
    with Client(server.url) as client:
        for k in range(50):
            say(server, client, json.dumps({"topic": "test", "value": [k], "count": k}))
            for nonsense in NONSENSE:
                say(server, client, nonsense)
        await_that(lambda: len(heard) >= 50)
        assert [value for value, _ in heard] == [[k] for k in range(50)]
        assert len({number for _, number in heard}) == 1


def test_later_clients_receive_the_last_message(server: PageServer, channel: Channel) -> None:
    channel.send("news", {"a": 1})
    channel.send("news", {"a": 2})
    with Client(server.url) as client:
        contents = [
            m.get("props", m.get("updates", {})).get("content", "")
            for m in client.replayed()
            if isinstance(m.get("props", m.get("updates")), dict)
        ]
    assert [text for text in contents if str(text).startswith("sagline:news:")][-1] == 'sagline:news:{"a":2}'


def test_a_value_is_text_in_an_attribute() -> None:
    assert re.findall(r'([\w-]+)="([^"]*)"', chosen_by("mode", "massless 1")) == [
        ("data-send", "mode"),
        ("data-value", "massless 1"),
    ]
    assert '"' not in chosen_by("x", 'a"b').split('data-value="')[1][:-1]


def test_an_answer_reaches_only_the_asking_client(server: PageServer, channel: Channel) -> None:
    channel.on("ask", lambda value, client: channel.send_to(client, "asked", value))
    with Client(server.url) as one, Client(server.url) as other:
        for k in range(20):  # in turn, faster than pages are drawn
            say(server, one, json.dumps({"topic": "ask", "value": f"one {k}", "count": k}))
            say(server, other, json.dumps({"topic": "ask", "value": f"other {k}", "count": k}))
        for each, name in ((one, "one"), (other, "other")):
            for text in map(content_of, each.heard()):
                assert "sagline:asked:" not in text or f'"{name} ' in text
                if text == f'sagline:asked:"{name} 19"':
                    break
            else:
                raise AssertionError("not told")
    await_that(lambda: not server.get_clients())
    channel.send_to(0, "asked", "gone")  # there is no client


def content_of(message: dict[str, Any]) -> str:
    """Content of a new or changed piece of HTML."""
    return str((message.get("props") or message.get("updates") or {}).get("content", ""))
