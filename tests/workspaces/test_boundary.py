import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

from sagline.core.arrays import Array
from sagline.workspaces.boundary import Boundary, boundary
from sagline.workspaces.surface import labels_of
from tests.refusal import refused
from tests.tiers import extended, wide
from tests.workspaces.shapes import Counted, Level, any_of, ball, both, brick, outside, torus

LOW, HIGH = [-1.0, -1.0, -1.0], [1.0, 1.0, 1.0]
BALL = 4.0 / 3.0 * np.pi

SETS: dict[str, tuple[Level, list[float]]] = {  # and the volumes of their pieces
    "ball": (ball([0.013, 0.02, 0.03], 0.7), [BALL * 0.7**3]),
    "ring": (torus(0.6, 0.25), [2.0 * np.pi**2 * 0.6 * 0.25**2]),
    "two balls": (any_of([ball([-0.45, 0.0, 0.1], 0.4), ball([0.5, 0.1, 0.0], 0.3)]), [BALL * 0.4**3, BALL * 0.3**3]),
    "cavity": (both([ball([0.0, 0.0, 0.0], 0.8), outside(ball([0.1, 0.0, 0.0], 0.4))]), [BALL * (0.8**3 - 0.4**3)]),
    "ball in a cavity": (
        any_of([both([ball([0.0, 0.0, 0.0], 0.9), outside(ball([0.0, 0.0, 0.0], 0.6))]), ball([0.0, 0.0, 0.0], 0.35)]),
        [BALL * (0.9**3 - 0.6**3), BALL * 0.35**3],
    ),
    "wall": (
        both([brick([0.0, 0.0, 0.0], [0.8, 0.6, 0.7]), outside(brick([0.21, 0.0, 0.0], [0.05, 9.0, 9.0]))]),
        [4.0 * 0.96 * 0.6 * 0.7, 4.0 * 0.54 * 0.6 * 0.7],
    ),
    "brick": (brick([0.013, 0.02, 0.03], [0.5, 0.6, 0.7]), [8.0 * 0.5 * 0.6 * 0.7]),
    "brick on the nodes": (brick([0.0, 0.0, 0.0], [0.5, 0.5, 0.75]), [8.0 * 0.5 * 0.5 * 0.75]),
    "turned brick": (
        brick([0.013, 0.02, 0.03], [0.5, 0.6, 0.3], Rotation.from_rotvec([0.3, 0.5, 0.7])),
        [8.0 * 0.5 * 0.6 * 0.3],
    ),
}


def is_watertight(found: Boundary) -> bool:
    """Each edge belongs to two triangles, which pass it in opposite directions."""
    edges = found.surface.faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)
    there = set(map(tuple, edges.tolist()))
    return len(there) == len(edges) and there == {(end, start) for start, end in there}


def corners_of(found: Boundary) -> tuple[Array, Array, Array]:
    """Of all triangles."""
    a, b, c = (found.surface.vertices[found.surface.faces[:, k]] for k in range(3))
    return a, b, c


@pytest.mark.parametrize("refine", [False, True])
@pytest.mark.parametrize("name", wide(SETS, first=2))
def test_volume_pieces_and_vertices_agree_with_the_set(name: str, refine: bool) -> None:
    level, volumes = SETS[name]
    counted = Counted(level)
    found = boundary(counted, LOW, HIGH, cells=24 if refine else 40, refine=refine)
    assert found.components.count == len(volumes)
    assert abs(found.volume - sum(volumes)) <= min(found.volume_error + 1e-12, 0.005 * sum(volumes))
    assert_allclose(found.components.volume, volumes, rtol=0.005)
    assert np.abs(level(found.surface.vertices)).max() < 1e-10
    assert found.evaluations == len(counted.positions)
    assert found.open_faces == ()
    assert is_watertight(found)
    a, b, c = corners_of(found)
    enclosed = np.einsum("fi,fi->f", a, np.cross(b, c)).sum() / 6.0
    assert enclosed == pytest.approx(found.surface.volume, rel=1e-9)
    assert enclosed > 0.0


