"""Cables as they hang, in closed form by the inverse hyperbolic sine: nothing here is taken from the kernels."""

from __future__ import annotations

from itertools import combinations
from typing import NamedTuple

import numpy as np
from scipy.optimize import minimize

from sagline.arrays import Array
from sagline.kernels.interference import shapes


class Hung(NamedTuple):
    """A cable from `start`, toward an angle about z [rad], by the force at its platform end."""

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
    """A cable of a kind: taut, sagging, deep, upright, folded, nearly folded, heavy or level."""
    length = float(rng.uniform(0.5, 15.0))
    weight = float(10.0 ** rng.uniform(-1.0, 1.5))
    load = weight * length
    stiffness = float(10.0 ** rng.uniform(3.5, 6.0))
    share = {"taut": 50.0, "sagging": 2.0, "deep": 0.2, "upright": 0.0, "folded": 0.0, "level": 1.0}
    horizontal = load * share.get(kind, 10.0 ** rng.uniform(-9.0, -2.0)) * float(rng.uniform(0.5, 2.0))
    vertical = load * float(rng.uniform(-1.0, 2.0))
    if kind == "upright":
        vertical = load * float(rng.choice([rng.uniform(1.1, 9.0), -rng.uniform(0.1, 9.0)]))
    if kind in ("folded", "nearly folded", "level"):  # it turns inside, perhaps at its very end
        vertical = load * float(rng.choice([0.5, rng.uniform(0.0, 1.0), 1e-14, 1.0 - 1e-14]))
    return Hung(
        rng.uniform(-3.0, 3.0, 3), float(rng.uniform(-4.0, 4.0)), horizontal, vertical, length, weight, stiffness
    )


KINDS = ("taut", "sagging", "deep", "upright", "folded", "nearly folded", "level")


def random_pair(rng: np.random.Generator) -> tuple[Hung, Hung]:
    """Two cables: anywhere, touching at points inside, meeting at an end, side by side, or one and the same."""
    one, other = (random_cable(rng, str(rng.choice(KINDS))) for _ in range(2))
    match int(rng.integers(6)):
        case 0:  # they cross
            meet = one.points(rng.random()) - other.points(rng.random())
            other = other._replace(start=other.start + meet)
        case 1:  # they all but cross
            meet = one.points(rng.random()) - other.points(rng.random())
            other = other._replace(start=other.start + meet + 10.0 ** rng.uniform(-9, -1) * rng.normal(size=3))
        case 2:  # they share an end
            other = other._replace(start=one.points(1.0) - other.points(1.0) + other.start)
        case 3:  # side by side
            other = one._replace(start=one.start + rng.normal(size=3) * 10.0 ** rng.uniform(-6, 0))
        case _:
            pass
    return one, other


def sampled_distance(one: Hung, other: Hung, count: int = 1501) -> float:
    """Least distance of count x count points [m], made better by simplex search from the three best ones."""
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


def all_pairs(count: int) -> Array:
    """Numbers of all pairs of so many."""
    return np.array(list(combinations(range(count), 2)), dtype=np.int64)
