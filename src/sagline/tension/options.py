"""Robot, cable model and method of sharing in the form in which kernels take them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from sagline.cables.model import CableModel
from sagline.core.arrays import locked
from sagline.core.errors import InvalidValueError
from sagline.kernels import codes
from sagline.kernels.inverse.poses import DistributionTerms, LimitTerms, ModelTerms
from sagline.robot.batch import Robots, first_of
from sagline.robot.robot import Robot
from sagline.tension.method import TensionMethod

LIMITS_OF = {"chord": codes.LIMITS_OF_CHORD, "frame_end": codes.LIMITS_OF_FRAME_END}


class Options(NamedTuple):
    """Model, method and limits as kernels take them first."""

    model: ModelTerms  # code, k_h, k_p
    sharing: DistributionTerms  # method, parameter, variable, root weights and goals of the cables
    limits: LimitTerms  # which quantity is limited, and the article's T_adj [N] or NaN


def kernel_options(robot: Robots, model: CableModel, tension: TensionMethod) -> Options:
    """Model, method and limits as kernels take them first."""
    shared = first_of(robot)
    if isinstance(robot, Robot):
        check_sharing(robot, tension)
    else:
        for index, one in enumerate(robot):
            check_sharing(one, tension, f"robot[{index}]")
    # a weightless cable has one tension, which is linear even where it is zero
    alike = model.weightless and tension.variable == "frame_end"
    variable = codes.CHORD_TENSION if alike else tension.variable_code
    weight, goal = (locked(row) for row in tension.preference(shared.cable_count))
    return Options(
        (model.code, *model.parameters),
        (tension.code, tension.parameter, variable, weight, goal),
        (LIMITS_OF[shared.tension_limits_of], tension.validity),
    )


def takes_default_kernel(tension: TensionMethod) -> bool:
    """True if a method is nearest to a reference in a linear variable: compiled first."""
    return tension.code <= codes.QUADRATIC_PROGRAM and tension.variable_code != codes.FRAME_END_TENSION


def check_sharing(robot: Robot, tension: TensionMethod, name: str | None = None) -> None:
    """Refuse a robot whose cables a method does not support."""
    n, m = robot.degrees_of_freedom, robot.cable_count
    called = name or robot.name
    item = f"{called}: number of cables"
    if m < n:
        step = "Add cables, or choose a motion pattern with fewer freedoms."
        raise InvalidValueError(item, m, f">= {n} for {robot.motion_pattern}", step)
    method = type(tension).__name__
    most = tension.most_redundant
    if most is not None and m > n + most:
        step = "Choose AnalyticCenter or MinimumNorm, which share among any number."
        raise InvalidValueError(item, m, f"{n} to {n + most} for {robot.motion_pattern} with {method}", step)
    unlimited = np.isinf(robot.tension_max)
    if tension.needs_upper_limits and unlimited.any():
        step = f"{method} needs an upper limit of every cable: give one, or choose MinimumNorm."
        raise InvalidValueError(f"{called}: tension_max[{int(np.argmax(unlimited))}]", "infinite", "finite", step)
