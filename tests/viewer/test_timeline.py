"""The timeline without a browser: contents of its tracks and actions on it."""

import json
import re
from collections.abc import Iterator
from dataclasses import fields, replace
from typing import Any

import numpy as np
import pytest

import sagline as sl
from sagline.control import State
from sagline.viewer.features import FEATURES
from sagline.viewer.features.timeline import TimelineFeature
from sagline.viewer.page import Page
from sagline.viewer.playback import PlayedPlan, PlayedSimulation
from sagline.viewer.player import Beside, Player
from sagline.viewer.server import start_server, stop_server
from sagline.viewer.session import LogFollower, PlayedLog
from sagline.viewer.timeline import MOST_COLUMNS as MOST_COLUMNS
from sagline.viewer.timeline import (
    MOST_SPANS,
    Chart,
    Track,
    columns,
    limit_violations,
    spans_of,
    timeline_message,
)
from tests.effort import least_seconds
from tests.files.executions import events_of, execution
from tests.tiers import extended, wide
from tests.viewer.client import Client, await_that
from tests.viewer.shown import Shown, shown, tell

ROBOT = sl.load_robot("article-mixed")
PLAN = sl.inverse(ROBOT, sl.quintic_path([(0, 0, 1.5), (7.5, 3.5, 1.5), (0, 0, 1.5)], durations=[4.0, 4.0], rate=10))
OTHER = sl.inverse(ROBOT, sl.quintic_path([(0, 0, 1.5), (0, 1, 1.5)], durations=[9.0], rate=10))


@pytest.fixture(scope="module")
def page() -> Iterator[Shown]:
    beside = Beside(PlayedPlan(OTHER), ("a.nc", "b.nc"))
    yield from shown(lambda server: Page(server, FEATURES, ROBOT, PlayedPlan(PLAN), beside=beside))


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> PlayedLog:
    file = tmp_path_factory.mktemp("log") / "run.mcap"
    execution().save(file)
    session = LogFollower(file).more()
    assert session is not None
    return session


def changed(session: PlayedLog, **changes: Any) -> PlayedLog:
    return replace(session, **changes)


@pytest.fixture
def growing(log: PlayedLog) -> Iterator[Shown]:
    """The first hundred cycles of the log."""
    cycles = {
        name: value[:100]
        for name in (each.name for each in fields(log))
        if isinstance(value := getattr(log, name), np.ndarray)
    }
    yield from shown(lambda server: Page(server, FEATURES, log.robot, changed(log, **cycles)))


@pytest.mark.parametrize("seed", wide(range(20), 5))
def test_columns_have_the_extrema_of_their_samples(seed: int) -> None:
    generator = np.random.default_rng(seed)
    count, most = int(generator.integers(2, 5000)), int(generator.integers(2, 300))
    time = np.cumsum(generator.uniform(1e-3, 1.0, count))
    values = generator.normal(size=(count, 3))
    values[generator.random((count, 3)) < 0.3] = np.nan
    starts, low, high = columns(time, values, most)
    assert len(starts) == min(count, most)
    assert starts[0] == time[0]
    ends = [*np.searchsorted(time, starts), count]
    for k in range(len(starts)):
        for line in range(3):
            part = values[ends[k] : ends[k + 1], line]
            known = part[~np.isnan(part)]
            expected = (known.min(), known.max()) if known.size else (np.nan, np.nan)
            assert np.array_equal([low[k, line], high[k, line]], expected, equal_nan=True)


@pytest.mark.parametrize("seed", wide(range(20), 5))
def test_shaded_spans_cover_exactly_the_faulty_samples(seed: int) -> None:
    generator = np.random.default_rng(seed)
    count = int(generator.integers(2, 4000))
    time = np.cumsum(generator.uniform(0.01, 0.1, count))
    wrong = generator.random(count) < generator.uniform(0.0, 0.3)
    spans = spans_of(time, wrong, lambda rows: f"{rows.start} {rows.stop}")
    covered = np.zeros(count, dtype=bool)
    for start, end, why in spans:
        first, stop = map(int, why.split())
        assert wrong[first]
        assert wrong[stop - 1]
        assert start == time[first]
        assert end == time[min(stop, count - 1)]  # a sample lasts until the next
        covered[first:stop] = True
        good = np.flatnonzero(~wrong[first:stop]) + first
        near = (time[-1] - time[0]) / MOST_SPANS
        assert all(time[k + 1] - time[k] <= near for k in good)
    assert np.all(covered[wrong])
    assert len(spans) <= MOST_SPANS + 1


