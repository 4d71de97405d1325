"""Undo, redo and reset of all changes of a page."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
import pytest

import sagline as sl
from sagline.viewer.feature import View
from sagline.viewer.features import FEATURES
from sagline.viewer.features.cut import CutFeature
from sagline.viewer.features.history import HistoryFeature
from sagline.viewer.page import Page
from tests.viewer.client import Client, await_that
from tests.viewer.shown import Shown, handle, shown, tell

HOME = [0.0, 0.0, 2.6]


@pytest.fixture
def page(monkeypatch: pytest.MonkeyPatch) -> Iterator[Shown]:
    monkeypatch.setattr("sagline.viewer.features.history.PAUSE", 0.05)
    yield from shown(lambda server: Page(server, FEATURES, sl.load_robot("cogiro"), pose=sl.Pose(HOME, np.eye(3))))


def view(page: Shown) -> View:
    assert page.viewer.view is not None
    return page.viewer.view


def recorded(page: Shown, is_shown: Callable[[], bool]) -> None:
    """Wait until a change is shown and recorded."""
    history = page.viewer.feature(HistoryFeature)
    await_that(lambda: is_shown() and not history._changed)


def at(page: Shown, position: list[float], density: float = 1.0) -> bool:
    return np.array_equal(page.position, position) and view(page).settings.density == density


def test_undo_and_redo_of_poses_and_settings(page: Shown) -> None:
    with Client(page.url) as client:
        client.drag([0.5, 0.25, 2.0])
        recorded(page, lambda: at(page, [0.5, 0.25, 2.0]))
        client.set(handle(page, "Cable density ×"), 4.0)
        recorded(page, lambda: at(page, [0.5, 0.25, 2.0], 4.0))
        tensions = view(page).snapshot.tension
        client.drag([-0.5, 0.0, 3.0])
        recorded(page, lambda: at(page, [-0.5, 0.0, 3.0], 4.0))
        for way, position, density in (
            ("undo", [0.5, 0.25, 2.0], 4.0),
            ("undo", [0.5, 0.25, 2.0], 1.0),
            ("undo", HOME, 1.0),
            ("undo", HOME, 1.0),  # there is no earlier step
            ("redo", [0.5, 0.25, 2.0], 1.0),
            ("redo", [0.5, 0.25, 2.0], 4.0),
        ):
            tell(page, client, "history", way)
            await_that(lambda position=position, density=density: at(page, position, density))  # type: ignore[misc]
        np.testing.assert_array_equal(view(page).snapshot.tension, tensions)
        client.drag([1.0, 1.0, 2.0])  # after a new change there is nothing to redo
        recorded(page, lambda: at(page, [1.0, 1.0, 2.0], 4.0))
        for way, position, density in (
            ("redo", [1.0, 1.0, 2.0], 4.0),
            ("reset", HOME, 1.0),
            ("undo", [1.0, 1.0, 2.0], 4.0),
        ):
            tell(page, client, "history", way)
            await_that(lambda position=position, density=density: at(page, position, density))  # type: ignore[misc]


def pause(history: HistoryFeature, paused: list[int]) -> None:
    """Let a long time pass since the last change; the serving thread calls it."""
    history._changed = 1e-9
    history.tick()
    paused.append(len(history._past))


def test_a_drag_with_pauses_is_one_step(page: Shown) -> None:
    history, paused = page.viewer.feature(HistoryFeature), list[int]()
    with Client(page.url) as client:
        client.grab()
        for x in (0.1, 0.2, 0.3):
            client.drag([x, 0.0, 2.6])
            await_that(lambda x=x: at(page, [x, 0.0, 2.6]))  # type: ignore[misc]
            page.viewer.later(lambda: pause(history, paused))
            await_that(lambda x=x: len(paused) == round(10.0 * x))  # type: ignore[misc]
        assert paused == [0, 0, 0]
        client.say(type="TransformControlsDragEndMessage", name="/platform", owner="")
        recorded(page, lambda: len(history._past) == 1)
        tell(page, client, "history", "undo")
        await_that(lambda: at(page, HOME))


def test_a_cut_is_undone_and_played_again(page: Shown) -> None:
    player = page.viewer.player
    with Client(page.url) as client:
        page.viewer.later(page.viewer.feature(CutFeature).cut)
        await_that(lambda: view(page).played is not None)
        tell(page, client, "history", "undo")
        await_that(lambda: view(page).played is None and at(page, HOME))
        assert not handle(page, "Undo cut").visible
        tell(page, client, "history", "redo")
        await_that(lambda: view(page).played is not None)
        assert handle(page, "Undo cut").visible
        assert player.played is not None


def test_undo_restores_tensions_chosen_by_hand(page: Shown) -> None:
    with Client(page.url) as client:
        before = view(page).snapshot.tension
        tell(page, client, "dot", {"by": [0.1, 0.1]})
        recorded(page, lambda: not np.array_equal(view(page).snapshot.tension, before))
        chosen = view(page).snapshot.tension
        for way, tension in (("undo", before), ("redo", chosen)):
            tell(page, client, "history", way)
            await_that(lambda tension=tension: np.allclose(view(page).snapshot.tension, tension))  # type: ignore[misc]
