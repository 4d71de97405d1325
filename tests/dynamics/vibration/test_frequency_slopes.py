"""Derivatives of frequencies compared with differences of `modes` and `vibration`, and with the scale of all forces."""

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest

import sagline as sl
from sagline.core.arrays import Array
from sagline.dynamics.vibration.frequency_slopes import _edges, _longest, _StringData
from tests.dynamics.linear_systems import mass_of
from tests.kinematics.feasible import feasible_plan
from tests.refusal import refused
from tests.statics.test_sensitivities import one_pose, planar, point
from tests.statics.test_stiffness import richardson
from tests.tiers import extended, wide

COGIRO, SUSPENDED = sl.load_robot("cogiro"), sl.load_robot("article-suspended")
CASES = [
    (COGIRO, sl.Catenary()),
    (SUSPENDED, sl.Catenary()),
    (COGIRO, sl.Elastic()),
    (planar(), sl.Catenary()),
    (point(), sl.Catenary()),
]
TURNED = np.array([[0.5, 0.3, 0.0], [0.3, 0.0, 0.0], [0.0, 0.0, 1.0]])  # a change of the inertia
PUSH = np.array([0.5, -0.3, 1.0, 0.01, 0.02, -0.03])  # and of the wrench
LOWEST = 8
UP_TO = 4.0  # Hz, above them
Frequencies = Callable[[sl.Equilibrium], Array]


def massless(state: sl.Equilibrium) -> Array:
    return sl.modes(state).frequency


def with_cable_mass(state: sl.Equilibrium) -> Array:
    """Singularities of the exact dynamic stiffness near the lowest frequencies of `vibration`."""
    near = sl.vibration(state, up_to=UP_TO).frequency[:LOWEST]
    pair = np.stack((near * (1.0 - 1e-7), near * (1.0 + 1e-7)))
    robot, rest = state.one_robot, sl.stiffness(state)
    levers = (robot.platform_anchors - robot.center_of_mass) @ state.pose.matrix.T
    moving = sl.dynamic_stiffness(state, pair.reshape(-1)).real - rest.cable_stiffness
    ends = np.swapaxes(np.hstack((np.eye(3), np.zeros((3, 3)))) + np.zeros((8, 3, 6)), 1, 2)
    ends[:, 3:] = np.cross(np.eye(3), levers[:, None])
    matrix = 0.5 * (rest.matrix + rest.matrix.T) + np.einsum("mki,fmij,mlj->fkl", ends, moving, ends)
    matrix = matrix - (2.0 * np.pi * pair.reshape(-1, 1, 1)) ** 2 * mass_of(state)
    values = np.linalg.eigvalsh(matrix)
    least = np.take_along_axis(values, np.abs(values).argmin(axis=1)[:, None], axis=1).reshape(pair.shape)
    return np.asarray((pair[0] * least[1] - pair[1] * least[0]) / (least[1] - least[0]))


def slope(at: Callable[[float], Array], step: float) -> Array:
    """Derivative at 0 from differences with three eliminated orders."""
    found: Array = (16.0 * richardson(at, 0.5 * step) - richardson(at, step)) / 15.0
    return found


def differences(state: sl.Equilibrium, frequencies: Frequencies, cable: int) -> Iterator[tuple[str, Array]]:
    """Derivatives by length, density and axial stiffness of one cable, by mass, and several by inertia and wrench."""
    robot, model, lengths, wrench = state.one_robot, state.cables.model, state.unstrained_length, state.wrench
    density, stiffness, one = (
        robot.cables.linear_density,
        robot.cables.axial_stiffness,
        np.eye(robot.cable_count)[cable],
    )

    def at(robot: sl.Robot = robot, longer: Array | float = 0.0, push: Array | float = 0.0) -> Array:
        found = sl.forward(robot, lengths + longer, state.pose, model, wrench + push)
        assert found.status == sl.ForwardStatus.SOLVED
        return frequencies(found.state)

    def cables(heavier: float = 0.0, stiffer: float = 0.0) -> sl.Robot:
        return robot.replace(cables=sl.Cable(density * (1.0 + heavier * one), stiffness * (1.0 + stiffer * one)))

    yield "length", slope(lambda h: at(longer=h * one), 1e-4)
    yield "density", slope(lambda h: at(cables(heavier=h)), 5e-3) / density[cable]
    yield "stiffness", slope(lambda h: at(cables(stiffer=h)), 3e-2) / stiffness[cable]
    heavier = slope(lambda h: at(robot.replace(mass=robot.mass * (1.0 + h), inertia=robot.inertia)), 1e-2)
    yield "mass", heavier / robot.mass
    if robot.motion_pattern == "3R3T":
        size = robot.inertia[0, 0]
        yield "inertia", slope(lambda h: at(robot.replace(inertia=robot.inertia + h * size * TURNED)), 1e-2) / size
        yield "wrench", slope(lambda h: at(push=h * robot.mass * PUSH), 3e-2) / robot.mass


