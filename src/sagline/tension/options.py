"""Robot, cable model and method of sharing in the form in which kernels take them."""

from __future__ import annotations

from sagline.cables.model import CableModel
from sagline.errors import InvalidValueError
from sagline.kernels import codes
from sagline.robot.robot import Robot
from sagline.tension.method import TensionMethod

LIMITS_OF = {"chord": codes.LIMITS_OF_CHORD, "frame_end": codes.LIMITS_OF_FRAME_END}
MOST_REDUNDANT = 2


def kernel_options(
    robot: Robot, model: CableModel, tension: TensionMethod
) -> tuple[int, float, float, int, int, int, float]:
    """Model, method and limits as the kernels' leading codes and parameters."""
    limits_of = LIMITS_OF[robot.tension_limits_of]
    return model.code, *model.parameters, tension.code, tension.variable_code, limits_of, tension.validity


def check_redundancy(robot: Robot) -> None:
    """Refuse a robot whose tensions cannot be determined.

    Raises:
        InvalidValueError: If it has fewer cables than degrees of freedom, or more than two redundant ones.
    """
    n, m = robot.degrees_of_freedom, robot.cable_count
    if n <= m <= n + MOST_REDUNDANT:
        return
    step = "Add cables, or choose a motion pattern with fewer freedoms." if m < n else "Leave out some cables."
    raise InvalidValueError(
        f"{robot.name}: number of cables", m, f"{n} to {n + MOST_REDUNDANT} for {robot.motion_pattern}", step
    )
