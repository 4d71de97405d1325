from functools import partial

import numpy as np
import pytest

import sagline as sl
from sagline.workspaces.boundary import boundary
from tests.effort import least_seconds
from tests.tiers import extended
from tests.workspaces.levels import ipanema, level_of
from tests.workspaces.rays import ray_hull

TRUE = 9.774  # m^3, by rays extrapolated (9.7742) and by marching cubes extrapolated (9.7740)


@extended
def test_rays_find_the_hull_of_wirex_with_exact_feasibility() -> None:
    robot, low, high = ipanema()
    hull = ray_hull(level_of(robot, sl.Straight()), [0.0, 0.0, 1.0], low, high)
    assert len(hull.vertices) == 4098
    assert hull.volume == pytest.approx(9.7452, abs=5e-5)  # WireX itself, with closed form and 1e-3: 9.734
    exact = ray_hull(level_of(robot, sl.Catenary()), [0.0, 0.0, 1.0], low, high)
    assert exact.volume == pytest.approx(hull.volume, abs=1e-6)  # no gravity, no sag
    for model, limit in ((sl.Straight(), 0.13), (sl.Catenary(), 0.2)):
        level = level_of(robot, model)
        assert least_seconds(partial(ray_hull, level, [0.0, 0.0, 1.0], low, high), limit) <= limit


def test_true_volume_of_that_hull() -> None:
    robot, low, high = ipanema()
    level = level_of(robot, sl.Straight())
    found = boundary(level, low, high, cells=24)
    assert found.volume == pytest.approx(TRUE, abs=0.002)
    assert abs(found.volume - TRUE) <= found.volume_error
    assert found.components.count == 1
    assert found.open_faces == ()
    assert np.abs(level(found.surface.vertices)).max() < 1e-9
    assert found.surface.closed


@pytest.mark.soak
def test_that_volume_and_its_error_bar_take_two_seconds() -> None:
    robot, low, high = ipanema()
    level = level_of(robot, sl.Straight())
    assert boundary(level, low, high, cells=64).volume_error < 0.002
    assert least_seconds(partial(boundary, level, low, high, cells=64), 2.0) <= 2.0


@extended
def test_suspended_robot_of_the_article_with_and_without_sag() -> None:
    robot = sl.load_robot("article-suspended")
    low, high = [-7.5, -5.5, 0.0], [7.5, 5.5, 6.0]
    exact, straight = (boundary(level_of(robot, m), low, high, cells=16) for m in (sl.Catenary(), sl.Straight()))
    assert exact.volume == pytest.approx(789.4, abs=1.0)
    assert exact.volume / straight.volume == pytest.approx(
        1.008, abs=0.001
    )  # the weight of the cables increases the tensions
    for found in (exact, straight):
        assert found.open_faces == ("z low",)
        assert found.components.count == 1
        assert found.surface.closed


@extended
def test_verdicts_of_the_inverse_change_within_a_millimeter_of_the_boundary() -> None:
    robot = sl.load_robot("article-suspended")
    found = boundary(level_of(robot, sl.Catenary()), [-7.5, -5.5, 0.0], [7.5, 5.5, 6.0], cells=12).surface
    corners = found.vertices[found.faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    free = np.flatnonzero((corners[:, :, 2] > 0.0).all(axis=1))[::3]
    normals = normals[free] / np.linalg.norm(normals[free], axis=1)[:, None]
    at = corners[free, 0]
    assert len(at) > 400
    turned = np.broadcast_to(np.eye(3), (len(at), 3, 3))
    for distance, open_at_most in ((1e-3, 0.1), (2e-3, 0.02)):
        inside, outside = (sl.Pose(at + side * distance * normals, turned) for side in (-1.0, 1.0))
        assert not sl.inverse(robot, outside).feasible.any()
        feasible = sl.inverse(robot, inside).feasible
        bracket = sl.margin(robot, inside)
        assert (bracket.value > 0.0).all()
        assert (bracket.low[~feasible] < 0.0).all()  # sag decides within the bracket of a suspended robot
        assert np.mean(~feasible) < open_at_most
