"""Names in shared pages are text: nothing in a name becomes a tag, ends an attribute or ends a script."""

from html.parser import HTMLParser

import numpy as np
import pytest

import sagline as sl
from sagline.share.course import SharedMotion
from sagline.share.machine import robot_drawing
from sagline.share.page import course_page, robot_page

NAME = """a & b"'><blink></script></title></svg>"""


class Page(HTMLParser):
    """Tags, titles, headings, descriptions and scripts of a page."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.tags: set[str] = set()
        self.descriptions: list[str] = []
        self.scripts = 0
        self.texts: dict[str, list[str]] = {"title": [], "h1": [], "p": []}
        self.inside = ""
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.add(tag)
        self.inside = tag
        self.scripts += tag == "script"
        if tag in self.texts:
            self.texts[tag].append("")
        self.descriptions += [value or "" for name, value in attrs if name == "aria-label"]

    def handle_endtag(self, tag: str) -> None:
        self.inside = ""

    def handle_data(self, data: str) -> None:
        if self.inside in self.texts:
            self.texts[self.inside][-1] += data


def named() -> sl.Robot:
    return sl.load_robot("cogiro").replace(name=NAME)


def test_the_name_of_a_robot() -> None:
    found, usual = Page(robot_page(named())), Page(robot_page(sl.load_robot("cogiro")))
    assert (found.tags, found.scripts) == (usual.tags, usual.scripts)
    assert found.texts["title"] == [NAME]
    assert set(found.texts["h1"]) == {NAME}
    assert sum(text.startswith(f"{NAME}: ") for text in found.descriptions) == 2  # the picture with and without scripts
    assert found.descriptions == [text.replace("cogiro", NAME) for text in usual.descriptions]


def test_the_title_and_the_notes_of_a_run() -> None:
    robot = named()
    assert robot.test_box is not None
    poses = sl.Pose(np.stack([0.5 * (robot.test_box.low + robot.test_box.high)] * 2), np.eye(3))
    course = SharedMotion.of_plan(sl.inverse(robot, poses))
    object.__setattr__(course, "notes", (NAME,))
    found = Page(course_page(course, NAME))
    assert "blink" not in found.tags
    assert found.texts["title"] == [NAME]
    assert set(found.texts["h1"]) == {NAME}
    assert NAME in found.texts["p"]
    assert sum(NAME in text for text in found.texts["p"]) == 3  # the note, and the description of the page, twice
    assert sum(text.startswith(NAME) for text in found.descriptions) == 2


@pytest.mark.parametrize("name", [NAME, "cogiro"])
def test_the_description_of_a_drawing(name: str) -> None:
    robot = sl.load_robot("cogiro").replace(name=name)
    page = Page(robot_drawing(robot, sl.Pose([0.0, 0.0, 2.0], np.eye(3)), np.full(8, np.nan)))
    assert page.tags == {"svg", "path"}
    (description,) = page.descriptions
    assert description.startswith(f"{name}: ")
