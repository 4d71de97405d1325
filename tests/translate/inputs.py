"""Calls of the public functions that reach the entries: the inputs on which C and compiled Python are compared."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

import sagline as sl
from tests.record.poses import METHODS, MODELS


def poses_of(robot: sl.Robot, count: int, seed: int) -> sl.Pose:
    """Random poses in a robot's box, level and tilted, feasible and not; the last ones at its corners."""
    random = np.random.default_rng(seed)
    low, high = robot.frame_anchors.min(axis=0), robot.frame_anchors.max(axis=0)
    if robot.test_box is not None:
        low, high = np.asarray(robot.test_box.low), np.asarray(robot.test_box.high)
    places = low + random.uniform(size=(count, 3)) * (high - low)
    places[-2], places[-1] = low, high
    turns = random.choice([0.0, 0.01, 0.3], size=(count, 1)) * random.uniform(-1.0, 1.0, size=(count, 3))
    return sl.Pose(places, Rotation.from_rotvec(turns).as_matrix())


def there_and_back(robot: sl.Robot, count: int, seed: int) -> sl.Plan:
    """Lengths of poses, and the poses of these lengths without a start."""
    plan = sl.inverse(robot, poses_of(robot, count, seed))
    sl.forward(robot, plan.unstrained_length)
    return plan


def models_and_methods(robot: sl.Robot, count: int) -> None:
    """Inverse kinematics by every cable model and every tension method that the robot takes."""
    poses = poses_of(robot, count, 1)
    for model in MODELS:
        for method in METHODS:
            try:
                sl.inverse(robot, poses, model, method)
            except sl.InvalidValueError:
                assert robot.cable_count - robot.degrees_of_freedom != 2  # such a robot takes every method


def statics(robot: sl.Robot, count: int) -> None:
    """Margins, confirmation, equilibria, modes, polygon."""
    poses = poses_of(robot, count, 2)
    plan = sl.inverse(robot, poses)
    sl.margin(robot, poses)
    sl.confirm(plan)
    chosen = int(np.flatnonzero(plan.feasible)[0])
    level = sl.Pose(poses.position[chosen], poses.rotation.as_matrix()[chosen])
    if robot.cable_count - robot.degrees_of_freedom == 2:
        sl.tension_polygon(robot, level)
    state = sl.forward(robot, plan.unstrained_length[chosen]).state
    sl.modes(state)
    sl.stiffness(state)
    sl.dynamic_stiffness(state, [1.0, 2.0])
    sl.frequency_response(state, [0.5, 1.0])
    sl.clearance(state)
    sl.simulate(state, duration=0.05)
    sl.equilibria(robot, plan.unstrained_length[chosen], starts=10)
