"""N robots, one per pose, compared with N single calls: equal to the last bit."""

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import sagline as sl
from sagline.core.arrays import Array, locked
from sagline.kinematics.forward import _outside_limits
from sagline.kinematics.forward_rows import solve_forward_rows
from tests.kinematics.feasible import box_poses, feasible_plan, moved, pose_rows
from tests.refusal import refused
from tests.tiers import extended, wide

COGIRO = sl.load_robot("cogiro")
COUNT = 50


def perturbed(robot: sl.Robot, count: int, seed: int) -> list[sl.Robot]:
    """Robots with different anchors, material, mass, center of mass, inertia and limits."""
    rng = np.random.default_rng(seed)

    def factor(*shape: int) -> Array:
        return np.asarray(1.0 + 0.01 * rng.normal(size=shape))

    return [
        robot.replace(
            frame_anchors=robot.frame_anchors + 0.01 * rng.normal(size=robot.frame_anchors.shape),
            platform_anchors=robot.platform_anchors + 0.005 * rng.normal(size=robot.platform_anchors.shape),
            cables=sl.Cable(
                robot.cables.linear_density * factor(robot.cable_count),
                robot.cables.axial_stiffness * factor(robot.cable_count),
            ),
            mass=robot.mass * float(factor()),
            center_of_mass=robot.center_of_mass + 0.01 * rng.normal(size=3),
            inertia=robot.inertia * float(factor()),
            tension_min=robot.tension_min + rng.uniform(0.0, 5.0, robot.cable_count),
            tension_max=robot.tension_max * factor(robot.cable_count),
        )
        for _ in range(count)
    ]


def state_fields(state: sl.Equilibrium) -> dict[str, Array]:
    cables = state.cables
    derived = ("cable_weight", "frame_end_tension", "sag", "closure_residual")
    stored = ("span", "rise", "unstrained_length", "horizontal_tension", "vertical_force", "chord_tension", "status")
    values = {name: getattr(cables, name) for name in stored + derived}
    return {**values, "wrench": state.wrench, "position": state.pose.position, "quaternion": state.pose.quaternion}


def assert_same(batch: dict[str, Array], singles: list[dict[str, Array]]) -> None:
    for name, values in batch.items():
        np.testing.assert_array_equal(values, np.stack([single[name] for single in singles]), err_msg=name)


def test_inverse_of_many_robots_agrees_with_single_calls() -> None:
    robots, pose = perturbed(COGIRO, COUNT, seed=1), box_poses(COGIRO, COUNT, seed=2)
    wrench = np.random.default_rng(3).normal(size=(COUNT, 6)) * 300.0
    plan = sl.inverse(robots, pose, wrench=wrench)
    assert plan.feasible.sum() > 30
    assert not plan.feasible.all()
    singles = [sl.inverse(robots[i], pose[i], wrench=wrench[i]) for i in range(COUNT)]
    assert_same(state_fields(plan.state), [state_fields(single.state) for single in singles])
    for name in ("status", "shortfall", "wrench_residual", "blocking", "farkas", "needed"):
        np.testing.assert_array_equal(getattr(plan, name), [getattr(single, name) for single in singles], err_msg=name)
    assert plan.state.robot == tuple(robots)
    assert plan.state[7].robot is robots[7]
    assert plan.state[-3:].robot == tuple(robots[-3:])


def test_margins_stiffness_and_modes_of_many_robots() -> None:
    robots, pose = perturbed(COGIRO, COUNT, seed=4), feasible_plan(COGIRO, COUNT, seed=5).state.pose
    robots = robots[: len(pose)]
    state = sl.inverse(robots, pose).state
    singles = [sl.inverse(robot, one).state for robot, one in zip(robots, pose, strict=True)]
    np.testing.assert_array_equal(sl.limit_margin(state), [sl.limit_margin(one) for one in singles])
    np.testing.assert_array_equal(sl.capacity_margin(state), [sl.capacity_margin(one) for one in singles])
    stiff, alone = sl.stiffness(state), [sl.stiffness(one) for one in singles]
    for name in ("matrix", "compliance", "length_sensitivity", "density_sensitivity", "stiffness_sensitivity"):
        np.testing.assert_array_equal(getattr(stiff, name), [getattr(one, name) for one in alone], err_msg=name)
    swinging = sl.modes(state)
    np.testing.assert_array_equal(swinging.frequency, [sl.modes(one).frequency for one in singles])
    np.testing.assert_array_equal(swinging.shape, [sl.modes(one).shape for one in singles])
    matrices = [sl.structure_matrix(robot, one) for robot, one in zip(robots, pose, strict=True)]
    np.testing.assert_array_equal(sl.structure_matrix(robots, pose), matrices)


