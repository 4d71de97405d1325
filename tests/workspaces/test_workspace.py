from itertools import pairwise

import numpy as np
import pytest
from numpy.testing import assert_allclose

import sagline as sl
from sagline.core.arrays import Array
from sagline.workspaces.criterion import Given, Judged
from sagline.workspaces.workspace import BY_BOX
from tests.refusal import refused
from tests.tiers import extended

SUSPENDED = sl.load_robot("article-suspended")
ROOM = sl.PoseBox([-6.0, -4.0, 0.5], [6.0, 4.0, 5.0])  # all within the workspace
WIDE = sl.PoseBox([-7.4, -5.4, 0.1], [7.4, 5.4, 5.9])


def square(**changes: object) -> sl.Robot:
    """Four cables to one point in a vertical plane, from the corners of a square of 2 m."""
    given = {
        "name": "square",
        "frame_anchors": [[0, 0.5, 0], [2, 0.5, 0], [2, 0.5, 2], [0, 0.5, 2]],
        "platform_anchors": np.zeros((4, 3)),
        "cables": sl.Cable(linear_density=0.01, axial_stiffness=1e5),
        "mass": 1.0,
        "gravity": 0.0,
        "motion_pattern": "2T",
        "plane_normal": [0, 1, 0],
        "tension_min": 1.0,
        "tension_max": 10.0,
    }
    return sl.Robot(**{**given, **changes})  # type: ignore[arg-type]


def normals_of(space: sl.Workspace) -> Array:
    """Normals of the surface at its vertices, outward, of length 1."""
    corners = space.surface.vertices[space.surface.faces]
    faces = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    found = np.zeros_like(space.surface.vertices)
    for k in range(3):
        np.add.at(found, space.surface.faces[:, k], faces)
    normals: Array = found / np.linalg.norm(found, axis=1, keepdims=True)
    return normals


@pytest.fixture(scope="module")
def suspended() -> sl.Workspace:
    return sl.workspace(SUSPENDED)


def test_the_articles_suspended_robot(suspended: sl.Workspace) -> None:
    assert suspended.volume == pytest.approx(789.4, abs=1.0)
    assert 0.0 < suspended.volume_error < 1.0
    assert suspended.unit == "m³"
    assert suspended.components.count == 1
    assert suspended.surface.closed
    assert suspended.open_faces == ("z low",)
    assert suspended.nearest is None


def test_every_vertex_is_on_the_boundary(suspended: sl.Workspace) -> None:
    free = suspended.limiting != BY_BOX
    weight = SUSPENDED.mass * SUSPENDED.gravity
    assert np.count_nonzero(free) > 8_000
    jumps = free & (np.abs(suspended.margin) > 1e-5 * weight)  # error bound of a margin on the exact curves
    assert np.count_nonzero(jumps) <= 4
    micrometer = 1e-6 * np.concatenate([np.eye(3), -np.eye(3)])  # the verdict changes within this distance of a jump
    beside = (suspended.surface.vertices[jumps][:, None] + micrometer).reshape(-1, 3)
    feasible = sl.inverse(SUSPENDED, sl.Pose(beside, np.eye(3))).feasible.reshape(-1, 6)
    assert (feasible.any(axis=1) & ~feasible.all(axis=1)).all()
    assert np.quantile(np.abs(suspended.margin[free]), 0.95) <= 1e-8 * weight
    found = sl.margin(SUSPENDED, sl.Pose(suspended.surface.vertices, np.eye(3)))
    assert np.array_equal(found.value, suspended.margin)
    assert np.array_equal(found.limiting_cable[free], suspended.limiting_cable[free])


