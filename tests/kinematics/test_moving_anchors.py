"""Plans with moving anchors: Galilean invariance, inertial forces, one robot per pose, rates, files and refusals."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import sagline as sl
from sagline.core.arrays import Array
from tests.kinematics.winches import wound
from tests.refusal import refused
from tests.tiers import wide

COGIRO = sl.load_robot("cogiro")
WAY = sl.septic_path(sl.Pose.from_euler([(0, 0, 2), (2, 1, 2.5)], [0.0, 0.1], 0.0, [0.0, -0.05]), durations=2.0)
TURNED = sl.anchors_on_bases(
    COGIRO,
    [
        (
            sl.path_from_samples(
                np.linspace(-1.0, 3.0, 81),
                sl.Pose.from_euler(
                    np.outer(0.2 * np.sin(np.linspace(0.0, 5.0, 81)), [1, 0, 1]),
                    0.05 * np.sin(np.linspace(0.0, 4.0, 81)),
                    0.0,
                    0.03 * np.sin(np.linspace(0.0, 6.0, 81)),
                ),
            ),
            [0, 1, 2, 6],
        )
    ],
)


def translated(robot: sl.Robot, path: sl.Path, velocity: Array, acceleration: Array) -> sl.AnchorMotion:
    """Anchors with a constant acceleration."""
    time = path.time[::20]
    moved = np.outer(time, velocity) + np.outer(0.5 * time**2, acceleration)
    return sl.AnchorMotion(time, robot.frame_anchors + moved[:, None])


def carried(path: sl.Path, velocity: Array, acceleration: Array) -> sl.Path:
    """The path of a platform in a frame with a constant acceleration, seen from the world."""
    pose = sl.Pose.from_quaternion(
        path.pose.position + np.outer(path.time, velocity) + np.outer(0.5 * path.time**2, acceleration),
        path.pose.quaternion,
    )
    twist, rate = path.twist.copy(), path.twist_rate.copy()
    twist[:, :3] += velocity + np.outer(path.time, acceleration)
    rate[:, :3] += acceleration
    return sl.Path(path.time, pose, twist, rate, jerk=path.jerk)


def robots() -> dict[str, sl.Robot]:
    return {
        "cogiro": COGIRO,
        "pulleys": wound(pulley_radius=0.06, dead_cable=3.0, dead_rise=2.0),
        "slanted": COGIRO.replace(winches=sl.Winch(0.05, swivel_axis=(0.6, 0.0, 0.8))),
    }


VELOCITY, ACCELERATION = np.array([3.0, -1.0, 0.5]), np.array([0.7, 0.4, -0.9])


@pytest.mark.parametrize("name", wide(["cogiro", "pulleys", "slanted"]))
def test_anchors_at_constant_velocity_agree_with_a_robot_at_rest(name: str) -> None:
    robot, none = robots()[name], np.zeros(3)
    still = sl.inverse(robot, WAY)
    plan = sl.inverse(robot, carried(WAY, VELOCITY, none), anchors=translated(robot, WAY, VELOCITY, none))
    assert plan.feasible.all()
    np.testing.assert_allclose(plan.unstrained_length, still.unstrained_length, atol=1e-10)
    np.testing.assert_allclose(plan.chord_tension, still.chord_tension, rtol=1e-8)
    assert plan.length_rate is not None
    assert still.length_rate is not None
    most = 1e-8 * np.abs(still.length_rate).max()
    if name != "slanted":  # these rates are those of a spline through the lengths
        np.testing.assert_allclose(plan.length_rate, still.length_rate, atol=2.0 * most)


@pytest.mark.parametrize("name", wide(["cogiro", "pulleys"]))
def test_an_accelerated_frame_agrees_with_an_inertial_force(name: str) -> None:
    robot = robots()[name]
    anchors = translated(robot, WAY, VELOCITY, ACCELERATION)
    plan = sl.inverse(robot, carried(WAY, VELOCITY, ACCELERATION), anchors=anchors)
    wrench = np.concatenate((-robot.mass * ACCELERATION, np.zeros(3)))
    still = sl.inverse(robot, WAY, wrench=wrench)
    np.testing.assert_allclose(plan.unstrained_length, still.unstrained_length, atol=1e-11)
    np.testing.assert_allclose(plan.chord_tension, still.chord_tension, rtol=1e-11)


def test_a_rotating_base_agrees_with_one_robot_per_pose() -> None:
    plan = sl.inverse(COGIRO, WAY, anchors=TURNED)
    each = [COGIRO.replace(frame_anchors=place) for place in TURNED.at(WAY.time)]
    one_by_one = sl.inverse(each, WAY)
    np.testing.assert_array_equal(plan.unstrained_length, one_by_one.unstrained_length)
    np.testing.assert_array_equal(plan.exit_point, one_by_one.exit_point)
    np.testing.assert_array_equal(plan.robot.frame_anchors, TURNED.at(WAY.time[0]))
    assert np.abs(sl.confirm(plan).position_error).max() < 1e-12


@pytest.mark.parametrize("method", wide([sl.MinimumNorm(), sl.Centroid()]), ids=lambda m: type(m).__name__)
@pytest.mark.parametrize("name", ["cogiro", "pulleys"])
def test_rates_agree_with_differences(name: str, method: sl.TensionMethod) -> None:
    robot, step = robots()[name], 2e-4
    fine = sl.septic_path(WAY.pose[np.array([0, -1])], durations=2.0, rate=1.0 / step)
    jerk = fine.jerk
    assert jerk is not None
    index = np.arange(40, len(fine) - 40, 497)

    def part(offset: int) -> sl.Plan:
        at = index + offset
        some = sl.Path(fine.time[at], fine.pose[at], fine.twist[at], fine.twist_rate[at], jerk=jerk[at])
        return sl.inverse(robot, some, tension=method, anchors=TURNED)

    rate = part(0).length_rate
    assert rate is not None
    near = {k: part(k).unstrained_length for k in (-2, -1, 1, 2)}
    central = (4 * (near[1] - near[-1]) / (2 * step) - (near[2] - near[-2]) / (4 * step)) / 3
    np.testing.assert_allclose(rate, central, atol=1e-8 * np.abs(central).max())


def test_rates_of_a_platform_at_rest_below_moving_anchors() -> None:
    time = np.linspace(0.0, 1.0, 101)
    still = sl.path_from_samples(time, np.tile([0.5, 0.2, 2.0], (101, 1)))
    plan = sl.inverse(COGIRO, still, anchors=TURNED)
    rate, expected = plan.length_rate, np.gradient(plan.unstrained_length, time, axis=0, edge_order=2)
    assert rate is not None
    np.testing.assert_allclose(rate[1:-1], expected[1:-1], atol=2e-4)
    assert np.abs(rate).max() > 0.1


def test_a_plan_file_keeps_the_anchors(tmp_path: Path) -> None:
    robot = robots()["pulleys"]
    anchors = translated(robot, WAY, VELOCITY, ACCELERATION)
    plan = sl.inverse(robot, carried(WAY, VELOCITY, ACCELERATION), anchors=anchors)
    plan.save(tmp_path / "plan.nc")
    again = sl.load_plan(tmp_path / "plan.nc")
    assert again.anchors is not None
    np.testing.assert_array_equal(again.anchors.time, anchors.time)
    np.testing.assert_array_equal(again.anchors.position, anchors.position)
    assert plan.length_rate is not None
    assert again.length_rate is not None
    np.testing.assert_array_equal(again.length_rate, plan.length_rate)
    np.testing.assert_array_equal(again.exit_point, plan.exit_point)
    np.testing.assert_array_equal(sl.winch_rates(again).drum_tension, sl.winch_rates(plan).drum_tension)


def test_winches_of_moving_anchors_agree_with_winches_at_rest() -> None:
    robot = robots()["pulleys"]
    plan = sl.inverse(robot, carried(WAY, VELOCITY, np.zeros(3)), anchors=translated(robot, WAY, VELOCITY, np.zeros(3)))
    still, moving = sl.winch_rates(sl.inverse(robot, WAY)), sl.winch_rates(plan)
    np.testing.assert_allclose(moving.drum_tension, still.drum_tension, rtol=1e-8)
    np.testing.assert_allclose(moving.drum_speed, still.drum_speed, atol=1e-6)
    np.testing.assert_allclose(sl.encoder_counts(plan), sl.encoder_counts(sl.inverse(robot, WAY)), atol=1.0)


def guided() -> sl.Robot:
    return COGIRO.replace(winches=sl.Winch(0.05, guides=COGIRO.frame_anchors[:, None] * [1.25, 1.25, 0.5]))


def out_of_plane() -> object:
    plane = sl.Robot(
        "plane",
        [[-2.0, 0.0, 3.0], [2.0, 0.0, 3.0], [0.0, 0.0, 0.0]],
        np.zeros((3, 3)),
        sl.Cable(0.05, 1e5),
        mass=10.0,
        motion_pattern="2T",
        plane_normal=(0, 1, 0),
    )
    path = sl.path_from_samples([0.0, 1.0], [[0.0, 0.0, 1.0], [0.1, 0.0, 1.0]])
    moved = plane.frame_anchors + np.array([[[0.0, 0.0, 0.0]], [[0.0, 0.2, 0.0]]])
    return sl.inverse(plane, path, anchors=sl.AnchorMotion([0.0, 1.0], moved))


def with_anchors(robot: object, motion: object, anchors: object = TURNED) -> sl.Plan:
    return sl.inverse(robot, motion, anchors=anchors)  # type: ignore[arg-type]


REFUSED: dict[str, tuple[Callable[[], object], dict[str, str]]] = {
    "no times": (
        lambda: with_anchors(COGIRO, (0.0, 0.0, 2.0)),
        {"item": "anchors", "value": "given for poses without times"},
    ),
    "several robots": (
        lambda: with_anchors([COGIRO] * len(WAY), WAY),
        {"item": "anchors", "value": "given for several robots"},
    ),
    "too late": (
        lambda: with_anchors(COGIRO, sl.Path(WAY.time + 2.0, WAY.pose, WAY.twist, WAY.twist_rate)),
        {"item": "anchors: time", "value": "4 s", "allowed": "-1 s to 3 s, the samples of anchors"},
    ),
    "other cables": (
        lambda: with_anchors(sl.without_cables(COGIRO, 1), WAY),
        {"item": "anchors", "value": "of 8 cables", "allowed": "7, as cogiro has"},
    ),
    "no motion": (lambda: with_anchors(COGIRO, WAY, COGIRO), {"item": "anchors", "allowed": "an AnchorMotion"}),
    "guides": (lambda: with_anchors(guided(), WAY), {"item": "winches: guides", "allowed": "None with moving anchors"}),
    "out of plane": (out_of_plane, {"item": "anchors", "value": "0.2 m out of the plane"}),
    "viewer": (
        lambda: sl.inverse(COGIRO, WAY, anchors=TURNED).state.one_robot,
        {"item": "robot", "next_step": "Select a single pose: state[i]."},
    ),
}


@pytest.mark.parametrize("name", REFUSED)
def test_unsupported_motions_are_refused(name: str) -> None:
    call, parts = REFUSED[name]
    with refused(**parts):  # type: ignore[arg-type]
        call()
