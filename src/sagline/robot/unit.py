"""Unit vectors and quaternions that stay what they are when normalized again."""

from __future__ import annotations

import numpy as np

from sagline.core.arrays import Array

# Rounding leaves a freshly normalized vector of 3 or 4 numbers within 2.5 eps of length 1.
_ROUNDING = 4.0 * np.finfo(np.float64).eps


def unit(vectors: Array) -> Array:
    """Scale vectors along the last axis to length 1; those that have it to rounding keep every bit.

    Files, pickles and copies pass here again and must not drift. Zero vectors give NaN: check lengths first.

    Args:
        vectors: Shape (..., k).

    Returns:
        Array of the same shape; the same array where nothing was to be done.
    """
    length = np.sqrt(np.einsum("...i,...i->...", vectors, vectors))[..., np.newaxis]
    if (np.abs(length - 1.0) <= _ROUNDING).all():
        return vectors
    scaled: Array = vectors / np.where(np.abs(length - 1.0) <= _ROUNDING, 1.0, length)
    return scaled
