"""A robot in motion, drawn from the lengths of its cables or from their nodes: a simulation's, or a machine's own."""

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


class Drawn(ABC):
    """What there is to see of a robot that moves."""

    __slots__ = ()

    @property
    @abstractmethod
    def robot(self) -> Robot:
        """The robot."""

    @property
    @abstractmethod
    def pose(self) -> Pose:
        """Where the platform is."""

    @property
    @abstractmethod
    def tension(self) -> Array:
        """Tensions at the frame ends [N], shape (m,); NaN where there is none."""

    @property
    @abstractmethod
    def length(self) -> Array:
        """Unstrained lengths off the drums [m], shape (m,); NaN where there is none."""

    @property
    def nodes(self) -> Array | None:
        """Positions of the cables at their nodes [m], shape (m, P, 3); None of cables without."""
        return None

    @property
    def broken(self) -> list[int]:
        """Cables that have broken."""
        return []

    @property
    def feasible(self) -> bool:
        """Whatever moves so can."""
        return True

    @property
    def rest(self) -> Pose | None:
        """Where else the platform is shown: nowhere."""
        return None

    def drawn_rest(self, error_scale: float) -> Array | None:
        """And where it is drawn then [m], shape (3,), what lies between some times as large."""
        return None

    @property
    def truth(self) -> Pose | None:
        """Where the platform truly is, where somebody knows."""
        return None

    def drawn_truth(self, error_scale: float) -> Array | None:
        """And where it is drawn then [m], shape (3,), what lies between some times as large."""
        return None

    @property
    def notice(self) -> str:
        """What stands at a platform that is not feasible."""
        return ""

    def courses(self, sag_scale: float) -> Array:
        """Points of the cables from frame anchor to platform end (m, P, 3); a broken one stays at its anchor."""
        if self.nodes is not None:
            courses = lines.resampled(self.nodes, lines.points_per_cable(self.robot))
        else:
            courses = self._hanging(sag_scale)
        courses[self.broken] = self.robot.frame_anchors[self.broken, None]
        return courses

    def cable_segments(self, sag_scale: float) -> Array:
        """Segments to draw the cables with (m (P - 1), 2, 3)."""
        return lines.segments(self.courses(sag_scale), dashed=False)

    def ghost_segments(self, sag_scale: float, apart: float) -> Array:
        """Segments of the chords where a cable hangs farther from its own than that [m]; else of no length."""
        drawn = self.courses(sag_scale)
        points = lines.straight(drawn[:, [-lines.POINTS, -1]])
        away = np.linalg.norm(drawn[:, -lines.POINTS :] - points, axis=2)
        return lines.segments(points, dashed=False, shown=away > apart)

    def cable_colors(self, scale: TensionScale) -> Colors:
        """Colors of both ends of every segment as viser takes them, shape (m (P - 1), 2, 3)."""
        ends = 2 * (lines.points_per_cable(self.robot) - 1)
        return np.repeat(scale.linear_colors(self.tension), ends, axis=0).reshape(-1, 2, 3)

    def _hanging(self, sag_scale: float) -> Array:
        """Massless cables hang as cables of their lengths do; over a pulley they leave it where their chords do."""
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
        free = lines.hanging(ends, Catenary().from_length(robot.cables, span, rise, length, robot.gravity), sag_scale)
        return free if wraps.shape[1] == 1 else np.concatenate((wraps, free), axis=1)
