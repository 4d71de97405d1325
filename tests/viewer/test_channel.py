"""What pages and server say to each other beside viser's own words."""

import json
from collections.abc import Iterator
from typing import Any

import pytest

import sagline as sl
from sagline.viewer.channel import LONGEST, chosen_by
from sagline.viewer.viewer import Viewer
from tests.viewer.client import Client, await_that
from tests.viewer.test_viewer import Shown, handle, shown

NONSENSE = ("", "{", "[]", "3", '{"topic": "test"}', '{"topic": [], "value": 1}', "[" * 5000,
            '{"topic": "other", "value": 1}', '{"topic": "test", "value": NaN}', '{"topic": "test", "value": [1e400]}',
            '{"topic": "test", "value": {"a": "\\ud800"}}', '{"topic": "mode", "value": "\\ud800"}',
            '{"topic": "test", "value": "' + "x" * LONGEST + '"}')  # fmt: skip


@pytest.fixture(scope="module")
def page() -> Iterator[Shown]:
    yield from shown(lambda server: Viewer(server, sl.load_robot("falcon-7")))


def say(page: Shown, client: Client, text: Any) -> None:
    client.set(handle(page, "sagline")._impl.uuid, text)


def test_what_a_page_says_is_heard_in_order_and_nonsense_is_not(page: Shown) -> None:
    heard: list[Any] = []
    page.viewer._channel.on("test", lambda value, client: heard.append((value, client)))
    with Client(page.port) as client:
        for k in range(50):
            say(page, client, json.dumps({"topic": "test", "value": [k], "count": k}))
            for nonsense in NONSENSE:
                say(page, client, nonsense)
        await_that(lambda: len(heard) >= 50)
        assert [value for value, _ in heard] == [[k] for k in range(50)]
        assert len({number for _, number in heard}) == 1
    assert page.thread.is_alive()


def test_who_comes_later_is_told_the_last_word(page: Shown) -> None:
    page.viewer._channel.tell("news", {"a": 1})
    page.viewer._channel.tell("news", {"a": 2})
    with Client(page.port) as client:
        contents = [
            m.get("props", m.get("updates", {})).get("content", "")
            for m in client.replayed()
            if isinstance(m.get("props", m.get("updates")), dict)
        ]
    assert [text for text in contents if str(text).startswith("sagline:news:")][-1] == 'sagline:news:{"a":2}'


def test_a_value_is_text_in_an_attribute() -> None:
    assert chosen_by("mode", "massless 1") == 'data-send="mode" data-value="massless 1"'
    assert '"' not in chosen_by("x", 'a"b').split('data-value="')[1][:-1]


def test_an_answer_reaches_who_asked_and_nobody_else(page: Shown) -> None:
    channel = page.viewer._channel
    channel.on("ask", lambda value, client: channel.answer(client, "asked", value))
    with Client(page.port) as one, Client(page.port) as other:
        for k in range(20):  # in turn, faster than pages are drawn
            say(page, one, json.dumps({"topic": "ask", "value": f"one {k}", "count": k}))
            say(page, other, json.dumps({"topic": "ask", "value": f"other {k}", "count": k}))
        for each, name in ((one, "one"), (other, "other")):
            for text in map(content_of, each.heard()):
                assert "sagline:asked:" not in text or f'"{name} ' in text
                if text == f'sagline:asked:"{name} 19"':
                    break
            else:
                raise AssertionError("not told")
    await_that(lambda: not channel._clients)
    channel.answer(0, "asked", "gone")  # nobody is there


def content_of(message: dict[str, Any]) -> str:
    """What a piece of HTML says that comes or changes."""
    return str((message.get("props") or message.get("updates") or {}).get("content", ""))
