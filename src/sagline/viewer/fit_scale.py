"""The colors of poses by how well a calibration fits them."""

from __future__ import annotations

from typing import Final

import numpy as np

from sagline.calibration.chi_squared import exceeded_with
from sagline.calibration.result import Calibration
from sagline.core.arrays import Indices
from sagline.viewer.readout import block, css_color
from sagline.viewer.stage import INFEASIBLE, PLATFORM, REST
from sagline.viewer.tension_scale import Colors

QUANTILES: Final = (0.95, 0.999)  # of chi squared, between the colors
COLORS: Final = np.array([PLATFORM, REST, INFEASIBLE], dtype=np.uint8)
NAMES: Final = ("as expected", "one in 20", "one in 1,000")


def freedoms(found: Calibration) -> Indices:
    """Readings of each pose beyond those that its lengths take, shape (N,), >= 1."""
    read = np.isfinite(found.residuals).sum(axis=1) - found.robot.cable_count
    return np.asarray(np.maximum(read, 1)).astype(np.int64)


def bands(found: Calibration) -> Indices:
    """The color of each pose, 0 for what is expected, shape (N,)."""
    limits = exceeded_with(1.0 - np.array(QUANTILES)[:, None], freedoms(found))
    return np.asarray((found.chi_squared_of_pose > limits).sum(axis=0)).astype(np.int64)


def colors(found: Calibration) -> Colors:
    """Red, green and blue of each pose, shape (N, 3)."""
    return np.asarray(COLORS[bands(found)])


def key(counts: Indices) -> str:
    """HTML that says which color is which, and how many poses have it."""
    marks = "".join(
        f'<span class="key"><span class="swatch" style="background:{css_color(color)}"></span> {name}: {count}</span>'
        for color, name, count in zip(COLORS, NAMES, counts, strict=True)
    )
    return block(f"<b>Chi squared of the poses</b><br>{marks}")
