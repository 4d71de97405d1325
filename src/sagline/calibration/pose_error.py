"""Where the platform is to be expected around a commanded pose, after a calibration."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sagline.core.arrays import Array, locked
from sagline.core.numbers import counted, n
from sagline.core.results import Result
from sagline.robot.pose import Pose


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class PoseError(Result):
    """Expected errors of poses, single or with a leading axis N.

    They are those of the platform where a calibrated robot's lengths for a commanded pose are paid out: of all numbers
    that were found, and of lengths that are off by the winches' own deviation.

    Attributes:
        pose: The commanded poses.
        covariance: Of the displacement of the platform frame's origin and its rotation vector, world axes, shape
            (..., 6, 6) [m^2, m rad, rad^2].
        own_covariance: The same but for a shift of the world and a turn about the vertical that the poses of the log
            have in common: what a robot that need not agree with anything outside itself is off.
    """

    pose: Pose
    covariance: Array
    own_covariance: Array

    def __str__(self) -> str:
        """Errors in a line, root mean squares over the poses that the robot can hold."""
        held = ~np.isnan(self.position)
        world, own, turn = (
            n(float(np.sqrt(np.mean(one[held] ** 2))), ".3g", unit) if held.any() else "–"
            for one, unit in ((self.position, "m"), (self.own_position, "m"), (self.rotation, "rad"))
        )
        poses = counted(int(np.count_nonzero(held)), "pose")
        return f"Errors to expect of {poses}: {world} in the world, {own} for itself, {turn}"

    @property
    def position(self) -> Array:
        """Root of the mean square of the distance from the commanded position [m], shape (...)."""
        return _root_of_trace(self.covariance[..., :3, :3])

    @property
    def own_position(self) -> Array:
        """The same by own_covariance [m], shape (...)."""
        return _root_of_trace(self.own_covariance[..., :3, :3])

    @property
    def rotation(self) -> Array:
        """Root of the mean square of the angle [rad], shape (...)."""
        return _root_of_trace(self.covariance[..., 3:, 3:])


def _root_of_trace(covariance: Array) -> Array:
    return locked(np.asarray(np.sqrt(np.trace(covariance, axis1=-2, axis2=-1))))
