"""Profiles: how much of a way is done at which share of its time, from rest to rest."""

from __future__ import annotations

from dataclasses import dataclass
from math import factorial
from typing import Final

import numpy as np

from sagline.core.arrays import Array


@dataclass(frozen=True, slots=True)
class Profile:
    """A polynomial that goes from 0 to 1 while s goes from 0 to 1, as smooth at both ends as its degree allows.

    With u = s (1 - s) its slope is c u^k, so that its first k derivatives vanish at both ends; the degree is 2 k + 1.

    Attributes:
        order: k, >= 2: 2 for the quintic (acceleration vanishes at the ends), 3 for the septic (jerk too).
        tail: Coefficients of the polynomial after its factor s^(k + 1), constant first.

    Source:
        c u^k integrated by the binomial theorem; docs/model.md, section 7.
    """

    order: int
    tail: tuple[float, ...]

    @classmethod
    def of_order(cls, order: int) -> Profile:
        """The profile whose first `order` derivatives vanish at both ends.

        Args:
            order: k, >= 2.

        Returns:
            Profile of degree 2 k + 1.
        """
        k = order
        scale = factorial(2 * k + 1) // factorial(k) ** 2
        binomials = (factorial(k) // factorial(i) // factorial(k - i) for i in range(k + 1))
        return cls(k, tuple(scale * (-1) ** i * b / (k + 1 + i) for i, b in enumerate(binomials)))

    @property
    def slope(self) -> float:
        """C = (2 k + 1)!/(k!)^2: what makes the integral of c u^k one."""
        return float(factorial(2 * self.order + 1) // factorial(self.order) ** 2)

    @property
    def peak_speed(self) -> float:
        """Largest slope, at s = 1/2: c/4^k."""
        return self.slope / 4.0**self.order

    @property
    def peak_acceleration(self) -> float:
        """Largest second derivative, where (1 - 2 s)^2 = q = 1/(2 k - 1): c k u^(k - 1) sqrt(q), u = (1 - q)/4."""
        k = self.order
        q = 1.0 / (2 * k - 1)
        return float(self.slope * k * (0.25 * (1.0 - q)) ** (k - 1) * np.sqrt(q))

    def share(self, s: Array) -> Array:
        """Share of the way that is done.

        Args:
            s: Share of the time, 0 to 1, of any shape.

        Returns:
            Array of the shape of s, from 0 to 1.
        """
        total: Array = np.full_like(s, self.tail[-1])
        for coefficient in self.tail[-2::-1]:
            total = coefficient + s * total
        return s ** (self.order + 1) * total

    def rates(self, s: Array) -> tuple[Array, Array, Array]:
        """First, second and third derivative of the share by s; the first k of them exactly 0 at both ends.

        Args:
            s: Share of the time, 0 to 1, of any shape.

        Returns:
            Three arrays of the shape of s.
        """
        k = self.order
        u, bend = s * (1.0 - s), 1.0 - 2.0 * s
        second = self.slope * k * u ** (k - 1) * bend
        third = self.slope * k * u ** (k - 2) * ((k - 1) * bend * bend - 2.0 * u)
        return self.slope * u**k, second, third


QUINTIC: Final = Profile.of_order(2)  # 10 s^3 - 15 s^4 + 6 s^5
SEPTIC: Final = Profile.of_order(3)  # 35 s^4 - 84 s^5 + 70 s^6 - 20 s^7
