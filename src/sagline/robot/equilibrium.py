"""A robot at rest, or in quasi-static motion: where its platform is and what its cables carry."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from sagline.cables.model import CableState
from sagline.core.arrays import Array, locked
from sagline.core.errors import InvalidValueError
from sagline.core.indices import length_of, part_of
from sagline.core.results import Result
from sagline.robot.contact import Contact
from sagline.robot.pose import Pose
from sagline.robot.robot import Robot
from sagline.robot.several import Index, Robots, anchors_of, first_of, robots_at
from sagline.robot.wheels import on_wheels


@dataclass(frozen=True, slots=True, eq=False)
class Equilibrium(Result):
    """The one type that stiffness, modes, the viewer and the files take.

    A batch is indexed like an array: `state[3]` is one of its poses, `state[2:5]` and `state[mask]` are batches;
    slices share the batch's memory.

    Attributes:
        robot: The robot; or a tuple of N, one a pose, where a sequence of robots was solved.
        pose: Pose of the platform, single or a batch of N.
        wrench: External plus inertial wrench on the platform about its center of mass, world axes, without
            gravity: force [N], moment [N m], shape (6,) or (N, 6).
        cables: State of the hanging cables, from where they leave the frame to their platform ends, fields of shape
            (m,) or (N, m).
        contact: What is behind them, on pulleys and as dead cable; None where nothing is: a cable then starts at its
            frame anchor and is all there is off the drum.
    """

    robot: Robot | tuple[Robot, ...]
    pose: Pose
    wrench: Array
    cables: CableState
    contact: Contact | None = None

    @property
    def unstrained_length(self) -> Array:
        """L: all cable off the drum, hanging, wrapped and dead [m], shape (m,) or (N, m)."""
        if self.contact is None:
            return self.cables.unstrained_length
        return locked(self.free_length + (self.contact.wrapped_length + self.contact.dead_length))

    @property
    def free_length(self) -> Array:
        """Unstrained length of the hanging cables [m], shape (m,) or (N, m)."""
        return self.cables.unstrained_length

    @property
    def chord_tension(self) -> Array:
        """Tau = T_x/cos phi [N], shape (m,) or (N, m); over a pulley phi is that of the tangent from the platform end.

        The tension that is shared, and that limits on the chord name.
        """
        return self.cables.chord_tension if self.contact is None else self.contact.chord_tension

    @property
    def pull(self) -> Array:
        """What the weight of the cables adds to the vertical force at their ends, T_z - tau sin phi [N]."""
        cables = self.cables
        sine = cables.rise / cables.chord if self.contact is None else self.contact.chord_sine
        return locked(cables.vertical_force - self.chord_tension * sine)

    @property
    def exit_point(self) -> Array:
        """Where the cables leave the frame, world axes [m], shape (m, 3) or (N, m, 3): pulleys, or frame anchors."""
        if self.contact is None:
            return locked(np.array(np.broadcast_to(anchors_of(self.robot).frame, (*self.cables.shape, 3))))
        return locked(on_wheels(self.robot, self.pose, self.contact.wrap_angle))

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
        contact = None if self.contact is None else self.contact.part(part)
        robot, wrench = robots_at(self.robot, part), locked(self.wrench[part])
        return Equilibrium(robot, self.pose[part], wrench, self.cables[part], contact)

    def __iter__(self) -> Iterator[Equilibrium]:
        """The poses of a batch, one by one."""
        return (self[i] for i in range(len(self)))

    @property
    def limited_tension(self) -> Array:
        """The tension that the robot's limits name [N], shape (m,) or (N, m): along the chord, or at the frame end."""
        return limited_tension(self.robot, self.cables, self.contact)


def limited_tension(robot: Robots, cables: CableState, contact: Contact | None = None) -> Array:
    """The tension that a robot's limits name: along the chord, or at the frame end.

    Args:
        robot: The robot, or several that fit together.
        cables: State of their cables, fields of shape (m,) or (N, m).
        contact: What is behind them, or None.

    Returns:
        Tensions [N], of the shape of the cables' fields.
    """
    if first_of(robot).tension_limits_of == "frame_end":
        return cables.frame_end_tension
    return cables.chord_tension if contact is None else contact.chord_tension
