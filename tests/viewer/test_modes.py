"""Animated modes, background computations, and simulations played like runs."""

import re
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
import pytest

import sagline as sl
from sagline import InvalidValueError, vibration
from sagline.viewer import readout, shapes
from sagline.viewer.feature import BackgroundTask
from sagline.viewer.features import FEATURES
from sagline.viewer.features.modes import ROWS, ModesFeature
from sagline.viewer.page import Page, home_pose
from sagline.viewer.playback import PlayedSimulation
from sagline.viewer.snapshot import Settings, snapshot_at
from sagline.viewer.swing import PERIOD, mode_of
from sagline.viewer.tension_scale import TensionScale
from tests.effort import best_rate
from tests.plot import made
from tests.tiers import extended, wide
from tests.viewer.client import PATIENCE, Client, await_that
from tests.viewer.shown import ROBOT, Shown, controls, handle, shown

POSE = sl.Pose([3.0, 2.0, 1.5], np.eye(3))


@pytest.fixture
def page() -> Iterator[Shown]:
    yield from shown(lambda server: Page(server, FEATURES, ROBOT, pose=POSE, mode="2"))


def moves(page: Shown) -> bool:
    """True if the page states which mode is animated."""
    return re.search(r"<b>[\d.]+ Hz, ", page.text) is not None


def rows_of(page: Shown) -> list[str]:
    """Rows of the list of modes."""
    return re.findall(r'<tr data-send="mode".*?</tr>', page.text)


def marks_of(page: Shown) -> list[str]:
    """Numbers of the modes that are marked in the drawing of the response."""
    drawings = "".join(re.findall(r"<svg.*?</svg>", page.text, re.DOTALL))
    return re.findall(r'data-send="mode" data-value="(\d+)"', drawings)


def heard_for(client: Client, seconds: float) -> list[Any]:
    """Messages of a duration; an animated page is never silent."""
    start, found = time.monotonic(), []
    for message in client.heard(0.5):
        found.append(message)
        if time.monotonic() - start > seconds:
            break
    return found


@extended
def test_a_long_list_of_modes_has_its_lowest_rows_and_the_chosen_one() -> None:
    robot = sl.load_robot("fast")
    with contextmanager(shown)(lambda server: Page(server, FEATURES, robot, mode="300")) as page:
        show = page.viewer.feature(ModesFeature)
        await_that(lambda: show.moving and not show.waiting)
        rows = rows_of(page)
        numbers = [int(number) for number in re.findall(r"<button [^>]*>(\d+)</button>", "".join(rows))]
        assert len(rows) == len(numbers) == ROWS + 1
        assert numbers[-1] == 300
        assert f" {ROWS} modes" in page.text
        frequencies = [float(row) for row in re.findall(r"<td>([\d.]+)</td>", "".join(rows))]
        assert frequencies == sorted(frequencies)


@extended
def test_a_mode_is_animated_at_the_update_rate_and_stops(page: Shown) -> None:
    show = page.viewer.feature(ModesFeature)
    await_that(lambda: show.moving and not show.waiting)  # the response is there too
    assert show.swing is not None
    found = vibration(show.swing.state, up_to=20.0)
    assert show.swing.mode.frequency == pytest.approx(found.frequency[1], rel=1e-12)
    with Client(page.url) as client:
        await_that(lambda: len(page.server.get_clients()) == 1)  # a closed client is shown everything again
        heard_for(client, 0.5)
        before = page.viewer.updates

        def rate() -> float:
            heard = heard_for(client, 2.0)
            drawn = sum(m.get("name") == "/cables" and "points" in m.get("updates", {}) for m in heard)
            return float(drawn) / 2.0

        assert best_rate(rate, 30.0) >= 30.0  # pictures a second
        assert page.viewer.updates == before  # nothing is solved for them
        farthest = np.linalg.norm(show.swing.courses(0.5 * np.pi) - show.swing.rest, axis=-1).max()
        rest, away, start = shapes.segments(show.swing.rest, dashed=False), [0.0], time.monotonic()
        while time.monotonic() < start + PERIOD or (
            max(away) < 0.9 * farthest and time.monotonic() < start + 20 * PERIOD  # a busy machine leaves pictures out
        ):
            away.append(np.linalg.norm(page.node("/cables").points - rest, axis=-1).max())
            time.sleep(0.01)
        assert max(away) == pytest.approx(farthest, rel=0.1)
        client.set(handle(page, "Mode"), "")
        await_that(lambda: not show.moving)
        np.testing.assert_allclose(page.node("/cables").points, rest, atol=1e-5)


@extended
def test_the_list_describes_every_frequency(page: Shown) -> None:
    with Client(page.url) as client:
        client.set(handle(page, "Mode"), "massless 1")
        await_that(lambda: "massless</b>" in page.text)
        await_that(lambda: any('"massless 1" class="chosen' in row for row in rows_of(page)))
        rows = rows_of(page)
        assert sum('class="chosen' in row for row in rows) == 1
        found = vibration(page.viewer.feature(ModesFeature).swing.state, up_to=20.0)  # type: ignore[union-attr]
        assert len(rows) == found.frequency.size + 6
        plain = [re.sub('data-value="[^"]*"', "", row) for row in rows]
        assert all(("cable mass" in row) != ("massless" in row) for row in plain)
        await_that(lambda: bool(marks_of(page)))
        marks = marks_of(page)
        assert marks == [str(k + 1) for k in range(found.frequency.size)]
        client.set(handle(page, "Mode"), "<b>nothing</b>")
        await_that(lambda: "&lt;b&gt;nothing" in page.text)
        assert not moves(page)
        told = re.search(r"&lt;b&gt;nothing[^<]*", page.text)
        assert told is not None
        assert re.findall(r"1 to (\d+)", told[0]) == [str(found.frequency.size), "6"]
        client.set(handle(page, "Mode"), "1")
        await_that(lambda: moves(page))


