"""The twelve tension distribution methods, and all of them by name."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Literal

import numpy as np
from numpy.typing import ArrayLike

from sagline.core.arguments import choice
from sagline.core.arrays import Array, checked, locked, number
from sagline.core.errors import InvalidValueError
from sagline.kernels import codes
from sagline.kernels.tension.on_polygon import WALK_CENTROID, WALK_NORM, WALK_SUM
from sagline.tension.method import GOAL, PREFERENCE_ROWS, ROOT_WEIGHT, TensionMethod, Variable


@dataclass(frozen=True, slots=True)
class MinimumNorm(TensionMethod):
    """The feasible tensions of least Euclidean norm: the projection of 0 onto the feasible set.

    Depends on the pose alone, so that a closed path closes; lets cables that are not needed go to their lower limits.
    Choose it for plans that repeat and for low tensions throughout.

    Source:
        Gia Luan & Truong Thinh 2020, (53); docs/model.md, section 5.
    """

    code: ClassVar[int] = codes.MINIMUM_NORM


@dataclass(frozen=True, slots=True)
class Closest(TensionMethod):
    """The article's choice (55): nearest to the previous tension set, by projection onto the feasible polygon.

    Follows a path smoothly, and depends on it: the first pose takes the minimum norm, and after a gap of
    infeasible poses the last feasible set is the reference. In a batch of poses every pose stands alone.
    Choose it for the smoothest tensions along one path.

    Source:
        Gia Luan & Truong Thinh 2020, (55); the projection is derived in docs/model.md, section 5.
    """

    code: ClassVar[int] = codes.CLOSEST

    @property
    def alone(self) -> TensionMethod:
        """The minimum norm."""
        return MinimumNorm(self.variable, self.lowest_point_margin)


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


@dataclass(frozen=True, slots=True)
class LowestSum(TensionMethod):
    """The feasible tensions of least 1-norm: a corner of the feasible set.

    The least motor torque in all; as many cables as are redundant stay at their limits. The corner jumps to another
    one where the path turns the polygon, so the tensions are not continuous. Where a whole side is lowest, its point
    of least norm is taken (for more than two redundant cables, one of its corners). Choose it for static loads.

    Source:
        Borgstrom, Jordan, Sukhatme, Batalin & Kaiser 2009, "Rapid computation of optimally safe tension
        distributions for parallel cable-driven robots"; Lamaury & Gouttefarde 2013.
    """

    code: ClassVar[int] = codes.LOWEST_SUM
    continuous: ClassVar[bool] = False


@dataclass(frozen=True, slots=True)
class LowestMaximum(TensionMethod):
    """The feasible tensions of least infinity-norm; of those with the same largest tension, the ones of least norm.

    Spares the most loaded cable, and so the winches' size; continuous in its largest tension but not in the others.
    Choose it to size cables and drives; for motion take `PNorm`, which comes near it smoothly.

    Source:
        Gosselin & Grenier 2011, "On the determination of the force distribution in overconstrained cable-driven
        parallel mechanisms".
    """

    code: ClassVar[int] = codes.LOWEST_MAXIMUM
    continuous: ClassVar[bool] = False


LARGEST = 32.0  # beyond, the powers of small tensions leave nothing for Newton's method to see


@dataclass(frozen=True, slots=True)
class PNorm(TensionMethod):
    """The feasible tensions of least p-norm, the p-th root of the sum of their p-th powers.

    Continuous for every p: p = 2 is `MinimumNorm`, large p comes near `LowestMaximum` without its jumps. Choose it,
    with p from 4 to 8, to spare the most loaded cable on a moving platform.

    Attributes:
        p: Exponent, 2 to 32.

    Source:
        Verhoeven 2004, "Analysis of the workspace of tendon-based Stewart platforms", ch. 5; Gosselin & Grenier 2011.
    """

    code: ClassVar[int] = codes.P_NORM
    p: float = 4.0

    def __post_init__(self) -> None:
        """Check the options."""
        TensionMethod.__post_init__(self)
        p = number(self.p, "p", "", low=2.0)
        if p > LARGEST:
            raise InvalidValueError("p", f"{p:g}", f"2 to {LARGEST:g}", "For larger p take LowestMaximum.")
        object.__setattr__(self, "p", p)

    @property
    def parameter(self) -> float:
        """The exponent."""
        return self.p


@dataclass(frozen=True, slots=True)
class Centroid(TensionMethod):
    """The centroid of the feasible polygon, the barycenter; the middle of the interval for one redundant cable.

    Continuous, and far from all limits, so that slack and overload are far too; costs more tension than needed. The
    same point in every variable. For more than two redundant cables take `AnalyticCenter`. Choose it for a stiff,
    robust setup where energy does not count. A set without end has no centroid: the pose is UNBOUNDED.

    Source:
        Mikelsons, Bruckmann, Hiller & Schramm 2008, "A real-time capable force calculation algorithm for redundant
        tendon-based parallel manipulators"; Lamaury & Gouttefarde 2013.
    """

    code: ClassVar[int] = codes.CENTROID
    most_redundant: ClassVar[int | None] = 2


@dataclass(frozen=True, slots=True)
class AnalyticCenter(TensionMethod):
    """The feasible tensions with the largest product of distances to all limits.

    Smooth wherever the feasible set has an inside: no limit ever becomes active. Near the border of the workspace,
    where the set shrinks to a point, it follows. Any number of redundant cables; the same point in every variable.
    Choose it for controllers that need differentiable tensions. A set without end has no center: UNBOUNDED.

    Source:
        Di Paola, Goldsztejn, Zoso & Caro 2023, "Analytic center based tension distribution for cable-driven
        platforms".
    """

    code: ClassVar[int] = codes.ANALYTIC_CENTER


@dataclass(frozen=True, slots=True)
class ClosedForm(TensionMethod):
    """The balanced tensions nearest to the middle of the limits, if they keep them.

    Linear in the wrench and smooth, but it misses part of the feasible poses: those are NOT_COVERED. Choose it where
    every microsecond counts and the platform stays in the inner workspace.

    Source:
        Pott, Bruckmann & Mikelsons 2009, "Closed-form force distribution for parallel wire robots".
    """

    code: ClassVar[int] = codes.CLOSED_FORM
    needs_upper_limits: ClassVar[bool] = True


@dataclass(frozen=True, slots=True)
class ImprovedClosedForm(TensionMethod):
    """The closed form, but a cable that misses its limit most is held there and the rest shared again.

    As many times as there are redundant cables; covers nearly all of the feasible poses, and says NOT_COVERED for the
    others. Continuous except at changes of the held cable. Choose it where ClosedForm ends too early.

    Source:
        Pott 2014, "An improved force distribution algorithm for over-constrained cable-driven parallel robots".
    """

    code: ClassVar[int] = codes.IMPROVED_CLOSED_FORM
    continuous: ClassVar[bool] = False
    needs_upper_limits: ClassVar[bool] = True


@dataclass(frozen=True, slots=True)
class Puncture(TensionMethod):
    """Entry into the limits on the line from the minimum-norm solution to the (improved) closed form.

    Low tensions at the price of a closed form; covers what `ImprovedClosedForm` covers. Choose it for low tensions on
    hardware that can afford no polygon.

    Source:
        Mueller, Reichert & Bruckmann 2015, "Analysis of a real-time capable cable force computation method".
    """

    code: ClassVar[int] = codes.PUNCTURE
    continuous: ClassVar[bool] = False
    needs_upper_limits: ClassVar[bool] = True


Optimum = Literal["1-norm", "2-norm", "centroid"]
_OPTIMA = {"1-norm": WALK_SUM, "2-norm": WALK_NORM, "centroid": WALK_CENTROID}


@dataclass(frozen=True, slots=True)
class PolygonWalk(TensionMethod):
    """The algorithm for n + 2 cables: walk around the feasible polygon, take its best point.

    Its answers are those of `LowestSum`, `MinimumNorm` and `Centroid`, which cut the polygon instead and are quicker.
    Choose it to compare with that algorithm as published.

    Attributes:
        optimum: "1-norm", "2-norm" (default) or "centroid".

    Source:
        Gouttefarde, Lamaury, Reichert & Bruckmann 2015, "A versatile tension distribution algorithm for n-DOF parallel
        robots driven by n + 2 cables".
    """

    code: ClassVar[int] = codes.POLYGON_WALK
    needs_upper_limits: ClassVar[bool] = True
    most_redundant: ClassVar[int | None] = 2
    optimum: Optimum = "2-norm"

    def __post_init__(self) -> None:
        """Check the options."""
        TensionMethod.__post_init__(self)
        object.__setattr__(self, "optimum", choice(self.optimum, "optimum", _OPTIMA))

    @property
    def parameter(self) -> float:
        """Code of the optimum."""
        return _OPTIMA[self.optimum]


METHODS: dict[str, type[TensionMethod]] = {
    method.__name__: method
    for method in (
        Closest,
        MinimumNorm,
        QuadraticProgram,
        LowestSum,
        LowestMaximum,
        PNorm,
        Centroid,
        AnalyticCenter,
        ClosedForm,
        ImprovedClosedForm,
        Puncture,
        PolygonWalk,
    )
}
