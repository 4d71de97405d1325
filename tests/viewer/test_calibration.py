"""A calibration in the page: ellipsoids with the size of errors, poses in the color of their fit, selectable rows."""

import re
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from functools import cache, partial
from html import unescape
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import sagline as sl
from sagline.viewer.features import FEATURES
from sagline.viewer.features import calibration as feature
from sagline.viewer.features.calibration import FIELD
from sagline.viewer.page import Page
from sagline.viewer.panel import written_mass
from sagline.viewer.shapes import Solid, error_ellipsoids, placed_balls, readable
from tests.calibration.made_up import made_up, parameters
from tests.tiers import extended
from tests.viewer.client import Client, await_that
from tests.viewer.shown import Shown, handle, shown


@cache
def calibrated() -> sl.Calibration:
    return made_up(count=20, names=("frame_anchors", "platform_anchors", "length_zero", "mass"))


@pytest.fixture(scope="module")
def page() -> Iterator[Shown]:
    yield from shown(lambda server: Page(server, FEATURES, calibrated().robot, found=calibrated()))


@pytest.fixture
def client(page: Shown) -> Iterator[Client]:
    with Client(page.url) as one:
        yield one
        list(one.heard(0.1))


def choose(page: Shown, client: Client, label: str, value: Any) -> None:
    """Set a field, and wait until it has been followed."""
    client.set(handle(page, label), value)
    await_that(lambda: handle(page, label).value == value)
    for _ in range(2):  # the first may have begun before
        before = page.viewer.updates
        page.viewer.refresh()
        await_that(partial(lambda seen: page.viewer.updates > seen, before))


@pytest.mark.parametrize("seed", range(20))
def test_an_ellipsoid_is_its_covariance(seed: int) -> None:
    random = np.random.default_rng(seed)
    roots = random.standard_normal((6, 3, 3)) * 10.0 ** random.uniform(-5.0, 0.0, (6, 1, 1))
    covariance = roots @ np.swapaxes(roots, 1, 2)
    covariance[2], covariance[4, 1, 1] = 0.0, np.inf
    known, errors, directions = error_ellipsoids(covariance)
    np.testing.assert_array_equal(known, [0, 1, 3, 5])
    turns, radii = placed_balls(errors, directions)
    axes = Rotation.from_quat(turns[:, [1, 2, 3, 0]]).as_matrix()
    again = axes @ (errors[..., None] ** 2 * np.swapaxes(axes, 1, 2))
    scale = np.abs(covariance[known]).max(axis=(1, 2), keepdims=True)
    np.testing.assert_allclose(again / scale, covariance[known] / scale, atol=1e-12)
    largest = errors.max(axis=1)
    np.testing.assert_allclose(radii.max(axis=1), largest)
    assert (radii.min(axis=1) >= 0.03 * largest * (1.0 - 1e-12)).all()
    factor = readable(errors, 0.4)
    assert factor == 1.0 or 0.4 / 2.5 <= factor * largest.max() <= 0.4 * (1.0 + 1e-9)


def test_a_ball_has_the_radius_1_all_around() -> None:
    body = Solid.ball()
    np.testing.assert_allclose(np.linalg.norm(body.vertices, axis=1), 1.0, rtol=1e-12)
    np.testing.assert_allclose(body.vertices.mean(axis=0), 0.0, atol=1e-12)


def test_one_pose_in_twenty_has_another_color() -> None:
    random = np.random.default_rng(0)
    count, m = 20_000, 8
    residuals = np.full((count, 2 * m + 6), np.nan)
    residuals[:, : 2 * m] = 0.0
    residuals[::2, 2 * m : 2 * m + 3] = 0.0
    freedom = np.where(np.arange(count) % 2 == 0, m + 3, m)
    squares = np.sum(random.standard_normal((count, m + 3)) ** 2 * (np.arange(m + 3) < freedom[:, None]), axis=1)
    many = replace(calibrated(), residuals=residuals, chi_squared_of_pose=squares)
    np.testing.assert_array_equal(feature.degrees_of_freedom(many), freedom)
    shares = np.bincount(feature.bands(many), minlength=3) / count
    np.testing.assert_allclose(shares, [0.95, 0.049, 0.001], atol=0.004)
    assert shares[2] == pytest.approx(0.001, abs=7e-4)


