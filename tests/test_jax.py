"""Functions for JAX, compared with those of sagline and with differences of their results."""

from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import sagline as sl
import sagline.jax as sj
from sagline.core.arrays import Array
from sagline.jax import calls
from tests.refusal import refused
from tests.statics.test_sensitivities import planar
from tests.statics.test_stiffness import richardson
from tests.tiers import extended, wide

jax.config.update("jax_enable_x64", True)
COGIRO = sl.load_robot("cogiro")
WRENCH = np.array([100.0, -50.0, 30.0, 20.0, 10.0, -30.0])


def tight(robot: sl.Robot, pose: sl.Pose, **changes: Any) -> sl.Robot:
    """The robot with a lower limit that is active at the pose."""
    tension = np.sort(sl.inverse(robot, pose, wrench=WRENCH).state.limited_tension)
    return robot.replace(tension_min=0.95 * tension[0] + 0.05 * tension[2], **changes)


POSE = sl.Pose.from_euler([1.0, 1.0, 2.0], 0.1, 0.05, 0.2)
INSIDE = sl.Pose.from_euler([0.3, 0.2, 1.5], 0.05, 0.05, 0.1)
PULLEYS = sl.load_robot("ipanema-2-pulleys")
SLANTED = COGIRO.replace(winches=sl.Winch(0.05, swivel_axis=[0.3, 0.1, 0.94], dead_cable=3.0, dead_rise=1.0))
CASES = {
    "cogiro": (COGIRO, POSE),
    "at a chord tension": (tight(COGIRO, POSE), POSE),
    "at a frame-end tension": (tight(COGIRO, POSE, tension_limits_of="frame_end"), POSE),
    "pulleys, at limits": (PULLEYS, INSIDE),
    "planar": (planar(), sl.Pose((0.4, 0.0, -0.3), Rotation.from_rotvec((0.0, 0.1, 0.0)))),
}

FORWARD = [CASES["cogiro"], CASES["pulleys, at limits"], CASES["planar"], (SLANTED, POSE)]


def close(found: Any, expected: Array) -> None:
    """Derivatives agree to a relative error of 1e-6, measured by the largest."""
    np.testing.assert_allclose(found, expected, rtol=0.0, atol=1e-6 * np.abs(expected).max())


class Shifted:
    """A robot, its pose and lengths after small changes of all inputs."""

    def __init__(self, robot: sl.Robot, pose: sl.Pose) -> None:
        self.robot, self.pose = robot, pose
        self.lengths = np.array(sl.inverse(robot, pose, wrench=WRENCH * self.share).unstrained_length)
        rng = np.random.default_rng(5)
        self.motion = rng.normal(size=6) @ robot.freedom.T @ robot.freedom
        self.force, self.wound = 100.0 * rng.normal(size=6), rng.normal(size=len(self.lengths))
        # a planar robot stays planar
        keep = np.ones(3) if robot.plane_normal is None else 1.0 - np.abs(robot.plane_normal)
        self.frame, self.platform = rng.normal(size=(2, len(self.lengths), 3)) * keep

    @property
    def share(self) -> float:
        """Share of the wrench; zero for a planar robot."""
        return 1.0 if self.robot.plane_normal is None else 0.0

    def at(self, h: float) -> tuple[sl.Robot, Array, Array, sl.Pose]:
        """Robot, lengths, wrench and pose."""
        robot = self.robot.replace(
            frame_anchors=self.robot.frame_anchors + h * self.frame,
            platform_anchors=self.robot.platform_anchors + h * self.platform,
        )
        turn = Rotation.from_rotvec(h * self.motion[3:]) * Rotation.from_quat(np.array(self.pose.quaternion))
        moved = sl.Pose(self.pose.position + h * self.motion[:3], turn)
        return robot, self.lengths + h * self.wound, self.share * WRENCH + h * self.force, moved

    def arguments(self) -> tuple[dict[str, Any], dict[str, Any]]:
        """Arguments of the functions for JAX, and the direction of their changes."""
        anchors = {"frame_anchors": self.robot.frame_anchors, "platform_anchors": self.robot.platform_anchors}
        return (
            {"wrench": self.share * WRENCH, **anchors},
            {"wrench": self.force, "frame_anchors": self.frame, "platform_anchors": self.platform},
        )


