from dataclasses import replace

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.path import Path
from matplotlib.text import Annotation
from matplotlib.transforms import Bbox

import sagline as sl
from sagline import plot
from tests.refusal import refused
from tests.tiers import extended

MIXED = sl.load_robot("article-mixed")
POSE = sl.Pose([1.0, -0.5, 2.5], np.eye(3))


def test_polygon_shows_corners_limits_and_methods() -> None:
    shape = sl.tension_polygon(MIXED, POSE, model=sl.Elastic())
    plan = sl.inverse(MIXED, POSE, model=sl.Elastic(), tension=sl.Centroid())
    ax = plot.polygon(shape, {"Centroid": plan.chord_tension, "none": np.full(8, np.nan)})
    sides = [line for line in ax.get_lines() if line.get_marker() == "None"]
    drawn = np.array([np.asarray(line.get_xydata())[0] for line in sides])
    np.testing.assert_array_equal(drawn, shape.vertices)
    ends = np.array([np.asarray(line.get_xydata())[1] for line in sides])
    np.testing.assert_array_equal(ends, np.roll(shape.vertices, -1, axis=0))
    names = [text.get_text() for text in ax.texts if isinstance(text, Annotation)]
    assert names == [f"cable {side.cable} {side.limit}" for side in shape.sides if side is not None]
    (point,) = [line for line in ax.get_lines() if line.get_marker() != "None"]
    place = np.asarray(point.get_xydata())[0]
    np.testing.assert_allclose(shape.origin + place @ shape.basis, plan.chord_tension, atol=1e-8)


@extended
def test_edges_of_zero_length_have_names() -> None:
    """At a common corner of three limits, two of them have an edge of zero length; their names do not overlap."""
    shape = sl.tension_polygon(MIXED, POSE)
    corner = shape.vertices[0]
    vertices = np.vstack((corner, corner + 1e-12, corner, shape.vertices[1:]))  # a limit with a wrong direction
    touched = replace(shape, vertices=vertices, sides=(shape.sides[0], shape.sides[0], *shape.sides))
    check_names(plot.polygon(touched), touched, "three in a corner")


def test_nothing_to_draw() -> None:
    with refused("polygon", "0 points with 2 coordinates", kind=sl.InvalidValueError):
        plot.polygon(sl.tension_polygon(MIXED, sl.Pose([9.0, 0, 1.5], np.eye(3))))


def poses(count: int) -> list[tuple[str, sl.TensionPolygon]]:
    """Polygons of many shapes: presets with two redundant cables at random poses, small and long edges."""
    random = np.random.default_rng(5)
    found = []
    for name in ("article-mixed", "article-suspended", "ipanema-1", "ipanema-2", "copacabana", "cogiro", "caroca"):
        robot = sl.load_robot(name)
        assert robot.test_box is not None
        low, high = robot.test_box.low, robot.test_box.high
        for _ in range(count):
            shape = sl.tension_polygon(robot, sl.Pose(random.uniform(low, high), np.eye(3)))
            if len(shape.vertices) > 2:
                found.append((name, shape))
    return found


def check_names(ax: Axes, shape: sl.TensionPolygon, where: str) -> None:
    figure = ax.figure
    figure.draw_without_rendering()  # type: ignore[union-attr]
    names = [text for text in ax.texts if isinstance(text, Annotation)]
    boxes = [super(Annotation, text).get_window_extent() for text in names]
    corners = ax.transData.transform(shape.vertices)
    outline = Path(np.vstack((corners, corners[:1])), closed=False)
    for text, box in zip(names, boxes, strict=True):
        assert not outline.intersects_bbox(box, filled=False), (where, text.get_text())
        assert ax.bbox.x0 <= box.x0, (where, text.get_text())
        assert box.x1 <= ax.bbox.x1, (where, text.get_text())
    for k, box in enumerate(boxes):
        assert not any(Bbox.intersection(box, other) for other in boxes[:k]), (where, names[k].get_text())


@extended
def test_names_do_not_overlap_lines_or_names() -> None:
    cases = poses(3)
    assert len(cases) > 15
    for where, shape in cases:
        check_names(plot.polygon(shape, {"Centroid": shape.tensions.mean(axis=0)}), shape, where)


@pytest.mark.soak
def test_names_of_many_polygons_do_not_overlap() -> None:
    for where, shape in poses(100):
        check_names(plot.polygon(shape), shape, where)


@extended
@pytest.mark.parametrize("size", [1e-6, 100.0, 1e9])
def test_names_at_the_tip_of_a_flat_polygon_are_placed(size: float) -> None:
    shape = sl.tension_polygon(MIXED, POSE)
    corners = size * np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 0.0], [1.0, 0.0], [0.0, 0.0]])
    flat = replace(shape, vertices=corners, tensions=np.zeros((5, 8)), sides=(shape.sides[0],) * 5)
    ax = plot.polygon(flat)
    assert len([text for text in ax.texts if isinstance(text, Annotation)]) == 5
    check_names(ax, flat, f"flat, {size:g} N")
