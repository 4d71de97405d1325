"""The 630 cables at 90 digits, as arrays."""

from __future__ import annotations

import csv
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from sagline import Cable
from sagline.core.arrays import Array

FILE = Path(__file__).parents[1] / "data" / "cables.csv"
GRAVITY = 9.81


@dataclass(frozen=True)
class Reference:
    """Columns of cables.csv; NaN for empty fields."""

    group: tuple[str, ...]
    span: Array
    rise: Array
    cable: Cable
    p2_length: Array
    p2_horizontal: Array
    p2_vertical: Array
    p3_horizontal: Array
    p3_length: Array
    p3_vertical: Array

    @property
    def weight(self) -> Array:
        """Weight per length [N/m]."""
        return self.cable.linear_density * GRAVITY

    def largest_tension(self, horizontal: Array, vertical: Array, length: Array) -> Array:
        """The larger of the two end tensions [N]."""
        frame = np.hypot(horizontal, vertical - self.weight * length)
        return np.maximum(frame, np.hypot(horizontal, vertical))


def load_reference() -> Reference:
    with FILE.open(encoding="utf-8") as stream:
        rows = list(csv.DictReader(stream))

    def column(name: str) -> Array:
        return np.array([float(row[name] or "nan") for row in rows])

    return Reference(
        group=tuple(row["group"] for row in rows),
        span=column("span_m"),
        rise=column("rise_m"),
        cable=Cable(column("linear_density_kg_m"), column("axial_stiffness_N")),
        p2_length=column("p2_unstrained_length_m"),
        p2_horizontal=column("p2_horizontal_tension_N"),
        p2_vertical=column("p2_vertical_force_N"),
        p3_horizontal=column("p3_horizontal_tension_N"),
        p3_length=column("p3_unstrained_length_m"),
        p3_vertical=column("p3_vertical_force_N"),
    )
