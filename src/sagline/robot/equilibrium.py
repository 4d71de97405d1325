"""A robot at rest, or in quasi-static motion: where its platform is and what its cables carry."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from sagline.arrays import Array, locked
from sagline.cables.model import CableState
from sagline.errors import InvalidValueError
from sagline.indices import length_of, part_of
from sagline.robot.pose import Pose
from sagline.robot.robot import Robot
from sagline.robot.several import Index, Robots, first_of, robots_at


@dataclass(frozen=True, slots=True, eq=False)
class Equilibrium:
    """The one type that stiffness, modes, the viewer and the files take.

    A batch is indexed like an array: `state[3]` is one of its poses, `state[2:5]` and `state[mask]` are batches;
    slices share the batch's memory.

    Attributes:
        robot: The robot; or a tuple of N, one a pose, where a sequence of robots was solved.
        pose: Pose of the platform, single or a batch of N.
        wrench: External plus inertial wrench on the platform about its center of mass, world axes, without
            gravity: force [N], moment [N m], shape (6,) or (N, 6).
        cables: State of the cables, fields of shape (m,) or (N, m).
    """

    robot: Robot | tuple[Robot, ...]
    pose: Pose
    wrench: Array
    cables: CableState

    @property
    def one_robot(self) -> Robot:
        """The robot, where it is the same at all poses.

        Raises:
            InvalidValueError: If there is one a pose.
        """
        if isinstance(self.robot, Robot):
            return self.robot
        raise InvalidValueError(
            "robot",
            f"a sequence of {len(self.robot)} robots, one a pose",
            "one robot for all poses",
            "Take the poses one by one: state[i].",
        )

    def __len__(self) -> int:
        """Number of poses in a batch."""
        return length_of(self.pose.shape, "single equilibrium")

    def __getitem__(self, index: Index) -> Equilibrium:
        """One pose of a batch, or a part of the batch.

        Args:
            index: A number, which may count from the end; a slice; or an array of numbers or of N booleans.

        Raises:
            NoBatchError: If the equilibrium is a single one; it is a TypeError too.
            NoSuchEntryError: If there is no such pose; it is an IndexError too.
        """
        part = part_of(index, self.pose.shape, "single equilibrium")
        return Equilibrium(robots_at(self.robot, part), self.pose[part], locked(self.wrench[part]), self.cables[part])

    def __iter__(self) -> Iterator[Equilibrium]:
        """The poses of a batch, one by one."""
        return (self[i] for i in range(len(self)))

    @property
    def limited_tension(self) -> Array:
        """The tension that the robot's limits name [N], shape (m,) or (N, m): along the chord, or at the frame end."""
        return limited_tension(self.robot, self.cables)


def limited_tension(robot: Robots, cables: CableState) -> Array:
    """The tension that a robot's limits name: along the chord, or at the frame end.

    Args:
        robot: The robot, or several that fit together.
        cables: State of their cables, fields of shape (m,) or (N, m).

    Returns:
        Tensions [N], of the shape of the cables' fields.
    """
    return cables.chord_tension if first_of(robot).tension_limits_of == "chord" else cables.frame_end_tension
