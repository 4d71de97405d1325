"""Findings of a calibration as data: status, omitted rows, directions, outliers, cross-validation."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from sagline.cables.model import CableModel
from sagline.calibration.log import Sensors
from sagline.calibration.parameters import Parameters
from sagline.core.arrays import Array, Indices, locked
from sagline.core.results import Result
from sagline.core.status import Status
from sagline.robot.pose import Pose
from sagline.robot.robot import Robot


class CalibrationStatus(Status):
    """Status of a calibration; `text` states the next step."""

    FOUND = 0, "found"
    DOUBTFUL = (
        1,
        "found, but the readings contradict the model or the deviations: check fixed parameters, residuals and "
        "outliers, and do not trust the standard errors",
    )
    NOT_CONVERGED = (
        2,
        "not converged: check the log, and give better initial values or fewer unknowns",
    )


class Omission(Status):
    """Reason for the omission of a row of a log; `text` describes it for one row."""

    NOT_A_NUMBER = 0, "a reading is missing"
    REPEATED = 1, "the readings repeat an earlier row"
    MOVING = 2, "the platform moved"
    SLACK = 3, "a cable was slack"
    NO_EQUILIBRIUM = 4, "the platform has no equilibrium at these lengths"
    OTHER_EQUILIBRIUM = 5, "the lengths and the other readings give different poses"


@dataclass(frozen=True, slots=True, eq=False)
class Direction(Result):
    """A combination of unknowns that is unobservable or weakly identifiable.

    Attributes:
        name: For example "the world shifted along x", or "pulley_radius with frame_anchors z".
        vector: Change of the parameters for one standard deviation of the combination, in their units, (P,).
        known: Ratio of the standard deviation after the calibration to the prior one: 1 if the readings have no
            information.
        step: Recommended measurement, for example "fix a frame anchor, or measure 3 points".
    """

    name: str
    vector: Array
    known: float
    step: str


@dataclass(frozen=True, slots=True, eq=False)
class Outlier(Result):
    """A pose, or a cable at a pose, that does not fit the other readings.

    Attributes:
        row: Row of the log.
        cable: Index of the cable, or None for the whole pose.
        quantity: "length", "load cell", "position" or "rotation".
        size: Error [m, N or rad].
        deviations: Error in standard deviations.
    """

    row: int
    cable: int | None
    quantity: str
    size: float
    deviations: float


@dataclass(frozen=True, slots=True, eq=False)
class Criticism(Result):
    """Fixed parameters that the readings contradict: their estimation would reduce chi squared more than by chance.

    Attributes:
        name: For example "load_cell_gain common to all cables", "load_cell_gain[3]" or "center_of_mass".
        kind: Kind of unknown, which can be added to the unknowns.
        fall: Reduction of chi squared.
        chance: Probability of such a reduction if the fixed values were correct.
        moves: Label of the estimated parameter that would change most, in standard errors.
        change: This change, in the unit of the parameter.
        deviations: This change in standard errors, >= 0.
    """

    name: str
    kind: str
    fall: float
    chance: float
    moves: str
    change: float
    deviations: float


@dataclass(frozen=True, slots=True, eq=False)
class SensorDeviation(Result):
    """Standard deviation of a kind of sensor, or of the sensor of a cable, from the residuals of a calibration.

    Attributes:
        quantity: "length", "load cell", "position" or "rotation".
        cable: Index of the cable, or None for all cables.
        stated: Standard deviation of `Sensors` [m, N or rad].
        found: Standard deviation from the residuals; NaN if the readings do not determine it.
        error: Standard error of `found`.
    """

    quantity: str
    cable: int | None
    stated: float
    found: float
    error: float


@dataclass(frozen=True, slots=True, eq=False)
class CrossValidation(Result):
    """Errors of predictions at poses that the calibration did not use.

    Attributes:
        folds: Number of parts of the poses.
        tension: Root mean square of load cell readings minus predictions [N]; NaN without load cells.
        position: Root mean square distance from measured positions [m]; NaN without a position measured along all three
            axes.
        tension_before: `tension` with the robot before the calibration [N].
        position_before: `position` with the robot before the calibration [m]; NaN if the measuring system was unknown.
    """

    folds: int
    tension: float
    position: float
    tension_before: float
    position_before: float


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Findings(Result):
    """Base of `Calibration` with the fields documented there."""

    robot: Robot
    before: Robot
    sensors: Sensors
    length_offset: Array
    status: CalibrationStatus
    parameters: Parameters
    values: Array
    covariance: Array
    chi_squared: float
    degrees_of_freedom: int
    rows: Indices
    left_out: Mapping[Omission, Indices]
    poses: Pose
    unstrained_length: Array
    residuals: Array
    chi_squared_of_pose: Array
    weights: Array
    outliers: tuple[Outlier, ...]
    gauge: tuple[Direction, ...]
    cannot_tell_apart: tuple[Direction, ...]
    criticisms: tuple[Criticism, ...]
    cross_validation: CrossValidation | None
    iterations: int
    model: CableModel
    log: str
    date: str

    @property
    def chi_squared_of_all(self) -> tuple[float, int]:
        """Chi squared of the readings of all poses without outliers, with any weight, and its expected value."""
        counted = ~np.isin(self.rows, [outlier.row for outlier in self.outliers])
        change = counted.astype(np.int64) - (self.weights == 1.0)  # 1: added, -1: removed
        readings = np.count_nonzero(~np.isnan(self.residuals[:, self.robot.cable_count :]), axis=1)
        chi_squared = self.chi_squared + float(self.chi_squared_of_pose @ change)
        return chi_squared, self.degrees_of_freedom + int(readings @ change)

    @property
    def standard_error(self) -> Array:
        """Standard deviations of the values, in their units, (P,); infinite if unobserved and without a prior."""
        return locked(np.sqrt(np.diagonal(self.covariance)))

    @property
    def correlation(self) -> Array:
        """Correlation of the values, (P, P); NaN off the diagonal for unobserved values without a prior."""
        error = self.standard_error
        known = np.isfinite(error) & (error > 0.0)
        size = np.where(known, error, np.nan)
        correlation = np.clip(self.covariance / np.outer(size, size), -1.0, 1.0)
        np.fill_diagonal(correlation, 1.0)
        return locked(correlation)
