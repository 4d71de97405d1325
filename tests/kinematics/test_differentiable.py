"""Derivatives of both kinematics with arrays of NumPy, compared with differences, and gradients with changes."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

import sagline as sl
from sagline.core.arrays import Array
from sagline.kinematics import differentiable as d
from tests.refusal import refused
from tests.shifted import CASES, COGIRO, FORWARD, POSE, SLANTED, Shifted, close
from tests.statics.test_stiffness import richardson


def of_forward(case: Shifted) -> tuple[d.Kinematics, list[Array], list[Array]]:
    """Kinematics, inputs of one sample and their changes."""
    arguments, changes = case.arguments_of_forward()
    inputs = [*arguments.values(), np.concatenate((case.pose.position, case.pose.quaternion))]
    return d.ForwardKinematics(case.robot, "catenary", "forward"), inputs, [*changes.values(), np.zeros(7)]


def of_inverse(case: Shifted) -> tuple[d.Kinematics, list[Array], list[Array]]:
    """Kinematics, inputs of one sample and their changes."""
    (position, quaternion, *rest), (shift, turn, *others) = (each.values() for each in case.arguments_of_inverse())
    inputs = [np.concatenate((position, quaternion)), *rest, np.zeros(len(case.lengths))]
    changes = [np.concatenate((shift, turn)), *others, np.zeros(len(case.lengths))]
    return d.InverseKinematics(case.robot, "catenary", "inverse"), inputs, changes


ALL = [(of_forward, *case) for case in FORWARD] + [(of_inverse, *case) for case in CASES.values()]
Of = Callable[[Shifted], tuple[d.Kinematics, list[Array], list[Array]]]


@pytest.mark.parametrize(("of", "robot", "pose"), ALL)
def test_changes_are_those_of_differences_and_gradients_are_their_transpose(
    of: Of, robot: sl.Robot, pose: sl.Pose
) -> None:
    case = Shifted(robot, pose)
    kinematics, inputs, changes = of(case)
    direct = case.forward if of is of_forward else case.inverse
    first, tension, results = d.solve_batch(kinematics, inputs)
    np.testing.assert_allclose(np.concatenate((first, tension)), direct(0.0), rtol=1e-12, atol=1e-12)
    solved = [*inputs, first, results]
    moved, pulled = d.push_batch(kinematics, changes, solved)
    expected, k = richardson(direct, 1e-5), len(first)
    close(moved, expected[:k])
    close(pulled, expected[k:])
    rng = np.random.default_rng(8)
    weights = rng.normal(size=k), rng.normal(size=len(tension))
    gradients = d.pull_batch(kinematics, weights, solved)
    along = sum((gradient * change).sum() for gradient, change in zip(gradients, changes, strict=False))
    np.testing.assert_allclose(along, weights[0] @ moved + weights[1] @ pulled, rtol=1e-11)


def repeated(inputs: list[Array], *axes: int) -> list[Array]:
    """The inputs with leading axes."""
    return [np.broadcast_to(each, (*axes, *each.shape)) for each in inputs]


def test_samples_of_many_blocks_agree_with_single_samples() -> None:
    kinematics, inputs, _ = of_forward(Shifted(COGIRO, POSE))
    lengths, *rest = repeated(inputs, 7, 100)
    lengths = lengths + 1e-3 * np.random.default_rng(3).normal(size=lengths.shape)
    first, tension, results = d.solve_batch(kinematics, [lengths, *rest])
    starts = sl.Pose(np.tile(POSE.position, (700, 1)), np.tile(POSE.matrix, (700, 1, 1)))
    direct = sl.forward(COGIRO, lengths.reshape(-1, 8), starts, wrench=inputs[1])
    np.testing.assert_allclose(first.reshape(-1, 7)[:, :3], direct.pose.position, rtol=0.0, atol=1e-12)
    np.testing.assert_allclose(tension.reshape(-1, 8), direct.state.cables.frame_end_tension, rtol=1e-12)
    solved = [lengths, *rest, first, results]
    gradients = d.pull_batch(kinematics, (first, tension), solved)
    for i in ((0, 0), (3, 7), (6, 99)):
        alone = d.pull_batch(kinematics, (first[i], tension[i]), [each[i] for each in solved])
        for whole, part in zip(gradients, alone, strict=True):
            np.testing.assert_array_equal(whole[i], part)


def test_no_samples_have_empty_results_and_gradients() -> None:
    kinematics, inputs, _ = of_inverse(Shifted(COGIRO, POSE))
    none = repeated(inputs, 3, 0)
    first, tension, results = d.solve_batch(kinematics, none)
    assert first.shape == tension.shape == (3, 0, 8)
    gradients = d.pull_batch(kinematics, (first, tension), [*none, first, results])
    assert [each.shape for each in gradients] == [each.shape for each in none]


def test_each_sample_has_its_own_target_tensions() -> None:
    kinematics, inputs, _ = of_inverse(Shifted(COGIRO, POSE))
    *rest, _ = repeated(inputs, 3)
    goals = np.random.default_rng(4).uniform(200.0, 900.0, (3, 8))
    lengths, _, results = d.solve_batch(kinematics, [*rest, goals])
    for goal, found in zip(goals, lengths, strict=True):
        plan = sl.inverse(COGIRO, POSE, tension=sl.QuadraticProgram(target=goal), wrench=inputs[1])
        np.testing.assert_allclose(found, plan.unstrained_length, rtol=1e-12)
    changes = [*(np.zeros(each.shape) for each in rest), np.ones((3, 8))]
    moved, _ = d.push_batch(kinematics, changes, [*rest, goals, lengths, results])
    for k in range(3):
        close(moved[k], richardson(lambda h, k=k: d.solve_batch(kinematics, [*inputs[:4], goals[k] + h])[0], 1.0))


@pytest.mark.parametrize(("of", "k"), [(of_forward, 0), (of_inverse, 0)])
def test_only_samples_without_a_solution_are_nan(of: Of, k: int) -> None:
    kinematics, inputs, _ = of(Shifted(COGIRO, POSE))
    rows = [np.array(each) for each in repeated(inputs, 3)]
    rows[k][1] = np.nan if of is of_forward else rows[k][1] + 30.0  # outside the frame
    first, tension, results = d.solve_batch(kinematics, rows)
    gradients = d.pull_batch(kinematics, (np.ones(first.shape), np.ones(tension.shape)), [*rows, first, results])
    for each in (first, tension, *gradients):
        assert np.isnan(each[1]).all()
        assert np.isfinite(each[[0, 2]]).all()
        np.testing.assert_array_equal(each[0], each[2])


def test_unsuitable_robots_and_models_are_refused() -> None:
    with refused("model", "Straight()", "a cable model with stiffness", "Use Catenary() or Elastic()."):
        d.ForwardKinematics(COGIRO, "straight", "sagline.host.forward")
    with refused("winches: swivel_axis[0]", None, "up or down here"):
        d.InverseKinematics(SLANTED, "catenary", "sagline.host.inverse")
    guided = COGIRO.replace(winches=sl.Winch(0.05, guides=COGIRO.frame_anchors[:, None] - 1.0))
    with refused("winches: guides", None, "None for sagline.host.forward"):
        d.ForwardKinematics(guided, "catenary", "sagline.host.forward")
