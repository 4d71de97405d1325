"""A run and its clock."""

import numpy as np
import pytest

import sagline as sl
from sagline.viewer.playback import PlayedPlan
from sagline.viewer.player import Player

ROBOT = sl.load_robot("article-mixed")
PATH = sl.quintic_path(
    sl.Pose(np.array([[0.0, 0.0, 1.5], [6.9, 3.0, 1.5]]), np.stack([np.eye(3)] * 2)), durations=[4.0], rate=10
)
PLAN = sl.inverse(ROBOT, PATH, model=sl.Empirical())
RUN = PlayedPlan(PLAN)


def test_samples_agree_with_the_plan() -> None:
    index = RUN.index_at(1.25)
    assert index == 12
    snapshot = RUN.at(1.25)
    assert np.array_equal(snapshot.pose.position, PATH.pose.position[12])
    assert np.array_equal(snapshot.tension, PLAN.chord_tension[12])
    assert snapshot.plan is not None
    assert snapshot.plan.state.cables.sag == pytest.approx(PLAN.state.cables.sag[12])
    found = sl.forward(ROBOT, PLAN.unstrained_length[12], start=snapshot.pose, wrench=PLAN.state.wrench[12])
    assert snapshot.error == pytest.approx(found.pose.position - PATH.pose.position[12], abs=1e-9)


def test_times_outside_give_the_nearer_end() -> None:
    assert RUN.index_at(-1.0) == 0
    assert RUN.index_at(1e9) == len(PATH) - 1
    assert RUN.duration == pytest.approx(4.0)


def test_the_time_of_a_sample_gives_that_sample() -> None:
    assert [RUN.index_at(float(time)) for time in RUN.time] == list(range(len(PATH)))
    assert RUN.index_at(float(np.nextafter(RUN.time[7], 0.0))) == 6


def test_traces_draw_the_error_times_its_scale() -> None:
    wanted, actual = RUN.traces(1000, 50.0)
    error = sl.confirm(PLAN).position_error
    assert np.array_equal(wanted, PATH.pose.position)
    assert actual - wanted == pytest.approx(50.0 * error, nan_ok=True)
    assert len(RUN.traces(7, 1.0)[0]) == 7


def test_plan_of_a_single_pose_is_no_run() -> None:
    with pytest.raises(sl.InvalidValueError, match="single pose"):
        PlayedPlan(sl.inverse(ROBOT, sl.Pose([0.0, 0.0, 1.5], np.eye(3))))


def test_clock_plays_pauses_scrubs_and_stops_at_the_end() -> None:
    player = Player(RUN, lambda _: None)

    def clock() -> tuple[float, bool]:
        return player.time, player.playing

    player.advance(1.0)
    assert clock() == (0.0, False)
    player.toggle()
    player.speed = 4.0
    player.advance(0.5)
    assert clock() == (2.0, True)
    player.advance(-5.0)
    assert clock() == (2.0, True)
    player.advance(99.0)
    assert clock() == (4.0, False)
    player.toggle()
    assert clock() == (0.0, True)
    player.scrub_to(3.0)
    assert clock() == (3.0, False)
    player.scrub_to(-3.0)
    assert clock() == (0.0, False)
