import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.spatial import ConvexHull

from sagline.core.arrays import Array
from sagline.workspaces.boundary import boundary
from tests.refusal import refused
from tests.workspaces.rays import generations, ray_hull, ray_hull_by_facets
from tests.workspaces.shapes import Counted, ball, both, brick, outside

LOW, HIGH = [-1.0, -1.0, -1.0], [1.0, 1.0, 1.0]


@pytest.mark.parametrize("divisions", [0, 1, 5])
def test_directions_are_those_of_a_divided_octahedron(divisions: int) -> None:
    steps, faces = generations(divisions)
    directions = np.concatenate([new for new, _ in steps])
    assert len(directions) == 4 * 4**divisions + 2
    assert len(faces) == 8 * 4**divisions
    assert_allclose(np.linalg.norm(directions, axis=1), 1.0, rtol=1e-15)
    hull = ConvexHull(directions)
    assert len(hull.vertices) == len(directions)
    center = directions[faces].mean(axis=1)
    normal = np.cross(
        directions[faces[:, 1]] - directions[faces[:, 0]], directions[faces[:, 2]] - directions[faces[:, 0]]
    )
    assert (np.einsum("fi,fi->f", center, normal) > 0.0).all()  # outward
    if divisions == 1:
        expected = np.sort(np.concatenate([hull.points[hull.vertices]]), axis=0)
        assert_allclose(expected, np.sort(directions, axis=0))


def test_hull_of_a_ball_is_the_polyhedron_with_its_vertices_on_it() -> None:
    counted = Counted(ball([0.1, 0.0, 0.0], 0.6))
    found = ray_hull(counted, [0.0, 0.05, -0.1], LOW, HIGH)
    assert_allclose(np.linalg.norm(found.vertices - [0.1, 0.0, 0.0], axis=1), 0.6, rtol=0.0, atol=1e-6)
    assert found.closed
    assert len(counted.positions) < 4.5 * 4098
    exact = 4.0 / 3.0 * np.pi * 0.6**3
    assert 0.997 * exact < found.volume < exact


def test_rays_end_at_the_box() -> None:
    found = ray_hull(lambda p: np.ones(len(p)), [0.2, 0.3, 0.1], LOW, HIGH, divisions=3)
    assert_allclose(np.abs(found.vertices).max(axis=1), 1.0, rtol=1e-14)


def test_a_wall_is_found_by_the_boundary_and_missed_by_rays() -> None:
    wall = both([brick([0.0, 0.0, 0.0], [0.8, 0.6, 0.7]), outside(brick([0.21, 0.0, 0.0], [0.05, 9.0, 9.0]))])
    hull = ray_hull(wall, [-0.3, 0.0, 0.0], LOW, HIGH, divisions=4)
    whole = 8.0 * 0.75 * 0.6 * 0.7
    found = boundary(wall, LOW, HIGH, cells=24)
    assert found.components.count == 2
    assert abs(found.volume - whole) < 0.005 * whole
    assert abs(hull.volume - whole) > 0.02 * whole


def test_facet_by_facet_finds_the_same_hull() -> None:
    rng = np.random.default_rng(4)
    normals = rng.normal(size=(40, 3))
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    away = rng.uniform(0.3, 0.8, 40)
    whole: list[int] = []

    def facets(positions: Array) -> tuple[Array, Array]:
        whole.append(len(positions))
        levels = away - positions @ normals.T
        return levels.min(axis=1), levels.argmin(axis=1)

    def facet_level(facet: Array, positions: Array) -> Array:
        k = facet.astype(np.int64)
        return np.asarray(away[k] - np.einsum("ni,ni->n", normals[k], positions))

    by_facets = ray_hull_by_facets(facets, facet_level, [0.0, 0.0, 0.0], LOW, HIGH)
    by_level = ray_hull(lambda p: facets(p)[0], [0.0, 0.0, 0.0], LOW, HIGH)
    assert_allclose(by_facets.vertices, by_level.vertices, rtol=0.0, atol=1e-6)
    assert_allclose(facets(by_facets.vertices)[0][np.abs(by_facets.vertices).max(axis=1) < 1.0], 0.0, atol=1e-7)
    del whole[:]
    ray_hull_by_facets(facets, facet_level, [0.0, 0.0, 0.0], LOW, HIGH)
    assert sum(whole) < 4.0 * 4098


def test_rays_from_outside_find_the_last_sign_change() -> None:
    # a hollow behind the first wall: rays from inside stop at either side, rays from outside at the last one
    shell = both([ball([0.0, 0.0, 0.0], 0.8), outside(ball([0.5, 0.0, 0.0], 0.1))])

    def facets(positions: Array) -> tuple[Array, Array]:
        return shell(positions), np.zeros(len(positions))

    found = ray_hull_by_facets(
        facets, lambda _, p: ball([0.0, 0.0, 0.0], 0.8)(p), [0.0, 0.0, 0.0], LOW, HIGH, divisions=3
    )
    assert_allclose(np.linalg.norm(found.vertices, axis=1), 0.8, rtol=0.0, atol=1e-7)


@pytest.mark.parametrize(
    ("center", "value"),
    [
        ([0.9, 0.9, 0.9], "where the level is -0.9588"),  # 0.6 m - 0.9 m sqrt(3)
        ([2.0, 0.0, 0.0], "outside the box"),
        ([0.0], "of shape (1,)"),
    ],
)
def test_a_center_that_is_not_inside_is_refused(center: list[float], value: str) -> None:
    with refused("center", value):
        ray_hull(ball([0.0, 0.0, 0.0], 0.6), center, LOW, HIGH)
