"""Support functions of sets of loads, and the extreme loads along a direction."""

from __future__ import annotations

import numpy as np
import pytest

from sagline.core.arrays import Array
from sagline.kernels.workspaces import wrench_set as kernels
from sagline.kernels.workspaces.wrench_set import Loads
from tests.kernels.compiled import from_python

reach, farthest = from_python(kernels.reach_of_loads), from_python(kernels.farthest)


def loads_of(kind: str, rng: np.random.Generator) -> Loads:
    """Segments, an ellipsoid, polytopes, or all of them, about a center."""
    every = kind == "all"
    sizes = np.array([5, 3] if every or kind == "polytopes" else [], dtype=np.int64)
    corners = rng.normal(size=(sizes.sum(), 6))
    for part in np.split(corners, np.cumsum(sizes)[:-1]) if len(sizes) else ():
        part -= part.mean(axis=0)
    return Loads(
        rng.normal(size=6),
        rng.normal(size=(4 if every or kind == "segments" else 0, 6)),
        rng.normal(size=(2 if every or kind == "ellipsoids" else 0, 6, 6)),
        corners,
        sizes,
    )


def support(loads: Loads, along: Array) -> float:
    """Largest along . (w - center), by formulas for each part."""
    total = np.abs(loads.segments @ along).sum() + sum(np.linalg.norm(axes @ along) for axes in loads.ellipsoids)
    parts = np.split(loads.corners @ along, np.cumsum(loads.sizes)[:-1]) if len(loads.sizes) else []
    return float(total + sum(part.max() for part in parts))


@pytest.mark.parametrize("kind", ["segments", "ellipsoids", "polytopes", "all"])
def test_the_extreme_load_agrees_with_the_support_function(kind: str) -> None:
    rng = np.random.default_rng(31)
    for _ in range(20):
        loads, against, wrench = loads_of(kind, rng), rng.normal(size=6), np.full(6, np.nan)
        most = support(loads, -against)
        assert reach(loads, against) == pytest.approx(most, rel=1e-13)
        farthest(loads, against, wrench)
        assert -against @ (wrench - loads.center) == pytest.approx(most, rel=1e-13)
        other = rng.normal(size=6)  # it belongs to the set: it is within the support function of every direction
        assert other @ (wrench - loads.center) <= support(loads, other) + 1e-12
