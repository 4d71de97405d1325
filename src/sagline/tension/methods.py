"""The twelve tension distribution methods, and a table of the methods by name."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Final, Literal

import numpy as np
from numpy.typing import ArrayLike

from sagline.core.arguments import choice, named
from sagline.core.arrays import Array, checked, locked, number
from sagline.core.errors import InvalidValueError
from sagline.kernels import codes
from sagline.kernels.tension.on_polygon import WALK_CENTROID, WALK_NORM, WALK_SUM
from sagline.tension.method import GOAL, PREFERENCE_ROWS, ROOT_WEIGHT, TensionMethod, Variable


@dataclass(frozen=True, slots=True)
class MinimumNorm(TensionMethod):
    """Feasible tensions with the smallest Euclidean norm: the projection of 0 onto the feasible set.

    The result depends only on the pose. A closed path therefore ends with its initial tensions. Cables that are not
    needed are at their lower limits. Choose this method for repeated motions, and for low tensions in general.

    Source:
        Gia Luan & Truong Thinh 2020, (53); docs/model.md, section 5.
    """

    code: ClassVar[int] = codes.MINIMUM_NORM


@dataclass(frozen=True, slots=True)
class Closest(TensionMethod):
    """Feasible tensions nearest to the previous tensions: projection onto the feasible set, (55) of the article.

    The tensions change smoothly along a path, but at a pose they depend on the path before it. The first pose has the
    minimum norm. After a gap of infeasible poses, the last feasible tensions are the reference. In a batch of poses,
    each pose is solved independently. Choose this method for the smoothest tensions along one path.

    Source:
        Gia Luan & Truong Thinh 2020, (55); the projection is derived in docs/model.md, section 5.
    """

    code: ClassVar[int] = codes.CLOSEST

    @property
    def alone(self) -> TensionMethod:
        """The minimum-norm method, because there are no previous tensions."""
        return MinimumNorm(self.variable, self.lowest_point_margin)


@dataclass(frozen=True, slots=True, eq=False)
class QuadraticProgram(TensionMethod):
    """The feasible tensions with the smallest weighted sum of squared distances to targets.

    In terms of the tensions times the roots of the weights, the method is a projection onto the feasible set. It is
    exact and continuous. For up to two redundant cables it needs no iterations. Choose this method to keep a
    pretension, or to reduce the load of some cables.

    Attributes:
        weights: Weight of each cable, > 0, shape () or (m,).
        target: Target tension [N], in the tension variable, >= 0, shape () or (m,).

    Source:
        Côté, Cardou & Gosselin 2016, "A tension distribution algorithm for cable-driven parallel robots operating
        beyond their wrench-feasible workspace"; docs/tension.md.
    """

    code: ClassVar[int] = codes.QUADRATIC_PROGRAM
    weights: ArrayLike = 1.0
    target: ArrayLike = 0.0

    def __post_init__(self) -> None:
        """Check the options; copy the caller's numbers into write-locked arrays."""
        TensionMethod.__post_init__(self)
        object.__setattr__(self, "weights", checked(self.weights, "weights", "", above=0.0))
        object.__setattr__(self, "target", checked(self.target, "target", "N", low=0.0))

    def preference(self, cables: int) -> Array:
        """Root weights, and targets multiplied by them.

        Args:
            cables: Number of cables m.

        Returns:
            Array of shape (PREFERENCE_ROWS, m).

        Raises:
            InvalidValueError: If `weights` or `target` are given for another number of cables.
        """
        rows = np.empty((PREFERENCE_ROWS, cables))
        for row, name, values in (
            (ROOT_WEIGHT, "weights", np.sqrt(np.asarray(self.weights))),
            (GOAL, "target", np.asarray(self.target)),
        ):
            if values.shape not in ((), (cables,)):
                raise InvalidValueError(
                    name, f"of shape {values.shape}", f"() or ({cables},)", "Give one value per cable."
                )
            rows[row] = values
        return locked(rows)

    def __reduce__(self) -> tuple[type[QuadraticProgram], tuple[Variable, float | None, ArrayLike, ArrayLike]]:
        """Pickle through the constructor."""
        return QuadraticProgram, (self.variable, self.lowest_point_margin, self.weights, self.target)


@dataclass(frozen=True, slots=True)
class LowestSum(TensionMethod):
    """The feasible tensions with the smallest 1-norm: a corner of the feasible set.

    The method minimizes the total motor torque. At least m - n cables are at their limits. The
    tensions are not continuous: along a path the optimum can jump to another corner. If all points of a side are
    optimal, the point with the smallest norm is selected; with more than two redundant cables, this point is a corner.
    Choose this method for static loads.

    Source:
        Borgstrom, Jordan, Sukhatme, Batalin & Kaiser 2009, "Rapid computation of optimally safe tension
        distributions for parallel cable-driven robots"; Lamaury & Gouttefarde 2013.
    """

    code: ClassVar[int] = codes.LOWEST_SUM
    continuous: ClassVar[bool] = False


