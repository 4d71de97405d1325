"""Cables without routing as kernel arguments: free spans and cables use the same memory."""

from __future__ import annotations

import numpy as np

from sagline.core.arrays import Array
from sagline.kernels.cable.terms import Cables

SAME = {
    "free_half_weight": "half_weight",
    "free_chord": "chord",
    "free_sine": "sine",
    "free_cosine": "cosine",
    "free_tau": "tau",
    "free_sag_force": "sag_force",
}


def plain_cables(m: int, fill: float, **given: Array) -> Cables:
    """Numbers for m cables: given values, and one value for all others."""
    words = {name: given.get(name, np.full(m, fill)) for name in Cables._fields if name != "machine"}
    words |= {free: words[own] for free, own in SAME.items()}
    return Cables(machine=False, **words)
