"""The null space of lengths compared with equilibria of changed lengths."""

from functools import cache

import numpy as np
import pytest

import sagline as sl
from sagline.control.null_space import NullSpace, null_space
from sagline.core.arrays import Array
from tests.control.stops import PROTOTYPE, stops
from tests.kinematics.feasible import feasible_plan

STEP = 1e-4  # m


@cache
def cogiro() -> sl.Plan:
    return feasible_plan(sl.load_robot("cogiro"), 3, seed=4)


PLANS = {"prototype": stops, "cogiro": cogiro}


def changed(state: sl.Equilibrium, change: Array) -> sl.Equilibrium:
    solution = sl.forward(state.robot, state.unstrained_length + change, start=state.pose)
    assert solution.stable.all()
    return solution.state


def slope(state: sl.Equilibrium, direction: Array) -> tuple[Array, Array]:
    """Motion of the platform origin and change of T_A for a meter along a direction, from two equilibria."""
    low, high = (changed(state, sign * STEP * direction) for sign in (-1.0, 1.0))
    moved = (high.pose.position - low.pose.position) / (2.0 * STEP)
    tension = (high.cables.frame_end_tension - low.cables.frame_end_tension) / (2.0 * STEP)
    return moved, tension


@pytest.mark.parametrize("name", PLANS)
def test_projected_lengths_do_not_move_the_platform(name: str) -> None:
    state = PLANS[name]().state
    direction = np.random.default_rng(1).normal(size=state.unstrained_length.shape)
    inside = (null_space(state).projection @ direction[..., None])[..., 0]
    still, _ = slope(state, inside)
    moving, _ = slope(state, direction)
    assert np.abs(still).max() < 1e-5
    assert np.abs(moving).max(axis=-1).min() > 0.05


@pytest.mark.parametrize("name", PLANS)
def test_the_correction_is_exactly_the_visible_error(name: str) -> None:
    state = PLANS[name]().state
    error = 5.0 * np.random.default_rng(2).normal(size=state.unstrained_length.shape)
    known = null_space(state)
    change = -(known.correction @ error[..., None])[..., 0]
    _, tension = slope(state, change)
    np.testing.assert_allclose(tension, -(known.visible @ error[..., None])[..., 0], atol=1e-3)


@pytest.mark.parametrize("name", PLANS)
def test_the_visible_error_is_a_projection_along_the_wrench(name: str) -> None:
    """Rank 2, idempotent, symmetric; the removed part is orthogonal to the effects of lengths."""
    known = null_space(PLANS[name]().state)
    visible = known.visible
    np.testing.assert_allclose(visible @ visible, visible, atol=1e-10)
    np.testing.assert_allclose(visible, np.swapaxes(visible, -1, -2), atol=1e-10)
    np.testing.assert_allclose(np.trace(visible, axis1=-2, axis2=-1), 2.0, rtol=1e-10)
    np.testing.assert_allclose(np.trace(known.projection, axis1=-2, axis2=-1), 2.0, rtol=1e-10)
    np.testing.assert_allclose(known.projection @ known.correction, known.correction, atol=1e-12)


def test_a_null_space_millimeter_changes_tensions_by_three_to_four_newtons() -> None:
    slopes = 1.0 / np.linalg.svd(null_space(stops().state).correction, compute_uv=False)[:, :2]
    assert 2.79e3 < slopes.min() < 2.81e3
    assert 3.97e3 < slopes.max() < 3.98e3


def test_single_poses_agree_with_batches() -> None:
    single, batch = null_space(stops().state[3]), null_space(stops().state)
    for one, many in zip(single, batch, strict=True):
        np.testing.assert_allclose(one, many[3], atol=1e-12)
        assert not one.flags.writeable


def test_a_pose_without_lengths_does_not_affect_others() -> None:
    places = np.array([[0.0, 0.0, 1.5], [0.0, 0.0, 3.5]])
    plan = sl.inverse(PROTOTYPE, sl.Pose(places, np.broadcast_to(np.eye(3), (2, 3, 3))))
    assert plan.feasible.tolist() == [True, False]
    found: NullSpace = null_space(plan.state)
    for part in found:
        assert np.isfinite(part[0]).all()
        assert np.isnan(part[1]).all()
