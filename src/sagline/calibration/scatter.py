"""Standard deviations of the sensors from the residuals of a calibration: variance components by REML.

docs/model.md, section 14.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np

from sagline.calibration.findings import Findings, SensorDeviation
from sagline.calibration.identifiability import prior_units
from sagline.calibration.log import reading_deviations
from sagline.calibration.observations import unwhitened_slopes
from sagline.calibration.parameters import internal, prior_root, slopes_of_values
from sagline.core.arrays import Array, Flags, Indices
from sagline.core.indices import evenly_spaced
from sagline.statics.tables import pose_rows

QUANTITIES: Final = ("length", "load cell", "position", "rotation")
FEWEST: Final = 10.0  # smallest redundancy of a group of readings for an estimate
LARGEST: Final = 0.3  # largest relative standard error of an estimate
GROSS: Final = 4.5  # smallest outlier, in estimated standard deviations
ROUNDS: Final = 4
MOST: Final = 300  # largest number of poses; more poses reduce the standard errors only
FLOOR: Final = 0.01  # smallest ratio of a variance to its stated value
ITERATIONS: Final = 20
TOLERANCE: Final = 0.01  # relative change of a variance


def sensor_deviations(found: Findings, *, per_cable: bool = False) -> tuple[SensorDeviation, ...]:
    """Standard deviation of each kind of sensor, or of the sensor of each cable, from the residuals.

    Poses with outliers are omitted at first. A pose is used again if its outlier is small in the estimated deviations.
    """
    m = found.robot.cable_count
    stated, ratios = reading_deviations(found.sensors, m), dict.fromkeys(QUANTITIES, 0.0)
    used = np.zeros(0, dtype=np.int64)
    for _ in range(ROUNDS):
        gross = [one.row for one in found.outliers if one.deviations > GROSS * ratios[one.quantity]]
        before, kept = used, np.flatnonzero(~np.isin(found.rows, gross))
        used = kept[evenly_spaced(len(kept), MOST)]
        read = ~np.isnan(found.residuals[used])
        groups = [group for group in _groups(m, per_cable=per_cable) if read[:, group[2]].any()]
        if len(groups) < 2:
            return ()
        if np.array_equal(before, used):
            break
        problem = _linear_problem(found, used, stated)
        factors, errors, redundancy = variance_factors(*problem, [one for *_, one in groups])
        ratios |= {quantity: float(np.sqrt(factor)) for (quantity, *_), factor in zip(groups, factors, strict=True)}
    deviations = []
    for (quantity, cable, one), factor, error, number in zip(groups, factors, errors, redundancy, strict=True):
        given = float(np.sqrt(np.mean(stated[one] ** 2)))
        known = number > FEWEST and error < LARGEST and factor > FLOOR
        now = given * float(np.sqrt(factor)) if known else np.nan
        deviations.append(SensorDeviation(quantity, cable, given, now, now * float(error)))
    return tuple(deviations)


def _groups(m: int, *, per_cable: bool) -> list[tuple[str, int | None, Indices]]:
    """Quantity, cable and columns of each group of readings."""
    ends = np.cumsum([0, m, m, 3, 3])
    found: list[tuple[str, int | None, Indices]] = []
    for k, name in enumerate(QUANTITIES):
        columns = np.arange(*ends[k : k + 2])
        split = per_cable and k < 2
        found += [(name, i, columns[i : i + 1]) for i in range(m)] if split else [(name, None, columns)]
    return found


def _linear_problem(found: Findings, used: Indices, stated: Array) -> tuple[Array, Array, Array, Array]:
    """Whitened slopes (n, R, P), noise (n, R, 2 m + 6), misfit at the priors (n, R), and root of the prior (P, P)."""
    m, parameters = found.robot.cable_count, found.parameters
    lengths = np.atleast_2d(found.unstrained_length)[used]
    by_values, by_length = unwhitened_slopes(
        found.robot, found.model, parameters, found.sensors, pose_rows(found.poses)[used], lengths
    )
    scale = prior_units(parameters).scale
    residuals = found.residuals[used]
    read = ~np.isnan(residuals[:, m:])
    step = (internal(parameters, found.values) - internal(parameters, parameters.prior)) / scale
    slopes = by_values * slopes_of_values(found.robot, parameters) * scale * read[..., None]
    noise = np.concatenate((by_length, np.broadcast_to(np.eye(m + 6), (len(used), m + 6, m + 6))), axis=2)
    noise = noise * np.where(np.isfinite(stated), stated, 0.0) * read[..., None]
    misfit = np.where(read, residuals[:, m:] - np.einsum("nij,nj->ni", by_length, residuals[:, :m]), 0.0)
    whiten = np.linalg.inv(np.linalg.cholesky(noise @ np.swapaxes(noise, 1, 2) + _units(~read)))
    deviation = parameters.prior_deviation / np.where(parameters.logarithmic, np.abs(parameters.prior), 1.0)
    root = prior_root(parameters) * (scale / deviation)
    slopes, misfit = whiten @ slopes, np.einsum("nij,nj->ni", whiten, misfit)
    root *= np.sqrt(len(used) / len(found.rows))  # as much prior information per pose as in the whole log
    return slopes, whiten @ noise, misfit + slopes @ step, root


def _units(missing: Flags) -> Array:
    """Unit variances of missing readings, (n, R, R)."""
    return np.asarray(missing[:, :, None] * np.eye(missing.shape[1]))


def variance_factors(
    rows: Array, noise: Array, misfit: Array, root: Array, groups: Sequence[Indices]
) -> tuple[Array, Array, Array]:
    """Ratios of the variances of groups of errors to the stated ones, by restricted maximum likelihood.

    The ratios are at least `FLOOR`. The method is Fisher scoring (Förstner 1979).

    Args:
        rows: Slopes of N poses by the parameters, (N, R, P), for readings with unit covariance.
        noise: Effects of the errors, each with a standard deviation of 1 if the stated deviations are right, (N, R, E).
        misfit: Readings minus predictions at the priors, (N, R).
        root: Root of the prior information, (P, P).
        groups: Errors of each group, G of them.

    Returns:
        Ratios (G,), relative standard errors of the deviations (G,), and redundancy numbers (G,).
    """
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
    """Traces of P U_g, (G,), and of P U_g P U_h, (G, G).

    P: projection on the residuals of whitened slopes z; U: covariance of the readings by each group of errors.
    """
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