@pytest.mark.parametrize(("aside", "agreeing"), [(1e-4, 0.99), (1e-3, 1.0)])
def test_verdicts_of_the_inverse_agree_a_millimeter_from_the_boundary(
    suspended: sl.Workspace, aside: float, agreeing: float
) -> None:
    faces = suspended.surface.faces
    by_box = np.unique(faces[(suspended.limiting[faces] == BY_BOX).any(axis=1)])
    free = np.setdiff1d(np.arange(len(suspended.surface.vertices)), by_box)
    some = np.random.default_rng(5).choice(free, 400, replace=False)
    normals = normals_of(suspended)[some]
    inside, outside = (sl.Pose(suspended.surface.vertices[some] + k * aside * normals, np.eye(3)) for k in (-1, 1))
    assert not sl.inverse(SUSPENDED, outside).feasible.any()
    found = sl.inverse(SUSPENDED, inside).feasible
    assert found[sl.margin(SUSPENDED, inside).low >= 0.0].all()
    assert found.mean() >= agreeing


def test_two_mirrors_of_the_robot_are_mirrors_of_its_workspace(suspended: sl.Workspace) -> None:
    # half a turn about z takes cable k to cable k + 4
    level = suspended.level
    finite = np.isfinite(level)
    assert np.array_equal(finite, finite[::-1, ::-1])
    assert_allclose(level[finite], level[::-1, ::-1][finite], rtol=0.0, atol=1e-9)
    shares = {(limit.criterion, limit.cable): limit.share for limit in suspended.limits}
    for cable in range(4):
        assert shares["margin", cable] == pytest.approx(shares["margin", cable + 4], abs=2e-3)
    assert sum(shares.values()) == pytest.approx(1.0, rel=1e-12)


@extended
def test_smaller_loads_give_larger_workspaces() -> None:
    sizes = (100.0, 50.0, 20.0, 0.0)
    spaces = [sl.workspace(SUSPENDED, None, sl.WrenchBox(size, 0.1 * size), cells=8) for size in sizes]
    for small, large in pairwise(spaces):
        assert small.volume < large.volume
        finite = np.isfinite(small.level)
        assert (small.level[finite] <= large.level[finite] + 1e-12).all()
        assert (large.levels()(small.surface.vertices) >= -1e-9).all()


@extended
def test_all_rotations_give_smaller_workspaces_and_any_of_them_larger() -> None:
    turns = sl.Pose.from_euler(np.zeros(3), np.radians([0.0, 25.0, -25.0]), 0.0, 0.0).matrix
    level = sl.workspace(SUSPENDED, WIDE, cells=6)
    every, some = (
        sl.workspace(SUSPENDED, WIDE, orientations=sl.Orientations(turns, need), cells=6) for need in ("all", "any")
    )
    each = [sl.margin(SUSPENDED, sl.Pose(_nodes(level), turn)).value.reshape(level.level.shape) for turn in turns]
    scale = SUSPENDED.mass * SUSPENDED.gravity
    assert_allclose(every.level * scale, np.min(each, axis=0), rtol=1e-12, atol=1e-9)
    assert_allclose(some.level * scale, np.max(each, axis=0), rtol=1e-12, atol=1e-9)
    assert every.volume < level.volume < some.volume
    tilted = sl.workspace(SUSPENDED, sl.PoseBox(ROOM.low, ROOM.high, tilt=0.2), cells=4)
    assert " 27 " in str(tilted)
    assert np.array_equal(tilted.level, sl.workspace(SUSPENDED, ROOM, orientations=sl.Tilts(0.2), cells=4).level)


def test_the_worst_or_the_best_orientation_is_used() -> None:
    turns = sl.Pose.from_euler(np.zeros(3), np.radians([0.0, 25.0, -25.0]), 0.0, 0.0).matrix
    places = np.random.default_rng(7).uniform(ROOM.low, ROOM.high, (50, 3))
    each = [sl.margin(SUSPENDED, sl.Pose(places, turn)).value for turn in turns]
    scale = SUSPENDED.mass * SUSPENDED.gravity
    every, some = (
        sl.workspace(SUSPENDED, ROOM, orientations=sl.Orientations(turns, need), cells=4, refine=False).levels()
        for need in ("all", "any")
    )
    assert_allclose(every(places) * scale, np.min(each, axis=0), rtol=1e-12, atol=1e-9)
    assert_allclose(some(places) * scale, np.max(each, axis=0), rtol=1e-12, atol=1e-9)


