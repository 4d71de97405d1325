"""The twelve tension distribution methods, and the methods by name."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Final, Literal

import numpy as np
from numpy.typing import ArrayLike

from sagline.core.arguments import choice, named
from sagline.core.arrays import Array, checked, locked, number
from sagline.core.errors import InvalidValueError
from sagline.core.surface import ordered_classes
from sagline.kernels import codes
from sagline.tension.method import GOAL, PREFERENCE_ROWS, ROOT_WEIGHT, TensionMethod, Variable


class MinimumNorm(TensionMethod):
    """Feasible tensions with the smallest Euclidean norm: projection of 0 onto the feasible set.

    The tensions depend only on the pose, so that a closed path ends with its initial tensions. Cables that are not
    needed are at their lower limits. Choose this method for repeated motions, and for low tensions in general.

    Source:
        Gia Luan & Truong Thinh 2020, (53); docs/model.md, section 5.
    """

    __slots__ = ()
    code: ClassVar[int] = codes.MINIMUM_NORM


class Closest(TensionMethod):
    """Feasible tensions nearest to the previous tensions, which are projected onto the feasible set.

    The method is equation (55) of the article. The tensions change smoothly along a path, but depend on the previous
    path. The first pose has the minimum norm. After infeasible poses, the reference is the last feasible tensions. In a
    batch of poses that is not a path, each pose has the minimum norm. Choose this method for smooth tensions along one
    path.

    Source:
        Gia Luan & Truong Thinh 2020, (55); the projection is derived in docs/model.md, section 5.
    """

    __slots__ = ()
    code: ClassVar[int] = codes.CLOSEST

    @property
    def alone(self) -> TensionMethod:
        """Minimum-norm method, because a single pose has no previous tensions."""
        return MinimumNorm(self.variable, self.lowest_point_margin)


@dataclass(frozen=True, slots=True, eq=False)
class QuadraticProgram(TensionMethod):
    """Feasible tensions with the smallest weighted sum of squared distances to target tensions.

    The method is a projection onto the feasible set, in which tensions are scaled by square roots of the weights. The
    result is exact and continuous. For up to two redundant cables, no iterations are needed. Choose this method to keep
    a pretension, or to reduce the load of some cables.

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
        """Check the options, and copy weights and targets into read-only arrays."""
        TensionMethod.__post_init__(self)
        object.__setattr__(self, "weights", checked(self.weights, "weights", "", above=0.0))
        object.__setattr__(self, "target", checked(self.target, "target", "N", low=0.0))

    def preference(self, cables: int) -> Array:
        """Square roots of the weights, and targets [N], for kernels.

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


class LowestSum(TensionMethod):
    """Feasible tensions with the smallest 1-norm, which are a corner of the feasible set.

    The method minimizes the total motor torque. At least m - n cables are at their limits. Along a path, the tensions
    can jump, because the optimum can change to another corner. If all points of a side are optimal, the point with the
    smallest norm is selected; with more than two redundant cables, a corner. Choose this method for static loads.

    Source:
        Borgstrom, Jordan, Sukhatme, Batalin & Kaiser 2009, "Rapid computation of optimally safe tension
        distributions for parallel cable-driven robots"; Lamaury & Gouttefarde 2013.
    """

    __slots__ = ()
    code: ClassVar[int] = codes.LOWEST_SUM
    continuous: ClassVar[bool] = False


class LowestMaximum(TensionMethod):
    """Feasible tensions with the smallest infinity-norm and, among these, with the smallest Euclidean norm.

    The method minimizes the largest cable load, which determines the size of the winches. The largest tension is
    continuous, but the other tensions may jump. Choose this method for the design of cables and drives. For motions,
    use the smooth approximation `PNorm`.

    Source:
        Gosselin & Grenier 2011, "On the determination of the force distribution in overconstrained cable-driven
        parallel mechanisms".
    """

    __slots__ = ()
    code: ClassVar[int] = codes.LOWEST_MAXIMUM
    continuous: ClassVar[bool] = False


# Largest exponent. With a larger exponent, Newton's method would lose the powers of small tensions by rounding.
LARGEST = 32.0


@dataclass(frozen=True, slots=True)
class PNorm(TensionMethod):
    """Feasible tensions with the smallest p-norm, which is the p-th root of the sum of p-th powers.

    The tensions are continuous for every p. The result for p = 2 is the minimum norm. For large p, the result
    approximates `LowestMaximum`, but without jumps. Choose this method, with p from 4 to 8, to reduce the largest cable
    load of a moving platform.

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
        """Exponent p of the norm."""
        return self.p


