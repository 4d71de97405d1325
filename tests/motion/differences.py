"""Velocities and accelerations from poses by central differences, the independent reference of the tests."""

import numpy as np
from scipy.spatial.transform import Rotation


def angular_velocity(quaternion: np.ndarray, step: float) -> np.ndarray:
    """At the inner samples, in world axes: log(R(t + h) R(t - h)^T) / 2h."""
    rotation = Rotation.from_quat(quaternion)
    turn: np.ndarray = (rotation[2:] * rotation[:-2].inv()).as_rotvec()
    return turn / (2.0 * step)


def slope(values: np.ndarray, step: float) -> np.ndarray:
    """At the inner samples: (f(t + h) - f(t - h)) / 2h."""
    difference: np.ndarray = (values[2:] - values[:-2]) / (2.0 * step)
    return difference
