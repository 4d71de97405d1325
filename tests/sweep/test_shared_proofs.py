"""A proof of infeasibility of one load decides other loads at its pose, except within rounding of the boundary."""

from pathlib import Path

import numpy as np

import sagline as sl


def test_a_shared_proof_does_not_decide_loads_at_the_boundary(tmp_path: Path) -> None:
    """A proof is exact for straight cables: at the boundary its gap is zero except for rounding."""
    robot, position, model = sl.load_robot("cogiro"), np.array([0.0, 0.0, 2.0]), sl.Straight()
    load = robot.mass * robot.gravity * np.array([0.4, 0.3, 0.2, 0.0, 0.0, 0.0])
    inside, outside = 0.0, 20.0
    for _ in range(60):
        middle = 0.5 * (inside + outside)
        feasible = sl.inverse(robot, sl.Pose(position, np.eye(3)), model, wrench=middle * load).feasible
        inside, outside = (middle, outside) if feasible else (inside, middle)
    sizes = inside * (1.0 + np.concatenate(([1e-3], -np.geomspace(1e-12, 1e-8, 30))))
    loads, poses = np.outer(sizes, load), sl.Pose(position[None], np.eye(3))
    sweep = sl.sweep.run(sl.sweep.Request(robot, poses, loads, model=model), tmp_path / "sweep", workers=1)
    alone = sl.inverse(robot, poses[np.zeros(31, dtype=int)], model, wrench=loads)
    assert alone.feasible.tolist() == [False] + [True] * 30
    np.testing.assert_array_equal(sweep.values("status")[0, 0], alone.status)
