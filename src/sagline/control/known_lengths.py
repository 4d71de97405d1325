"""Comparison of a machine's lengths with the lengths from homing: tolerance, and pose from the lengths."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Final

import numpy as np

from sagline.cables.model import CableModel
from sagline.control.null_space import SIGMAS, cell_sigma
from sagline.core.arrays import Array
from sagline.kinematics.forward import forward
from sagline.kinematics.home import home
from sagline.robot.drum import drum_lever
from sagline.robot.equilibrium import Equilibrium
from sagline.robot.pose import Pose
from sagline.robot.robot import Robot, with_quantities
from sagline.robot.tolerances import UNCERTAIN, value_of
from sagline.robot.winch import Winch

_SHARE: Final = 1e-3  # step of the numerical derivatives, in standard deviations
_READING: Final = ("length_zero", "drum_radius")  # quantities that convert counts to lengths


def length_tolerance(robot: Robot, state: Equilibrium, model: CableModel) -> Array:
    """Allowed difference between lengths of a machine and lengths from homing, 5 sigma [m], shape (m,).

    A difference is due to errors of the load cells, the resolution of the encoders, and errors of the robot's data. The
    errors of the robot's data are its tolerances, or the standard errors of its calibration where these are smaller.
    Each error changes the computed length at the pose of `state`.
    """
    winches = robot.winches
    assert winches is not None  # a controller needs the drums
    length, lever = state.unstrained_length, drum_lever(robot, state.unstrained_length)  # lever: [m/rad]
    variance = sum((part**2 for part in _at_pose(robot, state, model)), np.zeros(robot.cable_count))
    errors = _standard_errors(robot)
    if winches.length_zero is not None:
        variance += np.square(errors.get("length_zero", 0.0))
        variance += np.square(errors.get("drum_radius", 0.0) * (length - winches.length_zero) / lever)
    if winches.counts_per_turn is not None:
        count = 2.0 * np.pi * lever / np.abs(winches.gear * winches.counts_per_turn)
        variance += count**2 / 12.0  # rounding error: uniform distribution over one count
    return np.asarray(SIGMAS * np.sqrt(variance))


def _at_pose(robot: Robot, state: Equilibrium, model: CableModel) -> Iterator[Array]:
    """Standard deviations of the lengths at the pose of `state` [m], one array (m,) for each source of error."""
    winches = robot.winches
    assert winches is not None
    reading = state.cables.frame_end_tension * winches.load_cell_gain + winches.load_cell_bias
    stretch = 1.0 + winches.winding_tension / robot.cables.axial_stiffness

    def change(other: Robot, more: Array | float = 0.0) -> Array:
        """Change of homed lengths per standard deviation, for the robot `other` and readings higher by `more` [N]."""
        there, here = (
            _zeros(home(some, state.pose, read, model=model).winches)
            for some, read in ((other, reading + more), (robot, reading))
        )
        return np.asarray((there - here) / (stretch * _SHARE))

    yield change(robot, _SHARE * cell_sigma(robot))
    for name, error in _standard_errors(robot).items():
        if name in _READING or not UNCERTAIN[name].each:  # the load has no effect, because the tensions are known
            continue
        if not np.isfinite(error).all():
            yield np.full(robot.cable_count, math.inf)
            continue
        for axis in np.eye(3) if UNCERTAIN[name].axes else np.ones(1):
            yield change(_varied(robot, name, _SHARE * error * axis))


def _zeros(winches: Winch | None) -> Array:
    """Zeros of the lengths of the winches after homing."""
    assert winches is not None
    assert winches.length_zero is not None
    return winches.length_zero


def _standard_errors(robot: Robot) -> dict[str, Array]:
    """Standard errors by name: tolerances of the robot, or errors of its calibration where these are smaller."""
    errors = dict(robot.tolerances)
    for name, error in {} if robot.calibration is None else robot.calibration.standard_error.items():
        errors[name] = np.minimum(error, errors.get(name, np.where(np.isfinite(error), error, 0.0)))
    return errors


def _varied(robot: Robot, name: str, change: Array) -> Robot:
    """Copy of the robot in which `change` is added to the quantity `name`."""
    value = value_of(robot, name)
    return robot if value is None else with_quantities(robot, {name: value + change})


def place_of(robot: Robot, length: Array, stated: Pose, model: CableModel) -> str:
    """Describe the pose for the lengths `length` [m], (m,), and the distance of this pose from `stated`."""
    found = forward(robot, length, start=stated, model=model)
    if not found.stable:
        return "at its lengths, the platform has no equilibrium near the stated pose"
    x, y, z = np.round(found.pose.position, 3) + 0.0  # no negative zero
    apart = 1e3 * float(np.linalg.norm(found.pose.position - stated.position))
    turn = 2.0 * math.acos(min(abs(float(found.pose.quaternion @ stated.quaternion)), 1.0))
    away = f"{apart:.1f} mm and {math.degrees(turn):.1f} degrees away"
    return f"at its lengths, the platform is at ({x:.3f}, {y:.3f}, {z:.3f}) m, {away}"
