"""Colors of tensions at one pose, and the note on invisible sag."""

import re
from collections.abc import Iterator

import numpy as np
import pytest

import sagline as sl
from sagline.viewer.features import FEATURES
from sagline.viewer.page import Page
from sagline.viewer.readout import factor_slider
from sagline.viewer.tension_scale import TensionScale
from tests.viewer.client import Client, await_that
from tests.viewer.shown import Shown, handle, shown

LIMITS = TensionScale(10.0, 1000.0)


def test_the_scale_of_a_pose_ends_at_its_tensions() -> None:
    scale = TensionScale.of_pose(np.array([300.0, np.nan, 330.0, 310.0, 0.0]), LIMITS)
    assert (scale.low, scale.high) == (300.0, 330.0)
    assert TensionScale.of_pose(np.array([np.nan, 0.0]), LIMITS) is LIMITS
    equal = TensionScale.of_pose(np.full(3, 50.0), LIMITS)
    assert equal.fraction(np.array(50.0)) == pytest.approx(0.5)


def test_a_factor_of_one_is_in_the_middle_and_the_left_end_may_be_zero() -> None:
    ends = {}
    for low, high, least in ((0.1, 10.0, 0.1), (0.05, 20.0, 0.0), (1.0, 200.0, 1.0)):
        html = factor_slider("Factor ×", low, high, least, "")
        ends[high] = re.findall(r"--at:([\d.]+)%\">([\d.]+)<", html)
        assert f'min="{least:g}" max="{high:g}"' in html
    assert ends[10.0] == [("0", "0.1"), ("50", "1"), ("100", "10")]
    assert ends[20.0] == [("0", "0"), ("50", "1"), ("100", "20")]
    assert ends[200.0] == [("0", "1"), ("100", "200")]


@pytest.fixture(scope="module")
def page() -> Iterator[Shown]:
    yield from shown(lambda server: Page(server, FEATURES, sl.load_robot("cogiro")))


def spread(page: Shown) -> float:
    """Largest difference between the colors of two cables."""
    colors = page.node("/cables").colors.reshape(-1, 3).astype(float)
    return float(np.linalg.norm(colors[:, None] - colors, axis=2).max())


def test_similar_tensions_have_different_colors_by_pose(page: Shown) -> None:
    before = spread(page)
    with Client(page.url) as client:
        client.drag([0.5, 0.25, 2.6])
        await_that(lambda: page.position[0] == 0.5)
        client.set(handle(page, "Colors by"), "this pose")
        await_that(lambda: "of this pose" in page.text)
        await_that(lambda: spread(page) > max(2.0 * before, 100.0))
        assert page.viewer.view is not None
        tension = page.viewer.view.snapshot.tension
        legend = re.findall(r"left:[\d.]+%[^>]*>([\d.]+)<", page.text)
        assert min(map(float, legend)) >= float(f"{tension.min():.4g}")
        assert max(map(float, legend)) <= float(f"{tension.max():.4g}")
        client.set(handle(page, "Colors by"), "tension limits")
        await_that(lambda: "of this pose" not in page.text)


def test_an_invisible_sag_has_a_note(page: Shown) -> None:
    assert page.viewer.view is not None
    plan = page.viewer.view.snapshot.plan  # type: ignore[union-attr]
    assert plan is not None
    await_that(lambda: "too small to be seen" in page.text)
    found = re.search(r"The sag is ([\d.]+)\s*mm", page.text)
    assert found is not None
    assert float(found[1]) == pytest.approx(1e3 * plan.state.cables.sag.max(), rel=0.05)
    with Client(page.url) as client:
        client.set(handle(page, "Sag drawn ×"), 5.0)
        await_that(lambda: "too small to be seen" not in page.text)
