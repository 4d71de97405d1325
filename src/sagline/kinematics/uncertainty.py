"""Uncertainty of a plan: errors of poses and tensions due to the tolerances of the robot."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from sagline.core.arrays import Array, locked
from sagline.core.numbers import n
from sagline.core.results import Columns, Result, Tabular
from sagline.motion.path import Path
from sagline.robot.equilibrium import Equilibrium


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Uncertainty(Result, Tabular):
    """Result of `Plan.uncertainty`: errors at one pose, or at N poses with a leading axis N.

    K is the number of quantities with a tolerance. The values are NaN at poses that are not solved.

    Attributes:
        state: Robot, poses and cables of the plan.
        path: The path of the plan; None for poses without times.
        names: The quantities with a tolerance, K names of `Robot.tolerances`.
        covariance: Covariance of the displacement of the platform frame's origin and of its rotation vector, world
            axes, shape (..., 6, 6) [m^2, m rad, rad^2].
        pose_variance: Part of the diagonal of `covariance` due to each quantity, shape (..., 6, K) [m^2, rad^2].
        tension_variance: Variance of the frame-end tensions due to each quantity, shape (..., m, K) [N^2].
    """

    _columns: ClassVar[Columns] = (
        "path.time",
        "state.pose",
        "position",
        "rotation",
        "position_source",
        "dT#=tension",
        "tension_source",
    )

    state: Equilibrium
    path: Path | None
    names: tuple[str, ...]
    covariance: Array
    pose_variance: Array
    tension_variance: Array

    def __str__(self) -> str:
        """Text in one line: the largest errors, and the quantities that contribute most to them."""
        known = np.isfinite(np.atleast_1d(self.position))
        if not known.any():
            return "No pose is solved, so that no error is known"
        position, rotation, tension = (
            np.atleast_1d(one)[known] for one in (self.position, self.rotation, self.tension.max(axis=-1))
        )
        far, taut = int(np.argmax(position)), int(np.argmax(tension))
        sources = (np.atleast_1d(one)[known] for one in (self.position_source, self.tension_source))
        by_position, by_tension = (str(one[k]) for one, k in zip(sources, (far, taut), strict=True))
        return (
            f"Expected errors: position up to {n(1e3 * position[far], '.3g', 'mm')} (mostly {by_position}), rotation "
            f"up to {n(float(rotation.max()), '.3g', 'rad')}, tensions up to {n(tension[taut], '.3g', 'N')} (mostly "
            f"{by_tension})"
        )

    @property
    def position(self) -> Array:
        """Expected distance between actual and planned position [m], as a root mean square, shape (...)."""
        return locked(np.asarray(np.sqrt(self.pose_variance[..., :3, :].sum(axis=(-2, -1)))))

    @property
    def rotation(self) -> Array:
        """Expected angle between actual and planned rotation [rad], as a root mean square, shape (...)."""
        return locked(np.asarray(np.sqrt(self.pose_variance[..., 3:, :].sum(axis=(-2, -1)))))

    @property
    def tension(self) -> Array:
        """Standard deviations of the frame-end tensions [N], shape (..., m)."""
        return locked(np.sqrt(self.tension_variance.sum(axis=-1)))

    @property
    def position_source(self) -> NDArray[Any]:
        """Name of the quantity that contributes most to the variance of the position, shape (...); "" if not solved."""
        return self._largest(self.pose_variance[..., :3, :].sum(axis=-2))

    @property
    def tension_source(self) -> NDArray[Any]:
        """Name of the quantity that contributes most to the variance of all tensions, shape (...); "" if not solved."""
        return self._largest(self.tension_variance.sum(axis=-2))

    def _largest(self, parts: Array) -> NDArray[Any]:
        named = np.array((*self.names, ""))
        return named[np.where(np.isnan(parts).any(axis=-1), len(self.names), np.argmax(parts, axis=-1))]
