"""Figures show the correct numbers in the units of their axes."""

from dataclasses import replace
from io import BytesIO
from pathlib import Path as FilePath
from typing import Literal

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.collections import QuadMesh
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle
from matplotlib.path import Path as OutlinePath
from matplotlib.text import Annotation, Text
from mpl_toolkits.mplot3d.art3d import Poly3DCollection
from syrupy.assertion import SnapshotAssertion

import sagline as sl
from sagline import FileError, InvalidValueError, plot
from tests.plot import made
from tests.refusal import refused
from tests.tiers import extended, wide

SUSPENDED = sl.load_robot("article-suspended")
PATH = sl.article_path(rate=5.0)


TENSIONS = {
    "chord_tension": r"chord tension $\tau$ [N]",
    "horizontal_tension": "horizontal tension $T_x$ [N]",
    "vertical_force": "vertical force $T_z$ [N]",
    "frame_end_tension": "tension at the frame end $T_A$ [N]",
    "platform_end_tension": "tension at the platform end $T_B$ [N]",
}


def courses(ax: Axes) -> np.ndarray:
    return np.array([line.get_ydata() for line in ax.get_lines()])


def legend(ax: Axes) -> list[str]:
    return list(ax.get_legend_handles_labels()[1])


@pytest.mark.parametrize(("quantity", "label"), TENSIONS.items())
def test_tensions(quantity: str, label: str) -> None:
    ax = plot.tensions(made.plan(), quantity)
    np.testing.assert_array_equal(courses(ax), getattr(made.plan().state.cables, quantity).T)
    np.testing.assert_array_equal(ax.get_lines()[0].get_xdata(), PATH.time)
    assert (ax.get_xlabel(), ax.get_ylabel().replace("\n", " ")) == ("time [s]", label)
    assert legend(ax) == [f"cable {i}" for i in range(8)]


def test_lengths_in_metres_and_adjusting_lengths_in_millimetres() -> None:
    np.testing.assert_array_equal(courses(plot.lengths(made.plan())), made.plan().unstrained_length.T)
    ax = plot.lengths(made.plan(), "adjusting_length")
    chord = np.hypot(made.plan().state.cables.span, made.plan().state.cables.rise)
    np.testing.assert_allclose(courses(ax), 1e3 * (made.plan().unstrained_length - chord).T, rtol=1e-12, atol=1e-11)
    assert ax.get_ylabel().endswith("[mm]")


def test_an_unknown_quantity_is_named() -> None:
    with refused("quantity", "'span'", "unstrained_length, adjusting_length", kind=InvalidValueError):
        plot.lengths(made.plan(), "span")
    with refused("quantity", "'tau'", ", ".join(TENSIONS), kind=InvalidValueError):
        plot.tensions(made.plan(), "tau")


def test_every_cable_looks_different() -> None:
    looks = {(line.get_color(), str(line.get_linestyle())) for line in plot.tensions(made.plan()).get_lines()}
    assert len(looks) == 8


def test_overview_shows_the_four_quantities() -> None:
    cables = made.plan().state.cables
    shown = (
        made.plan().unstrained_length,
        1e3 * cables.adjusting_length,
        made.plan().horizontal_tension,
        made.plan().vertical_force,
    )
    axes = plot.overview(made.plan()).axes
    for ax, values in zip(axes, shown, strict=True):
        np.testing.assert_array_equal(courses(ax), values.T)


def test_infeasible_spans_are_shaded_up_to_halfway_to_the_feasible_samples() -> None:
    times = np.array([0.0, 1.0, 2.0, 4.0, 5.0, 6.0])
    x = np.array([0.0, 0.0, 7.3, 7.3, 0.0, 7.3])  # infeasible at the third, fourth and last sample
    still = np.zeros((6, 6))
    places = sl.Pose.from_euler(np.stack((x, 0.0 * x, 0.0 * x + 1.5), axis=1), 0.0, 0.0, 0.0)
    plan = sl.inverse(SUSPENDED, sl.Path(times, places, still, still))
    assert list(plan.feasible) == [True, True, False, False, True, False]
    ax = plot.tensions(plan)
    spans = [p.get_extents().transformed(ax.transData.inverted()) for p in ax.patches if isinstance(p, Rectangle)]
    np.testing.assert_allclose([(s.x0, s.x1) for s in spans], [(1.5, 4.5), (5.5, 6.0)], rtol=1e-12)
    assert legend(ax).count("infeasible") == 1


