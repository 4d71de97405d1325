"""Residuals and slopes of one pose in standard deviations, with what noise of the lengths does to the readings."""

from __future__ import annotations

import math

from sagline.core.arrays import Array
from sagline.kernels.algebra.cholesky import factor_positive
from sagline.kernels.calibration.terms import BESIDE, CalibrationArrays, Linearization, Sensing
from sagline.kernels.jit import glue


@glue
def whiten(sensing: Sensing, residual: Array, space: CalibrationArrays, work: Array) -> None:
    """Leave out what was not read, and fill W with W^T W the inverse of the covariance: the inverse of its factor."""
    readings, m = work.shape[0], residual.size - BESIDE
    for j in range(residual.size):
        if not (abs(residual[j]) < math.inf and space.deviation[j] < math.inf):
            residual[j] = math.nan
            if j >= readings:
                continue
            for i in range(m):
                space.by_length[i, j] = 0.0
            for q in range(work.shape[1]):
                work[j, q] = 0.0
            space.deviation[j] = 1.0
    for j in range(readings):
        for k in range(j + 1):
            total = space.deviation[j] * space.deviation[j] if k == j else 0.0
            for i in range(m):
                deviation = sensing.length_deviation[i]
                total += space.by_length[i, j] * space.by_length[i, k] * deviation * deviation
            space.whole[j, k] = total
            space.whole[k, j] = total
    factor_positive(space.whole, 0.0, space.own)
    for k in range(readings):  # W into whole, column by column
        for j in range(readings):
            space.whole[j, k] = 0.0
        space.whole[k, k] = 1.0 / space.own[k, k]
        for j in range(k + 1, readings):
            total = 0.0
            for q in range(k, j):
                total += space.own[j, q] * space.whole[q, k]
            space.whole[j, k] = -total / space.own[j, j]


@glue
def store_linearization(
    sensing: Sensing, answer: Linearization, p: int, read: Array, lengths: Array, space: CalibrationArrays
) -> None:
    """Write what one pose says."""
    residual, matrix, whole = answer.residual[p], answer.matrix[p], space.whole
    readings, m = matrix.shape[0], lengths.size
    for j in range(readings):
        total = residual[j]
        for i in range(m):
            total -= space.by_length[i, j] * (read[i] - lengths[i])
        space.deviation[j] = 0.0 if math.isnan(residual[j]) else total
    for j in range(readings):
        total = 0.0
        for q in range(matrix.shape[1]):
            matrix[j, q] = 0.0
        for k in range(j + 1):
            total += whole[j, k] * space.deviation[k]
            for q in range(matrix.shape[1]):
                matrix[j, q] += whole[j, k] * answer.work[k, q]
        answer.misfit[p, j] = total
    for i in range(m):
        square = sensing.length_deviation[i] * sensing.length_deviation[i]
        for j in range(readings):
            total = 0.0
            for k in range(j + 1):
                total += whole[j, k] * space.by_length[i, k]
            answer.back[p, i, j] = square * total
