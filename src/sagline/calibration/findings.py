"""Findings of a calibration as data, and standard deviations of the sensors (REML; docs/model.md, section 14)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Final

import numpy as np

from sagline.cables.model import CableModel
from sagline.calibration.log import Sensors, count_of_frequencies, reading_deviations
from sagline.calibration.observations import MachineTerms, unwhitened_slopes
from sagline.calibration.parameters import Parameters, PriorUnits
from sagline.calibration.straight import whitened_errors
from sagline.core.arguments import evenly_spaced
from sagline.core.arrays import Array, Flags, Indices, locked
from sagline.core.results import Result, Status
from sagline.kernels import codes
from sagline.kernels.calibration import kinds
from sagline.robot.pose import Pose
from sagline.robot.robot import Robot
from sagline.statics.tables import pose_rows


class CalibrationStatus(Status):
    """Status of a calibration; `text` states the next step."""

    FOUND = 0, "found"
    DOUBTFUL = (
        1,
        "found, but the readings contradict the model or the deviations: check fixed parameters, residuals and "
        "outliers, and do not trust the standard errors",
    )
    NOT_CONVERGED = (2, "not converged: check the log, and give better initial values or fewer unknowns")


class Omission(Status):
    """Reason why a row of a log is omitted; `text` states the reason for one row."""

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
        known: Standard deviation after the calibration divided by the prior standard deviation.
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
        quantity: "length", "load cell", "position", "rotation", "swivel angle" or "frequency".
        size: Error [m, N, rad or Hz].
        deviations: Error in standard deviations.
    """

    row: int
    cable: int | None
    quantity: str
    size: float
    deviations: float


@dataclass(frozen=True, slots=True, eq=False)
class Criticism(Result):
    """Fixed parameters that the readings contradict, because their estimation would clearly reduce chi squared.

    Attributes:
        name: For example "load_cell_gain common to all cables", "load_cell_gain[3]" or "center_of_mass".
        kind: Name of the unknown to add, so that the calibration estimates the parameters.
        fall: Reduction of chi squared.
        chance: Probability that chi squared falls by `fall` if the fixed values are correct.
        moves: Label of the estimated parameter with the largest change in standard errors.
        change: Change of the parameter `moves`, in its unit.
        deviations: Absolute value of `change` in standard errors.
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
    """Standard deviation of a kind of sensor, or of one cable's sensor, computed from the residuals of a calibration.

    Attributes:
        quantity: "length", "load cell", "position", "rotation", "swivel angle" or "frequency".
        cable: Index of the cable, or None if all cables have the same standard deviation.
        stated: Standard deviation of `Sensors` [m, N or rad].
        found: Standard deviation from the residuals; NaN if the readings do not determine a value.
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
        tension: Root mean square difference between load cell readings and predictions [N]; NaN without load cells.
        position: Root mean square distance of measured and predicted positions [m]; NaN without complete positions.
        tension_before: As `tension`, but predicted with the robot before the calibration [N].
        position_before: As `position`, but predicted with the robot before the calibration [m]; NaN if the pose of the
            measuring system was unknown.
    """

    folds: int
    tension: float
    position: float
    tension_before: float
    position_before: float


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Findings(Result):
    """Base class of `Calibration`, which documents the fields."""

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
        """Chi squared of all poses without outliers, including poses with a reduced weight, and its expected value."""
        counted = ~np.isin(self.rows, [outlier.row for outlier in self.outliers])
        change = counted.astype(np.int64) - (self.weights == 1.0)  # 1: pose is added, -1: pose is removed
        readings = np.count_nonzero(~np.isnan(self.residuals[:, self.robot.cable_count :]), axis=1)
        chi_squared = self.chi_squared + float(self.chi_squared_of_pose @ change)
        return chi_squared, self.degrees_of_freedom + int(readings @ change)

    @property
    def standard_error(self) -> Array:
        """Standard errors (P,) of the values in their units; infinite for an unobserved value without a prior."""
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


QUANTITIES: Final = ("length", "load cell", "position", "rotation", "swivel angle", "frequency")
UNITS: Final = dict(zip(QUANTITIES, ("m", "N", "m", "rad", "rad", "Hz"), strict=True))
FEWEST: Final = 10.0  # smallest redundancy of a group of readings for which there is an estimate
LARGEST: Final = 0.3  # largest relative standard error of an estimate; otherwise there is no estimate
GROSS: Final = 4.5  # standard deviations: a smaller error is not an outlier
ROUNDS: Final = 4
MOST: Final = 300  # largest number of poses for the estimate; more poses would only reduce its standard errors
FLOOR: Final = 0.01  # smallest ratio of a variance to its stated value
ITERATIONS: Final = 20
TOLERANCE: Final = 0.01  # the iteration ends if no variance changes by more, relative to its value


def sensor_deviations(found: Findings, *, per_cable: bool = False) -> tuple[SensorDeviation, ...]:
    """Standard deviation of each kind of sensor, or of each cable's sensor, computed from the residuals."""
    # The first estimate omits poses with outliers. Later estimates include poses with small outliers.
    m = found.robot.cable_count
    modes = count_of_frequencies(found.sensors, m, found.residuals.shape[1])
    stated, ratios = reading_deviations(found.sensors, m, modes), dict.fromkeys(QUANTITIES, 0.0)
    used = np.zeros(0, dtype=np.int64)
    for _ in range(ROUNDS):
        gross = [one.row for one in found.outliers if one.deviations > GROSS * ratios[one.quantity]]
        before, kept = used, np.flatnonzero(~np.isin(found.rows, gross))
        used = kept[evenly_spaced(len(kept), MOST)]
        read = ~np.isnan(found.residuals[used])
        groups = [group for group in _groups(m, modes, read.shape[1], per_cable=per_cable) if read[:, group[2]].any()]
        if len(groups) < 2:
            return ()
        if np.array_equal(before, used):
            break
        problem = _linear_problem(found, used, stated)
        factors, errors, redundancy = _variance_factors(*problem, [one for *_, one in groups])
        ratios |= {quantity: float(np.sqrt(factor)) for (quantity, *_), factor in zip(groups, factors, strict=True)}
    deviations = []
    for (quantity, cable, one), factor, error, number in zip(groups, factors, errors, redundancy, strict=True):
        given = float(np.sqrt(np.mean(stated[one][np.isfinite(stated[one])] ** 2)))
        known = number > FEWEST and error < LARGEST and factor > FLOOR
        now = given * float(np.sqrt(factor)) if known else np.nan
        deviations.append(SensorDeviation(quantity, cable, given, now, now * float(error)))
    return tuple(deviations)