def test_poses_without_time_and_a_single_pose() -> None:
    poses = sl.inverse(SUSPENDED, PATH.pose[::50])
    ax = plot.tensions(poses)
    assert ax.get_xlabel() == "pose"
    np.testing.assert_array_equal(ax.get_lines()[3].get_xdata(), np.arange(7))
    single = sl.inverse(SUSPENDED, PATH.pose[0])
    np.testing.assert_array_equal(courses(plot.lengths(single))[:, 0], single.unstrained_length)


def test_path_from_above_with_arrows_along_the_motion() -> None:
    ax = plot.path(PATH)
    np.testing.assert_array_equal(ax.get_lines()[0].get_xydata(), PATH.pose.position[:, :2])
    arrows = [np.subtract(text.xy, text.xyann) for text in ax.texts if isinstance(text, Annotation)]
    directions = [arrow / np.linalg.norm(arrow) for arrow in arrows]
    c, s = 5.0 / np.hypot(5.0, 3.5), 3.5 / np.hypot(5.0, 3.5)
    expected = [(c, s), (-1, 0), (0, -1), (1, 0), (0, 1), (-c, -s)]  # each motion of the path of the article
    np.testing.assert_allclose(directions, expected, atol=1e-6)
    assert ax.get_title(loc="right") == "$z$ = 1.5 m"
    assert len(ax.figure.axes) == 1  # a level path has no panel of heights


def test_the_height_of_a_path_is_drawn_over_time() -> None:
    way = sl.quintic_path([(0, 0, 1.5), (0, 0, 2.5), (1, 0, 1.0)], speed=1.0)
    ax = plot.path(way)
    _, below = ax.figure.axes
    assert (below.get_xlabel(), below.get_ylabel()) == ("time [s]", "$z$ [m]")
    np.testing.assert_array_equal(
        below.get_lines()[0].get_xydata(), np.column_stack((way.time, way.pose.position[:, 2]))
    )
    own = Figure().add_subplot()
    assert plot.path(way, ax=own) is own
    assert own.figure.axes == [own]


def test_velocity() -> None:
    ax = plot.velocity(PATH)
    np.testing.assert_array_equal(courses(ax), PATH.twist[:, :3].T)
    assert ax.get_ylabel() == "velocity [m/s]"


def test_errors_are_in_millimetres_on_one_scale() -> None:
    straight, exact = (sl.confirm(sl.inverse(SUSPENDED, PATH, model=m)) for m in (sl.Straight(), sl.Catenary()))
    left, right = plot.errors(straight, exact).axes
    np.testing.assert_array_equal(courses(left), 1e3 * straight.position_error.T)
    assert left.get_ylim() == right.get_ylim()
    assert left.get_ylabel().endswith("error [mm]")
    alone = plot.error(exact)
    low, high = alone.get_ylim()
    assert (low, high) == (-1e-3, 1e-3)  # rounding is not enlarged to fill the figure


def test_errors_that_are_too_small_to_see_are_stated() -> None:
    straight, exact = (sl.confirm(sl.inverse(SUSPENDED, PATH, model=m)) for m in (sl.Straight(), sl.Catenary()))
    assert [text.get_text() for text in plot.error(exact).texts] == ["largest: 0 (rounding)", "$x$", "$y$", "$z$"]
    left, right = plot.errors(straight, exact).axes
    assert ([t.get_text() for t in left.texts], [t.get_text() for t in right.texts]) == ([], ["largest: 0 (rounding)"])
    shallow = sl.confirm(sl.inverse(SUSPENDED, PATH, model=sl.Parabolic()))
    largest = 1e6 * np.abs(shallow.position_error).max()
    told = [text.get_text() for text in plot.errors(straight, shallow).axes[1].texts]
    assert told == [f"largest: {largest:.0f}\u00a0µm"]


