"""Proofs for boxes of poses against the exact inverse, and what is refused."""

from __future__ import annotations

import numpy as np
import pytest

import sagline as sl
from sagline.arrays import Array
from sagline.workspaces.proof import PRECISION, Prover
from sagline.workspaces.wrench_sets import NO_LOAD, load_of

ROBOTS = ("ipanema-1", "article-suspended", "article-mixed", "cogiro", "falcon-7")
CORNERS = np.stack(np.meshgrid(*[[-1.0, 1.0]] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
RANDOM = 8  # poses a box, beside its corners


def contradictions(
    robot: sl.Robot,
    model: sl.CableModel,
    count: int,
    rng: np.random.Generator,
    *,
    wrenches: sl.WrenchSet | None = None,
    precision: tuple[float, float] = PRECISION,
) -> tuple[int, int, int]:
    """Random boxes of all sizes; poses looked at inside and outside, and at how many the inverse says otherwise."""
    low, high = robot.frame_anchors.min(axis=0), robot.frame_anchors.max(axis=0)
    low = np.minimum(low, [np.inf, np.inf, 0.0])
    load = load_of(wrenches)
    prover = Prover(robot, load, model, precision)
    found: dict[int, list[Array]] = {1: [], 2: []}
    for edge in np.geomspace(0.02, 0.15, 6) * (high - low).max():
        half = 0.5 * edge * rng.uniform(0.4, 1.0, 3)
        middle = rng.uniform(low, high, (count // 6, 3))
        verdicts = prover.verdicts(middle, half)
        for box in np.flatnonzero(verdicts):
            places = np.concatenate([CORNERS, rng.uniform(-1.0, 1.0, (RANDOM, 3))])
            found[int(verdicts[box])].append(middle[box] + places * half)
    inside, outside = (np.concatenate(found[kind] or [np.zeros((0, 3))]) for kind in (1, 2))
    wrong = 0
    for positions, right in ((inside, sl.PoseStatus.SOLVED), (outside, sl.PoseStatus.INFEASIBLE)):
        if len(positions):
            wrench = _one_each(load, len(positions), rng)
            if right == sl.PoseStatus.INFEASIBLE and load is not NO_LOAD:
                margin = sl.margin(robot, sl.Pose(positions, np.eye(3)), load, model=model)
                wrong += int((margin.low > 0.0).sum())
                continue
            status = sl.inverse(robot, sl.Pose(positions, np.eye(3)), wrench=wrench, model=model).status
            wrong += int((status != right).sum())
    return len(inside), len(outside), wrong


def _one_each(load: sl.WrenchSet, count: int, rng: np.random.Generator) -> Array:
    """Wrenches of a set, half of them at its corners."""
    wrench = np.tile(load.center, (count, 1))
    signs = rng.uniform(-1.0, 1.0, (count, len(load.segments)))
    signs[::2] = np.sign(signs[::2])
    wrench += signs @ load.segments
    for matrix in load.ellipsoids:
        direction = rng.normal(size=(count, 6))
        wrench += direction / np.linalg.norm(direction, axis=1, keepdims=True) @ matrix.T
    first = 0
    for size in load.sizes:
        wrench += load.corners[first + rng.integers(size, size=count)]
        first += size
    return wrench


@pytest.mark.parametrize("name", ROBOTS)
@pytest.mark.parametrize("model", [sl.Straight(), sl.Catenary()], ids=["straight", "catenary"])
def test_no_pose_contradicts_a_proof(name: str, model: sl.CableModel) -> None:
    rng = np.random.default_rng(14)
    inside, outside, wrong = contradictions(sl.load_robot(name), model, 90, rng)
    assert wrong == 0
    assert min(inside, outside) > 50


def test_pulleys_tilts_and_too_few_cables_are_refused() -> None:
    robot, box = sl.load_robot("article-suspended"), sl.PoseBox([0, 0, 2], [1, 1, 3])
    with pytest.raises(sl.InvalidValueError, match="pulley_radius"):
        sl.prove(sl.load_robot("ipanema-2-pulleys"), box)
    with pytest.raises(sl.InvalidValueError, match="tilt"):
        sl.prove(robot, sl.PoseBox([0, 0, 2], [1, 1, 3], tilt=0.1))
    with pytest.raises(sl.InvalidValueError, match="number of cables"):
        sl.prove(sl.without_cables(robot, 0, 1, 2), box)
