"""Slices through a region of feasible positions, and the colors of their margins."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import Any, Final, TypeAlias

import numpy as np
from contourpy import LineType, contour_generator
from numpy.typing import NDArray

from sagline.core.arrays import Array, Indices
from sagline.viewer.readout import color_key, html_block
from sagline.viewer.shapes import round_below
from sagline.viewer.tension_scale import Colors, ForceUnit
from sagline.workspaces.levels import Slice

INSIDE: Final = 4  # number of bands above 0, the last one unbounded
OUTSIDE: Final = 2  # number of bands below 0, the first one unbounded
# The colors differ in lightness and in hue, for color-blind users and for both backgrounds.
_COLORS: Final = np.array(
    [[196, 92, 40], [222, 150, 104], [126, 196, 186], [64, 160, 150], [22, 122, 116], [8, 84, 84]], dtype=np.uint8
)


@dataclass(frozen=True, slots=True)
class MarginScale:
    """Bands of margins."""

    step: float  # width of a band [N], > 0

    @classmethod
    def up_to(cls, largest: float) -> MarginScale:
        """Bands of a round width; the last bounded band ends near the largest margin [N]."""
        coarse = largest / INSIDE if np.isfinite(largest) and largest > 0.0 else 1.0
        return cls(round_below(coarse))

    @property
    def edges(self) -> Array:
        """Margins at the borders of the bands [N], ascending; one of them is 0."""
        return self.step * np.arange(1.0 - OUTSIDE, INSIDE)

    def bands(self, margin: Array) -> Indices:
        """Index of the band of each margin, 0 for the most negative; zero with rounding errors counts as inside."""
        steps = np.floor(np.asarray(margin) / self.step + 1e-6)
        return np.asarray(np.clip(steps, -OUTSIDE, INSIDE - 1)).astype(np.int64) + OUTSIDE

    def colors(self, margin: Array) -> Colors:
        """The color of each margin, shape (..., 3)."""
        return np.asarray(_COLORS[self.bands(margin)])

    def picture(self, cut: Slice, unit: ForceUnit) -> tuple[NDArray[np.uint8], Array, Array, Marks]:
        """Picture of a slice, lines where its margin is 0, lines at the borders of the other bands, and labels."""
        # the picture has red, green, blue and opacity, with the lowest row first, shape (h, w, 4)
        # lines are segments in the world [m], shape (s, 2, 3)
        low, high = self.edges[0] - self.step, self.edges[-1] + self.step
        margin = np.clip(cut.margin, low, high)  # infinite margins have contours
        fine = _finer(_finer(margin).T).T
        opacity = np.where(fine >= 0.0, INSIDE_OPACITY, OUTSIDE_OPACITY).astype(np.uint8)
        found = contour_generator(cut.across, cut.up, margin, line_type=LineType.ChunkCombinedOffset)
        lines = [(float(edge), _segments(found.lines(float(edge)), cut)) for edge in self.edges]
        boundary = next(own for edge, own in lines if edge == 0.0)
        others = np.concatenate([own for edge, own in lines if edge != 0.0])
        marks = _marks(sorted(lines, key=lambda line: abs(line[0])), cut, unit)
        return np.dstack((self.colors(fine), opacity)), boundary, others, marks

    def key(self, unit: ForceUnit) -> str:
        """HTML of the color legend."""
        edges = [_bare(edge, unit) for edge in self.edges]
        between = [f"{low} to {high}" for low, high in pairwise(edges)]
        names = [f"below {edges[0]}", *between, f"above {edges[-1]}"]
        return html_block(f"<b>Margin [{unit.name}]</b> &nbsp;{color_key(zip(_COLORS, names, strict=True))}")


def _bare(edge: float, unit: ForceUnit) -> str:
    """Text of a margin at the border of a band [N], without its unit."""
    return f"{edge / unit.newtons:g}".replace("-", "−")


APART = 0.12  # smallest distance of two labels, relative to the slice's longer side
FINER = 3  # pixels per point of the grid, along each axis
INSIDE_OPACITY, OUTSIDE_OPACITY = 150, 90  # out of 255, so that the robot behind the slice is visible


Marks: TypeAlias = list[tuple[str, Array]]  # labels and their positions [m], shape (3,)


def _marks(lines: list[tuple[float, Array]], cut: Slice, unit: ForceUnit) -> Marks:
    """Labels of the lines from 0 on. Each label is at the farthest point of its line in another direction."""
    apart = APART * max(float(np.ptp(cut.across)), float(np.ptp(cut.up)))
    marks: Marks = []
    for k, (edge, segments) in enumerate(lines):
        middles = segments.mean(axis=1)
        taken = [np.linalg.norm(middles - place, axis=1) < apart for _, place in marks]
        free = middles[~np.logical_or.reduce([np.zeros(len(middles), dtype=bool), *taken])]
        if len(free):
            way = 2.0 * np.pi * (0.1 + k / len(lines))
            along = free[:, list(cut.plane.axes)] @ np.array([np.cos(way), np.sin(way)])
            marks.append((f"{_bare(edge, unit)} {unit.name}", free[along.argmax()]))
    return marks


def _finer(values: Array) -> Array:
    """Values interpolated between those of each row, for pixels of equal width."""
    places = (np.arange(FINER * (values.shape[1] - 1)) + 0.5) / FINER
    first = places.astype(np.intp)
    share = places - first
    return np.asarray((1.0 - share) * values[:, first] + share * values[:, first + 1])


def _segments(found: Any, cut: Slice) -> Array:
    """Segments of contours (s, 2, 3) in the world."""
    (points,), (offsets,) = found  # one chunk
    if points is None:
        return np.empty((0, 2, 3))
    starts = np.ones(len(points), dtype=bool)
    starts[offsets[1:] - 1] = False  # no segment starts at the last point of a line
    first = np.flatnonzero(starts)
    pairs = np.stack((points[first], points[first + 1]), axis=1)
    placed = np.empty((len(pairs), 2, 3))
    placed[..., cut.plane.normal] = cut.plane.at
    placed[..., list(cut.plane.axes)] = pairs
    return placed
