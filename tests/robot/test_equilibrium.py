"""Parts of a batch: the same numbers, shared memory where possible, and read-only."""

from dataclasses import fields
from typing import Any

import numpy as np
import pytest

import sagline as sl
from sagline.core.arrays import Array
from sagline.core.numbers import n
from tests.refusal import refused

ROBOT = sl.load_robot("article-suspended")
POSE = sl.Pose.from_euler([[0, 0, 1.5], [1, 1, 1.5], [2, -1, 2.0], [-3, 2, 1.0]], 0.0, 0.0, 0.0)
WRENCH = np.arange(24.0).reshape(4, 6)
MASK = np.array([True, False, True, True])
INDICES = [0, 2, -1, np.int64(1), slice(1, 3), slice(None, None, -2), slice(3, 3), MASK, np.array([3, 0, 3])]


def state() -> sl.Equilibrium:
    return sl.inverse(ROBOT, POSE, wrench=WRENCH).state


def arrays(cables: sl.CableState) -> dict[str, Array]:
    values = {field.name: getattr(cables, field.name) for field in fields(cables)}
    return {name: value for name, value in values.items() if isinstance(value, np.ndarray)}


@pytest.mark.parametrize("index", INDICES, ids=str)
def test_a_part_of_a_batch_has_the_entries_of_its_arrays(index: int) -> None:
    batch = state()
    part = batch[index]
    np.testing.assert_array_equal(part.pose.position, batch.pose.position[index])
    np.testing.assert_array_equal(part.pose.quaternion, batch.pose.quaternion[index])
    np.testing.assert_array_equal(part.wrench, WRENCH[index])
    assert part.robot is ROBOT
    for name, value in arrays(batch.cables).items():
        taken = getattr(part.cables, name)
        np.testing.assert_array_equal(taken, value[index], err_msg=name)
        assert not taken.flags.writeable
    for name in ("cable_weight", "frame_end_tension", "sag", "closure_residual"):
        np.testing.assert_array_equal(getattr(part.cables, name), getattr(batch.cables, name)[index], err_msg=name)
    assert not part.wrench.flags.writeable
    assert not part.pose.position.flags.writeable


def test_slices_share_the_memory_of_the_batch_and_masks_do_not() -> None:
    batch = state()
    for part, shared in ((batch[1:3], True), (batch[2], True), (batch[MASK], False)):
        for name, value in arrays(batch.cables).items():
            assert np.shares_memory(getattr(part.cables, name), value) == shared
        assert np.shares_memory(part.pose.position, batch.pose.position) == shared
        assert np.shares_memory(part.wrench, batch.wrench) == shared
        assert part.cables.cable is ROBOT.cables


def test_functions_accept_parts_of_a_batch() -> None:
    batch = state()
    np.testing.assert_array_equal(sl.stiffness(batch).matrix[1:], sl.stiffness(batch[1:]).matrix)
    np.testing.assert_array_equal(sl.stiffness(batch).matrix[-1], sl.stiffness(batch[-1]).matrix)
    np.testing.assert_array_equal(sl.limit_margin(batch)[MASK], sl.limit_margin(batch[MASK]))
    np.testing.assert_array_equal(sl.capacity_margin(batch)[2], sl.capacity_margin(batch[2]))


def test_a_batch_has_a_length_and_a_single_equilibrium_has_none() -> None:
    batch = state()
    assert len(batch) == len(batch.cables) == 4
    assert [one.wrench[0] for one in batch] == [0.0, 6.0, 12.0, 18.0]
    assert [one.shape for one in batch.cables] == [(8,)] * 4
    for single, words in ((batch[0], "a single equilibrium"), (batch.cables[0][0], "a state of a single cable")):
        with refused("index", "0", "none", kind=TypeError) as caught:
            single[0]
        assert words.removeprefix("a ") in caught.value.next_step
        with refused("this", words, "a batch", kind=TypeError):
            len(single)
    with pytest.raises(IndexError):
        batch[4]


