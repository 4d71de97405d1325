"""Sums of squares of standard normal numbers: by chance.

The special functions alone: a package of statistics would take a third of a second to load, and 50 MB.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.special import chdtr, chdtrc, chdtri

from sagline.core.arrays import Array


def below(squares: Any, freedoms: Any) -> Array:
    """Probability that chance has no more."""
    return np.asarray(chdtr(freedoms, squares))


def above(squares: Any, freedoms: Any) -> Array:
    """Probability that chance has more."""
    return np.asarray(chdtrc(freedoms, squares))


def exceeded_with(probability: Any, freedoms: Any) -> Array:
    """What chance exceeds with a probability, small ones kept to the last digit; of no freedoms, as of one."""
    return np.asarray(chdtri(np.maximum(freedoms, 1), probability))