class Centroid(TensionMethod):
    """Centroid (barycenter) of the feasible polygon; with one redundant cable, center of the feasible interval.

    The tensions are continuous and far from all limits, so that slackness and overload are unlikely. The tensions are
    higher than necessary. The result is the same for every tension variable. For more than two redundant cables, use
    `AnalyticCenter`. Choose this method for high stiffness if energy consumption is not important. An unbounded
    feasible set has no centroid; the pose then gets the status UNBOUNDED.

    Source:
        Mikelsons, Bruckmann, Hiller & Schramm 2008, "A real-time capable force calculation algorithm for redundant
        tendon-based parallel manipulators"; Lamaury & Gouttefarde 2013.
    """

    __slots__ = ()
    code: ClassVar[int] = codes.CENTROID
    most_redundant: ClassVar[int | None] = 2


class AnalyticCenter(TensionMethod):
    """Feasible tensions with the largest product of distances to all limits.

    The tensions never reach a limit, and are smooth, while the feasible set has an interior. At the border of the
    workspace, the set shrinks to a single point, to which the tensions converge. The method allows any number of
    redundant cables. The result is the same for every tension variable. Choose this method for controllers that need
    differentiable tensions. An unbounded feasible set has no analytic center; the pose then gets the status UNBOUNDED.

    Source:
        Di Paola, Goldsztejn, Zoso & Caro 2023, "Analytic center based tension distribution for cable-driven
        platforms".
    """

    __slots__ = ()
    code: ClassVar[int] = codes.ANALYTIC_CENTER


class ClosedForm(TensionMethod):
    """Balancing tensions that are nearest to the middle of the tension limits.

    The tensions are smooth and linear in the wrench. If these tensions violate a limit, the pose gets the status
    NOT_COVERED, even if other tensions are feasible. Choose this method for the shortest computing time in the inner
    workspace.

    Source:
        Pott, Bruckmann & Mikelsons 2009, "Closed-form force distribution for parallel wire robots".
    """

    __slots__ = ()
    code: ClassVar[int] = codes.CLOSED_FORM
    needs_upper_limits: ClassVar[bool] = True


class ImprovedClosedForm(TensionMethod):
    """Closed form with iterations, each of which sets the tension with the largest violation to its limit.

    The number of iterations is at most the number of redundant cables. Nearly all feasible poses get a result; the
    other feasible poses get the status NOT_COVERED. The tensions jump only at poses at which the cable at a limit
    changes. Choose this method if `ClosedForm` gives no result at too many feasible poses.

    Source:
        Pott 2014, "An improved force distribution algorithm for over-constrained cable-driven parallel robots".
    """

    __slots__ = ()
    code: ClassVar[int] = codes.IMPROVED_CLOSED_FORM
    continuous: ClassVar[bool] = False
    needs_upper_limits: ClassVar[bool] = True


class Puncture(TensionMethod):
    """First point within the limits on the line between minimum-norm tensions and the (improved) closed form.

    The tensions are low, and the method is as fast as a closed form. Puncture solves the same poses as
    `ImprovedClosedForm`. A few feasible poses get the status NOT_COVERED: 2 of 1,200 in a test with ipanema-3. Choose
    this method for low tensions if the computer is too slow for a method with a polygon.

    Source:
        Mueller, Reichert & Bruckmann 2015, "Analysis of a real-time capable cable force computation method".
    """

    __slots__ = ()
    code: ClassVar[int] = codes.PUNCTURE
    continuous: ClassVar[bool] = False
    needs_upper_limits: ClassVar[bool] = True


Optimum = Literal["1-norm", "2-norm", "centroid"]
_OPTIMA = {"1-norm": codes.WALK_SUM, "2-norm": codes.WALK_NORM, "centroid": codes.WALK_CENTROID}


@dataclass(frozen=True, slots=True)
class PolygonWalk(TensionMethod):
    """Algorithm for n + 2 cables that walks around the feasible polygon to the best point.

    The results are equal to the results of `LowestSum`, `MinimumNorm` or `Centroid`, which clip the polygon and are
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


# Default method of all functions and commands. Poses without a path use `DEFAULT.alone`, the minimum norm.
DEFAULT: Final = Closest()


def methods_by_name() -> dict[str, type[TensionMethod]]:
    """Classes of the tension distribution methods by name, in the order of `__init__.pyi`."""
    return ordered_classes("sagline.tension")


def method_of(value: TensionMethod | str) -> TensionMethod:
    """Tension distribution method `value`, or the method with the name `value`, such as "minimum-norm"."""
    return named(value, TensionMethod, methods_by_name(), "tension")
