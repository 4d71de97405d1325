"""Margins compared with all facets, linear programs, single loads, and verdicts of the inverse."""

from __future__ import annotations

import pickle
from itertools import product

import numpy as np
import pytest
from scipy.optimize import linprog

import sagline as sl
from sagline import InvalidValueError
from sagline.core.arrays import Array
from sagline.kernels import tables
from sagline.workspaces.margin import MarginRows
from tests.refusal import refused
from tests.tiers import wide
from tests.workspaces.all_facets import PATTERNS, Support, all_facets, crafted, mean_arm, no_load, pulls_on_a_grid

LEVEL = np.eye(3)
SUSPENDED = sl.load_robot("article-suspended")
IPANEMA = sl.load_robot("ipanema-1")
Status = sl.MarginStatus
WIDER = 2.0  # the bounds of differences from secants may be wider than the exact ones, relative to these


def poses_of(robot: sl.Robot, count: int, rng: np.random.Generator) -> sl.Pose:
    """Poses in and around the middle of the frame, slightly tilted if the platform can rotate."""
    low, high = robot.frame_anchors.min(axis=0), robot.frame_anchors.max(axis=0)
    if robot.test_box is not None:
        low, high = robot.test_box.low, robot.test_box.high
    middle, half = 0.5 * (low + high), 0.5 * (high - low)
    position = middle + rng.uniform(-0.9, 0.9, (count, 3)) * half * rng.uniform(0.1, 1.0, (count, 1))
    angles = rng.uniform(-0.2, 0.2, (3, count)) * (robot.motion_pattern == "3R3T")
    return sl.Pose.from_euler(position, *angles)


def cables_of(robot: sl.Robot) -> Array:
    """A robot without pulleys as a table, shape (m, CABLE_COLUMNS)."""
    materials = (robot.cables.linear_density, robot.cables.axial_stiffness, robot.tension_min, robot.tension_max)
    pulleys = np.zeros((robot.cable_count, tables.CABLE_COLUMNS - tables.PULLEY_RADIUS))
    return np.column_stack((robot.frame_anchors, robot.platform_anchors, *materials, pulleys))


def rows_of(poses: sl.Pose) -> Array:
    return np.hstack((poses.position, poses.quaternion))


@pytest.mark.parametrize("pattern", PATTERNS)
@pytest.mark.parametrize("model", wide([sl.Catenary(), sl.Straight(), sl.Parabolic()]))
def test_the_margin_is_the_least_of_all_facets(pattern: str, model: sl.CableModel) -> None:
    rng = np.random.default_rng(3)
    settled = 0
    for extra in (0, 1, 2, 4):
        robot = crafted(rng, pattern, extra)
        poses = sl.Pose(rng.uniform(-1, 1, (3, 3)) * (1, pattern in ("3T", "3R3T"), 1), LEVEL)
        for arm in (0.0, 0.3):
            found = sl.margin(robot, poses, model=model, moment_arm=arm)
            for k, pose in enumerate(poses):
                pulls = pulls_on_a_grid(robot, pose, model)
                known = all_facets(robot, pose, pulls, no_load, arm)
                size = robot.tension_max.max()
                wide = WIDER * (known.high - known.low) + (pulls.most - pulls.least).sum() + 1e-9 * size
                if known.low - wide <= 0.0 <= known.high + wide:  # the exact curves decide
                    settled += 1
                    continue
                assert found.value[k] == pytest.approx(known.value, abs=1e-11 * size + 1e-9 * abs(known.value))
                assert known.low - wide <= found.low[k] <= known.low + 1e-6 * size
                assert known.high - 1e-6 * size <= found.high[k] <= known.high + wide
    assert settled < 12


