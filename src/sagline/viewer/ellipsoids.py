"""Ellipsoids of errors: where they lie and how large they are drawn."""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from sagline.core.arrays import Array, Indices
from sagline.viewer.solids import Solid, round_below

THINNEST: Final = 0.03  # of its longest axis: a flat one is still seen


class Ellipsoids(NamedTuple):
    """Some ellipsoids.

    Attributes:
        middle: Where they are [m], shape (k, 3).
        turn: Their axes, as quaternions, scalar first, shape (k, 4).
        radius: One standard error along each of their axes [m], shape (k, 3).
        which: Whose they are, shape (k,).
    """

    middle: Array
    turn: Array
    radius: Array
    which: Indices

    @classmethod
    def of(cls, points: Array, covariance: Array) -> Ellipsoids:
        """Those of points, without those of which nothing is known or everything.

        Args:
            points: The points [m], shape (m, 3).
            covariance: Of the coordinates of each [m^2], shape (m, 3, 3).
        """
        known = np.isfinite(covariance).all(axis=(1, 2)) & covariance.any(axis=(1, 2))
        which = np.flatnonzero(known).astype(np.int64)
        squares, axes = np.linalg.eigh(covariance[which])
        mirrored = np.linalg.det(axes) < 0.0
        axes[mirrored, :, 0] *= -1.0
        turn = Rotation.from_matrix(axes).as_quat()[:, [3, 0, 1, 2]] if len(which) else np.zeros((0, 4))
        return cls(points[which], turn, np.sqrt(np.maximum(squares, 0.0)), which)

    def drawn(self, factor: float) -> Array:
        """Their radii as they are drawn, some times as large [m], shape (k, 3)."""
        longest = self.radius.max(axis=1, keepdims=True)
        return np.asarray(factor * np.maximum(self.radius, THINNEST * longest))


def readable(radius: Array, size: float) -> float:
    """A round factor with which the largest radius is drawn about as large as a size [m]; 1 for none."""
    largest = float(radius.max(initial=0.0))
    return max(round_below(size / largest), 1.0) if largest > 0.0 else 1.0


def ball() -> Solid:
    """A ball of radius 1."""
    from trimesh.creation import icosphere  # a fifth of what starts the viewer, and few see a ball

    mesh = icosphere(subdivisions=2)
    return Solid(np.asarray(mesh.vertices, dtype=np.float64), np.asarray(mesh.faces, dtype=np.int64))