def test_no_position_is_evaluated_twice() -> None:
    counted = Counted(SETS["turned brick"][0])
    boundary(counted, LOW, HIGH, cells=16)
    assert len(np.unique(counted.positions, axis=0)) == len(counted.positions)


@extended
def test_evaluations_grow_with_the_square_of_the_cells() -> None:
    level, _ = SETS["ball"]
    counts = [boundary(level, LOW, HIGH, cells=n).evaluations - (n + 1) ** 3 for n in (16, 32, 64)]
    assert counts[1] < 4.2 * counts[0]
    assert counts[2] < 4.2 * counts[1]
    asked = Counted(level)
    found = boundary(asked, LOW, HIGH, cells=32)
    vertices, faces = len(found.surface.vertices), len(found.surface.faces)
    nodes = sum(len(part) for part in asked.asked[1:2])
    assert nodes < 4.5 * vertices
    assert found.evaluations - 33**3 - nodes < 4.5 * vertices + 2.1 * faces


def test_cells_that_a_finer_neighbor_finds_crossed_are_evaluated_too() -> None:
    def rough(p: np.ndarray) -> np.ndarray:
        bumps = np.sin(17.0 * p[:, 0]) * np.sin(19.0 * p[:, 1] + 1.0) * np.sin(18.0 * p[:, 2])
        return np.asarray(0.6 - np.linalg.norm(p, axis=1) + 0.2 * bumps)

    for cells in (8, 10, 12, 14):
        counted = Counted(rough)
        found = boundary(counted, LOW, HIGH, cells=cells)
        assert len(counted.asked[2]) < len(counted.asked[1])  # the nodes of these cells, before the vertices
        assert np.abs(rough(found.surface.vertices)).max() < 1e-10
        assert is_watertight(found)


@pytest.mark.parametrize(
    "seed", wide([*range(6), *(pytest.param(seed, marks=pytest.mark.soak) for seed in range(6, 200))], first=2)
)
@pytest.mark.parametrize("kind", ["turned brick", "upright brick", "ball", "ring", "wedge", "infinite"])
def test_the_true_volume_is_within_the_error_bar(kind: str, seed: int) -> None:
    rng = np.random.default_rng([seed, 7])
    center, half, cells = rng.uniform(-0.1, 0.1, 3), rng.uniform(0.25, 0.5, 3), int(rng.integers(8, 20))
    turn = None if kind in ("upright brick", "infinite") else Rotation.random(rng=rng)
    volume = 8.0 * float(half.prod())
    level = brick(center, half, turn)
    if kind == "ball":
        level, volume = ball(center, half[0]), BALL * half[0] ** 3
    elif kind == "ring":
        level, volume = torus(0.6, half[0] / 2.0 + 0.1), 2.0 * np.pi**2 * 0.6 * (half[0] / 2.0 + 0.1) ** 2
    elif kind == "wedge":  # half of the brick, by a plane through opposite edges
        assert turn is not None
        normal = turn.apply([half[1], half[0], 0.0]) / np.hypot(half[0], half[1])
        level, volume = both([level, lambda p: (p - center) @ normal]), volume / 2.0
    elif kind == "infinite":
        solid = brick(center, half)
        level = lambda p: np.where(solid(p) >= 0.0, np.inf, -np.inf)  # noqa: E731
    found = boundary(level, LOW, HIGH, cells=cells, refine=bool(seed % 2))
    assert abs(found.volume - volume) <= found.volume_error
    assert found.volume_error < 0.5 * (2.0 / cells)  # and is small
    assert is_watertight(found)


def test_the_error_bar_includes_errors_common_to_all_grids() -> None:
    # the distance from the edges to the inner nodes is the same at every halving, so all grids have the same error
    third = 2.0 / 3.0 - 1e-9
    level = brick([0.0, 0.0, 0.0], [third, third, third])
    bars = [boundary(level, LOW, HIGH, cells=n, refine=False) for n in (8, 16)]
    for found in bars:
        assert abs(found.volume - 8.0 * third**3) <= found.volume_error