@pytest.mark.parametrize("cables", [9, 10, 12, 16])
def test_margins_of_many_cables_are_the_least_of_all_facets(cables: int) -> None:
    rng = np.random.default_rng(cables)
    half = np.array([60.0] * 3 + [6.0] * 3)
    corners = rng.normal(size=(3, 6)) * half
    loads: list[tuple[sl.WrenchSet, Support]] = [
        (sl.WrenchBox(60.0, 6.0), lambda y: np.abs(y) @ half),
        (sl.WrenchPolytope(corners), lambda y: -(y @ corners.T).min(axis=1)),
        (sl.WrenchEllipsoid(60.0, 6.0), lambda y: np.sqrt((y * y) @ (half * half))),
    ]
    feasible = decided = 0
    for density in (0.01, 0.2):
        robot = sl.Robot(
            "suspended",
            rng.uniform((-6.0, -4.0, 0.0), (6.0, 4.0, 6.0), (cables, 3)),
            rng.uniform(-0.5, 0.5, (cables, 3)),
            sl.Cable(density, 1e5),
            100.0,
            np.eye(3) * 10.0,
            tension_min=20.0,
            tension_max=1500.0,
        )
        for pose in poses_of(robot, 3, rng):
            pulls = pulls_on_a_grid(robot, pose, sl.Catenary())
            for (load, support), arm in zip(loads, (mean_arm(robot), 0.2, 2.0), strict=True):
                known = all_facets(robot, pose, pulls, support, arm)
                found = sl.margin(robot, pose, load, moment_arm=arm)
                wide = WIDER * (known.high - known.low) + (pulls.most - pulls.least).sum()
                if abs(known.value) > wide:  # the exact curves do not decide
                    feasible, decided = feasible + (known.value > 0.0), decided + 1
                    assert float(found.value) == pytest.approx(known.value, rel=1e-8)
                    assert float(found.low) <= known.low + 1e-6 * abs(known.low)
    assert feasible < decided > 9
    assert feasible > 0 or cables == 9  # its feasible poses are near the boundary


@pytest.mark.parametrize("model", [sl.Straight(), sl.Parabolic()])
def test_without_a_lever_arm_the_margin_is_the_capacity_margin(model: sl.CableModel) -> None:
    for robot in (SUSPENDED, IPANEMA, sl.load_robot("falcon-7")):
        poses = poses_of(robot, 400, np.random.default_rng(5))
        known = sl.capacity_margin(sl.inverse(robot, poses, model=model).state)
        found = sl.margin(robot, poses, model=model, moment_arm=0.0)
        inside = np.isfinite(known)
        assert inside.sum() > 50
        np.testing.assert_allclose(found.value[inside], known[inside], rtol=0.0, atol=1e-10)
        assert (found.value[~inside] < 0.0).all()
        np.testing.assert_array_equal(found.low, found.high)


def test_linear_programs_agree_along_the_normal_and_are_larger_elsewhere() -> None:
    rng = np.random.default_rng(6)
    poses = poses_of(IPANEMA, 12, rng)
    arm = mean_arm(IPANEMA)
    box = sl.WrenchBox(force=2.0, moment=0.5)
    corners = np.array(list(product((-1, 1), repeat=6))) * ([2.0] * 3 + [0.5] * 3)
    found = sl.margin(IPANEMA, poses, box, model=sl.Straight())
    matrix = sl.structure_matrix(IPANEMA, poses)
    assert (found.value > 0.0).sum() > 4
    for k in range(len(poses)):
        against = -found.direction[k] * ([1.0] * 3 + [arm * arm] * 3)
        worst = corners[np.argmin(corners @ found.direction[k])]
        others = rng.normal(size=(3, 6)) * ([1.0] * 3 + [arm] * 3)
        others /= np.sqrt((others[:, :3] ** 2).sum(axis=1) + (others[:, 3:] ** 2).sum(axis=1) / arm**2)[:, None]
        reached = [_reach(matrix[k], worst, way) for way in (against, *others)]
        if found.value[k] >= 0.0:
            assert reached[0] == pytest.approx(found.value[k], abs=1e-7)
            assert min(reached) >= found.value[k] - 1e-7
        else:
            assert np.isnan(_reach(matrix[k], worst, against * 0.0))


