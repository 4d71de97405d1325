"""Jupyter shows robots, plans and results: the verdict, a drawing in the colors of the page, and never an error."""

import re
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from html import escape, unescape
from html.parser import HTMLParser
from typing import Any, Literal
from xml.etree import ElementTree

import numpy as np
import pytest
from syrupy.assertion import SnapshotAssertion

import sagline as sl
import sagline.notebook
from sagline.notebook import figures
from sagline.notebook.figures import LARGEST
from sagline.present.summaries import summary_of
from tests.calibration.made_up import made_up
from tests.effort import least_seconds
from tests.plot import made
from tests.tiers import extended, wide

LONGEST = 2.0  # s of the processor of an ordinary machine
ROBOT = sl.load_robot("article-suspended")
PATH = sl.article_path(rate=5.0)


def shown(thing: Any) -> str:
    text = thing._repr_html_()
    assert isinstance(text, str)
    return text


def drawing(text: str) -> ElementTree.Element:
    found = re.search(r"<svg\b.*</svg>", text, re.DOTALL)
    assert found is not None
    return ElementTree.fromstring(found[0])


class Balanced(HTMLParser):
    """Parser that finds tags that are not closed."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.open: list[str] = []
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        if tag != "img":
            self.open.append(tag)

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        pass

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag


OUTSIDE = sl.Pose([[0.0, 0.0, 1.5], [7.3, 0.0, 1.5], [7.3, 0.0, 1.5], [0.0, 0.0, 2.0]], np.eye(3))
THINGS: dict[str, Callable[[], Any]] = {
    "plan": made.plan,
    "robot": lambda: ROBOT,
    "robot without a test box": lambda: ROBOT.replace(test_box=None),
    "path": lambda: PATH,
    "plan of one pose": lambda: sl.inverse(ROBOT, PATH.pose[0]),
    "infeasible plan": lambda: sl.inverse(ROBOT, sl.Pose([0.0, 0.0, 9.0], np.eye(3))),
    "plan with gaps": lambda: sl.inverse(ROBOT, OUTSIDE),
    "confirmation": lambda: sl.confirm(made.plan()),
    "forward": lambda: sl.forward(ROBOT, made.plan().unstrained_length[0], PATH.pose[0]),
    "workspace": lambda: sl.workspace(ROBOT, wrenches=sl.WrenchBox(force=50.0), cells=8),
    "nowhere": lambda: sl.workspace(ROBOT, wrenches=sl.WrenchBox(force=9e4), cells=4),
    "simulation": lambda: made.simulation(20),
    "vibration": lambda: made.vibration(made.state_at(), np.array([1.0, 2.0]), np.array([0.9, 0.1])),
    "calibration": lambda: made_up(count=20),
}
DRAWN = (
    *("plan", "robot", "path", "plan of one pose", "infeasible plan", "plan with gaps"),
    *("confirmation", "workspace", "simulation", "calibration"),
)


@cache
def thing_of(name: str) -> Any:
    return THINGS[name]()


@cache
def once(name: str) -> str:
    return shown(thing_of(name))


@pytest.mark.parametrize("name", wide(THINGS))
def test_html_is_complete_small_and_fast(name: str) -> None:
    thing = thing_of(name)
    text = once(name)
    verdict = summary_of(thing)
    assert verdict is not None
    assert unescape(re.sub(r"<[^>]+>", "", text)).startswith(f"{verdict.title}: {verdict.verdict}")
    assert Balanced(text).open == []
    assert len(text.encode()) < LARGEST + 10_000
    assert ("<svg" in text) == (name in DRAWN)
    assert least_seconds(lambda: shown(thing), LONGEST) < LONGEST
    assert not re.search(r"""(?:src|href)=["']?(?!#|data:)\w""", text)  # no external resources


def test_verdicts(snapshot: SnapshotAssertion) -> None:
    names = ("robot", "plan", "infeasible plan", "plan with gaps", "confirmation", "forward", "workspace")
    found = {name: summary_of(thing_of(name)) for name in names}
    assert {name: each and (each.title, each.verdict, each.good) for name, each in found.items()} == snapshot
    said = {name: "\n".join((each.verdict, *each.lines)) for name, each in found.items() if each is not None}
    tension = made.plan().chord_tension
    assert f"{len(PATH)} poses" in said["plan"]
    assert f"{tension.min():.4g}\u00a0N to {tension.max():.4g}\u00a0N" in said["plan"]
    assert f"1 to 2, {thing_of('plan with gaps').shortfall[1]:.1f}\u00a0N" in said["plan with gaps"]
    assert "limited by" in said["workspace"]


