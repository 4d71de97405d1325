"""Recorded sessions of the controller, read from logs, as the timeline plays them."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass, field
from html import escape
from typing import Any

import numpy as np

from sagline.control.recording import Event, EventKind
from sagline.control.states import State
from sagline.core.arrays import Array, Codes
from sagline.core.numbers import n
from sagline.files.execution_file import plan_of_log
from sagline.files.mcap_layout import NANO
from sagline.files.mcap_reader import Log, LogReader
from sagline.robot.pose import Pose
from sagline.robot.robot import Robot
from sagline.viewer.drawn import InMotion
from sagline.viewer.readout import block, box, cable_table, definitions, pose_line
from sagline.viewer.robot_scene import ACTUAL, TRUTH, WANTED
from sagline.viewer.tension_scale import TensionScale, force_unit, number
from sagline.viewer.timeline import Chart, Mark, Span, Track, cable_names, limit_violations, spans_of, tension_limits

PER_METER = 1e3  # mm
MOST_EVENTS = 8  # that are listed, the newest
WRONG = (State.FAULT, State.EMERGENCY)


@dataclass(frozen=True, slots=True, eq=False)
class Session:
    """N cycles of a controller, from time 0 on.

    Attributes:
        robot: The robot.
        time: Of the cycles, from 0 on [s], shape (N,).
        began: The first of them on the clock of the link [s].
        state: Codes of `State`, shape (N,).
        late: By how much each began too late [s], shape (N,).
        position: Of the platform's origin, estimated [m], shape (N, 3); NaN where it is not known.
        quaternion: Rotation, estimated, shape (N, 4).
        planned: Position that was planned [m], shape (N, 3); NaN beside a plan.
        planned_quaternion: Rotation that was planned, shape (N, 4).
        true: Position in truth [m], shape (N, 3); None where nobody knows.
        true_quaternion: Rotation in truth, shape (N, 4).
        tension: At the frame ends, as read [N], shape (N, m).
        planned_tension: As planned [N], shape (N, m).
        length: From the encoders, with the zero of homing [m], shape (N, m).
        set_length: That was asked for [m], shape (N, m).
        events: What happened.
    """

    robot: Robot
    time: Array
    began: float
    state: Codes
    late: Array
    position: Array
    quaternion: Array
    planned: Array
    planned_quaternion: Array
    true: Array | None
    true_quaternion: Array | None
    tension: Array
    planned_tension: Array
    length: Array
    set_length: Array
    events: tuple[Event, ...]
    shown: Array = field(init=False)  # numbers of cycles: the last before each whose place is known

    name = "log"
    still = "A log is what it was recorded as; drag the platform to ask what if."

    def __post_init__(self) -> None:
        """Find what to show where nothing is known: what was known before, or first."""
        known = np.flatnonzero(np.isfinite(self.position[:, 0]))
        last = np.searchsorted(known, np.arange(len(self.time)), side="right") - 1
        rows = known[np.maximum(last, 0)] if known.size else np.full(len(self.time), -1)
        object.__setattr__(self, "shown", rows)

    @property
    def home(self) -> Pose:
        """The first pose."""
        return self.pose_at(0)

    @property
    def duration(self) -> float:
        """Time of the last cycle [s]."""
        return float(self.time[-1])

    def pose_at(self, index: int) -> Pose:
        """Planned pose of a cycle; without a plan the estimated one, or the one before."""
        if np.isfinite(self.planned[index]).all():
            return Pose.from_quaternion(self.planned[index], self.planned_quaternion[index])
        row = int(self.shown[index])
        if row >= 0:
            return Pose.from_quaternion(self.position[row], self.quaternion[row])
        box, anchors = self.robot.test_box, self.robot.frame_anchors
        return Pose(anchors.mean(axis=0) if box is None else 0.5 * (box.low + box.high), np.eye(3))

    def sight(self, time: float) -> SessionMoment:
        """The cycle at or before a time [s]."""
        index = int(np.searchsorted(self.time, time, side="right")) - 1
        return SessionMoment(self, min(max(index, 0), self.time.size - 1))

    def traces(self, most: int, error_scale: float) -> tuple[Array, Array]:
        """Planned and estimated positions (n, 3), n <= most."""
        rows = np.unique(np.linspace(0, self.time.size - 1, most).astype(np.intp))
        planned, actual = self.planned[rows], self.position[rows]
        away = actual - planned
        return planned, np.where(np.isfinite(away), planned + error_scale * away, actual)

    def track(self) -> Track:
        """Tensions, what they are off, what lengths and platform are off, and what happened."""
        unit, cables, axes = force_unit(self.robot), cable_names(self.robot), ("x", "y", "z")
        limits = tension_limits(self.robot, unit.newtons, at="frame_end")

        def off(value: Array, wanted: Array, scale: float = PER_METER) -> Callable[[slice], Array]:
            return lambda rows: scale * (value[rows] - wanted[rows])

        name, decimals, newtons = unit.name, unit.decimals, unit.newtons
        charts = [
            Chart("Tension, measured", name, decimals, cables, lambda rows: self.tension[rows] / newtons, limits),
            Chart("Tension less the planned one", "N", 1, cables, off(self.tension, self.planned_tension, 1.0)),
            Chart("Length set less measured", "mm", 2, cables, off(self.set_length, self.length)),
            Chart("Estimated less planned", "mm", 2, axes, off(self.position, self.planned)),
        ]
        paths = [("planned", WANTED), ("estimated", ACTUAL)]
        if self.true is not None:
            charts.append(Chart("True less planned", "mm", 2, axes, off(self.true, self.planned)))
            paths.append(("true", TRUTH))
        marks = tuple(
            Mark(event.time - self.began, f"{event.name}: {event.text}", bad=event.kind is EventKind.FAULT)
            for event in self.events
        )
        return Track(self.time, tuple(charts), self._wrong(), marks, tuple(paths))

    def _wrong(self) -> tuple[Span, ...]:
        """Spans of faults, and of tensions outside their limits."""

        def why(rows: slice) -> str:
            state = self.state[rows]
            return State(int(state[np.isin(state, WRONG)][0])).name

        faults = spans_of(self.time, np.isin(self.state, WRONG), why)
        return tuple(sorted(faults + limit_violations(self.robot, self.time, self.tension, force_unit(self.robot))))


@dataclass(frozen=True, slots=True, eq=False)
class SessionMoment(InMotion):
    """One cycle.

    Attributes:
        session: The log.
        index: Number of the cycle.
    """

    session: Session
    index: int

    @property
    def robot(self) -> Robot:
        """The robot."""
        return self.session.robot

    @property
    def pose(self) -> Pose:
        """Planned pose, or without a plan the estimated one."""
        return self.session.pose_at(self.index)

    @property
    def tension(self) -> Array:
        """As the load cells read it [N], shape (m,)."""
        return np.asarray(self.session.tension[self.index])

    @property
    def length(self) -> Array:
        """From the encoders [m], shape (m,)."""
        return np.asarray(self.session.length[self.index])

    @property
    def time(self) -> float:
        """Since the first cycle [s]."""
        return float(self.session.time[self.index])

    @property
    def state(self) -> State:
        """Of the controller."""
        return State(int(self.session.state[self.index]))

    @property
    def past(self) -> tuple[Event, ...]:
        """Events so far."""
        now = self.session.began + self.time
        return tuple(event for event in self.session.events if event.time <= now)

    @property
    def feasible(self) -> bool:
        """True if there is no fault."""
        return self.state not in WRONG

    @property
    def notice(self) -> str:
        """Name of the fault."""
        return "" if self.feasible else self.state.name

    @property
    def rest(self) -> Pose | None:
        """Estimated pose."""
        return self._beside(self.session.position, self.session.quaternion)

    @property
    def truth(self) -> Pose | None:
        """True pose."""
        if self.session.true is None or self.session.true_quaternion is None:
            return None
        return self._beside(self.session.true, self.session.true_quaternion)

    def verdict(self) -> str:
        """HTML of the state, the errors of pose and tensions, and the latest events."""
        session, k, unit = self.session, self.index, force_unit(self.robot)
        rows = [("Time", f"{self.time:.2f} s"), ("Cycle late", n(session.late[k], ".2g", "s"))]
        rest, truth, planned = self.rest, self.truth, session.planned[k]
        for name, pose, other in (
            ("Estimated less planned", rest, planned),
            ("True less planned", truth, planned),
            ("True less estimated", truth, None if rest is None else rest.position),
        ):
            if pose is not None and other is not None and np.isfinite(other).all():
                away = PER_METER * float(np.linalg.norm(pose.position - other))
                rows.append((name, n(away, ".3g", "mm")))
        if np.isfinite(self.tension).any():
            low, high = np.nanmin(self.tension), np.nanmax(self.tension)
            rows.append(("Tensions", f"{unit.bare(low)} to {unit.written(high)}"))
        for event in self.past[-MOST_EVENTS:]:
            rows.append((f"{event.time - session.began:.2f} s", f"{event.name}: {event.text}"))
        text = definitions((name, escape(what)) for name, what in rows)
        return box("quiet" if self.feasible else "bad", self.state.name, text)

    def numbers(self, scale: TensionScale) -> str:
        """HTML of the pose, and of tension and its error and the error of the length of every cable."""
        session, k, unit = self.session, self.index, force_unit(self.robot)
        heads = ("cable", f"tension<br>[{unit.name}]", "less planned<br>[N]", "set less read<br>[mm]")
        columns = (
            [unit.bare(each) for each in self.tension],
            [number(each, ".1f") for each in self.tension - session.planned_tension[k]],
            [number(each, ".2f") for each in PER_METER * (session.set_length[k] - session.length[k])],
        )
        return block(pose_line(self.pose) + cable_table(heads, columns, scale.colors(self.tension)))

    @property
    def why_no_choice(self) -> str:
        """Reason why tensions are not chosen."""
        return "What a machine did is not chosen any more: its tensions are those that its load cells read."

    def _beside(self, positions: Array, quaternions: Array) -> Pose | None:
        place = positions[self.index]
        return Pose.from_quaternion(place, quaternions[self.index]) if np.isfinite(place).all() else None


class LogFollower:
    """Reader of a log in a file, and of the log of its twin, also while they grow."""

    def __init__(self, file: os.PathLike[str] | str, truth: os.PathLike[str] | str | None = None) -> None:
        """Name the files."""
        self._reader = LogReader(file)
        self._truth = None if truth is None else LogReader(truth)
        self._parts: list[dict[str, Any]] = []
        self._plans: dict[int, tuple[Array, Array, Array]] = {}  # times, positions and quaternions

    @property
    def log(self) -> Log:
        """The log as far as it was read."""
        return self._reader.log

    @property
    def robot(self) -> Robot | None:
        """The robot of the log; None until it was read."""
        return self._reader.log.robot

    def more(self) -> Session | None:
        """Read what is new; the whole session, None if nothing is new, or nothing is there."""
        grown = self._reader.more()
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
        position, quaternion = (np.array([getattr(one, name) for one in truth]) for name in ("position", "quaternion"))
        return _interpolated(time, position, quaternion, (stamp - start) / NANO)


def _interpolated(time: Array, position: Array, quaternion: Array, at: Array) -> tuple[Array, Array]:
    """Positions in between (N, 3) and nearest quaternions (N, 4) at times; NaN outside."""
    outside = ~((at >= time[0]) & (at <= time[-1]))
    positions = np.stack([np.interp(at, time, axis) for axis in position.T], axis=1)
    quaternions = quaternion[np.clip(np.searchsorted(time, at), 0, len(time) - 1)]
    positions[outside] = np.nan
    quaternions[outside] = np.nan
    return positions, quaternions
