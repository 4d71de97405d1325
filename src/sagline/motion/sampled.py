"""Path from timed poses, with velocities and accelerations from splines."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from sagline.core.arrays import Array
from sagline.core.errors import InvalidValueError
from sagline.motion.path import Path, checked_time
from sagline.robot.pose import PoseLike, pose_of


def path_from_samples(time: ArrayLike, pose: PoseLike) -> Path:
    """Path from timed poses.

    Cubic splines with continuous second derivatives interpolate position and quaternion. They give the velocities and
    accelerations; the poses are unchanged. At each end, a single cubic goes through the outermost four samples
    (not-a-knot). The path can therefore start and end in motion. Two samples give a constant velocity, and three
    samples give a parabola.

    Errors of the samples reduce the accuracy of the acceleration. Position errors up to d [m] at time steps of h [s]
    cause acceleration errors up to 12 d/h^2. For positions rounded to micrometers (d = 0.5e-6 m) and 100 samples/s,
    this is 0.06 m/s^2.

    Args:
        time: Time of each sample [s], shape (N,), strictly increasing, N >= 2.
        pose: The N poses; the rotation between consecutive poses is less than 180 degrees.

    Returns:
        Path with the given times and poses; its jerk is None, because a cubic spline does not define it.

    Raises:
        InvalidValueError: If the times do not increase, there are less than two times, or the number of poses is
            different.

    Examples:
        >>> import numpy as np
        >>> import sagline as sl
        >>> time = np.linspace(0.0, 2.0, 21)
        >>> pose = sl.Pose.from_euler(np.outer(time**2, [1, 0, 2]), 0, 0, 0)
        >>> path = sl.path_from_samples(time, pose)
        >>> print(path.twist[-1, :3].round(6), path.twist_rate[0, :3].round(6))
        [4. 0. 8.] [2. 0. 4.]
    """
    clock, pose = checked_time(time), pose_of(pose)
    if clock.size < 2 or pose.shape != (clock.size,):
        raise InvalidValueError(
            "pose",
            f"of shape {pose.shape} with {clock.size} time{'s' * (clock.size != 1)}",
            "as many poses as times, at least two",
            "Give one pose for each time.",
        )
    velocity, acceleration = spline_rates(clock, pose.position)
    angular_velocity, angular_acceleration = _angular_rates(clock, _without_sign_changes(pose.quaternion))
    twist = np.hstack((velocity, angular_velocity))
    return Path(clock, pose, twist, np.hstack((acceleration, angular_acceleration)))


def spline_rates(time: Array, values: Array) -> tuple[Array, Array]:
    """First and second derivatives of the cubic spline through the values, at its knots.

    Shapes: time (N,); values (N, ...).
    """
    from scipy.interpolate import CubicSpline  # this import takes longer than the rest of the folder motion

    spline = CubicSpline(time, values, bc_type="not-a-knot")
    return spline(time, 1), spline(time, 2)


def _without_sign_changes(quaternion: Array) -> Array:
    """Make quaternions continuous: each gets the sign closer to its predecessor (q and -q are the same rotation)."""
    aligned = np.sum(quaternion[1:] * quaternion[:-1], axis=1) >= 0.0
    sign = np.cumprod(np.concatenate(([1.0], np.where(aligned, 1.0, -1.0))))
    continuous: Array = quaternion * sign[:, None]
    return continuous


def _angular_rates(time: Array, quaternion: Array) -> tuple[Array, Array]:
    """Angular velocity [rad/s] and acceleration [rad/s^2] in world axes of a spline through unit quaternions.

    The normalized quaternion has q' = (omega, 0) q / 2, and |q| = 1 at the samples. The derivatives of the spline
    therefore give omega = 2 vec(q' q*) and omega' = 2 vec(q'' q*) - 2 omega (q . q').

    scipy's RotationSpline is not used, because its first and last velocities are means over the outermost steps. The
    acceleration at both ends is therefore wrong, even with small steps.
    """
    rate, curvature = spline_rates(time, quaternion)
    velocity = 2.0 * _vector_of_product_with_conjugate(rate, quaternion)
    growth = np.sum(quaternion * rate, axis=1, keepdims=True)  # rate of the norm, which varies along a spline
    return velocity, 2.0 * _vector_of_product_with_conjugate(curvature, quaternion) - 2.0 * growth * velocity


def _vector_of_product_with_conjugate(a: Array, b: Array) -> Array:
    """Vector part of the quaternion product a b*, scalars last, shapes (N, 4) -> (N, 3)."""
    vector: Array = b[:, 3:] * a[:, :3] - a[:, 3:] * b[:, :3] - np.cross(a[:, :3], b[:, :3])
    return vector
