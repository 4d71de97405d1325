"""Random boxes of poses, their proofs, and poses in them with a contradicting verdict of the inverse."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

import sagline as sl
from sagline.core.arrays import Array
from sagline.workspaces.proof import PRECISION, Prover
from sagline.workspaces.wrench_sets import load_of

CORNERS = np.stack(np.meshgrid(*[[-1.0, 1.0]] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
RANDOM = 8  # poses per box, in addition to its corners
SIZES = np.geomspace(0.02, 0.15, 6)  # of the boxes, relative to the frame
_CATENARY = sl.Catenary()


def contradictions(
    robot: sl.Robot,
    count: int,
    rng: np.random.Generator,
    *,
    model: sl.CableModel = _CATENARY,
    wrenches: sl.WrenchSet | None = None,
    turns: tuple[float, ...] = (0.0,),
    precision: tuple[float, float] = PRECISION,
) -> tuple[int, int, int]:
    """Numbers of examined poses in boxes proved inside and outside, and of poses with contradicting verdicts.

    Outside a set of loads that is a proof of the margin that all of it is borne.
    """
    low, high = robot.frame_anchors.min(axis=0), robot.frame_anchors.max(axis=0)
    low = np.minimum(low, [np.inf, np.inf, 0.0])
    prover = Prover(robot, load_of(wrenches), model, precision)
    found: dict[int, list[tuple[Array, Array]]] = {1: [], 2: []}
    for size in SIZES:
        half = 0.5 * size * (high - low).max() * rng.uniform(0.4, 1.0, 3)
        middle = rng.uniform(low, high, (count // len(SIZES), 3))
        turn = float(rng.choice(turns))
        vectors = rng.normal(scale=0.1 if turn else 0.0, size=middle.shape)
        verdicts = prover.verdicts(middle, half, vectors, turn)
        for box in np.flatnonzero(verdicts):
            places = np.concatenate([CORNERS, rng.uniform(-1.0, 1.0, (RANDOM, 3))])
            axes = rng.normal(size=places.shape)
            angles = turn * rng.choice([1.0, 1.0, 0.5, 0.1], len(places))
            turned = Rotation.from_rotvec(axes / np.linalg.norm(axes, axis=1, keepdims=True) * angles[:, None])
            rotation = (turned * Rotation.from_rotvec(vectors[box])).as_quat()
            found[int(verdicts[box])].append((middle[box] + places * half, rotation))
    inside, outside = (_poses(found[kind]) for kind in (1, 2))
    return (
        len(inside),
        len(outside),
        _not_inside(robot, inside, model, wrenches, rng) + _not_outside(robot, outside, model, wrenches),
    )


def _poses(parts: list[tuple[Array, Array]]) -> sl.Pose:
    if not parts:
        return sl.Pose(np.zeros((0, 3)), np.eye(3))
    positions, rotations = (np.concatenate(arrays) for arrays in zip(*parts, strict=True))
    return sl.Pose.from_quaternion(positions, rotations)


def _not_inside(
    robot: sl.Robot, poses: sl.Pose, model: sl.CableModel, wrenches: sl.WrenchSet | None, rng: np.random.Generator
) -> int:
    """Number of poses at which a load of a set is not balanced, one load per pose."""
    if not len(poses):
        return 0
    load = _one_each(robot, wrenches, len(poses), rng)
    # without a lower chord limit the minimum norm may leave a cable slack; other tensions do not
    may_be_slack = (robot.tension_min == 0.0).any() or robot.tension_limits_of == "frame_end"
    sharing = sl.AnalyticCenter() if may_be_slack else sl.MinimumNorm()
    status = sl.inverse(robot, poses, wrench=load, model=model, tension=sharing, stability=False).status
    return int((status != sl.PoseStatus.SOLVED).sum())


def _not_outside(robot: sl.Robot, poses: sl.Pose, model: sl.CableModel, wrenches: sl.WrenchSet | None) -> int:
    if not len(poses):
        return 0
    if wrenches is not None:
        return int((sl.margin(robot, poses, wrenches, model=model).low > 0.0).sum())
    return int((sl.inverse(robot, poses, model=model, stability=False).status != sl.PoseStatus.INFEASIBLE).sum())


def _one_each(robot: sl.Robot, wrenches: sl.WrenchSet | None, count: int, rng: np.random.Generator) -> Array:
    """A wrench of the set for each pose, half of them at its corners; for level poses if it contains accelerations."""
    load = load_of(wrenches)
    wrench = np.tile(load.center, (count, 1))
    signs = rng.uniform(-1.0, 1.0, (count, len(load.segments) + 6))
    signs[::2] = np.sign(signs[::2])
    wrench += signs[:, 6:] @ load.segments
    linear, angular = load.accelerations
    wrench[:, :3] -= robot.mass * linear * signs[:, :3]
    wrench[:, 3:] -= angular * signs[:, 3:6] @ robot.inertia.T
    for matrix in load.ellipsoids:
        direction = rng.normal(size=(count, 6))
        wrench += direction / np.linalg.norm(direction, axis=1, keepdims=True) @ matrix.T
    first = 0
    for size in load.sizes:
        wrench += load.corners[first + rng.integers(size, size=count)]
        first += size
    return wrench
