"""Hidden line removal in parallel projection, and division of triangles at borders between limiting criteria.

Sorting by distance is not sufficient, because each of three cables can pass in front of the next one. In parallel
projection all quantities are linear along a segment. The ends of hidden parts are therefore exact intersections of
straight lines.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Final, NamedTuple

import numpy as np

from sagline.core.arrays import Array, Indices, blocks

FLAT = 1e-9  # surfaces and lines with a smaller extent, relative to the picture's size, hide nothing
TOUCHING = 1e-6  # a line this close to a surface is on it, not behind it; relative to the picture's size
CHUNK = 2_000_000  # number of pairs of segments and limits per block
FAR = 1e3  # depth of a plane in front of all lines and surfaces, in picture sizes
ALONG = 3.0  # largest hidden length of a line nearly parallel to a strip, divided by the strip's width


class FlatLine(NamedTuple):
    """A line in the picture."""

    points: Array  # coordinates to the right, up, and toward the viewer [m], shape (P, 3)
    half_width: float  # half of the width [m] within which the line hides lines behind it; 0 if it hides nothing
    # Additional distance at crossings [m]: a line that is less than half_width + gap behind this line, such as a cable
    # that ends at the same anchor, is not hidden.
    gap: float


# A flat convex piece that hides lines: its corners (4, 3); the smallest distance behind it at which points are hidden;
# the index of the line to which it belongs, -1 for surfaces; the index of the line that it hides, -1 for all others.
_Piece = tuple[Array, float, int, int]


def view_axes(azimuth: float, elevation: float) -> Array:
    """Unit vectors to the right, up and toward the viewer, in world axes, as the rows of a matrix."""
    around, above = np.array([np.cos(azimuth), np.sin(azimuth)]), np.array([np.cos(elevation), np.sin(elevation)])
    toward = np.array([above[0] * around[0], above[0] * around[1], above[1]])
    right = np.array([-around[1], around[0], 0.0])
    return np.stack((right, np.cross(toward, right), toward))


def visible_parts(
    lines: Sequence[FlatLine], surfaces: Sequence[Array], labels: Sequence[Array] = ()
) -> list[list[Array]]:
    """Visible parts of lines."""
    if not lines:
        return []
    size = float(np.ptp(np.concatenate([line.points for line in lines]), axis=0).max()) or 1.0
    over = [np.column_stack((label, np.full(len(label), FAR * size))) for label in labels]
    starts = np.concatenate([line.points[:-1] for line in lines])
    ends = np.concatenate([line.points[1:] for line in lines])
    owners = np.repeat(np.arange(len(lines)), [len(line.points) - 1 for line in lines])
    pieces = [*_pieces_of(lines, [*surfaces, *over], size), *_crossings(lines, starts, ends, owners)]
    hidden = _hidden(starts, ends, owners, pieces)
    found: list[list[Array]] = [[] for _ in lines]
    for start, end, owner, spans in zip(starts, ends, owners, hidden, strict=True):
        for low, high in _rest(spans):
            part = np.stack((start + low * (end - start), start + high * (end - start)))
            parts = found[owner]
            if parts and low == 0.0 and np.array_equal(parts[-1][-1], part[0]):
                parts[-1] = np.concatenate((parts[-1], part[1:]))
            else:
                parts.append(part)
    return found


def _rest(spans: Array) -> list[tuple[float, float]]:
    """The parts of the range 0 to 1 that spans (n, 2) leave free."""
    left, reached = [], 0.0
    for low, high in spans[np.argsort(spans[:, 0])].tolist():
        if low > reached:
            left.append((reached, low))
        reached = max(reached, high)
    return [*left, (reached, 1.0)] if reached < 1.0 else left


def _hidden(starts: Array, ends: Array, owners: Indices, pieces: Sequence[_Piece]) -> list[Array]:
    """Hidden spans (n, 2) of each of S segments, in numbers from 0 at the start of a segment to 1 at its end."""
    # The K limits of a piece are its sides: products of their outward normals with a position are at most `offsets`.
    corners = np.array([piece[0] for piece in pieces]).reshape(-1, 4, 3)
    behind, hiders, hides = (np.array([piece[k] for piece in pieces]) for k in (1, 2, 3))
    along = np.roll(corners[..., :2], -1, axis=1) - corners[..., :2]
    normals = np.stack((along[..., 1], -along[..., 0]), axis=-1)  # outward if the corners are counter-clockwise
    offsets = np.einsum("rkc,rkc->rk", normals, corners[..., :2])
    planes = np.array([_plane(each) for each in corners]).reshape(-1, 3)
    found: list[Array] = []
    for part in blocks(len(starts), max(1, CHUNK // max(offsets.size, 1))):
        # In a hidden span, the segment is within all limits and behind the plane: K + 1 linear functions are <= 0.
        start, step, owner = starts[part], ends[part] - starts[part], owners[part, None]
        outside = np.einsum("sc,rkc->srk", start[:, :2], normals) - offsets
        rise = np.einsum("sc,rkc->srk", step[:, :2], normals)
        depth = start[:, :2] @ planes[:, :2].T + planes[:, 2]
        before = (start[:, 2:] - depth + behind)[..., None]
        nearer = (step[:, 2:] - step[:, :2] @ planes[:, :2].T)[..., None]
        value, slope = np.concatenate((outside, before), axis=2), np.concatenate((rise, nearer), axis=2)
        crossed = np.divide(-value, slope, out=np.zeros_like(value), where=slope != 0.0)
        low = np.where(slope < 0.0, crossed, 0.0).max(axis=2, initial=0.0)
        high = np.where(slope > 0.0, crossed, 1.0).min(axis=2, initial=1.0)
        never = ((slope == 0.0) & (value > 0.0)).any(axis=2) | (owner == hiders)
        never |= (hides >= 0) & (hides != owner)
        there = (low < high) & ~never
        found += [np.column_stack((low[s, there[s]], high[s, there[s]])) for s in range(len(start))]
    return found


def _pieces_of(lines: Sequence[FlatLine], surfaces: Sequence[Array], size: float) -> list[_Piece]:
    """Pieces that hide lines: surfaces, and strips along lines."""
    pieces: list[_Piece] = []
    for number, line in enumerate(lines):
        long = np.linalg.norm(np.diff(line.points[:, :2], axis=0), axis=1) > FLAT * size
        if line.half_width > 0.0:
            for start, end in zip(line.points[:-1][long], line.points[1:][long], strict=True):
                pieces.append((_strip(start, end, line.half_width), line.half_width + line.gap, number, -1))
    for surface in surfaces:
        if abs(area := _area(surface)) > FLAT * size**2:
            pieces.append((surface if area > 0.0 else surface[::-1], TOUCHING * size, -1, -1))
    return pieces


def _crossings(lines: Sequence[FlatLine], starts: Array, ends: Array, owners: Indices) -> list[_Piece]:
    """Strips at all crossings where a line that can hide others passes in front of another line."""
    steps = ends - starts
    hides = np.array([line.half_width + line.gap for line in lines])[owners]
    front = np.flatnonzero(hides > 0.0)
    away = starts[:, None, :2] - starts[None, front, :2]
    turn = _cross(steps[None, front, :2], steps[:, None, :2])
    crossing = np.abs(turn) > 0.0
    safe = np.where(crossing, turn, 1.0)
    here = _cross(away, steps[:, None, :2]) / safe  # parameter along the front line
    there = _cross(away, steps[None, front, :2]) / safe
    inside = crossing & (np.minimum(here, there) >= 0.0) & (np.maximum(here, there) <= 1.0)
    inside &= owners[:, None] != owners[None, front]
    depth = starts[None, front, 2] + here * steps[None, front, 2] - starts[:, None, 2] - there * steps[:, None, 2]
    found: list[_Piece] = []
    for back, k in np.argwhere(inside & (depth > hides[None, front])):
        segment, half = int(front[k]), float(hides[front[k]])
        place = starts[segment] + float(here[back, k]) * steps[segment]
        step = ALONG * half * steps[segment] / float(np.hypot(*steps[segment, :2]))
        found.append((_strip(place - step, place + step, half), half, int(owners[segment]), int(owners[back])))
    return found


def _cross(one: Array, other: Array) -> Array:
    return np.asarray(one[..., 0] * other[..., 1] - one[..., 1] * other[..., 0])


def _strip(start: Array, end: Array, half_width: float) -> Array:
    """Corners (4, 3), counter-clockwise, of a strip from `start` to `end`. The depth is constant across the strip."""
    along = (end - start)[:2]
    across = half_width / float(np.hypot(*along)) * np.array([-along[1], along[0], 0.0])
    return np.stack((start - across, end - across, end + across, start + across))


def _area(corners: Array) -> float:
    """Signed area in the picture, positive if the corners are counter-clockwise."""
    x, y = corners[:, 0] - corners[0, 0], corners[:, 1] - corners[0, 1]
    return 0.5 * float(x @ np.roll(y, -1) - y @ np.roll(x, -1))


def _plane(corners: Array) -> Array:
    """Coefficients a, b and c of the depth a x + b y + c of a plane in the picture."""
    middle = corners.mean(axis=0)
    slopes, *_ = np.linalg.lstsq(corners[:, :2] - middle[:2], corners[:, 2] - middle[2], rcond=None)
    return np.array([*slopes, middle[2] - slopes @ middle[:2]])


BISECTIONS: Final = 5  # number of bisections that locate a border on an edge
Find = Callable[[Array], Indices]


def cut_at_limits(points: Array, triangles: Indices, limit: Indices, find: Find) -> tuple[Array, Indices]:
    """Divide triangles (T, 3) of points (V, d) where `limit` (V,) changes. Returns corners (U, 3, d) and codes (U,)."""
    # each new triangle has a single limit; `find` gives the codes of the limits at points (n, d)
    codes = limit[triangles]
    mixed = (codes != codes[:, :1]).any(axis=1)
    corners, whole = [points[triangles[~mixed]]], [codes[~mixed, 0]]
    if mixed.any():
        triangles = triangles[mixed]
        edges = np.sort(np.stack((triangles, np.roll(triangles, -1, axis=1)), axis=2), axis=2)  # (T, 3, 2)
        pairs, place = np.unique(edges.reshape(-1, 2), axis=0, return_inverse=True)
        borders = _borders(points[pairs], limit[pairs], find)[place.reshape(-1, 3)]
        for tips, middles, own in _pieces(points[triangles], borders, limit[triangles]):
            corners.append(np.stack((tips, *middles), axis=1))
            whole.append(own)
    return np.concatenate(corners), np.concatenate(whole)


def _borders(ends: Array, codes: Indices, find: Find) -> Array:
    """Points of the edges `ends` (E, 2, d) where the limit changes, by bisection. Other edges give their middles."""
    ends = ends.copy()
    change = np.flatnonzero(codes[:, 0] != codes[:, 1])
    for _ in range(BISECTIONS):
        middle = 0.5 * (ends[change, 0] + ends[change, 1])
        ends[change, np.where(find(middle) == codes[change, 0], 0, 1)] = middle
    return np.asarray(0.5 * (ends[:, 0] + ends[:, 1]))


def _pieces(tips: Array, borders: Array, codes: Indices) -> list[tuple[Array, tuple[Array, Array], Indices]]:
    """Six parts of each triangle. Corners of the parts: the triangle's corners, borders on its edges, and one point."""
    # If a triangle has two limits, the common point is midway between both borders, so that the border is straight.
    changes = codes != np.roll(codes, -1, axis=1)
    weight = changes[:, :, None] / changes.sum(axis=1)[:, None, None]
    common = (weight * borders).sum(axis=1)
    return [
        (tips[:, k], pair, codes[:, k])
        for k in range(3)
        for pair in ((borders[:, k], common), (common, borders[:, k - 1]))
    ]