@extended
def test_a_drag_stops_the_animation_until_new_modes_exist(page: Shown) -> None:
    with Client(page.url) as client:
        client.set(handle(page, "Mode"), "1")
        await_that(lambda: moves(page))
        for x in np.linspace(3.0, 0.0, 20):
            client.drag([x, 0.0, 1.5])
            time.sleep(0.03)
        await_that(lambda: page.position[0] == 0.0)
        await_that(lambda: moves(page))
        swing = page.viewer.feature(ModesFeature).swing
        assert swing is not None
        assert swing.mode.frequency == pytest.approx(1.77012, abs=1e-5)  # as finite elements have it
        assert swing.state.pose.position[0] == 0.0


@extended
def test_a_cut_cable_is_simulated_and_played_like_a_run(page: Shown, monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[Any] = []

    def cut(state: sl.Equilibrium, cable: int, cable_mass: str) -> Iterator[sl.Simulation]:
        asked.append((state.pose.position.tolist(), cable, cable_mass))
        yield made.simulation()

    monkeypatch.setattr("sagline.viewer.features.cut.simulate_cut", cut)
    with Client(page.url) as client:
        client.drag([1.0, 0.0, 2.0])
        await_that(lambda: page.position[0] == 1.0)
        client.set(handle(page, "Cable to cut"), "3")
        client.set(next(each for each in controls(page.server) if each.label == "Cut" and each.visible), True)
        await_that(lambda: page.viewer.view is not None and page.viewer.view.played is not None)
        assert asked == [([1.0, 0.0, 2.0], 3, "none")]
        await_that(lambda: "cable 3 at 1.000 s" in page.text)
        assert "massless cables" in page.text
        assert not moves(page)
        await_that(lambda: page.told("clock")["time"] == 2.0)
        client.grab()
        client.drag([0.5, 0.0, 2.0])
        await_that(lambda: page.position[0] == 0.5)
        await_that(lambda: moves(page))


def test_cables_of_a_simulation_have_their_lengths() -> None:
    played = PlayedSimulation(made.simulation())
    start, end = played.at(0.0), played.at(9.0)
    state = made.state_at()
    ends = shapes.chords(ROBOT, state.pose)
    np.testing.assert_allclose(start.courses(1.0), shapes.catenaries(ends, state.cables, 1.0), atol=1e-9)
    assert end.index == 199
    assert np.isnan(end.tension[3])
    np.testing.assert_array_equal(end.courses(1.0)[3], np.broadcast_to(ROBOT.frame_anchors[3], (41, 3)))
    assert "<td>–</td>" in end.numbers(TensionScale.of(ROBOT))
    assert played.duration == 2.0
    wanted, actual = played.traces(50, 1.0)
    assert np.isnan(wanted).all()
    np.testing.assert_array_equal(actual[[0, -1]], played.simulation.pose.position[[0, -1]])


def test_only_the_latest_background_result_is_used() -> None:
    tasks: list[Callable[[], None]] = []
    task, done = BackgroundTask(tasks.append), list[int]()
    gate = threading.Event()

    def slow() -> int:
        gate.wait(PATIENCE)
        return 1

    def refuse() -> int:
        raise InvalidValueError("state", "none", "some", "Try.")

    task.start(slow, done.append, print)
    task.start(lambda: 2, done.append, print)
    task.start(lambda: 3, done.append, print)
    assert task.busy
    assert task.elapsed == 0.0
    gate.set()
    for _ in range(2):
        await_that(lambda: bool(tasks))
        tasks.pop()()
    assert done == [3]
    await_that(lambda: not task.busy)
    told: list[str] = []
    task.start(refuse, done.append, told.append)
    await_that(lambda: bool(tasks))
    tasks.pop()()
    assert told == [str(InvalidValueError("state", "none", "some", "Try."))]
    task.start(lambda: 1 // 0, done.append, told.append)
    await_that(lambda: bool(tasks))
    with pytest.raises(ZeroDivisionError):  # the error is not due to the user
        tasks.pop()()


@pytest.mark.parametrize("name", wide(["cogiro", "falcon-7", "fast"]))
def test_natural_frequencies_in_the_readings_animate_their_modes(name: str) -> None:
    robot = sl.load_robot(name)
    seen = snapshot_at(robot, home_pose(robot), Settings(robot.mass), None)
    assert seen.plan is not None
    frequency = sl.modes(seen.plan.state).frequency
    text = readout.numbers_html(seen, TensionScale.of(robot), np.append(frequency, [0.0, np.nan]))
    pressed = re.findall(r'<button class="shake" data-send="mode" data-value="([^"]*)"[^>]*>([^<]*)</button>', text)
    found = vibration(seen.plan.state, up_to=1.0)
    assert len(pressed) == len(frequency) == 6
    for what, told in pressed:
        mode = mode_of(found, what)
        assert mode is not None
        assert told == f"{mode.frequency:.2f}"
    assert f"{frequency[-1]:.2f}, 0.00, – Hz" in re.sub("<[^>]*>", "", text)
