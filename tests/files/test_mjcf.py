from __future__ import annotations

import re
from itertools import product
from typing import TYPE_CHECKING

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from syrupy.assertion import SnapshotAssertion

from sagline import (
    Cable,
    CableGeometryError,
    Elastic,
    InvalidValueError,
    Pose,
    Robot,
    Winch,
    dump_mjcf,
    forward,
    inverse,
    load_robot,
)
from sagline.core.arrays import Array
from tests.refusal import refused
from tests.tiers import extended, wide

if TYPE_CHECKING:
    import mujoco

POSE = Pose.from_euler((1.0, -0.5, 2.0), 0.1, -0.05, 0.08)
STEPS = 12_000


def opened(text: str) -> tuple[mujoco.MjModel, mujoco.MjData]:
    import mujoco

    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return model, data


def rest_state(text: str) -> mujoco.MjData:
    """The state in which the platform of MuJoCo comes to rest after damped motion."""
    import mujoco

    model, data = opened(text)
    model.dof_damping[:] = 3.0 * model.dof_M0  # 1/s of the mass or moment of each motion: equal decay of all motions
    for _ in range(STEPS):
        mujoco.mj_step(model, data)
    assert np.abs(data.qvel).max() < 1e-9
    return data


def rotation_of(data: mujoco.MjData) -> Rotation:
    w, x, y, z = data.qpos[3:]
    return Rotation.from_quat((x, y, z, w))


@pytest.mark.parametrize("name", wide(["article-suspended", "ipanema-1"]))
def test_planned_lengths_keep_the_platform_at_rest(name: str) -> None:
    robot = load_robot(name)
    assert robot.test_box is not None
    pose = Pose.from_euler(0.5 * (robot.test_box.low + robot.test_box.high), 0.05, 0.02, -0.03)
    plan = inverse(robot, pose, model=Elastic())
    model, data = opened(dump_mjcf(robot, pose))
    np.testing.assert_allclose(data.ten_length, np.hypot(plan.state.cables.span, plan.state.cables.rise), rtol=1e-14)
    pull = model.tendon_stiffness * (data.ten_length - plan.unstrained_length)
    np.testing.assert_allclose(pull, plan.chord_tension, rtol=1e-9)
    np.testing.assert_allclose(data.qacc, 0.0, atol=1e-9)


def test_other_lengths_lead_to_the_equilibrium_of_the_elastic_model() -> None:
    robot = load_robot("article-suspended")
    lengths = inverse(robot, POSE, model=Elastic()).unstrained_length * np.linspace(0.985, 1.005, 8)
    expected = forward(robot, lengths, start=POSE, model=Elastic())
    assert expected.solved
    assert np.linalg.norm(expected.pose.position - POSE.position) > 0.05  # it has moved and rotated
    data = rest_state(dump_mjcf(robot, POSE, lengths))
    np.testing.assert_allclose(data.qpos[:3], expected.pose.position, atol=1e-7)
    turn = expected.pose.rotation.inv() * rotation_of(data)
    assert turn.magnitude() < 1e-7


def test_mass_and_inertia_agree_with_the_robot() -> None:
    inertia = np.array([[1.2, 0.1, -0.2], [0.1, 1.5, 0.3], [-0.2, 0.3, 2.0]])
    robot = load_robot("article-suspended").replace(inertia=inertia, center_of_mass=(0.1, -0.05, 0.02), mass=12.0)
    model, _ = opened(dump_mjcf(robot, POSE, [7.0] * 8))
    w, x, y, z = model.body("platform").iquat
    principal = Rotation.from_quat((x, y, z, w)).as_matrix()
    np.testing.assert_allclose(principal @ np.diag(model.body("platform").inertia) @ principal.T, inertia, atol=1e-12)
    np.testing.assert_allclose(model.body("platform").ipos, (0.1, -0.05, 0.02), atol=1e-15)
    assert model.body("platform").mass == 12.0


@extended
def test_a_slack_cable_does_not_push() -> None:
    robot = load_robot("article-suspended")
    lengths = inverse(robot, POSE, model=Elastic()).unstrained_length + np.array([0.0, 0, 0, 0.5, 0, 0, 0, 0])
    model, data = opened(dump_mjcf(robot, POSE, lengths))
    taut = model.tendon_lengthspring[:, 1] < data.ten_length
    assert taut.tolist() == [True] * 3 + [False] + [True] * 4
    expected = forward(robot, lengths, start=POSE, model=Elastic())
    data = rest_state(dump_mjcf(robot, POSE, lengths))
    np.testing.assert_allclose(data.qpos[:3], expected.pose.position, atol=1e-7)