@pytest.mark.parametrize(("robot", "pose"), wide(FORWARD, first=1))
def test_forward_has_the_results_and_the_slopes_of_the_forward_kinematics(robot: sl.Robot, pose: sl.Pose) -> None:
    case = Shifted(robot, pose)

    def solve(h: float) -> Array:
        changed, lengths, wrench, _ = case.at(h)
        found = sl.forward(changed, lengths, pose, wrench=wrench)
        assert found.stable
        return np.concatenate((found.pose.position, found.pose.quaternion, found.state.cables.frame_end_tension))

    def of(arguments: dict[str, Any]) -> Any:
        lengths = arguments.pop("lengths")
        return jnp.concatenate(sj.forward(robot, lengths, pose, **arguments))

    arguments, changes = case.arguments()
    arguments["lengths"], changes["lengths"] = case.lengths, case.wound
    found, slope = jax.jit(lambda a, b: jax.jvp(of, (a,), (b,)))(arguments, changes)
    np.testing.assert_allclose(found, solve(0.0), rtol=1e-12, atol=1e-12)
    expected = richardson(solve, 1e-5)
    close(slope[:7], expected[:7])
    close(slope[7:], expected[7:])


@pytest.mark.parametrize(("robot", "pose"), wide(CASES.values(), first=1))
def test_inverse_has_the_results_and_the_slopes_of_the_inverse_kinematics(robot: sl.Robot, pose: sl.Pose) -> None:
    case = Shifted(robot, pose)

    def solve(h: float) -> Array:
        changed, _, wrench, moved = case.at(h)
        found = sl.inverse(changed, moved, wrench=wrench)
        assert found.feasible
        return np.concatenate((found.unstrained_length, found.state.cables.frame_end_tension))

    def of(arguments: dict[str, Any]) -> Any:
        place = sj.Forward(arguments.pop("position"), arguments.pop("quaternion"), None)
        return jnp.concatenate(sj.inverse(robot, place, **arguments))

    arguments, changes = case.arguments()
    arguments |= {"position": pose.position, "quaternion": pose.quaternion}
    turned = 0.5 * (Rotation.from_quat([*case.motion[3:], 0.0]) * Rotation.from_quat(pose.quaternion)).as_quat()
    changes |= {"position": case.motion[:3], "quaternion": np.linalg.norm(case.motion[3:]) * turned}
    found, slope = jax.jit(lambda a, b: jax.jvp(of, (a,), (b,)))(arguments, changes)
    np.testing.assert_allclose(found, solve(0.0), rtol=1e-12, atol=1e-12)
    expected = richardson(solve, 1e-5)
    m = len(case.lengths)
    close(slope[:m], expected[:m])
    close(slope[m:], expected[m:])


@extended
def test_target_tensions_have_the_slopes_of_the_quadratic_program() -> None:
    target = np.linspace(200.0, 900.0, 8)
    rest = sj.inverse(COGIRO, POSE, target=target)
    slopes = jax.jacrev(lambda goal: sj.inverse(COGIRO, POSE, target=goal).unstrained_length)(target)

    def lengths(h: float, i: int) -> Array:
        method = sl.QuadraticProgram(target=target + h * np.eye(8)[i])
        return sl.inverse(COGIRO, POSE, tension=method).unstrained_length

    np.testing.assert_allclose(rest.unstrained_length, lengths(0.0, 0), rtol=1e-12)
    for i in range(8):
        close(slopes[:, i], richardson(lambda h, i=i: lengths(h, i), 1.0))


def test_forward_after_inverse_is_the_identity_in_batches_of_batches() -> None:
    def around(position: Any) -> Any:
        lengths = sj.inverse(COGIRO, sj.Forward(position, POSE.quaternion, None)).unstrained_length
        return sj.forward(COGIRO, lengths, POSE).position

    positions = POSE.position + np.random.default_rng(6).uniform(-0.2, 0.2, (2, 3, 3))
    found, slopes = jax.jit(jax.vmap(jax.vmap(lambda p: (around(p), jax.jacrev(around)(p)))))(positions)
    np.testing.assert_allclose(found, positions, atol=1e-12)
    np.testing.assert_allclose(slopes, np.broadcast_to(np.eye(3), (2, 3, 3, 3)), atol=1e-9)