def columns_of(cables: int, modes: int, width: int) -> dict[str, slice]:
    """Columns of each of the `QUANTITIES` among `width` columns of residuals; `modes`: number of frequencies."""
    ends = np.cumsum([0, cables, cables, 3, 3, width - 2 * cables - 6 - modes, modes]).tolist()
    return {name: slice(*part) for name, part in zip(QUANTITIES, pairwise(ends), strict=True)}


def _groups(m: int, modes: int, width: int, *, per_cable: bool) -> list[tuple[str, int | None, Indices]]:
    """Quantity, cable and columns of each group of readings; width: number of columns; modes: of frequencies."""
    found: list[tuple[str, int | None, Indices]] = []
    for k, (name, part) in enumerate(columns_of(m, modes, width).items()):
        columns = np.arange(part.start, part.stop)
        split = per_cable and k in (0, 1, 4) and columns.size > 0
        found += [(name, i, columns[i : i + 1]) for i in range(m)] if split else [(name, None, columns)]
    return found


def _linear_problem(found: Findings, used: Indices, stated: Array) -> tuple[Array, Array, Array, Array]:
    """Whitened slopes (n, R, P), effects of errors (n, R, m + R), misfit (n, R) and root of the prior (P, P)."""
    m, parameters = found.robot.cable_count, found.parameters
    lengths = np.atleast_2d(found.unstrained_length)[used]
    scale = PriorUnits(parameters).scale
    step = (parameters.internal(found.values) - parameters.internal(parameters.prior)) / scale
    root = parameters.prior_root * scale
    root *= np.sqrt(len(used) / len(found.rows))  # the prior information per pose is the same as in the whole log
    if found.model.code == codes.STRAIGHT:
        numbers = found.length_offset, parameters.of_cables(found.values, kinds.SCALE, 1.0)
        machine = MachineTerms(found.robot, found.model, parameters, found.sensors, *numbers)
        slopes = machine.winch_slopes(lengths)
        rows, noise, misfit = whitened_errors(machine, slopes, pose_rows(found.poses)[used], found.residuals[used])
        return rows * scale, noise, misfit + rows * scale @ step, root
    residuals = found.residuals[used]
    modes = count_of_frequencies(found.sensors, m, residuals.shape[1])
    machine = MachineTerms(found.robot, found.model, parameters, found.sensors)
    frequencies = residuals[:, residuals.shape[1] - modes :] if modes else None
    by_values, by_length = unwhitened_slopes(machine, pose_rows(found.poses)[used], lengths, frequencies)
    read = ~np.isnan(residuals[:, m:])
    slopes = by_values * machine.slopes * scale * read[..., None]
    noise = np.concatenate((by_length, np.broadcast_to(np.eye(read.shape[1]), (*read.shape, read.shape[1]))), axis=2)
    noise = noise * np.where(np.isfinite(stated), stated, 0.0) * read[..., None]
    misfit = np.where(read, residuals[:, m:] - np.einsum("nij,nj->ni", by_length, residuals[:, :m]), 0.0)
    whiten = np.linalg.inv(np.linalg.cholesky(noise @ np.swapaxes(noise, 1, 2) + _units(~read)))
    slopes, misfit = whiten @ slopes, np.einsum("nij,nj->ni", whiten, misfit)
    return slopes, whiten @ noise, misfit + slopes @ step, root