def test_poses_without_confirmed_equilibrium_are_shaded() -> None:
    lengths = made.plan().unstrained_length.copy()
    lengths[20:30] *= 0.3  # no stable equilibrium
    found = sl.forward(SUSPENDED, lengths, start=PATH.pose)
    assert np.flatnonzero(found.status != sl.ForwardStatus.SOLVED).tolist() == list(range(20, 30))
    ax = plot.error(replace(sl.confirm(made.plan()), status=found.status, pose=found.pose))
    spans = [p.get_extents().transformed(ax.transData.inverted()) for p in ax.patches if isinstance(p, Rectangle)]
    middles = 0.5 * (PATH.time[19:31:10] + PATH.time[20:32:10])
    np.testing.assert_allclose([(s.x0, s.x1) for s in spans], [tuple(middles)], rtol=1e-12)
    assert legend(ax)[-1] == "not confirmed"


def test_a_sample_between_two_gaps_is_visible() -> None:
    times = np.arange(5.0)
    x = np.array([0.0, 7.3, 0.0, 7.3, 7.3])
    places = sl.Pose.from_euler(np.stack((x, 0.0 * x, 0.0 * x + 1.5), axis=1), 0.0, 0.0, 0.0)
    plan = sl.inverse(SUSPENDED, sl.Path(times, places, np.zeros((5, 6)), np.zeros((5, 6))))
    assert list(plan.feasible) == [True, False, True, False, False]
    for line in plot.tensions(plan).get_lines():
        assert (line.get_marker(), line.get_markevery()) == ("o", [0, 2])


def test_cables_end_at_the_anchors() -> None:
    pose = sl.Pose.from_euler((1.0, 2.0, 1.7), 0.3, 0.0, 0.0)
    ax = plot.robot(SUSPENDED, pose)
    cables = [np.array(line.get_data_3d()).T for line in ax.get_lines()[:8]]
    ends = pose.position + SUSPENDED.platform_anchors @ pose.matrix.T
    np.testing.assert_allclose([c[0] for c in cables], SUSPENDED.frame_anchors, atol=1e-12)
    np.testing.assert_allclose([c[-1] for c in cables], ends, atol=1e-9)
    plan = sl.inverse(SUSPENDED, pose)
    for cable, sag in zip(cables, plan.state.cables.sag, strict=True):
        share = np.linalg.norm((cable - cable[0])[:, :2], axis=1) / np.linalg.norm((cable[-1] - cable[0])[:2])
        drop = cable[0, 2] + share * (cable[-1, 2] - cable[0, 2]) - cable[:, 2]
        assert drop.max() == pytest.approx(sag, rel=2e-3)  # one of 50 points is near the lowest one


def test_cables_have_the_color_of_their_tension_and_their_numbers() -> None:
    pose = sl.Pose.from_euler((3.0, 2.0, 1.7), 0.0, 0.0, 0.0)
    robot = sl.load_robot("article-mixed")
    ax = plot.robot(robot, pose)
    tension = sl.inverse(robot, pose).chord_tension
    colors = np.array([to_rgb(line.get_color()) for line in ax.get_lines()[:8]])
    (bar,) = [other for other in ax.figure.axes if other is not ax]
    assert bar.get_ylabel() == TENSIONS["chord_tension"]
    (mesh,) = [drawn for drawn in bar.collections if isinstance(drawn, QuadMesh)]
    np.testing.assert_allclose(mesh.to_rgba(tension)[:, :3], colors, atol=0.02)  # the color bar names the colors
    assert [text.get_text() for text in ax.texts] == [str(k) for k in range(8)]
    for text, anchor in zip(ax.texts, robot.frame_anchors, strict=True):
        assert np.linalg.norm(np.array(text.get_position_3d()) - anchor) < 1.0


@pytest.mark.parametrize("name", wide(sl.robot_names()))
def test_numbers_on_the_axes_of_a_robot_do_not_overlap(name: str) -> None:
    ax = plot.robot(sl.load_robot(name))
    figure = ax.figure
    figure.draw_without_rendering()
    texts = []
    for axis in (ax.xaxis, ax.yaxis, ax.zaxis):
        assert len(axis.get_ticklocs()) >= 1
        texts += [tick.label1 for tick in axis.get_major_ticks() if tick.label1.get_text()] + [axis.label]
    boxes = [outline(text) for text in texts]
    for k, box in enumerate(boxes):
        assert figure.bbox.contains(*box.get_extents().min)
        assert figure.bbox.contains(*box.get_extents().max)
        assert not any(box.intersects_path(other, filled=True) for other in boxes[:k]), (name, texts[k])


