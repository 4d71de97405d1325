"""Models in MuJoCo: they stay finite and come to rest at the equilibrium of straight springs."""

import mujoco
import numpy as np
import pytest
from scipy.linalg import eigh

from sagline import Cable, Elastic, Pose, Robot, dump_mjcf, forward, inverse, load_robot, modes, robot_names
from sagline.core.arrays import Array
from sagline.files.mjcf import step_and_damping
from tests.tiers import extended

pytestmark = extended


def opened(text: str) -> tuple[mujoco.MjModel, mujoco.MjData]:
    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return model, data


def middle(robot: Robot) -> Pose:
    assert robot.test_box is not None
    return Pose.from_euler(0.5 * (robot.test_box.low + robot.test_box.high), 0.0, 0.0, 0.0)


def run(model: mujoco.MjModel, data: mujoco.MjData, seconds: float) -> None:
    for _ in range(round(seconds / model.opt.timestep)):
        mujoco.mj_step(model, data)
    assert np.isfinite(data.qpos).all()
    assert data.time == pytest.approx(seconds, rel=1e-2)  # MuJoCo starts again after a number that is not finite


def frequencies(model: mujoco.MjModel, data: mujoco.MjData, step: float) -> Array:
    """Natural frequencies [Hz] from the mass matrix of MuJoCo and differences of its forces."""
    mass = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, mass)
    rest, columns = data.qpos.copy(), []
    for i in range(model.nv):
        forces = []
        for sign in (1.0, -1.0):
            data.qpos[:], data.qvel[:] = rest, 0.0
            mujoco.mj_integratePos(model, data.qpos, sign * np.eye(model.nv)[i], step)
            mujoco.mj_forward(model, data)
            forces.append(data.qfrc_passive - data.qfrc_bias)
        columns.append((forces[1] - forces[0]) / (2.0 * step))
    stiffness = np.array(columns)
    squares: Array = eigh(0.5 * (stiffness + stiffness.T), mass, eigvals_only=True)
    return np.sqrt(squares) / (2.0 * np.pi)


@pytest.mark.parametrize("name", robot_names())
def test_a_preset_comes_to_rest_at_the_equilibrium_of_straight_cables(name: str) -> None:
    robot = load_robot(name)
    pose = middle(robot)
    planned = inverse(robot, pose, model=Elastic()).unstrained_length
    lengths = planned * (1.0 + 2e-4 * np.random.default_rng(0).normal(size=robot.cable_count))
    expected = forward(robot, lengths, start=pose, model=Elastic())
    away = float(np.linalg.norm(expected.pose.position - pose.position))
    assert away > 1e-4
    model, data = opened(dump_mjcf(robot, pose, lengths))
    run(model, data, 100.0 if name == "fast" else 10.0)
    np.testing.assert_allclose(data.qpos[:3], expected.pose.position, atol=1e-5 * away)
    assert np.abs(data.qvel).max() < 1e-5 * away


@pytest.mark.parametrize("name", robot_names())
def test_frequencies_and_masses_agree_with_the_robot(name: str) -> None:
    robot = load_robot(name)
    pose = middle(robot)
    model, data = opened(dump_mjcf(robot, pose))
    size = float(np.linalg.norm(np.ptp(robot.frame_anchors, axis=0)))
    found = frequencies(model, data, 1e-7 * size)
    expected = modes(inverse(robot, pose, model=Elastic()).state).frequency
    np.testing.assert_allclose(found, expected, rtol=1e-4)
    assert model.opt.timestep <= 0.05 / expected.max()
    assert model.opt.timestep >= min(0.002, 0.01 / expected.max())  # and not shorter than useful
    assert model.body_mass.sum() == robot.mass
    np.testing.assert_allclose(np.sort(model.body_inertia[1]), np.linalg.eigvalsh(robot.inertia), rtol=1e-9)


@pytest.mark.parametrize("name", robot_names())
def test_the_platform_is_drawn_in_its_size(name: str) -> None:
    robot = load_robot(name)
    model, _ = opened(dump_mjcf(robot, middle(robot)))
    low, high = robot.platform_anchors.min(axis=0), robot.platform_anchors.max(axis=0)
    drawn = 2.0 * model.geom_size[0]
    expected = high - low if robot.platform_size is None else robot.platform_size
    thick = expected > 0.05 * expected.max()
    np.testing.assert_allclose(drawn[thick], expected[thick], rtol=1e-12)
    assert (drawn >= 0.01 * expected.max()).all()
    np.testing.assert_allclose(model.geom_pos[0], 0.5 * (low + high), atol=1e-12)


def any_robot(random: np.random.Generator) -> Robot:
    """A robot of any size, mass and stiffness, with few or many cables."""
    size, mass = 10.0 ** random.uniform(-1.0, 2.0), 10.0 ** random.uniform(-2.0, 4.0)
    count = int(random.integers(3, 13))
    reach = size * 10.0 ** random.uniform(-2.0, -0.5)
    frame = size * random.uniform(-1.0, 1.0, (count, 3)) + (0.0, 0.0, 2.0 * size)
    edges = reach * random.uniform(0.1, 1.0, 3)
    inertia = mass * np.diag(edges @ edges - edges**2) / 3.0
    stiffness = mass * 9.81 * 10.0 ** random.uniform(1.5, 4.5)
    return Robot(
        "any", frame, edges * random.uniform(-1.0, 1.0, (count, 3)), Cable(1e-3 * mass / size, stiffness), mass, inertia
    )


