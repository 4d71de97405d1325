"""How well anchors are known relative to one another: without what merely moves all of them together."""

from __future__ import annotations

from typing import Final, Literal

import numpy as np

from sagline.calibration.unknowns import KINDS, Parameters
from sagline.core.arrays import Array

Anchors = Literal["frame_anchors", "platform_anchors"]
_TURNS: Final = {"frame_anchors": (2,), "platform_anchors": (0, 1, 2)}  # axes about which nothing would notice


def anchor_covariance(parameters: Parameters, covariance: Array, which: Anchors) -> Array | None:
    """Covariance of the coordinates of all anchors of the frame or of the platform.

    Args:
        parameters: What was found.
        covariance: Of its values, (P, P).
        which: Anchors of what.

    Returns:
        [m^2], shape (m, 3, m, 3), zero of coordinates that nobody asked for; None where none was asked for.
    """
    first = KINDS[which].first
    numbers = parameters.where[first : first + 3].T.reshape(-1).astype(np.int64)
    if (numbers < 0).all():
        return None
    asked = numbers >= 0
    whole = np.zeros((numbers.size, numbers.size))
    whole[np.ix_(asked, asked)] = covariance[np.ix_(numbers[asked], numbers[asked])]
    m = numbers.size // 3
    return whole.reshape(m, 3, m, 3)


def without_motion(points: Array, which: Anchors) -> Array:
    """What takes out of small moves of anchors that which moves all of them together.

    Shifts are taken out, and turns of which no reading could tell: of the frame those about the vertical, of the
    platform all three, since its own axes are where its anchors say.

    Args:
        points: The anchors [m], shape (m, 3).
        which: Anchors of what.

    Returns:
        A projection of their coordinates, shape (3 m, 3 m).

    Source:
        Baarda 1973, "S-transformations and criterion matrices", with the anchors all alike.
    """
    m = len(points)
    ways = [np.tile(axis, m) for axis in np.eye(3)]
    ways += [np.cross(np.eye(3)[axis], points - points.mean(axis=0)).reshape(-1) for axis in _TURNS[which]]
    basis, size, _ = np.linalg.svd(np.stack(ways, axis=1), full_matrices=False)
    basis = basis[:, size > 1e-9 * size[0]]
    return np.asarray(np.eye(3 * m) - basis @ basis.T)


def relative_covariance(points: Array, covariance: Array, which: Anchors) -> Array:
    """What is left of the covariance of anchors without what moves all of them together.

    Args:
        points: The anchors [m], shape (m, 3).
        covariance: Of their coordinates [m^2], shape (m, 3, m, 3).
        which: Anchors of what.

    Returns:
        The same shape [m^2]; NaN where an infinite one makes it unknown.
    """
    if not np.isfinite(covariance).all():
        return np.full(covariance.shape, np.nan)
    kept, size = without_motion(points, which), points.size
    return np.asarray(kept @ covariance.reshape(size, size) @ kept.T).reshape(covariance.shape)
