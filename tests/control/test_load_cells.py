"""Parity of the load cells by the balance of the platform."""

from collections.abc import Callable

import numpy as np
import pytest

import sagline as sl
from sagline.control.null_space import _balance_slope, parity
from sagline.core.arrays import Array
from tests.control.stops import PROTOTYPE, stops
from tests.kinematics.feasible import feasible_plan

PLANS: dict[str, Callable[[], sl.Plan]] = {
    "prototype": stops,
    "cogiro": lambda: feasible_plan(sl.load_robot("cogiro"), 3, seed=4),
}


def visible(state: sl.Equilibrium) -> Array:
    """V = 1 - N N^T, by the orthonormal basis of the null space."""
    basis = np.linalg.svd(_balance_slope(state))[2][..., 6:, :]
    found: Array = np.eye(8) - np.swapaxes(basis, -1, -2) @ basis
    return found


def likeness(matrix: Array) -> Array:
    """|cos| of the patterns of two cells, 0 for a cell and itself."""
    own = np.sqrt(np.einsum("...ii->...i", matrix))
    found: Array = np.abs(matrix / (own[..., :, None] * own[..., None, :])) * (1.0 - np.eye(8))
    return found


@pytest.mark.parametrize("name", PLANS)
def test_the_wrench_of_one_shortened_cable(name: str) -> None:
    """Fixed platform: one length is shorter, by the cable model only."""
    plan = PLANS[name]()
    state, robot = plan.state, plan.state.one_robot
    slope, step = _balance_slope(state), 1e-5
    for cable in range(8):
        change = np.zeros(8)
        change[cable] = step
        pair = [_held(state, robot, sign * change) for sign in (-1.0, 1.0)]
        wrench = (pair[1][0] - pair[0][0]) / (pair[1][1] - pair[0][1])[..., cable, None]
        np.testing.assert_allclose(slope[..., cable], wrench, atol=2e-6)


def _held(state: sl.Equilibrium, robot: sl.Robot, change: Array) -> tuple[Array, Array]:
    """Wrench of the cables about the center of mass, and T_A, at the pose of the state with changed lengths."""
    matrix = state.pose.matrix
    levers = (robot.platform_anchors - robot.center_of_mass) @ np.swapaxes(matrix, -1, -2)
    ends = state.pose.position[:, None] + robot.platform_anchors @ np.swapaxes(matrix, -1, -2)
    across = robot.frame_anchors - ends
    span = np.hypot(across[..., 0], across[..., 1])
    hanging = sl.Catenary().from_length(robot.cables, span, -across[..., 2], state.unstrained_length + change)
    level = hanging.horizontal_tension / span
    force = np.stack((level * across[..., 0], level * across[..., 1], -hanging.vertical_force), axis=-1)
    wrench = np.concatenate((force.sum(axis=1), np.cross(levers, force).sum(axis=1)), axis=-1)
    return wrench, hanging.frame_end_tension


def test_74_to_97_percent_of_the_error_of_a_cell_are_visible() -> None:
    seen = np.sqrt(np.einsum("...ii->...i", visible(stops().state)))
    assert seen.min() == pytest.approx(0.74, abs=0.005)
    assert seen.max() == pytest.approx(0.97, abs=0.005)


def test_two_cells_resemble_each_other_and_a_load_not_too_much() -> None:
    state = stops().state
    cells = visible(state)
    assert likeness(cells).max() == pytest.approx(0.71, abs=0.005)
    load = np.linalg.pinv(_balance_slope(state)) @ np.array([0.0, 0.0, 1.0, 0.0, 0.0, 0.0])
    load /= np.linalg.norm(load, axis=-1, keepdims=True)
    like = np.abs(load) / np.sqrt(np.einsum("...ii->...i", cells))
    assert like.max() == pytest.approx(0.59, abs=0.005)
    rows = parity(state)
    own = np.einsum("...ii->...i", rows)
    assert likeness(own[..., :, None] * rows).max() == pytest.approx(0.67, abs=0.005)
    assert 5.0 * np.hypot(1.0, 2.0) / own.min() == pytest.approx(15.8, abs=0.05)  # N that are always detected


@pytest.mark.parametrize("cell", range(8))
def test_the_wrong_cell_has_the_largest_parity_and_its_error_is_estimated(cell: int) -> None:
    rows = parity(stops().state)
    error = np.zeros(8)
    error[cell] = -20.0
    found = rows @ error
    assert (np.abs(found).argmax(axis=-1) == cell).all()
    np.testing.assert_allclose(found[..., cell] / rows[..., cell, cell], -20.0)


def moved(robot: sl.Robot, more: Array | float = 0.0) -> Array:
    """Largest parity at all stops of a machine that differs from the plan [N]."""
    plan = stops()
    there = sl.forward(robot, plan.unstrained_length + more, plan.state.pose)
    assert there.stable.all()
    error = there.state.cables.frame_end_tension - plan.state.cables.frame_end_tension
    return np.abs(parity(plan.state) @ error[..., None]).max()  # type: ignore[no-any-return]


def test_errors_of_the_machine_name_no_cell() -> None:
    """11 N name a cell: errors of load, stiffness, anchors and encoders leave less."""
    threshold = 5.0 * np.hypot(1.0, 2.0)
    inertia = PROTOTYPE.inertia
    stiff = PROTOTYPE.cables.replace(axial_stiffness=1.2 * PROTOTYPE.cables.axial_stiffness)
    rng = np.random.default_rng(0)
    shifted = PROTOTYPE.frame_anchors + 0.01 * rng.normal(size=(8, 3))
    machines = {
        "10 kg more": moved(PROTOTYPE.replace(mass=60.0, inertia=inertia)),
        "stiffer by 20 %": moved(PROTOTYPE.replace(cables=stiff)),
        "anchors off by 1 cm": moved(PROTOTYPE.replace(frame_anchors=shifted)),
        "zeros off by 6.5 mm": moved(PROTOTYPE, -6.5e-3),
        "zeros off by 2 mm at random": moved(PROTOTYPE, 2e-3 * rng.normal(size=8)),
    }
    assert max(machines.values()) < 0.5 * threshold
    assert (
        moved(PROTOTYPE.replace(center_of_mass=[0.02, 0.0, 0.0])) > threshold
    )  # a moment: more than the weight of a load


def test_a_pose_without_lengths_has_none() -> None:
    places = np.array([[0.0, 0.0, 1.5], [0.0, 0.0, 3.5]])
    plan = sl.inverse(PROTOTYPE, sl.Pose(places, np.broadcast_to(np.eye(3), (2, 3, 3))))
    rows = parity(plan.state)
    assert np.isfinite(rows[0]).all()
    assert np.isnan(rows[1]).all()
