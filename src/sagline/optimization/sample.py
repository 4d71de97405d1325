"""Points that are spread over the unit cube."""

from __future__ import annotations

import numpy as np

from sagline.core.arrays import Array


def latin_hypercube(count: int, dimensions: int, seed: int) -> Array:
    """Points of which every coordinate has one in each of `count` equal intervals.

    Args:
        count: How many points.
        dimensions: Of the cube.
        seed: Of the generator.

    Returns:
        Points from 0 to 1, shape (count, dimensions).

    Source:
        McKay, Beckman & Conover 1979.
    """
    random = np.random.default_rng(seed)
    intervals = np.stack([random.permutation(count) for _ in range(dimensions)], axis=-1)
    return np.asarray((intervals + random.random((count, dimensions))) / count)