@dataclass(frozen=True, slots=True)
class LowestMaximum(TensionMethod):
    """Feasible tensions with the smallest infinity-norm; among several, those with the smallest Euclidean norm.

    The method minimizes the largest cable load, and thus the required size of the winches. The largest tension is
    continuous, but the other tensions may jump. Choose this method to size cables and drives. For motions use `PNorm`,
    a smooth approximation.

    Source:
        Gosselin & Grenier 2011, "On the determination of the force distribution in overconstrained cable-driven
        parallel mechanisms".
    """

    code: ClassVar[int] = codes.LOWEST_MAXIMUM
    continuous: ClassVar[bool] = False


# largest exponent; for a larger one, the powers of small tensions would be lost by rounding in Newton's method
LARGEST = 32.0


@dataclass(frozen=True, slots=True)
class PNorm(TensionMethod):
    """Feasible tensions with the smallest p-norm, the p-th root of the sum of p-th powers.

    The tensions are continuous for every p. p = 2 is `MinimumNorm`, and large p approximates `LowestMaximum` without
    its jumps. Choose this method, with p from 4 to 8, to reduce the largest cable load of a moving platform.

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
            raise InvalidValueError("p", f"{p:g}", f"2 to {LARGEST:g}", "For larger p use LowestMaximum.")
        object.__setattr__(self, "p", p)

    @property
    def parameter(self) -> float:
        """The exponent."""
        return self.p


@dataclass(frozen=True, slots=True)
class Centroid(TensionMethod):
    """The centroid (barycenter) of the feasible polygon; with one redundant cable, the center of the feasible interval.

    The tensions are continuous and far from all limits, so that slackness and overload are unlikely. The tensions are
    higher than necessary. The result is the same for every tension variable. For more than two redundant cables use
    `AnalyticCenter`. Choose this method for a stiff, robust setup if energy is unimportant. If the feasible set is
    unbounded, it has no centroid, and the pose gets the status UNBOUNDED.

    Source:
        Mikelsons, Bruckmann, Hiller & Schramm 2008, "A real-time capable force calculation algorithm for redundant
        tendon-based parallel manipulators"; Lamaury & Gouttefarde 2013.
    """

    code: ClassVar[int] = codes.CENTROID
    most_redundant: ClassVar[int | None] = 2


@dataclass(frozen=True, slots=True)
class AnalyticCenter(TensionMethod):
    """The feasible tensions with the largest product of distances to all limits.

    The tensions are smooth wherever the feasible set has an interior, because limits never become active. Near the
    border of the workspace, the set shrinks to a point, and the tensions converge to this point. The method supports
    any number of redundant cables. The result is the same for every tension variable. Choose this method for
    controllers that require differentiable tensions. An unbounded feasible set has no center; the pose gets the status
    UNBOUNDED.

    Source:
        Di Paola, Goldsztejn, Zoso & Caro 2023, "Analytic center based tension distribution for cable-driven
        platforms".
    """

    code: ClassVar[int] = codes.ANALYTIC_CENTER


@dataclass(frozen=True, slots=True)
class ClosedForm(TensionMethod):
    """The balanced tensions nearest to the middle of the limits, if they satisfy the limits.

    The tensions are smooth and linear in the wrench, but some feasible poses get no result and the status NOT_COVERED.
    Choose this method for the shortest computing time if the platform remains in the inner workspace.

    Source:
        Pott, Bruckmann & Mikelsons 2009, "Closed-form force distribution for parallel wire robots".
    """

    code: ClassVar[int] = codes.CLOSED_FORM
    needs_upper_limits: ClassVar[bool] = True


@dataclass(frozen=True, slots=True)
class ImprovedClosedForm(TensionMethod):
    """Closed form with iterations; each iteration fixes the cable with the largest violation at its limit.

    The number of iterations is at most the number of redundant cables. Nearly all feasible poses get a result; the
    others get the status NOT_COVERED. The tensions are continuous except at poses where another cable is fixed. Choose
    this method if ClosedForm gives no result at too many feasible poses.

    Source:
        Pott 2014, "An improved force distribution algorithm for over-constrained cable-driven parallel robots".
    """

    code: ClassVar[int] = codes.IMPROVED_CLOSED_FORM
    continuous: ClassVar[bool] = False
    needs_upper_limits: ClassVar[bool] = True


@dataclass(frozen=True, slots=True)
class Puncture(TensionMethod):
    """First point within the limits on the line from the minimum-norm solution to the (improved) closed form.

    The method gives low tensions, and is as fast as a closed form. It solves the same poses as
    `ImprovedClosedForm`: a few feasible poses get the status NOT_COVERED, 2 of 1,200 in a test with ipanema-3. Choose
    this method for low tensions on hardware that is too slow for a polygon.

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
    """Algorithm for n + 2 cables: a walk around the feasible polygon to its best point.

    The results are equal to the results of `LowestSum`, `MinimumNorm` and `Centroid`, which clip the polygon and are
    faster. Choose this method for comparison with the published algorithm.

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

# The default method of all functions and commands. At poses without a path, `DEFAULT.alone` applies: the minimum norm.
DEFAULT: Final = Closest()


def method_of(value: TensionMethod | str, item: str = "tension") -> TensionMethod:
    """Return a tension distribution method unchanged; convert a name such as "minimum-norm" to a method."""
    return named(value, TensionMethod, METHODS, item)
