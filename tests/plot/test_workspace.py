"""Figures of workspaces show the correct boundaries, margins, limits and fronts."""

import sys
from typing import Any, cast
from unittest.mock import Mock

import numpy as np
import pytest
from matplotlib.collections import QuadMesh
from matplotlib.contour import QuadContourSet
from matplotlib.figure import Figure
from mpl_toolkits.mplot3d.art3d import Poly3DCollection
from syrupy.assertion import SnapshotAssertion

import sagline as sl
from sagline import Front, plot
from sagline.plot.front import _best_until
from sagline.plot.workspace import FAR_SIDE, NEAR_SIDE, _limit_colors, _round_levels
from tests.kinematics.test_many_robots import planar
from tests.refusal import refused
from tests.tiers import extended

ROBOT = sl.load_robot("article-suspended")
LOADS = sl.WrenchBox(force=50.0, moment=5.0)


@pytest.fixture(scope="module")
def space() -> sl.Workspace:
    return sl.workspace(ROBOT, wrenches=LOADS, cells=10, refine=False)


def texts(figure: Figure) -> list[str]:
    return [text.get_text() for ax in figure.axes for text in ax.texts]


def test_the_bold_line_is_the_boundary_and_thin_ones_are_round_margins(space: sl.Workspace) -> None:
    ax = plot.slice(space, "z", at=2.0)
    lines: list[Any] = [one for one in ax.collections if isinstance(one, QuadContourSet) and not one.filled]
    margins, bold = lines
    assert bold.get_linewidth()[0] > 2.0 * margins.get_linewidth()[0]
    ends = np.concatenate([path.vertices for path in bold.get_paths()])[::10]
    poses = sl.Pose.from_euler(np.column_stack((ends, np.full(len(ends), 2.0))), 0.0, 0.0, 0.0)
    away = np.abs(sl.margin(ROBOT, poses, LOADS).value)
    assert np.quantile(away, 0.9) < 0.5  # N, with 50 N per meter and points 75 mm apart
    for level, path in zip(margins.levels, margins.get_paths(), strict=True):
        points = path.vertices[::10]
        poses = sl.Pose.from_euler(np.column_stack((points, np.full(len(points), 2.0))), 0.0, 0.0, 0.0)
        assert np.median(np.abs(sl.margin(ROBOT, poses, LOADS).value - level)) < 0.5
    assert "z = 2\xa0m; ±50\xa0N, ±5\xa0N\xa0m; level" in ax.get_title() or "±50" in ax.get_title()
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("$x$ [m]", "$y$ [m]")


@extended
def test_regions_have_the_color_and_the_name_of_their_cable(space: sl.Workspace) -> None:
    ax = plot.slice(space, "z", at=2.0)
    mesh = next(each for each in ax.collections if isinstance(each, QuadMesh))
    names = [text for text in ax.texts if text.get_text().startswith("cable")]
    assert len(names) >= 4
    colors = _limit_colors(space)
    for name in names:
        x, y = name.get_position()
        found = sl.margin(ROBOT, sl.Pose([x, y, 2.0], np.eye(3)), LOADS)
        assert name.get_text() == f"cable {found.limiting_cable}"
        corner = np.asarray(mesh.get_coordinates())
        column = int(np.searchsorted(corner[0, :, 0], x)) - 1
        row = int(np.searchsorted(corner[:, 0, 1], y)) - 1
        shade = np.asarray(mesh.get_array())[row, column]
        np.testing.assert_allclose(shade, 0.45 * np.array(colors[0, int(found.limiting_cable)]) + 0.55, atol=1e-12)


@extended
def test_a_plane_of_symmetry_has_regions_rather_than_noise(space: sl.Workspace) -> None:
    ax = plot.slice(space, "y", at=0.0)
    mesh = next(each for each in ax.collections if isinstance(each, QuadMesh))
    shades = np.asarray(mesh.get_array())
    changes = (shades[:, 1:] != shades[:, :-1]).any(axis=-1)
    assert changes.mean() < 0.08


@extended
def test_a_plane_is_evaluated_once(space: sl.Workspace, monkeypatch: pytest.MonkeyPatch) -> None:
    module = sys.modules["sagline.plot.workspace"]
    look = Mock(wraps=module.slice_of)
    monkeypatch.setattr(module, "slice_of", look)
    plot.slice(space, "z", at=2.0)
    assert look.call_count == 1


def test_a_slice_outside_of_the_workspace_has_a_note(space: sl.Workspace, snapshot: SnapshotAssertion) -> None:
    ax = plot.slice(space, "x", at=7.5)
    assert [text.get_text() for text in ax.texts] == snapshot