def test_infeasible_spans_of_a_plan_have_reasons() -> None:
    track = PlayedPlan(PLAN).track()
    gaps = PLAN.gaps
    (before, gap, after), ((start, end, why),) = gaps, track.spans
    assert before.status is after.status is sl.PoseStatus.UNSTABLE
    time = track.time
    assert (start, end) == (time[before.first], time[after.last + 1])
    cables = ", ".join(map(str, gap.cables))
    assert f" {gap.shortfall:.1f} N; " in why
    assert why.endswith(f"cables {cables}")


def test_the_page_receives_the_numbers_of_the_plan() -> None:
    track = PlayedPlan(PLAN).track()
    (part,) = timeline_message([("run", track)], 0, 8.0)["tracks"]
    low = np.array(part["low"], dtype=float)  # None as NaN
    np.testing.assert_allclose(low.T, PLAN.state.limited_tension, rtol=0.0, atol=0.5001e-2)
    assert part["high"] is None  # a column a sample
    assert np.array_equal(part["times"], np.round(PLAN.path.time, 9))  # type: ignore[union-attr]
    assert [limit[:2] for limit in part["limits"]] == [(25.0, "lowest allowed"), (2000.0, "highest allowed")]
    lengths = timeline_message([("run", track)], 1, 8.0)["tracks"][0]
    np.testing.assert_allclose(
        np.array(lengths["low"], dtype=float).T, PLAN.unstrained_length, rtol=0.0, atol=0.5001e-5
    )
    json.dumps(timeline_message([("run", track)], 0, 8.0), allow_nan=False)


def test_limits_within_the_range_are_drawn_and_others_stated() -> None:
    time, limits = (
        np.linspace(0.0, 1.0, 11),
        ((25.0, "lowest", False), (2000.0, "highest", True)),
    )
    chart = Chart("Tension", "N", 1, ("0",), lambda rows: 30.0 + 20.0 * time[rows, None], limits)
    page = timeline_message([("a", Track(time, (chart,)))], 0, 1.0)
    assert page["range"] == pytest.approx([25.0 - 1.0, 50.0 + 1.0])
    assert page["tracks"][0]["limits"] == [(25.0, "lowest", False)]
    assert page["tracks"][0]["far"] == "highest 2000 N"


@pytest.mark.parametrize("seed", wide(range(20), 5))
def test_a_zoomed_range_has_finer_data(seed: int) -> None:
    generator = np.random.default_rng(seed)
    time = np.cumsum(generator.uniform(1e-3, 1.0, 4000))
    time -= time[0]
    values = generator.normal(size=(4000, 2))
    track = Track(time, (Chart("x", "N", 5, ("x", "y"), values.__getitem__),))
    start, end = np.sort(generator.uniform(0.0, time[-1], 2))
    rows = track.within(start, end)
    inside = (time >= start) & (time <= end)
    assert np.all(inside[rows] | (np.arange(4000)[rows] == rows.start) | (np.arange(4000)[rows] == rows.stop - 1))
    assert np.count_nonzero(inside[rows]) == np.count_nonzero(inside)
    if rows.start > 0:
        assert time[rows.start] < start  # the line comes from there, and that sample lasts until the next
    (part,) = timeline_message([("a", track)], 0, float(time[-1]), (start, end))["tracks"]
    known = values[rows]
    assert np.min(part["low"], axis=1) == pytest.approx(known.min(axis=0), abs=1e-6)
    assert np.max(part["high"] or part["low"], axis=1) == pytest.approx(known.max(axis=0), abs=1e-6)
    assert len(part["times"]) == min(len(known), MOST_COLUMNS)


