"""Motion in time compared with another integration, MuJoCo, energy balances, and plans."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Literal

import numpy as np
import pytest

import sagline as sl
from sagline.core.arrays import Array
from tests.dynamics.let_go import LIFT, beside, integrated, lopsided
from tests.refusal import refused
from tests.tiers import extended, wide

Code = Literal["splitting", "runge-kutta"]
MODEL = Path(__file__).parents[3] / "docs" / "model.md"
BOTH: tuple[Code, ...] = ("splitting", "runge-kutta")
SHIFT = np.array([0.004, -0.003, 0.0033])  # m; 6 mm
GUST = ([0.0, 0.003, 0.03], np.outer([0, 1, 1], [3.0, 2.0, -3.0, 1.0, 0.8, 0.5]))


def largest_distance(expected: Array, run: sl.Simulation) -> float:
    """Largest distance of positions and of quaternions, m and about half a rad."""
    same = np.sign(np.sum(expected[:, 3:] * run.pose.quaternion, axis=1))[:, None]
    place = np.abs(run.pose.position - expected[:, :3]).max()
    return float(max(place, np.abs(same * run.pose.quaternion - expected[:, 3:]).max()))


@pytest.mark.parametrize(("integrator", "order"), [("splitting", 2), ("runge-kutta", 4)])
def test_motion_converges_to_another_integration_with_the_order_of_the_method(integrator: Code, order: int) -> None:
    robot, step = lopsided("article-suspended"), 0.008 if integrator == "runge-kutta" else 0.004
    state, lengths = beside(robot, (0.5, 0.3, 1.5), 10.0 * SHIFT)
    expected = integrated(robot, sl.Catenary(), state.pose, lengths, np.linspace(0.0, 0.64, 21))
    errors = [
        largest_distance(expected, sl.simulate(state, unstrained_length=lengths, duration=0.64, step=h, record=0.032,
                                        integrator=integrator))
        for h in (step, 0.5 * step, 0.25 * step)
    ]  # fmt: skip
    np.testing.assert_allclose(np.log2(np.divide(errors[:-1], errors[1:])), order, atol=0.15)
    assert errors[-1] < (1e-4 if order == 2 else 1e-7)
    assert np.abs(np.diff(expected[:, :3], axis=0)).max() > 1e-3  # it moves


@extended
@pytest.mark.parametrize("integrator", BOTH)
def test_elastic_cables_swing_as_tendons_of_mujoco(integrator: Code) -> None:
    import mujoco

    robot, step = sl.load_robot("article-suspended"), 1e-4
    state, lengths = beside(robot, (0.5, 0.3, 1.5), SHIFT, sl.Elastic())
    model = mujoco.MjModel.from_xml_string(sl.dump_mjcf(robot, state.pose, lengths))
    model.opt.integrator, model.opt.timestep = mujoco.mjtIntegrator.mjINT_RK4, 5e-4
    model.tendon_damping[:] = 0.0
    model.dof_damping[:] = 0.0
    data = mujoco.MjData(model)
    for _ in range(2000):
        mujoco.mj_step(model, data)
    if integrator == "splitting":
        step = 2e-5
    run = sl.simulate(state, unstrained_length=lengths, duration=1.0, step=step, record=0.5, integrator=integrator)
    assert np.abs(run.pose.position[-1] - data.qpos[:3]).max() < 1e-9
    assert np.abs(run.pose.position[-1] - run.pose.position[0]).max() > 1e-3


@pytest.mark.parametrize("integrator", BOTH)
def test_a_robot_at_rest_stays_there(integrator: Code) -> None:
    state = sl.inverse(
        lopsided("article-suspended"), sl.Pose.from_euler([0.5, 0.3, 1.5], 0.1, 0, 0), tension=LIFT
    ).state
    run = sl.simulate(state, duration=10.0, integrator=integrator)
    walk = np.sqrt(10.0 / run.step) * np.spacing(1.5)  # m, due to rounding of positions in each step
    assert np.abs(run.pose.position - state.pose.position).max() < 5.0 * walk
    assert np.abs(run.twist).max() < 1e-11


@pytest.mark.parametrize(
    ("away", "least"), wide([(0.03, 10.0), (0.006, 40.0)])
)  # in the last one cables become slack repeatedly
@pytest.mark.parametrize(("integrator", "most"), [("splitting", 5e-5), ("runge-kutta", 1e-4)])
def test_energy_has_no_trend_in_a_minute(integrator: Code, most: float, away: float, least: float) -> None:
    state, lengths = beside(sl.load_robot("cogiro"), (0.0, 0.0, 2.0), np.array([away, 0.0, 0.0]))
    run = sl.simulate(state, unstrained_length=lengths, duration=60.0, step=1e-3, integrator=integrator)
    assert least < run.tensions.min() < 1.2 * least
    assert np.ptp(run.tensions) > 1000.0
    trend = np.polyfit(run.time / 60.0, run.energy.error / run.energy.kinetic.max(), 1)[0]
    assert abs(trend) < most


def test_the_work_of_winches_is_that_of_h() -> None:
    robot = sl.load_robot("article-suspended")
    path = sl.septic_path([(0, 0, 1), (0.3, 0.2, 2), (0, 0, 1)], durations=[1.0, 1.0], rate=1000.0)
    run = sl.simulate(sl.inverse(robot, path, tension=LIFT), record=1e-3)
    total = run.energy.kinetic + run.energy.potential
    moved = np.ptp(total)
    assert moved == pytest.approx(530.0, abs=0.5)
    error = np.abs(run.energy.error).max()
    assert error < 1e-6 * moved
    wound, tension = np.diff(run.length, axis=0), 0.5 * (run.tensions[1:] + run.tensions[:-1])
    whole = tension + 0.5 * tension**2 / robot.cables.axial_stiffness
    by_tension, by_whole = (np.cumsum(-(pull * wound).sum(axis=1)) for pull in (tension, whole))
    missed = np.abs(total[1:] - total[0] - by_tension).max()
    told = f"For a lift of {moved:.0f} J, the residual of this balance is ${1e5 * error:.0f} \\cdot 10^{{-5}}$ J. "
    told += f"If the tension at the frame end replaces $H$, the residual is {missed:.1f} J."
    assert told in " ".join(MODEL.read_text(encoding="utf-8").split())
    assert np.abs(total[1:] - total[0] - by_whole).max() < 1e-3  # of the trapezoidal rule


@pytest.mark.parametrize(
    ("place", "goal", "static"), [((0, 0, 1.5), (3, 0, 1.5), 5.95), ((-1.5, 0, 1.5), (1.5, 0, 1.5), 2.82)]
)
def test_planned_lengths_leave_less_vibration_than_static_ones(place: Array, goal: Array, static: float) -> None:
    robot = sl.load_robot("article-suspended")
    path = sl.quintic_path([place, goal], durations=2.0, rate=1000.0)
    run = sl.simulate(sl.inverse(robot, path, tension=LIFT), duration=6.0)
    rest = sl.inverse(robot, path.pose, tension=LIFT)
    plain = sl.simulate(rest.state[0], unstrained_length=(path.time, rest.unstrained_length), duration=6.0)
    shaken, plainly = (
        1e3 * np.linalg.norm(one.pose.position[one.time >= 2.0] - goal, axis=1).max() for one in (run, plain)
    )
    assert shaken < 1e-6
    assert plainly == pytest.approx(static, abs=0.01)
    planned = path.pose.position[:: round(0.01 / 0.001)]
    assert np.abs(run.pose.position[: len(planned)] - planned).max() < 1e-9


@extended
def test_with_pulleys_and_dead_length_a_plan_is_followed_and_energy_is_balanced() -> None:
    robot = sl.load_robot("article-suspended").replace(winches=sl.Winch(0.05, dead_cable=3.0, dead_rise=2.5))
    path = sl.septic_path([(0, 0, 1.5), (1, 0.5, 1.8)], durations=1.5, rate=1000.0)
    plan = sl.inverse(robot, path, tension=LIFT)
    run = sl.simulate(plan, duration=2.5)
    planned = path.pose.position[::10]
    assert np.abs(run.pose.position[: len(planned)] - planned).max() < 1e-8
    assert np.abs(run.energy.error).max() < 1e-6 * np.ptp(run.energy.potential)
    np.testing.assert_allclose(run.tensions[0], plan.state.cables.frame_end_tension[0], rtol=1e-9)


def test_the_wrench_of_a_plan_acts_unless_another_is_given() -> None:
    robot = sl.load_robot("article-suspended")
    path = sl.septic_path([(0, 0, 1.5), (0.6, 0.3, 1.7)], durations=1.0, rate=1000.0)
    load = np.outer(1.0 + path.time, [3.0, -5.0, -40.0, 1.0, 2.0, 0.5])
    plan = sl.inverse(robot, path, tension=LIFT, wrench=load)
    run = sl.simulate(plan)
    assert np.abs(run.pose.position - path.pose.position[::10]).max() < 1e-9
    same, other = (sl.simulate(plan, wrench=given) for given in ((path.time, load), np.zeros(6)))
    np.testing.assert_allclose(same.pose.position, run.pose.position, rtol=0, atol=1e-11)
    assert np.abs(other.pose.position - run.pose.position).max() > 1e-3


FRAMES = {
    "3T": [[3, 0, 3], [-2, 2, 3], [-2, -2, 3]],
    "1R2T": [[-3, 0, 3], [3, 0, 3], [0.5, 0, 3]],
    "2T": [[-3, 0, 3], [3, 0, 3]],
}
ENDS = {"3T": np.zeros((3, 3)), "1R2T": [[-0.2, 0, 0.1], [0.2, 0, 0.1], [0.0, 0.0, 0.1]], "2T": np.zeros((2, 3))}


@pytest.mark.parametrize("pattern", ["3T", "1R2T", "2T"])
def test_platforms_with_fewer_degrees_of_freedom_stay_within_them(pattern: Literal["3T", "1R2T", "2T"]) -> None:
    normal, rope = None if pattern == "3T" else (0.0, 1.0, 0.0), sl.Cable(0.05, 5e4)
    few = {"inertia": np.diag([0.3, 0.2, 0.3]), "motion_pattern": pattern, "plane_normal": normal}
    robot = sl.Robot("few", FRAMES[pattern], ENDS[pattern], rope, 10.0, **few)  # type: ignore[arg-type]
    state = sl.inverse(robot, sl.Pose.from_euler([0.3, 0.0, 1.0], 0, 0, 0)).state
    run = sl.simulate(state, wrench=np.array([3.0, 4.0, -5.0, 1.0, 0.5, 2.0]), duration=1.0)
    free = robot.freedom
    assert np.abs(run.twist - run.twist @ free.T @ free).max() < 1e-12
    assert np.abs(run.twist @ free.T).max(axis=0).min() > 1e-3
    assert np.abs(run.energy.error).max() < 1e-6


@pytest.mark.parametrize("cable_mass", wide(["none", "modal", "lumped"], first=2))
@pytest.mark.parametrize(("duration", "last"), [(0.005, [0.0, 0.005]), (0.0234, [0.01, 0.02, 0.0234])])
def test_the_end_is_always_recorded(cable_mass: Literal["none", "lumped", "modal"], duration: float, last: Any) -> None:
    """At the first step that is not earlier; the last sample agrees with a run that records every step."""
    state = sl.inverse(sl.load_robot("expo2015-lucia"), sl.Pose([-0.6, 0.0, 3.5], np.eye(3))).state
    given: dict[str, Any] = {"wrench": GUST, "cable_mass": cable_mass, "nodes": 6, "step": 1e-4}
    run = sl.simulate(state, duration=duration, **given)
    np.testing.assert_allclose(run.time[-len(last) :], last, atol=1e-12)
    every = sl.simulate(state, duration=duration, record=1e-4, **given)
    for mine, theirs in ((run.pose.position, every.pose.position), (run.tensions, every.tensions)):
        assert mine.shape[0] == run.time.size
        np.testing.assert_allclose(mine[-1], theirs[-1], rtol=1e-9)
    assert run.energy.supplied[-1] == pytest.approx(every.energy.supplied[-1], rel=1e-9)
    assert run.energy.supplied[-1] > 0.0


@pytest.mark.parametrize("cable_mass", wide(["none", "modal", "lumped"], first=2))
def test_twists_refer_to_the_origin_as_in_paths(cable_mass: Literal["none", "lumped", "modal"]) -> None:
    """Compared with differences of the poses, for a platform that rotates about a distant center of mass."""
    robot = sl.load_robot("expo2015-lucia").replace(center_of_mass=[0.05, -0.1, 0.2])
    state = sl.inverse(robot, sl.Pose([-0.6, 0.0, 3.5], np.eye(3))).state
    turning = (np.array([0.0, 0.1, 0.2, 0.3]), np.outer([0, 1, -1, 0], [3.0, 2.0, -3.0, 5.0, 4.0, 3.0]))
    run = sl.simulate(state, wrench=turning, duration=0.4, record=1e-3, cable_mass=cable_mass, nodes=6)
    place, turned = run.pose.position, run.pose.rotation
    moving = (place[2:] - place[:-2]) / (run.time[2:] - run.time[:-2])[:, None]
    spinning = (turned[2:] * turned[:-2].inv()).as_rotvec() / (run.time[2:] - run.time[:-2])[:, None]
    size = np.abs(moving).max()
    assert np.abs(np.cross(run.twist[:, 3:], [0.05, -0.1, 0.2])).max() > 0.2 * size
    tolerance = 2e-2 if cable_mass == "modal" else 2e-3
    assert np.abs(run.twist[1:-1, :3] - moving).max() < tolerance * size
    assert np.abs(run.twist[1:-1, 3:] - spinning).max() < tolerance * np.abs(spinning).max()


def test_a_run_has_the_twists_of_its_path() -> None:
    robot = lopsided("article-suspended")
    poses = sl.Pose.from_euler([(0, 0, 1.5), (0.1, 0.2, 1.6)], [0.0, 0.1], 0.0, [0.0, 0.1])
    path = sl.quintic_path(poses, durations=1.0, rate=1000.0)
    run = sl.simulate(sl.inverse(robot, path, tension=LIFT), record=0.01)
    assert np.abs(run.twist - path.twist[::10]).max() < 1e-7
    assert np.abs(np.cross(path.twist[:, 3:], robot.center_of_mass)).max() > 1e-3


def test_robots_at_a_pose_and_plans_of_one_pose_start_at_rest() -> None:
    robot, here, push = sl.load_robot("article-suspended"), (1.0, 1.0, 1.5), [0, 0, 50.0, 0, 0, 0]
    plan = sl.inverse(robot, here)
    expected = sl.simulate(plan.state, duration=0.3, wrench=push).pose.position
    assert np.abs(expected[-1] - here).max() > 1e-4
    np.testing.assert_array_equal(sl.simulate(robot, here, duration=0.3, wrench=push).pose.position, expected)
    np.testing.assert_array_equal(sl.simulate(plan, duration=0.3, wrench=push).pose.position, expected)
    with refused("start", "a plan of poses without times"):
        sl.simulate(sl.inverse(robot, [here, here]), duration=0.3)