@pytest.mark.parametrize("limits_of", ["chord", "frame_end"])
def test_limit_margins_are_those_of_each_robot(limits_of: str) -> None:
    robots = perturbed(COGIRO.replace(tension_limits_of=limits_of), 4, seed=6)
    pose = sl.Pose(np.tile([0.0, 0.0, 3.0], (4, 1)), np.eye(3))
    plan = sl.inverse(robots, pose, tension=sl.AnalyticCenter())
    tension = plan.state.cables.frame_end_tension if limits_of == "frame_end" else plan.chord_tension
    for i, robot in enumerate(robots):
        gaps = np.concatenate((tension[i] - robot.tension_min, robot.tension_max - tension[i]))
        assert sl.limit_margin(plan.state)[i] == gaps.min()


@pytest.mark.parametrize("begun", wide(["apart", "chained", "searched"], first=2))
def test_forward_of_many_robots_agrees_with_single_calls(begun: str) -> None:
    robots = perturbed(COGIRO, COUNT, seed=7)
    plan = feasible_plan(COGIRO, COUNT, seed=8)
    robots, lengths = robots[: len(plan.state.pose)], plan.unstrained_length
    near = moved(plan.state.pose, 0.1, 3.0, seed=9)
    wrench = np.random.default_rng(10).normal(size=(len(robots), 6)) * 20.0
    if begun == "apart":
        found = sl.forward(robots, lengths, near, wrench=wrench)
        singles = [sl.forward(robots[i], lengths[i], near[i], wrench=wrench[i]) for i in range(len(robots))]
    elif begun == "chained":
        found = sl.forward(robots, lengths, near[0], wrench=wrench)
        singles = []
        for i in range(len(robots)):
            start = singles[-1].pose if singles else near[0]
            singles.append(sl.forward(robots[i], lengths[i], start, wrench=wrench[i]))
    else:
        found = sl.forward(robots, lengths, wrench=wrench)
        singles = [sl.forward(robots[i], lengths[i], wrench=wrench[i]) for i in range(len(robots))]
    if begun == "chained":  # cables keep their previous state in a chain, which changes rounding
        positions = np.stack([single.pose.position for single in singles])
        np.testing.assert_allclose(found.pose.position, positions, rtol=0.0, atol=1e-11)
    else:
        assert_same(state_fields(found.state), [state_fields(single.state) for single in singles])
        for name in ("stiffness_min", "energy", "wrench_residual", "iterations", "status"):
            np.testing.assert_array_equal(getattr(found, name), [getattr(one, name) for one in singles], err_msg=name)
    assert found.stable.sum() >= len(robots) - 5
    assert found.state.robot == tuple(robots)


def test_a_repeated_search_uses_the_robot_of_each_sample() -> None:
    # cables that are 2 % too long are partly slack: those samples are repeated from tilted initial poses
    robots = perturbed(COGIRO, 6, seed=11)
    lengths = feasible_plan(COGIRO, 12, seed=12).unstrained_length[:6].copy()
    lengths[[1, 4]] *= 1.02
    found = sl.forward(robots, lengths)
    for i, robot in enumerate(robots):
        np.testing.assert_array_equal(found.pose.position[i], sl.forward(robot, lengths[i]).pose.position)