def test_two_tracks_have_one_axis_and_the_chosen_chart() -> None:
    time = np.linspace(0.0, 1.0, 3)

    def track(titles: str, size: float) -> Track:
        return Track(time, tuple(Chart(each, "N", 1, ("0",), lambda rows: size * time[rows, None]) for each in titles))

    page = timeline_message([("a", track("AB", 1.0)), ("b", track("CA", 7.0))], 0, 1.0)
    assert [part["title"] for part in page["tracks"]] == ["A", "A"]
    assert page["range"] == pytest.approx([-0.35, 7.35])
    page = timeline_message([("a", track("AB", 1.0)), ("b", track("CA", 7.0))], 1, 1.0)
    assert [part["title"] for part in page["tracks"]] == ["B", "A"]  # no B: what is in its place


def test_a_simulation_marks_a_break_and_omits_the_broken_cable() -> None:
    state = sl.inverse(sl.load_robot("cogiro"), sl.Pose([0.0, 0.0, 2.0], np.eye(3))).state
    cut = sl.simulate(state, duration=1.0, events=sl.Break(cable=3, time=0.5))
    track = PlayedSimulation(cut).track()
    ((time, _, bad),) = [mark for mark in track.marks if mark[1].startswith("break of cable 3")]
    assert time == pytest.approx(0.5)
    assert bad
    values = track.charts[0].values(slice(None))
    assert np.array_equal(np.isnan(values[:, 3]), cut.time >= 0.5)
    assert np.array_equal(values[:, :3], cut.tensions[:, :3])
    assert not any(" 3" in why.split(" below")[0] for _, _, why in track.spans)


def test_tensions_beyond_their_limits_are_spans_with_their_worst() -> None:
    robot = ROBOT.replace(tension_min=20.0, tension_max=500.0)
    tension = np.full((6, 8), 100.0)
    tension[1:3, 4], tension[2, 5], tension[4, 0] = [12.0, 14.0], 700.0, np.nan
    ((*ends, why),) = limit_violations(robot, np.arange(6.0), tension)
    assert ends == [1.0, 3.0]
    told = re.findall(r"cable (\d) (below|above) ([\d.]+) N: ([\d.]+) N[\w ]+winch", why)
    assert told == [("4", "below", "20.0", "12.0"), ("5", "above", "500.0", "700.0")]


def test_a_log_marks_its_events_and_shades_its_faults(log: PlayedLog) -> None:
    marks = log.track().marks
    assert [(time, bad) for time, _, bad in marks] == [(0.0, False), (0.5, True)]
    assert [text for _, text, _ in marks] == [f"{event.name}: {event.text}" for event in events_of()]
    state = np.where((log.time >= 0.8) & (log.time < 1.2), State.FAULT, State.MOVING)
    ((*ends, why),) = changed(log, state=state.astype(np.int8)).track().spans
    assert ends == pytest.approx([0.8, 1.2])
    assert why == "FAULT"


def test_steps_move_from_sample_to_sample() -> None:
    track = Track(np.array([0.0, 0.1, 0.4, 0.5]), ())
    assert [track.step_from(0.1, steps) for steps in (1, 2, 9, -1, -9, 0)] == [0.4, 0.5, 0.5, 0.0, 0.0, 0.1]
    assert track.step_from(0.3, 1) == 0.4
    assert track.step_from(0.3, -1) == 0.0


def test_scrubbing_shows_that_sample_in_both_runs(page: Shown) -> None:
    with Client(page.url) as client:
        tell(page, client, "scrub", 1.25)
        await_that(lambda: np.array_equal(page.position, PLAN.state.pose.position[12]))
        beside = page.node("/beside")
        await_that(lambda: np.array_equal(beside.position, OTHER.state.pose.position[12]))
        await_that(lambda: page.told("clock")["time"] == 1.25)
        tell(page, client, "step", 2)
        await_that(lambda: np.array_equal(page.position, PLAN.state.pose.position[14]))
        tell(page, client, "scrub", 9.0)  # the first run has ended, the second has not
        await_that(lambda: np.array_equal(beside.position, OTHER.state.pose.position[-1]))
        await_that(lambda: np.array_equal(page.position, PLAN.state.pose.position[-1]))
        assert page.told("timeline")["duration"] == 9.0
        client.grab()
        client.drag([0.3, 0.0, 1.5])
        await_that(lambda: page.told("clock")["following"] is False)
        assert not beside.visible
        tell(page, client, "follow", True)
        await_that(lambda: page.told("clock")["following"] is True and bool(beside.visible))


