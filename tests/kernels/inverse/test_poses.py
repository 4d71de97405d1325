"""Inverse of poses through its entry: balance, limits, all methods, and no state between poses."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import pytest

from sagline.core.arrays import Array, Codes, locked
from sagline.kernels import codes, tables
from sagline.kernels.cable import models, states
from sagline.kernels.cable.terms import Chord, Material, Model, Pulley
from sagline.kernels.codes import (
    CATENARY,
    CHORD_TENSION,
    CLOSEST,
    ELASTIC,
    FRAME_END_TENSION,
    HORIZONTAL_TENSION,
    LIMITS_OF_CHORD,
    MINIMUM_NORM,
    POSE_INFEASIBLE,
    POSE_NO_CHORD,
    POSE_SINGULAR,
    POSE_SOLVED,
)
from sagline.kernels.inverse.feasibility import decide_poses, margins_of_poses, polygon_of_pose
from sagline.kernels.inverse.poses import inverse_poses
from sagline.kernels.memory import memory_for
from sagline.kernels.tension.polygon import SPARE_CORNERS
from tests.kernels.balance.robots import A_POINT, EVERY_MOTION, GRAVITY, IN_A_PLANE, TO_AND_FRO, Case, random_case
from tests.kernels.compiled import from_python

frame_end_tension = from_python(states.frame_end_tension)
from_tension = from_python(models.from_tension)

OTHERWISE = range(codes.LOWEST_SUM, codes.POLYGON_WALK + 1)


def fixed(array: Array) -> Array:
    """Read-only, like inputs from Python: kernels are compiled once for these."""
    return locked(array.copy())


class Answer(NamedTuple):
    results: Array
    statuses: Codes
    residuals: Array
    needed: Array
    poses: Codes


def new_answers(count: int, m: int, n: int) -> Answer:
    return Answer(
        np.full((tables.RESULT_ROWS, count, m), -7.0),
        np.full((count, m), -7, dtype=np.int8),
        np.full((count, 2), -7.0),
        np.full((count, n), -7.0),
        np.full(count, -7, dtype=np.int8),
    )


def solve(
    case: Case,
    poses: Array | None = None,
    method: int = MINIMUM_NORM,
    variable: int = CHORD_TENSION,
    model: int = CATENARY,
    previous: Array | None = None,
    goal: float = 0.0,
    room: tuple[Array, np.ndarray] | None = None,
    otherwise: bool | None = None,
    span: tuple[int, int] | None = None,
) -> Answer:
    poses = case.pose[None] if poses is None else poses
    count, m, n = len(poses), len(case.robot), len(case.freedom)
    answer = new_answers(count, m, n)
    parameter = 4.0 if method == codes.P_NORM else 1.0
    inverse_poses(
        (model, 4.9, 4.0),
        (method, parameter, variable, fixed(np.ones(m)), fixed(np.full(m, goal))),
        LIMITS,
        robot_terms(case),
        fixed(poses),
        fixed(case.wrench[None]),
        np.full(m, math.nan) if previous is None else previous,
        memory_for(m) if room is None else room,
        otherwise,
        False,
        (answer.results, answer.statuses, answer.residuals, answer.needed, answer.poses),
        *(span or (0, count)),
    )
    return answer


def residual_of(case: Case, pose: Array, results: Array) -> Array:
    """Residual of cable forces, weight and load along the free motions."""
    case = case._replace(pose=pose)
    chords = case.chords
    level = np.hypot(chords[:, 0], chords[:, 1])
    force = np.column_stack(
        (
            -results[tables.HORIZONTAL] * chords[:, 0] / level,
            -results[tables.HORIZONTAL] * chords[:, 1] / level,
            -results[tables.VERTICAL],
        )
    )
    x, y, z, w = pose[3:]
    turn = np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )
    lever = (case.robot[:, 3:6] - case.body[tables.CENTER_X :]) @ turn.T
    total = np.concatenate((force.sum(axis=0), np.cross(lever, force).sum(axis=0))) + case.wrench
    total[2] -= case.body[tables.MASS] * GRAVITY
    return np.asarray(case.freedom @ total)


def course(case: Case, count: int, reach: float = 0.3) -> Array:
    """Poses on a line, with distant ones at the end."""
    poses = np.tile(case.pose, (count, 1))
    poses[:, 0] += np.linspace(0.0, reach, count)
    poses[:, 2] -= np.linspace(0.0, 0.5 * reach, count)
    return poses


def feasible_case(m: int, freedom: Array = EVERY_MOTION, seed: int = 0) -> Case:
    """The first random robot with a feasible pose."""
    for trial in range(400):
        case = random_case(np.random.default_rng(1000 * seed + trial), m, freedom, flat=freedom is IN_A_PLANE)
        if solve(case).poses[0] == POSE_SOLVED:
            return case
    raise AssertionError("no robot holds its platform")


SHAPES = [(8, EVERY_MOTION), (9, EVERY_MOTION), (7, EVERY_MOTION), (5, IN_A_PLANE), (6, A_POINT), (2, TO_AND_FRO)]


@pytest.mark.parametrize("otherwise", [None, True])
@pytest.mark.parametrize(("m", "freedom"), SHAPES)
def test_the_platform_is_in_balance(m: int, freedom: Array, otherwise: bool | None) -> None:
    case = feasible_case(m, freedom)
    poses = course(case, 4, 0.02)
    answer = solve(case, poses, otherwise=otherwise)
    for p in np.flatnonzero(answer.poses == POSE_SOLVED):
        assert np.abs(residual_of(case, poses[p], answer.results[:, p])).max() < 1e-9
        assert np.abs(answer.residuals[p]).max() < 1e-9
        tau = answer.results[tables.TENSION, p]
        assert (tau >= case.robot[:, tables.TENSION_MIN] - 1e-9).all()
        assert (tau <= case.robot[:, tables.TENSION_MAX] + 1e-9).all()
        chords = case._replace(pose=poses[p]).chords
        np.testing.assert_allclose(answer.results[tables.SPAN, p], np.hypot(chords[:, 0], chords[:, 1]), rtol=1e-14)
        np.testing.assert_allclose(answer.results[tables.RISE, p], chords[:, 2], rtol=1e-12)
        assert (answer.statuses[p] == codes.CABLE_SOLVED).all()
        length = np.linalg.norm(chords, axis=1)
        for i in range(m):  # the length of each cable agrees with a single catenary at its tension
            chord = Chord(length[i], chords[i, 2] / length[i], np.hypot(chords[i, 0], chords[i, 1]) / length[i])
            material = Material(case.robot[i, tables.DENSITY], case.robot[i, tables.STIFFNESS])
            expected = from_tension(Model(CATENARY, 0.0, 0.0, GRAVITY), chord, material, tau[i])[0]
            assert answer.results[tables.LENGTH, p, i] == pytest.approx(expected, rel=2e-14)
    assert answer.poses[0] == POSE_SOLVED


@pytest.mark.parametrize("method", [MINIMUM_NORM, codes.QUADRATIC_PROGRAM, *OTHERWISE])
def test_a_batch_agrees_with_single_poses(method: int) -> None:
    case = feasible_case(8)
    poses = course(case, 12, 2.0)
    poses[5] = poses[0]
    otherwise = None if method <= codes.QUADRATIC_PROGRAM else True
    together = solve(case, poses, method, goal=90.0, otherwise=otherwise)
    assert together.poses[0] == together.poses[5]
    assert len(set(together.poses)) > 1  # an error in between, without later effects
    for p in range(12):
        alone = solve(case, poses[p : p + 1].copy(), method, goal=90.0, otherwise=otherwise)
        np.testing.assert_array_equal(together.results[:, p], alone.results[:, 0])
        np.testing.assert_array_equal(together.statuses[p], alone.statuses[0])
        np.testing.assert_array_equal(together.residuals[p], alone.residuals[0])
        np.testing.assert_array_equal(together.needed[p], alone.needed[0])
        assert together.poses[p] == alone.poses[0]


def test_only_the_requested_poses_are_written() -> None:
    case = feasible_case(8)
    answer = solve(case, course(case, 5), span=(1, 3))
    assert (answer.poses[[0, 3, 4]] == -7).all()
    assert (answer.poses[1:3] != -7).all()
    assert (answer.results[:, [0, 3, 4]] == -7.0).all()


@pytest.mark.parametrize(
    ("variable", "otherwise"), [(CHORD_TENSION, None), (HORIZONTAL_TENSION, None), (FRAME_END_TENSION, True)]
)
def test_closest_starts_at_the_tensions_of_the_previous_pose(variable: int, otherwise: bool | None) -> None:
    case = feasible_case(8)
    poses = course(case, 6, 0.05)
    previous = np.full(8, math.nan)
    together = solve(case, poses, CLOSEST, variable, previous=previous, otherwise=otherwise)
    assert (together.poses == POSE_SOLVED).all()
    before = np.full(8, math.nan)
    for p in range(6):
        alone = solve(case, poses[p : p + 1].copy(), CLOSEST, variable, previous=before, otherwise=otherwise)
        np.testing.assert_array_equal(together.results[:, p], alone.results[:, 0])
        shared = shared_tensions(case, variable, alone.results[:, 0])
        np.testing.assert_allclose(before, shared, rtol=1e-12)
    np.testing.assert_array_equal(previous, before)
    far = solve(case, poses[5:].copy(), MINIMUM_NORM, variable, otherwise=otherwise).results[tables.TENSION, 0]
    assert np.abs(far - together.results[tables.TENSION, 5]).max() > 1e-3


def shared_tensions(case: Case, variable: int, results: Array) -> Array:
    if variable == CHORD_TENSION:
        return np.asarray(results[tables.TENSION])
    if variable == HORIZONTAL_TENSION:
        return np.asarray(results[tables.HORIZONTAL])
    weight = case.robot[:, tables.DENSITY] * GRAVITY
    return np.asarray(np.hypot(results[tables.HORIZONTAL], results[tables.VERTICAL] - weight * results[tables.LENGTH]))


def test_an_infeasible_pose_keeps_the_previous_tensions() -> None:
    case = feasible_case(8)
    poses = course(case, 3, 0.0)
    poses[1, 2] += 50.0
    previous = np.full(8, math.nan)
    answer = solve(case, poses, CLOSEST, previous=previous)
    assert list(answer.poses) == [POSE_SOLVED, POSE_INFEASIBLE, POSE_SOLVED]
    np.testing.assert_allclose(answer.results[tables.TENSION, 2], answer.results[tables.TENSION, 0], rtol=1e-9)
    np.testing.assert_array_equal(previous, answer.results[tables.TENSION, 2])
    assert np.isnan(answer.results[tables.LENGTH : tables.WRAP, 1]).all()
    assert np.isfinite(answer.results[: tables.LENGTH, 1]).all()
    assert np.isnan(answer.residuals[1]).all()
    assert np.isfinite(answer.needed[1]).all()


def in_variable(case: Case, variable: int, tensions: Array) -> Array:
    """Chord tensions in the variable of the distribution."""
    chords = case.chords
    length = np.linalg.norm(chords, axis=1)
    sine, cosine = chords[:, 2] / length, np.hypot(chords[:, 0], chords[:, 1]) / length
    if variable != FRAME_END_TENSION:
        return np.asarray(tensions * (cosine if variable == HORIZONTAL_TENSION else 1.0))
    model = Model(CATENARY, 0.0, 0.0, GRAVITY)
    return np.array(
        [
            frame_end_tension(
                model,
                Chord(length[i], sine[i], cosine[i]),
                Material(case.robot[i, tables.DENSITY], case.robot[i, tables.STIFFNESS]),
                Pulley(0.0, 1.0, 0.0, 0.0),
                tension,
            )
            for i, tension in enumerate(tensions)
        ]
    )


@pytest.mark.parametrize("variable", [CHORD_TENSION, HORIZONTAL_TENSION, FRAME_END_TENSION])
def test_the_least_norm_is_in_the_variable_of_the_distribution(variable: int) -> None:
    found = 0
    for seed in range(40):
        case = random_case(np.random.default_rng(seed), 14)
        case.robot[:, tables.TENSION_MIN], case.robot[:, tables.TENSION_MAX] = 0.5, 1e5  # no limit is active
        answer = solve(case, method=codes.QUADRATIC_PROGRAM, variable=variable, goal=150.0, otherwise=True)
        tau = answer.results[tables.TENSION, 0]
        if answer.poses[0] != POSE_SOLVED or tau.min() < 1.0:
            continue
        found += 1
        null = np.linalg.svd(case.structure)[2][6:]
        above, below, here = (in_variable(case, variable, tau * factor) for factor in (1.001, 0.999, 1.0))
        slope, miss = (above - below) / (0.002 * tau), here - 150.0
        np.testing.assert_allclose(null @ (slope * miss), 0.0, atol=1e-4)  # no direction of the null space is better
    assert found > 3


def test_reasons_of_failure() -> None:
    case = feasible_case(8)
    broken = case._replace(robot=case.robot.copy())
    broken.robot[:, 3:6] = broken.body[tables.CENTER_X :]
    answer = solve(broken)
    assert answer.poses[0] == POSE_SINGULAR
    assert np.isnan(answer.needed).all()
    case.pose[:] = [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0]
    case.robot[2, :3] = case.robot[2, 3:6]
    answer = solve(case)
    assert answer.poses[0] == POSE_NO_CHORD
    assert np.isnan(answer.needed).all()


def robots_of_every_size() -> list[Case]:
    cases = [random_case(np.random.default_rng(m), m, EVERY_MOTION) for m in range(6, 25)]
    cases += [random_case(np.random.default_rng(m), m, IN_A_PLANE, flat=True) for m in range(3, 25, 3)]
    return cases + [random_case(np.random.default_rng(m), m, TO_AND_FRO) for m in (2, 3, 9, 24)]


def test_memory_is_sufficient_for_every_robot_and_method() -> None:
    for case in robots_of_every_size():
        m, n = len(case.robot), len(case.freedom)
        r = m - n
        case.robot[:, tables.TENSION_MAX] = 1e6
        for method in [MINIMUM_NORM, codes.QUADRATIC_PROGRAM, *OTHERWISE]:
            if method in (codes.CENTROID, codes.POLYGON_WALK) and r > 2:
                continue
            for variable in (CHORD_TENSION, FRAME_END_TENSION):
                solve(case, method=method, variable=variable, otherwise=True, goal=50.0, model=ELASTIC)
        for room in (memory_for(m), (np.empty(30), np.empty(2, dtype=np.int64))):
            enough = room[0].size > 30
            for call in (decided, margined, polygoned):
                if enough:
                    if call is not margined or m < 14:  # a margin examines all choices of columns
                        call(case, room)
                else:
                    with pytest.raises(ValueError, match="total size"):
                        call(case, room)


def test_too_little_memory_is_reported() -> None:
    case = feasible_case(8)
    numbers, counters = memory_for(8)
    for room in ((numbers[:500].copy(), counters), (numbers, counters[:3].copy()), (numbers[:0], counters[:0])):
        with pytest.raises(ValueError, match="total size"):
            solve(case, room=room)
        with pytest.raises(ValueError, match="total size"):
            solve(case, method=codes.LOWEST_MAXIMUM, otherwise=True, room=room)


WorkArrays = tuple[Array, np.ndarray]
TERMS = (CATENARY, 4.9, 4.0)
LIMITS = (LIMITS_OF_CHORD, math.nan)


def robot_terms(case: Case) -> tuple[Array, Array, Array]:
    return fixed(case.freedom), fixed(case.body[None]), fixed(case.robot[None])


def decided(case: Case, room: WorkArrays) -> Array:
    m, n = len(case.robot), len(case.freedom)
    nothing = np.full((1, n), np.nan)
    found = (np.full((1, 2), np.nan), nothing, nothing.copy(), np.zeros((1, m), dtype=np.bool_))
    answers = new_answers(1, m, n)
    heavy = fixed(np.array([[0.0, 0.0, -1e5, 0.0, 0.0, 0.0]]))
    which = locked(np.zeros(1, dtype=np.int64))
    given = (TERMS, LIMITS, robot_terms(case), fixed(case.pose[None]), heavy)
    results = (answers.results, answers.statuses, answers.residuals, answers.needed, answers.poses)
    decide_poses(*given, which, True, room, results, found)
    return found[0]


def margined(case: Case, room: WorkArrays) -> Array:
    found = np.full(1, np.nan)
    sag_forces = locked(np.zeros((1, len(case.robot))))
    margins_of_poses(
        TERMS, LIMITS, robot_terms(case), fixed(case.pose[None]), fixed(case.wrench[None]), sag_forces, room, found
    )
    return found


def polygoned(case: Case, room: WorkArrays) -> int:
    m, n = len(case.robot), len(case.freedom)
    polygon = (
        np.empty(m), np.empty(m), np.empty((3, m)), np.empty((m - n, m)),
        np.empty((2 * m + SPARE_CORNERS, 2)), np.empty(2 * m + SPARE_CORNERS, dtype=np.int64),
    )  # fmt: skip
    distribution = (MINIMUM_NORM, 0.0, CHORD_TENSION, fixed(np.ones(m)), fixed(np.zeros(m)))
    given = (TERMS, distribution, LIMITS, robot_terms(case), fixed(case.pose), fixed(case.wrench))
    carried = (fixed(np.full(m, np.nan)), fixed(np.full(m, np.nan)))
    return polygon_of_pose(*given, carried, room, polygon)