def test_volumes_of_curved_surfaces_have_fourth_order() -> None:
    level, volumes = SETS["ball"]
    off = [abs(boundary(level, LOW, HIGH, cells=n, refine=False).volume - volumes[0]) for n in (10, 20, 40)]
    assert off[0] < 1e-3 * volumes[0]
    assert off[2] < off[0] / 4.0**3


def test_vertices_are_at_sign_changes_and_jumps() -> None:
    def level(p: np.ndarray) -> np.ndarray:
        length = np.linalg.norm(p - [0.1, 0.0, 0.0], axis=1)
        outside = np.where(p[:, 2] > 0.3, -np.inf, -1e5)
        return np.where(length < 0.6, np.where(p[:, 0] > 0.0, np.inf, 1.0 - length), outside)

    found = boundary(level, LOW, HIGH, cells=16)
    vertices = found.surface.vertices
    length = np.linalg.norm(vertices - [0.1, 0.0, 0.0], axis=1)
    assert_allclose(length, 0.6, rtol=0.0, atol=1e-10)
    assert (level(vertices) >= 0.0).all()  # the last position known to be inside
    assert found.evaluations < 400_000
    assert abs(found.volume - BALL * 0.6**3) <= found.volume_error


def test_a_set_beyond_the_box_ends_exactly_at_its_faces() -> None:
    found = boundary(ball([0.0, 0.0, 1.0], 0.7), LOW, HIGH, cells=20)
    assert found.open_faces == ("z high",)
    assert abs(found.volume - BALL * 0.7**3 / 2.0) <= found.volume_error
    assert found.surface.vertices.max() == 1.0
    corner = boundary(ball([1.0, -1.0, 1.0], 0.7), LOW, HIGH, cells=20)
    assert corner.open_faces == ("x high", "y low", "z high")
    assert abs(corner.volume - BALL * 0.7**3 / 8.0) <= corner.volume_error
    for one in (found, corner):
        assert is_watertight(one)
    everything = boundary(lambda p: np.ones(len(p)), LOW, [1.0, 2.0, 3.0], cells=8)
    assert everything.volume == pytest.approx(24.0, rel=1e-14)
    assert everything.volume_error == 0.0
    assert len(everything.open_faces) == 6
    assert everything.surface.area == pytest.approx(52.0, rel=1e-14)


def test_an_empty_set_has_no_volume_and_no_pieces() -> None:
    found = boundary(lambda p: -1.0 - p[:, 0] ** 2, LOW, HIGH, cells=8)
    assert (found.volume, found.volume_error, found.components.count, found.open_faces) == (0.0, 0.0, 0, ())
    assert len(found.surface.faces) == 0
    assert found.surface.closed
    assert found.components.label([0.0, 0.0, 0.0]) == -1
    assert found.grid.values.max() == -1.0  # the grid still gives the nearest position


def test_cells_of_any_box_are_nearly_cubes() -> None:
    found = boundary(ball([2.0, 0.5, 1.0], 0.4), [0.0, 0.0, 0.0], [4.0, 1.0, 2.0], cells=32)
    assert found.grid.values.shape == (33, 9, 17)
    assert_allclose(found.grid.step, 0.125)
    assert abs(found.volume - BALL * 0.4**3) <= found.volume_error
    flat = boundary(lambda p: 0.4 - np.hypot(p[:, 0], p[:, 2]), LOW, HIGH, cells=(32, 1, 32))  # constant along y
    assert abs(flat.volume - 2.0 * np.pi * 0.4**2) <= flat.volume_error
    assert flat.open_faces == ("y low", "y high")