@extended
def test_play_and_speed_work_with_thirty_clock_messages_per_second(page: Shown) -> None:
    with Client(page.url) as client:
        tell(page, client, "speed", 4.0)
        tell(page, client, "scrub", 0.0)
        await_that(lambda: page.told("clock") == {"time": 0.0, "playing": False, "speed": 4.0, "following": True})
        list(client.heard(0.3))
        tell(page, client, "play", True)
        tell(page, client, "play", True)  # said twice it plays all the same
        await_that(lambda: page.told("clock")["time"] == 9.0)
        await_that(lambda: not page.told("clock")["playing"])
        heard = [str(m.get("updates", {}).get("content", "")) for m in client.heard(0.5)]
        clocks = [text for text in heard if text.startswith("sagline:clock:")]
        assert 2 <= len(clocks) <= 30 * 9.0 / 4.0 + 3
        tell(page, client, "speed", 1.0)
        await_that(lambda: page.told("clock")["speed"] == 1.0)


def test_a_chart_is_chosen_and_the_cable_at_the_pointer_is_bold(page: Shown) -> None:
    with Client(page.url) as client:
        tell(page, client, "chart", 1)
        await_that(lambda: page.told("timeline")["tracks"][0]["title"] == "Unstrained length")
        tell(page, client, "chart", 0)
        tell(page, client, "follow", True)
        tell(page, client, "scrub", 0.0)
        tell(page, client, "point", 2)
        await_that(lambda: (line := page.node("/pointed")) is not None and bool(line.visible))
        ends = page.node("/pointed").points[[0, -1], [0, 1]]
        assert ends[0] == pytest.approx(ROBOT.frame_anchors[2], abs=1e-6)
        assert ends[1] == pytest.approx(PLAN.state.pose.position[0] + ROBOT.platform_anchors[2], abs=1e-6)
        tell(page, client, "point", None)
        await_that(lambda: not page.node("/pointed").visible)


@extended
def test_zooming_in_and_out(page: Shown) -> None:
    with Client(page.url) as client:
        tell(page, client, "window", [2.0, 4.0])
        await_that(lambda: page.told("timeline")["window"] == [2.0, 4.0])
        times = page.told("timeline")["tracks"][0]["times"]
        assert times == pytest.approx(np.arange(1.9, 4.05, 0.1))  # the one before lasts into it
        tell(page, client, "window", [-3.0, 1.0])
        await_that(lambda: page.told("timeline")["window"] == [0.0, 1.0])
        tell(page, client, "speed", 16.0)
        tell(page, client, "scrub", 0.0)
        tell(page, client, "play", True)
        await_that(lambda: page.told("timeline")["window"][0] > 0.0)  # the clock has left it
        await_that(lambda: not page.told("clock")["playing"])
        tell(page, client, "speed", 1.0)
        tell(page, client, "window", [-1.0, 99.0])
        await_that(lambda: page.told("timeline")["window"] == [0.0, 9.0])
        tell(page, client, "window", [2.0, 4.0])
        await_that(lambda: page.told("timeline")["window"] == [2.0, 4.0])
        tell(page, client, "window", None)
        await_that(lambda: page.told("timeline")["window"] == [0.0, 9.0])
        list(client.heard(0.1))  # who has not heard all takes ten seconds to leave


