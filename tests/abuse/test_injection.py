"""Markup in any text of a robot, run, log or calibration: each page has the same elements as with harmless texts."""

from __future__ import annotations

import ast
import re
from collections import Counter
from collections.abc import Callable
from dataclasses import fields, is_dataclass, replace
from functools import cache
from html.parser import HTMLParser
from pathlib import Path
from typing import Any, Literal

import pytest

import sagline as sl
from sagline.files.execution_file import save_execution
from sagline.present.page import Chapter, Finding, Panel, Table, Verdict, page
from sagline.robot.tolerances import Provenance
from sagline.share.course import SharedMotion
from sagline.share.page import course_page, robot_page
from sagline.viewer.page import Source
from sagline.viewer.server import page_html
from sagline.viewer.session import LogFollower, PlayedLog
from tests.calibration.made_up import made_up
from tests.files.executions import execution
from tests.tiers import extended

HOSTILE = (
    """<img src=x onerror=alert(1)>""",
    """"><script>alert(1)</script>""",
    """'-->]]></script></style></svg></title><b onclick='x'>""",
    """&lt;i&gt;&#60;u&#62; {{7*7}} {% x %} {safe}""",
    """" onmouseover="alert(1)" x=\"""",
    """<a href="javascript:alert(1)">a</a><base href=//x>""",
    """$x_{1}$ \\frac{a} $\\undefined$ [a](javascript:x) `b` ${1}""",
)
KINDS: tuple[Literal["plan", "simulation", "execution", "calibration"], ...] = (
    "plan", "simulation", "execution", "calibration",
)  # fmt: skip


