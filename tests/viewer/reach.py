"""Checks that a page can be used with keys and a screen reader, for all of its elements."""

from pathlib import Path
from typing import Final

from playwright.sync_api import Page

RULES: Final = Path(__file__).with_name("reach.js").read_text()
CHECKED: Final = ("unnamed", "unreached", "nested", "pictures", "dangling", "scrolling", "twice", "page")
MOST_STOPS: Final = 400
SILENT: Final = ("RootWebArea", "dialog", "generic")  # roles that may have the focus without being a control


def broken_rules(page: Page) -> dict[str, list[str]]:
    """Violations by rule, with the help of the accessibility tree of the browser."""
    page.evaluate(RULES)
    found = {rule: page.evaluate(f"window.reach.{rule}()") for rule in CHECKED}
    found["without a name"] = _silent(page)
    return {rule: elements for rule, elements in found.items() if elements}


def walked(page: Page) -> tuple[list[str], list[str], list[str]]:
    """Tab through the page: the stops, those that do not show the focus, and what was not met."""
    page.evaluate(RULES)
    page.evaluate("window.reach.begin()")
    stops: list[str] = []
    unseen: list[str] = []
    for _ in range(MOST_STOPS):
        page.keyboard.press("Tab")
        stop = page.evaluate("window.reach.step()")
        if stop is None:
            break
        stops.append(stop["told"])
        if not stop["seen"]:
            unseen.append(stop["told"])
    else:
        raise AssertionError("Tab goes on for ever")
    return stops, unseen, page.evaluate("window.reach.left()")


def _silent(page: Page) -> list[str]:
    """Controls and pictures without a name for screen readers."""
    session = page.context.new_cdp_session(page)
    nodes = session.send("Accessibility.getFullAXTree")["nodes"]
    session.detach()
    silent = []
    for node in nodes:
        role = node.get("role", {}).get("value", "")
        focusable = any(
            each["name"] == "focusable" and each["value"].get("value") for each in node.get("properties", ())
        )
        if node.get("ignored") or role in SILENT or not (focusable or role in ("image", "img")):
            continue
        if not node.get("name", {}).get("value", "").strip():
            silent.append(f"{role} {node.get('backendDOMNodeId')}")
    return silent