def planar() -> Robot:
    return Robot(
        "slice -- one",  # an XML comment must not contain two hyphens
        [(-2, 0.3, 3), (2, 0.3, 3), (-2, 0.3, 0), (2, 0.3, 0)],
        [(-0.2, 0, 0.1), (0.2, 0, 0.1), (-0.2, 0, -0.1), (0.2, 0, -0.1)],
        Cable(0.01, 3e4),
        6.0,
        np.diag([0.1, 0.2, 0.1]),
        center_of_mass=(0.02, 0.0, -0.01),
        motion_pattern="1R2T",
        plane_normal=(0, 1, 0),
        tension_min=5.0,
        tension_max=500.0,
    )


def test_a_planar_platform_with_a_rotation() -> None:
    robot, pose = planar(), Pose.from_euler((0.2, 0.3, 1.4), 0.3, -0.1, 0.0)
    lengths = inverse(robot, pose, model=Elastic()).unstrained_length * np.array([0.99, 1.0, 1.001, 0.995])
    expected = forward(robot, lengths, start=pose, model=Elastic())
    assert expected.solved
    data = rest_state(dump_mjcf(robot, pose, lengths))
    platform = data.body("platform")
    np.testing.assert_allclose(platform.xpos, expected.pose.position, atol=1e-7)
    np.testing.assert_allclose(platform.xmat.reshape(3, 3), expected.pose.rotation.as_matrix(), atol=1e-7)


@extended
def test_a_point_mass_only_translates() -> None:
    robot = Robot(
        "bob",
        [(-1, -1, 2), (1, -1, 2), (0, 1, 2)],
        np.zeros((3, 3)),
        Cable(0.01, 2e4),
        2.0,
        motion_pattern="3T",
        tension_max=300.0,
    )
    pose = Pose.from_euler((0.1, 0.0, 1.0), 0.0, 0.0, 0.0)
    lengths = inverse(robot, pose, model=Elastic()).unstrained_length * np.array([1.0, 1.01, 0.99])
    expected = forward(robot, lengths, start=pose, model=Elastic())
    data = rest_state(dump_mjcf(robot, pose, lengths))
    np.testing.assert_allclose(data.body("platform").xpos, expected.pose.position, atol=1e-7)


@pytest.mark.parametrize(
    ("pose", "lengths", "parts"),
    [
        (Pose.from_euler(np.zeros((2, 3)), 0, 0, 0), None, ("pose", "a batch of 2")),
        (Pose.from_euler((0, 0, 20.0), 0, 0, 0), None, ("article-suspended at (0, 0, 20) m",)),
        (POSE, [1.0] * 7, ("unstrained_length", "of shape (7,)")),
        (POSE, [1.0] * 7 + [0.0], ("unstrained_length[7]", "0 m")),
    ],
)
def test_refusals(pose: Pose, lengths: list[float] | None, parts: tuple[str, ...]) -> None:
    with refused(*parts, kind=InvalidValueError):
        dump_mjcf(load_robot("article-suspended"), pose, lengths)


def sentences(text: str, word: str) -> list[str]:
    """Sentences of the comment that contain a word."""
    (comment,) = re.findall("<!--(.*?)-->", text, re.DOTALL)
    return [sentence for sentence in " ".join(comment.split()).split(". ") if word in sentence]


def test_the_file_lists_omitted_data(snapshot: SnapshotAssertion) -> None:
    assert sentences(dump_mjcf(load_robot("article-suspended"), POSE), "sag,") == snapshot


OVER_PULLEYS = load_robot("article-suspended").replace(
    winches=Winch(
        pulley_radius=[0.1, 0.2, 0.3, 0.0, 0.1, 0.2, 0.3, 0.15],
        swivel_axis=[[0, 0, 1]] * 5 + [[0, 0, -1]] * 3,
        dead_cable=[3.0, 0.0, 4.0, 2.0, 0.0, 3.0, 0.1, 3.0],
    )
)


