"""Labels that do not cover each other, for each client separately."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest

import sagline as sl
from sagline.viewer.camera import Camera
from sagline.viewer.features.labels import Label, LabelsFeature, covered, visible_labels
from sagline.viewer.page import Page
from tests.viewer.client import Client, await_that
from tests.viewer.shown import ROBOT, Shown, framed, shown
from tests.viewer.test_push_show import POSE, look

EYE = Camera(np.zeros(3), np.eye(3), np.array([1.0, 1.0]), np.array([1000.0, 1000.0]))  # looks along z


def label(name: str, *position: float) -> Label:
    return Label(name, np.array(position), np.array([50.0, 20.0]), np.array([0.5, 1.0]))


def test_the_nearer_one_of_two_labels_is_drawn() -> None:
    near, far, apart = label("/a", 0.0, 0.0, 2.0), label("/b", 0.1, 0.0, 4.0), label("/c", 0.5, 0.0, 4.0)
    assert covered([near, far, apart], EYE) == {"/b"}
    assert covered([far, apart, near], EYE) == {"/b"}
    behind = label("/d", 0.0, 0.0, -2.0)
    assert covered([far, apart, behind], EYE) == set()
    assert covered([], EYE) == set()


def test_names_of_axes_and_anchors_give_way() -> None:
    there = [label(name, 0.0, 0.0, 2.0 + k) for k, name in enumerate(("/axes/x", "/names/0", "/limits_names/0", "/a"))]
    assert covered(there, EYE) == {"/axes/x", "/names/0", "/limits_names/0"}
    assert covered(there[:3], EYE) == {"/axes/x", "/names/0"}
    assert covered(there[:2], EYE) == {"/axes/x"}


def test_labels_closer_than_their_sizes_overlap() -> None:
    for across, down, hides in ((49.0, 0.0, True), (51.0, 0.0, False), (0.0, 19.0, True), (0.0, 21.0, False)):
        other = label("/b", across / 250.0, down / 250.0, 2.0)  # 250 px a meter at this distance
        assert bool(covered([label("/a", 0.0, 0.0, 2.0), other], EYE)) is hides


@pytest.fixture
def page() -> Iterator[Shown]:
    yield from shown(lambda server: Page(server, (LabelsFeature,), ROBOT, pose=POSE))


def test_every_client_has_its_own_labels(page: Shown) -> None:
    feature = page.viewer.feature(LabelsFeature)

    def place_of(name: str) -> np.ndarray:
        return next(each.position for each in visible_labels(page.server.scene) if each.name == name)

    with Client(page.url) as beside, Client(page.url) as above:
        numbers = [each.met(page.server).client_id for each in (beside, above)]
        framed(above, page)
        look(beside, page)  # the platform is in the middle of this picture
        page.server.scene.add_label("/far", "a label far behind", position=(0.5, 50.0, 1.5))
        page.server.scene.add_label("/near", "a near label", position=(0.5, 0.0, 1.5))
        await_that(lambda: "/far" in feature._hidden.get(numbers[0], ()) and numbers[1] in feature._hidden)
        assert "/far" not in feature._hidden[numbers[1]]
        told = [m for m in beside.heard(1.0) if m["type"] == "SetSceneNodeVisibilityMessage"]
        assert [m["visible"] for m in told if m["name"] == "/far"][-1] is False
        page.server.scene.get_handle_by_name("/near").visible = False  # type: ignore[union-attr]
        await_that(lambda: "/far" not in feature._hidden[numbers[0]])
        told = [m for m in beside.heard(1.0) if m["type"] == "SetSceneNodeVisibilityMessage"]
        assert [m["visible"] for m in told if m["name"] == "/far"] == [True]
        assert all(m["visible"] for m in above.heard(0.5) if m.get("name") == "/far" and "visible" in m)
    page.viewer.later(lambda: page.viewer.go(sl.Pose([0.0, 0.0, 1.5], np.eye(3))))
    page.server.scene.add_label("/platform/here", "here", position=(0.0, 0.0, 0.5))
    await_that(lambda: page.position[0] == 0.0)
    assert place_of("/platform/here") == pytest.approx([0.0, 0.0, 2.0])  # in the frame of the platform