def test_a_zoomed_range_follows_the_clock() -> None:
    server = start_server(port=0)
    try:
        page = Page(server, (), ROBOT, PlayedPlan(PLAN))
        channel, player = page.channel, page.player
        show = TimelineFeature(page)

        def window() -> Any:
            show.tick()
            return json.loads(channel._sent["timeline"].content.split(":", 2)[2])["window"]

        channel._handlers["window"]([1.0, 3.0], 0)
        player.scrub_to(2.5)
        channel._handlers["play"](True, 0)
        assert window() == [1.0, 3.0]
        player.advance(1.0)
        assert window() == [3.5, 5.5]  # it turned the page
        player.advance(100.0)  # just after that
        assert not player.playing
        assert window() == [6.0, 8.0]
        player.scrub_to(0.0)
        assert window() == [6.0, 8.0]  # who looks elsewhere does so by hand
    finally:
        stop_server(server)


@extended
def test_a_growing_log_is_followed_at_its_end(growing: Shown, log: PlayedLog) -> None:
    with Client(growing.url) as client:
        tell(growing, client, "chart", 1)
        tell(growing, client, "scrub", 99.0)
        await_that(lambda: growing.told("clock")["time"] == log.time[99])
        growing.viewer.extend(log)
        await_that(lambda: growing.told("clock")["time"] == log.duration)
        await_that(lambda: growing.told("timeline")["duration"] == log.duration)
        grown = growing.told("timeline")
        assert grown["chart"] == 1  # more of the same: what is looked at stays
        assert grown["tracks"][0]["times"][-1] == log.duration


NONSENSE: dict[str, tuple[Any, ...]] = {
    "scrub": (None, "1", True, [], {}, 1e400, -1e400, 10**400),
    "step": (None, "1", False, [1], 1e9, -1e9),
    "play": (None, 1, 0, "true", []),
    "speed": (None, 0, -1, 3, "1", True, 1e400),
    "follow": (None, 1, "false", {}),
    "chart": (None, -1, 2, 1.0, True, "0", 10**30),
    "window": (0, [], [0.0], [1.0, 0.0], [0.0, 1e400], ["0", "1"], [3.0, 3.0 + 1e-9], {}, True, [0.0, 1.0, 2.0]),
    "point": ("1", 1.0, [], {}, True, 10**30, -1),
}


def test_invalid_messages_are_ignored(page: Shown) -> None:
    with Client(page.url) as client:
        tell(page, client, "scrub", 2.0)
        await_that(lambda: page.told("clock")["time"] == 2.0)
        before = page.told("clock"), page.told("timeline")
        for topic, values in NONSENSE.items():
            for value in values:
                tell(page, client, topic, value)
        tell(page, client, "point", None)
        tell(page, client, "speed", 4.0)  # a speed that is one
        await_that(lambda: page.told("clock")["speed"] == 4.0)
        assert ({**page.told("clock"), "speed": 1.0}, page.told("timeline")) == before
        tell(page, client, "speed", 1.0)
        await_that(lambda: page.told("clock")["speed"] == 1.0)
        assert page.thread.is_alive()


def test_a_cut_is_played_alone_and_undo_restores_both_runs() -> None:
    run, other = PlayedPlan(PLAN), Beside(PlayedPlan(OTHER), ("a", "b"))
    player = Player(run, lambda *_: None, other)
    assert (player.beside, player.duration) == (other, 9.0)
    player.play(PlayedPlan(PLAN))
    assert (player.beside, player.duration) == (None, 8.0)
    player.extend(run)
    player.play(run)
    assert (player.beside, player.duration) == (other, 9.0)


@extended
def test_a_long_run_is_sent_quickly() -> None:
    """600,000 samples of eight cables: the page receives its data in a moment."""
    time = np.linspace(0.0, 600.0, 600_000)
    values = np.random.default_rng(1).normal(size=(600_000, 8))
    marks = tuple((float(k), "x", False) for k in range(1000))
    track = Track(time, (Chart("Tension", "N", 1, tuple("01234567"), values.__getitem__),), (), marks)
    assert least_seconds(lambda: timeline_message([("run", track)], 0, 600.0), 0.5) < 0.5
    assert len(json.dumps(timeline_message([("run", track)], 0, 600.0))) < 400_000
