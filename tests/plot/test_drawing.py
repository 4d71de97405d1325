"""A robot drawn for print: positions, numbers of cables, and poses without equilibrium."""

from pathlib import Path as FilePath
from typing import Any

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from syrupy.assertion import SnapshotAssertion

import sagline as sl
from sagline import InvalidValueError, plot
from sagline.plot.robot import strokes as lines_of
from sagline.viewer.tension_scale import TensionScale
from tests.refusal import refused
from tests.tiers import extended, wide

ROBOT = sl.load_robot("article-mixed")
POSE = sl.Pose.from_euler((1.0, 0.5, 1.7), 0.1, 0.0, 0.2)
SOME = ("falcon-7", "fast", "ipanema-3-pulleys")  # all others in a long run


def strokes(ax: Axes) -> list[LineCollection]:
    return [each for each in ax.collections if isinstance(each, LineCollection)]


def distance_from_line(points: np.ndarray, course: np.ndarray) -> float:
    """Largest distance of points from a polyline."""
    starts, steps = course[:-1], np.diff(course, axis=0)
    away = points[:, None] - starts
    square = np.maximum(np.einsum("sc,sc->s", steps, steps), 1e-30)
    share = np.clip(np.einsum("nsc,sc->ns", away, steps) / square, 0.0, 1.0)
    return float(np.linalg.norm(away - share[..., None] * steps, axis=2).min(axis=1).max())


@pytest.mark.parametrize(("azimuth", "elevation"), wide([(2.3, 0.9), (-1.0, 0.4), (0.0, 0.0), (0.4, 0.5 * np.pi)]))
def test_cables_have_their_shape_and_the_color_of_their_tension(azimuth: float, elevation: float) -> None:
    ax = plot.drawing(ROBOT, POSE, azimuth, elevation)
    plan = sl.inverse(ROBOT, POSE)
    right = np.array([-np.sin(azimuth), np.cos(azimuth), 0.0])
    up = np.array([-np.sin(elevation) * np.cos(azimuth), -np.sin(elevation) * np.sin(azimuth), np.cos(elevation)])
    colors = TensionScale.of(ROBOT).colors(plan.chord_tension) / 255.0
    ends = POSE.transform(ROBOT.platform_anchors)
    for i, drawn in enumerate(strokes(ax)[:8]):
        np.testing.assert_allclose(np.asarray(drawn.get_colors())[0, :3], colors[i], atol=1e-12)
        profile = plan.state.cables[i].points(41)  # in the plane of the cable, from its frame end
        level = (ends[i] - ROBOT.frame_anchors[i])[:2]
        level = level / np.linalg.norm(level)
        course = ROBOT.frame_anchors[i] + np.column_stack((profile[:, :1] * level, profile[:, 1]))
        picture = np.column_stack((course @ right, course @ up))
        parts = [np.asarray(path.vertices) for path in drawn.get_paths()]
        assert parts
        assert max(distance_from_line(part, picture) for part in parts) < 1e-9


@extended
def test_each_number_is_nearest_to_its_cable() -> None:
    for name in ("article-mixed", "cogiro", "ipanema-2"):
        robot = sl.load_robot(name)
        ax = plot.drawing(robot)
        texts = [text for text in ax.texts if text.get_text().isdigit()]
        assert [text.get_text() for text in texts] == [str(i) for i in range(8)]
        places = np.array([text.get_position() for text in texts], dtype=np.float64)
        courses = [np.concatenate([np.asarray(path.vertices) for path in each.get_paths()]) for each in strokes(ax)[:8]]
        for i, place in enumerate(places):
            nearest = [distance_from_line(place[None], course) for course in courses]
            assert nearest[i] <= min(nearest) + 1e-9, (name, i)
        room = 8.0 * np.ptp(ax.get_xlim()) / (ax.bbox.width / ax.figure.dpi * 72.0)
        gaps = np.linalg.norm(places[:, None] - places, axis=2) + 9e9 * np.eye(8)
        assert gaps.min() > 0.9 * room, name  # numbers do not meet


def test_cables_without_equilibrium_are_straight_dashed_and_gray(snapshot: SnapshotAssertion) -> None:
    ax = plot.drawing(ROBOT, sl.Pose([0.0, 0.0, 9.0], np.eye(3)))
    assert ax.get_title() == snapshot
    assert len(ax.figure.axes) == 1  # no color bar without tensions
    for drawn in strokes(ax)[:8]:
        dashes: Any = drawn.get_linestyle()
        assert dashes[0][1] is not None
        assert np.ptp(np.asarray(drawn.get_colors())[0, :3]) < 0.06


@pytest.mark.parametrize("elevation", [-0.1, 1.6])
def test_the_direction_of_view_is_from_above_the_ground(elevation: float) -> None:
    with refused("elevation", f"{elevation:g} rad", "0 to pi / 2", kind=InvalidValueError):
        plot.drawing(ROBOT, POSE, elevation=elevation)


@extended
@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=[] if name in SOME else pytest.mark.soak) for name in sl.robot_names()]
)
def test_every_robot_is_drawn_within_its_figure(name: str, tmp_path: FilePath) -> None:
    with plot.style("ieee"):
        ax = plot.drawing(sl.load_robot(name))
    assert isinstance(ax.figure, Figure)
    ax.figure.draw_without_rendering()
    box, bounds = ax.get_tightbbox(), ax.figure.bbox
    assert box is not None
    assert bounds.x0 - 1.0 <= box.x0 < box.x1 <= bounds.x1 + 1.0
    assert bounds.y0 - 1.0 <= box.y0 < box.y1 <= bounds.y1 + 1.0
    plot.save(ax, tmp_path / "robot.svg")
    text = (tmp_path / "robot.svg").read_text(encoding="utf-8")
    assert "<image" not in text
    assert "chord tension" in text


def test_axes_of_the_caller_are_used_and_a_point_mass_has_no_faces() -> None:
    point = sl.Robot(
        "point", [[3, 0, 3], [-2, 2, 3], [-2, -2, 3]], np.zeros((3, 3)), sl.Cable(0.05, 5e4), 10.0, motion_pattern="3T"
    )
    ax = Figure().add_subplot()
    assert plot.drawing(point, sl.Pose([0.0, 0.0, 1.0], np.eye(3)), ax=ax) is ax
    assert all(each.get_paths() for each in strokes(ax)[:3])


def test_cables_of_winches_on_the_platform_begin_at_the_frame() -> None:
    winches = sl.Winch(0.1, dead_cable=0.4, drum_radius=0.1, on_platform=[True, False] * 4)
    robot, pose = sl.load_robot("cogiro").replace(winches=winches), sl.Pose.from_euler([1.0, 0.5, 2.0], 0.1, 0.0, 0.1)
    plan = sl.inverse(robot, pose)
    cables, others = lines_of(robot, pose, plan)
    np.testing.assert_allclose([each.points[0] for each in cables], robot.frame_anchors, atol=1e-9)
    ends = pose.transform(robot.platform_anchors)
    np.testing.assert_allclose([each.points[-1] for each in cables], ends, atol=1e-9)
    rims = np.array([each.points for each in others[:8]])  # of the pulleys, which contain the exit points
    gaps = np.linalg.norm(rims - plan.exit_point[:, None], axis=2).min(axis=1)
    assert gaps.max() < 0.1 * np.pi / 49.0
    feet = [each.points[1] for each in others if len(each.points) == 2][:4]  # of the dead lengths on the platform
    np.testing.assert_allclose(feet, pose.transform(robot.platform_anchors - [0.0, 0.0, 0.4])[::2], atol=1e-12)
