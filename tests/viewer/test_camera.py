"""Projections of a camera compared with calculations by hand."""

from types import SimpleNamespace

import numpy as np
import pytest

import sagline as sl
from sagline.viewer import shapes
from sagline.viewer.camera import Camera

CAMERA = SimpleNamespace(  # ten meters before the origin, looking along y
    wxyz=np.array([np.sqrt(0.5), -np.sqrt(0.5), 0.0, 0.0]),
    position=np.array([0.0, -10.0, 0.0]),
    fov=2.0 * np.arctan(0.5),
    image_width=800,
    image_height=600,
)


def eye() -> Camera:
    found = Camera.of(CAMERA)
    assert found is not None
    return found


def test_projections_agree_with_similar_triangles() -> None:
    places, deep = eye().project(np.array([[0.0, 0.0, 0.0], [2.0, 0.0, 1.0], [1.0, 10.0, 0.0], [0.0, -20.0, 0.0]]))
    # half of the picture's height, 300 px, is 5 m at a distance of 10 m
    np.testing.assert_allclose(places[:3], [[400.0, 300.0], [520.0, 240.0], [430.0, 300.0]], atol=1e-9)
    np.testing.assert_allclose(deep, [10.0, 10.0, 20.0, -10.0], atol=1e-12)


def test_a_ray_leads_back_to_the_point() -> None:
    some = np.random.default_rng(2).uniform(-3.0, 3.0, size=(20, 3))
    places, deep = eye().project(some)
    for point, place, depth in zip(some, places / [800.0, 600.0], deep, strict=True):
        np.testing.assert_allclose(eye().place + depth * eye().ray((place[0], place[1])), point, atol=1e-12)


@pytest.mark.parametrize(
    "wrong",
    [
        {"fov": 0.0},
        {"fov": float("nan")},
        {"image_width": 0},
        {"image_height": "high"},
        {"position": np.array([np.inf, 0.0, 0.0])},
        {"position": np.zeros(2)},
        {"wxyz": np.zeros(4)},
    ],
)
def test_invalid_cameras_are_refused(wrong: dict[str, object]) -> None:
    assert Camera.of(SimpleNamespace(**(vars(CAMERA) | wrong))) is None


@pytest.mark.parametrize("name", ["falcon-7", "cogiro", "fast"])
def test_the_intersection_of_ray_and_platform_agrees_with_single_triangles(name: str) -> None:
    body = shapes.Solid.platform(sl.load_robot(name))
    size = float(np.abs(body.vertices).max())
    random = np.random.default_rng(4)
    hits = 0
    for _ in range(40):
        start = random.normal(size=3)
        start *= 4.0 * size / np.linalg.norm(start)
        direction = (
            body.vertices.mean(axis=0) + random.uniform(-0.6, 0.6, size=3) * np.ptp(body.vertices, axis=0) - start
        )
        far = body.ray_distance(start, direction)
        fars = []
        for a, b, c in body.vertices[body.faces]:
            matrix = np.column_stack((b - a, c - a, -direction))
            if abs(np.linalg.det(matrix)) > 1e-12 * size**3:
                u, v, s = np.linalg.solve(matrix, start - a)
                fars += [s] * bool(u >= 0.0 and v >= 0.0 and u + v <= 1.0 and s > 0.0)
        assert (far is None) == (fars == [])
        if far is not None:
            hits += 1
            assert far == pytest.approx(min(fars), rel=1e-9)
    assert hits > 5


def test_the_nearest_line_is_chosen_and_at_a_crossing_the_front_one() -> None:
    across = np.array([[-3.0, 0.0, 1.0], [3.0, 0.0, 1.0]])
    upright = np.array([[1.0, 2.0, -3.0], [1.0, 2.0, 3.0]])  # behind it
    lines = np.stack((across, upright))
    # z = 1 at 10 m is 60 px above the middle; x = 1 at 12 m is 50 px to the right
    assert eye().nearest_line((300.0 / 800.0, 245.0 / 600.0), lines, 8.0) == 0
    assert eye().nearest_line((452.0 / 800.0, 300.0 / 600.0), lines, 8.0) == 1
    assert eye().nearest_line((450.0 / 800.0, 240.0 / 600.0), lines, 8.0) == 0
    assert eye().nearest_line((300.0 / 800.0, 290.0 / 600.0), lines, 8.0) is None
    behind = lines - np.array([0.0, 20.0, 0.0])
    assert eye().nearest_line((300.0 / 800.0, 240.0 / 600.0), behind, 1e9) is None