@pytest.mark.parametrize("limits_of", ["chord", "frame_end"])
def test_a_search_judges_each_sample_by_the_limits_and_cables_of_its_robot(limits_of: str) -> None:
    plan = feasible_plan(COGIRO, 6, seed=22)
    lengths, rows, none = plan.unstrained_length, pose_rows(plan.state.pose), locked(np.zeros((1, 6)))
    robots = [
        COGIRO.replace(
            cables=sl.Cable(density * COGIRO.cables.linear_density, COGIRO.cables.axial_stiffness),
            tension_limits_of=limits_of,
        )
        for density in np.linspace(1.0, 10.0, len(lengths))
    ]
    found = solve_forward_rows(tuple(robots), sl.Catenary(), lengths, rows, none)
    cables = found.solution(tuple(robots), sl.Catenary(), none[0], (len(lengths),)).state.cables
    tension = np.sort(cables.frame_end_tension if limits_of == "frame_end" else cables.chord_tension, axis=1)
    # limits 5 % beside the tensions of each robot exclude the requested number of cables
    low = [1.05 * row[k] for row, k in zip(tension, (0, 1, 2, 0, 0, 3), strict=True)]
    robots = [robot.replace(tension_min=value) for robot, value in zip(robots, low, strict=True)]
    singles = [_outside_limits(robot, sl.Catenary(), found.part(np.array([i])))[0] for i, robot in enumerate(robots)]
    assert len(set(singles)) > 2
    np.testing.assert_array_equal(_outside_limits(tuple(robots), sl.Catenary(), found), singles)


def test_straight_cables_are_fitted_robot_by_robot() -> None:
    robots, pose = perturbed(COGIRO, 5, seed=13), box_poses(COGIRO, 5, seed=14)
    reach = np.stack([one.transform(r.platform_anchors) - r.frame_anchors for r, one in zip(robots, pose, strict=True)])
    lengths = np.linalg.norm(reach, axis=-1)
    found = sl.forward(robots, lengths, moved(pose, 0.05, 1.0, seed=15), sl.Straight())
    np.testing.assert_allclose(found.pose.position, pose.position, atol=1e-10)


def test_a_path_of_many_robots_uses_the_inertia_of_each() -> None:
    waypoints = sl.Pose.from_euler([[0, 0, 3.0], [1, 0.5, 3.5]], [0.0, 0.3], [0.0, 0.1], 0.0)
    path = sl.quintic_path(waypoints, durations=2.0, rate=10.0)
    robots = perturbed(COGIRO, len(path), seed=16)
    plan = sl.inverse(robots, path, tension=sl.MinimumNorm())
    assert plan.feasible.all()
    for i, robot in enumerate(robots):
        alone = sl.inverse(robot, path, tension=sl.MinimumNorm())
        np.testing.assert_array_equal(plan.state.wrench[i], alone.state.wrench[i])
        np.testing.assert_array_equal(plan.unstrained_length[i], alone.unstrained_length[i])
    proof = sl.confirm(plan)
    assert np.abs(proof.position_error).max() < 1e-11


def test_measured_tensions_are_fitted_robot_by_robot() -> None:
    robots, pose = perturbed(COGIRO, 3, seed=17), feasible_plan(COGIRO, 6, seed=18).state.pose[:3]
    plan = sl.inverse(robots, pose)
    readings = plan.state.cables.frame_end_tension + np.random.default_rng(19).normal(size=(3, 8))
    measured = sl.MeasuredTension(readings, 5.0, 0.003)
    found = sl.forward(robots, plan.unstrained_length, pose, tension_measured=measured)
    for i, robot in enumerate(robots):
        one = sl.MeasuredTension(readings[i], 5.0, 0.003)
        alone = sl.forward(robot, plan.unstrained_length[i], pose[i], tension_measured=one)
        np.testing.assert_array_equal(found.pose.position[i], alone.pose.position)
        assert found.covariance is not None
        assert alone.covariance is not None
        np.testing.assert_array_equal(found.covariance[i], alone.covariance)


def planar(normal: tuple[float, float, float]) -> sl.Robot:
    frame = [[3, 0, 3], [-3, 0, 3], [-3, 0, 0], [3, 0, 0]]
    ends = [[0.2, 0, 0.1], [-0.2, 0, 0.1], [-0.2, 0, -0.1], [0.2, 0, -0.1]]
    return sl.Robot(
        "planar", frame, ends, sl.Cable(0.05, 5e4), 10.0, np.eye(3), motion_pattern="1R2T", plane_normal=normal
    )