def _units(missing: Flags) -> Array:
    """Covariance (n, R, R) with the variance 1 for missing readings and 0 for all other readings."""
    return np.asarray(missing[:, :, None] * np.eye(missing.shape[1]))


def _variance_factors(
    rows: Array, noise: Array, misfit: Array, root: Array, groups: Sequence[Indices]
) -> tuple[Array, Array, Array]:
    """Estimated variances divided by stated variances, for groups of errors, by restricted maximum likelihood."""
    # The ratios (G,) are at least `FLOOR`; relative standard errors of the deviations (G,) and redundancy numbers (G,)
    # follow. The method is Fisher scoring (Förstner 1979). rows: derivatives of the whitened readings, (N, R, P);
    # noise: effects (N, R, E) of E errors with the stated variance 1 on these readings; misfit: readings minus
    # predictions at the priors, (N, R); root: root of the prior information, (P, P).
    factors = np.ones(len(groups))
    parts, missing = [noise[:, :, group] for group in groups], _units(np.asarray(~noise.any(axis=2)))
    for _ in range(ITERATIONS):
        whole = sum((f * part @ np.swapaxes(part, 1, 2) for f, part in zip(factors, parts, strict=True)), missing)
        whiten = np.linalg.inv(np.linalg.cholesky(whole))
        own, z, y = [whiten @ part for part in parts], whiten @ rows, np.einsum("nij,nj->ni", whiten, misfit)
        flat = z.reshape(-1, z.shape[2])
        covariance = np.asarray(np.linalg.pinv(flat.T @ flat + root.T @ root, hermitian=True))
        rest = y - z @ (covariance @ (flat.T @ y.reshape(-1)))
        squares = np.array([np.sum((np.swapaxes(part, 1, 2) @ rest[..., None]) ** 2) for part in own])
        redundancy, fisher = _information(own, z, covariance)
        scaled = fisher * np.outer(factors, factors)
        change = np.linalg.solve(scaled, factors * (squares - redundancy))
        before, factors = factors, np.maximum(factors * np.clip(1.0 + change, 0.25, 4.0), FLOOR)
        if np.abs(factors / before - 1.0).max() < TOLERANCE:
            break
    return factors, np.sqrt(0.5 * np.diag(np.linalg.inv(scaled))), before * redundancy


def _information(own: list[Array], z: Array, covariance: Array) -> tuple[Array, Array]:
    """Traces of P U_g, shape (G,), and traces of P U_g P U_h, shape (G, G), for groups g and h of errors."""
    # P: projection of the readings on the residuals of a fit with slopes `z`; U_g: covariance that group g causes.
    along = [np.swapaxes(part, 1, 2) @ z for part in own]
    steps = [each @ covariance for each in along]
    seen = [
        step.reshape(-1, z.shape[2]).T @ each.reshape(-1, z.shape[2]) for step, each in zip(steps, along, strict=True)
    ]
    redundancy = np.array([np.sum(part**2) - np.trace(s) for part, s in zip(own, seen, strict=True)])
    fisher = np.empty((len(own), len(own)))
    for g, first in enumerate(own):
        for h in range(g + 1):
            both = np.swapaxes(first, 1, 2) @ own[h]
            leverage = np.sum(both * (steps[g] @ np.swapaxes(along[h], 1, 2)))
            fisher[g, h] = fisher[h, g] = np.sum(both**2) - 2.0 * leverage + np.sum(seen[g] * seen[h].T)
    return redundancy, fisher