def _nodes(space: sl.Workspace) -> Array:
    return np.stack(np.meshgrid(*space.axes, indexing="ij"), axis=-1).reshape(-1, 3)


@extended
def test_workspaces_of_light_and_straight_cables_agree() -> None:
    straight = sl.workspace(SUSPENDED, WIDE, model=sl.Straight(), cells=8).surface.volume
    differences = []
    for density in (0.067, 0.067e-2, 0.067e-4):
        cable = sl.Cable(density, SUSPENDED.cables.axial_stiffness[0])
        differences.append(sl.workspace(SUSPENDED.replace(cables=cable), WIDE, cells=8).surface.volume - straight)
    assert differences[0] > 1.0  # sag increases it: the weight of the cables adds tension
    assert abs(differences[1]) < 0.02 * differences[0]
    assert abs(differences[2]) < 0.0002 * differences[0]


def test_a_wall_cuts_the_workspace_in_two() -> None:
    wall = sl.Box([0.2, 12.0, 1.0], [1.0, 0.0, 0.5], name="wall")
    box = sl.PoseBox([-3.0, -1.0, 0.3], [4.0, 1.0, 0.9])
    space = sl.workspace(SUSPENDED, box, criteria=[sl.Clearance(0.05, wall)], cells=8)
    assert space.components.count == 2
    places = np.random.default_rng(3).uniform(box.low, box.high, (400, 3))
    state = sl.inverse(SUSPENDED, sl.Pose(places, np.eye(3)), tension=sl.MinimumNorm()).state
    free = sl.clearance(state, wall).distance >= 0.05
    assert 50 < np.count_nonzero(free) < 350
    assert np.array_equal(space.levels()(places) >= 0.0, free)
    parts = space.components.label(places[free])
    sides = places[free][:, 0] > 1.0
    assert len(np.unique(np.stack((parts, sides))[:, parts >= 0], axis=1).T) == 2
    assert space.limits[0].criterion == "clearance"


def test_sag_is_the_largest_one_under_the_middle_load() -> None:
    corners = [[0, 0, -300, 0, 0, 0], [0, 0, -100, 0, 0, 0]]
    loads = sl.WrenchPolytope(corners) + sl.WrenchBox(20.0, 2.0, center=[50, 0, -200, 0, 0, 5])
    middle, limit = [50, 0, -400, 0, 0, 5], 0.3
    space = sl.workspace(SUSPENDED, ROOM, loads, criteria=[sl.MaximumSag(limit)], cells=4, refine=False)
    poses = sl.Pose(np.random.default_rng(6).uniform(ROOM.low, ROOM.high, (200, 3)), np.eye(3))
    margin = sl.margin(SUSPENDED, poses, loads).value / (SUSPENDED.mass * SUSPENDED.gravity)
    sag = sl.inverse(SUSPENDED, poses, tension=sl.MinimumNorm(), wrench=middle).state.cables.sag.max(axis=1)
    held = margin >= 0.0
    least = np.minimum(margin, 1.0 - sag / limit)
    assert np.count_nonzero(least[held] < margin[held]) > 50
    assert_allclose(space.levels()(poses.position)[held], least[held], rtol=1e-12, atol=1e-12)


def test_the_area_of_a_planar_robot() -> None:
    # weightless cables with at least 1 N in four directions: feasible everywhere inside the square
    space = sl.workspace(square(tension_min=1e-6), cells=32)
    assert space.unit == "m²"
    assert space.volume == pytest.approx(4.0, rel=2e-3)
    assert (space.box.low[1], space.box.high[1]) == (0.5, 0.5)
    assert not any("y" in face for face in space.open_faces)
    loaded = sl.workspace(square(), sl.PoseBox([0, 0.5, 0], [2, 0.5, 2]), sl.WrenchBox([4.0, 0.0, 4.0]), cells=32)
    loads = [[fx, 0.0, fz, 0.0, 0.0, 0.0] for fx in (-4.0, 4.0) for fz in (-4.0, 4.0)]
    places = [[x, 0.5, z] for x in loaded.x[4:-4:4] for z in loaded.z[4:-4:4]]
    held = [
        all(sl.inverse(square(), sl.Pose(place, np.eye(3)), sl.Straight(), wrench=load).feasible for load in loads)
        for place in places
    ]
    assert 10 < sum(held) < len(held)
    assert np.array_equal(loaded.levels()(np.array(places)) >= 0.0, held)


