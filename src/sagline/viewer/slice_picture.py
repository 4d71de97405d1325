"""A slice of margins as a picture that lies in the scene, with the lines between its bands."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from contourpy import LineType, contour_generator
from numpy.typing import NDArray

from sagline.arrays import Array
from sagline.viewer.margin_scale import MarginScale
from sagline.workspaces.slice import Slice

FINER = 3  # points of the picture for one of the grid, each way
INSIDE_OPACITY, OUTSIDE_OPACITY = 150, 90  # of 255: the robot behind it is seen


class Picture(NamedTuple):
    """What is drawn of a slice.

    Attributes:
        image: Red, green, blue and opacity, the first row the lowest, shape (h, w, 4).
        boundary: Segments of the line where the margin is 0, in the world [m], shape (b, 2, 3).
        lines: Segments between the other bands, shape (s, 2, 3).
    """

    image: NDArray[np.uint8]
    boundary: Array
    lines: Array


def picture_of(cut: Slice, scale: MarginScale) -> Picture:
    """Colors and lines of a slice."""
    margin = np.clip(cut.margin, scale.edges[0] - scale.step, scale.edges[-1] + scale.step)  # infinite ones have lines
    fine = _finer(_finer(margin).T).T
    opacity = np.where(fine >= 0.0, INSIDE_OPACITY, OUTSIDE_OPACITY).astype(np.uint8)
    found = contour_generator(cut.across, cut.up, margin, line_type=LineType.ChunkCombinedOffset)
    edges = scale.edges
    others = [_segments(found.lines(float(edge)), cut) for edge in edges if edge != 0.0]
    return Picture(np.dstack((scale.colors(fine), opacity)), _segments(found.lines(0.0), cut), np.concatenate(others))


def _finer(values: Array) -> Array:
    """Points between those of each row, and beyond its ends, so that each stands for a pixel of the same width."""
    count = values.shape[1]
    places = np.clip((np.arange(FINER * (count - 1)) + 0.5) / FINER, 0.0, count - 1.0)
    first = np.minimum(places.astype(np.intp), count - 2)
    share = places - first
    return np.asarray((1.0 - share) * values[:, first] + share * values[:, first + 1])


def _segments(found: Any, cut: Slice) -> Array:
    """Pieces of lines (s, 2, 3) in the world."""
    (points,), (offsets,) = found  # one chunk
    if points is None:
        return np.empty((0, 2, 3))
    starts = np.ones(len(points), dtype=bool)
    starts[offsets[1:] - 1] = False  # the last of each line begins nothing
    first = np.flatnonzero(starts)
    pairs = np.stack((points[first], points[first + 1]), axis=1)
    placed = np.empty((len(pairs), 2, 3))
    placed[..., cut.plane.normal] = cut.plane.at
    placed[..., list(cut.plane.axes)] = pairs
    return placed
