"""A log in the page: platforms, texts, and new data of a growing log."""

import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import viser

import sagline as sl
from sagline.control import Event, EventKind, State
from sagline.files.mcap_writer import Recorder
from sagline.viewer.features import FEATURES
from sagline.viewer.page import Page
from sagline.viewer.playback import PlayedSimulation
from sagline.viewer.player import InMotion, Player
from sagline.viewer.readout import css_color
from sagline.viewer.robot_scene import ACTUAL, INFEASIBLE, PLATFORM, TRUTH, scaled_position
from sagline.viewer.server import start_server, stop_server
from sagline.viewer.session import LogFollower, PlayedLog
from sagline.viewer.tension_scale import TensionScale
from tests.files.executions import cycles_of, events_of, execution, plan_of
from tests.plot import made
from tests.tiers import extended, wide

ROBOT = sl.load_robot("article-prototype")


@pytest.fixture
def log(tmp_path: Path) -> Path:
    execution().save(tmp_path / "run.mcap")
    return tmp_path / "run.mcap"


@pytest.fixture
def truth(tmp_path: Path) -> Path:
    """A twin that is 3 mm lower, from half a second on, on the same clock."""
    plan = plan_of()
    with Recorder(tmp_path / "twin.mcap", ROBOT, epoch=0) as recorder:
        for k in range(50, 201):
            below = plan.state.pose.position[k] - np.array([0.0, 0.0, 3e-3])
            recorder.truth(1000.0 + 0.01 * k, below, plan.state.pose.quaternion[k])
    return tmp_path / "twin.mcap"


def session_of(log: Path, truth: Path | None = None) -> PlayedLog:
    session = LogFollower(log, truth).more()
    assert session is not None
    return session


def text_of(html: str) -> str:
    return " ".join(re.sub(r"<[^>]+>", " ", html).split())


def test_set_estimated_and_true_platforms_are_at_their_poses(log: Path, truth: Path) -> None:
    session, done, plan = session_of(log, truth), execution(), plan_of()
    assert session.duration == pytest.approx(2.0)
    early, late, silent = session.at(0.2), session.at(1.204), session.at(0.49)
    assert late.index == 120
    assert np.allclose(late.pose.position, plan.state.pose.position[120], rtol=0.0, atol=1e-12)
    assert late.rest is not None
    assert late.truth is not None
    assert np.array_equal(late.rest.position, done.position[120])
    assert np.allclose(late.truth.position - late.pose.position, [0.0, 0.0, -3e-3], rtol=0.0, atol=1e-9)
    drawn = scaled_position(late.pose, late.truth, 10.0)
    assert np.allclose(drawn - late.pose.position, [0.0, 0.0, -3e-2], rtol=0.0, atol=1e-8)
    assert early.truth is None  # the twin's log begins later
    assert silent.rest is None  # there was no solution
    assert np.array_equal(late.tension, done.tension[120])
    assert np.array_equal(late.length, done.length[120])


def test_the_panel_shows_state_errors_and_events(log: Path, truth: Path) -> None:
    session, done = session_of(log, truth), execution()
    moment, scale = session.at(1.2), TensionScale.of(ROBOT)
    said = text_of(moment.verdict)
    assert said.startswith("MOVING Time 1.20 s")
    assert "planned 3 mm" in said
    assert events_of()[1].text in said
    assert events_of()[1].text not in text_of(session.at(0.4).verdict)
    row = text_of(moment.numbers(scale))
    off = done.tension[120] - done.planned_tension[120]
    assert f"5 {done.tension[120, 5]:.1f} {off[5]:.1f}" in row
    assert css_color(scale.colors(moment.tension)[5]) in moment.numbers(scale)


def test_a_text_from_a_log_is_text_on_the_page(log: Path) -> None:
    session = session_of(log)
    evil = Event(1000.0, 0, EventKind.NOTE, "x", State.MOVING, "<script>alert(1)</script>")
    text = replace(session, events=(evil,)).at(1.0).verdict
    assert "<script>" not in text
    assert "&lt;script&gt;" in text


