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
            for m in client.heard(1.0)
            if isinstance(m.get("props", m.get("updates")), dict)
        ]
    assert [text for text in contents if str(text).startswith("sagline:news:")][-1] == 'sagline:news:{"a":2}'


def test_a_value_is_text_in_an_attribute() -> None:
    assert chosen_by("mode", "massless 1") == 'data-send="mode" data-value="massless 1"'
    assert '"' not in chosen_by("x", 'a"b').split('data-value="')[1][:-1]