def outline(text: Text) -> OutlinePath:
    """The box of a text with its rotation."""
    turned = text.get_rotation()
    middle = text.get_window_extent()
    text.set_rotation(0.0)
    size = np.asarray(text.get_window_extent().size)
    text.set_rotation(turned)
    corners = 0.5 * size * np.array([(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0)])
    c, s = np.cos(np.radians(turned)), np.sin(np.radians(turned))
    center = 0.5 * (np.asarray(middle.min) + np.asarray(middle.max))
    return OutlinePath(center + corners @ np.array([(c, s), (-s, c)]))


@extended
@pytest.mark.parametrize(
    ("pattern", "size"), [("2T", (0.3, 1e-9, 0.2)), ("3T", (0.0, 0.0, 0.0)), ("2T", (0.0, 0.0, 0.0))]
)
def test_robots_without_width_are_drawn(pattern: Literal["3T", "2T"], size: tuple[float, float, float]) -> None:
    corners = [(-4.0, 0.0, 3.0), (4.0, 0.0, 3.0), (4.0, 0.0, 0.0), (-4.0, 0.0, 0.0)]
    frame = np.array(corners if pattern == "2T" else [*corners[:2], (0.0, 4.0, 3.0), (0.0, -4.0, 3.0)])
    robot = sl.Robot(
        name="flat",
        frame_anchors=frame,
        platform_anchors=np.zeros((4, 3)),
        cables=sl.Cable(0.01, 1e5),
        mass=10.0,
        motion_pattern=pattern,
        plane_normal=(0.0, 1.0, 0.0) if pattern == "2T" else None,
        tension_min=1.0,
        tension_max=1000.0,
        platform_size=size if any(size) else None,
    )
    ax = plot.robot(robot, sl.Pose([0.2, 0.0, 1.5], np.eye(3)))
    ax.figure.draw_without_rendering()
    low, high = ax.get_ylim3d()
    assert high - low >= 0.79  # a tenth of the length, so that it is visible


def test_the_platform_stands_over_its_shadow() -> None:
    ax = plot.robot(SUSPENDED, sl.Pose.from_euler((2.0, -1.0, 1.7), 0.3, 0.0, 0.0))
    ground, shadow = (drawn for drawn in ax.collections if isinstance(drawn, Poly3DCollection))
    corners, dark = (np.asarray(flat._faces)[0] for flat in (ground, shadow))
    assert np.all(corners[:, 2] == 0.0)
    assert np.all(dark[:, 2] == 0.0)
    np.testing.assert_allclose(np.mean(dark[:4, :2], axis=0), (2.0, -1.0), atol=1e-9)
    edges = np.sort(np.linalg.norm(np.diff(dark[[0, 1, 2, 3, 0], :2], axis=0), axis=1))
    assert SUSPENDED.platform_size is not None
    np.testing.assert_allclose(edges[::2], np.sort(SUSPENDED.platform_size[:2]), rtol=1e-9)
    assert ground.get_zorder() <= shadow.get_zorder() < ax.get_lines()[0].get_zorder()


def test_a_robot_that_nothing_holds_says_so(snapshot: SnapshotAssertion) -> None:
    ax = plot.robot(SUSPENDED, sl.Pose.from_euler((0.0, 0.0, 7.0), 0.0, 0.0, 0.0))
    assert ax.get_title() == snapshot
    assert ax.get_lines()[0].get_linestyle() == "--"


def test_a_robot_needs_one_pose() -> None:
    with refused("pose", "missing", "a single pose, because the robot has no test box", kind=InvalidValueError):
        plot.robot(SUSPENDED.replace(test_box=None))
    with refused("pose", "a batch of 301", kind=InvalidValueError):
        plot.robot(SUSPENDED, PATH.pose)


