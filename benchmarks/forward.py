"""Forward kinematics: success, speed and accuracy; one table, one core.

python -m benchmarks.forward            # full counts, as in the targets
python -m benchmarks.forward --quick    # a tenth of the poses
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from functools import partial

import numpy as np
from rich.console import Console
from scipy.spatial.transform import Rotation

import sagline as sl
from benchmarks.measure import Row, best_of_calls, best_seconds, one_core, show
from sagline.core.arrays import Array, Flags
from sagline.kernels.forward.sensitivity import sensitivities_of_states
from sagline.statics.slopes import KernelStates
from sagline.statics.stiffness import sensitivity_arrays
from tests.kinematics.feasible import angle_error, feasible_plan, motion_between, moved, position_error

BOX_POSES = 10_000
PRESET_POSES = 1_000
TIMED_POSES = 1_000
ARTICLE_TILT = np.radians(10.0)
SAME = 1e-6  # closer poses count as equal [m], [rad]


def wider(robot: sl.Robot) -> sl.Robot:
    """The article's robots with tilts to 10 degrees, as in the targets."""
    box = robot.test_box
    assert box is not None
    if not robot.name.startswith("article"):
        return robot
    return robot.replace(test_box=sl.PoseBox(box.low, box.high, ARTICLE_TILT))


def plan_of(robot: sl.Robot, feasible: int, seed: int) -> sl.Plan:
    """A plan of exactly `count` feasible poses of the test box."""
    plan = feasible_plan(robot, int(1.5 * feasible) + 20, seed)
    keep = slice(0, feasible)
    return sl.inverse(robot, plan.state.pose[keep], tension=sl.MinimumNorm())


def right(found: sl.ForwardSolution, pose: sl.Pose) -> Flags:
    """True for samples at which the original pose was found."""
    return np.asarray((position_error(found, pose) < SAME) & (angle_error(found, pose) < SAME))


def percent(flags: Flags) -> str:
    """Share of true flags."""
    return f"{100.0 * np.mean(flags):.2f} %"


def far_starts(share: float) -> Iterator[Row]:
    """Success for CoGiRo with start poses whose errors are a meter and up to 40 degrees."""
    plan = plan_of(sl.load_robot("cogiro"), int(share * BOX_POSES), seed=1)
    pose, count = plan.state.pose, len(plan.unstrained_length)
    for degrees in (2.0, 10.0, 20.0, 40.0):
        found = sl.forward(plan.state.robot, plan.unstrained_length, moved(pose, 1.0, degrees, seed=2))
        yield Row(
            f"CoGiRo, {count} poses, start off by 1 m and {degrees:g}°: an equilibrium; the same pose",
            "100 %; ≥ 99 %",
            f"{percent(found.stable)}; {percent(right(found, pose))} ({found.iterations.mean():.1f} steps)",
        )


def without_start(share: float) -> Iterator[Row]:
    """Success for every preset, without start poses and with the planned poses as start poses."""
    worst_shift, worst_turn, worst_force = 0.0, 0.0, 0.0
    for name in sl.robot_names():
        robot = wider(sl.load_robot(name))
        plan = plan_of(robot, int(share * PRESET_POSES), seed=3)
        pose, count = plan.state.pose, len(plan.unstrained_length)
        found = sl.forward(robot, plan.unstrained_length)
        straight = sl.forward(robot, plan.unstrained_length, model=sl.Straight())
        near = np.mean(position_error(straight, pose) < 0.1)
        yield Row(
            f"{name}, {count} poses, no start: an equilibrium; the right one",
            "100 %; ≥ 99.5 %",
            f"{percent(found.stable)}; {percent(right(found, pose))} (straight within 0.1 m: {100 * near:.0f} %)",
        )
        back = sl.forward(robot, plan.unstrained_length, start=pose)
        worst_shift = max(worst_shift, float(position_error(back, pose).max()))
        worst_turn = max(worst_turn, float(angle_error(back, pose).max()))
        load = robot.mass * robot.gravity
        worst_force = max(worst_force, float(back.wrench_residual[:, 0].max()) / max(load, 1.0))
    yield Row("pose error after inverse and forward kinematics, all presets: position; rotation", "1e-9 m; 1e-9 rad",
              f"{worst_shift:.1e} m; {worst_turn:.1e} rad")  # fmt: skip
    yield Row("unbalanced force after that, relative to the platform's weight", "", f"{worst_force:.1e}")


def walk(robot: sl.Robot, count: int) -> tuple[sl.Pose, sl.Plan]:
    """A path of steps of 2 mm and 1 mrad through the middle of the test box."""
    box = robot.test_box
    assert box is not None
    t = np.arange(count)
    middle = 0.5 * (box.low + box.high)
    radius = 0.002 * count / (2.0 * np.pi)
    angle = 2.0 * np.pi * t / count
    position = middle + radius * np.column_stack((np.cos(angle), np.sin(angle), 0.0 * t))
    tilt = 0.1 * np.column_stack((np.sin(0.01 * t), np.cos(0.01 * t), 0.0 * t))  # 1 mrad per step
    pose = sl.Pose(position, Rotation.from_rotvec(tilt))
    return pose, sl.inverse(robot, pose, tension=sl.MinimumNorm())


