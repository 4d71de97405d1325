"""Functions for JAX, compared with those of sagline and with differences of their results."""

import doctest
from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import sagline as sl
import sagline.jax as sj
from sagline.core.arrays import Array
from sagline.kernels.forward.sensitivity import least_stiffnesses
from tests.refusal import refused
from tests.shifted import CASES, COGIRO, FORWARD, POSE, SLANTED, Shifted, close
from tests.statics.test_stiffness import richardson
from tests.tiers import extended, wide

jax.config.update("jax_enable_x64", True)


@pytest.mark.parametrize(("robot", "pose"), wide(FORWARD, first=1))
def test_forward_has_the_results_and_the_slopes_of_the_forward_kinematics(robot: sl.Robot, pose: sl.Pose) -> None:
    case = Shifted(robot, pose)

    def of(arguments: dict[str, Any]) -> Any:
        lengths = arguments.pop("lengths")
        return jnp.concatenate(sj.forward(robot, lengths, pose, **arguments))

    arguments, changes = case.arguments_of_forward()
    found, slope = jax.jit(lambda a, b: jax.jvp(of, (a,), (b,)))(arguments, changes)
    np.testing.assert_allclose(found, case.forward(0.0), rtol=1e-12, atol=1e-12)
    expected = richardson(case.forward, 1e-5)
    close(slope[:7], expected[:7])
    close(slope[7:], expected[7:])


@pytest.mark.parametrize(("robot", "pose"), wide(CASES.values(), first=1))
def test_inverse_has_the_results_and_the_slopes_of_the_inverse_kinematics(robot: sl.Robot, pose: sl.Pose) -> None:
    case = Shifted(robot, pose)

    def of(arguments: dict[str, Any]) -> Any:
        place = sj.Forward(arguments.pop("position"), arguments.pop("quaternion"), None)
        return jnp.concatenate(sj.inverse(robot, place, **arguments))

    arguments, changes = case.arguments_of_inverse()
    found, slope = jax.jit(lambda a, b: jax.jvp(of, (a,), (b,)))(arguments, changes)
    np.testing.assert_allclose(found, case.inverse(0.0), rtol=1e-12, atol=1e-12)
    expected = richardson(case.inverse, 1e-5)
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
    far = sj.Forward(np.array([30.0, 0.0, 1.0]), np.array(POSE.quaternion), np.zeros(8))
    infeasible = jax.jit(lambda place: sj.inverse(COGIRO, place))(far)
    broken = jax.jit(lambda lengths: sj.forward(COGIRO, lengths, POSE))(np.full(8, np.nan))
    assert np.isnan(np.concatenate((*infeasible, *broken))).all()


def test_slopes_have_a_kink_where_a_limit_becomes_active() -> None:
    rest = sl.inverse(COGIRO, POSE).state.chord_tension
    robot, cable = COGIRO.replace(tension_min=rest.min()), int(np.argmin(rest))

    def tension(load: Any) -> Any:
        return sj.inverse(robot, POSE, jnp.zeros(6).at[2].set(load)).tension[cable]

    slope = jax.jit(jax.grad(tension))  # one compilation instead of one per operation
    slopes = [slope(load) for load in (-0.1, 0.1)]  # N
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
    sj.register.cache_clear()
    monkeypatch.setattr(sj, "backend", lambda: "python")
    with refused("SAGLINE_BACKEND", "python", "c for sagline.jax"):
        sj.inverse(COGIRO, POSE)


def test_a_call_that_does_not_fit_an_entry_is_an_error_of_jax() -> None:
    sj.inverse(COGIRO, POSE)  # registers the target

    def no_entry() -> None:
        """Not a kernel."""

    reason = "no such entry"
    for entry, *arguments in ((no_entry, 1.0), (least_stiffnesses, np.ones((6, 6)), np.ones((1, 6, 6)))):
        with pytest.raises(jax.errors.JaxRuntimeError, match=reason):
            jax.block_until_ready(sj.ffi_call(entry, *arguments, sj.NewArray((1,))))


@extended
def test_the_examples_of_the_docstrings_print_what_they_say() -> None:
    assert doctest.testmod(sj) == (0, 15)
