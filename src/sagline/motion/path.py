"""Path: poses, velocities and accelerations of the platform at each sample."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from sagline.core.arrays import Array, checked
from sagline.core.errors import InvalidValueError
from sagline.core.results import Shown
from sagline.core.table import Columns, Tabular
from sagline.robot.pose import Pose, PoseLike, pose_of


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Path(Shown, Tabular):
    """Motion of the platform frame over time, in N samples.

    Attributes:
        time: Time of each sample [s], shape (N,), strictly increasing.
        pose: Poses of the platform frame, a batch of N.
        twist: Velocity of the platform's origin [m/s] and angular velocity [rad/s], in world axes, shape (N, 6).
        twist_rate: Acceleration of the platform's origin [m/s^2] and angular acceleration [rad/s^2], in world axes,
            shape (N, 6).
        jerk: d(twist_rate)/dt [m/s^3, rad/s^3], shape (N, 6); None if unknown, for example for sampled poses.
        rests: Times at which the platform rests between two segments, including the first and last time [s], shape
            (R,). They can be between samples. None if unknown, for example for sampled poses.
    """

    _columns: ClassVar[Columns] = (
        "time",
        "pose",
        *(f"{name}=twist.{k}" for k, name in enumerate(("vx", "vy", "vz", "wx", "wy", "wz"))),
    )

    time: Array
    pose: Pose
    twist: Array
    twist_rate: Array
    jerk: Array | None
    rests: Array | None

    def __init__(
        self,
        time: ArrayLike,
        pose: PoseLike,
        twist: ArrayLike,
        twist_rate: ArrayLike,
        jerk: ArrayLike | None = None,
        rests: ArrayLike | None = None,
    ) -> None:
        """Create a path from its fields.

        Args:
            time: Time of each sample [s], shape (N,), strictly increasing.
            pose: A batch of N poses.
            twist: Velocity [m/s] and angular velocity [rad/s], shape (N, 6).
            twist_rate: First time derivatives of the twist [m/s^2, rad/s^2], shape (N, 6).
            jerk: Second time derivatives of the twist [m/s^3, rad/s^3], shape (N, 6), or None.
            rests: Times of rest between segments [s], strictly increasing, from first to last sample time; or None.

        Raises:
            InvalidValueError: If the times do not increase, a number is not finite, or the lengths differ.
        """
        clock, pose = checked_time(time), pose_of(pose)
        samples = clock.size
        if pose.shape != (samples,):
            raise _length_error("pose", f"of shape {pose.shape}", samples)
        object.__setattr__(self, "time", clock)
        object.__setattr__(self, "pose", pose)
        object.__setattr__(self, "jerk", None)
        object.__setattr__(self, "rests", None if rests is None else _checked_rests(rests, clock))
        rates = [("twist", twist, "m/s or rad/s"), ("twist_rate", twist_rate, "m/s^2 or rad/s^2")]
        for name, value, unit in [*rates, *([] if jerk is None else [("jerk", jerk, "m/s^3 or rad/s^3")])]:
            array = checked(value, name, unit, shape=(None, 6))
            if array.shape != (samples, 6):
                raise _length_error(name, f"of shape {array.shape}", samples)
            object.__setattr__(self, name, array)

    def __len__(self) -> int:
        """Number of samples."""
        return self.time.size

    @property
    def duration(self) -> float:
        """Time between the first and the last sample [s]."""
        return float(self.time[-1] - self.time[0])

    def __reduce__(self) -> tuple[type[Path], tuple[Array, Pose, Array, Array, Array | None, Array | None]]:
        """Pickle through the constructor, so that a loaded path is checked and write-locked."""
        return Path, (self.time, self.pose, self.twist, self.twist_rate, self.jerk, self.rests)


def checked_time(time: ArrayLike, item: str = "time") -> Array:
    """Check the sample times [s], strictly increasing, shape (N,) with N >= 1; return a locked copy."""
    clock = checked(time, item, "s", shape=(None,))
    if clock.ndim != 1 or clock.size == 0:
        raise InvalidValueError(item, f"of shape {clock.shape}", "shape (N,), N >= 1", "Give one time for each sample.")
    late = np.flatnonzero(np.diff(clock) <= 0.0)
    if late.size:
        k = int(late[0]) + 1
        raise InvalidValueError(
            f"{item}[{k}]", f"{clock[k]} s", f"> {clock[k - 1]} s (the one before)", "Sort the samples by time."
        )
    return clock


def _checked_rests(rests: ArrayLike, clock: Array) -> Array:
    times = checked_time(rests, "rests")
    if times.size < min(2, clock.size) or times[0] != clock[0] or times[-1] != clock[-1]:
        allowed = f"times from {clock[0]} s to {clock[-1]} s, the first and the last sample's"
        raise InvalidValueError("rests", f"from {times[0]} s to {times[-1]} s", allowed, "Give all rests, or None.")
    return times


def _length_error(item: str, value: str, samples: int) -> InvalidValueError:
    return InvalidValueError(
        item, value, f"one entry for each of the {samples} times", f"Give {item} for every sample."
    )
