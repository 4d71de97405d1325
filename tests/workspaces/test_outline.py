"""Outlines: vertices are on the boundary by independent margins, and positions inside are feasible."""

import numpy as np
import pytest

import sagline as sl
from sagline import LeastMargin, MinimumNorm, Orientations, Surface, WrenchSet
from sagline.core.arrays import Array, locked
from sagline.workspaces.boundary import Outline, outline
from sagline.workspaces.levels import Levels
from sagline.workspaces.region import Region, region_of
from sagline.workspaces.wrench_sets import NO_LOAD
from tests.tiers import extended, wide

ROBOTS = ("cogiro", "falcon-7", "fast")
SEEN = 5e-3  # of a cell of the grid: tolerance of a vertex


def made(robot: sl.Robot, cells: int, wrenches: WrenchSet = NO_LOAD) -> tuple[Outline, Region]:
    region = region_of(robot, None, cells)
    return outline_of(robot, wrenches, region), region


def outline_of(robot: sl.Robot, wrenches: WrenchSet, region: Region) -> Outline:
    turned, margin = Orientations(np.eye(3)), (LeastMargin(),)
    return outline(Levels(robot, wrenches, turned, margin, sl.Catenary(), MinimumNorm(), None, None), region)


def turns_around(surface: Surface, places: Array) -> Array:
    """Winding number of a surface around positions: van Oosterom & Strackee 1983."""
    found = np.empty(len(places))
    for k, place in enumerate(places):
        a, b, c = (surface.vertices[surface.faces[:, i]] - place for i in range(3))
        x, y, z = (np.linalg.norm(one, axis=1) for one in (a, b, c))
        dots = (np.einsum("fi,fi->f", *pair) for pair in ((a, b), (b, c), (c, a)))
        ab, bc, ca = dots
        volume = np.einsum("fi,fi->f", a, np.cross(b, c))
        found[k] = 2.0 * np.arctan2(volume, x * y * z + ab * z + bc * x + ca * y).sum() / (4.0 * np.pi)
    return found


@pytest.mark.parametrize("name", wide(ROBOTS))
def test_vertices_are_where_the_verdict_of_the_inverse_changes(name: str) -> None:
    robot = sl.load_robot(name)
    found, _ = made(robot, 20)
    wall = np.setdiff1d(found.surface.faces[~found.on_box], found.surface.faces[found.on_box])
    chosen = np.random.default_rng(16).choice(wall, 12, replace=False)
    step = found.grid.step.max()
    for k in chosen.tolist():
        place = found.surface.vertices[k]
        around = place + SEEN * step * np.vstack((np.eye(3), -np.eye(3)))
        held = sl.inverse(robot, sl.Pose(around, np.eye(3))).feasible
        assert held.any()  # the boundary is closer
        assert not held.all()
    assert found.cable.max() < robot.cable_count


@pytest.mark.parametrize(
    ("name", "count"),
    [("cogiro", 150), *(pytest.param(name, 600, marks=pytest.mark.soak) for name in sl.robot_names())],
)
def test_exactly_the_positions_inside_are_feasible(name: str, count: int) -> None:
    robot = sl.load_robot(name)
    found, region = made(robot, 30)
    places = np.random.default_rng(17).uniform(region.low, region.high, (count, 3))
    away = np.linalg.norm(places[:, None] - found.surface.vertices, axis=2).min(axis=1)
    clear = places[away > found.grid.step.max()]
    assert len(clear) > 0.5 * count
    turns = turns_around(found.surface, clear)
    np.testing.assert_allclose(turns, np.rint(turns), atol=1e-6)  # closed
    status = sl.margin(robot, sl.Pose(clear, np.stack([np.eye(3)] * len(clear)))).status
    sure = status != sl.MarginStatus.OPEN
    np.testing.assert_array_equal((turns > 0.5)[sure], (status == sl.MarginStatus.FEASIBLE)[sure])
    there = status != sl.MarginStatus.NO_CHORD  # positions elsewhere cannot be evaluated
    plan = sl.inverse(robot, sl.Pose(clear[there], np.stack([np.eye(3)] * np.count_nonzero(there))))
    assert np.mean(plan.feasible != (turns > 0.5)[there]) < 0.01  # positions that sag leaves open


@extended
def test_the_outline_agrees_with_the_workspace() -> None:
    robot, loads = sl.load_robot("article-suspended"), sl.WrenchBox(force=30.0)
    found, region = made(robot, 16, loads)
    space = sl.workspace(robot, wrenches=loads, cells=16, refine=False)
    assert found.volume == pytest.approx(space.volume, rel=0.03)  # without bulges beyond the box
    assert found.parts == space.components.count
    assert found.open_faces == space.open_faces
    shares = {limit.cable: limit.share for limit in space.limits}
    assert found.shares == pytest.approx(shares, abs=0.01)
    assert list(found.shares.values()) == sorted(found.shares.values(), reverse=True)
    smaller = region._replace(low=locked(region.low + 0.5))
    assert "z low" not in outline_of(robot, loads, smaller).open_faces  # a face of its own box has no limiting cable


def test_an_empty_outline_has_no_faces() -> None:
    found, _ = made(sl.load_robot("cogiro"), 6, sl.WrenchBox(force=1e6))
    assert found.surface.faces.shape == (0, 3)
    assert found.shares == {}
    assert (found.volume, found.parts, found.open_faces) == (0.0, 0, ())