def printed_slopes(slopes: sl.FrequencySlopes, cable: int) -> dict[str, Array]:
    return {
        "length": slopes.length_sensitivity[:, cable],
        "density": slopes.density_sensitivity[:, cable],
        "stiffness": slopes.stiffness_sensitivity[:, cable],
        "mass": slopes.mass_sensitivity,
        "inertia": np.einsum("kij,ij->k", slopes.inertia_sensitivity, TURNED),
        "wrench": slopes.wrench_sensitivity @ PUSH,
    }


@pytest.mark.parametrize(("robot", "model"), CASES, ids=lambda one: getattr(one, "name", type(one).__name__))
def test_massless_frequencies_by_differences(robot: sl.Robot, model: sl.CableModel) -> None:
    state = one_pose(robot, model)
    found = printed_slopes(sl.frequency_slopes(state), 1)
    for name, expected in differences(state, massless, 1):
        np.testing.assert_allclose(found[name], expected, rtol=0.0, atol=1e-6 * np.abs(expected).max(), err_msg=name)


HEAVY = [CASES[0], *(pytest.param(*case, marks=pytest.mark.soak) for case in CASES[1:3])]


@pytest.mark.parametrize(("robot", "model"), HEAVY, ids=lambda one: getattr(one, "name", type(one).__name__))
def test_frequencies_with_cable_mass_by_differences(robot: sl.Robot, model: sl.CableModel) -> None:
    state = one_pose(robot, model)
    found = printed_slopes(sl.frequency_slopes(sl.vibration(state, up_to=UP_TO)), 1)
    for name, expected in differences(state, with_cable_mass, 1):
        atol = 1e-6 * np.abs(expected).max()
        np.testing.assert_allclose(found[name][:LOWEST], expected, rtol=0.0, atol=atol, err_msg=name)


@pytest.mark.parametrize("name", wide(["article-mixed", "fast", "cogiro", "ipanema-1"], first=2))
@pytest.mark.parametrize("heavy", [False, True], ids=["massless", "with cable mass"])
def test_frequencies_do_not_depend_on_the_scale_of_forces_and_masses(name: str, heavy: bool) -> None:
    robot = sl.load_robot(name)
    state = one_pose(robot, sl.Catenary())
    lowest = sl.modes(state).frequency
    slopes = sl.frequency_slopes(sl.vibration(state, up_to=1.2 * lowest[0]) if heavy else state)
    assert slopes.cable_mass == heavy
    parts = [
        slopes.density_sensitivity * robot.cables.linear_density,
        slopes.stiffness_sensitivity * robot.cables.axial_stiffness,
        slopes.mass_sensitivity[:, None] * robot.mass,
        (slopes.inertia_sensitivity * robot.inertia).reshape(-1, 9),
        slopes.wrench_sensitivity * state.wrench,
    ]
    all_parts = np.concatenate(parts, axis=1)
    assert len(all_parts) > 1
    np.testing.assert_array_less(np.abs(all_parts.sum(axis=1)), 1e-9 * np.abs(all_parts).sum(axis=1))


@pytest.mark.parametrize("heavy", [False, True], ids=["massless", "with cable mass"])
def test_a_wrench_moves_the_pose_and_with_it_the_frequencies(heavy: bool) -> None:
    state = one_pose(COGIRO, sl.Catenary())
    slopes = sl.frequency_slopes(sl.vibration(state, up_to=4.0) if heavy else state)
    known = sl.stiffness(state)
    size = np.abs(slopes.wrench_sensitivity).max()
    held = slopes.pose_sensitivity @ known.compliance
    np.testing.assert_allclose(held, slopes.wrench_sensitivity, rtol=0.0, atol=1e-11 * size)