@pytest.mark.parametrize(
    ("robots", "item"),
    [
        ([COGIRO, COGIRO, sl.without_cables(COGIRO, 3)], "robot[2]: cable_count"),
        ([COGIRO, COGIRO.replace(gravity=1.62), COGIRO], "robot[1]: gravity"),
        ([COGIRO, COGIRO.replace(tension_limits_of="frame_end"), COGIRO], "robot[1]: tension_limits_of"),
        ([COGIRO, COGIRO.replace(motion_pattern="3T"), COGIRO], "robot[1]: motion_pattern"),
        ([planar((0, 1, 0)), planar((0, 1, 0)), planar((0, -1, 0))], "robot[2]: plane_normal"),
        ([COGIRO, COGIRO], "robot"),
        ([], "robot"),
        ([COGIRO, "cogiro", COGIRO], "robot[1]"),
    ],
)
def test_robots_that_do_not_fit_together_are_named(robots: list[sl.Robot], item: str) -> None:
    pose = box_poses(COGIRO, 3, seed=0)
    for call in (
        lambda: sl.inverse(robots, pose),
        lambda: sl.forward(robots, np.full((3, robots[0].cable_count if robots else 8), 10.0)),
        lambda: sl.structure_matrix(robots, pose),
    ):
        with refused(item, kind=sl.InvalidValueError):
            call()


def test_several_robots_need_a_batch_of_poses() -> None:
    with refused("robot", "a sequence of 2 robots", "one robot") as caught:
        sl.inverse([COGIRO, COGIRO], sl.Pose([0, 0, 3.0], np.eye(3)))
    assert "repeat" in caught.value.next_step
    with refused("robot", "a sequence of 1 robots"):
        sl.forward([COGIRO], np.full(8, 10.0))


def test_a_method_that_one_of_the_robots_cannot_use_names_it() -> None:
    open_ended = COGIRO.replace(tension_max=np.inf)
    with refused("robot[1]: tension_max[0]", "infinite"):
        sl.inverse([COGIRO, open_ended], box_poses(COGIRO, 2, seed=0), tension=sl.ClosedForm())


def test_a_plan_of_many_robots_is_not_saved(tmp_path: object) -> None:
    from pathlib import Path

    file = Path(str(tmp_path)) / "run.nc"
    plan = sl.inverse(perturbed(COGIRO, 2, seed=20), box_poses(COGIRO, 2, seed=21))
    with refused("robot", "a sequence of 2 robots, one per pose"):
        plan.save(file)
    assert not file.exists()


@extended
def test_robots_with_and_without_pulleys_in_one_batch(monkeypatch: pytest.MonkeyPatch) -> None:
    """In reused memory: values that a kernel does not write must not appear in results."""
    empty = np.empty
    plain = sl.load_robot("article-prototype")
    robots = [plain, plain.replace(winches=sl.Winch(pulley_radius=0.05, dead_cable=2.0)), plain]
    poses = sl.Pose.from_euler([[0.2, 0.1, 1.4], [0.0, 0.0, 1.5], [0.3, 0.4, 1.2]], 0.0, 0.0, 0.0)
    lengths = sl.inverse(robots, poses).unstrained_length

    def used(shape: int | tuple[int, ...], dtype: type = float) -> NDArray[Any]:
        return np.full(shape, np.nan) if dtype is float else empty(shape, dtype)

    with monkeypatch.context() as patch:
        patch.setattr(np, "empty", used)
        found = sl.forward(robots, lengths, start=poses)
    for k, robot in enumerate(robots):
        alone = sl.forward(robot, lengths[k], start=poses[k])
        for name in (
            "unstrained_length",
            "horizontal_tension",
        ):  # a cable without pulley is rounded differently beside pulleys
            together, single = getattr(found.state.cables, name)[k], getattr(alone.state.cables, name)
            np.testing.assert_allclose(together, single, rtol=1e-12)
    assert found.state.contact is not None
    np.testing.assert_array_equal(found.state.contact.wrapped_length[[0, 2]], 0.0)
    np.testing.assert_array_equal(found.state.contact.dead_length[[0, 2]], 0.0)
