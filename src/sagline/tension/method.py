"""Base class of all tension distribution methods, and data of the methods for kernels."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar, Literal, NamedTuple

import numpy as np

from sagline.cables.model import CableModel
from sagline.core.arguments import choice, word_of
from sagline.core.arrays import Array, exactly, locked, number
from sagline.core.errors import InvalidValueError
from sagline.kernels import codes
from sagline.robot.batch import Robots, first_of
from sagline.robot.equilibrium import Equilibrium
from sagline.robot.reach import check_cable_count
from sagline.robot.robot import Robot

if TYPE_CHECKING:
    from sagline.kernels.inverse.poses import DistributionTerms, LimitTerms, ModelTerms

Variable = Literal["chord", "horizontal", "frame_end"]
VARIABLES = {"chord": codes.CHORD_TENSION, "horizontal": codes.HORIZONTAL_TENSION, "frame_end": codes.FRAME_END_TENSION}

# number of rows of the array of cable preferences
ROOT_WEIGHT, GOAL = 0, 1  # rows: square root of a cable's weight in the sum of squares; target tension [N]
PREFERENCE_ROWS = 2


@dataclass(frozen=True, slots=True)
class TensionMethod:
    """Base class of tension distribution methods, which select one of all feasible sets of tensions.

    Attributes:
        code: Code that selects the method in the kernels (`sagline.kernels.codes`), 0 to METHOD_COUNT - 1.
        needs_upper_limits: True if the method requires a finite upper limit for every cable.
        most_redundant: Largest number of redundant cables that the method allows; None for any number.
        continuous: True if the tensions change continuously when the pose changes continuously.
        variable: Tension variable of the method: "chord" (default), "horizontal" (T_x of the article), or "frame_end"
            (tension at the load cell of the winch). For example, minimum-norm tensions depend on the variable. A pose
            directly under an anchor is singular in the variable "horizontal", because a vertical cable has no
            horizontal tension.
        lowest_point_margin: T_adj of equation (54) of the article [N]. The bound T_x >= w D/(2 |tan phi|) + T_adj keeps
            the lowest point of each cable outside its span. None (default): no bound.
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
        code = getattr(self, "code", "missing")
        if code not in range(codes.METHOD_COUNT):
            step = "Choose the code of a method that the kernels have: sagline.kernels.codes."
            raise InvalidValueError(f"{type(self).__name__}.code", code, f"0 to {codes.METHOD_COUNT - 1}", step)
        object.__setattr__(self, "variable", choice(self.variable, "variable", VARIABLES))
        if self.lowest_point_margin is not None:
            margin = number(self.lowest_point_margin, "lowest_point_margin", "N", low=0.0)
            object.__setattr__(self, "lowest_point_margin", margin)

    @property
    def alone(self) -> TensionMethod:
        """Method that applies to a pose without a previous pose; only `Closest` has another method for such a pose."""
        return self

    @property
    def title(self) -> str:
        """Name of the method on the command line, followed by a tension variable other than the chord tension."""
        of = "" if self.variable == "chord" else f" of {self.variable.replace('_', '-')} tensions"
        return word_of(type(self).__name__) + of

    @property
    def parameter(self) -> float:
        """Numerical parameter of some methods: an exponent, or the code of an optimum; zero for all other methods."""
        return 0.0

    def preference(self, cables: int) -> Array:
        """Square roots of the cables' weights, and target tensions of the cables, for kernels.

        Args:
            cables: Number of cables m.

        Returns:
            Array of shape (PREFERENCE_ROWS, m).
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
        """T_adj for kernels; NaN if the option is None."""
        return float("nan") if self.lowest_point_margin is None else float(self.lowest_point_margin)


def shared_tension(state: Equilibrium, variable: Variable) -> Array:
    """Tensions (m,) or (N, m) [N] of a state in the tension variable `variable`."""
    match variable:
        case "chord":
            return state.chord_tension
        case "horizontal":
            return state.cables.horizontal_tension
    return state.cables.frame_end_tension


LIMITS_OF = {"chord": codes.LIMITS_OF_CHORD, "frame_end": codes.LIMITS_OF_FRAME_END}


class Options(NamedTuple):
    """First arguments of kernels: cable model, tension distribution method and limits."""

    model: ModelTerms  # code, k_h, k_p
    sharing: DistributionTerms  # code of the method, parameter, variable, preferences of the cables
    limits: LimitTerms  # code of the limited tension; T_adj [N], or NaN


def kernel_options(robot: Robots, model: CableModel, tension: TensionMethod) -> Options:
    """First arguments of kernels: cable model, tension distribution method and limits."""
    shared = first_of(robot)
    if isinstance(robot, Robot):
        check_sharing(robot, tension)
    else:
        for index, one in enumerate(robot):
            check_sharing(one, tension, f"robot[{index}]")
    # in a weightless cable, the frame-end tension is equal to the chord tension
    alike = model.weightless and tension.variable == "frame_end"
    variable = codes.CHORD_TENSION if alike else tension.variable_code
    item, shape = f"{type(tension).__name__}.preference", (PREFERENCE_ROWS, shared.cable_count)
    weight, goal = exactly(tension.preference(shared.cable_count), item, "", shape)
    return Options(
        (model.code, *model.parameters),
        (tension.code, tension.parameter, variable, weight, goal),
        (LIMITS_OF[shared.tension_limits_of], tension.validity),
    )


def takes_default_kernel(tension: TensionMethod) -> bool:
    """True for a method that minimizes the distance to a reference in a linear variable, as the default kernel does."""
    return tension.code <= codes.QUADRATIC_PROGRAM and tension.variable_code != codes.FRAME_END_TENSION


def check_sharing(robot: Robot, tension: TensionMethod, name: str | None = None) -> None:
    """Refuse a robot for which the tension distribution method `tension` is not defined."""
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