def _reach(matrix: Array, wrench: Array, way: Array) -> float:
    """Largest multiple of a wrench that the cables supply, by a linear program; NaN if its start is infeasible."""
    needed = np.array([0.0, 0.0, IPANEMA.mass * IPANEMA.gravity, 0.0, 0.0, 0.0]) - wrench
    limits = [*zip(IPANEMA.tension_min, IPANEMA.tension_max, strict=True), (0.0, None if way.any() else 0.0)]
    cost = np.append(np.zeros(matrix.shape[1]), -1.0)
    solved = linprog(cost, A_eq=np.column_stack([matrix, way]), b_eq=needed, bounds=limits, method="highs")
    return float(solved.x[-1]) if solved.success else float("nan")


def test_the_margin_of_a_box_is_that_of_its_corners() -> None:
    poses = poses_of(SUSPENDED, 300, np.random.default_rng(7))
    corners = np.array(list(product((-1, 1), repeat=6))) * ([100.0] * 3 + [20.0] * 3)
    box = sl.margin(SUSPENDED, poses, sl.WrenchBox(force=100.0, moment=20.0))
    together = sl.margin(SUSPENDED, poses, sl.WrenchPolytope(corners))
    apart = [sl.margin(SUSPENDED, poses, sl.WrenchPolytope([corner])) for corner in corners]
    for name in ("value", "low", "high"):
        values = np.stack([getattr(one, name) for one in apart])
        np.testing.assert_allclose(getattr(box, name), values.min(axis=0), rtol=0.0, atol=1e-12)
        np.testing.assert_allclose(getattr(box, name), getattr(together, name), rtol=0.0, atol=1e-12)


def test_the_margin_of_a_sum_of_sets_is_that_of_all_sums() -> None:
    rng = np.random.default_rng(8)
    poses = poses_of(SUSPENDED, 20, rng)
    first, second = rng.normal(size=(5, 6)), rng.normal(size=(4, 6)) * 3.0
    center, matrix = rng.normal(size=6), rng.normal(size=(6, 6))
    sums = (first[:, None] + second).reshape(-1, 6) + center
    found = sl.margin(
        SUSPENDED, poses, sl.WrenchPolytope(first) + sl.WrenchPolytope(second) + sl.WrenchBox(0, 0, center)
    )
    np.testing.assert_allclose(found.value, sl.margin(SUSPENDED, poses, sl.WrenchPolytope(sums)).value, atol=1e-11)
    # the support of an ellipsoid is at its extreme point against the normal
    round_ = sl.margin(SUSPENDED, poses, sl.WrenchEllipsoid(matrix=matrix, center=center))
    for k, pose in enumerate(poses):
        ahead = matrix.T @ round_.direction[k]
        point = center - matrix @ ahead / np.linalg.norm(ahead)
        alone = sl.margin(SUSPENDED, pose, sl.WrenchPolytope([point]))
        assert float(alone.value) == pytest.approx(round_.value[k], abs=1e-10)


def test_accelerations_are_loads_of_mass_and_rotated_inertia() -> None:
    rng = np.random.default_rng(9)
    turned = np.array([[2.0, 0.3, 0.1], [0.3, 3.0, -0.2], [0.1, -0.2, 2.5]])
    robots = [SUSPENDED.replace(mass=mass, inertia=turned * mass / 100.0) for mass in (80.0, 160.0, 240.0)]
    poses = sl.Pose.from_euler(rng.uniform([-1, -1, 2], [1, 1, 4], (3, 3)), *rng.uniform(-0.5, 0.5, (3, 3)))
    found = sl.margin(robots, poses, sl.Accelerations(linear=1.5, angular=4.0))
    for k, (robot, pose) in enumerate(zip(robots, poses, strict=True)):
        inertia = pose.matrix @ robot.inertia @ pose.matrix.T
        rates = np.array(list(product((-1, 1), repeat=6))) * ([1.5] * 3 + [4.0] * 3)
        loads = -np.hstack([robot.mass * rates[:, :3], rates[:, 3:] @ inertia])
        known = sl.margin(robot, pose, sl.WrenchPolytope(loads))
        assert found.value[k] == pytest.approx(float(known.value), abs=1e-10)
        assert found.low[k] == pytest.approx(float(known.low), abs=1e-10)


