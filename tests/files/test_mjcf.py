import mujoco
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from sagline.cables.cable import Cable
from sagline.cables.elastic import Elastic
from sagline.errors import InvalidValueError
from sagline.files.mjcf import dump_mjcf
from sagline.files.robot_file import load_robot
from sagline.kinematics.forward import forward
from sagline.kinematics.inverse import inverse
from sagline.robot.pose import Pose
from sagline.robot.robot import Robot

POSE = Pose.from_euler((1.0, -0.5, 2.0), 0.1, -0.05, 0.08)
STEPS = 12_000


def opened(text: str) -> tuple[mujoco.MjModel, mujoco.MjData]:
    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return model, data


def settled(text: str) -> mujoco.MjData:
    """The state in which MuJoCo's platform comes to rest, by letting it swing out."""
    model, data = opened(text)
    model.dof_damping[:] = 3.0 * model.dof_M0  # 1/s of each motion's mass or moment: no motion lags
    for _ in range(STEPS):
        mujoco.mj_step(model, data)
    assert np.abs(data.qvel).max() < 1e-9
    return data


def rotation_of(data: mujoco.MjData) -> Rotation:
    w, x, y, z = data.qpos[3:]
    return Rotation.from_quat((x, y, z, w))


@pytest.mark.parametrize("name", ["article-suspended", "ipanema-1"])
def test_planned_lengths_hold_the_platform_where_it_is(name: str) -> None:
    robot = load_robot(name)
    assert robot.test_box is not None
    pose = Pose.from_euler(0.5 * (robot.test_box.low + robot.test_box.high), 0.05, 0.02, -0.03)
    plan = inverse(robot, pose, model=Elastic())
    model, data = opened(dump_mjcf(robot, pose))
    np.testing.assert_allclose(data.ten_length, np.hypot(plan.state.cables.span, plan.state.cables.rise), rtol=1e-14)
    pull = model.tendon_stiffness * (data.ten_length - plan.unstrained_length)
    np.testing.assert_allclose(pull, plan.chord_tension, rtol=1e-9)
    np.testing.assert_allclose(data.qacc, 0.0, atol=1e-9)


def test_other_lengths_settle_in_the_equilibrium_of_the_elastic_model() -> None:
    robot = load_robot("article-suspended")
    lengths = inverse(robot, POSE, model=Elastic()).unstrained_length * np.linspace(0.985, 1.005, 8)
    expected = forward(robot, lengths, start=POSE, model=Elastic())
    assert expected.solved
    assert np.linalg.norm(expected.pose.position - POSE.position) > 0.05  # it has moved, and turned
    data = settled(dump_mjcf(robot, POSE, lengths))
    np.testing.assert_allclose(data.qpos[:3], expected.pose.position, atol=1e-7)
    turn = expected.pose.rotation.inv() * rotation_of(data)
    assert turn.magnitude() < 1e-7


def test_mass_and_inertia_are_the_robots() -> None:
    inertia = np.array([[1.2, 0.1, -0.2], [0.1, 1.5, 0.3], [-0.2, 0.3, 2.0]])
    robot = load_robot("article-suspended").replace(inertia=inertia, center_of_mass=(0.1, -0.05, 0.02), mass=12.0)
    model, _ = opened(dump_mjcf(robot, POSE, [7.0] * 8))
    w, x, y, z = model.body("platform").iquat
    principal = Rotation.from_quat((x, y, z, w)).as_matrix()
    np.testing.assert_allclose(principal @ np.diag(model.body("platform").inertia) @ principal.T, inertia, atol=1e-12)
    np.testing.assert_allclose(model.body("platform").ipos, (0.1, -0.05, 0.02), atol=1e-15)
    assert model.body("platform").mass == 12.0


def test_a_slack_cable_does_not_push() -> None:
    robot = load_robot("article-suspended")
    lengths = inverse(robot, POSE, model=Elastic()).unstrained_length + np.array([0.0, 0, 0, 0.5, 0, 0, 0, 0])
    model, data = opened(dump_mjcf(robot, POSE, lengths))
    taut = model.tendon_lengthspring[:, 1] < data.ten_length
    assert taut.tolist() == [True] * 3 + [False] + [True] * 4
    expected = forward(robot, lengths, start=POSE, model=Elastic())
    data = settled(dump_mjcf(robot, POSE, lengths))
    np.testing.assert_allclose(data.qpos[:3], expected.pose.position, atol=1e-7)


def planar() -> Robot:
    return Robot(
        "slice -- one",  # two hyphens would end an XML comment
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


def test_a_planar_platform_turned_out_of_line() -> None:
    robot, pose = planar(), Pose.from_euler((0.2, 0.3, 1.4), 0.3, -0.1, 0.0)
    lengths = inverse(robot, pose, model=Elastic()).unstrained_length * np.array([0.99, 1.0, 1.001, 0.995])
    expected = forward(robot, lengths, start=pose, model=Elastic())
    assert expected.solved
    data = settled(dump_mjcf(robot, pose, lengths))
    platform = data.body("platform")
    np.testing.assert_allclose(platform.xpos, expected.pose.position, atol=1e-7)
    np.testing.assert_allclose(platform.xmat.reshape(3, 3), expected.pose.rotation.as_matrix(), atol=1e-7)


def test_a_point_mass_slides_only() -> None:
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
    data = settled(dump_mjcf(robot, pose, lengths))
    np.testing.assert_allclose(data.body("platform").xpos, expected.pose.position, atol=1e-7)


@pytest.mark.parametrize(
    ("pose", "lengths", "message"),
    [
        (Pose.from_euler(np.zeros((2, 3)), 0, 0, 0), None, "pose is a batch of 2"),
        (Pose.from_euler((0, 0, 20.0), 0, 0, 0), None, "no tensions within the limits"),
        (POSE, [1.0] * 7, r"unstrained_length is of shape \(7,\)"),
        (POSE, [1.0] * 7 + [0.0], r"unstrained_length\[7\] is 0 m"),
    ],
)
def test_what_is_refused(pose: Pose, lengths: list[float] | None, message: str) -> None:
    with pytest.raises(InvalidValueError, match=message):
        dump_mjcf(load_robot("article-suspended"), pose, lengths)


def test_the_file_says_what_is_not_in_it() -> None:
    text = dump_mjcf(load_robot("article-suspended"), POSE)
    assert "Its sag, its weight and the tension limits are not in this model." in text
