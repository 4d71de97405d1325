"""Random feasible and empty sets in the null space, and their corners by brute force."""

from __future__ import annotations

import itertools
import math
from typing import NamedTuple

import numpy as np
from scipy.optimize import linprog

from sagline.core.arrays import Array, Indices
from sagline.kernels.algebra.bounds import HIGH, LOW, START
from sagline.kernels.algebra.programs import ActiveSet, Basis
from sagline.kernels.tension.nearest import ReferencePoint
from sagline.kernels.tension.polygon import SPARE_CORNERS, WorkArrays
from tests.kernels.compiled import memory


class Problem(NamedTuple):
    bounds: Array
    null: Array

    @property
    def is_feasible(self) -> bool:
        """Verdict of a linear program."""
        return bool(self.program(np.zeros(len(self.null))).status == 0)

    @property
    def is_endless(self) -> bool:
        """True for an unbounded set: a direction never leaves a bound with two finite limits.

        Of such ways up to a length, the linear program finds one along which tensions without upper limits grow most.
        """
        closed = np.isfinite(self.bounds[HIGH])
        if np.linalg.matrix_rank(self.null) < len(self.null):
            return True
        grows = self.null[:, ~closed]
        found = linprog(
            -grows.sum(axis=1),
            A_ub=-grows.T if grows.size else None,
            b_ub=np.zeros(grows.shape[1]) if grows.size else None,
            A_eq=self.null[:, closed].T if closed.any() else None,
            b_eq=np.zeros(closed.sum()) if closed.any() else None,
            bounds=(-1.0, 1.0),
        )
        assert found.status == 0
        return bool(found.fun < -1e-9)

    def program(self, cost: Array) -> linprog:
        """Least cost over the set by SciPy."""
        finite = np.isfinite(self.bounds[HIGH])
        rows = np.concatenate((-self.null.T, self.null.T[finite]))
        start = self.bounds[START]
        sides = np.concatenate((start - self.bounds[LOW], (self.bounds[HIGH] - start)[finite]))
        scale = np.abs(sides).max()
        found = linprog(cost, A_ub=rows, b_ub=sides / scale, bounds=(None, None))
        if found.status == 0:
            found.x, found.fun = found.x * scale, found.fun * scale
        return found

    def tensions(self, point: Array) -> Array:
        return np.asarray(self.bounds[START] + point @ self.null)

    def keeps_limits(self, tensions: Array, slack: float = 1e-10) -> bool:
        return bool(((tensions >= self.bounds[LOW] - slack) & (tensions <= self.bounds[HIGH] + slack)).all())


def random_problem(rng: np.random.Generator, m: int, r: int, feasible: bool = True, open_share: float = 0.0) -> Problem:
    """Tensions of some hundred newtons; START is perpendicular to the null space, like the minimum norm."""
    null = np.linalg.qr(rng.normal(size=(m, r)))[0].T.copy()
    bounds = np.zeros((3, m))
    start = rng.uniform(20.0, 200.0, m)
    bounds[START] = start - null.T @ (null @ start)
    middle = start if feasible else start + rng.normal(size=m) * 200.0
    bounds[LOW] = middle - rng.uniform(5.0, 60.0, m)
    bounds[HIGH] = middle + rng.uniform(5.0, 60.0, m)
    bounds[HIGH, rng.uniform(size=m) < open_share] = math.inf
    return Problem(bounds, null)


def nearness(r: int, reference: Array | None = None, previous: Array | None = None) -> ReferencePoint:
    """Work arrays for the point of r redundant cables, nearest to a reference or to 0."""
    held = ActiveSet(
        np.zeros(r + 2, dtype=np.int64),
        np.full((r + 1, r), np.nan),
        np.full((r + 1, r + 1), np.nan),
        np.full((2, r + 1), np.nan),
    )
    before = np.full(1, np.nan) if previous is None else previous
    return ReferencePoint(before, np.zeros(r) if reference is None else reference.copy(), held, np.full(r, np.nan))


def room_of(m: int, r: int) -> WorkArrays:
    """Work arrays of the tension distribution methods in their initial state."""
    labels = np.full(2 * m + SPARE_CORNERS, -1, dtype=np.int64)
    corners = np.full((2 * m + SPARE_CORNERS, 2), np.nan)
    return WorkArrays(corners, labels, np.zeros(1, dtype=np.int64), basis_of(r + 1), memory())


def basis_of(d: int) -> Basis:
    labels = np.full(d + 1, -1, dtype=np.int64)
    return Basis(labels, np.full(d + 1, np.nan), np.full((d, d), np.nan))


def corner_room(m: int) -> tuple[Array, Indices]:
    return np.full((2 * m + SPARE_CORNERS, 2), np.nan), np.full(2 * m + SPARE_CORNERS, -1, dtype=np.int64)


def brute_corners(problem: Problem, slack: float = 1e-9) -> Array:
    """All intersections of two limits that satisfy all others (K, 2)."""
    bounds, null = problem
    sides = [(null[:, i], bounds[row, i] - bounds[START, i]) for i in range(null.shape[1]) for row in (LOW, HIGH)]
    found: list[Array] = []
    for (a, u), (b, v) in itertools.combinations([s for s in sides if math.isfinite(s[1])], 2):
        pair = np.array([a, b])
        if abs(np.linalg.det(pair)) > 1e-12:
            corner = np.linalg.solve(pair, [u, v])
            new = all(np.abs(corner - other).max() > 10 * slack for other in found)
            if new and problem.keeps_limits(problem.tensions(corner), slack):
                found.append(corner)
    return np.array(found).reshape(-1, 2)


def area_of(corners: Array) -> float:
    """Signed area of a polygon, positive counter-clockwise."""
    x, y = corners.T
    return float(0.5 * (x @ np.roll(y, -1) - y @ np.roll(x, -1)))