def assert_it_stays_finite(seed: int) -> None:
    random = np.random.default_rng(seed)
    robot = any_robot(random)
    pose = Pose.from_euler(np.zeros(3), *random.uniform(-0.3, 0.3, 3))
    distance = np.linalg.norm(pose.transform(robot.platform_anchors) - robot.frame_anchors, axis=1)
    model, data = opened(dump_mjcf(robot, pose, distance * random.uniform(0.999, 1.01, robot.cable_count)))
    size = float(np.ptp(robot.frame_anchors, axis=0).max())
    data.qvel[:3] = 0.1 * np.sqrt(9.81 * size) * random.uniform(-1.0, 1.0, 3)
    period = np.sqrt(size / 9.81)
    run(model, data, max(1000, round(10.0 * period / model.opt.timestep)) * model.opt.timestep)
    assert np.abs(data.qvel[:3]).max() < 3.0 * np.sqrt(9.81 * size)  # no energy is generated


@pytest.mark.parametrize("seed", range(30))
def test_any_robot_stays_finite_after_an_impulse(seed: int) -> None:
    assert_it_stays_finite(seed)


@pytest.mark.soak
def test_a_thousand_robots_stay_finite_after_an_impulse() -> None:
    for seed in range(1000, 2000):
        assert_it_stays_finite(seed)


def test_a_swinging_platform_comes_to_rest() -> None:
    corners = np.array([[20, 15, 12], [-20, 15, 12], [-20, -15, 12], [20, -15, 12.0]])
    camera = Robot("camera", corners, 0.01 * corners, Cable(0.03, 2e5), 25.0, np.eye(3), center_of_mass=(0, 0, -0.3))
    lengths = [21.0, 24.0, 29.5, 27.0]
    expected = forward(camera, lengths, model=Elastic())
    model, data = opened(dump_mjcf(camera, expected.pose, lengths))
    data.qvel[:3] = (0.5, 0.0, 0.0)
    run(model, data, 120.0)
    np.testing.assert_allclose(data.qpos[:3], expected.pose.position, atol=1e-6)
    assert np.abs(data.qvel).max() < 1e-6


@pytest.mark.parametrize("moments", [(0.1, 0.7, 0.8), (0.8, 0.7, 0.1), (1.0, 2.0, 3.0)])
def test_a_flat_platform_is_accepted(moments: tuple[float, float, float]) -> None:
    robot = load_robot("article-suspended").replace(inertia=np.diag(moments))
    model, _ = opened(dump_mjcf(robot, middle(robot)))
    np.testing.assert_allclose(np.sort(model.body_inertia[1]), np.sort(moments), rtol=1e-11)


def test_a_plane_needs_the_moment_about_its_normal_only() -> None:
    flat = [(-2, 0, 3), (2, 0, 3), (-2, 0, 0), (2, 0, 0)]
    robot = Robot(
        "slice",
        flat,
        0.1 * np.array(flat),
        Cable(0.01, 3e4),
        6.0,
        np.diag([0.01, 0.2, 0.01]),  # impossible for a body, and without effect on a platform that rotates about y only
        motion_pattern="1R2T",
        plane_normal=(0, 1, 0),
    )
    model, data = opened(dump_mjcf(robot, Pose.from_euler((0.1, 0.0, 1.0), 0.0, 0.1, 0.0), [2.0] * 4))
    mass = np.zeros((3, 3))
    mujoco.mj_fullM(model, data, mass)
    np.testing.assert_allclose(np.sort(np.linalg.eigvalsh(mass)), [0.2, 6.0, 6.0], rtol=1e-9)


def test_a_platform_end_at_its_frame_end_is_accepted() -> None:
    frame = np.array([(-1.0, -1.0, 2.0), (1.0, -1.0, 2.0), (0.0, 1.0, 2.0)])
    bob = Robot("bob", frame, np.zeros((3, 3)), Cable(0.01, 2e4), 2.0, motion_pattern="3T")
    model, data = opened(dump_mjcf(bob, Pose.from_euler(frame[0], 0.0, 0.0, 0.0), [1e-6, 2.0, 2.0]))
    run(model, data, 0.01)


def test_no_written_step_is_longer_than_the_robot_allows() -> None:
    robot, generator = load_robot("cogiro"), np.random.default_rng(5)
    pose, lengths = middle(robot), np.full(robot.cable_count, 10.0)
    for factor in 10.0 ** generator.uniform(0.0, 6.0, 50):
        stiff = robot.replace(cables=Cable(robot.cables.linear_density, factor * robot.cables.axial_stiffness))
        written = opened(dump_mjcf(stiff, pose, lengths))[0].opt.timestep
        allowed, _, _ = step_and_damping(stiff, pose, stiff.cables.axial_stiffness / lengths)
        assert 0.9 * allowed < written <= allowed * (1.0 + 1e-15)
