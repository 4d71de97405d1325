"""Robot, cable model and method of sharing in the form in which kernels take them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from sagline.arrays import locked
from sagline.cables.model import CableModel
from sagline.errors import InvalidValueError
from sagline.kernels import codes
from sagline.kernels.inverse.poses import LimitTerms, ModelTerms, SharingTerms
from sagline.robot.robot import Robot
from sagline.tension.method import TensionMethod

LIMITS_OF = {"chord": codes.LIMITS_OF_CHORD, "frame_end": codes.LIMITS_OF_FRAME_END}


class Options(NamedTuple):
    """Model, method and limits as kernels take them first.

    Attributes:
        model: Code, k_h, k_p.
        sharing: Method, parameter, variable, root weights and goals of the cables.
        limits: Which quantity is limited, and the article's T_adj [N] or NaN.
    """

    model: ModelTerms
    sharing: SharingTerms
    limits: LimitTerms


def kernel_options(robot: Robot, model: CableModel, tension: TensionMethod) -> Options:
    """Model, method and limits as kernels take them first.

    Raises:
        InvalidValueError: If the robot's tensions cannot be determined, or not by this method.
    """
    check_sharing(robot, tension)
    weight, goal = (locked(row) for row in tension.preference(robot.cable_count))
    return Options(
        (model.code, *model.parameters),
        (tension.code, tension.parameter, tension.variable_code, weight, goal),
        (LIMITS_OF[robot.tension_limits_of], tension.validity),
    )


def takes_default_kernel(tension: TensionMethod) -> bool:
    """Whether a method shares nearest to a reference in a linear variable: what is compiled first."""
    return tension.code <= codes.QUADRATIC_PROGRAM and tension.variable_code != codes.FRAME_END_TENSION


def check_sharing(robot: Robot, tension: TensionMethod) -> None:
    """Refuse a robot among whose cables a method cannot share the load.

    Raises:
        InvalidValueError: If it has fewer cables than degrees of freedom, more redundant ones than the method can
            share among, or no upper limits where the method needs them.
    """
    n, m = robot.degrees_of_freedom, robot.cable_count
    item = f"{robot.name}: number of cables"
    if m < n:
        step = "Add cables, or choose a motion pattern with fewer freedoms."
        raise InvalidValueError(item, m, f">= {n} for {robot.motion_pattern}", step)
    name = type(tension).__name__
    most = tension.most_redundant
    if most is not None and m > n + most:
        step = "Choose AnalyticCenter or MinimumNorm, which share among any number."
        raise InvalidValueError(item, m, f"{n} to {n + most} for {robot.motion_pattern} with {name}", step)
    unlimited = np.isinf(robot.tension_max)
    if tension.needs_upper_limits and unlimited.any():
        step = f"{name} needs an upper limit of every cable: give one, or choose MinimumNorm."
        raise InvalidValueError(f"{robot.name}: tension_max[{int(np.argmax(unlimited))}]", "infinite", "finite", step)
