"""A robot at rest, or in quasi-static motion: where its platform is and what its cables carry."""

from __future__ import annotations

from dataclasses import dataclass

from sagline.arrays import Array
from sagline.cables.model import CableState
from sagline.robot.pose import Pose
from sagline.robot.robot import Robot


@dataclass(frozen=True, slots=True, eq=False)
class Equilibrium:
    """The one type that stiffness, modes, the viewer and the files take.

    Attributes:
        robot: The robot.
        pose: Pose of the platform, single or a batch of N.
        wrench: External plus inertial wrench on the platform about its center of mass, world axes, without
            gravity: force [N], moment [N m], shape (6,) or (N, 6).
        cables: State of the cables, fields of shape (m,) or (N, m).
    """

    robot: Robot
    pose: Pose
    wrench: Array
    cables: CableState

    @property
    def limited_tension(self) -> Array:
        """The tension that the robot's limits name [N], shape (m,) or (N, m): along the chord, or at the frame end."""
        return limited_tension(self.robot, self.cables)


def limited_tension(robot: Robot, cables: CableState) -> Array:
    """The tension that a robot's limits name: along the chord, or at the frame end.

    Args:
        robot: The robot.
        cables: State of its cables, fields of shape (m,) or (N, m).

    Returns:
        Tensions [N], of the shape of the cables' fields.
    """
    return cables.chord_tension if robot.tension_limits_of == "chord" else cables.frame_end_tension
