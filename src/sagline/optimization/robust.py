"""Anchors that are not quite where they should be."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sagline.core.arguments import choice, whole_number
from sagline.core.arrays import Array, number
from sagline.kernels import tables

TAKEN = ("worst", "mean")
MOST_SAMPLES = 1000


@dataclass(frozen=True, slots=True)
class AnchorErrors:
    """Errors of all anchors as a sample, the same for all candidates: normally distributed, each coordinate by itself.

    Attributes:
        deviation: Standard deviation of each coordinate [m].
        samples: How many robots with errors stand for each candidate.
        take: Which of their values is the candidate's, "worst" or "mean".
        seed: Of the sample.
    """

    deviation: float
    samples: int
    take: str
    seed: int

    def __init__(self, deviation: float, *, samples: int = 8, take: str = "worst", seed: int = 0) -> None:
        """Check them.

        Args:
            deviation: Standard deviation of each coordinate [m], > 0.
            samples: How many, 1 to 1000.
            take: "worst" or "mean".
            seed: Of the sample, a whole number >= 0.

        Raises:
            InvalidValueError: If an argument is of the wrong kind, or out of range.

        Examples:
            >>> import sagline as sl
            >>> print(sl.AnchorErrors(0.01, samples=4).take)
            worst
        """
        values = {
            "deviation": number(deviation, "deviation", "m", above=0.0),
            "samples": whole_number(samples, "samples", 1, MOST_SAMPLES),
            "take": choice(take, "take", TAKEN),
            "seed": whole_number(seed, "seed", 0),
        }
        for field, value in values.items():
            object.__setattr__(self, field, value)

    def added(self, cables: Array) -> Array:
        """Tables of robots whose anchors err.

        Args:
            cables: Tables of candidates, shape (N, m, CABLE_COLUMNS).

        Returns:
            Shape (N, samples, m, CABLE_COLUMNS).
        """
        many = np.repeat(cables[:, None], self.samples, axis=1)
        ends = tables.PLATFORM_Z + 1  # both ends come first
        errors = np.random.default_rng(self.seed).standard_normal((self.samples, cables.shape[1], ends))
        many[..., :ends] += self.deviation * errors
        return many