def test_axes_of_the_caller_are_used() -> None:
    figure = Figure()
    ax = figure.add_subplot()
    for draw in (plot.tensions, plot.lengths):
        assert draw(made.plan(), ax=ax) is ax
    assert plot.velocity(PATH, ax) is ax
    space = figure.add_subplot(projection="3d")
    assert plot.robot(SUSPENDED, ax=space) is space


@extended
@pytest.mark.parametrize(("suffix", "start"), [("svg", b"<?xml"), ("png", b"\x89PNG"), ("pdf", b"%PDF")])
def test_figures_are_saved_the_same_each_time(tmp_path: FilePath, suffix: str, start: bytes) -> None:
    for name in ("a", "b"):
        plot.save(plot.velocity(PATH), tmp_path / f"{name}.{suffix}")
    content = (tmp_path / f"a.{suffix}").read_bytes()
    assert content.startswith(start)
    if suffix != "pdf":
        assert content == (tmp_path / f"b.{suffix}").read_bytes()


def test_an_unknown_suffix(tmp_path: FilePath) -> None:
    with refused(kind=FileError, file=tmp_path / "a.xyz") as caught:
        plot.save(plot.overview(made.plan()), tmp_path / "a.xyz")
    assert ".xyz" in caught.value.reason
    assert "png" in caught.value.next_step
    assert not list(tmp_path.iterdir())


@extended
def test_a_notebook_shows_the_figure() -> None:
    from PIL import Image

    figure = plot.overview(made.plan())
    image = Image.open(BytesIO(figure._repr_png_()))  # type: ignore[attr-defined]
    assert image.size == (705, 1147)


@extended
def test_a_path_of_a_hundred_thousand_stops_has_distinguishable_arrows() -> None:
    count = 200_000
    moving = (np.arange(count) % 2)[:, None] * np.ones((count, 6))
    angle = np.linspace(0.0, 6.0, count)
    place = np.stack((np.cos(angle), np.sin(angle), 0.0 * angle), axis=1)
    ax = plot.path(sl.Path(np.arange(count) / 1e3, sl.Pose(place, np.eye(3)), moving, 0.0 * moving))
    begins = np.array([child.xy for child in ax.get_children() if isinstance(child, Annotation)])
    assert len(begins) == 100
    assert np.ptp(np.diff(np.unwrap(np.arctan2(begins[:, 1], begins[:, 0])))) < 1e-3  # equally spaced


def test_pulleys_are_drawn_as_circles_and_cables_leave_them_at_their_exit_points() -> None:
    winch = sl.Winch(pulley_radius=0.3, dead_cable=2.0, dead_rise=[2.0] * 4 + [1.0] * 4, drum_radius=0.25)
    robot, pose = SUSPENDED.replace(winches=winch), sl.Pose([1.0, 0.5, 2.0], np.eye(3))
    lines = plot.robot(robot, pose).get_lines()
    drawn = [np.array(line.get_data_3d()).T for line in lines]
    plan = sl.inverse(robot, pose)
    for cable, anchor, leaves in zip(drawn[:8], robot.frame_anchors, plan.exit_point, strict=True):
        np.testing.assert_array_equal(cable[0], anchor)
        assert np.linalg.norm(cable - leaves, axis=1).min() < 1e-9
    ends = pose.transform(robot.platform_anchors)
    np.testing.assert_allclose([cable[-1] for cable in drawn[:8]], ends, atol=1e-9)
    reach = (ends - robot.frame_anchors) * [1.0, 1.0, 0.0]
    centers = robot.frame_anchors + 0.3 * reach / np.linalg.norm(reach, axis=1, keepdims=True)
    for circle, center in zip(drawn[8:16], centers, strict=True):
        np.testing.assert_allclose(np.linalg.norm(circle - center, axis=1), 0.3, rtol=1e-9)
    for i, anchor in enumerate(robot.frame_anchors):  # after the circles of eight pulleys and eight drums
        run, rise = drawn[24 + i], 2.0 if i < 4 else 1.0
        np.testing.assert_allclose(run, [anchor, anchor - (0.0, 0.0, rise)], atol=1e-15)
        assert lines[24 + i].get_linestyle() == ("-" if i < 4 else ":")