@pytest.mark.parametrize("state", wide([State.FAULT, State.MOVING, State.EMERGENCY]))
def test_a_fault_is_red_with_its_name(log: Path, state: State) -> None:
    session = session_of(log)
    wrong = replace(session, state=np.full(201, state, dtype=np.int8))
    server = start_server(port=0)
    try:
        viewer = Page(server, FEATURES, ROBOT, wrong)
        viewer._update()
        body = handle(server, "/platform/body")
        assert tuple(body.color) == (PLATFORM if state is State.MOVING else INFEASIBLE)
        assert handle(server, "/platform/notice").text == ("" if state is State.MOVING else state.name)
    finally:
        stop_server(server)


def handle(server: viser.ViserServer, name: str) -> Any:
    return server.scene.get_handle_by_name(name)


@extended
def test_the_page_shows_three_platforms_and_follows_the_log(tmp_path: Path, truth: Path) -> None:
    file = tmp_path / "growing.mcap"
    plan, follower = plan_of(), LogFollower(file, truth)
    recorder = Recorder(file, ROBOT, epoch=0)
    recorder.begins(plan)
    cycles = list(cycles_of(plan))
    for cycle in cycles[:100]:
        recorder.cycle(cycle)
    while (session := follower.more()) is None or len(session.time) < 100:
        pass
    server = start_server(port=0)
    try:
        viewer = Page(server, FEATURES, ROBOT, session)
        viewer.player.scrub_to(session.duration)
        viewer._update()
        assert viewer.view is not None
        assert isinstance(viewer.view.snapshot, InMotion)
        assert viewer.view.snapshot.index == 99
        assert handle(server, "/truth").visible
        assert tuple(handle(server, "/truth/body").color) == TRUTH
        for cycle in cycles[100:]:
            recorder.cycle(cycle)
        recorder.close()
        grown = follower.more()
        assert grown is not None
        viewer.extend(grown)
        viewer._update()
        assert viewer.view.snapshot.index == 200  # who looked at the end sees the new end
        assert viewer.player.time == pytest.approx(2.0)
    finally:
        stop_server(server)


def test_a_growing_timeline_keeps_its_range_except_at_its_end() -> None:
    part, whole = PlayedSimulation(made.simulation(50)), PlayedSimulation(made.simulation())
    for before, playing, after in ((part.duration, False, 2.0), (0.5, False, 0.5), (0.5, True, 0.5)):
        player = Player(part, lambda _: None)
        player.time, player.playing = before, playing
        player.extend(whole)
        assert (player.duration, player.time, player.playing) == (2.0, after, playing)


def test_planned_estimated_and_true_platforms_have_different_colors() -> None:
    colors = np.array([PLATFORM, ACTUAL, TRUTH, INFEASIBLE], dtype=float)
    apart = np.linalg.norm(colors[:, None] - colors[None], axis=2) + 1e3 * np.eye(4)
    assert apart.min() > 60.0
    for background in (np.full(3, 255.0), np.array([26.0, 27.0, 30.0])):
        assert contrast(np.array(TRUTH, dtype=float), background) >= 3.0


def contrast(one: np.ndarray, other: np.ndarray) -> float:
    """Of two colors, 1 to 21 (WCAG 2.1)."""

    def luminance(color: np.ndarray) -> float:
        part = color / 255.0
        linear = np.where(part <= 0.04045, part / 12.92, ((part + 0.055) / 1.055) ** 2.4)
        return float(linear @ [0.2126, 0.7152, 0.0722])

    low, high = sorted((luminance(one), luminance(other)))
    return (high + 0.05) / (low + 0.05)


def test_a_platform_with_unknown_pose_is_shown_in_the_middle(log: Path) -> None:
    session = session_of(log)
    unknown = np.full((201, 3), np.nan)
    lost = replace(session, position=unknown, planned=unknown)
    assert ROBOT.test_box is not None
    assert np.allclose(lost.at(0.0).pose.position, 0.5 * (ROBOT.test_box.low + ROBOT.test_box.high))
    later = unknown.copy()
    later[100:120] = [0.1, 0.2, 1.4]
    known = replace(session, position=later, planned=unknown)
    assert np.array_equal(known.at(1.5).pose.position, [0.1, 0.2, 1.4])  # the last that was known
    assert known.track().spans == ()
    assert known.traces(50, 1.0)[1].shape == (50, 3)
