"""Table 2: ten poses of the prototype, desired and measured."""

from __future__ import annotations

import csv
from dataclasses import dataclass
from importlib.resources import files

import numpy as np

from sagline.core.arrays import Array, locked


@dataclass(frozen=True, slots=True, eq=False)
class Table2:
    """The article's Table 2, as printed."""

    points: tuple[str, ...]  # names of the poses, shape (10,)
    desired: Array  # desired positions [m], shape (10, 3)
    actual: Array  # measured positions [m], shape (10, 3)
    printed_error: Array  # positioning errors as printed [m], shape (10,)

    @property
    def error(self) -> Array:
        """Actual minus desired position [m], shape (10, 3)."""
        return self.actual - self.desired

    @property
    def distance(self) -> Array:
        """Euclidean distance of actual and desired position [m], shape (10,)."""
        return np.asarray(np.linalg.norm(self.error, axis=1))


def table2() -> Table2:
    """Read the table from the package."""
    # source: Gia Luan & Truong Thinh 2020, Table 2
    text = files("sagline.article").joinpath("data/table2.csv").read_text(encoding="utf-8")
    rows = list(csv.reader(line for line in text.splitlines() if not line.startswith("#")))[1:]
    numbers = np.array([row[1:] for row in rows], dtype=np.float64)
    return Table2(
        points=tuple(row[0] for row in rows),
        desired=locked(numbers[:, 0:3].copy()),
        actual=locked(numbers[:, 3:6].copy()),
        printed_error=locked(1e-3 * numbers[:, 6]),
    )
