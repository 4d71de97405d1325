"""Interface of all tension distribution methods, and their data for kernels."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Literal, NamedTuple

import numpy as np

from sagline.cables.model import CableModel
from sagline.core.arguments import choice, word_of
from sagline.core.arrays import Array, locked, number
from sagline.core.errors import InvalidValueError
from sagline.kernels import codes
from sagline.kernels.inverse.poses import DistributionTerms, LimitTerms, ModelTerms
from sagline.robot.batch import Robots, first_of
from sagline.robot.equilibrium import Equilibrium
from sagline.robot.reach import check_cable_count
from sagline.robot.robot import Robot

Variable = Literal["chord", "horizontal", "frame_end"]
VARIABLES = {
    "chord": codes.CHORD_TENSION,
    "horizontal": codes.HORIZONTAL_TENSION,
    "frame_end": codes.FRAME_END_TENSION,
}

# rows of the array of cable preferences
ROOT_WEIGHT, GOAL = 0, 1  # root of the weight of a cable in the sum of squares, and its target tension [N]
PREFERENCE_ROWS = 2


@dataclass(frozen=True, slots=True)
class TensionMethod:
    """Rule that selects one tension per cable among all feasible tensions. The rule has options, and a kernel code.

    Attributes:
        code: Code of the method in the kernels (`sagline.kernels.codes`).
        needs_upper_limits: True if every cable must have a finite upper limit.
        most_redundant: Largest number of redundant cables for which the method works; None for any number.
        continuous: True if the tensions change without jumps when the pose changes continuously.
        variable: The tension variable of the method: "chord" (default), "horizontal" (T_x of the article), or
            "frame_end" (the tension at the load cell of the winch). Minimum-norm results depend on the variable. A
            vertical cable has no horizontal tension. A pose directly under an anchor is therefore singular in the
            variable "horizontal".
        lowest_point_margin: T_adj of (54) in the article [N]: the bound T_x >= w D/(2 |tan phi|) + T_adj keeps the
            lowest point of each cable outside its span. None (default): no such bound.
    """

    code: ClassVar[int]
    needs_upper_limits: ClassVar[bool] = False
    most_redundant: ClassVar[int | None] = None
    continuous: ClassVar[bool] = True
    variable: Variable = "chord"
    lowest_point_margin: float | None = None

    def __post_init__(self) -> None:
        """Check the options."""
        if type(self) is TensionMethod:
            step = "Choose a tension method, for instance MinimumNorm()."
            raise InvalidValueError("TensionMethod()", "the abstract base class", "a tension distribution method", step)
        object.__setattr__(self, "variable", choice(self.variable, "variable", VARIABLES))
        if self.lowest_point_margin is not None:
            margin = number(self.lowest_point_margin, "lowest_point_margin", "N", low=0.0)
            object.__setattr__(self, "lowest_point_margin", margin)

    @property
    def alone(self) -> TensionMethod:
        """Method for a pose without a previous pose: this method, except for `Closest`."""
        return self

    @property
    def title(self) -> str:
        """Name on the command line, followed by the tension variable if the variable is not the chord tension."""
        of = "" if self.variable == "chord" else f" of {self.variable.replace('_', '-')} tensions"
        return word_of(type(self).__name__) + of

    @property
    def parameter(self) -> float:
        """Numerical parameter, which only some methods have: an exponent, or the code of an optimum."""
        return 0.0

    def preference(self, cables: int) -> Array:
        """Root weights and targets of the cables, for kernels.

        Args:
            cables: Number of cables m.

        Returns:
            Array of shape (PREFERENCE_ROWS, m); targets in N.
        """
        rows = np.zeros((PREFERENCE_ROWS, cables))
        rows[ROOT_WEIGHT] = 1.0
        return locked(rows)

    @property
    def variable_code(self) -> int:
        """Code of the tension variable for kernels."""
        return VARIABLES[self.variable]

    @property
    def validity(self) -> float:
        """T_adj for kernels: NaN for None."""
        return float("nan") if self.lowest_point_margin is None else float(self.lowest_point_margin)


def shared_tension(state: Equilibrium, variable: Variable) -> Array:
    """Tensions of a state in the variable of the tension distribution method, (m,) or (N, m) [N]."""
    match variable:
        case "chord":
            return state.chord_tension
        case "horizontal":
            return state.cables.horizontal_tension
    return state.cables.frame_end_tension


LIMITS_OF = {"chord": codes.LIMITS_OF_CHORD, "frame_end": codes.LIMITS_OF_FRAME_END}


class Options(NamedTuple):
    """Model, method and limits: the first arguments of the kernels."""

    model: ModelTerms  # code, k_h, k_p
    sharing: DistributionTerms  # method, parameter, variable, root weights and targets of the cables
    limits: LimitTerms  # limited tension, and the article's T_adj [N] or NaN


def kernel_options(robot: Robots, model: CableModel, tension: TensionMethod) -> Options:
    """Model, method and limits: the first arguments of the kernels."""
    shared = first_of(robot)
    if isinstance(robot, Robot):
        check_sharing(robot, tension)
    else:
        for index, one in enumerate(robot):
            check_sharing(one, tension, f"robot[{index}]")
    # a weightless cable has the same tension everywhere, so that its frame-end tension is its chord tension
    alike = model.weightless and tension.variable == "frame_end"
    variable = codes.CHORD_TENSION if alike else tension.variable_code
    weight, goal = (locked(row) for row in tension.preference(shared.cable_count))
    return Options(
        (model.code, *model.parameters),
        (tension.code, tension.parameter, variable, weight, goal),
        (LIMITS_OF[shared.tension_limits_of], tension.validity),
    )


def takes_default_kernel(tension: TensionMethod) -> bool:
    """True if `tension` minimizes the distance to a reference in a linear variable. A shorter kernel does this."""
    return tension.code <= codes.QUADRATIC_PROGRAM and tension.variable_code != codes.FRAME_END_TENSION


def check_sharing(robot: Robot, tension: TensionMethod, name: str | None = None) -> None:
    """Refuse `robot` if the tension distribution method `tension` is not defined for it."""
    n, m = robot.degrees_of_freedom, robot.cable_count
    called = name or robot.name
    check_cable_count(robot, called)
    method = type(tension).__name__
    most = tension.most_redundant
    if most is not None and m > n + most:
        step = "Choose AnalyticCenter or MinimumNorm, which accept any number of cables."
        raise InvalidValueError(
            f"{called}: number of cables", m, f"{n} to {n + most} for {robot.motion_pattern} with {method}", step
        )
    unlimited = np.isinf(robot.tension_max)
    if tension.needs_upper_limits and unlimited.any():
        step = f"{method} needs an upper limit of every cable: give one, or choose MinimumNorm."
        raise InvalidValueError(f"{called}: tension_max[{int(np.argmax(unlimited))}]", "infinite", "finite", step)
