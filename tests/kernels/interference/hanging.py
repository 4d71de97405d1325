"""Catenaries in closed form by the inverse hyperbolic sine, independent of the kernels."""

from __future__ import annotations

from itertools import combinations
from typing import NamedTuple

import numpy as np
from scipy.optimize import minimize

import sagline as sl
from sagline.core.arrays import Array, Indices, locked
from sagline.interference.pairs import cable_rows
from sagline.kernels.interference import shapes
from sagline.kernels.interference.catenary_distance import least_distances, work_arrays_for_pieces


class Hung(NamedTuple):
    """A cable from `start`, toward an angle about z [rad], with a force at its platform end."""

    start: Array
    angle: float
    horizontal: float
    vertical: float
    length: float
    weight: float
    stiffness: float

    def points(self, share: Array | float) -> Array:
        """Points at shares of the unstrained length, shape (..., 3)."""
        s = np.asarray(share) * self.length
        low = self.vertical - self.weight * self.length
        here = low + self.weight * s
        h = self.horizontal
        x = h * s / self.stiffness
        if h > 0.0:
            x = x + h / self.weight * (np.arcsinh(here / h) - np.arcsinh(low / h))
        lift = (here**2 - low**2) / (np.hypot(h, here) + np.hypot(h, low))
        z = lift / self.weight + (low + 0.5 * self.weight * s) * s / self.stiffness
        return np.asarray(self.start + np.stack((np.cos(self.angle) * x, np.sin(self.angle) * x, z), axis=-1))

    @property
    def row(self) -> Array:
        row = np.zeros(shapes.COLUMNS)
        row[shapes.PLACE : shapes.PLACE + 3] = self.start
        row[shapes.LAST] = 1.0
        row[shapes.LEVEL : shapes.LEVEL + 2] = np.cos(self.angle), np.sin(self.angle)
        row[shapes.HORIZONTAL : shapes.STIFFNESS + 1] = self[2:]
        return row


def random_cable(rng: np.random.Generator, kind: str) -> Hung:
    """A cable of a kind: taut, sagging, very slack, vertical, folded, nearly folded, heavy or level."""
    length = float(rng.uniform(0.5, 15.0))
    weight = float(10.0 ** rng.uniform(-1.0, 1.5))
    load = weight * length
    stiffness = float(10.0 ** rng.uniform(3.5, 6.0))
    share = {"taut": 50.0, "sagging": 2.0, "deep": 0.2, "upright": 0.0, "folded": 0.0, "level": 1.0}
    horizontal = load * share.get(kind, 10.0 ** rng.uniform(-9.0, -2.0)) * float(rng.uniform(0.5, 2.0))
    vertical = load * float(rng.uniform(-1.0, 2.0))
    if kind == "upright":
        vertical = load * float(rng.choice([rng.uniform(1.1, 9.0), -rng.uniform(0.1, 9.0)]))
    if kind in ("folded", "nearly folded", "level"):  # the curvature has an extremum inside, perhaps at its very end
        vertical = load * float(rng.choice([0.5, rng.uniform(0.0, 1.0), 1e-14, 1.0 - 1e-14]))
    return Hung(
        rng.uniform(-3.0, 3.0, 3), float(rng.uniform(-4.0, 4.0)), horizontal, vertical, length, weight, stiffness
    )


KINDS = ("taut", "sagging", "deep", "upright", "folded", "nearly folded", "level")


def random_pair(rng: np.random.Generator) -> tuple[Hung, Hung, bool]:
    """Two cables, and True if they are side by side; others cross, nearly cross, have a common end, or neither."""
    one, other = (random_cable(rng, str(rng.choice(KINDS))) for _ in range(2))
    match kind := int(rng.integers(6)):
        case 0:  # they cross
            meet = one.points(rng.random()) - other.points(rng.random())
            other = other._replace(start=other.start + meet)
        case 1:  # they nearly cross
            meet = one.points(rng.random()) - other.points(rng.random())
            other = other._replace(start=other.start + meet + 10.0 ** rng.uniform(-9, -1) * rng.normal(size=3))
        case 2:  # they have a common end
            other = other._replace(start=one.points(1.0) - other.points(1.0) + other.start)
        case 3:  # side by side
            aside = 10.0 ** rng.uniform(-6, 0) if rng.random() < 0.9 else 0.0
            other = one._replace(start=one.start + aside * rng.normal(size=3))
        case _:
            pass
    return one, other, kind == 3


