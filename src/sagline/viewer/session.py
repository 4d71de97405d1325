"""Recorded sessions of the controller as the timeline plays them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from html import escape

import numpy as np

from sagline.control.recording import Event, EventKind
from sagline.control.states import State
from sagline.core.arrays import Array, Codes
from sagline.core.numbers import n
from sagline.robot.pose import Pose
from sagline.robot.robot import Robot
from sagline.viewer.drawn import Drawn
from sagline.viewer.readout import block, box, css_color, pose_line, sentence
from sagline.viewer.stage import ACTUAL, TRUTH, WANTED
from sagline.viewer.tension_scale import TensionScale, force_unit
from sagline.viewer.timeline import Chart, Mark, Span, Track, cable_names, outside, spans_of, tension_limits
from sagline.viewer.wording import number

PER_METER = 1e3  # mm
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
        """Where it begins."""
        return self.pose_at(0)

    @property
    def duration(self) -> float:
        """Time of the last cycle [s]."""
        return float(self.time[-1])

    def pose_at(self, index: int) -> Pose:
        """Where the platform is to be at a cycle; beside a plan where it is estimated to be, or was before."""
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
        """Where the controller had stopped for a fault, or a tension was beyond its limits."""

        def why(rows: slice) -> str:
            state = self.state[rows]
            return State(int(state[np.isin(state, WRONG)][0])).name

        faults = spans_of(self.time, np.isin(self.state, WRONG), why)
        return tuple(sorted(faults + outside(self.robot, self.time, self.tension, force_unit(self.robot))))


@dataclass(frozen=True, slots=True, eq=False)
class SessionMoment(Drawn):
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
        """Where the platform is to be, or beside a plan is estimated to be."""
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
        """What has happened."""
        now = self.session.began + self.time
        return tuple(event for event in self.session.events if event.time <= now)

    @property
    def feasible(self) -> bool:
        """Whether nothing is wrong."""
        return self.state not in WRONG

    @property
    def notice(self) -> str:
        """What is wrong."""
        return "" if self.feasible else self.state.name

    @property
    def rest(self) -> Pose | None:
        """Where the platform is estimated to be, beside where it is to be."""
        return self._beside(self.session.position, self.session.quaternion)

    def drawn_rest(self, error_scale: float) -> Array | None:
        """Where that is drawn [m], shape (3,)."""
        return self._drawn(self.rest, error_scale)

    @property
    def truth(self) -> Pose | None:
        """Where the platform truly is."""
        if self.session.true is None or self.session.true_quaternion is None:
            return None
        return self._beside(self.session.true, self.session.true_quaternion)

    def drawn_truth(self, error_scale: float) -> Array | None:
        """Where that is drawn [m], shape (3,)."""
        return self._drawn(self.truth, error_scale)

    def _beside(self, positions: Array, quaternions: Array) -> Pose | None:
        place = positions[self.index]
        return Pose.from_quaternion(place, quaternions[self.index]) if np.isfinite(place).all() else None

    def _drawn(self, pose: Pose | None, error_scale: float) -> Array | None:
        at = self.pose.position
        return None if pose is None else np.asarray(at + error_scale * (pose.position - at))


MOST_EVENTS = 8  # that are told, the newest


def verdict(moment: SessionMoment) -> str:
    """The state, what the platform and the tensions are off, and what has happened."""
    session, k, unit = moment.session, moment.index, force_unit(moment.robot)
    rows = [("Time", f"{moment.time:.2f} s"), ("Cycle late", n(session.late[k], ".2g", "s"))]
    distances = {"Estimated": moment.rest, "True": moment.truth}
    if np.isfinite(session.planned[k]).all():
        for name, pose in distances.items():
            if pose is not None:
                away = PER_METER * float(np.linalg.norm(pose.position - session.planned[k]))
                rows.append((f"{name} less planned", n(away, ".3g", "mm")))
    if moment.rest is not None and moment.truth is not None:
        away = PER_METER * float(np.linalg.norm(moment.truth.position - moment.rest.position))
        rows.append(("True less estimated", n(away, ".3g", "mm")))
    tension = moment.tension
    if np.isfinite(tension).any():
        rows.append(("Tensions", f"{unit.bare(np.nanmin(tension))} to {unit.written(np.nanmax(tension))}"))
    rows += [(f"{event.time - session.began:.2f} s", f"{event.name}: {event.text}") for event in _told(moment)]
    text = "".join(f"<dt>{name}</dt><dd>{escape(what)}</dd>" for name, what in rows)
    return box("quiet" if moment.feasible else "bad", moment.state.name, f"<dl>{text}</dl>")


def numbers(moment: SessionMoment, scale: TensionScale) -> str:
    """The pose; tension, what it is off, and what the length is off, of every cable."""
    session, k, unit = moment.session, moment.index, force_unit(moment.robot)
    colors = scale.colors(moment.tension)
    off = moment.tension - session.planned_tension[k]
    lag = PER_METER * (session.set_length[k] - session.length[k])
    rows = "".join(
        f'<tr><td><span class="swatch" style="background:{css_color(colors[i])}"></span> {i}</td>'
        f"<td>{unit.bare(moment.tension[i])}</td><td>{number(off[i], '.1f')}</td><td>{number(lag[i], '.2f')}</td></tr>"
        for i in range(moment.robot.cable_count)
    )
    names = ("cable", f"tension<br>[{unit.name}]", "less planned<br>[N]", "set less read<br>[mm]")
    head = f"<tr>{''.join(f'<th>{name}</th>' for name in names)}</tr>"
    return block(f"{pose_line(moment.pose)}<table>{head}{rows}</table>")


def polygon() -> str:
    """Why there are no tensions to choose from."""
    return sentence("What a machine did is not chosen any more: its tensions are those that its load cells read.")


def _told(moment: SessionMoment) -> tuple[Event, ...]:
    return moment.past[-MOST_EVENTS:]
