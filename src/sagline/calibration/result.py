"""What a calibration found, and how far it is to be trusted."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from sagline.calibration import words
from sagline.calibration.expected import Known, about_center, expected_at, known_of, moved_at, scatter_of
from sagline.calibration.findings import Findings
from sagline.calibration.pose_error import PoseError
from sagline.core.arguments import choice, instance
from sagline.core.arrays import locked, numbers
from sagline.core.results import Saved
from sagline.kinematics.forward import forward
from sagline.kinematics.forward_solution import ForwardSolution
from sagline.robot.pose import Pose
from sagline.statics.tables import pose_rows

if TYPE_CHECKING:
    pass


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Calibration(Findings, Saved):
    """Result of `calibrate`: P numbers found from the readings at N poses.

    Attributes:
        robot: The robot with what was found.
        before: The robot as it was.
        sensors: The sensors with what was found of the measuring system.
        length_offset: To be added to lengths that the machine believes [m], shape (m,); zero where counts were read.
        status: How it ended.
        parameters: What the numbers are, and their priors.
        values: What was found, in the units of the parameters, (P,).
        covariance: Of the values, (P, P); of what no datum and no prior tells it is infinite along the diagonal.
        chi_squared: Sum of squares of all residuals in standard deviations, priors included.
        degrees_of_freedom: Readings and lengths less what they determine: what chi_squared is to be compared with.
        rows: Rows of the log that were used, (N,).
        left_out: Why, and which rows of the log were not.
        poses: Where the platform stood, N of them.
        unstrained_length: The true lengths of the cables there [m], (N, m).
        residuals: Readings less predictions: lengths [m], load cells [N], position [m], rotation [rad], shape
            (N, 2 m + 6); NaN where nothing was read.
        chi_squared_of_pose: (N,).
        weights: Of the poses: less than 1 for one that does not fit the rest, (N,).
        outliers: Which do not fit, and by how much.
        gauge: Directions that the data leave open, where the priors have them.
        cannot_tell_apart: Directions that they hardly tell.
        cross_validation: Error at poses left out; None where it was not asked for.
        iterations: Of the least squares.
        model: Cable model.
        log: Where the readings come from.
        date: When it was done, ISO 8601.
    """

    def value_of(self, label: str) -> tuple[float, float]:
        """A number that was found and its standard error, both in the unit of its parameter.

        Args:
            label: As `parameters.labels` has it: "frame_anchors[3].x", "mass".

        Raises:
            InvalidValueError: If nothing is called so.
        """
        k = self.parameters.labels.index(choice(label, "label", self.parameters.labels))
        return float(self.values[k]), float(self.standard_error[k])

    def __str__(self) -> str:
        """What was found and how far it is to be trusted, in lines of 80 columns, the verdict first."""
        return words.in_words(self)

    def pose_error(self, pose: Pose) -> PoseError:
        """How far from a commanded pose the platform is to be expected, with this calibration.

        The lengths that `inverse` gives the calibrated robot are paid out by the true one: what the calibration does
        not know moves the platform, and what the winches' lengths are off, `sensors.length_deviation`.

        Args:
            pose: One, or N.

        Returns:
            PoseError; NaN where the robot cannot hold the pose, infinite where it follows what nothing tells.

        Raises:
            InvalidValueError: If it is no pose, or one outside the motions of the robot's pattern.
        """
        poses, lengths = pose_rows(self.poses), np.atleast_2d(self.unstrained_length)
        whole, own = expected_at(self._known(), poses, lengths, instance(pose, Pose, "pose"))
        return PoseError(pose, locked(whole), locked(own))

    def forward(self, unstrained_length: ArrayLike, start: Pose | None = None) -> ForwardSolution:
        """Where the platform rests at lengths that the machine believes, with the covariance of that.

        Args:
            unstrained_length: [m], shape (m,) or (N, m); `length_offset` is added to them.
            start: As of `forward`.

        Returns:
            ForwardSolution of the calibrated robot; `covariance` is that of what the calibration does not know and of
            `sensors.length_deviation` together, NaN where there is no solution.

        Raises:
            InvalidValueError: As of `forward`.
        """
        believed = numbers(unstrained_length, "unstrained_length", "m")
        lengths = believed if believed.shape[-1:] != self.length_offset.shape else believed + self.length_offset
        found = forward(self.robot, lengths, start, self.model)
        rows, shape = np.atleast_2d(found.state.unstrained_length), found.pose.shape
        there = np.isfinite(rows).all(axis=1) & np.atleast_1d(found.stable)
        scatter = np.full((len(rows), 6, 6), np.nan)
        known = self._known()
        scatter[there] = scatter_of(known, moved_at(known, pose_rows(found.pose)[there], rows[there]))
        covariance = about_center(scatter.reshape(*shape, 6, 6), self.robot, found.pose)
        return replace(found, covariance=locked(covariance))

    def _known(self) -> Known:
        return known_of(self.robot, self.model, self.parameters, self.covariance, self.sensors)

    def table(self) -> str:
        """Every number with its standard error, what was there before, and how far it has moved, one a line."""
        return words.table(self)
