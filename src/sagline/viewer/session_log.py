"""From a log in a file, also one that still grows, to what a timeline plays."""

from __future__ import annotations

import os
from typing import Any, NamedTuple

import numpy as np

from sagline.core.arrays import Array
from sagline.files.execution_file import plan_of_log
from sagline.files.mcap_layout import NANO
from sagline.files.mcap_reader import Log, LogReader
from sagline.robot.robot import Robot
from sagline.viewer.session import Session


class Course(NamedTuple):
    """Poses over time.

    Attributes:
        time: [s], increasing, shape (K,).
        position: [m], shape (K, 3).
        quaternion: Shape (K, 4).
    """

    time: Array
    position: Array
    quaternion: Array

    def at(self, time: Array) -> tuple[Array, Array]:
        """Positions in between and the nearest rotations, (N, 3) and (N, 4); NaN outside."""
        outside = ~((time >= self.time[0]) & (time <= self.time[-1]))
        position = np.stack([np.interp(time, self.time, course) for course in self.position.T], axis=1)
        rows = np.clip(np.searchsorted(self.time, time), 0, len(self.time) - 1)
        quaternion = self.quaternion[rows]
        position[outside] = np.nan
        quaternion[outside] = np.nan
        return position, quaternion


class Follower:
    """Reads a log, and that of a twin beside it, as far as they go, and further when they have grown."""

    def __init__(self, file: os.PathLike[str] | str, truth: os.PathLike[str] | str | None = None) -> None:
        """Name the files."""
        self._reader = LogReader(file)
        self._truth = None if truth is None else LogReader(truth)
        self._parts: list[dict[str, Any]] = []
        self._courses: dict[int, Course] = {}

    @property
    def log(self) -> Log:
        """What has been read."""
        return self._reader.log

    @property
    def robot(self) -> Robot | None:
        """Whose log it is; None as long as it does not say."""
        return self._reader.log.robot

    def more(self) -> Session | None:
        """Read what is new.

        Returns:
            All that there is so far; None if there was nothing new, or is nothing at all.
        """
        grown = self._reader.more()
        if self._truth is not None and self._truth.more():
            grown = True
        log = self.log
        self._parts += [self._part(block) for block in log.blocks[len(self._parts) :]]
        return self._session(log.robot) if grown and log.robot is not None and self._parts else None

    def _part(self, block: dict[str, Any]) -> dict[str, Any]:
        """What is shown of a chunk."""
        names = ("time", "state", "late", "position", "quaternion", "tension", "planned_tension", "set_length")
        part = {name: block[name] for name in names}
        part["length"] = block["length"] + block["zero"]
        part["stamp"] = int(block["epoch"]) + np.rint(block["time"] * NANO).astype(np.int64)
        number, rows = int(block["plan"]), len(block["time"])
        planned = np.full((rows, 3), np.nan), np.full((rows, 4), np.nan)
        if number >= 0:
            planned = self._course(number).at(block["clock"])
        part["planned"], part["planned_quaternion"] = planned
        return part

    def _course(self, number: int) -> Course:
        if number not in self._courses:
            plan = plan_of_log(self.log, number)
            pose = plan.state.pose
            time = np.zeros(1) if plan.path is None else plan.path.time - plan.path.time[0]
            self._courses[number] = Course(time, np.atleast_2d(pose.position), np.atleast_2d(pose.quaternion))
        return self._courses[number]

    def _session(self, robot: Robot) -> Session:
        whole = {name: np.concatenate([part[name] for part in self._parts]) for name in self._parts[0]}
        stamp, began = whole.pop("stamp"), float(whole["time"][0])
        true, turned = self._true(stamp)
        whole["time"] = np.round(whole["time"] - began, 9)  # 0.3 and not less: who asks for 0.3 s means this cycle
        events = tuple(self.log.events)
        return Session(robot=robot, began=began, true=true, true_quaternion=turned, events=events, **whole)

    def _true(self, stamp: Any) -> tuple[Array | None, Array | None]:
        truth = [] if self._truth is None else self._truth.log.truth
        if not truth:
            return None, None
        start = truth[0].stamp
        time = np.array([one.stamp - start for one in truth]) / NANO
        course = Course(time, np.array([one.position for one in truth]), np.array([one.quaternion for one in truth]))
        return course.at((stamp - start) / NANO)
