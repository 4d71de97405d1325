"""What a client sees where: rays through points of its picture, and where points of the world are in it."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from sagline.core.arrays import Array
from sagline.viewer.solids import Solid


class Eye(NamedTuple):
    """A camera.

    Attributes:
        place: Where it is [m], shape (3,).
        axes: Right, down and forward, one a column, shape (3, 3).
        reach: Half of the picture's width and height at a distance of 1, shape (2,).
        pixels: Width and height of the picture [px], shape (2,).
    """

    place: Array
    axes: Array
    reach: Array
    pixels: Array

    @classmethod
    def of(cls, camera: Any) -> Eye | None:
        """The camera of a client as viser knows it; None as long as it has not told a sensible one."""
        try:
            turn, place = np.asarray(camera.wxyz, dtype=np.float64), np.asarray(camera.position, dtype=np.float64)
            pixels = np.array([camera.image_width, camera.image_height], dtype=np.float64)
            high = float(np.tan(0.5 * camera.fov))
        except (AssertionError, TypeError, ValueError):  # viser asserts that a camera has been told
            return None
        sound = turn.shape == (4,) and place.shape == (3,) and pixels.min() > 0.0 and high > 0.0
        if not (sound and np.isfinite([*turn, *place, *pixels, high]).all() and np.linalg.norm(turn) > 0.0):
            return None
        axes = Rotation.from_quat(np.roll(turn, -1)).as_matrix()
        return cls(place, axes, high * np.array([pixels[0] / pixels[1], 1.0]), pixels)

    def ray(self, at: tuple[float, float]) -> Array:
        """Direction in which a point of the picture lies, at a depth of 1, shape (3,).

        Args:
            at: The point, from 0, 0 at the left upper corner to 1, 1.
        """
        across, down = self.reach * (2.0 * np.asarray(at) - 1.0)
        return np.asarray(self.axes @ np.array([across, down, 1.0]))

    def seen(self, points: Array) -> tuple[Array, Array]:
        """Where points (..., 3) are in the picture [px], shape (..., 2), and how deep [m]; behind the eye is < 0."""
        across, down, deep = np.moveaxis((points - self.place) @ self.axes, -1, 0)
        ahead = np.where(deep == 0.0, np.nan, deep)
        flat = np.stack((across / ahead, down / ahead), axis=-1) / self.reach
        return np.asarray(0.5 * (flat + 1.0) * self.pixels), deep


def met(solid: Solid, start: Array, direction: Array) -> float | None:
    """How many times a direction a ray goes until it meets a surface; None where it misses.

    Args:
        solid: The surface.
        start: Where the ray starts [m], shape (3,).
        direction: Where it goes, shape (3,).

    Source:
        Moeller & Trumbore, J. Graphics Tools 2, 1997.
    """
    first, second, third = np.moveaxis(solid.vertices[solid.faces], 1, 0)
    one, two, gap = second - first, third - first, start - first
    across = np.cross(direction, two)
    volume = np.einsum("fi,fi->f", one, across)
    flat = np.abs(volume) <= 1e-14 * np.abs(one).max() * np.abs(two).max() * np.abs(direction).max()
    volume = np.where(flat, np.nan, volume)
    other = np.cross(gap, one)
    u, v = np.einsum("fi,fi->f", gap, across) / volume, other @ direction / volume
    far = np.einsum("fi,fi->f", two, other) / volume
    hit = (u >= 0.0) & (v >= 0.0) & (u + v <= 1.0) & (far > 0.0)
    return float(far[hit].min()) if hit.any() else None


def chosen_line(eye: Eye, at: tuple[float, float], lines: Array, within: float) -> int | None:
    """Which line is nearest to a point of the picture, if one is near; of several at it the one in front.

    Args:
        eye: Who looks.
        at: The point, from 0, 0 at the left upper corner to 1, 1.
        lines: Points along the lines [m], shape (m, P, 3).
        within: How near [px].
    """
    places, deep = eye.seen(lines)
    pixel = np.asarray(at) * eye.pixels
    start, run = places[:, :-1] - pixel, np.diff(places, axis=1)
    length = np.maximum(np.einsum("mpi,mpi->mp", run, run), 1e-12)
    share = np.clip(-np.einsum("mpi,mpi->mp", start, run) / length, 0.0, 1.0)
    away = np.linalg.norm(start + share[..., None] * run, axis=-1)
    ahead = (deep[:, :-1] > 0.0) & (deep[:, 1:] > 0.0)
    away = np.where(ahead & np.isfinite(away), away, np.inf)
    nearest = away.min(axis=1)
    if not nearest.min() <= within:
        return None
    depth = np.take_along_axis(deep, away.argmin(axis=1)[:, None], axis=1)[:, 0]
    as_near = nearest <= nearest.min() + 1.0  # px: cables that cross there
    return int(np.argmin(np.where(as_near, depth, np.inf)))


def place_of(value: Any) -> tuple[float, float] | None:
    """The point of a picture that a page has told, from 0, 0 at the left upper corner to 1, 1; None for nonsense."""
    try:
        x, y = (float(each) for each in value)
    except (TypeError, ValueError, OverflowError):
        return None
    return (x, y) if abs(x) < 10.0 and abs(y) < 10.0 else None  # NaN neither
