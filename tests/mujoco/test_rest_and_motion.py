"""Cables of the plug-in in MuJoCo: equal to `sl.forward` at rest and to `sl.simulate` in motion; energy; winches."""

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np
import pytest

import sagline as sl
from sagline.core.arrays import Array
from tests.kinematics.test_underconstrained import suspended
from tests.tiers import wide

COGIRO = sl.load_robot("cogiro")


def middle(robot: sl.Robot) -> sl.Pose:
    assert robot.test_box is not None
    return sl.Pose.from_euler(0.5 * (robot.test_box.low + robot.test_box.high), 0.0, 0.0, 0.0)


def started(spec: Any, step: float | None = None) -> tuple[Any, Any]:
    """Compiled model and data after `mj_forward`; `step`: another time step [s]."""
    model = spec.compile()
    if step is not None:
        model.opt.timestep = step
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return model, data


def pose_of(data: Any) -> sl.Pose:
    w, x, y, z = data.body("platform").xquat
    return sl.Pose.from_quaternion(np.array(data.body("platform").xpos), (x, y, z, w))


def distance(one: sl.Pose, other: sl.Pose) -> tuple[float, float]:
    """Largest difference of positions [m], and angle between orientations [rad]."""
    turn = (one.rotation.inv() * other.rotation).magnitude()
    return float(np.abs(one.position - other.position).max()), float(turn)


def newton_step(model: Any, data: Any, small: float) -> Array:
    """Step to the equilibrium of MuJoCo from its present position, with differences of its forces as stiffness."""
    rest, columns = data.qpos.copy(), []
    force = data.qfrc_passive - data.qfrc_bias
    for i in range(model.nv):
        sides = []
        for sign in (1.0, -1.0):
            data.qpos[:] = rest
            mujoco.mj_integratePos(model, data.qpos, sign * small * np.eye(model.nv)[i], 1.0)
            mujoco.mj_forward(model, data)
            sides.append(data.qfrc_passive - data.qfrc_bias)
        columns.append((sides[0] - sides[1]) / (2.0 * small))
    step: Array = np.linalg.solve(np.array(columns).T, -force)
    return step


@pytest.mark.parametrize("name", sl.robot_names())
def test_at_rest_a_preset_is_where_forward_finds_it(name: str) -> None:
    robot = sl.load_robot(name)
    planned = sl.inverse(robot, middle(robot)).unstrained_length
    lengths = planned * (1.0 + 2e-4 * np.random.default_rng(0).normal(size=robot.cable_count))
    expected = sl.forward(robot, lengths, middle(robot))
    assert distance(expected.pose, middle(robot))[0] > 1e-4
    model, data = started(sl.mujoco.model_of(robot, expected.pose, unstrained_length=lengths))
    np.testing.assert_allclose(data.sensor("tensions").data, expected.state.cables.frame_end_tension, rtol=1e-9)
    size = float(np.ptp(robot.frame_anchors, axis=0).max())
    away = newton_step(model, data, 1e-6 * size)
    assert np.abs(away[:3]).max() < 3e-15 * size
    assert np.abs(away[3:]).max() < 1e-13


@pytest.mark.parametrize("cables", [3, 4])
def test_a_platform_on_few_cables_begins_in_its_equilibrium(cables: int) -> None:
    for radius in (None, 0.03):
        _, data = started(sl.mujoco.model_of(suspended(cables, radius=radius), (0.1, 0.0, 1.0)))
        assert np.abs(data.qacc).max() < 1e-9


def in_plane() -> sl.Robot:
    """Four cables in a vertical plane, to a plate that turns in it."""
    frame = np.array([(-2.0, 0.0, 3.0), (2.0, 0.0, 3.0), (-2.0, 0.0, 0.0), (2.0, 0.0, 0.0)])
    ends = 0.1 * (frame - (0.0, 0.0, 1.5)) * (1.0, 1.0, -1.0)
    return sl.Robot(
        "plate", frame, ends, sl.Cable(0.05, 3e4), 6.0, np.diag([0.1, 0.2, 0.1]), motion_pattern="1R2T",
        plane_normal=(0, 1, 0), center_of_mass=(0.03, 0.0, -0.02), tension_min=5.0, tension_max=400.0,
    )  # fmt: skip


CASES = {
    "cogiro": (COGIRO, (0.0, 0.0, 2.0), None),
    "pulleys": (sl.load_robot("ipanema-3-pulleys"), None, None),
    "losses": (COGIRO, (1.0, 0.5, 2.0), sl.Damping(loss_time=1e-3, air_damping=0.1)),
    "plate": (in_plane(), (0.2, 0.0, 1.4), None),
    "losses over pulleys": (sl.load_robot("ipanema-3-pulleys"), None, sl.Damping(loss_time=1e-3, air_damping=0.1)),
}


