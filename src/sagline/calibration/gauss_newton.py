"""The step of a calibration's least squares: to the least of the parabola at a state, as far as numbers may go."""

from __future__ import annotations

from typing import Final

import numpy as np
from scipy.linalg import LinAlgError, cho_factor, cho_solve, eigh

from sagline.calibration.problem import Normal, Problem, State
from sagline.core.arrays import Array

OPEN: Final = 1e-13  # of the largest: smaller eigenvalues are rounding


def best_step(problem: Problem, state: State, normal: Normal) -> tuple[Array, float]:
    """The Gauss-Newton step, internal (P,), and what it promises of the sum of squares.

    Along directions that neither data nor priors tell there is no step, and none leads below the least that a number
    may be: where it would, the others go where they fit best beside that.
    """
    scale, deviation = problem.scale, problem.prior_deviation
    known = np.where(np.isfinite(deviation), scale / deviation, 0.0) ** 2
    missed = (state.numbers - problem.prior) / scale
    downhill = scale * normal.gradient - known * missed
    matrix = scale[:, None] * normal.matrix * scale + np.diag(known)
    step = _lowest(matrix, downhill, positive=bool(known.all()))
    room = (problem.least - state.numbers) / scale
    if (step < room).any():
        step = _lowest_within(matrix, downhill, room)
    promised = float(2.0 * step @ downhill - step @ matrix @ step)
    return np.where(step <= room, problem.least - state.numbers, scale * step), promised


def _lowest(matrix: Array, downhill: Array, *, positive: bool) -> Array:
    """Where x^T M x - 2 b^T x is least; zero along what is not told."""
    if positive:
        try:
            return np.asarray(cho_solve(cho_factor(matrix), downhill))
        except LinAlgError:  # what priors tell is rounding beside the readings
            pass
    values, vectors = _told(matrix)
    return np.asarray(vectors @ ((vectors.T @ downhill) / values))


def _lowest_within(matrix: Array, downhill: Array, room: Array) -> Array:
    """The same of all x >= room (P,), which are zero or less."""
    from scipy.optimize import lsq_linear  # of use to few, and a quarter of a second to load

    values, vectors = _told(matrix)
    root = np.sqrt(values)
    found = lsq_linear(root[:, None] * vectors.T, vectors.T @ downhill / root, (room, np.inf), method="bvls")
    return np.where(found.active_mask < 0, room, found.x)  # there, not near there


def _told(matrix: Array) -> tuple[Array, Array]:
    """Eigenvalues that are more than rounding, and their vectors: columns."""
    values, vectors = eigh(matrix)
    told = values > OPEN * values[-1]
    return values[told], vectors[:, told]
