"""Tension at the drum compared with the differential equation of the cable; tables of drums."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import sagline as sl
from sagline.robot.drum import Drums, drum_tension
from tests.kinematics.test_on_platform import POSE, ROBOTS
from tests.kinematics.winches import wound


@pytest.mark.parametrize("rise", [3.0, -2.5])
def test_the_tension_at_the_drum_agrees_with_a_guided_cable(rise: float) -> None:
    robot = wound("article-prototype", dead_cable=3.5, dead_rise=rise)
    state = sl.inverse(robot, sl.Pose.from_euler([0.3, 0.2, 1.5], 0, 0, 0)).state
    weight, stiffness = robot.cables.linear_density * robot.gravity, robot.cables.axial_stiffness
    begin = state.cables.frame_end_tension
    along = solve_ivp(  # dT/dz = weight of a meter of stretched cable
        lambda z, tension: weight / (1.0 + tension / stiffness), (0.0, -rise), begin, rtol=1e-12, atol=1e-10
    )
    np.testing.assert_allclose(drum_tension(state), along.y[:, -1], rtol=1e-10)
    assert np.sign(drum_tension(state) - begin) == pytest.approx(-np.sign(rise))
    # the dead length follows from its tensions: strains between those of the frame end and the drum
    assert state.contact is not None
    mean = 3.5 / (1.0 + 0.5 * (begin + drum_tension(state)) / stiffness)
    np.testing.assert_allclose(state.contact.dead_length, mean, rtol=1e-7)


@pytest.mark.parametrize("axis", [1.0, -1.0])
def test_the_tension_over_a_pulley_changes_with_the_height_of_the_exit(axis: float) -> None:
    robot = wound("article-prototype", pulley_radius=0.2, swivel_axis=[0.0, 0.0, axis])
    state = sl.inverse(robot, sl.Pose.from_euler([0.3, 0.2, 1.5], 0, 0, 0)).state
    weight = robot.cables.linear_density * robot.gravity
    higher = state.exit_point[:, 2] - robot.frame_anchors[:, 2]
    assert (np.sign(higher) == axis).all()
    stretched = 1.0 + state.cables.frame_end_tension / robot.cables.axial_stiffness
    np.testing.assert_allclose(
        state.cables.frame_end_tension - drum_tension(state), weight * higher / stretched, rtol=1e-4
    )


@pytest.mark.parametrize("model", [sl.Straight(), sl.Elastic(), sl.Parabolic(), sl.Empirical(0.5, 0.5)], ids=repr)
@pytest.mark.parametrize("radius", [0.0, 0.2])
def test_the_dead_part_of_a_shallow_cable_has_its_chord_tension(model: sl.CableModel, radius: float) -> None:
    robot = wound("article-prototype", pulley_radius=radius, dead_cable=3.5, dead_rise=3.0)
    state = sl.inverse(robot, sl.Pose.from_euler([0.3, 0.2, 1.5], 0, 0, 0), model).state
    assert state.contact is not None
    if isinstance(model, sl.Straight):
        np.testing.assert_array_equal(state.contact.dead_length, 3.5)
        strain = state.chord_tension / robot.cables.axial_stiffness
    else:
        strain = 3.5 / state.contact.dead_length - 1.0  # the dead length determines its tension
    np.testing.assert_allclose(drum_tension(state), strain * robot.cables.axial_stiffness, rtol=1e-9)


def test_a_cable_of_negative_length_has_no_tension() -> None:
    """At a drum 3 m below, a rope with EA = 14 kN and 3 kN/m would have a negative length."""
    robot = wound("article-prototype")
    state = sl.inverse(robot, sl.Pose.from_euler([0.3, 0.2, 1.5], 0, 0, 0)).state
    heavy = robot.replace(
        cables=robot.cables.replace(linear_density=300.0),
        winches=wound("article-prototype", dead_cable=3.5, dead_rise=3.0).winches,
    )
    assert np.isnan(drum_tension(sl.Equilibrium(heavy, state.pose, state.wrench, state.cables))).all()


def test_beginnings_of_layers() -> None:
    drums = Drums(wound())
    assert drums.starts.shape == (8, 5)
    np.testing.assert_allclose(drums.lengths(np.full((1, 8), 40.0))[0], drums.starts[:, 2], rtol=1e-15)
    np.testing.assert_allclose(drums.turns(drums.starts[:, 1:2].T)[0][0], 20.0, rtol=1e-14)
    # nested in an equilateral triangle, rope of 4 mm on a pitch radius of 50 mm: 6.9 % per layer
    assert drums.table[0, 1] / drums.table[0, 0] == pytest.approx(0.069, abs=5e-4)


def test_drums_of_different_cables() -> None:
    layers = np.array([4, 4, 5, 4, 6, 4, 4, 4])
    robot = wound(layers=layers, drum_radius=np.linspace(0.048, 0.08, 8))
    drums = Drums(robot)
    alone = Drums(wound(layers=6, drum_radius=np.linspace(0.048, 0.08, 8)[4]))
    turns = np.linspace(0.0, 119.0, 40)[:, None] * np.ones(8)
    np.testing.assert_array_equal(drums.lengths(turns)[:, 4], alone.lengths(turns)[:, 4])
    np.testing.assert_array_equal(drums.most, 20.0 * layers)


@pytest.mark.parametrize("offset", [-0.11, 0.0, 0.05])
def test_lengths_are_continuous_at_the_end_of_a_layer(offset: float) -> None:
    drums = Drums(wound(drum_offset=offset))
    ends = 20.0 * np.arange(1, 4)[:, None] * np.ones(8)
    before, after = drums.lengths(ends - 1e-9), drums.lengths(ends + 1e-9)
    np.testing.assert_allclose(before, after, rtol=0.0, atol=1e-8)
    assert (before > after).all()


def test_the_energy_changes_by_the_work_of_drums_on_the_platform() -> None:
    robot = ROBOTS["heavy"]
    state = sl.inverse(robot, POSE).state
    tension, step = drum_tension(state), 2e-4
    work = tension + tension**2 / (2.0 * robot.cables.axial_stiffness)
    ends = [sl.forward(robot, state.unstrained_length + h * np.eye(8), POSE).energy for h in (step, -step)]
    np.testing.assert_allclose((ends[1] - ends[0]) / (2.0 * step), work, rtol=1e-6)  # (wR/T)^2 is neglected