def test_a_pose_shows_its_residuals() -> None:
    text = unescape(re.sub(r"<[^>]+>", " ", feature.pose_residuals(calibrated(), 17))).replace("\u00a0", " ")
    assert text.split(":")[0].split() == ["Row", "17"]
    cells = re.findall(r"(−?[\d.]+) (µm|mm|N) +(−?[\d.]+) σ", text)
    assert len(cells) == 16
    for k, (residual, unit, times) in enumerate(cells):
        column = k // 2 + (8 if k % 2 else 0)
        size, deviation = {"µm": (1e-6, 5e-4), "mm": (1e-3, 5e-4), "N": (1.0, 5.0)}[unit]
        value = calibrated().residuals[17, column]
        assert float(residual.replace("−", "-")) * size == pytest.approx(value, rel=0.06)
        assert float(times.replace("−", "-")) == pytest.approx(value / deviation, abs=0.0501)
    assert "position" not in text
    assert "position" in feature.pose_residuals(calibrated(), 16)


def test_kinds_are_shown_with_their_units() -> None:
    text = unescape(re.sub(r"<[^>]+>", " ", feature.parameters_text(calibrated()))).replace("\u00a0", " ")
    moved = 1e3 * np.sqrt(np.mean((calibrated().values[:24] - calibrated().parameters.prior[:24]) ** 2))
    error = 1e3 * np.sqrt(np.mean(calibrated().standard_error[:24] ** 2))
    row = re.search(r"frame anchors +([\d.]+) mm +([\d.]+) mm +50 mm", text)
    assert row is not None
    assert [float(each) for each in row.groups()] == pytest.approx([moved, error], rel=0.06)
    assert calibrated().gauge
    assert all(direction.name in text for direction in calibrated().gauge)
    hardly = replace(
        calibrated(), cannot_tell_apart=(replace(calibrated().gauge[0], name="frame_anchors z", known=0.6),)
    )
    assert "frame anchors z, 60 %" in feature.parameters_text(hardly)


def test_meters_and_radians_of_one_kind_are_distinguished() -> None:
    robot = calibrated().before
    numbers = parameters(robot, ("measuring_frame",))
    found = replace(
        calibrated(), parameters=numbers, values=np.array([3.0, 4.0, 0.0, 0.3, 0.0, 0.4]), covariance=np.eye(6)
    )
    text = unescape(re.sub(r"<[^>]+>", " ", feature.parameters_text(found))).replace("\u00a0", " ")
    told = re.findall(r"measuring frame +([\d.]+) (\w+) +1 (\w+) ", text)
    assert told == [("2.9", "m", "m"), ("0.29", "rad", "rad")]  # sqrt(25/3)


@pytest.mark.parametrize("status", list(sl.CalibrationStatus))
def test_the_verdict_agrees_with_the_calibration(status: sl.CalibrationStatus) -> None:
    text = feature.verdict_text(replace(calibrated(), status=status))
    assert (" good" in text) == (status is sl.CalibrationStatus.FOUND)
    for reason, rows in calibrated().left_out.items():
        assert re.search(rf"\b{len(rows)} row{'s'[: len(rows) != 1]} [\w ]+: {re.escape(reason.text)}", text)
    assert status is sl.CalibrationStatus.FOUND or status.text[:30] in text


@extended
def test_errors_are_drawn_with_the_stated_size(page: Shown, client: Client) -> None:
    def semi_axes(where: str) -> np.ndarray:
        return np.sort(page.node(f"{where}/errors").batched_scales.max(axis=1))

    own = [
        np.sqrt(np.linalg.eigvalsh(calibrated().covariance[3 * k : 3 * k + 3, 3 * k : 3 * k + 3])[-1])
        for k in range(16)
    ]
    for factor in (10.0, 40.0):
        choose(page, client, "Drawn ×", factor)
        np.testing.assert_allclose(semi_axes(""), factor * np.sort(own[:8]), rtol=1e-5)
        np.testing.assert_allclose(semi_axes("/platform"), factor * np.sort(own[8:]), rtol=1e-5)
        assert f"{factor:g} times" in page.text
    moves = np.asarray(page.node("/moves").points)
    away = 40.0 * (calibrated().before.frame_anchors - calibrated().robot.frame_anchors)
    np.testing.assert_allclose(moves[:, 0] - moves[:, 1], away, atol=1e-5)
    choose(page, client, "Relative to one another", True)
    assert semi_axes("").max() < 0.3 * 40.0 * max(own[:8])  # the shift and the turn are the most of it
    moves = np.asarray(page.node("/moves").points)
    left = (moves[:, 1] - moves[:, 0]) / 40.0
    away = calibrated().robot.frame_anchors - calibrated().before.frame_anchors
    np.testing.assert_allclose(left.mean(axis=0), 0.0, atol=1e-6)
    centered = calibrated().robot.frame_anchors - calibrated().robot.frame_anchors.mean(axis=0)
    assert abs(np.cross(centered, left)[:, 2].sum()) < 1e-5 < abs(np.cross(centered, away)[:, 2].sum())
    assert np.linalg.norm(left) < np.linalg.norm(away)
    assert "common motion" in page.text
    choose(page, client, "Errors of the anchors", False)
    assert page.node("/errors") is page.node("/platform/errors") is None
    choose(page, client, "Relative to one another", False)
    choose(page, client, "Errors of the anchors", True)
    assert None not in (page.node("/errors"), page.node("/platform/errors"))