def test_less_load_leaves_more_margin() -> None:
    rng = np.random.default_rng(10)
    poses = poses_of(SUSPENDED, 200, rng)
    sizes = np.sort(rng.uniform(0.0, 200.0, 6))
    for make in (
        lambda f: sl.WrenchBox(f, 0.1 * f),
        lambda f: sl.WrenchEllipsoid(f),
        lambda f: sl.Accelerations(f / 50),
    ):
        margins = np.stack([sl.margin(SUSPENDED, poses, make(size)).value for size in sizes])
        assert (np.diff(margins, axis=0) < 0.0).all()


@pytest.mark.parametrize("model", [sl.Parabolic(), sl.Catenary()])
def test_a_force_of_the_margin_is_at_the_boundary(model: sl.CableModel) -> None:
    poses = poses_of(SUSPENDED, 50, np.random.default_rng(11))
    found = sl.margin(SUSPENDED, poses, moment_arm=0.7, model=model)
    for k, pose in enumerate(poses):
        way = -found.direction[k] * ([1.0] * 3 + [0.49] * 3)
        moved = sl.margin(SUSPENDED, pose, sl.WrenchPolytope([found.value[k] * way]), moment_arm=0.7, model=model)
        assert abs(float(moved.value)) <= 1e-9 + float(found.high[k] - found.low[k])
        assert moved.low <= 1e-9
        assert moved.high >= -1e-9


def test_a_mirrored_robot_at_the_mirrored_pose_has_the_same_margin() -> None:
    mirror = np.array([-1.0, 1.0, 1.0])
    rng = np.random.default_rng(12)
    robot = crafted(rng, "3R3T", 2)
    other = robot.replace(frame_anchors=robot.frame_anchors * mirror, platform_anchors=robot.platform_anchors * mirror)
    angles = rng.uniform(-0.3, 0.3, (3, 40))
    position = rng.uniform(-1, 1, (40, 3))
    here = sl.margin(robot, sl.Pose.from_euler(position, *angles))
    there = sl.margin(other, sl.Pose.from_euler(position * mirror, -angles[0], -angles[1], angles[2]))
    for name in ("value", "low", "high"):
        np.testing.assert_allclose(getattr(here, name), getattr(there, name), rtol=1e-9)


def test_the_margin_converges_to_that_of_straight_cables() -> None:
    poses = poses_of(SUSPENDED, 60, np.random.default_rng(13))
    straight = sl.margin(SUSPENDED, poses, model=sl.Straight()).value
    off = []
    for share in (1e-1, 1e-2, 1e-3):
        light = SUSPENDED.replace(
            cables=SUSPENDED.cables.replace(linear_density=SUSPENDED.cables.linear_density * share)
        )
        found = sl.margin(light, poses)
        off.append(max(np.abs(end - straight).max() for end in (found.value, found.low, found.high)))
    assert off[0] == pytest.approx(10 * off[1], rel=0.1)
    assert off[1] == pytest.approx(10 * off[2], rel=0.1)


def test_infeasibility_by_a_moment_alone_is_stated() -> None:
    # in the middle, the cables of a symmetric robot resist moments about z, but not 50 N m
    middle = sl.Pose(0.5 * (IPANEMA.frame_anchors.min(axis=0) + IPANEMA.frame_anchors.max(axis=0)), LEVEL)
    twist = sl.WrenchPolytope([[0, 0, 0, 0, 0, 5000.0]])
    found = sl.margin(IPANEMA, middle, twist, model=sl.Straight())
    assert found.status == Status.INFEASIBLE
    assert -5000.0 / mean_arm(IPANEMA) < float(found.value) < 0.0


