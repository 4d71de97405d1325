"""Configuration of a robot as it is drawn: solved at rest, or a sample of a motion."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TypeAlias

import numpy as np

from sagline.cables.models import Catenary
from sagline.core.arrays import Array
from sagline.robot.batch import dead_cable, pulleys_of
from sagline.robot.pose import Pose
from sagline.robot.robot import Robot
from sagline.statics.chords import touching_angle
from sagline.viewer import lines
from sagline.viewer.readout import block, cable_table, pose_line
from sagline.viewer.snapshot import Snapshot
from sagline.viewer.tension_scale import Colors, TensionScale


@dataclass(frozen=True, slots=True, eq=False)
class InMotion:
    """One sample of a simulation or of a log, drawn from the lengths of its cables or from their nodes."""

    robot: Robot
    pose: Pose
    index: int  # of the sample
    tension: Array  # [N], shape (m,); NaN where there is none
    length: Array  # unstrained, off the drums [m], shape (m,); NaN where there is none
    verdict: str  # HTML of the state and of the events
    heads: tuple[str, ...]  # of the table of the cables
    columns: Sequence[Sequence[str]]  # of that table, a text for each cable
    why_no_choice: str  # reason why tensions are not chosen
    feasible: bool = True
    rest: Pose | None = None  # second pose that is shown
    truth: Pose | None = None  # true pose, where it is known
    nodes: Array | None = None  # positions of the cables at their nodes [m], shape (m, P, 3)
    broken: list[int] = field(default_factory=list)  # cables that have broken
    notice: str = ""  # label of a platform that is not feasible

    def numbers(self, scale: TensionScale) -> str:
        """HTML of the pose, and of the table of the cables."""
        return block(pose_line(self.pose) + cable_table(self.heads, self.columns, scale.colors(self.tension)))

    def courses(self, sag_scale: float) -> Array:
        """Points of the cables from frame anchor to platform end (m, P, 3); a broken cable stays at its anchor."""
        if self.nodes is not None:
            courses = lines.resampled(self.nodes, lines.points_per_cable(self.robot))
        else:
            courses = self._catenaries(sag_scale)
        courses[self.broken] = self.robot.frame_anchors[self.broken, None]
        return courses

    def _catenaries(self, sag_scale: float) -> Array:
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
        cables = Catenary().from_length(robot.cables, span, rise, length, robot.gravity)
        free = lines.catenaries(ends, cables, sag_scale)
        return free if wraps.shape[1] == 1 else np.concatenate((wraps, free), axis=1)


Configuration: TypeAlias = Snapshot | InMotion


def scaled_position(pose: Pose, other: Pose, factor: float) -> Array:
    """Position of another pose with its distance scaled by a factor [m], shape (3,)."""
    return np.asarray(pose.position + factor * (other.position - pose.position))


def cable_segments(drawn: Configuration, sag_scale: float) -> Array:
    """Segments of the cables (m (P - 1), 2, 3), dashed where the pose is not feasible."""
    return lines.segments(drawn.courses(sag_scale), dashed=not drawn.feasible)


def chord_segments(drawn: Configuration, sag_scale: float, apart: float) -> Array:
    """Segments of the chords where a cable is farther from its own than a distance [m]; else of zero length."""
    free = drawn.courses(sag_scale)[:, -lines.POINTS :]
    chords = lines.straight(free[:, [0, -1]])
    return lines.segments(chords, dashed=False, shown=np.linalg.norm(free - chords, axis=2) > apart)


def cable_colors(drawn: Configuration, scale: TensionScale) -> Colors:
    """Colors of both ends of every segment as viser takes them, shape (m (P - 1), 2, 3)."""
    ends = 2 * (lines.points_per_cable(drawn.robot) - 1)
    return np.repeat(scale.linear_colors(drawn.tension), ends, axis=0).reshape(-1, 2, 3)