def speed(share: float) -> Iterator[Row]:
    """Times per solution: tracking, distant start poses, no start pose, and single samples from Python."""
    robot = sl.load_robot("cogiro")
    pose, plan = walk(robot, TIMED_POSES)
    lengths = plan.unstrained_length
    assert plan.feasible.all()
    time = best_seconds(lambda: sl.forward(robot, lengths, start=pose[0])) / len(lengths)
    yield Row("trajectory of CoGiRo (steps of 2 mm and 1 mrad), batch", "≤ 25 µs per solve", f"{1e6 * time:.1f} µs")
    plan = plan_of(robot, TIMED_POSES, seed=4)
    start = moved(plan.state.pose, 1.0, 20.0, seed=5)
    time = best_seconds(lambda: sl.forward(robot, plan.unstrained_length, start=start)) / len(start)
    yield Row("start pose wrong by 1 m and 20°, batch", "≤ 150 µs", f"{1e6 * time:.1f} µs")
    time = best_seconds(lambda: sl.forward(robot, plan.unstrained_length)) / len(start)
    yield Row("no start pose, batch", "", f"{1e6 * time:.1f} µs")
    solver = sl.ForwardSolver(robot, start=pose[0])
    rows = [row.copy() for row in lengths]
    position, quaternion = np.empty(3), np.empty(4)
    at = iter(range(10**9))
    time = best_of_calls(lambda: solver.step(rows[next(at) % len(rows)]))
    yield Row("ForwardSolver.step from Python, tracking", "≤ 40 µs", f"{1e6 * time:.1f} µs")
    time = best_of_calls(lambda: solver.step_into(rows[next(at) % len(rows)], position, quaternion))
    yield Row("ForwardSolver.step_into, tracking", "", f"{1e6 * time:.1f} µs")


def stiffnesses(share: float) -> Iterator[Row]:
    """Times of stiffness and all sensitivities: the kernel alone, arrays of poses, and single states."""
    for name in ("cogiro", "ipanema-2-pulleys"):
        state = plan_of(sl.load_robot(name), 500, seed=7).state
        arguments, one = next(KernelStates.of(state).parts(sensitivity_arrays(state))), state[0]
        alone = best_seconds(partial(sensitivities_of_states, *arguments)) / len(state)
        batch = best_seconds(partial(sl.stiffness, state)) / len(state)
        single = best_of_calls(partial(sl.stiffness, one), calls=100)
        measured = f"{1e6 * alone:.1f} µs; {1e6 * batch:.1f} µs; {1e6 * single:.0f} µs"
        yield Row(f"`stiffness` of {name}: kernel alone per state; with arrays; one state", "≤ 5 µs; ; ", measured)


def derivatives(share: float) -> Iterator[Row]:
    """Sensitivities, compared with central differences that are extrapolated from two step sizes."""
    robot = sl.load_robot("cogiro")
    plan = plan_of(robot, 20, seed=6)
    pose, lengths = plan.state.pose, plan.unstrained_length
    found = sl.stiffness(plan.state)
    rest = sl.forward(robot, lengths, start=pose)

    def slope(change: Callable[[float], sl.ForwardSolution], h: float) -> Array:
        def central(step: float) -> Array:
            return (motion_between(rest, change(step)) - motion_between(rest, change(-step))) / (2.0 * step)

        return (4.0 * central(0.5 * h) - central(h)) / 3.0

    def worst(analytic: Array, numeric: Array) -> float:
        error = np.linalg.norm(analytic - numeric, axis=-1) / np.linalg.norm(numeric, axis=-1)
        return float(error.max())

    def pushed(k: int) -> Callable[[float], sl.ForwardSolution]:
        return lambda h: sl.forward(robot, lengths, start=pose, wrench=h * np.eye(6)[k])

    def wound(i: int) -> Callable[[float], sl.ForwardSolution]:
        return lambda h: sl.forward(robot, lengths + h * np.eye(8)[i], start=pose)

    compliance = max(worst(found.compliance[..., k], slope(pushed(k), 10.0)) for k in range(6))
    by_length = max(worst(found.length_sensitivity[..., i], slope(wound(i), 2e-4)) for i in range(8))
    yield Row("relative difference of compliance and central differences", "1e-7", f"{compliance:.1e}")
    yield Row("relative difference of length sensitivity and central differences", "1e-7", f"{by_length:.1e}")


def main(share: float = 1.0) -> list[Row]:
    """Measure everything, with progress, and print one table; `share` of the full number of poses.

    Returns:
        The rows of the table.
    """
    one_core()
    console = Console(stderr=True)
    rows: list[Row] = []
    for part in (far_starts, without_start, speed, stiffnesses, derivatives):
        console.print(f"[dim]{(part.__doc__ or '').splitlines()[0]}[/dim]")
        for row in part(share):
            console.print(f"[dim]  {row.quantity}: {row.measured}[/dim]")
            rows.append(row)
    show("forward kinematics, one core", rows, Console())
    return rows


if __name__ == "__main__":
    main(0.1 if "--quick" in sys.argv[1:] else 1.0)