def test_a_normal_of_moments_has_no_force_margin() -> None:
    # two cables at the center of mass of a beam, and one down from each end of it, 1 m away: 100 N m in both directions
    robot = sl.Robot(
        "beam",
        [[-4, 0, 3], [4, 0, 3], [1, 0, -5], [-1, 0, -5]],
        [[0, 0, 0], [0, 0, 0], [1, 0, 0], [-1, 0, 0]],
        sl.Cable(0.1, 1e6),
        1.0,
        np.eye(3),
        gravity=0.0,
        motion_pattern="1R2T",
        plane_normal=[0, 1, 0],
        tension_max=100.0,
    )
    pose, load = sl.Pose([0, 0, 0], LEVEL), sl.WrenchPolytope([[0, 0, 0, 0, 1e4, 0]])
    found = sl.margin(robot, pose, load)
    assert float(found.value) == pytest.approx(-(1e4 - 100.0) / 0.5, rel=1e-12)  # the mean lever arm
    forces = sl.margin(robot, pose, load, moment_arm=0.0)
    assert (int(forces.status), float(forces.value)) == (Status.INFEASIBLE, -np.inf)
    np.testing.assert_array_equal(forces.direction[:3], 0.0)
    assert np.linalg.norm(forces.direction[3:]) == pytest.approx(1.0)


def test_poses_that_no_motion_connects_are_refused() -> None:
    robot = crafted(np.random.default_rng(3), "1R2T")
    with refused("pose[1]", allowed="0 m, by motion_pattern 1R2T", kind=InvalidValueError):
        sl.margin(robot, sl.Pose([[0, 0, 0], [0, 1, 0]], np.eye(3)))


def test_cables_without_upper_limits() -> None:
    hanging = SUSPENDED.replace(tension_max=np.inf)
    poses = poses_of(SUSPENDED, 300, np.random.default_rng(14))
    found = sl.margin(hanging, poses)
    limited = sl.margin(SUSPENDED.replace(tension_max=1e9), poses, model=sl.Straight())
    straight = sl.margin(hanging, poses, model=sl.Straight())
    np.testing.assert_allclose(straight.value, limited.value, rtol=1e-6)
    assert (found.low <= found.value).all()
    assert (found.value <= found.high).all()
    # cables on all sides of a point: all loads are feasible
    star = crafted(np.random.default_rng(1), "2T", 1).replace(
        frame_anchors=[[-3, 0, -2], [3, 0, -2], [0, 0, 4]], tension_max=np.inf, tension_min=0.0
    )
    free = sl.margin(star, sl.Pose([0, 0, 0], LEVEL), sl.WrenchBox(force=1e6), model=sl.Straight())
    assert np.isposinf(free.value)
    assert free.status == Status.FEASIBLE
    assert free.limiting_cable == -1


def test_singular_poses_and_coincident_ends_are_outside_with_a_reason() -> None:
    crossed = IPANEMA.replace(platform_anchors=np.zeros((8, 3)))
    found = sl.margin(crossed, sl.Pose([0.1, 0.2, 0.3], LEVEL))
    assert (int(found.status), float(found.value), int(found.limiting_cable)) == (Status.SINGULAR, -np.inf, -1)
    at_anchor = sl.Pose(IPANEMA.frame_anchors[0] - IPANEMA.platform_anchors[0], LEVEL)
    found = sl.margin(IPANEMA, at_anchor)
    assert (int(found.status), float(found.low), float(found.high)) == (Status.NO_CHORD, -np.inf, -np.inf)
    rows = np.full((2, 7), np.nan)
    assert (MarginRows(IPANEMA).rows(rows).status == Status.NO_CHORD).all()
    slack = SUSPENDED.replace(tension_min=0.0, tension_max=1e-3)
    assert sl.margin(slack, sl.Pose([0, 0, 2], LEVEL)).status in (Status.TOO_SLACK, Status.INFEASIBLE)


