"""Typed poses, copied lines, links, and refused pages in headless Chromium."""

from collections.abc import Iterator
from threading import Thread

import numpy as np
import pytest
from playwright.sync_api import Browser

import sagline as sl
from sagline.viewer.features import FEATURES
from sagline.viewer.page import Page as ViewerPage
from sagline.viewer.server import start_server, stop_server
from tests.chromium import NEEDED, PATIENCE, launched
from tests.tiers import extended
from tests.viewer.client import Client
from tests.viewer.reach import broken_rules
from tests.viewer.test_browser import FEWER_PICTURES, FLAGS, await_that, opened
from tests.viewer.test_state_code import executed

pytestmark = [extended, NEEDED]


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    yield from launched(FLAGS)


def test_a_pose_is_typed_and_linked(browser: Browser) -> None:
    with opened(browser, sl.load_robot("falcon-7"), complains=True) as (page, viewer):

        def place() -> np.ndarray:
            assert viewer.view is not None
            return viewer.view.snapshot.pose.position

        field = page.locator("#sagline-pose")
        wanted = viewer.home.position + np.array([0.05, 0.0, 0.02])
        field.fill(", ".join(map(str, wanted)))
        field.press("Enter")
        await_that(page, lambda: np.array_equal(place(), wanted))
        field.fill("1, 2")
        field.press("Enter")
        page.get_by_role("alert").filter(has_text="allowed: three or six numbers").wait_for()
        field.press("Escape")
        await_that(page, lambda: field.input_value().startswith(f"{wanted[0]:.4f}".rstrip("0")))

        page.get_by_role("button", name="Copy as code").press("Enter")
        page.get_by_role("dialog", name="Python code of this state").wait_for()
        names = executed(page.locator("dialog textarea").input_value())
        assert viewer.view is not None
        np.testing.assert_array_equal(names["tension"], viewer.view.snapshot.tension)
        await_that(page, lambda: page.locator("dialog [role=status]").inner_text() != "")
        assert page.evaluate("getSelection().toString() || document.activeElement.selectionEnd") not in ("", 0)
        assert broken_rules(page) == {}
        page.get_by_role("dialog").get_by_role("button", name="Close").press("Enter")

        page.get_by_role("tab", name="Modes").press("Enter")
        page.get_by_role("button", name="Copy link").press("Enter")
        page.get_by_role("dialog", name="Link to this state").wait_for()
        link = page.locator("dialog textarea").input_value()
        assert "&tab=Modes" in link
        page.get_by_role("dialog").get_by_role("button", name="Close").press("Enter")
        page.get_by_role("button", name="Platform back home").press("Enter")
        await_that(page, lambda: np.array_equal(place(), viewer.home.position))

        elsewhere = browser.new_page(viewport={"width": 1000, "height": 640})
        elsewhere.set_default_timeout(1e3 * PATIENCE)
        elsewhere.add_init_script(FEWER_PICTURES)
        elsewhere.goto(link)
        await_that(elsewhere, lambda: np.allclose(place(), wanted, atol=1e-12))
        elsewhere.get_by_role("tab", name="Modes", selected=True).wait_for()
        assert elsewhere.url == page.url == viewer.server.url
        elsewhere.evaluate("location.hash = '#robot=fast:12345678&pose=0,0,1'")
        elsewhere.get_by_role("alert").filter(has_text="the link is of 'fast'; allowed: falcon-7").wait_for()
        elsewhere.close()
        assert np.allclose(place(), wanted, atol=1e-12)


# attempts of a foreign page: to open a connection, and to read the page
INTRUDING = """async (address) => {
    const socket = new WebSocket(address.replace("http", "ws"))
    const opened = new Promise((end) => { socket.onopen = () => end("open"); socket.onerror = () => end("refused") })
    const read = fetch(address).then((answer) => answer.text()).then((text) => text.length, () => "refused")
    return [await opened, await read]
}"""


def test_a_foreign_page_is_refused_even_with_the_token(browser: Browser) -> None:
    server = start_server(port=0, clients=1)
    other = start_server(port=0, token=False)
    try:
        page = browser.new_page()
        for address in ("data:text/html,foreign", other.url):
            page.goto(address)
            assert page.evaluate(INTRUDING, server.url) == ["refused", "refused"]
            assert page.evaluate(INTRUDING, server.url.replace("127.0.0.1", "localhost")) == ["refused", "refused"]
        page.goto(server.url)
        opened, size = page.evaluate(INTRUDING, server.url)
        assert opened == "open"
        assert size > 1e5
        page.close()
    finally:
        stop_server(server)
        stop_server(other)


def test_the_page_connects_only_to_its_server_and_shows_refusals(browser: Browser) -> None:
    server = start_server(port=0, clients=1)
    viewer = ViewerPage(server, FEATURES, sl.load_robot("falcon-7"))
    thread = Thread(target=viewer.serve)
    thread.start()
    page = browser.new_page()
    page.set_default_timeout(1e3 * PATIENCE)
    page.add_init_script(FEWER_PICTURES)
    try:
        with Client(server.url):
            page.goto(server.url_at(server.access.path_once()))
            assert page.url == server.url
            page.get_by_role("alert").filter(has_text="number of pages is 2; allowed: up to 1").wait_for()
        page.get_by_text("Feasible", exact=True).wait_for()
        page.get_by_role("alert").filter(has_text="reconnects").wait_for(state="hidden")
        page.goto(f"{server.url}?websocket=ws://127.0.0.1:9")
        page.get_by_text("Feasible", exact=True).wait_for()
        assert page.url == server.url
    finally:
        page.close()
        viewer.stop()
        thread.join(timeout=PATIENCE)
        stop_server(server)