@pytest.mark.parametrize("case", CASES)
def test_motion_converges_to_simulate_with_order_four(case: str) -> None:
    robot, place, damping = CASES[case]
    pose = middle(robot) if place is None else sl.Pose.from_euler(place, 0.0, 0.0, 0.0)
    plan, time = sl.inverse(robot, pose), 0.2
    change = 2e-3 * np.random.default_rng(1).normal(size=robot.cable_count)
    run = sl.simulate(
        plan, unstrained_length=plan.unstrained_length + change, duration=time, step=2.5e-5, record=time,
        integrator="runge-kutta", damping=damping,
    )  # fmt: skip
    errors = []
    for step in (1e-3, 5e-4, 2.5e-4):
        model, data = started(sl.mujoco.model_of(robot, pose, damping=damping), step)
        data.ctrl[:] = change
        mujoco.mj_step(model, data, nstep=round(time / step))
        mujoco.mj_forward(model, data)
        tension = np.abs(data.sensor("tensions").data - run.tensions[-1]).max() / run.tensions[-1].max()
        errors.append((*distance(pose_of(data), run.pose[-1]), tension))
    assert distance(run.pose[-1], pose)[0] > 5e-4
    np.testing.assert_allclose(np.log2(np.array(errors)[:-1] / errors[1:]), 4.0, atol=0.3)
    assert max(errors[-1]) < 1e-7
    assert errors[-1][0] < 2e-10


def energy_of_cables(robot: sl.Robot, pose: sl.Pose, lengths: Array) -> float:
    """Strain and weight of the cables [J], from the potential of docs/model.md, section 2."""
    ends = pose.transform(robot.platform_anchors) - robot.frame_anchors
    span, rise, weight = np.hypot(ends[:, 0], ends[:, 1]), ends[:, 2], robot.cables.linear_density * robot.gravity
    state = sl.Catenary().from_length(robot.cables, span, rise, lengths, robot.gravity)
    x, z, w, stiff = state.horizontal_tension, state.vertical_force, weight * lengths, robot.cables.axial_stiffness
    at_frame, total = np.hypot(x, z - w), np.hypot(x, z - w) + np.hypot(x, z)
    mean = at_frame + z * (2.0 * z - w) / total + 2.0 * x**2 / total * np.arctanh(w / total) / (w / total)
    inner = lengths * (x**2 + z**2 - w * z + w**2 / 3.0) / (2.0 * stiff) + 0.5 * lengths * mean
    return float((x * span + z * rise - inner).sum())


@pytest.mark.parametrize("integrator", ["mjINT_RK4", "mjINT_EULER"])
def test_the_energy_does_not_change(integrator: str) -> None:
    plan = sl.inverse(COGIRO, sl.Pose.from_euler((0.5, 0.0, 2.0), 0.0, 0.0, 0.0))
    spec = sl.mujoco.model_of(COGIRO, plan.state.pose, unstrained_length=plan.unstrained_length + 0.01)
    spec.option.enableflags |= mujoco.mjtEnableBit.mjENBL_ENERGY
    spec.option.integrator = getattr(mujoco.mjtIntegrator, integrator)
    model, data = started(spec, 2e-4)
    totals, moved = [], []
    for _ in range(40):
        mujoco.mj_step(model, data, nstep=100)
        mujoco.mj_forward(model, data)
        stored = energy_of_cables(COGIRO, pose_of(data), plan.unstrained_length + 0.01)
        totals.append(stored + data.energy.sum())
        moved.append(data.energy[1])
    assert max(moved) > 1.0
    assert np.ptp(totals) < (1e-7 if integrator == "mjINT_RK4" else 0.02) * max(moved)


def test_a_winch_with_the_dynamics_of_an_integrator_has_a_speed() -> None:
    plan, speed = sl.inverse(COGIRO, (0.0, 0.0, 2.0)), np.linspace(-0.05, 0.08, 8)
    damping, time = sl.Damping(loss_time=2e-3), 0.1
    lengths = (np.array([0.0, time]), plan.unstrained_length + np.array([[0.0], [time]]) * speed)
    run = sl.simulate(plan, unstrained_length=lengths, damping=damping, step=2e-5, record=time)
    spec = sl.mujoco.model_of(COGIRO, (0.0, 0.0, 2.0), damping=damping)
    for winch in spec.actuators:
        winch.dyntype = mujoco.mjtDyn.mjDYN_INTEGRATOR
    model, data = started(spec, 2.5e-4)
    data.ctrl[:] = speed
    mujoco.mj_step(model, data, nstep=round(time / model.opt.timestep))
    mujoco.mj_forward(model, data)
    assert distance(run.pose[-1], plan.state.pose)[0] > 1e-3
    assert distance(pose_of(data), run.pose[-1])[0] < 1e-9
    np.testing.assert_allclose(data.sensor("tensions").data, run.tensions[-1], rtol=1e-6)
    np.testing.assert_array_equal(data.actuator_force, data.sensor("tensions").data)


