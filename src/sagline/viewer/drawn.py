"""A robot as it is drawn, at rest or in motion."""

from __future__ import annotations

from abc import ABC, abstractmethod

import numpy as np

from sagline.cables.models import Catenary
from sagline.core.arrays import Array
from sagline.robot.batch import dead_cable, pulleys_of
from sagline.robot.pose import Pose
from sagline.robot.robot import Robot
from sagline.statics.chords import touching_angle
from sagline.viewer import lines
from sagline.viewer.tension_scale import Colors, TensionScale


class Drawable(ABC):
    """A robot at a pose, as it is drawn."""

    __slots__ = ()

    @property
    @abstractmethod
    def robot(self) -> Robot:
        """The robot."""

    @property
    @abstractmethod
    def pose(self) -> Pose:
        """Pose of the platform."""

    @property
    @abstractmethod
    def tension(self) -> Array:
        """Tensions [N], shape (m,); NaN where there is none."""

    @property
    @abstractmethod
    def feasible(self) -> bool:
        """True if platform and cables are drawn as feasible."""

    @property
    @abstractmethod
    def rest(self) -> Pose | None:
        """A second pose that is shown; None for none."""

    @abstractmethod
    def courses(self, sag_scale: float) -> Array:
        """Points of the cables from frame anchor to platform end [m], shape (m, P, 3), the sag scaled by a factor."""

    def scaled_position(self, pose: Pose | None, factor: float) -> Array | None:
        """Position of another pose with its distance scaled by a factor [m], shape (3,)."""
        here = self.pose.position
        return None if pose is None else np.asarray(here + factor * (pose.position - here))

    def cable_segments(self, sag_scale: float) -> Array:
        """Segments of the cables (m (P - 1), 2, 3), dashed where the pose is not feasible."""
        return lines.segments(self.courses(sag_scale), dashed=not self.feasible)

    def ghost_segments(self, sag_scale: float, apart: float) -> Array:
        """Segments of the chords where a cable is farther from its own than a distance [m]; else of no length."""
        free = self.courses(sag_scale)[:, -lines.POINTS :]
        chords = lines.straight(free[:, [0, -1]])
        return lines.segments(chords, dashed=False, shown=np.linalg.norm(free - chords, axis=2) > apart)

    def cable_colors(self, scale: TensionScale) -> Colors:
        """Colors of both ends of every segment as viser takes them, shape (m (P - 1), 2, 3)."""
        ends = 2 * (lines.points_per_cable(self.robot) - 1)
        return np.repeat(scale.linear_colors(self.tension), ends, axis=0).reshape(-1, 2, 3)


class InMotion(Drawable):
    """A robot in motion, drawn from the lengths of its cables or from their nodes."""

    __slots__ = ()

    @property
    @abstractmethod
    def length(self) -> Array:
        """Unstrained lengths off the drums [m], shape (m,); NaN where there is none."""

    @abstractmethod
    def verdict(self) -> str:
        """HTML of the state and of the events."""

    @abstractmethod
    def numbers(self, scale: TensionScale) -> str:
        """HTML of the pose, and of tension and length of every cable."""

    @property
    @abstractmethod
    def why_no_choice(self) -> str:
        """Reason why tensions are not chosen."""

    @property
    def nodes(self) -> Array | None:
        """Positions of the cables at their nodes [m], shape (m, P, 3); None of cables without."""
        return None

    @property
    def broken(self) -> list[int]:
        """Cables that have broken."""
        return []

    @property
    def truth(self) -> Pose | None:
        """True pose; None where it is not known."""
        return None

    @property
    def notice(self) -> str:
        """Label of a platform that is not feasible."""
        return ""

    def courses(self, sag_scale: float) -> Array:
        """Points of the cables from frame anchor to platform end (m, P, 3); a broken one stays at its anchor."""
        if self.nodes is not None:
            courses = lines.resampled(self.nodes, lines.points_per_cable(self.robot))
        else:
            courses = self._free(sag_scale)
        courses[self.broken] = self.robot.frame_anchors[self.broken, None]
        return courses

    def _free(self, sag_scale: float) -> Array:
        """Points of catenaries of the lengths, which leave their pulleys where their chords do."""
        robot, pose = self.robot, self.pose
        wraps = lines.wraps(robot, pose, None)
        ends = lines.chords(robot, pose, wraps[:, -1])
        run = ends[:, 1] - ends[:, 0]
        span, rise = np.hypot(run[:, 0], run[:, 1]), run[:, 2]
        wrapped = np.zeros_like(span)
        if wraps.shape[1] > 1:
            wrapped = pulleys_of(robot).radius * np.nan_to_num(touching_angle(robot, pose))
        length = self.length - wrapped - dead_cable(robot)
        length = np.where(length > 0.0, length, np.hypot(span, rise))
        free = lines.catenaries(
            ends, Catenary().from_length(robot.cables, span, rise, length, robot.gravity), sag_scale
        )
        return free if wraps.shape[1] == 1 else np.concatenate((wraps, free), axis=1)
