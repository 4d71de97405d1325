"""Homing: readings of load cells, and impossible tensions."""

import re
from typing import Any

import numpy as np
import pytest

import sagline as sl
from tests.kinematics.winches import wound
from tests.refusal import refused

POSE = sl.Pose.from_euler([1.0, 1.0, 2.0], 0.0, 0.0, 0.0)


def refused_homing(robot: sl.Robot, reading: Any, *parts: str | None) -> Any:
    """Error of `home`, with its first parts."""
    with refused(*parts, kind=sl.InvalidValueError) as caught:
        sl.home(robot, POSE, reading)
    assert len(str(caught.value)) < 300
    return caught.value


def test_a_reading_is_corrected_by_bias_and_gain() -> None:
    rng = np.random.default_rng(3)
    bias, gain = rng.uniform(-30.0, 30.0, 8), rng.uniform(0.8, 1.2, 8)
    robot = wound(load_cell_bias=bias, load_cell_gain=gain, load_cell_range=2e3)
    plan = sl.inverse(robot, POSE)
    zeroed = sl.home(robot, POSE, gain * plan.state.cables.frame_end_tension + bias, 77.0)
    np.testing.assert_array_equal(sl.encoder_counts(sl.inverse(zeroed, POSE)), np.full(8, 77.0))
    np.testing.assert_allclose(sl.lengths_from_counts(zeroed, np.full(8, 77.0)), plan.unstrained_length, rtol=1e-12)


def test_a_load_cell_reads_no_more_than_its_range() -> None:
    reading = np.full(8, 500.0)
    reading[2] = 1000.1
    robot = wound(load_cell_range=1000.0)
    refused_homing(robot, reading, "cable 2: frame_end_tension", "1000.1 N", "<= 1000 N, its load_cell_range")
    reading[2] = 1000.0
    sl.home(robot, POSE, reading)


def test_a_tension_is_positive_after_the_bias() -> None:
    refused_homing(wound(), -1.0, "cable 0: frame_end_tension", "-1 N", "> 0 N")
    biased = wound(load_cell_bias=[0.0, 20.0] * 4)
    refused_homing(biased, [500.0, 20.0] * 4, "cable 1: frame_end_tension", "20 N", "> 20 N, its load_cell_bias")


def test_impossible_stretch_is_refused() -> None:
    robot = wound(load_cell_gain=2.0, load_cell_bias=10.0)
    most = robot.cables.axial_stiffness[0]  # half of it times a gain of two
    error = refused_homing(robot, 1.01 * most + 10.0, "cable 0: frame_end_tension")
    assert error.allowed.startswith(f"<= {most + 10.0:.6g} N, ")
    assert "axial_stiffness" in error.next_step


@pytest.mark.parametrize("radius", [0.0, 0.1])
@pytest.mark.parametrize("density", [0.5, 5.0])
def test_the_least_tension_is_printed_and_accepted(radius: float, density: float) -> None:
    robot = wound(cable_length=40.0, pulley_radius=radius, load_cell_gain=2.0, load_cell_bias=3.0)
    robot = robot.replace(cables=robot.cables.replace(linear_density=density))
    error = refused_homing(robot, [4.0] + [1e4] * 7, "cable 0: frame_end_tension", "4 N")
    least = float(error.allowed.removeprefix(">= ").split()[0])
    sl.home(robot, POSE, [least] + [1e4] * 7)
    refused_homing(robot, [0.98 * least] + [1e4] * 7)
    # the smallest of all catenaries between the two ends
    chords = POSE.transform(robot.platform_anchors) - robot.frame_anchors
    span, rise, all_tensions = np.hypot(*chords.T[:2]), chords[:, 2], np.geomspace(1.0, 1e4, 3000)[:, None]
    states = sl.Catenary().from_tension(robot.cables, span, rise, all_tensions, robot.gravity)
    assert (least - 3.0) / 2.0 == pytest.approx(np.nanmin(states.frame_end_tension[:, 0]), rel=0.015)


def test_an_end_inside_a_pulley_is_named() -> None:
    robot = wound(pulley_radius=0.3)
    inside = robot.frame_anchors[4] + [0.2, 0.0, 0.0] - robot.platform_anchors[4]
    with refused(value="0.2 m", allowed="> 0.6 m there", kind=sl.CableGeometryError) as caught:
        sl.home(robot, sl.Pose(inside, np.eye(3)), 500.0)
    assert caught.value.item.startswith("pose, cable 4: ")
    assert "pulley" in caught.value.item
    there = robot.frame_anchors[4] - robot.platform_anchors[4]
    with refused("pose, cable 4: distance between its ends", "0 m", kind=sl.CableGeometryError):
        sl.home(wound(), sl.Pose(there, np.eye(3)), 500.0)


def test_the_length_off_a_drum_is_at_most_its_capacity() -> None:
    error = refused_homing(
        wound(cable_length=[28.0] * 7 + [8.0]),
        500.0,
        "cable 7: length off its drum at the pose",
        None,
        "<= 8 m, its cable_length",
    )
    assert re.fullmatch(r"\d+\.\d* m", error.value)
