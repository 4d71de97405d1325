"""The colors of margins: bands between round forces, inside of the workspace and outside, the same in every drawing."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from math import floor, log10
from typing import Final

import numpy as np

from sagline.core.arrays import Array, Indices
from sagline.viewer.readout import block, css_color
from sagline.viewer.tension_scale import Colors
from sagline.viewer.wording import ForceUnit

INSIDE: Final = 4  # bands above 0, the last without an end
OUTSIDE: Final = 2  # bands below 0, the first without a beginning
# Lightness tells them apart as well as hue does, for all eyes and on both backgrounds.
_COLORS: Final = np.array(
    [[196, 92, 40], [222, 150, 104], [126, 196, 186], [64, 160, 150], [22, 122, 116], [8, 84, 84]], dtype=np.uint8
)


@dataclass(frozen=True, slots=True)
class MarginScale:
    """Bands of margins.

    Attributes:
        step: Width of a band [N], > 0.
    """

    step: float

    @classmethod
    def up_to(cls, largest: float) -> MarginScale:
        """Bands of a round width of which the last but one ends about at the largest margin [N]."""
        coarse = largest / INSIDE if np.isfinite(largest) and largest > 0.0 else 1.0
        power = 10.0 ** floor(log10(coarse))
        return cls(max(times * power for times in (1.0, 2.0, 5.0) if times * power <= coarse * (1.0 + 1e-9)))

    @property
    def edges(self) -> Array:
        """Margins between the bands [N], rising; one of them is 0."""
        return self.step * np.arange(1.0 - OUTSIDE, INSIDE)

    def bands(self, margin: Array) -> Indices:
        """The band of each margin, 0 the farthest outside; what is 0 but for rounding is inside."""
        steps = np.floor(np.asarray(margin) / self.step + 1e-6)
        return np.asarray(np.clip(steps, -OUTSIDE, INSIDE - 1)).astype(np.int64) + OUTSIDE

    def colors(self, margin: Array) -> Colors:
        """The color of each margin, shape (..., 3)."""
        return np.asarray(_COLORS[self.bands(margin)])

    def key(self, unit: ForceUnit) -> str:
        """HTML that says which color is which margin."""
        edges = [bare(edge, unit) for edge in self.edges]
        between = [f"{low} to {high}" for low, high in pairwise(edges)]
        names = [f"below {edges[0]}", *between, f"above {edges[-1]}"]
        marks = "".join(
            f'<span class="key"><span class="swatch" style="background:{css_color(color)}"></span> {name}</span>'
            for color, name in zip(_COLORS, names, strict=True)
        )
        return block(f"<b>Margin [{unit.name}]</b> &nbsp;{marks}")


def bare(edge: float, unit: ForceUnit) -> str:
    """A margin between bands [N], without its unit."""
    return f"{edge / unit.newtons:g}".replace("-", "−")