def test_a_flat_box_is_a_slice() -> None:
    flat = sl.workspace(SUSPENDED, sl.PoseBox([-6.0, -4.0, 2.0], [6.0, 4.0, 2.0]), cells=16)
    slab = sl.workspace(SUSPENDED, sl.PoseBox([-6.0, -4.0, 1.99], [6.0, 4.0, 2.01]), cells=16)
    assert flat.unit == "m²"
    assert flat.volume == pytest.approx(slab.volume / 0.02, rel=2e-3)


def test_an_empty_workspace_names_the_nearest_pose_and_its_cables() -> None:
    space = sl.workspace(SUSPENDED, ROOM, sl.WrenchBox(5000.0), cells=6)
    assert (space.volume, space.volume_error, space.components.count) == (0.0, 0.0, 0)
    near = space.nearest
    assert near is not None
    assert near.margin < 0.0
    assert near.cables
    assert near.margin == pytest.approx(float(sl.margin(SUSPENDED, near.pose, sl.WrenchBox(5000.0)).value))
    assert "moments" not in near.reason
    assert "empty" in str(space)
    assert near.reason.replace("\N{NO-BREAK SPACE}", " ") in " ".join(line.strip() for line in str(space).splitlines())


def test_infeasible_moments_are_reported() -> None:
    near = sl.workspace(SUSPENDED, ROOM, sl.WrenchBox(1.0, 1e5), cells=6).nearest
    assert near is not None
    assert "moments" in near.reason


def test_a_region_smaller_than_a_cell_is_found_by_the_search() -> None:
    middle, radius = np.array([0.3, 0.2, 2.1]), 0.05

    class Near(sl.Criterion):
        title, unit = "near", "m"

        def judge(self, given: Given) -> Judged:
            away = np.linalg.norm(given.pose.position - middle, axis=1)
            return Judged(radius - away)

        def scale(self, robot: sl.Robot) -> float:
            return 1.0

    near = sl.workspace(SUSPENDED, ROOM, criteria=[Near()], cells=6).nearest
    assert near is not None
    assert near.level >= 0.0
    assert np.linalg.norm(near.pose.position - middle) <= radius
    assert "cell" in near.reason


def test_faces_without_a_limiting_cable() -> None:
    # a point pulled to all sides without upper limits, on straight cables, bears any load inside the square
    robot = square(tension_max=np.inf)
    found = sl.margin(robot, sl.Pose([1.0, 0.5, 1.0], np.eye(3)), model=sl.Straight())
    assert np.isinf(found.value)
    box, loads = sl.PoseBox([0.5, 0.5, 0.5], [1.5, 0.5, 1.5]), sl.WrenchBox([1e6, 0, 1e6])
    space = sl.workspace(robot, box, loads, model=sl.Straight(), cells=4)
    assert space.volume == pytest.approx(1.0, rel=1e-12)
    assert space.open_faces == ("x low", "x high", "z low", "z high")
    assert (space.limiting == BY_BOX).all()
    assert space.limits == ()