def test_material_of_a_batch_is_selected_with_its_parts() -> None:
    density = np.array([[0.1], [0.2], [0.3]]) * np.ones(2)
    cables = sl.Catenary().from_tension(sl.Cable(density, 5e4), 10.0, -2.0, [[100.0, 200.0]] * 3)
    part = cables[1:]
    np.testing.assert_array_equal(part.cable.linear_density, density[1:])
    assert np.shares_memory(part.cable.linear_density, cables.cable.linear_density)
    assert not part.cable.linear_density.flags.writeable
    np.testing.assert_array_equal(part.cable_weight, cables.cable_weight[1:])
    np.testing.assert_array_equal(cables[-1][0].cable.linear_density, 0.3)
    assert cables[-1][0].span.shape == ()
    np.testing.assert_array_equal(cables[-1][0].sag, cables.sag[-1, 0])


def test_material_given_once_for_a_batch_is_spread() -> None:
    cables = sl.Catenary().from_tension(sl.Cable([[0.1, 0.2]], 5e4), 10.0, -2.0, [[100.0, 200.0]] * 3)
    assert cables[2].cable.linear_density.shape == (2,)
    np.testing.assert_array_equal(cables[2].cable_weight, cables.cable_weight[2])
    assert sl.Catenary().from_tension(sl.Cable(0.1, 5e4), 10.0, 1.0, [9.0, 8.0])[1].cable.linear_density.shape == ()


def test_robots_of_a_batch_are_selected_with_its_parts() -> None:
    robots = [ROBOT.replace(mass=ROBOT.mass + k) for k in range(4)]
    batch = sl.inverse(robots, POSE).state
    assert batch[MASK].robot == (robots[0], robots[2], robots[3])
    assert batch[-1].one_robot is robots[3]
    assert batch.cables.cable.linear_density.shape == (4, 8)
    assert batch[1].cables.cable.linear_density.shape == (8,)
    with refused("robot", "a sequence of 4 robots, one per pose", kind=sl.InvalidValueError):
        _ = batch.one_robot
    with refused("robot", "an empty sequence", kind=sl.InvalidValueError):
        sl.stiffness(batch[np.zeros(4, dtype=bool)])


def test_functions_of_an_equilibrium_accept_every_kind_of_start() -> None:
    here = (1.0, 1.0, 1.5)
    plan = sl.inverse(ROBOT, here)
    ball = sl.Sphere((0.0, 0.0, 0.2), radius=0.1)
    calls: list[tuple[Any, tuple[Any, ...], Any]] = [
        (sl.stiffness, (), lambda found: found.matrix),
        (sl.modes, (), lambda found: found.frequency),
        (sl.limit_margin, (), np.asarray),
        (sl.capacity_margin, (), np.asarray),
        (sl.clearance, (ball,), lambda found: found.distance),
        (sl.linearized, (sl.Damping(modal_damping=0.01), "speeds"), lambda found: found.A),
        (sl.dynamic_stiffness, ([1.0],), np.asarray),
        (sl.frequency_response, ([1.0],), lambda found: found.compliance),
        (sl.control.parity, (), np.asarray),
        (sl.control.null_space, (), lambda found: found.projection),
    ]
    for function, further, number in calls:
        expected = number(function(plan.state, *further))
        solution = sl.forward(ROBOT, plan.unstrained_length, start=plan.state.pose)
        for start in ((plan,), (ROBOT, here), (ROBOT, sl.Pose(here))):
            np.testing.assert_array_equal(number(function(*start, *further)), expected, err_msg=function.__name__)
        np.testing.assert_allclose(number(function(solution, *further)), expected, rtol=1e-6, atol=1e-7)
    np.testing.assert_array_equal(sl.stiffness(ROBOT, pose=[here, here]).matrix[1], sl.stiffness(plan).matrix)
    np.testing.assert_array_equal(sl.vibration(ROBOT, here).frequency, sl.vibration(plan.state, up_to=20.0).frequency)
    for start in ((plan,), (ROBOT, here)):
        assert sl.frequency_slopes(*start).mass_sensitivity[0] == sl.frequency_slopes(plan.state).mass_sensitivity[0]


def test_a_robot_at_an_infeasible_pose_is_refused_with_its_shortfall() -> None:
    far = (50.0, 0.0, 1.0)
    short = float(sl.inverse(ROBOT, far).shortfall)
    with refused("pose", f"INFEASIBLE, {n(short, '.4g', 'N')} short", "a feasible pose"):
        sl.vibration(ROBOT, far)
    for wrong in (ROBOT, 3, None):
        with refused("state", None, "an Equilibrium"):
            sl.modes(wrong)  # type: ignore[call-overload]
