"""What comes out of another tool's robot file."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from sagline.robot.robot import Robot

# Where a file gives no material: a 4 mm steel rope, as assumed for the preset cogiro.
STEEL_ROPE_DENSITY: Final = 0.065  # kg/m
STEEL_ROPE_STIFFNESS: Final = 700e3  # N


@dataclass(frozen=True, slots=True, eq=False)
class Imported:
    """A robot read from another tool's file, and what the reading cost.

    Attributes:
        robot: The robot; `robot.assumed` holds what the file does not give, field by field, with the reason, and
            `robot.notes` what was lost.
        lost: What the file gives and the robot does not hold, one sentence each.
    """

    robot: Robot
    lost: tuple[str, ...]


def imported(robot: Robot, lost: tuple[str, ...]) -> Imported:
    """A robot whose notes tell what was lost, so that its file does too.

    Args:
        robot: The robot that was read.
        lost: What the file gives and the robot does not hold, one sentence each.

    Returns:
        Both; the robot's notes begin with "Not taken over:" where something was lost.
    """
    return Imported(robot.replace(notes=" ".join(("Not taken over:", *lost))) if lost else robot, lost)
