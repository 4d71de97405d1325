"""Logs of the controller in the form that the player and the timeline need."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass, field
from html import escape
from typing import Any

import numpy as np

from sagline.control.recording import Event, EventKind
from sagline.control.states import State
from sagline.core.arguments import evenly_spaced
from sagline.core.arrays import Array, Codes
from sagline.core.numbers import n
from sagline.files.execution_file import plan_of_log
from sagline.files.mcap_layout import NANO
from sagline.files.mcap_reader import LogReader
from sagline.robot.pose import Pose
from sagline.robot.robot import Robot
from sagline.viewer.player import InMotion, Played
from sagline.viewer.readout import definitions, verdict_box
from sagline.viewer.robot_scene import ACTUAL, TRUTH, WANTED
from sagline.viewer.tension_scale import ForceUnit, number_text
from sagline.viewer.timeline import Chart, Span, Track, limit_violations, spans_of

PER_METER = 1e3  # mm per m
MOST_EVENTS = 8  # largest number of listed events, the newest
NO_CHOICE = "Tensions of a log are not chosen: they are the readings of the load cells."
WRONG = (State.FAULT, State.EMERGENCY)


@dataclass(frozen=True, slots=True, eq=False)
class PlayedLog(Played):
    """N cycles of a controller; their times begin at 0."""

    robot: Robot
    time: Array  # times of the cycles from 0 [s], shape (N,)
    began: float  # time of the first cycle on the clock of the link [s]
    state: Codes  # codes of `State`, shape (N,)
    late: Array  # delay of each cycle [s], shape (N,)
    position: Array  # estimated position of the platform's origin [m], shape (N, 3); NaN if unknown
    quaternion: Array  # estimated quaternions, shape (N, 4)
    planned: Array  # planned positions [m], shape (N, 3); NaN without a plan
    planned_quaternion: Array  # planned quaternions, shape (N, 4)
    true: Array | None  # true positions [m], shape (N, 3); None if unknown
    true_quaternion: Array | None  # true quaternions, shape (N, 4)
    tension: Array  # measured tensions at the frame ends [N], shape (N, m)
    planned_tension: Array  # planned tensions [N], shape (N, m)
    length: Array  # lengths from the encoders, with the zeros of homing [m], shape (N, m)
    set_length: Array  # set points of the lengths [m], shape (N, m)
    events: tuple[Event, ...]
    # planned poses; without a plan, the estimated pose, or the last known pose
    poses: Pose = field(init=False)

    name = "log"
    unchanged = "A log keeps its robot and loads; drag the platform to change them."

    def __post_init__(self) -> None:
        """Determine the poses of all cycles."""
        rows = np.arange(len(self.time))
        if (known := np.flatnonzero(np.isfinite(self.position[:, 0]))).size:
            rows = known[np.maximum(np.searchsorted(known, rows, side="right") - 1, 0)]
        planned = np.isfinite(self.planned).all(axis=1, keepdims=True)
        position = np.where(planned, self.planned, self.position[rows])
        quaternion = np.where(planned, self.planned_quaternion, self.quaternion[rows])
        unknown = ~np.isfinite(position).all(axis=1)
        box, anchors = self.robot.test_box, self.robot.frame_anchors
        position[unknown] = anchors.mean(axis=0) if box is None else 0.5 * (box.low + box.high)
        quaternion[unknown] = [0.0, 0.0, 0.0, 1.0]
        object.__setattr__(self, "poses", Pose.from_quaternion(position, quaternion))

    def at(self, time: float) -> InMotion:
        """The cycle at or before a time [s]."""
        k, unit = self.index_at(time), ForceUnit.of(self.robot)
        state, tension = State(int(self.state[k])), np.asarray(self.tension[k])
        rest, truth = self._pose(self.position, self.quaternion, k), self._pose(self.true, self.true_quaternion, k)
        rows = [("Time", f"{self.time[k]:.2f} s"), ("Cycle late", n(self.late[k], ".2g", "s"))]
        for name, pose, other in (
            ("Estimated minus planned", rest, self.planned[k]),
            ("True minus planned", truth, self.planned[k]),
            ("True minus estimated", truth, None if rest is None else rest.position),
        ):
            if pose is not None and other is not None and np.isfinite(other).all():
                rows.append((name, n(PER_METER * float(np.linalg.norm(pose.position - other)), ".3g", "mm")))
        if np.isfinite(tension).any():
            rows.append(("Tensions", unit.span(tension)))
        past = [event for event in self.events if event.time <= self.began + self.time[k]]
        rows += [(f"{event.time - self.began:.2f} s", f"{event.name}: {event.text}") for event in past[-MOST_EVENTS:]]
        heads = ("cable", f"tension<br>[{unit.name}]", "minus planned<br>[N]", "set minus read<br>[mm]")
        columns = (
            [unit.bare(each) for each in tension],
            [number_text(each, ".1f") for each in tension - self.planned_tension[k]],
            [number_text(each, ".2f") for each in PER_METER * (self.set_length[k] - self.length[k])],
        )
        feasible = state not in WRONG
        text = definitions((name, escape(text)) for name, text in rows)
        verdict = verdict_box("quiet" if feasible else "bad", state.name, text)
        here, length, notice = self.poses[k], np.asarray(self.length[k]), "" if feasible else state.name
        table = (heads, columns, NO_CHOICE)
        return InMotion(self.robot, here, k, tension, length, verdict, *table, feasible, rest, truth, notice=notice)

    def code(self, source: str, time: float) -> list[str]:
        """Lines of Python for a cycle; `source` is an expression for the execution."""
        index = self.index_at(time)
        return [
            f"log = {source}",
            f"index = {index}  # {self.time[index]:g} s",
            "robot, tension = log.robot, log.samples.tension[index]",
        ]

    @staticmethod
    def _pose(positions: Array | None, quaternions: Array | None, k: int) -> Pose | None:
        """Pose of a cycle; None if unknown."""
        if positions is None or quaternions is None or not np.isfinite(positions[k]).all():
            return None
        return Pose.from_quaternion(positions[k], quaternions[k])

    def traces(self, most: int, error_scale: float) -> tuple[Array, Array]:
        """Planned and estimated positions (n, 3), n <= `most`."""
        rows = evenly_spaced(len(self.time), most)
        planned, actual = self.planned[rows], self.position[rows]
        away = actual - planned
        return planned, np.where(np.isfinite(away), planned + error_scale * away, actual)

    def track(self) -> Track:
        """Charts of the tensions and of the errors of tensions, lengths and position, and the events."""
        tension, axes = Chart.of_tensions("Tension, measured", self.robot, self.tension), ("x", "y", "z")
        cables = tension.names

        def error(value: Array, reference: Array, scale: float = PER_METER) -> Callable[[slice], Array]:
            return lambda rows: scale * (value[rows] - reference[rows])

        charts = [
            tension,
            Chart("Tension minus planned tension", "N", 1, cables, error(self.tension, self.planned_tension, 1.0)),
            Chart("Set length minus measured length", "mm", 2, cables, error(self.set_length, self.length)),
            Chart("Estimated minus planned", "mm", 2, axes, error(self.position, self.planned)),
        ]
        paths = [("planned", WANTED), ("estimated", ACTUAL)]
        if self.true is not None:
            charts.append(Chart("True minus planned", "mm", 2, axes, error(self.true, self.planned)))
            paths.append(("true", TRUTH))
        marks = tuple(
            (event.time - self.began, f"{event.name}: {event.text}", event.kind is EventKind.FAULT)
            for event in self.events
        )
        return Track(self.time, tuple(charts), self._wrong(), marks, tuple(paths))

    def _wrong(self) -> tuple[Span, ...]:
        """Spans of faults, and of tensions outside their limits."""

        def why(rows: slice) -> str:
            state = self.state[rows]
            return State(int(state[np.isin(state, WRONG)][0])).name

        faults = spans_of(self.time, np.isin(self.state, WRONG), why)
        return tuple(sorted(faults + limit_violations(self.robot, self.time, self.tension)))


class LogFollower:
    """Reader of a log file and, optionally, of the twin's log file; both files may still grow."""

    def __init__(self, file: os.PathLike[str] | str, truth: os.PathLike[str] | str | None = None) -> None:
        """Open the log and the log of the twin."""
        self.log = LogReader(file)  # the part of the log that was read
        self._truth = None if truth is None else LogReader(truth)
        self._parts: list[dict[str, Any]] = []
        self._plans: dict[int, tuple[Array, Array, Array]] = {}  # times, positions and quaternions

    def more(self) -> PlayedLog | None:
        """Read new cycles. Returns the whole log, or None if there are no new cycles."""
        grown = self.log.more()
        if self._truth is not None and self._truth.more():
            grown = True
        log = self.log
        self._parts += [self._part(block) for block in log.blocks[len(self._parts) :]]
        return self._session(log.robot) if grown and log.robot is not None and self._parts else None

    def _part(self, block: dict[str, Any]) -> dict[str, Any]:
        """The quantities of a block of the log, with the planned poses."""
        names = ("time", "state", "late", "position", "quaternion", "tension", "planned_tension", "set_length")
        part = {name: block[name] for name in names}
        part["length"] = block["length"] + block["zero"]
        part["stamp"] = int(block["epoch"]) + np.rint(block["time"] * NANO).astype(np.int64)
        number, rows = int(block["plan"]), len(block["time"])
        planned = np.full((rows, 3), np.nan), np.full((rows, 4), np.nan)
        if number >= 0:
            planned = _interpolated(*self._planned(number), block["clock"])
        part["planned"], part["planned_quaternion"] = planned
        return part

    def _planned(self, number: int) -> tuple[Array, Array, Array]:
        """Times, positions and quaternions of a plan of the log."""
        if number not in self._plans:
            plan = plan_of_log(self.log, number)
            pose = plan.state.pose
            time = np.zeros(1) if plan.path is None else plan.path.time - plan.path.time[0]
            self._plans[number] = time, np.atleast_2d(pose.position), np.atleast_2d(pose.quaternion)
        return self._plans[number]

    def _session(self, robot: Robot) -> PlayedLog:
        whole = {name: np.concatenate([part[name] for part in self._parts]) for name in self._parts[0]}
        stamp, began = whole.pop("stamp"), float(whole["time"][0])
        true, turned = self._true(stamp)
        whole["time"] = np.round(whole["time"] - began, 9)  # rounded, so that this time selects the cycle
        events = tuple(self.log.events)
        return PlayedLog(robot=robot, began=began, true=true, true_quaternion=turned, events=events, **whole)

    def _true(self, stamp: Any) -> tuple[Array | None, Array | None]:
        truth = [] if self._truth is None else self._truth.truth
        if not truth:
            return None, None
        stamps, position, quaternion = map(np.array, zip(*truth, strict=True))
        return _interpolated((stamps - stamps[0]) / NANO, position, quaternion, (stamp - stamps[0]) / NANO)


def _interpolated(time: Array, position: Array, quaternion: Array, at: Array) -> tuple[Array, Array]:
    """Interpolated positions (N, 3) and nearest quaternions (N, 4) at times; NaN outside."""
    outside = ~((at >= time[0]) & (at <= time[-1]))
    positions = np.stack([np.interp(at, time, axis) for axis in position.T], axis=1)
    quaternions = quaternion[np.clip(np.searchsorted(time, at), 0, len(time) - 1)]
    positions[outside] = np.nan
    quaternions[outside] = np.nan
    return positions, quaternions
