"""Shared pages in headless Chromium: runs play and robots can be dragged, also on phones, in both themes."""

import functools
from collections.abc import Iterator
from pathlib import Path
from typing import Literal

import numpy as np
import pytest
from playwright.sync_api import Browser, Page, expect

import sagline as sl
from sagline.core.arrays import Array
from sagline.robot.reach import home_pose
from sagline.share.course import SharedMotion
from sagline.share.page import LENGTH, POSITION, TENSION, TIME, TURN, course_page, robot_page
from sagline.viewer import shapes
from sagline.viewer.shapes import Solid
from tests.chromium import NEEDED, launched
from tests.share.opening import FLAGS, asking, opened
from tests.tiers import extended
from tests.viewer.reach import broken_rules

CONTRAST = (Path(__file__).parents[1] / "viewer" / "contrast.js").read_text()
SIZES = ((390, 640), (1000, 640), (1440, 900))
OVERFLOWING = """[...document.querySelectorAll("body *:not(.heard)")].filter((each) => each.checkVisibility())
    .filter((each) => each.getBoundingClientRect().right > innerWidth + 1 || each.scrollWidth > each.clientWidth + 1
        && getComputedStyle(each).overflow !== "visible").map((each) => each.outerHTML.slice(0, 200))"""
STATES = (
    "Object.fromEntries(Object.entries(it.course).map(([name, all]) => [name, all.map((each) => Array.from(each))]))"
)

pytestmark = [extended, NEEDED]

MATRIX = pytest.mark.parametrize(
    ("name", "size", "theme"),
    [
        pytest.param(name, size, theme, marks=() if size == quick else pytest.mark.soak)
        for name, quick in (("falcon-7", None), ("cogiro", SIZES[0]), ("fast", None))
        for size, theme in zip(SIZES, ("dark", "light", "dark"), strict=True)
    ],
)


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    yield from launched(FLAGS)


@functools.cache
def run_of(name: str) -> sl.Plan:
    """A path that leaves the feasible region and returns."""
    robot = sl.load_robot(name)
    assert robot.test_box is not None
    low, high = robot.test_box.low, robot.test_box.high
    middle, size = 0.5 * (low + high), high - low
    ends = sl.Pose(np.array([middle, middle + 0.3 * size, middle + 2.0 * size, middle]), np.stack([np.eye(3)] * 4))
    slow = 10.0 if name == "fast" else 1.0  # it is half a kilometer wide
    plan = sl.inverse(robot, sl.quintic_path(ends, durations=[2.0 * slow, 3.0 * slow, 3.0 * slow], rate=25.0 / slow))
    assert 0.2 < plan.feasible.mean() < 0.9
    return plan


def check_look(page: Page) -> None:
    """Text is readable, controls have names, and no content overflows."""
    texts = page.evaluate(CONTRAST)
    assert len(texts) > 20
    assert {(text["words"], round(text["ratio"], 2)) for text in texts if not text["ratio"] >= 4.5} == set()
    assert page.evaluate(OVERFLOWING) == []
    assert broken_rules(page) == {}


def pixels(page: Page) -> bytes:
    """The picture after the next frame of the page."""
    page.evaluate("new Promise((drawn) => requestAnimationFrame(() => requestAnimationFrame(drawn)))")
    return page.locator("canvas").screenshot()


@MATRIX
def test_a_run_plays(
    browser: Browser, tmp_path: Path, name: str, size: tuple[int, int], theme: Literal["light", "dark"]
) -> None:
    plan = run_of(name)
    (tmp_path / "run.html").write_text(course_page(SharedMotion.of_plan(plan), "run"), encoding="utf-8")
    with opened(browser, tmp_path / "run.html", width=size[0], height=size[1], theme=theme) as page:
        check_states(plan, page)
        check_look(page)
        assert plan.path is not None
        k, end = 30, plan.path.time[-1]
        asking(page, f"it.scrub({plan.path.time[k]:.6f})")
        expect(page.get_by_role("status")).to_have_text("Feasible")
        drawn = np.array(asking(page, "it.moment().courses"))
        robot = plan.state.one_robot
        state = plan.state[k]
        expected = shapes.catenaries(shapes.chords(robot, state.pose), state.cables, 1.0)
        sag = float(np.max(state.cables.sag))
        np.testing.assert_allclose(drawn, expected, rtol=0.0, atol=2.0 * POSITION + TENSION * sag)
        before = pixels(page)
        page.get_by_label("Speed").select_option("10")
        page.get_by_role("button", name="Play").click()
        page.get_by_text(f"{end:.2f} s of {end:.2f} s").wait_for()
        assert pixels(page) != before
        page.get_by_role("slider", name="Time").fill(f"{0.625 * end:g}")
        expect(page.get_by_role("status")).to_contain_text("Not feasible")
        check_look(page)


def check_states(plan: sl.Plan, page: Page) -> None:
    """Decoded states agree with the plan within half of the stated step."""
    states = {key: np.array(columns, dtype=np.float64).T for key, columns in asking(page, STATES).items()}
    assert plan.path is not None
    exact = {
        "time": (plan.path.time[:, None], TIME),
        "position": (plan.state.pose.position, POSITION),
        "quaternion": (plan.state.pose.quaternion, TURN),
        "length": (plan.unstrained_length, LENGTH),
    }
    for key, (values, step) in exact.items():
        np.testing.assert_allclose(states[key], values, rtol=0.0, atol=0.5001 * step)
    np.testing.assert_allclose(states["tension"], plan.chord_tension, rtol=0.501 * TENSION)
    np.testing.assert_array_equal(states["verdict"][:, 0] > 0.0, ~plan.feasible)