@extended
@pytest.mark.parametrize("factor", [0.0, -3.0, float("nan"), 1e300])
def test_invalid_factors_are_refused(page: Shown, client: Client, factor: float) -> None:
    client.set(handle(page, "Drawn ×"), factor)
    await_that(lambda: "Type a factor" in page.text)
    choose(page, client, "Drawn ×", 10.0)
    assert "enlarged 10 times" in page.text


def test_a_chosen_row_moves_the_platform(page: Shown, client: Client) -> None:
    choose(page, client, FIELD, "17")
    await_that(lambda: np.allclose(page.position, calibrated().poses.position[17]))
    assert "Row 17" in page.text
    assert '"17" class="chosen"' in page.text
    for typed, words in (("20", "the platform moved"), ("77", "no such row"), ("x", "no such row"), ("", "")):
        choose(page, client, FIELD, typed)
        assert words in page.text
    assert page.node("/chosen") is None
    np.testing.assert_allclose(page.position, calibrated().poses.position[17])


@extended
def test_a_clicked_pose_is_chosen(page: Shown, client: Client) -> None:
    np.testing.assert_allclose(page.node("/log").batched_positions, calibrated().poses.position, rtol=1e-6)
    np.testing.assert_array_equal(page.node("/log").batched_colors, feature.COLORS[feature.bands(calibrated())])
    assert [page.node(f"/log/{row}").text for row in (4, 17)] == ["row 4, cable 3", "row 17, cable 6"]
    client.say(
        type="SceneNodeClickMessage", name="/log", instance_index=5, ray_origin=[0.0, 0.0, 0.0],
        ray_direction=[1.0, 0.0, 0.0], screen_pos=[0.5, 0.5], modifier=None, owner="",
    )  # fmt: skip
    await_that(lambda: np.allclose(page.position, calibrated().poses.position[5]))
    assert handle(page, FIELD).value == "5"
    choose(page, client, "Poses of the log", False)
    assert page.node("/log") is page.node("/log/4") is None
    choose(page, client, "Poses of the log", True)
    assert page.node("/log") is not None


def test_a_selection_of_a_long_log_and_all_outliers_are_drawn() -> None:
    count = 10_000
    long = replace(
        calibrated(),
        rows=np.arange(count),
        poses=sl.Pose(np.resize(calibrated().poses.position, (count, 3)), np.eye(3)),
        residuals=np.resize(calibrated().residuals, (count, 22)),
        chi_squared_of_pose=np.zeros(count),
        weights=np.ones(count),
        outliers=(replace(calibrated().outliers[0], row=1234),),
    )
    with contextmanager(shown)(lambda server: Page(server, FEATURES, calibrated().robot, found=long)) as page:
        drawn = len(page.node("/log").batched_positions)
        assert 1000 <= drawn <= 4000
        names = [name.text for k in range(drawn) if (name := page.node(f"/log/{k}")) is not None]
        assert names == ["row 1234, cable 3"]


def test_an_estimated_mass_is_shown_exactly(page: Shown) -> None:
    assert written_mass(91.366634512) == 91.367
    field = handle(page, "Platform + load [kg]")
    assert field.value == written_mass(calibrated().robot.mass) != calibrated().robot.mass
    assert page.viewer.view is not None
    assert page.viewer.view.settings.mass == calibrated().robot.mass
