"""The motion of a plan an instant before and after each of its samples, as its path's rates continue it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from sagline.core.arrays import Array, Indices
from sagline.motion.path import Path
from sagline.motion.sampled import spline_rates
from sagline.robot.pose import Pose
from sagline.robot.several import Robots
from sagline.statics.balance import inertial_wrench

SHARE = 1e-5  # of the time in which the motion changes: differences over it are good to 1e-9
LONGEST = 1e-2  # of the time between samples
_CONSTANT = 1e-9  # of the largest part of a wrench: what differs by less does not change


class Instant(NamedTuple):
    """One moment near every sample.

    Attributes:
        pose: Poses, a batch of N.
        wrench: External plus inertial wrench, shape (N, 6).
    """

    pose: Pose
    wrench: Array

    def part(self, samples: Indices) -> Instant:
        """Those near some of the samples.

        Args:
            samples: Which (k,).

        Returns:
            Instant of k samples.
        """
        return Instant(self.pose[samples], self.wrench[samples])


class Instants(NamedTuple):
    """Before and after every sample.

    Attributes:
        before: A step before.
        after: A step after.
        later: Two steps after.
        step: The step [s].
    """

    before: Instant
    after: Instant
    later: Instant
    step: float


def instants(robot: Robots, path: Path, wrench: Array) -> Instants:
    """The poses and wrenches a step before and after each sample of a path.

    Args:
        robot: The robot, or one a sample.
        path: The path. Where it knows no jerk, that is taken from a spline through its accelerations.
        wrench: External plus inertial wrench at the samples (N, 6); the external part is interpolated by a spline.

    Returns:
        Instants; the step is chosen by the speed at which the motion changes.
    """
    jerk = path.jerk if path.jerk is not None else _rate(path.time, path.twist_rate)
    external = wrench - inertial_wrench(robot, path.pose, path.twist, path.twist_rate)
    changing = float(np.ptp(external, axis=0).max()) > _CONSTANT * float(np.abs(wrench).max())
    external_rate = _rate(path.time, external) if changing else np.zeros_like(external)
    step = _step(path, jerk)

    def at(h: float) -> Instant:
        pose = _moved(path, jerk, h)
        twist = path.twist + h * (path.twist_rate + 0.5 * h * jerk)
        inertial = inertial_wrench(robot, pose, twist, path.twist_rate + h * jerk)
        return Instant(pose, inertial + external + h * external_rate)

    return Instants(at(-step), at(step), at(2.0 * step), step)


def _rate(time: Array, values: Array) -> Array:
    return spline_rates(time, values)[0] if len(time) > 1 else np.zeros_like(values)


def _step(path: Path, jerk: Array) -> float:
    """A small share of the time in which the motion changes by a meter or a radian, or of that between samples."""
    rates = (path.twist, path.twist_rate, jerk)
    quickest = max(float(np.abs(rate).max()) ** (1.0 / order) for order, rate in enumerate(rates, start=1))
    between = float(np.diff(path.time).min()) if len(path) > 1 else 1.0
    return min(LONGEST * between, SHARE / quickest if quickest > 0.0 else np.inf)


def _moved(path: Path, jerk: Array, h: float) -> Pose:
    """The poses a time h later, to third order in position and second in orientation, whose third is even in h."""
    from scipy.spatial.transform import Rotation  # takes a third of the time that sagline takes to load

    move = h * (path.twist + 0.5 * h * (path.twist_rate + h / 3.0 * jerk))
    turned = path.pose.quaternion
    if path.twist[:, 3:].any() or path.twist_rate[:, 3:].any():
        turned = (Rotation.from_rotvec(move[:, 3:]) * path.pose.rotation).as_quat()
    return Pose.from_quaternion(path.pose.position + move[:, :3], turned)
