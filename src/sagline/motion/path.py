"""Path: poses, velocities and accelerations over time; construction of a path from timed poses by splines."""

from __future__ import annotations

from typing import ClassVar

import numpy as np
from attrs import field, frozen
from numpy.typing import ArrayLike

from sagline.core.arrays import Array, checked
from sagline.core.errors import InvalidValueError
from sagline.core.fields import given, if_known, reduced
from sagline.core.results import Columns, Shown, Tabular, set_fields
from sagline.robot.pose import Pose, PoseLike, pose_of


@frozen(eq=False, repr=False, weakref_slot=False)
class Path(Shown, Tabular):
    """Motion of the platform frame over time, at N samples.

    Attributes:
        time: Time of each sample [s], shape (N,), strictly increasing.
        pose: Poses of the platform frame, a batch of N.
        twist: Velocity of the platform's origin [m/s] and angular velocity [rad/s], in world axes, shape (N, 6).
        twist_rate: Acceleration of the platform's origin [m/s^2] and angular acceleration [rad/s^2], in world axes,
            shape (N, 6).
        jerk: d(twist_rate)/dt [m/s^3, rad/s^3], shape (N, 6); None if unknown, for example for sampled poses.
        rests: Times [s] at which the platform is at rest between two segments, including the first and the last time,
            shape (R,), strictly increasing. A rest can be between two samples. None if unknown.

    Raises:
        InvalidValueError: If the times do not increase, if a number is not finite, or if the numbers of samples differ.
    """

    _columns: ClassVar[Columns] = (
        "time",
        "pose",
        *(f"{name}=twist.{k}" for k, name in enumerate(("vx", "vy", "vz", "wx", "wy", "wz"))),
    )

    time: Array = field(converter=given)
    pose: Pose = field(converter=pose_of)
    twist: Array = field(converter=given)
    twist_rate: Array = field(converter=given)
    jerk: Array | None = field(default=None, converter=if_known)
    rests: Array | None = field(default=None, converter=if_known)

    def __attrs_post_init__(self) -> None:
        """Check every field."""
        clock = checked_time(self.time)
        if self.pose.shape != clock.shape:
            raise _length_error("pose", self.pose.shape, clock.size)
        rests = None if self.rests is None else _checked_rests(self.rests, clock)
        set_fields(self, time=clock, rests=rests)
        for name, unit in (("twist", "m/s or rad/s"), ("twist_rate", "m/s^2 or rad/s^2"), ("jerk", "m/s^3 or rad/s^3")):
            if name == "jerk" and self.jerk is None:
                continue
            array = checked(getattr(self, name), name, unit, shape=(None, 6))
            if array.shape != (clock.size, 6):
                raise _length_error(name, array.shape, clock.size)
            set_fields(self, **{name: array})

    def __len__(self) -> int:
        """Number of samples."""
        return self.time.size

    @property
    def duration(self) -> float:
        """Time between the first and the last sample [s]."""
        return float(self.time[-1] - self.time[0])

    __reduce__ = reduced


def checked_time(time: ArrayLike, item: str = "time") -> Array:
    """Read-only copy of strictly increasing sample times [s], shape (N,), N >= 1; raises an error for other times."""
    clock = checked(time, item, "s", shape=(None,))
    if clock.ndim != 1 or clock.size == 0:
        raise InvalidValueError(item, f"of shape {clock.shape}", "shape (N,), N >= 1", "Give one time for each sample.")
    late = np.flatnonzero(np.diff(clock) <= 0.0)
    if late.size:
        k = int(late[0]) + 1
        allowed, step = f"> {clock[k - 1]} s, the previous time", "Sort the samples by time."
        raise InvalidValueError(f"{item}[{k}]", f"{clock[k]} s", allowed, step)
    return clock


def _checked_rests(rests: ArrayLike, clock: Array) -> Array:
    times = checked_time(rests, "rests")
    if times.size < min(2, clock.size) or times[0] != clock[0] or times[-1] != clock[-1]:
        allowed = f"times from {clock[0]} s to {clock[-1]} s, the times of the first and the last sample"
        raise InvalidValueError("rests", f"from {times[0]} s to {times[-1]} s", allowed, "Give all rests, or None.")
    return times


