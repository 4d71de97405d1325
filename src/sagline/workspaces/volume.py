"""The volume within a net of triangles whose vertices alone are on the boundary, and how wrong it can be.

Between its vertices a flat triangle cuts what bulges. How far the boundary is from its middle is measured on the
function itself, along the normal. Over a curved triangle the mean distance is 3/4 of that, to the fourth order of the
step. Over any that bulges one way, edges and corners of the boundary included, it is between 1/3 (a pyramid) and all
of that (Jensen's inequality): with 3/4 taken, no more than 5/12 of it is missed.
"""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from sagline.arrays import Array
from sagline.workspaces.crossing import crossings
from sagline.workspaces.grid import Level, evaluate
from sagline.workspaces.surface import Indices, normals_of

MEAN: Final = 3.0 / 4.0  # of the distance at a curved triangle's middle
MISSED: Final = 5.0 / 12.0  # of it at most
FLAT: Final = 1e-6  # of a step: a distance that adds nothing


class Bulge(NamedTuple):
    """What lies between a net and the boundary.

    Attributes:
        volume: Over each triangle [m^3], negative where the boundary is within the net, shape (F,).
        error: By how much that can be wrong [m^3], shape (F,): where the boundary was not found within reach, all that
            is within it.
    """

    volume: Array
    error: Array


def bulge(level: Level, vertices: Array, faces: Indices, slope: Array, reach: float) -> Bulge:
    """What lies between a net and the boundary.

    Args:
        level: The function.
        vertices: Those of the net, on the boundary [m], shape (V, 3).
        faces: Its triangles, shape (F, 3).
        slope: How fast the function falls there along the normal, about [1/m], shape (F,); NaN where that is not known.
        reach: How far from a triangle the boundary is looked for [m].

    Returns:
        Bulge.
    """
    normals = normals_of(vertices, faces)
    area = np.linalg.norm(normals, axis=1)
    normals = normals / np.maximum(area, np.finfo(np.float64).tiny)[:, None]
    distance = distances(level, vertices[faces].mean(axis=1), normals, slope, reach)
    found = ~np.isnan(distance)
    volume = np.where(found, MEAN * area * distance, 0.0)
    return Bulge(volume, area * np.where(found, MISSED * np.abs(distance), reach))


def distances(level: Level, points: Array, normals: Array, slope: Array, reach: float) -> Array:
    """How far the boundary is from points along their normals, to some percent.

    Args:
        level: The function.
        points: Where [m], shape (N, 3).
        normals: Outward, of length 1, shape (N, 3).
        slope: How fast the function falls along them, about [1/m], shape (N,); NaN where that is not known.
        reach: How far to look [m].

    Returns:
        Distances [m], negative inward, NaN beyond reach, shape (N,).
    """
    at_points = evaluate(level, points)
    is_inside = at_points >= 0.0
    away = np.where(is_inside, 1.0, -1.0)[:, None] * normals
    with np.errstate(divide="ignore", invalid="ignore"):
        guess = 1.5 * np.abs(at_points) / slope
    guess = np.where(np.isfinite(guess) & (slope > 0.0), guess, 0.1 * reach)
    distance = np.where(guess <= FLAT * reach, 0.0, np.nan)
    near, at_near = np.zeros(len(points)), at_points.copy()
    far = np.clip(guess, 0.01 * reach, reach)
    k = np.flatnonzero(guess > FLAT * reach)
    while len(k):
        at_far = evaluate(level, points[k] + far[k, None] * away[k])
        crossed = (at_far >= 0.0) != is_inside[k]
        done = k[crossed]
        distance[done] = _between(level, points, away, (near, at_near), (far, at_far[crossed]), done)
        k, at_far = k[~crossed], at_far[~crossed]
        near[k], at_near[k] = far[k], at_far
        k = k[far[k] < reach]
        far[k] = np.minimum(3.0 * far[k], reach)
    signed: Array = np.where(is_inside, distance, -distance)
    return signed


def _between(
    level: Level, points: Array, away: Array, near: tuple[Array, Array], far: tuple[Array, Array], k: Indices
) -> Array:
    """Where the sign changes within brackets: by their chord, and by looking closer where an end is infinite."""
    start, at_start, end, at_end = near[0][k], near[1][k], far[0][k], far[1]
    with np.errstate(invalid="ignore"):
        share = at_start / (at_start - at_end)
    rough = np.flatnonzero(np.isinf(at_start) | np.isinf(at_end))
    if len(rough):
        outward = (at_start[rough] >= 0.0)[:, None]
        ends = [points[k[rough]] + distance[rough, None] * away[k[rough]] for distance in (start, end)]
        inner, outer = np.where(outward, ends, ends[::-1])
        at_inner, at_outer = np.where(outward.T, (at_start[rough], at_end[rough]), (at_end[rough], at_start[rough]))
        found = crossings(level, inner, outer, at_inner, at_outer, precision=0.01, narrow=0.05)
        share[rough] = np.where(outward[:, 0], found, 1.0 - found)
    between: Array = start + share * (end - start)
    return between