def sampled_distance(one: Hung, other: Hung, count: int = 1501) -> float:
    """Least distance of count x count points [m], improved by a simplex search from the three best ones."""
    share = np.linspace(0.0, 1.0, count)
    a, b = one.points(share), other.points(share)
    squares = (a**2).sum(1)[:, None] + (b**2).sum(1) - 2.0 * a @ b.T
    best = np.inf
    for flat in np.argsort(squares, axis=None)[:3] if count <= 301 else [int(squares.argmin())]:
        i, j = np.unravel_index(flat, squares.shape)

        def apart(at: Array) -> float:
            s, t = np.clip(at, 0.0, 1.0)
            return float(np.linalg.norm(one.points(s) - other.points(t)))

        start = np.array([share[i], share[j]])
        simplex = start + np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]) * np.where(start > 0.5, -0.5, 0.5) / count
        found = minimize(
            apart,
            start,
            method="Nelder-Mead",
            options={"initial_simplex": simplex, "xatol": 1e-13, "fatol": 1e-15, "maxiter": 600},
        )
        best = min(best, float(found.fun), apart(start))
    return best


def all_pairs(count: int) -> Indices:
    """Indices of all pairs of a number of cables."""
    return np.array(list(combinations(range(count), 2)), dtype=np.int64)


def measured(
    moving: Array,
    pairs: Indices | None = None,
    precision: float = 1e-4,
    together: bool = False,
    still: Array | None = None,
) -> tuple[Array, Array, Array]:
    """Distances, lower bounds and nearest points of rows (N, K, COLUMNS)."""
    numbers = all_pairs(moving.shape[1]) if pairs is None else np.asarray(pairs, dtype=np.int64)
    beside = np.zeros((0, shapes.COLUMNS)) if still is None else still
    shape = (len(moving), len(numbers))
    out = np.full(shape, np.nan), np.full(shape, np.nan), np.full((*shape, 2, 3), np.nan)
    rows, others = locked(np.ascontiguousarray(moving)), locked(beside)
    least_distances(rows, others, locked(numbers), precision, together, *work_arrays_for_pieces(), *out)
    return out


def nearest_cable_pairs() -> list[tuple[Array, Array]]:
    """The sixty nearest pairs of cables of four robots at random feasible poses, as rows, without common anchors."""
    rng = np.random.default_rng(60)
    found: list[tuple[float, Array, Array]] = []
    for name in ("article-suspended", "cogiro", "ipanema-1", "expo2015-lucia-pulleys"):
        robot = sl.load_robot(name)
        assert robot.test_box is not None
        places = rng.uniform(robot.test_box.low, robot.test_box.high, (25, 3))
        state = sl.inverse(robot, sl.Pose.from_euler(places, 0.0, 0.0, 0.0)).state
        rows = cable_rows(state, np.zeros(robot.cable_count))
        rows = rows[~np.isnan(rows).any(axis=(1, 2))]
        distance, _, _ = measured(rows)
        for n, p in np.argwhere(distance > 1e-6):
            i, j = all_pairs(robot.cable_count)[p]
            found.append((float(distance[n, p]), rows[n, i], rows[n, j]))
    return [(one, other) for _, one, other in sorted(found, key=lambda entry: entry[0])[:60]]


def agreement(pairs: list[tuple[Array, Array]]) -> float:
    """Largest difference from 1,501 x 1,501 points and simplex search."""
    worst = 0.0
    for rows in pairs:
        cables = [
            Hung(
                row[shapes.PLACE : shapes.PLACE + 3],
                float(np.arctan2(row[shapes.LEVEL + 1], row[shapes.LEVEL])),
                *(float(value) for value in row[shapes.HORIZONTAL : shapes.STIFFNESS + 1]),
            )
            for row in rows
        ]
        found, low, _ = measured(np.array([rows]))
        brute = sampled_distance(cables[0], cables[1])
        assert low[0, 0] <= brute + 1e-12
        worst = max(worst, abs(brute - float(found[0, 0])))
    return worst