@pytest.mark.parametrize(("pattern", "freedoms"), [("3T", 3), ("1R2T", 3), ("3R3T", 6)])
def test_degrees_of_freedom_are_those_of_the_motion_pattern(
    pattern: Literal["3T", "1R2T", "3R3T"], freedoms: int
) -> None:
    robot = sl.Robot("any", ROBOT.frame_anchors, ROBOT.platform_anchors, ROBOT.cables, 10.0, ROBOT.inertia,
                     motion_pattern=pattern, plane_normal=[0, 1, 0] if pattern == "1R2T" else None)  # fmt: skip
    assert f"8 cables, {freedoms} freedoms ({pattern})" in re.sub(r"<[^>]+>", "", shown(robot))


@pytest.mark.parametrize("name", wide(DRAWN))
def test_drawings_have_the_colors_of_the_page(name: str) -> None:
    """Readable in the dark theme of Jupyter: black and gray take the text color of the page."""
    text = once(name)
    picture = drawing(text)
    assert "currentColor" in text
    looks = " ".join(element.get("style", "") for element in picture.iter())
    for red, green, blue in re.findall(r"#([0-9a-f]{2})([0-9a-f]{2})([0-9a-f]{2})\b", looks):
        assert not red == green == blue, name
    assert "style" not in {
        element.tag.rpartition("}")[2] for element in picture.iter()
    }  # would apply to the whole page


@extended
def test_ids_in_drawings_are_unique() -> None:
    texts = [once(name) for name in DRAWN]
    names = [re.findall(r'\bid="([^"]+)"', text) for text in texts]
    assert sum(map(len, names)) == len({name for each in names for name in each}) > 0
    for text, own in zip(texts, names, strict=True):
        assert set(re.findall(r'(?:href="#|url\(#)([^")]+)', text)) == set(own)


def test_values_are_escaped_text() -> None:
    texts = [element for element in drawing(once("plan")).iter() if element.tag.endswith("text")]
    words = " ".join("".join(text.itertext()) for text in texts)
    assert "time [s]" in words


def test_names_are_escaped() -> None:
    name = "<b>a & b</b>"
    text = shown(ROBOT.replace(name=name))
    assert text.count(escape(name)) == 2  # the verdict, and the description of the drawing
    assert "<b>" not in text


@extended
def test_long_plans_and_many_marks_stay_small() -> None:
    path = sl.article_path(rate=2000.0)
    plan = sl.inverse(ROBOT, path)
    assert plan.status.size > 100_000
    text = shown(plan)
    assert len(text.encode()) < 60_000
    assert least_seconds(lambda: shown(plan), LONGEST) < LONGEST
    peaks = plan.chord_tension.max(axis=0)
    figure = figures.figure_of(plan)
    assert figure is not None
    drawn = [np.nanmax(np.asarray(line.get_ydata(), dtype=float)) for line in figure.axes[0].get_lines()]
    np.testing.assert_array_equal(drawn, peaks)  # thinned, but with its peaks


def test_results_without_a_drawing_have_a_text(monkeypatch: pytest.MonkeyPatch) -> None:
    def fails(thing: object) -> None:
        raise RuntimeError("no fonts")

    monkeypatch.setattr(figures, "figure_of", fails)
    text = shown(made.plan())
    assert f"{len(PATH)} poses" in text
    assert "<svg" not in text


def test_results_without_a_summary_have_their_ordinary_text(monkeypatch: pytest.MonkeyPatch) -> None:
    def fails(thing: object) -> None:
        raise RuntimeError("broken")

    monkeypatch.setattr(sagline.notebook, "summary_of", fails)
    assert made.plan()._repr_html_() is None  # Jupyter then shows repr()
    monkeypatch.undo()
    assert made.plan().state.cables._repr_html_() is None
    broken = replace(
        made.plan(), status=np.full(3, 77, dtype=np.int8)
    )  # no code of a status, and without a number for it
    assert broken._repr_html_() is None or "<svg" not in shown(broken) or Balanced(shown(broken)).open == []


@extended
def test_large_figures_become_pictures_or_are_omitted(monkeypatch: pytest.MonkeyPatch) -> None:
    whole = once("plan")
    monkeypatch.setattr(figures, "LARGEST", len(whole) // 3)
    assert "<svg" not in shown(made.plan())
    monkeypatch.setattr(figures, "LARGEST", 100)
    text = shown(made.plan())
    assert "<svg" not in text
    assert "<img" not in text
    assert f"{len(PATH)} poses" in text


WITHOUT = """
import sys
{before}
import numpy as np
import sagline as sl
robot = sl.load_robot("article-suspended")
later = ("matplotlib", "sagline.notebook", "sagline.plot")
assert not [name for name, module in sys.modules.items() if module and name.startswith(later)], "core"
text = robot._repr_html_()
print("<svg" in text, "article-suspended" in text)
"""


@extended
@pytest.mark.parametrize(
    ("before", "said"),
    [pytest.param("", "True True", marks=pytest.mark.soak), ("sys.modules['matplotlib'] = None", "False True")],
)
def test_without_matplotlib_only_the_verdict_is_shown(before: str, said: str) -> None:
    code = WITHOUT.format(before=before)
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == said
    assert done.stderr == ""