def test_frame_end_limits_are_converted_to_chord_limits() -> None:
    ends = SUSPENDED.replace(tension_limits_of="frame_end")
    poses = poses_of(SUSPENDED, 40, np.random.default_rng(15))
    found = sl.margin(ends, poses)
    run = poses.transform(ends.platform_anchors) - ends.frame_anchors
    span, rise = np.hypot(run[..., 0], run[..., 1]), run[..., 2]
    for k, pose in enumerate(poses):
        limits = []
        for limit in (ends.tension_min, ends.tension_max):
            tension = limit.copy()
            for _ in range(60):
                hung = sl.Catenary().from_tension(ends.cables, span[k], rise[k], tension, ends.gravity)
                tension = tension + (limit - hung.frame_end_tension)
            limits.append(tension)
        known = sl.margin(SUSPENDED.replace(tension_min=limits[0], tension_max=limits[1]), pose)
        assert found.value[k] == pytest.approx(float(known.value), abs=1e-8)
        assert found.low[k] == pytest.approx(float(known.low), abs=1e-6)


def test_many_robots_as_tables_agree_with_objects() -> None:
    rng = np.random.default_rng(16)
    poses = poses_of(SUSPENDED, 5, rng)
    table = np.repeat(cables_of(SUSPENDED)[None], 3, axis=0)
    table[:, :, :3] += rng.normal(size=(3, 8, 3)) * 0.2
    table[:, :, tables.PLATFORM_X] *= [[1.0], [1.2], [0.8]]
    rows = MarginRows(SUSPENDED, sl.WrenchBox(20.0), cables=table).rows(np.tile(rows_of(poses), (3, 1)))
    for k in range(3):
        robot = SUSPENDED.replace(frame_anchors=table[k, :, :3], platform_anchors=table[k, :, 3:6])
        known = sl.margin(robot, poses, sl.WrenchBox(20.0))
        for name in ("value", "low", "high", "status", "direction"):
            np.testing.assert_array_equal(getattr(rows, name)[5 * k : 5 * k + 5], getattr(known, name))
        np.testing.assert_array_equal(rows.cable[5 * k : 5 * k + 5], known.limiting_cable)
    with refused("poses", "4 of them", "a multiple of 3", kind=InvalidValueError):
        MarginRows(SUSPENDED, cables=table).rows(rows_of(poses)[:4])
    with refused("cables", allowed=f"shape (R, 8, {tables.CABLE_COLUMNS})", kind=InvalidValueError):
        MarginRows(SUSPENDED, cables=table[:, :7])


def test_a_result_has_the_shape_of_the_poses_and_is_read_only() -> None:
    pose = sl.Pose([0, 0, 2], LEVEL)
    one, more = sl.margin(SUSPENDED, pose), sl.margin(SUSPENDED, sl.Pose([[0, 0, 2], [1, 0, 2]], LEVEL))
    assert (one.value.shape, one.direction.shape, more.value.shape) == ((), (6,), (2,))
    assert more.value[0] == one.value
    again = pickle.loads(pickle.dumps(more))
    np.testing.assert_array_equal(again.value, more.value)
    assert not again.value.flags.writeable
    assert bool(one.feasible)


def test_too_few_cables_and_other_kinds_are_refused() -> None:
    pose = sl.Pose([0, 0, 2], LEVEL)
    five = SUSPENDED
    for _ in range(3):
        five = sl.without_cables(five, 0)
    with refused("article-suspended: number of cables", "5", ">= 6 for 3R3T", kind=InvalidValueError):
        sl.margin(five, pose)
    with refused("wrenches", "[1.0, 2.0, 3.0]", "a WrenchSet, or None", kind=InvalidValueError):
        sl.margin(SUSPENDED, pose, [1.0, 2.0, 3.0])  # type: ignore[arg-type]
    with refused("moment_arm", "-1 m", ">= 0 m, finite", kind=InvalidValueError):
        sl.margin(SUSPENDED, pose, moment_arm=-1.0)
    with refused("robot", "a sequence of 2 robots", "one robot", kind=InvalidValueError):
        sl.margin([SUSPENDED] * 2, pose)