@extended
def test_batches_of_some_arguments_agree_with_single_calls() -> None:
    rng = np.random.default_rng(7)
    lengths = np.array(sl.inverse(COGIRO, POSE).unstrained_length) + 1e-3 * rng.normal(size=(4, 8))
    wrenches = 50.0 * rng.normal(size=(3, 6))

    def tension(one: Any, wrench: Any) -> Any:
        return sj.forward(COGIRO, one, POSE, wrench).tension

    grid = jax.vmap(jax.vmap(tension, (None, 0)), (0, None))(lengths, wrenches)
    for i, one in enumerate(lengths):
        for j, wrench in enumerate(wrenches):
            found = sl.forward(COGIRO, one, POSE, wrench=wrench)
            np.testing.assert_allclose(grid[i, j], found.state.cables.frame_end_tension, rtol=1e-12)


def test_poses_without_a_solution_are_nan() -> None:
    far = sj.Forward(np.array([30.0, 0.0, 1.0]), POSE.quaternion, None)
    assert np.isnan(np.concatenate(sj.inverse(COGIRO, far))).all()
    broken = sj.forward(COGIRO, np.full(8, np.nan), POSE)
    assert np.isnan(np.concatenate(broken)).all()


def test_slopes_have_a_kink_where_a_limit_becomes_active() -> None:
    rest = sl.inverse(COGIRO, POSE).state.chord_tension
    robot, cable = COGIRO.replace(tension_min=rest.min()), int(np.argmin(rest))

    def tension(load: Any) -> Any:
        return sj.inverse(robot, POSE, jnp.zeros(6).at[2].set(load)).tension[cable]

    slopes = [jax.grad(tension)(load) for load in (-0.1, 0.1)]  # N
    assert sorted(np.abs(slopes))[0] < 1e-2 * sorted(np.abs(slopes))[1]


ONE = "Give one sample; use jax.vmap for a batch."
BAD: dict[str, tuple[Callable[[], object], tuple[str | None, ...]]] = {
    "lengths": (
        lambda: sj.forward(COGIRO, np.ones((3, 8)), POSE),
        ("unstrained_length", "of shape (3, 8)", "shape (8,)", ONE),
    ),
    "wrench": (lambda: sj.inverse(COGIRO, POSE, np.ones(3)), ("wrench", "of shape (3,)", "shape (6,)", ONE)),
    "target": (
        lambda: sj.inverse(COGIRO, POSE, target=np.ones(7)),
        ("target", "of shape (7,)", "shape (8,)", ONE),
    ),
    "batch of poses": (
        lambda: sj.inverse(COGIRO, sl.Pose(np.zeros((2, 3)), np.tile(np.eye(3), (2, 1, 1)))),
        ("quaternion", "of shape (2, 4)", "shape (4,)", ONE),
    ),
    "anchors": (
        lambda: sj.forward(COGIRO, np.ones(8), POSE, frame_anchors=np.ones(8)),
        ("frame_anchors", "of shape (8,)", "shape (8, 3)", ONE),
    ),
    "straight cables": (
        lambda: sj.inverse(COGIRO, POSE, model="straight"),
        ("model", "Straight()", "a cable model with stiffness", "Use Catenary() or Elastic()."),
    ),
    "slanted axes": (
        lambda: sj.inverse(SLANTED, POSE),
        ("winches: swivel_axis[0]", "(0.302, 0.101, 0.948)", "up or down here", None),
    ),
    "robot": (lambda: sj.forward("cogiro", np.ones(8), POSE), ("robot", None, None, None)),  # type: ignore[arg-type]
}


@pytest.mark.parametrize("name", BAD)
def test_bad_arguments_are_refused_in_one_line(name: str) -> None:
    call, parts = BAD[name]
    with refused(*parts):
        call()


def test_single_precision_and_other_back_ends_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    jax.config.update("jax_enable_x64", False)
    try:
        with refused("jax_enable_x64", "False", "True, because poses need double precision"):
            sj.inverse(COGIRO, POSE)
    finally:
        jax.config.update("jax_enable_x64", True)
    calls.register.cache_clear()
    monkeypatch.setattr(calls, "backend", lambda: "python")
    with refused("SAGLINE_BACKEND", "python", "c for sagline.jax"):
        sj.inverse(COGIRO, POSE)


def test_a_call_that_does_not_fit_an_entry_is_an_error_of_jax() -> None:
    sj.inverse(COGIRO, POSE)  # registers the target
    for arguments, reason in (
        (("no_entry", 1.0), "no such entry"),
        (("least_stiffnesses", np.ones((6, 6)), np.ones((1, 6, 6))), "no such entry"),
    ):
        with pytest.raises(jax.errors.JaxRuntimeError, match=reason):
            jax.block_until_ready(calls.call_kernel(*arguments, calls.result_of(1)))
