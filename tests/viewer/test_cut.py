"""A cable is clicked, cut and restored by a client without a browser."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from viser import CameraHandle

import sagline as sl
from sagline.viewer import shapes
from sagline.viewer.camera import Camera
from sagline.viewer.features import FEATURES, cut
from sagline.viewer.features.cut import CutFeature
from sagline.viewer.page import Page, home_pose
from sagline.viewer.playback import PlayedSimulation
from sagline.viewer.player import InMotion, Played, Player
from sagline.viewer.server import start_server, stop_server
from tests.effort import least_seconds
from tests.plot import made
from tests.tiers import extended, wide
from tests.viewer.client import Client, await_that
from tests.viewer.shown import ROBOT, Shown, controls, handle, shown
from tests.viewer.test_push_show import POSE, look, tell


@pytest.fixture(scope="module")
def page() -> Iterator[Shown]:
    yield from shown(lambda server: Page(server, FEATURES, ROBOT, pose=POSE))


def seen_at(page: Shown, camera: CameraHandle, cable: int) -> list[float]:
    """Position of a cable in the view of a client, away from the others."""
    eye = Camera.of(camera)
    assert eye is not None
    assert page.viewer.view is not None
    places = eye.project(page.viewer.view.snapshot.courses(1.0))[0]
    others = np.delete(places, cable, axis=0).reshape(-1, 2)
    away = np.linalg.norm(places[cable, :, None] - others, axis=2).min(axis=1)
    assert away.max() > 5.0
    return [float(x) for x in places[cable, away.argmax()] / eye.pixels]


def button_of(page: Shown, cable: int) -> Any:
    """The button that cuts a cable; None if it is not offered."""
    found = (each for each in controls(page.server) if each.label == f"Cut cable {cable}" and each.visible)
    return next(found, None)


def test_a_click_marks_the_cable_below_it(page: Shown) -> None:
    with Client(page.url) as client:
        camera, chosen = look(client, page), handle(page, "Cable to cut")
        for cable in (0, 3, 5):
            tell(client, page, "pick", seen_at(page, camera, cable))
            await_that(lambda cable=cable: button_of(page, cable) is not None)  # type: ignore[misc]
            assert chosen.value == str(cable)
            assert page.node("/chosen").visible
            view = page.viewer.view
            assert view is not None
            tension = view.snapshot.tension[cable]
            assert page.node("/chosen_name").text == f"cable {cable}: {tension:.1f} N"
            np.testing.assert_allclose(page.node("/chosen").points[0, 0], ROBOT.frame_anchors[cable], atol=1e-5)
        tell(client, page, "pick", [0.02, 0.98])
        await_that(lambda: not page.node("/chosen").visible)
        strange: list[Any] = [None, [], {}, [1], ["x", 2], [1e300, 1e300], [[0.5, 0.5]], 10**400]
        for nonsense in strange:
            tell(client, page, "pick", nonsense)
        tell(client, page, "pick", seen_at(page, camera, 1))
        await_that(lambda: chosen.value == "1")


@extended
def test_the_motion_agrees_with_simulate_and_undo_restores_all(page: Shown) -> None:
    def played() -> Played | None:
        assert page.viewer.view is not None
        return page.viewer.view.played

    with Client(page.url) as client:
        camera = look(client, page)
        tell(client, page, "pick", seen_at(page, camera, 2))
        await_that(lambda: button_of(page, 2) is not None)
        before = page.viewer.view
        assert before is not None
        client.set(button_of(page, 2), True)
        await_that(lambda: (found := played()) is not None and found.duration > 4.0)
        whole = played()
        assert isinstance(whole, PlayedSimulation)
        state = sl.inverse(ROBOT, POSE, tension=sl.MinimumNorm()).state
        damping = sl.Damping(loss_time=1e-3)
        by_itself = sl.simulate(state, duration=cut.DURATION, events=sl.Break(cable=2, time=0.0), damping=damping)
        np.testing.assert_allclose(whole.simulation.tensions, by_itself.tensions, rtol=1e-9)
        cable, peak, _ = cut.peak_of(by_itself, 2)
        others = np.delete(by_itself.largest_tension, 2)  # type: ignore[arg-type]
        assert peak == others.max()
        await_that(lambda: " so far" not in page.text)
        assert f"{peak:.1f} N in cable {cable}" in page.text
        assert f"{peak / ROBOT.tension_max[cable]:.2f} times" in page.text
        await_that(lambda: page.told("clock")["time"] == whole.duration)
        assert isinstance(page.viewer.view and page.viewer.view.snapshot, InMotion)
        client.set(handle(page, "Undo cut"), True)
        await_that(lambda: played() is None)
        after = page.viewer.view
        assert after is not None
        np.testing.assert_array_equal(after.snapshot.pose.position, POSE.position)
        np.testing.assert_array_equal(after.snapshot.tension, before.snapshot.tension)
        assert not handle(page, "Undo cut").visible


def test_a_run_loaded_in_the_meantime_is_kept() -> None:
    server = start_server(port=0)
    try:
        given, first, second = PlayedSimulation(made.simulation()), made.simulation(50), made.simulation(60)
        viewer = Page(server, FEATURES, given.robot, given)
        cuts, player = viewer.feature(CutFeature), viewer.player
        cuts._requested, before = 1, (given.at(0.0).pose, player.save())
        cuts._play(1, first, 3, before)
        cuts._play(1, second, 3, before)
        assert isinstance(player.played, PlayedSimulation)
        assert player.played.simulation is second
        player.play(given)
        cuts._play(1, made.simulation(70), 3, before)
        assert player.played is given
    finally:
        stop_server(server)


def test_undo_restores_cut_by_cut() -> None:
    server = start_server(port=0)
    try:
        given = PlayedSimulation(made.simulation())
        viewer = Page(server, FEATURES, given.robot, given)
        cuts, player = viewer.feature(CutFeature), viewer.player
        for number in (1, 2):
            cuts._requested = number
            cuts._play(number, made.simulation(50), 3, (given.at(0.0).pose, player.save()))
        first = cuts.before[-1][1].played
        cuts.undo()
        assert player.played is first
        assert handle(server, "Undo cut").visible
        cuts.undo()
        assert player.played is given
        assert not handle(server, "Undo cut").visible
    finally:
        stop_server(server)


@pytest.mark.parametrize("name", wide(["cogiro", "falcon-7", "fast"]))
def test_the_first_part_is_shown_early(name: str) -> None:
    robot = sl.load_robot(name)
    state = sl.inverse(robot, home_pose(robot), tension=sl.MinimumNorm()).state
    parts = cut.simulate_cut(state, 1, "none")
    first = next(parts)
    assert (
        least_seconds(lambda: next(cut.simulate_cut(state, 1, "none")), 0.15) < 0.15
    )  # of the 0.3 until something moves
    again, second = next(cut.simulate_cut(state, 1, "none")), next(parts)
    for part in (again, second):
        np.testing.assert_array_equal(part.tensions[: len(first.time)], first.tensions)
    kinetic = second.energy.kinetic
    assert kinetic.max() > 0.0
    assert np.abs(second.energy.error).max() < 1e-3 * kinetic.max()


def test_the_clock_waits_at_the_end_of_simulated_time() -> None:
    player = Player(None, lambda played: None)
    whole = made.simulation()
    player.play(PlayedSimulation(whole), at_once=True)
    player.advance(5.0)
    ended = player.playing
    player.grow(PlayedSimulation(whole))
    assert (ended, player.playing) == (False, True)
    assert player.time == player.duration == 2.0
    player.scrub_to(1.0)
    player.grow(PlayedSimulation(whole))
    assert (player.time, player.playing) == (1.0, False)


def test_the_previous_run_is_restored_at_its_time() -> None:
    run = PlayedSimulation(made.simulation())
    player = Player(run, lambda played: None)
    player.scrub_to(0.7)
    player.toggle()
    kept = player.save()
    player.play(PlayedSimulation(made.simulation(50)), at_once=True)
    player.advance(0.5)
    player.restore(kept)
    assert player.played is run
    assert (player.time, player.playing, player.following) == (0.7, True, True)
    player.leave()
    kept = player.save()
    player.play(PlayedSimulation(made.simulation(50)), at_once=True)
    player.restore(kept)
    assert (player.time, player.playing, player.following) == (0.7, False, False)


def test_the_pieces_of_a_cut_cable_with_mass_are_drawn() -> None:
    """Up to their free ends, with a gap between them, and without NaN in the segments of the page."""
    state = sl.inverse(sl.load_robot("cogiro"), sl.Pose((0.0, 0.0, 2.0), np.eye(3))).state
    torn = sl.Break(1, 0.0, position=0.5)
    simulation = sl.simulate(state, duration=0.2, cable_mass="lumped", nodes=8, events=torn)
    assert simulation.nodes is not None
    nodes = simulation.nodes[-1, 1]
    (gap,) = np.flatnonzero(np.isnan(nodes[:, 0]))
    course = PlayedSimulation(simulation).at(0.2).courses(1.0)[1]
    empty = np.isnan(course[:, 0])
    assert course[:-1][empty[1:] & ~empty[:-1]] == pytest.approx(nodes[[gap - 1]])
    assert course[1:][empty[:-1] & ~empty[1:]] == pytest.approx(nodes[[gap + 1]])
    drawn = shapes.segments(course[None], dashed=False)
    assert np.isfinite(drawn).all()
    lengths = np.linalg.norm(drawn[:, 1] - drawn[:, 0], axis=1)
    assert lengths.max() < 0.5 * np.linalg.norm(nodes[gap + 1] - nodes[gap - 1])
