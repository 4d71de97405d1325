"""Loads and cables of the region in the page: after a cut, with a push, and during a run."""

import re
from collections.abc import Iterator

import numpy as np
import pytest

import sagline as sl
from sagline.viewer.feature import View
from sagline.viewer.features import FEATURES
from sagline.viewer.features.cut import simulate_cut
from sagline.viewer.features.push import PushFeature
from sagline.viewer.features.region import RegionFeature
from sagline.viewer.page import Page
from sagline.viewer.playback import PlayedSimulation
from sagline.viewer.player import Configuration, Played
from sagline.viewer.server import PageServer, start_server, stop_server
from sagline.viewer.snapshot import Settings, snapshot_at
from tests.viewer.shown import ROBOT, a_run, handle

CUT = 3
SETTINGS = Settings(ROBOT.mass)
POSE = sl.Pose([0.5, 0.3, 1.5], np.eye(3))


@pytest.fixture(scope="module")
def page() -> Iterator[Page]:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("sagline.viewer.workspace.region_hull", lambda *_: None)
        server = start_server(port=0)
        page = Page(server, FEATURES, ROBOT)
        handle(server, "Region").value = handle(server, "Where can I go").value = True
        yield page
        stop_server(server)


def shown_margin(page: Page, snapshot: Configuration, played: Played | None = None) -> tuple[float, str]:
    """Margin below the platform [N], and the words after it."""
    page.feature(RegionFeature).follow(View(snapshot, SETTINGS, page.scale, ghost=False, played=played))
    label = page.server.scene.get_handle_by_name("/platform/left")
    found = re.fullmatch(r"([\d.]+) N (left|too much)(.*)", label.text)  # type: ignore[union-attr]
    assert found is not None
    return float(found[1]) * (1.0 if found[2] == "left" else -1.0), found[3]


def margin_of(robot: sl.Robot, pose: sl.Pose, wrench: np.ndarray | None = None) -> float:
    return float(sl.margin(robot, pose, sl.WrenchBox(center=wrench)).value)


def test_after_a_cut_the_region_is_that_of_the_remaining_cables(page: Page) -> None:
    state = sl.inverse(ROBOT, POSE).state
    cut = PlayedSimulation(next(iter(simulate_cut(state, CUT, "none"))))
    moment = cut.at(cut.duration)
    shown, words = shown_margin(page, moment, cut)
    left = sl.without_cables(ROBOT, CUT)
    assert shown == pytest.approx(margin_of(left, moment.pose), abs=0.06)
    assert shown < 0.0 < margin_of(ROBOT, moment.pose)
    found = re.fullmatch(rf", cable (\d), without cable {CUT}", words)
    assert found is not None
    limiting = np.arange(ROBOT.cable_count) == int(found[1])
    low, high = ROBOT.tension_min - 20.0 * limiting, ROBOT.tension_max + 20.0 * limiting
    relaxed = sl.without_cables(ROBOT.replace(tension_min=low, tension_max=high), CUT)
    assert margin_of(relaxed, moment.pose) > margin_of(left, moment.pose) + 1.0


def test_the_margin_follows_a_push(page: Page) -> None:
    server = page.server
    assert isinstance(server, PageServer)
    handle(server, "Force [N]").value, handle(server, "Along x, y, z").value = 300.0, (1.0, 0.0, 0.0)
    handle(server, "At x, y, z [m]").value = at = (0.1, -0.2, 0.3)
    push = page.feature(PushFeature).push
    assert push is not None
    lever = np.array(at) - ROBOT.center_of_mass
    wrench = np.concatenate(([300.0, 0.0, 0.0], np.cross(lever, [300.0, 0.0, 0.0])))
    try:
        shown, _ = shown_margin(page, snapshot_at(ROBOT, POSE, SETTINGS, None))
        assert shown == pytest.approx(margin_of(ROBOT, POSE, wrench), abs=0.06)
        run = a_run()  # a run has its own loads
        moment = run.at(1.0)
        shown, _ = shown_margin(page, moment, run)
        state = run.plan.state[run.index_at(1.0)]
        loads = sl.WrenchBox(center=state.wrench)
        assert shown == pytest.approx(float(sl.margin(ROBOT, state.pose, loads, model=sl.Empirical()).value), abs=0.06)
        assert abs(shown - margin_of(ROBOT, state.pose)) > 0.1
    finally:
        page.feature(PushFeature).release()