@pytest.mark.parametrize("heavy", [False, True], ids=["massless", "with cable mass"])
def test_equal_frequencies_split_by_eigenvalues(heavy: bool) -> None:
    corners = np.array([[1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0], [1.0, -1.0]])
    frame = np.column_stack((4.0 * corners, np.full(4, 5.0)))
    robot = sl.Robot("square", frame, np.zeros((4, 3)), sl.Cable(0.05, 5e4), 10.0, motion_pattern="3T", tension_min=5.0)
    state = sl.inverse(robot, sl.Pose((0.0, 0.0, 1.0), np.eye(3))).state

    def vibrating(state: sl.Equilibrium) -> sl.Equilibrium | sl.Vibration:
        return sl.vibration(state, up_to=3.0) if heavy else state

    def frequencies(change: Array) -> Array:
        moved = vibrating(sl.forward(robot, state.unstrained_length + change, state.pose).state)
        whole = moved.frequency if isinstance(moved, sl.Vibration) else sl.modes(moved).frequency
        return np.asarray(whole[pair])

    slopes, step = sl.frequency_slopes(vibrating(state)), 1e-6
    pairs = np.flatnonzero(np.bincount(slopes.group) == 2)
    assert len(pairs) > heavy
    for number in pairs:
        pair = slopes.group == number
        change = np.array([1.0, 0.0, 0.0, 0.0])
        apart = (frequencies(step * change) - frequencies(-step * change)[::-1]) / (2.0 * step)
        np.testing.assert_allclose(slopes.length_sensitivity[pair, 0], apart, rtol=2e-6)
        one, other = slopes.mass_sensitivity[pair].tolist()
        assert one == pytest.approx(other, rel=1e-7)  # the mass does not separate them


def test_no_mode_below_the_frequency_has_no_rows() -> None:
    slopes = sl.frequency_slopes(sl.vibration(one_pose(COGIRO, sl.Catenary()), up_to=0.1))
    assert slopes.length_sensitivity.shape == (0, 8)
    assert slopes.inertia_sensitivity.shape == (0, 3, 3)


def test_refusals() -> None:
    plan = sl.inverse(COGIRO, sl.Pose([[0, 0, 1.5], [0, 0, 90.0]], np.tile(np.eye(3), (2, 1, 1))))
    shallow = feasible_plan(COGIRO, 1, 1, sl.Parabolic()).state[0]
    cases: tuple[tuple[Any, *tuple[str, ...]], ...] = (
        (plan.state, "a batch of 2", "a single state"),
        (plan.state[1], "a state without lengths", "a state that was solved"),
        (plan, "a batch of 2", "a single state"),
        (sl.vibration(plan.state[1], up_to=1.0), "a vibration with the status NO_LENGTHS"),
    )
    for given, *parts in cases:
        with refused("state", *parts, kind=sl.InvalidValueError):
            sl.frequency_slopes(given)
    with refused("the state's cable model", "Parabolic", "Catenary, Elastic"):
        sl.frequency_slopes(shallow)
    with refused("together", "-1", ">= 0, finite"):
        sl.frequency_slopes(plan.state[0], together=-1.0)


@extended
def test_cables_over_pulleys_are_refused() -> None:
    over = one_pose(sl.load_robot("ipanema-2-pulleys"), sl.Catenary())
    for given in (over, sl.vibration(over, up_to=1.0)):
        with refused("state", "a robot with pulleys or dead length"):
            sl.frequency_slopes(given)


@pytest.mark.parametrize("level", [0.0, 1e-12, 1e-3, 1.0, 50.0])
def test_the_number_of_elements_is_limited_for_folding_cables(level: float) -> None:
    cable = _StringData(np.array([level, 0.0, 4.0]), 1.0, 9.0, 1e5, 0.1)
    edges, omega = _edges(cable, 40.0), 40.0
    assert (edges[0], edges[-1]) == (0.0, 9.0)
    assert edges.size < 400
    long = np.diff(edges) > _longest(cable, omega, edges[:-1], edges[1:])
    assert np.diff(edges)[long].sum() < 1e-10
