"""Machines at equilibria, for all cases of a calibration."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

import sagline as sl
from sagline.core.arrays import Array
from tests.calibration.reference import Machine
from tests.kinematics.feasible import feasible_plan
from tests.statics.test_sensitivities import planar, point

_DRUM: dict[str, Any] = {
    "drum_radius": 0.048,
    "groove_pitch": 0.004,
    "gear": 12.0,
    "counts_per_turn": 4096.0,
    "count_zero": 1e5,
    "length_zero": 12.0,
}


class Standing(NamedTuple):
    """A machine at several poses."""

    machine: Machine
    pose: sl.Pose
    lengths: Array


def sensors(length: float = 1e-9) -> sl.Sensors:
    """All sensors, with a rotated measuring system and a target beside the origin of the platform."""
    frame = sl.Pose((1.0, -2.0, 0.5), Rotation.from_rotvec((0.3, -0.2, 0.7)))
    cell = {"position_deviation": [1e-3, 2e-3, 3e-3], "rotation_deviation": [1e-3, 3e-3, 2e-3]}
    return sl.Sensors(length, 5.0, **cell, frame=frame, target=(0.2, -0.1, 0.3))


def with_drums(robot: sl.Robot, **changes: Any) -> sl.Robot:
    """The robot with a drum, pulleys and load cells at each anchor."""
    rope = robot.cables.replace(diameter=0.004)
    return robot.replace(cables=rope, winches=sl.Winch(**{**_DRUM, **changes}))


def robots() -> dict[str, sl.Robot]:
    """Robots by name; numbers of those with winches differ from cable to cable."""
    few = np.linspace(0.9, 1.1, 8)
    cell = {"load_cell_gain": few, "load_cell_bias": 20.0 * few - 18.0}
    run = {"dead_cable": 3.0 * few, "dead_rise": 2.0 * few - 1.0}
    swivel = np.outer([1.0, -1.0] * 4, [0.0, 0.0, 1.0])
    axes = np.random.default_rng(5).normal(size=(8, 3))
    axes[0], axes[1] = [0.0, 0.0, 1.0], [-1.0, 0.0, 0.0]
    slanted = {"swivel_axis": axes / np.linalg.norm(axes, axis=1)[:, None]}
    aboard: dict[str, Any] = {
        "swivel_axis": axes[::-1],
        "dead_cable": 0.4 * few,
        "on_platform": [True] * 5 + [False] * 3,
    }
    pulleys = sl.load_robot("ipanema-2")
    layers = {"drum_width": 0.08, "layers": 4, "drum_distance": 0.8, "drum_offset": -0.04, "cable_length": 34.0}
    cogiro = sl.load_robot("cogiro")
    return {
        "cogiro": cogiro,
        "article-suspended": sl.load_robot("article-suspended"),
        "planar": planar(),
        "point": point(),
        "pulleys": pulleys.replace(winches=sl.Winch(0.25 * few, swivel_axis=swivel, **run, **cell)),
        "slanted": cogiro.replace(winches=sl.Winch(0.05 * few, **slanted, **run, **cell)),
        "aboard": cogiro.replace(winches=sl.Winch(0.05 * few, **aboard, **cell)),
        "drums": with_drums(cogiro, winding_tension=160.0, **cell),
        "layers": with_drums(cogiro, pulley_radius=0.05 * few, winding_tension=40.0, **run, **layers),
    }


def standing(robot: sl.Robot, count: int = 2, length: float = 1e-9, seed: int = 3) -> Standing:
    """The robot at feasible poses."""
    if robot.motion_pattern == "3R3T":
        pose = feasible_plan(robot, 2 * count + 8, seed).state.pose[:count]
    else:
        turn = 0.1 * np.arange(1, count + 1)[:, None] * (robot.motion_pattern == "1R2T")
        height = 1.2 * (robot.name == "point")
        shift = [[0.4, 0.0, height - 0.3], [-0.6, 0.0, height + 0.2]][:count]
        pose = sl.Pose(shift, Rotation.from_rotvec(turn * (0.0, 1.0, 0.0)))
    plan = sl.inverse(robot, pose, tension=sl.MinimumNorm())
    assert plan.feasible.all()
    assert len(plan.unstrained_length) == count
    offset = np.linspace(-0.1, 0.2, robot.cable_count)
    return Standing(Machine(robot, sensors(length), offset), plan.state.pose, plan.unstrained_length)
