"""Parts of a workspace: connected by a walk, separated by a proof, or neither."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.ndimage import label
from scipy.spatial.transform import Rotation

import sagline as sl
from sagline.core.arrays import Array, Flags
from sagline.workspaces.boundary import boundary
from sagline.workspaces.grid import sample_grid
from sagline.workspaces.separation import exclusion, separated
from sagline.workspaces.surface import FINE, labels_of
from tests.tiers import wide
from tests.workspaces.shapes import any_of, ball, brick

LOW, HIGH = np.full(3, -1.0), np.full(3, 1.0)


def test_parts_connected_by_a_walk_are_one() -> None:
    space = sl.workspace(sl.load_robot("expo2015-lucia"), cells=24)
    assert label(space.components.nodes >= 0)[1] == 3  # nodes of the grid connected along its edges
    assert space.components.count == 1
    assert space.components.separate.all()
    assert space.components.volume[0] == pytest.approx(space.volume)
    assert "parts" not in str(space)


@pytest.mark.parametrize("seed", wide(range(12), first=3))
@pytest.mark.parametrize("kind", ["rod", "plate"])
def test_walks_lead_through_parts_thinner_than_a_cell(kind: str, seed: int) -> None:
    turn = Rotation.random(rng=np.random.default_rng(seed))
    thickness = 3e-3
    if kind == "rod":
        ends = [ball(turn.apply([end, 0.0, 0.0]), 0.2) for end in (-0.6, 0.6)]
        level = any_of([brick([0.0, 0.0, 0.0], [0.9, thickness, thickness], turn), *ends])
    else:
        level = brick([0.0, 0.0, 0.0], [0.8, 0.8, thickness], turn)
    grid = sample_grid(level, LOW, HIGH, (24, 24, 24))
    assert label(grid.inside)[1] > 1
    labels, count, walks = labels_of(level, grid)
    assert count == 1
    assert np.array_equal(labels > 0, grid.inside)
    for walk in walks:
        assert (level(walk) >= 0.0).all()
        assert np.linalg.norm(np.diff(walk, axis=0), axis=1).max() <= grid.step.max() / FINE
        assert np.abs(walk).max() <= 1.0


def test_gaps_are_not_connected() -> None:
    for gap, count in ((0.3, 2), (0.15, 2), (-0.02, 1)):
        level = any_of([ball([-0.4 - gap, 0.05, 0.0], 0.4), ball([0.4, -0.03, 0.07], 0.4)])
        grid = sample_grid(level, LOW, HIGH, (17, 17, 17))
        assert labels_of(level, grid)[1] == count


def test_a_closed_layer_of_excluded_boxes_separates() -> None:
    balls = any_of([ball([-0.5, 0.0, 0.0], 0.35), ball([0.5, 0.0, 0.0], 0.3), ball([0.5, 0.8, 0.0], 0.15)])
    components = boundary(balls, LOW, HIGH, cells=16).components

    def wall(centers: Array, half: Array) -> Flags:
        return np.asarray(np.abs(centers[:, 0]) + half[0] < 0.08)

    def door(centers: Array, half: Array) -> Flags:
        return np.asarray(wall(centers, half) & ~((np.abs(centers[:, 1:]) - half[1:] < 0.01).all(axis=1)))

    assert not components.separate.any()
    assert not separated(components, None).any()
    assert not separated(components, door).any()
    assert separated(components, wall).tolist() == [False, False, False]  # two are on one side
    two = boundary(any_of([ball([-0.5, 0.0, 0.0], 0.35), ball([0.5, 0.0, 0.0], 0.3)]), LOW, HIGH, cells=16).components
    assert separated(two, wall).tolist() == [True, True]
    assert separated(two, door).tolist() == [False, False]


def test_a_wall_separates_a_robots_workspace_and_a_low_wall_does_not() -> None:
    robot = sl.load_robot("article-suspended")
    box = sl.PoseBox([-3.0, -1.0, 0.3], [4.0, 1.0, 0.9])
    wall = sl.Box([0.2, 12.0, 1.0], [1.0, 0.0, 0.5], name="wall")
    space = sl.workspace(robot, box, criteria=[sl.Clearance(0.05, wall)], cells=8)
    assert space.components.separate.tolist() == [True, True]
    assert " in 2 parts\n" in str(space)
    assert "proved" in str(space)
    # without the wall around the platform only cables can collide, which proves nothing
    exclude = exclusion(space.levels())
    assert exclude is not None
    half = np.array([0.05, 0.05, 0.05])
    centers = np.stack(np.meshgrid(np.linspace(-3, 4, 141), 0.0, np.linspace(0.3, 2.0, 18)), axis=-1).reshape(-1, 3)
    found = exclude(centers, half)
    assert found.any()
    rng = np.random.default_rng(0)
    places = (centers[found, None] + rng.uniform(-half, half, (int(found.sum()), 20, 3))).reshape(-1, 3)
    assert (space.levels()(places) < 0.0).all()


def test_the_margin_separates_parts_of_a_workspace() -> None:
    robot = sl.load_robot("article-mixed")
    turned = sl.Orientations(Rotation.from_rotvec([0.1, 0.3, -0.2]).as_matrix())
    space = sl.workspace(robot, wrenches=sl.WrenchPolytope([[200, 80, 10, -10, -30, 0]]), orientations=turned, cells=12)
    assert space.components.count == 2
    assert space.components.separate.all()


def test_the_text_states_missing_walks_and_proofs() -> None:
    load = sl.WrenchPolytope([[1680, -1860, 7210, 70, -630, -1350]])
    space = sl.workspace(sl.load_robot("expo2015-lucia-pulleys"), wrenches=load, cells=12)
    assert space.components.count == 2
    assert not space.components.separate.any()
    assert "this grid" in str(space)
    assert "proved" not in str(space)
