"""The drawing of the feasible tensions."""

import re

import numpy as np
import pytest

import sagline as sl
from sagline.viewer.features.tensions import polygon_figure
from sagline.viewer.snapshot import Settings, snapshot_at

ROBOT = sl.load_robot("article-suspended")
HERE = sl.Pose([1.0, 0.5, 2.0], np.eye(3))


def test_the_drawing_has_the_shape_of_the_polygon_with_the_dot() -> None:
    html = polygon_figure(snapshot_at(ROBOT, HERE, Settings(mass=50.0, tension=sl.Centroid()), None))
    polygon = sl.tension_polygon(ROBOT, HERE)
    found = re.search(r'<polygon points="(.*?)"', html)
    assert found is not None
    drawn = np.array([[float(part) for part in point.split(",")] for point in found[1].split()]) * [1.0, -1.0]
    size = np.ptp(drawn, axis=0)[0] / np.ptp(polygon.vertices, axis=0)[0]
    shape = (polygon.vertices - polygon.vertices[0]) * size
    assert drawn - drawn[0] == pytest.approx(shape, abs=0.2)
    dot = re.search(r'<circle cx="([\d.]+)" cy="([\d.]+)"', html)
    assert dot is not None
    tension = sl.inverse(ROBOT, HERE, tension=sl.Centroid()).chord_tension
    where = (polygon.basis @ (tension - polygon.origin) - polygon.vertices[0]) * size
    assert np.array([float(dot[1]), -float(dot[2])]) - drawn[0] == pytest.approx(where, abs=0.5)


def test_edges_are_named_outside_of_the_polygon() -> None:
    html = polygon_figure(snapshot_at(ROBOT, HERE, Settings(mass=50.0), None))
    found = re.search(r'<polygon points="(.*?)"', html)
    assert found is not None
    corners = np.array([[float(part) for part in point.split(",")] for point in found[1].split()])
    labels = re.findall(r'<text x="([\d.]+)" y="([\d.]+)"[^>]*>(\d) (min|max)</text>', html)
    sides = {(side.cable, side.limit): k for k, side in enumerate(sl.tension_polygon(ROBOT, HERE).sides) if side}
    assert len(labels) > 2
    turn = np.sign(np.linalg.det([corners[1] - corners[0], corners[2] - corners[1]]))
    for x, y, cable, limit in labels:
        k = sides[int(cable), limit]
        start, end = corners[k], corners[(k + 1) % len(corners)]
        away = np.array([float(x), float(y) - 3.0]) - start  # text on its baseline
        assert turn * np.linalg.det([end - start, away]) < 0.0


def test_other_redundancies_have_a_text() -> None:
    seven = sl.load_robot("falcon-7")
    assert seven.test_box is not None
    middle = sl.Pose(0.5 * (seven.test_box.low + seven.test_box.high), np.eye(3))
    html = polygon_figure(snapshot_at(seven, middle, Settings(mass=seven.mass), None))
    ends = sl.tension_polygon(seven, middle).vertices[:, 0]
    assert f"{ends.min():.4g} to {ends.max():.4g} N" in html
    outside = snapshot_at(ROBOT, sl.Pose([7.2, 3.0, 1.5], np.eye(3)), Settings(mass=50.0), None)
    assert "No tensions" in polygon_figure(outside)
