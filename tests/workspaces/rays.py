"""Hull of the points seen along rays from one point, for comparison with the boundary.

It is the boundary only if the center sees the whole set. `sagline.workspaces.boundary` finds the boundary of any set.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from sagline.core.arguments import whole_number
from sagline.core.arrays import Array, Indices, exactly, locked
from sagline.core.errors import InvalidValueError
from sagline.workspaces.grid import Brackets, Level, _crossings_of, brackets, crossings, distance_to_box, level_values
from sagline.workspaces.surface import Surface

ITERATIONS: Final = 100  # facets that limit consecutive parts of a ray: three are usual
SHARP: Final = 1e-5  # of the level at the ends of a bracket of at most a hundredth of a ray
CLOSE: Final = 1e-7  # a level that is treated as zero from below

_POLES: Final = np.array([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]], dtype=np.float64)
_OCTANTS: Final = np.array(
    [[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]], dtype=np.int64
)

Facets = Callable[[Array], tuple[Array, Array]]
"""At positions [m], shape (N, 3): the level, shape (N,), and which facet it is of, shape (N, ...)."""
FacetLevel = Callable[[Array, Array], Array]
"""Of facets, shape (N, ...), at positions [m], shape (N, 3): the level, shape (N,); nowhere less than that of all."""


def generations(divisions: int) -> tuple[list[tuple[Array, Indices]], Indices]:
    """Directions on the sphere: an octahedron with repeatedly halved edges, projected to length 1.

    Args:
        divisions: How often: 4^(divisions + 1) + 2 directions, 4,098 with five.

    Returns:
        Generations: directions of length 1, shape (K, 3), and the two that each lies between, counted through all
        generations, shape (K, 2), none in the first; and the triangles between all, shape (2 4^divisions 4, 3).
    """
    found = [(_POLES, np.zeros((0, 2), dtype=np.int64))]
    directions, faces = _POLES, _OCTANTS
    for _ in range(divisions):
        sides = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
        parents, middle = np.unique(np.sort(sides, axis=1), axis=0, return_inverse=True)
        new = directions[parents].sum(axis=1)
        new /= np.linalg.norm(new, axis=1)[:, None]
        found.append((new, parents))
        (a, b, c), (ab, bc, ca) = faces.T, len(directions) + middle.reshape(3, -1)
        faces = np.concatenate(
            [np.stack(part, axis=1) for part in ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))]
        )
        directions = np.concatenate([directions, new])
    return found, faces


def ray_hull(level: Level, center: ArrayLike, low: ArrayLike, high: ArrayLike, divisions: int = 5) -> Surface:
    """Closed surface of the points where rays from a center leave a set.

    The rays of each generation are looked for near the chord between their parents' ends.

    Args:
        level: The function, >= 0 inside.
        center: Where the rays begin, inside [m], shape (3,).
        low: Lower corner of the box where they end at the latest [m], shape (3,).
        high: Upper corner of the box [m], shape (3,).
        divisions: 4^(divisions + 1) + 2 rays, 4,098 with five; 0 to 8.

    Returns:
        Surface; the ends of the rays are found to a millionth of their length.

    Raises:
        InvalidValueError: If the center is not inside, or an argument is out of range.
    """
    origin, at_center = _origin(level, center, low, high)
    steps, faces = generations(whole_number(divisions, "divisions", 0, 8))
    length, slope = np.zeros(0), np.zeros(0)
    directions = np.zeros((0, 3))
    for new, parents in steps:
        limit = distance_to_box(origin, new, np.asarray(low), np.asarray(high))
        if not len(parents):
            start, at_start, step = np.zeros(len(new)), np.full(len(new), at_center), limit
        else:
            start = np.minimum(_chords(directions, length, parents, new), limit)
            at_start = level_values(level, origin + start[:, None] * new)
            step = np.clip(1.5 * np.abs(at_start) / slope[parents].mean(axis=1), 1e-4 * limit, limit)
        points = origin + start[:, None] * new
        ends = brackets(level, points, new, at_start, step, limit - start, start)
        reached = np.where(at_start >= 0.0, limit, 0.0)
        reached[ends.k] = _ends(level, origin, new, ends, SHARP if len(parents) else SHARP**2)
        directions = np.concatenate([directions, new])
        length, slope = np.concatenate([length, reached]), np.concatenate([slope, _slope(ends)])
    return Surface(locked(origin + length[:, None] * directions), locked(faces))


def ray_hull_by_facets(
    facets: Facets, facet_level: FacetLevel, center: ArrayLike, low: ArrayLike, high: ArrayLike, divisions: int = 5
) -> Surface:
    """Like `ray_hull`, but from outside inward, with one facet of the level after the other.

    The level is the least of many facets'. Where it is negative so is that facet up to its own root, which is cheaper
    to find; and nothing inside is passed over, but what is narrower than the search for the root sees.

    Args:
        facets: The level, and its facet.
        facet_level: The level of a facet.
        center: Where the rays begin, inside [m], shape (3,).
        low: Lower corner of the box where they end at the latest [m], shape (3,).
        high: Upper corner of the box [m], shape (3,).
        divisions: 4^(divisions + 1) + 2 rays, 4,098 with five; 0 to 8.

    Returns:
        Surface; the ends of the rays are found to a millionth of their length.

    Raises:
        InvalidValueError: If the center is not inside, or an argument is out of range.
    """
    origin, _ = _origin(lambda positions: facets(positions)[0], center, low, high)
    steps, faces = generations(whole_number(divisions, "divisions", 0, 8))
    directions = np.concatenate([new for new, _ in steps])
    length = distance_to_box(origin, directions, np.asarray(low), np.asarray(high))
    k = np.arange(len(directions))
    for _ in range(ITERATIONS):
        ends = origin + length[k, None] * directions[k]
        value, facet = facets(ends)
        n = np.flatnonzero(value < -CLOSE)
        if not len(n):
            break
        k = k[n]
        length[k] *= _roots(facet_level, facet[n], ends[n], value[n], origin)
    return Surface(locked(origin + length[:, None] * directions), locked(faces))


def _origin(level: Level, center: ArrayLike, low: ArrayLike, high: ArrayLike) -> tuple[Array, float]:
    """Checked center, and the level there."""
    origin = exactly(center, "center", "m", (3,))
    outside = (origin <= exactly(low, "low", "m", (3,))) | (origin >= exactly(high, "high", "m", (3,)))
    value = float(level_values(level, origin[None])[0])
    if outside.any() or not value >= 0.0:
        where = "outside the box" if outside.any() else f"where the level is {value:.4g}"
        raise InvalidValueError("center", where, "a position in the set, within the box", "Choose another center.")
    return origin, value


def _chords(directions: Array, length: Array, parents: Indices, new: Array) -> Array:
    """Distances along new directions to the chords between the ends of the rays of their parents [m]."""
    a, b = length[parents].T
    middle: Array = 2.0 * a * b / np.maximum(a + b, np.finfo(np.float64).tiny)
    return _along(middle[:, None] * directions[parents[:, 0]], new)


def _ends(level: Level, origin: Array, directions: Array, ends: Brackets, precision: float) -> Array:
    """Distance of each sign change along its ray [m]."""
    inner, outer, at_inner, at_outer = (part[ends.k] for part in ends[:4])
    share = crossings(level, inner, outer, at_inner, at_outer, precision=precision)
    return _along(inner + share[:, None] * (outer - inner) - origin, directions[ends.k])


def _along(positions: Array, directions: Array) -> Array:
    lengths: Array = np.einsum("ni,ni->n", positions, directions)
    return lengths


def _slope(ends: Brackets) -> Array:
    """Decrease of the level along each ray, approximately [1/m]."""
    width = np.linalg.norm(ends.outer - ends.inner, axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        slope: Array = (ends.at_inner - ends.at_outer) / width
    known = np.isfinite(slope) & (slope > 0.0)
    slope[~known] = np.median(slope[known]) if known.any() else 1.0
    return slope


def _roots(facet_level: FacetLevel, facet: Array, outer: Array, at_outer: Array, origin: Array) -> Array:
    """Share of rays up to the roots of facets; 0 if the level of a facet is negative at the center as well."""
    centers = np.broadcast_to(origin, outer.shape)
    at_center = facet_level(facet, centers)
    k = np.flatnonzero(at_center >= 0.0)

    def values(n: Indices, positions: Array) -> Array:
        return facet_level(facet[k[n]], positions)

    found = _crossings_of(values, centers[k], outer[k], at_center[k], at_outer[k], precision=1e-9)
    share = np.zeros(len(outer))
    share[k] = found
    return share