def test_zero_values_at_nodes_give_no_degenerate_triangles() -> None:
    found = boundary(SETS["brick on the nodes"][0], LOW, HIGH, cells=16)
    a, b, c = corners_of(found)
    assert 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1).min() > 1e-6
    sheet = boundary(lambda p: -np.abs(p[:, 0]), LOW, HIGH, cells=4, refine=False)  # inside on one plane of nodes
    assert sheet.volume == pytest.approx(0.0, abs=1e-12)
    assert sheet.surface.closed


def test_the_mesh_is_closed_for_random_signs() -> None:
    from scipy.ndimage import label

    rng = np.random.default_rng(3)
    for _ in range(60):
        shape = rng.integers(2, 7, 3)
        signs = np.where(rng.random(shape) < rng.choice([0.2, 0.5, 0.8]), 1.0, -1.0)

        def level(p: np.ndarray, signs: np.ndarray = signs, shape: np.ndarray = shape) -> np.ndarray:
            assert (np.abs(p) <= 1.0 + 1e-15).all()  # no position outside the box is evaluated
            at = np.rint((p + 1.0) / 2.0 * (shape - 1)).astype(int)
            return np.asarray(signs[tuple(at.T)])

        x, y, z = (int(n) - 1 for n in shape)
        found = boundary(level, LOW, HIGH, cells=(x, y, z), refine=False)
        assert found.surface.closed
        assert found.components.count == labels_of(level, found.grid)[1] <= label(signs > 0.0)[1]
        assert found.components.volume.sum() == pytest.approx(found.volume, abs=1e-12)
        pieces = found.components.vertices[found.surface.faces]
        assert (pieces == pieces[:, :1]).all()


def test_positions_are_assigned_to_pieces() -> None:
    found = boundary(SETS["two balls"][0], LOW, HIGH, cells=20)
    assert_allclose(found.components.label([[-0.45, 0.0, 0.1], [0.5, 0.1, 0.0], [0.79, 0.1, 0.0]]), [0, 1, 1])
    assert found.components.label([0.0, -0.9, 0.0]) == -1
    assert found.components.label([9.0, 0.0, 0.0]) == -1
    sides = found.components.vertices == (found.surface.vertices[:, 0] > 0.05)
    assert sides.all()


@pytest.mark.parametrize(
    ("change", "parts"),
    [
        ({"low": [1.0, -1.0, -1.0]}, ("box along x", "1 to 1 m")),
        ({"high": [1.0, np.nan, 1.0]}, ("high[1]", "nan m")),
        ({"cells": 1}, ("cells", "1", "2 to 128")),
        ({"cells": 1000}, ("cells", "1000")),
        ({"refine": 9}, ("refine", "9")),
        ({"cells": 100, "refine": 2}, ("refine", "2", "0 to 1")),
        ({"refine": "twice"}, ("refine", "'twice'")),
        ({"level": lambda p: np.full(len(p), np.nan)}, ("level at (-1, -1, -1) m", "nan")),
        ({"level": lambda p: np.zeros((len(p), 2))}, ("level", "of shape (729, 2)")),
    ],
)
def test_invalid_arguments_are_named(change: dict[str, object], parts: tuple[str, ...]) -> None:
    given: dict[str, object] = {"level": SETS["ball"][0], "low": LOW, "high": HIGH, "cells": 8, **change}
    with refused(*parts):
        boundary(**given)  # type: ignore[arg-type]


def test_of_two_pieces_in_one_cell_the_nearer_one_is_chosen() -> None:
    def level(p: np.ndarray) -> np.ndarray:  # at two opposite corners of the only cell
        return np.where(np.abs(p.sum(axis=1)) > 2.0, 1.0, -1.0)

    found = boundary(level, LOW, HIGH, cells=(1, 1, 1), refine=False)
    assert found.components.count == 2
    near_low, near_high = found.components.label([[-0.8, -0.7, -0.9], [0.8, 0.7, 0.9]])
    nodes = found.components.nodes
    assert (near_low, near_high) == (nodes[0, 0, 0], nodes[1, 1, 1])