@pytest.mark.parametrize(
    ("normal", "at", "item", "value", "allowed"),
    [
        ("z", 9.0, "at", "9 m", "0 to 6 m, the box"),
        ("z", np.nan, "at", None, None),
        ("q", None, "normal", "'q'", None),
    ],
)
def test_invalid_planes_are_refused(
    space: sl.Workspace, normal: str, at: float | None, item: str, value: str | None, allowed: str | None
) -> None:
    with refused(item, value, allowed, kind=sl.InvalidValueError):
        plot.slice(space, normal, at)


def test_the_hull_is_complete_and_its_bars_are_the_limits(space: sl.Workspace) -> None:
    figure = plot.workspace(space)
    assert isinstance(figure, Figure)
    ax, bars = figure.axes
    hulls: list[Any] = [
        each for each in ax.collections if isinstance(each, Poly3DCollection) and each.get_alpha() is not None
    ]
    assert sorted(each.get_alpha() for each in hulls) == [FAR_SIDE, NEAR_SIDE]
    drawn = np.concatenate([np.asarray(each._faces).reshape(-1, 3) for each in hulls])
    vertices = space.surface.vertices
    width = np.ptp(vertices, axis=0).max() / 90.0
    np.testing.assert_allclose(drawn.min(axis=0), vertices.min(axis=0), atol=2.0 * width)
    np.testing.assert_allclose(drawn.max(axis=0), vertices.max(axis=0), atol=2.0 * width)
    shares = [patch.get_width() for patch in cast(list[Any], bars.patches)]
    assert shares == pytest.approx([100.0 * limit.share for limit in space.limits])
    assert [label.get_text() for label in bars.get_yticklabels()] == [f"cable {one.cable}" for one in space.limits]
    assert f"{space.volume:.0f}" in figure.get_suptitle()


@extended
def test_an_empty_workspace_is_a_figure_too(
    tmp_path_factory: pytest.TempPathFactory, snapshot: SnapshotAssertion
) -> None:
    empty = sl.workspace(ROBOT, wrenches=sl.WrenchBox(1e5), cells=4)
    figure = plot.workspace(empty)
    assert "empty" in figure.get_suptitle()
    plot.save(figure, tmp_path_factory.mktemp("figure") / "empty.png")
    assert [text.get_text() for text in plot.slice(empty).texts] == snapshot


def test_a_planar_robot_is_drawn_as_a_slice() -> None:
    flat = sl.workspace(planar((0.0, 1.0, 0.0)), cells=12)
    assert plot.workspace(flat).axes[0].get_ylabel() == "$z$ [m]"
    with refused("normal", kind=sl.InvalidValueError):
        plot.slice(flat, "z")


def test_round_levels_are_few_and_round() -> None:
    assert _round_levels(233.0).tolist() == [50.0, 100.0, 150.0, 200.0]
    assert _round_levels(0.0).size == _round_levels(np.inf).size == 0


def front_of(*kinds: str, count: int = 30) -> Front:
    """Candidates whose second goal is worse if the first is better; every fifth is not a robot."""
    first = np.linspace(1.0, 2.0, count)
    values = np.column_stack([first, *(3.0 - (k + 1) * first for k in range(len(kinds) - 1))])
    values[::5] = np.nan
    goals = tuple(sl.Goal(kind, maximize=True) for kind in kinds)
    free, none = np.zeros((2, 0)), np.zeros((count, 0))
    return Front(ROBOT, (ROBOT, ROBOT), goals, values[[-1, 6]], values[1], (), free, True, none, values, "cma", 0)


def test_a_front_joins_the_better_robots_and_marks_the_start(snapshot: SnapshotAssertion) -> None:
    found = front_of("mean_margin", "least_margin", "largest_sag")
    figure = plot.front(found)
    assert len(figure.axes) == 2
    for k, ax in enumerate(figure.axes, start=1):
        every, better, start = ax.get_lines()
        np.testing.assert_array_equal(np.asarray(every.get_xydata()), found.evaluated_values[:, [0, k]])
        np.testing.assert_array_equal(np.asarray(better.get_xydata()), found.values[::-1][:, [0, k]])
        np.testing.assert_array_equal(np.asarray(start.get_xydata())[0], found.start_values[[0, k]])
    assert figure.axes[1].get_ylabel() == snapshot


def test_a_search_with_one_goal_is_drawn_over_time() -> None:
    found = front_of("mean_margin")
    _, best, start = plot.front(found).axes[0].get_lines()
    assert np.asarray(best.get_ydata())[-1] == np.nanmax(found.evaluated_values)
    assert np.asarray(start.get_ydata())[0] == found.start_values[0]
    np.testing.assert_array_equal(
        _best_until(np.array([np.nan, 3.0, 1.0, 2.0]), highest=False), [np.nan, 3.0, 1.0, 1.0]
    )
