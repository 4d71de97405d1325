"""The inverse that a page computes, in Chromium, against the library's: tensions, lengths, verdicts, shortfalls."""

from collections.abc import Iterator
from importlib.resources import files
from typing import Any

import numpy as np
import pytest
from playwright.sync_api import Browser, Page

import sagline as sl
from sagline.robot.batch import pulley_centers
from sagline.robot.reach import bounds
from sagline.share.machine import model_data
from sagline.statics.tables import chord_geometry
from sagline.viewer.snapshot import Snapshot
from tests.chromium import NEEDED, PATIENCE, launched
from tests.tiers import extended

SCRIPTS = ("catenary.js", "sharing.js", "robot.js")
EVERY = """([machine, poses]) => poses.map(({ position, quaternion }) => {
    const found = robot.balanced(machine, { position, matrix: robot.rotation(quaternion) });
    return {
        feasible: found.feasible, tension: found.tension ?? null, length: found.hung?.map(robot.lengthOf) ?? null,
        blocking: found.blocking, short: found.short === Infinity ? "all" : found.short ?? null, why: found.why ?? "",
        points: found.hung?.map((hung) => robot.course(hung.line, hung, 40, 16)) ?? null,
    };
})"""

pytestmark = [extended, NEEDED]


@pytest.fixture(scope="module")
def page() -> Iterator[Page]:
    for browser in launched("--disable-gpu --disable-component-update"):
        yield with_scripts(browser)


def with_scripts(browser: Browser) -> Page:
    folder = files("sagline.share").joinpath("page")
    text = "\n".join(folder.joinpath(name).read_text(encoding="utf-8") for name in SCRIPTS)
    page = browser.new_page()
    page.set_default_timeout(1e3 * PATIENCE)
    page.set_content(f"<script>{text}</script>")
    return page


def poses(robot: sl.Robot, count: int) -> sl.Pose:
    """Within the box that the robot stands in, half of them where it is meant to work; a little turned."""
    rng = np.random.default_rng(7)
    low, high = bounds(robot)
    assert robot.test_box is not None
    inside = rng.uniform(robot.test_box.low, robot.test_box.high, (count // 2, 3))
    position = np.concatenate((rng.uniform(low, high, (count - count // 2, 3)), inside))
    pose = sl.Pose.from_euler(position, *rng.normal(0.0, 0.1, (3, count)))
    return pose[np.flatnonzero(np.isfinite(chord_geometry(robot, pose)[:, 2]).all(axis=1))]


def found_by(page: Page, robot: sl.Robot, pose: sl.Pose) -> list[dict[str, Any]]:
    pairs = zip(pose.position.tolist(), pose.quaternion.tolist(), strict=True)
    given = [{"position": position, "quaternion": quaternion} for position, quaternion in pairs]
    answer: list[dict[str, Any]] = page.evaluate(EVERY, [model_data(robot), given])
    return answer


def frame_end_limited() -> sl.Robot:
    """Limits where the load cells sit: the lower one is what many cables would hang below."""
    robot = sl.load_robot("ipanema-2-pulleys")
    return robot.replace(name="frame-end", tension_limits_of="frame_end")


ROBOTS = {name: sl.load_robot(name) for name in sl.robot_names()} | {"frame-end": frame_end_limited()}
FAST = ("falcon-7", "cogiro", "fast", "ipanema-2-pulleys", "frame-end")


@pytest.mark.parametrize(
    ("name", "count"),
    [(each, 30) for each in FAST] + [pytest.param(each, 400, marks=pytest.mark.soak) for each in ROBOTS],
)
def test_the_page_finds_what_the_library_does(page: Page, name: str, count: int) -> None:
    robot = ROBOTS[name]
    pose = poses(robot, count)
    plan = sl.inverse(robot, pose)
    found = found_by(page, robot, pose)
    np.testing.assert_array_equal([one["feasible"] for one in found], plan.feasible)
    held = np.flatnonzero(plan.feasible)
    assert 1 < len(held) < len(pose)
    np.testing.assert_allclose([found[i]["tension"] for i in held], plan.chord_tension[held], rtol=1e-9)
    np.testing.assert_allclose([found[i]["length"] for i in held], plan.unstrained_length[held], rtol=1e-12)
    for i in np.flatnonzero(~plan.feasible):
        short = np.inf if found[i]["short"] == "all" else found[i]["short"]
        np.testing.assert_allclose(short, plan.shortfall[i], rtol=1e-3)


@pytest.mark.parametrize("name", ["cogiro", "fast", "ipanema-2-pulleys"])
def test_the_page_draws_cables_where_the_library_does(page: Page, name: str) -> None:
    robot = ROBOTS[name]
    pose = sl.Pose(0.5 * (robot.test_box.low + robot.test_box.high), np.eye(3))  # type: ignore[union-attr]
    plan = sl.inverse(robot, pose)
    expected = Snapshot(robot, pose, plan, None).courses(1.0)
    (found,) = found_by(page, robot, sl.Pose(pose.position[None], np.eye(3)))
    drawn = np.array(found["points"])
    np.testing.assert_allclose(drawn[:, -41:], expected[:, -41:], atol=1e-9)
    if expected.shape[1] > 41:  # on the pulleys: all points lie on their rims, from the anchor on
        np.testing.assert_allclose(drawn[:, 0], robot.frame_anchors, atol=1e-12)
        radius = np.linalg.norm(drawn[:, :16] - pulley_centers(robot, pose)[:, None], axis=2)
        np.testing.assert_allclose(radius, 0.25, atol=1e-9)


def test_a_platform_at_an_anchor_is_told(page: Page) -> None:
    robot = ROBOTS["falcon-7"]
    at = robot.frame_anchors[3] - robot.platform_anchors[3]
    (found,) = found_by(page, robot, sl.Pose(at[None], np.eye(3)))
    assert (found["feasible"], found["why"], found["blocking"]) == (False, "chord", [3])