def test_a_winch_with_the_dynamics_of_a_filter_follows_its_control() -> None:
    plan, change, delay = sl.inverse(COGIRO, (0.0, 0.0, 2.0)), np.linspace(-0.005, 0.008, 8), 0.03
    damping, time = sl.Damping(loss_time=2e-3), np.linspace(0.0, 0.1, 4001)
    lengths = (time, plan.unstrained_length + (1.0 - np.exp(-time / delay))[:, None] * change)
    run = sl.simulate(plan, unstrained_length=lengths, damping=damping, step=2.5e-5, record=0.1)
    spec = sl.mujoco.model_of(COGIRO, (0.0, 0.0, 2.0), damping=damping)
    for winch in spec.actuators:
        winch.dyntype = mujoco.mjtDyn.mjDYN_FILTER
        winch.dynprm[0] = delay
    model, data = started(spec, 2.5e-4)
    data.ctrl[:] = change
    mujoco.mj_step(model, data, nstep=round(0.1 / model.opt.timestep))
    mujoco.mj_forward(model, data)
    assert distance(run.pose[-1], plan.state.pose)[0] > 1e-3
    assert distance(pose_of(data), run.pose[-1])[0] < 1e-8
    np.testing.assert_allclose(data.sensor("tensions").data, run.tensions[-1], rtol=1e-5)


def test_a_limited_control_changes_the_length_up_to_its_limit() -> None:
    found = []
    for control, limited in ((0.02, True), (0.004, False)):
        spec = sl.mujoco.model_of(COGIRO, (0.0, 0.0, 2.0))
        for winch in spec.actuators:
            winch.ctrlrange, winch.ctrllimited = (-0.001, 0.004), limited
        model, data = started(spec)
        data.ctrl[:] = control
        mujoco.mj_step(model, data, nstep=10)
        found.append(data.qpos.copy())
    np.testing.assert_array_equal(*found)


@pytest.mark.parametrize("name", wide(["cogiro", "ipanema-3-pulleys"], first=2))
def test_a_restored_state_continues_with_the_same_bits(name: str) -> None:
    robot = sl.load_robot(name)
    model, data = started(sl.mujoco.model_of(robot, middle(robot)))
    data.ctrl[:] = 1e-3 * np.arange(robot.cable_count)
    mujoco.mj_step(model, data, nstep=20)
    kind = mujoco.mjtState.mjSTATE_INTEGRATION
    state = np.empty(mujoco.mj_stateSize(model, kind))
    mujoco.mj_getState(model, data, state, kind)
    mujoco.mj_step(model, data, nstep=20)
    other = mujoco.MjData(model)
    mujoco.mj_setState(model, other, state, kind)
    mujoco.mj_step(model, other, nstep=20)
    np.testing.assert_array_equal(other.qpos, data.qpos)
    np.testing.assert_array_equal(other.sensordata, data.sensordata)


@pytest.mark.parametrize("name", ["article-mixed", "ipanema-3-pulleys"])
def test_cables_are_drawn_with_their_sag(name: str) -> None:
    robot = sl.load_robot(name)
    plan = sl.inverse(robot, middle(robot))
    model, data = started(sl.mujoco.model_of(robot, middle(robot)))
    scene, camera = mujoco.MjvScene(model, maxgeom=1000), mujoco.MjvCamera()
    every = mujoco.mjtCatBit.mjCAT_ALL
    mujoco.mjv_updateScene(model, data, mujoco.MjvOption(), None, camera, every, scene)
    capsules = [each for each in scene.geoms[: scene.ngeom] if each.type == mujoco.mjtGeom.mjGEOM_CAPSULE]
    ends = np.array([each.pos + each.size[2] * each.mat[:, 2] for each in capsules])
    nodes = ends.reshape(robot.cable_count, -1, 3)[:, -24:]
    points = plan.state.cables.points(25)[:, 1:]  # of the free spans, from their upper ends
    start = plan.state.exit_point
    toward = pose_of(data).transform(robot.platform_anchors) - start
    along = toward[:, None, :2] / np.linalg.norm(toward[:, :2], axis=1)[:, None, None]
    expected = start[:, None] + np.concatenate((points[..., :1] * along, points[..., 1:]), axis=2)
    np.testing.assert_allclose(nodes, expected, atol=2e-6 * np.abs(expected).max())  # drawn in single precision
    assert plan.state.cables.sag.max() > 1e-3
