"""Verdicts with sag: time of infeasible poses, far from the border and near it; one core."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from rich.console import Console

import sagline as sl
from benchmarks.measure import Row, best_seconds, one_core, show
from sagline.core.arrays import Array
from sagline.kinematics.inverse_rows import decide_rows, solve_inverse_rows
from sagline.statics.tables import pose_rows, robot_terms
from sagline.tension.method import kernel_options
from tests.tension.reference import BORDER_ROBOTS, found_border, random_poses

POSES = 2000
OVERLOADS = (1e-3, 1e-6)  # distance beyond the border, relative to the weight
METHOD = sl.MinimumNorm()


def main() -> None:
    """Print the table."""
    one_core()
    show(
        "Verdicts with sag",
        [row for name in BORDER_ROBOTS for row in (in_the_open(name), *at_the_border(name))],
        Console(),
    )


def in_the_open(name: str) -> Row:
    """Random poses in and around a robot's test box, infeasible by more than 1e-3 of its weight."""
    robot, rng = sl.load_robot(name), np.random.default_rng(1)
    weight = robot.mass * robot.gravity
    poses = random_poses(robot, POSES, rng, stretch=1.5)
    loads = rng.normal(size=(POSES, 6)) * rng.uniform(0, 0.5, (POSES, 1)) * weight
    loads[:, 3:] *= np.ptp(robot.platform_anchors, axis=0).max()
    plan = sl.inverse(robot, poses, tension=METHOD, wrench=loads)
    beyond = np.flatnonzero((plan.status == sl.PoseStatus.INFEASIBLE) & (plan.shortfall > 1e-3 * weight))
    seconds = decision_seconds(robot, poses[beyond], loads[beyond])
    return Row(
        f"{name}: {beyond.size:,} infeasible poses, overload above 1e-3 of the weight",
        "<= 40 us per pose",
        f"{seconds / beyond.size * 1e6:.0f} us",
    )


def at_the_border(name: str) -> Iterator[Row]:
    """Poses with a load slightly above the largest feasible load."""
    border = found_border(name, 100, 3)
    weight = border.robot.mass * border.robot.gravity
    for over in OVERLOADS:
        loads = border.ways * (border.loads + over * weight)[:, None]
        plan = sl.inverse(border.robot, border.poses, tension=METHOD, wrench=loads)
        each = [decision_seconds(border.robot, border.poses[i : i + 1], loads[i : i + 1]) for i in range(len(loads))]
        yield Row(
            f"{name}: one pose, {over:g} of the weight beyond the border",
            "milliseconds",
            f"{np.median(each) * 1e6:.0f} us, at most {max(each) * 1e3:.1f} ms; "
            f"{np.mean(plan.status == sl.PoseStatus.INFEASIBLE):.0%} infeasible, the others borderline",
        )


def decision_seconds(robot: sl.Robot, poses: sl.Pose, loads: Array) -> float:
    """Time to decide poses that the iterations of the tension distribution left open."""
    options = kernel_options(robot, sl.Catenary(), METHOD)
    rows, terms, nothing = pose_rows(poses), robot_terms(robot), np.full(robot.cable_count, np.nan)
    found = solve_inverse_rows(robot, METHOD, options, rows, loads, nothing)

    def decide() -> None:
        decide_rows(terms, options, rows, loads, found._replace(pose_status=found.pose_status.copy()))

    return best_seconds(decide, 3)


if __name__ == "__main__":
    main()