def _length_error(item: str, shape: tuple[int, ...], samples: int) -> InvalidValueError:
    allowed, step = f"one entry for each of the {samples} times", f"Give {item} for every sample."
    return InvalidValueError(item, f"of shape {shape}", allowed, step)


def path_from_samples(time: ArrayLike, pose: PoseLike) -> Path:
    """Create a path from timed poses.

    Cubic splines through positions and quaternions give the velocities and accelerations. The poses are unchanged. At
    each end, one cubic interpolates the outermost four samples (not-a-knot condition), so that a path can begin and end
    in motion. Two samples give a constant velocity, and three samples give a parabola.

    Small errors of the samples cause large errors of the acceleration: position errors up to d [m] at time steps of h
    [s] cause acceleration errors up to 12 d/h^2. Example: positions in whole micrometers (d = 0.5e-6 m) at 100
    samples/s cause errors up to 0.06 m/s^2.

    Args:
        time: Time of each sample [s], shape (N,), strictly increasing, N >= 2.
        pose: N poses, with rotations of less than 180 degrees between consecutive poses.

    Returns:
        Path with the given times and poses. The jerk is None, because a cubic spline does not define a jerk.

    Raises:
        InvalidValueError: If the times do not increase, or are fewer than two; if the numbers of times and poses
            differ.

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
        value = f"of shape {pose.shape} with {clock.size} time{'s' * (clock.size != 1)}"
        allowed = "as many poses as times, at least two"
        raise InvalidValueError("pose", value, allowed, "Give one pose for each time.")
    velocity, acceleration = spline_rates(clock, pose.position)
    angular_velocity, angular_acceleration = _angular_rates(clock, without_sign_changes(pose.quaternion))
    twist = np.hstack((velocity, angular_velocity))
    return Path(clock, pose, twist, np.hstack((acceleration, angular_acceleration)))


def spline_rates(time: Array, values: Array) -> tuple[Array, Array]:
    """First and second time derivatives of the cubic spline through `values` (N, ...), at the times (N,)."""
    from scipy.interpolate import CubicSpline  # slow import, only needed here

    spline = CubicSpline(time, values, bc_type="not-a-knot")
    return spline(time, 1), spline(time, 2)


def without_sign_changes(quaternion: Array) -> Array:
    """Quaternions without sign changes between consecutive samples; q and -q are the same rotation."""
    aligned = np.sum(quaternion[1:] * quaternion[:-1], axis=1) >= 0.0
    sign = np.cumprod(np.concatenate(([1.0], np.where(aligned, 1.0, -1.0))))
    continuous: Array = quaternion * sign[:, None]
    return continuous


def _angular_rates(time: Array, quaternion: Array) -> tuple[Array, Array]:
    """Angular velocity [rad/s] and angular acceleration [rad/s^2] in world axes of a spline through quaternions."""
    # The normalized quaternion has q' = (omega, 0) q / 2, and |q| = 1 at the samples. The derivatives of the spline
    # therefore give omega = 2 vec(q' q*) and omega' = 2 vec(q'' q*) - 2 omega (q . q').
    # RotationSpline of scipy is not used, because its accelerations at both ends are wrong, even with small steps: its
    # first and last velocities are means over the outermost steps.
    rate, curvature = spline_rates(time, quaternion)
    velocity = 2.0 * conjugate_product(rate, quaternion)
    growth = np.sum(quaternion * rate, axis=1, keepdims=True)  # rate of |q|, which is not constant along a spline
    return velocity, 2.0 * conjugate_product(curvature, quaternion) - 2.0 * growth * velocity


def conjugate_product(a: Array, b: Array) -> Array:
    """Vector part (N, 3) of the quaternion products a b*; quaternions (N, 4) with the scalar last."""
    vector: Array = b[:, 3:] * a[:, :3] - a[:, 3:] * b[:, :3] - np.cross(a[:, :3], b[:, :3])
    return vector
