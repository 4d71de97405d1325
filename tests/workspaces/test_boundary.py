import numpy as np
import pytest
import trimesh
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

from sagline.workspaces.boundary import Boundary, boundary
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


def mesh_of(found: Boundary) -> trimesh.Trimesh:
    return trimesh.Trimesh(found.surface.vertices, found.surface.faces, process=False)


@pytest.mark.parametrize("refine", [False, True])
@pytest.mark.parametrize("name", SETS)
def test_volume_pieces_and_vertices_are_those_of_the_set(name: str, refine: bool) -> None:
    level, volumes = SETS[name]
    counted = Counted(level)
    found = boundary(counted, LOW, HIGH, cells=24 if refine else 40, refine=refine)
    assert found.components.count == len(volumes)
    assert abs(found.volume - sum(volumes)) <= min(found.volume_error + 1e-12, 0.005 * sum(volumes))
    assert_allclose(found.components.volume, volumes, rtol=0.02)  # of the net: flat triangles
    assert np.abs(level(found.surface.vertices)).max() < 1e-10
    assert found.evaluations == len(counted.positions)
    assert found.open_faces == ()
    mesh = mesh_of(found)
    assert mesh.is_watertight
    assert mesh.is_winding_consistent
    assert mesh.volume == pytest.approx(found.surface.volume, rel=1e-9)
    assert mesh.volume > 0.0


def test_no_position_is_asked_for_twice() -> None:
    counted = Counted(SETS["turned brick"][0])
    boundary(counted, LOW, HIGH, cells=16)
    assert len(np.unique(counted.positions, axis=0)) == len(counted.positions)