CONTINUOUS = "MinimumNorm, QuadraticProgram, PNorm, Centroid, AnalyticCenter, ClosedForm"
BAD: dict[str, tuple[dict[str, object], dict[str, str]]] = {  # arguments, and parts of the error
    "tilt twice": (
        {"box": sl.PoseBox(ROOM.low, ROOM.high, 0.1), "orientations": sl.Tilts(0.1)},
        {"item": "orientations", "allowed": "one of the two"},
    ),
    "jumping tensions": (
        {"criteria": [sl.MaximumSag(0.05)], "tension": sl.LowestSum()},
        {"item": "tension", "allowed": CONTINUOUS},
    ),
    "a corner of the polygon": (
        {"criteria": [sl.LeastStiffness(1.0)], "tension": sl.PolygonWalk(optimum="1-norm")},
        {"item": "tension", "allowed": CONTINUOUS},
    ),
    "the pose before": (
        {"criteria": [sl.LeastFrequency(1.0)], "tension": sl.Closest()},
        {"item": "tension", "allowed": CONTINUOUS},
    ),
    "no criterion": ({"criteria": [3]}, {"item": "criteria[0]", "value": "3"}),
    "one criterion": ({"criteria": sl.MaximumSag(0.05)}, {"item": "criteria", "allowed": "a list of criteria"}),
    "no extent": ({"box": sl.PoseBox([0, 0, 1], [0, 0, 2])}, {"item": "box", "value": "without extent along x and y"}),
    "few cells": ({"cells": 3}, {"item": "cells", "value": "3", "allowed": "4 to 128"}),
    "a wrench": ({"wrenches": [0, 0, 1, 0, 0, 0]}, {"item": "wrenches", "allowed": "a WrenchSet, or None"}),
    "a rotation": (
        {"orientations": np.eye(3)},
        {"item": "orientations", "next_step": "Give Tilts(np.radians(10)), or Orientations(rotations)."},
    ),
}


@pytest.mark.parametrize("case", BAD)
def test_refusals(case: str) -> None:
    given, parts = BAD[case]
    with refused(**parts, kind=sl.InvalidValueError):
        sl.workspace(SUSPENDED, **given)  # type: ignore[arg-type]


def test_refusals_of_planar_robots() -> None:
    with refused("box", "0.5 m thick along plane_normal, y", "0 m for a planar robot", kind=sl.InvalidValueError):
        sl.workspace(square(), sl.PoseBox([0, 0, 0], [2, 0.5, 2]))
    with refused("orientations: tilt", "5.73 deg", kind=sl.InvalidValueError):
        sl.workspace(square(), orientations=sl.Tilts(0.1))
    with refused("plane_normal", "(0.7071, 0.7071, 0)", kind=sl.InvalidValueError):
        sl.workspace(square(plane_normal=[1, 1, 0], frame_anchors=[[0, 0, 0], [2, -2, 0], [2, -2, 2], [0, 0, 2]]))


def test_any_method_is_valid_without_a_criterion_on_tensions() -> None:
    usual = sl.workspace(SUSPENDED, ROOM, cells=4)
    assert sl.workspace(SUSPENDED, ROOM, tension=sl.LowestSum(), cells=4).volume == usual.volume


def test_progress_ends_with_the_total() -> None:
    told: list[tuple[int, int]] = []
    sl.workspace(SUSPENDED, ROOM, cells=8, progress=lambda done, of: told.append((done, of)))
    done, of = np.array(told).T
    assert (np.diff(done) > 0).all()
    assert (done <= of).all()


def test_the_field_agrees_with_single_poses() -> None:
    space = sl.workspace(SUSPENDED, ROOM, sl.WrenchBox(20.0, 2.0), cells=4)
    field = space.field
    assert dict(field.sizes) == {"x": 5, "y": len(space.y), "z": len(space.z)}
    place = {"x": space.x[3], "y": space.y[1], "z": space.z[1]}
    alone = sl.margin(SUSPENDED, sl.Pose(list(place.values()), np.eye(3)), sl.WrenchBox(20.0, 2.0))
    assert float(field.margin.sel(place)) == pytest.approx(float(alone.value), rel=1e-12)
    assert int(field.cable.sel(place)) == int(alone.limiting_cable)
    assert np.array_equal(field.level.values, space.level)
    assert field.margin.attrs["units"] == "N"


def test_the_text_fits_eighty_columns(suspended: sl.Workspace) -> None:
    text = str(suspended)
    assert max(map(len, text.splitlines())) <= 80
    assert "789." in text
    assert "m³" in text
    assert "z low" in text
