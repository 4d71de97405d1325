"""The solver of a control loop agrees with `forward`."""

from typing import Any

import numpy as np
import pytest

import sagline as sl
from sagline.kinematics.forward import search
from sagline.kinematics.forward_rows import ForwardRows
from tests.kinematics.feasible import box_poses, feasible_plan

COGIRO = sl.load_robot("cogiro")


def test_steps_equal_the_batch() -> None:
    plan = feasible_plan(COGIRO, 1, seed=1)
    lengths = plan.unstrained_length[0] + 0.002 * np.arange(30)[:, None] * np.linspace(-1, 1, 8)
    batch = sl.forward(COGIRO, lengths, plan.state.pose[0])
    solver = sl.ForwardSolver(COGIRO)  # without an initial pose: the first step searches
    position, quaternion = np.empty(3), np.empty(4)
    for i, row in enumerate(lengths):
        step = solver.step(row)
        np.testing.assert_allclose(step.position, batch.pose.position[i], atol=1e-10)
        np.testing.assert_allclose(step.chord_tension, batch.state.cables.chord_tension[i], rtol=1e-7)
        assert step.status == batch.status[i]
        assert max(step.force_residual, step.moment_residual) < 1e-8
        assert solver.step_into(row, position, quaternion) == step.status
        np.testing.assert_allclose(position, step.position, atol=1e-12)
        np.testing.assert_allclose(quaternion, step.quaternion, atol=1e-12)


def test_it_searches_once_and_again_after_a_reset(monkeypatch: pytest.MonkeyPatch) -> None:
    plan = feasible_plan(COGIRO, 1, seed=4)
    solver, searches = sl.ForwardSolver(COGIRO), []

    def counted(*arguments: Any) -> ForwardRows:
        searches.append(1)
        return search(*arguments)

    monkeypatch.setattr("sagline.kinematics.forward_solver.search", counted)
    for known in (0, 1, 1):
        assert len(searches) == known
        assert solver.step(plan.unstrained_length[0]).status == sl.ForwardStatus.SOLVED
    solver.reset()
    solver.step(plan.unstrained_length[0])
    assert len(searches) == 2
    solver.reset(plan.state.pose[0])
    solver.step(plan.unstrained_length[0])
    assert len(searches) == 2


def test_results_are_copies_and_the_wrench_is_used() -> None:
    plan = feasible_plan(COGIRO, 1, seed=2)
    solver = sl.ForwardSolver(COGIRO, start=plan.state.pose[0])
    first = solver.step(plan.unstrained_length[0])
    kept = first.position.copy()
    second = solver.step(plan.unstrained_length[0], wrench=(0, 0, -200.0, 0, 0, 0))
    assert second.position[2] < kept[2] - 1e-3
    np.testing.assert_array_equal(first.position, kept)
    np.testing.assert_allclose(solver.step(plan.unstrained_length[0]).position, kept, atol=1e-12)


def test_a_failed_step_keeps_the_previous_pose() -> None:
    plan = feasible_plan(COGIRO, 1, seed=3)
    solver = sl.ForwardSolver(COGIRO, start=plan.state.pose[0])
    lengths = plan.unstrained_length[0].copy()
    position, quaternion = np.empty(3), np.empty(4)
    assert solver.step_into(np.full(8, np.nan), position, quaternion) == sl.ForwardStatus.NO_LENGTHS
    assert np.isnan(position).all()
    np.testing.assert_allclose(solver.step(lengths).position, plan.state.pose.position[0], atol=1e-9)


def test_the_previous_solution_is_discarded_by_a_reset_or_a_failure() -> None:
    plan = feasible_plan(COGIRO, 2, seed=4)
    (first, second), lengths = plan.state.pose, plan.unstrained_length
    solver = sl.ForwardSolver(COGIRO, start=first)
    np.testing.assert_allclose(solver.step(lengths[0]).position, first.position, atol=1e-11)
    solver.reset(second)
    np.testing.assert_allclose(solver.step(lengths[1]).position, second.position, atol=1e-11)
    solver.step(np.full(8, 1e-3))  # lengths that are too short
    solver.reset(first)
    np.testing.assert_allclose(solver.step(lengths[0]).position, first.position, atol=1e-11)


def test_bad_input() -> None:
    solver = sl.ForwardSolver(COGIRO)
    with pytest.raises(sl.InvalidValueError, match=r"unstrained_length\[2\]"):
        solver.step([5.0, 5.0, -1.0, 5.0, 5.0, 5.0, 5.0, 5.0])
    with pytest.raises(sl.InvalidValueError, match="shape"):
        solver.step([5.0] * 7)
    for wrong in (-1.0, 0.0, np.nan, np.inf):
        with pytest.raises(sl.InvalidValueError, match=r"unstrained_length\[5\]"):
            solver.step(np.where(np.arange(8) == 5, wrong, 5.0))
    with pytest.raises(sl.InvalidValueError, match="one sample"):
        solver.step(np.full((1, 8), 5.0))
    with pytest.raises(sl.InvalidValueError, match="single pose"):
        solver.reset(box_poses(COGIRO, 2, seed=0))
    with pytest.raises(sl.InvalidValueError, match="Straight"):
        sl.ForwardSolver(COGIRO, sl.Straight())