class Elements(HTMLParser):
    """Counter of the elements of a page with the names of their attributes; collects the texts."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.counts: Counter[tuple[str, ...]] = Counter()
        self.texts: list[str] = []
        self.feed(text)
        self.close()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.counts[(tag, *sorted(name for name, _ in attrs))] += 1
        self.texts += [value for _, value in attrs if value]

    def handle_endtag(self, tag: str) -> None:
        self.counts["/" + tag,] += 1

    def handle_comment(self, data: str) -> None:
        self.counts["comment",] += 1

    def handle_data(self, data: str) -> None:
        self.texts.append(data)


def plain(text: str) -> str:
    """A harmless text of the same length."""
    return "x" * len(text)


def named(text: str) -> sl.Robot:
    """A robot with the same given text in every text field."""
    robot = sl.load_robot("article-suspended")
    known = Provenance(text, "2026-01-01", {"mass": 0.1}, text)
    return robot.replace(name=text, source=text, notes=text, assumed={"mass": text}, calibration=known)


def check(make: Callable[[str], str], text: str) -> None:
    """Compare a page made with a text to the one made with a harmless text."""
    hostile, harmless = Elements(make(text)), Elements(make(plain(text)))
    assert hostile.counts == harmless.counts
    assert any(text in one for one in hostile.texts), "the text is not in the page"


@cache
def pose() -> sl.Pose:
    return sl.Pose.from_euler([[0.0, 0.0, 2.0], [0.5, 0.0, 2.0]], 0.0, 0.0, 0.0)


THINGS: dict[str, Callable[[sl.Robot], Any]] = {
    "robot": lambda robot: robot,
    "plan": lambda robot: sl.inverse(robot, pose()),
    "confirmation": lambda robot: sl.confirm(sl.inverse(robot, pose())),
    "workspace": lambda robot: sl.workspace(robot, cells=4),
    "vibration": lambda robot: sl.vibration(sl.inverse(robot, pose()[0]).state, up_to=4.0),
    "simulation": lambda robot: sl.simulate(sl.inverse(robot, pose()[0]).state, duration=0.05),
    "calibration": lambda robot: replace(made_up(count=4), robot=robot),
}


@extended
@pytest.mark.parametrize("text", HOSTILE, ids=range(len(HOSTILE)))
@pytest.mark.parametrize("kind", THINGS)
def test_notebooks(kind: str, text: str) -> None:
    check(lambda name: THINGS[kind](named(name))._repr_html_(), text)


def filled(value: Any, text: str) -> Any:
    """A part of a report with the given text in every field except keys and drawings."""
    if isinstance(value, str) and not isinstance(value, Verdict):
        return text
    if isinstance(value, Panel):
        return Panel(value.svg, text)
    if is_dataclass(value) and not isinstance(value, type):
        kept = {"key", "numbers"}
        return replace(
            value,
            **{each.name: filled(getattr(value, each.name), text) for each in fields(value) if each.name not in kept},
        )
    if isinstance(value, Table):
        return Table(*(filled(each, text) for each in value))
    if isinstance(value, list | tuple):
        made = type(value)._make if hasattr(value, "_make") else type(value)
        return made(filled(each, text) for each in value)
    return value


@pytest.mark.parametrize("text", HOSTILE, ids=range(len(HOSTILE)))
def test_reports(text: str) -> None:
    findings = tuple(
        Finding(f"key-{k}", "a", "b", "c", verdict, {"a": 1.0}, (k,), (k,), (Panel("<svg></svg>", "d"),),
                (Table("e", ["f", "g"], [["h", "i"], ["j", "k"]]), Table("e", list("fghij"), [list("klmno")])))
        for k, verdict in enumerate(Verdict)
    )  # fmt: skip

    def report(each: str) -> str:
        part = filled(Chapter("one", "title", "lead", findings), each)
        return page(each, each, each, [part], Panel("<svg></svg>", each), each)

    check(lambda each: re.sub(r"</?sub>", "", report(each)), text)  # x_1 is printed with an index


@extended
@pytest.mark.parametrize("text", HOSTILE, ids=range(len(HOSTILE)))
def test_shared_pages(text: str, tmp_path: Path) -> None:
    check(lambda name: robot_page(named(name)), text)
    check(
        lambda name: course_page(SharedMotion.of_plan(sl.inverse(named(name), sl.article_path(rate=1.0))), name), text
    )
    check(lambda name: course_page(SharedMotion.of_session(session(name, tmp_path)), name), text)
    course = SharedMotion.of_plan(sl.inverse(named("a"), sl.article_path(rate=1.0)))
    texts = ("kind", "quantity", "notes", "verdicts")
    check(
        lambda name: course_page(replace(course, **{one: filled(getattr(course, one), name) for one in texts}), "b"),
        text,
    )


def session(text: str, folder: Path) -> PlayedLog:
    """A log with the given text in its robot and its events."""
    done = execution()
    robot = done.robot.replace(name=text, source=text, notes=text)
    assert done.plan is not None
    assert done.plan.path is not None
    plan = sl.inverse(robot, done.plan.path)
    events = tuple(each._replace(name=text, text=text) for each in done.events)
    save_execution(replace(done, robot=robot, plan=plan, events=events, reason=text), folder / "run.mcap")
    found = LogFollower(folder / "run.mcap").more()
    assert found is not None
    return found


@extended
@pytest.mark.parametrize("text", HOSTILE, ids=range(len(HOSTILE)))
def test_viewer(text: str, tmp_path: Path) -> None:
    own = "<html><head><title>Viser</title></head><body></body></html>"
    check(lambda name: page_html(own, name), text)
    check(lambda name: session(name, tmp_path).at(1.5).verdict, text)


@pytest.mark.parametrize("text", HOSTILE, ids=range(len(HOSTILE)))
def test_code_of_the_viewer(text: str) -> None:
    """A name in "copy as code" is only a constant."""
    for source in (Source.of_robot(text, 2.0), *(Source.of_file(kind, Path(text)) for kind in KINDS)):
        code = ast.parse("\n".join(line for line in (source.robot, source.played) if line))
        constants = [node.value for node in ast.walk(code) if isinstance(node, ast.Constant)]
        assert set(constants) <= {text, str(Path(text))}
        assert constants
        assert not any(isinstance(node, ast.BinOp | ast.JoinedStr) for node in ast.walk(code))
