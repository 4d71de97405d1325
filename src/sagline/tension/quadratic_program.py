"""Quadratic program: the feasible tensions nearest to targets, each cable with its own weight."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from sagline.core.arrays import Array, checked, locked
from sagline.core.errors import InvalidValueError
from sagline.kernels import codes
from sagline.tension.method import GOAL, PREFERENCE_ROWS, ROOT_WEIGHT, TensionMethod, Variable


@dataclass(frozen=True, slots=True, eq=False)
class QuadraticProgram(TensionMethod):
    """The feasible tensions of least sum of weights times squared distances to targets.

    In tensions weighted by the roots this is again a projection onto the feasible set: exact, and without iterations
    for two redundant cables or fewer. Continuous. Choose it to keep a pretension, or to spare some cables.

    Attributes:
        weights: Weight of each cable, > 0, shape () or (m,).
        target: Tension to be near [N], in the variable, >= 0, shape () or (m,).

    Source:
        Côté, Cardou & Gosselin 2016, "A tension distribution algorithm for cable-driven parallel robots operating
        beyond their wrench-feasible workspace"; docs/tension.md.
    """

    code: ClassVar[int] = codes.QUADRATIC_PROGRAM
    weights: ArrayLike = 1.0
    target: ArrayLike = 0.0

    def __post_init__(self) -> None:
        """Check the options; keep the caller's numbers as arrays of our own."""
        TensionMethod.__post_init__(self)
        object.__setattr__(self, "weights", checked(self.weights, "weights", "", above=0.0))
        object.__setattr__(self, "target", checked(self.target, "target", "N", low=0.0))

    def preference(self, cables: int) -> Array:
        """Root weights, and targets times them.

        Args:
            cables: Number of cables m.

        Returns:
            Array of shape (PREFERENCE_ROWS, m).

        Raises:
            InvalidValueError: If there are weights or targets for another number of cables.
        """
        rows = np.empty((PREFERENCE_ROWS, cables))
        for row, name, values in (
            (ROOT_WEIGHT, "weights", np.sqrt(np.asarray(self.weights))),
            (GOAL, "target", np.asarray(self.target)),
        ):
            if values.shape not in ((), (cables,)):
                raise InvalidValueError(name, f"of shape {values.shape}", f"() or ({cables},)", "Give one a cable.")
            rows[row] = values
        return locked(rows)

    def __reduce__(self) -> tuple[type[QuadraticProgram], tuple[Variable, float | None, ArrayLike, ArrayLike]]:
        """Pickle through the constructor."""
        return QuadraticProgram, (self.variable, self.lowest_point_margin, self.weights, self.target)