@MATRIX
def test_a_robot_is_dragged(
    browser: Browser, tmp_path: Path, name: str, size: tuple[int, int], theme: Literal["light", "dark"]
) -> None:
    robot = sl.load_robot(name)
    (tmp_path / "robot.html").write_text(robot_page(robot), encoding="utf-8")
    with opened(browser, tmp_path / "robot.html", width=size[0], height=size[1], theme=theme) as page:
        check_look(page)
        start = np.array(asking(page, "it.moment().pose.position"))
        before, ring = pixels(page), page.locator("[data-part=ring]").bounding_box()
        assert ring is not None
        x, y = ring["x"] + ring["width"] / 2, ring["y"] + ring["height"] / 2
        page.mouse.move(x, y)
        page.mouse.down()
        page.mouse.move(x + 12, y + 5, steps=4)
        page.mouse.up()
        moved = np.array(asking(page, "it.moment().pose.position"))
        assert np.linalg.norm(moved - start) > 0.0
        assert pixels(page) != before
        check_balance(page, robot, moved)
        page.get_by_role("button", name="Home").click()
        np.testing.assert_allclose(asking(page, "it.moment().pose.position"), start)
        check_winch(page, robot)
        slider = page.get_by_role("slider", name="z")
        slider.focus()
        page.keyboard.press("End")
        expect(page.get_by_role("status")).to_contain_text("Not ")
        turned = pixels(page)
        page.locator("canvas").focus()
        page.keyboard.press("ArrowLeft")
        assert pixels(page) != turned
        check_look(page)


WAITING = """const compile = WebAssembly.instantiate, waited = new Promise((go) => { window.go = go; });
WebAssembly.instantiate = async (...given) => { await waited; return compile(...given); };"""


def test_straight_cables_are_drawn_while_kernels_load(browser: Browser, tmp_path: Path) -> None:
    robot = sl.load_robot("article-mixed")
    (tmp_path / "robot.html").write_text(robot_page(robot), encoding="utf-8")
    context = browser.new_context(viewport={"width": 390, "height": 640})
    context.add_init_script(WAITING)
    page = context.new_page()
    page.goto((tmp_path / "robot.html").as_uri())
    expect(page.get_by_text("Loading the model").first).to_be_visible()
    straight = pixels(page)
    page.evaluate("window.go()")
    expect(page.get_by_role("status")).to_have_text("Feasible")
    sagging = pixels(page)
    context.close()
    assert len(straight) > 0.5 * len(sagging)  # a picture with the robot
    assert straight != sagging


@pytest.mark.parametrize("height", [640, 844])
def test_a_platform_outside_of_its_frame_is_completely_visible(browser: Browser, tmp_path: Path, height: int) -> None:
    robot = sl.load_robot("falcon-7")
    corners = home_pose(robot).transform(Solid.platform(robot).vertices)
    assert corners[:, 2].max() > 1.2 * robot.frame_anchors[:, 2].max()
    (tmp_path / "robot.html").write_text(robot_page(robot), encoding="utf-8")
    with opened(browser, tmp_path / "robot.html", width=390, height=height) as page:
        seen = asking(page, "given.map((each) => it.view.seen(each))", corners.tolist())
        assert all(0.0 < each[side] < 1.0 for each in seen for side in ("x", "y"))


def check_balance(page: Page, robot: sl.Robot, position: Array) -> None:
    plan = sl.inverse(robot, sl.Pose(position, np.eye(3)))
    assert plan.feasible
    np.testing.assert_allclose(asking(page, "it.moment().tension"), plan.chord_tension, rtol=1e-12)
    rows = page.locator("[data-part=cables] tr").all_inner_texts()
    assert [float(row.split()[2]) for row in rows] == pytest.approx(plan.unstrained_length, abs=6e-5)


def check_winch(page: Page, robot: sl.Robot) -> None:
    """A longer cable: the platform moves to the equilibrium of the library, and returns with the slider."""
    planned = sl.Pose(asking(page, "it.moment().pose.position"), np.eye(3))
    before = np.array(asking(page, "it.moment().length"))
    page.get_by_label("Cable to wind").select_option("1")
    slider = page.get_by_label("Change of its length")
    slider.focus()
    page.keyboard.press("PageUp")
    length = np.array(asking(page, "it.moment().length"))
    assert np.flatnonzero(length != before).tolist() == [1]
    assert length[1] > before[1]
    rest = sl.forward(robot, length, start=planned)
    np.testing.assert_allclose(asking(page, "it.moment().pose.position"), rest.pose.position, rtol=0.0, atol=1e-12)
    way = 1e3 * np.linalg.norm(rest.pose.position - planned.position)
    expect(page.locator("[data-part=verdict]")).to_contain_text(f" {way:.1f} mm ")
    slider.fill("0")
    np.testing.assert_array_equal(asking(page, "it.moment().pose.position"), planned.position)
