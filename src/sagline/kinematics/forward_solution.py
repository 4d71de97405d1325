"""What the forward kinematics answers."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sagline.core.arrays import Array, Codes, Flags, Indices
from sagline.core.results import Result
from sagline.kinematics.forward_status import STABLE, ForwardStatus
from sagline.robot.equilibrium import Equilibrium
from sagline.robot.pose import Pose


@dataclass(frozen=True, slots=True, eq=False)
class ForwardSolution(Result):
    """Result of `forward`: a single sample, or N of them with a leading axis.

    Attributes:
        state: Robot, poses, wrench and cables in equilibrium; NaN where the lengths were NaN.
        status: Codes of `ForwardStatus`, shape () or (N,).
        stiffness_min: Smallest stiffness of the platform against its free motions [N/m], shape () or (N,). A rotation
            counts by the arc it makes at the root mean square distance of the platform ends from the center of mass.
        energy: Potential energy of cables, weight and given force [J], shape () or (N,); frame ends and the origin
            of the world are at zero. The shallow models have none: NaN. Straight cables: what they minimize
            instead, half the sum of squared length errors [m^2].
        wrench_residual: Norms of the unbalanced force [N] and moment [N m] in the platform's free motions,
            shape (2,) or (N, 2).
        iterations: Newton steps taken, shape () or (N,).
        covariance: Of the pose found from measured tensions: displacement of the center of mass [m] and rotation
            vector [rad], world axes, shape (6, 6) or (N, 6, 6). None where no tensions were measured.
    """

    state: Equilibrium
    status: Codes
    stiffness_min: Array
    energy: Array
    wrench_residual: Array
    iterations: Indices
    covariance: Array | None = None

    @property
    def pose(self) -> Pose:
        """Where the platform rests."""
        return self.state.pose

    @property
    def solved(self) -> Flags:
        """Whether each sample is a stable equilibrium in which the cables hold the platform, shape () or (N,)."""
        return np.asarray(self.status == ForwardStatus.SOLVED)

    @property
    def stable(self) -> Flags:
        """Whether each sample is a stable equilibrium, however it is held, shape () or (N,)."""
        return np.isin(self.status, STABLE)

    @property
    def slack(self) -> Flags:
        """Which cables hang rather than pull, shape (m,) or (N, m): tau at most half the weight of the chord's length.

        Such a cable sags by a quarter of its chord or more. A weightless one is slack when it carries nothing.
        """
        cables = self.state.cables
        density = np.zeros(()) if cables.model.weightless else cables.cable.linear_density
        return np.asarray(cables.chord_tension <= 0.5 * density * cables.gravity * cables.chord)