@pytest.mark.parametrize("seed", wide(range(5)))
def test_forces_and_stiffness_over_pulleys_agree_with_swivelling_pulleys(seed: int) -> None:
    """Forces to rounding; the rest position with other lengths to the square of its distance."""
    random = np.random.default_rng(seed)
    pose = Pose.from_euler(random.uniform((-3.0, -2.0, 0.5), (3.0, 2.0, 4.0)), *random.uniform(-0.15, 0.15, 3))
    plan = inverse(OVER_PULLEYS, pose, model=Elastic())
    assert plan.feasible
    model, data = opened(dump_mjcf(OVER_PULLEYS, pose))
    pull = model.tendon_stiffness * (data.ten_length - model.tendon_lengthspring[:, 1])
    np.testing.assert_allclose(pull, plan.chord_tension, rtol=1e-9)
    np.testing.assert_allclose(model.tendon_stiffness, 44e3 / plan.unstrained_length, rtol=1e-14)
    np.testing.assert_allclose(data.qacc, 0.0, atol=1e-7)
    np.testing.assert_array_equal(data.ten_wrapnum == 4, OVER_PULLEYS.winches.pulley_radius > 0.0)  # type: ignore[union-attr]
    lengths = plan.unstrained_length * (1.0 + 1e-5 * random.normal(size=8))
    expected = forward(OVER_PULLEYS, lengths, start=pose, model=Elastic())
    away = float(np.linalg.norm(expected.pose.position - pose.position))
    assert away > 1e-5
    data = rest_state(dump_mjcf(OVER_PULLEYS, pose, lengths))
    np.testing.assert_allclose(data.qpos[:3], expected.pose.position, atol=1e-4 * away)


@extended
def test_length_errors_over_pulleys_are_small_nearby_and_millimeters_in_corners() -> None:
    """Length errors of fixed cylinders, which do not swivel, of ipanema-2-pulleys, and of fixed exit points."""
    import mujoco

    robot = load_robot("ipanema-2-pulleys")
    box = robot.test_box
    assert box is not None
    middle, half = 0.5 * (box.low + box.high), 0.5 * (box.high - box.low)
    model, data = opened(dump_mjcf(robot, Pose(middle, np.eye(3))))
    plan = inverse(robot, Pose(middle, np.eye(3)), model=Elastic())
    lengths, exits = plan.unstrained_length, plan.exit_point
    assert plan.wrap_angle is not None
    for share, most, fixed in ((0.1, 0.013e-3, 0.70e-3), (1.0, 10.0e-3, 77e-3)):
        worst, left = 0.0, 0.0
        for corner in product((-1.0, 1.0), repeat=3):
            pose = Pose(middle + share * half * corner, np.eye(3))
            data.qpos[:3], data.qpos[3:] = pose.position, (1.0, 0.0, 0.0, 0.0)
            mujoco.mj_forward(model, data)
            ends = pose.transform(robot.platform_anchors)
            taut = tangent_lengths(ends - robot.frame_anchors, 0.25)
            off = data.ten_length - model.tendon_lengthspring[:, 1] + lengths - taut
            worst = max(worst, float(np.abs(off).max()))
            stays = np.linalg.norm(ends - exits, axis=1) + 0.25 * plan.wrap_angle
            left = max(left, float(np.abs(stays - taut).max()))
        assert worst == pytest.approx(most, rel=0.01)
        assert left == pytest.approx(fixed, rel=0.01)


def tangent_lengths(reach: Array, radius: float) -> Array:
    """Length from the entry on a pulley to a point: arc and tangent, by the angles of a right triangle."""
    across, up = np.hypot(reach[:, 0], reach[:, 1]) - radius, reach[:, 2]
    distance = np.hypot(across, up)
    touches = np.arctan2(up, across) + np.arccos(radius / distance)  # angle of the radius there, from level outward
    return np.asarray(radius * (np.pi - touches) + np.sqrt(distance**2 - radius**2))


def test_a_platform_end_in_a_pulley_is_refused() -> None:
    robot = load_robot("article-suspended").replace(winches=Winch(pulley_radius=0.2))
    place = robot.frame_anchors[3] - robot.platform_anchors[3] + np.array([0.1, 0.1, -1.0])
    with pytest.raises(CableGeometryError, match=r"cable 2: .* pulley"):
        dump_mjcf(robot, Pose(place, np.eye(3)), [9.0] * 8)
    with refused(
        "cable 2: unstrained length", "4 m", "> 4 m, the dead length between drum and pulley", kind=InvalidValueError
    ):
        dump_mjcf(OVER_PULLEYS, POSE, [9.0, 9.0, 4.0, 9.0, 9.0, 9.0, 9.0, 9.0])


def test_the_file_states_the_errors_of_pulleys(snapshot: SnapshotAssertion) -> None:
    assert sentences(dump_mjcf(OVER_PULLEYS, POSE), "pulleys") == snapshot
    assert "pulleys" not in dump_mjcf(load_robot("article-suspended"), POSE)
