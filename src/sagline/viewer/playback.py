"""Plans and simulations as the timeline plays them."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from typing import Final

import numpy as np

from sagline.core.arrays import Array
from sagline.core.errors import InvalidValueError
from sagline.core.numbers import n
from sagline.core.progress import Progress
from sagline.dynamics.simulation.results import Occurrence, Simulation
from sagline.kinematics.confirm import Confirmation, confirm
from sagline.kinematics.plan import Plan
from sagline.robot.pose import Pose
from sagline.robot.robot import Robot
from sagline.viewer.drawn import InMotion
from sagline.viewer.readout import block, box, cable_table, definitions, pose_line
from sagline.viewer.robot_scene import ACTUAL, WANTED
from sagline.viewer.snapshot import Snapshot
from sagline.viewer.tension_scale import ForceUnit, TensionScale, force_unit, number
from sagline.viewer.timeline import Chart, Mark, Track, cable_names, infeasible_spans, limit_violations, tension_limits

CABLES = {
    "none": "massless cables",
    "lumped": "cables with mass, as chains of nodes",
    "modal": "cables with mass, as their linear modes",
}


@dataclass(frozen=True, slots=True, eq=False)
class Moment(InMotion):
    """A robot in motion.

    Attributes:
        simulation: The simulation.
        index: Number of the sample.
    """

    simulation: Simulation
    index: int

    @property
    def robot(self) -> Robot:
        """The robot."""
        return self.simulation.robot

    @property
    def pose(self) -> Pose:
        """Pose of the platform."""
        return self.simulation.pose[self.index]

    @property
    def time(self) -> float:
        """Since the start [s]."""
        return float(self.simulation.time[self.index] - self.simulation.time[0])

    @property
    def past(self) -> tuple[Occurrence, ...]:
        """Events so far."""
        now = float(self.simulation.time[self.index])
        return tuple(event for event in self.simulation.events if event.time <= now)

    @property
    def broken(self) -> list[int]:
        """Cables that have broken."""
        return [event.cable for event in self.past if event.kind == "break" and event.cable is not None]

    @property
    def tension(self) -> Array:
        """Tensions at the frame ends [N], shape (m,); NaN of a broken cable."""
        tension: Array = self.simulation.tensions[self.index].copy()
        tension[self.broken] = np.nan
        return tension

    @property
    def length(self) -> Array:
        """Unstrained lengths off the drums [m], shape (m,)."""
        return np.asarray(self.simulation.length[self.index])

    def verdict(self) -> str:
        """HTML of the kind of simulation, the numbers of the moment, and the events so far."""
        simulation, unit = self.simulation, force_unit(self.robot)
        speed, energy = float(np.linalg.norm(simulation.twist[self.index, :3])), simulation.energy
        size = float(np.nanmax(np.abs(energy.kinetic) + np.abs(energy.potential)))
        rows = [
            ("Cables", CABLES.get(simulation.cable_mass, simulation.cable_mass)),
            ("Time", f"{self.time:.3f} s"),
            ("Speed", n(speed, ".3g", "m/s")),
            ("Tensions", f"{unit.bare(np.nanmin(self.tension))} to {unit.written(np.nanmax(self.tension))}"),
            ("Energy error", n(energy.error[self.index], ".2g", "J", size=size)),
        ]
        rows += [("Event", event_text(event, unit)) for event in self.past]
        return box("quiet", "Simulated", definitions(rows))

    def numbers(self, scale: TensionScale) -> str:
        """HTML of the pose, and of tension and length of every cable."""
        unit, length = force_unit(self.robot), self.simulation.length[self.index]
        heads = ("cable", f"at the winch<br>[{unit.name}]", "length<br>[m]")
        columns = [unit.bare(each) for each in self.tension], [number(each, ".4f") for each in length]
        return block(pose_line(self.pose) + cable_table(heads, columns, scale.colors(self.tension)))

    @property
    def why_no_choice(self) -> str:
        """Reason why tensions are not chosen."""
        return "In motion nothing is chosen: tensions follow from lengths and from where the platform is."

    @property
    def feasible(self) -> bool:
        """True: any motion is drawn as feasible."""
        return True

    @property
    def rest(self) -> None:
        """No second pose."""
        return None

    @property
    def nodes(self) -> Array | None:
        """Positions of the cables at their nodes [m], shape (m, P, 3); None of cables without."""
        return None if self.simulation.nodes is None else np.asarray(self.simulation.nodes[self.index])


def event_text(event: Occurrence, unit: ForceUnit) -> str:
    """Description of an event."""
    what = event.kind if event.cable is None else f"{event.kind} of cable {event.cable}"
    before, after = unit.bare(event.tension_before), unit.written(event.tension_after)
    return f"{what} at {event.time:.3f} s: {before} before, then at most {after}"


@dataclass(frozen=True, slots=True, eq=False)
class Run:
    """A plan of N poses, with the poses confirmed by forward kinematics.

    Attributes:
        plan: The plan.
        confirmation: The plan confirmed with exact cables.
        time: Time of each sample [s], shape (N,), from 0 on; one second a sample for poses without a path.
    """

    plan: Plan
    confirmation: Confirmation
    time: Array

    name = "run"
    still = "A run is what it was planned as; drag the platform to ask what if."

    @classmethod
    def of(cls, plan: Plan, progress: Progress | None = None) -> Run:
        """The run of a plan."""
        if not plan.state.pose.shape:
            raise InvalidValueError(
                "run", "a plan of a single pose", "a plan of poses in a row", "Save a plan of a path."
            )
        time = np.arange(len(plan.state.pose), dtype=np.float64) if plan.path is None else plan.path.time
        return cls(plan, confirm(plan, progress=progress), time - time[0])

    @property
    def robot(self) -> Robot:
        """The robot."""
        return self.plan.state.one_robot

    @property
    def home(self) -> Pose:
        """The first pose."""
        return self.plan.state.pose[0]

    @property
    def duration(self) -> float:
        """Time of the last sample [s]."""
        return float(self.time[-1])

    def index_at(self, time: float) -> int:
        """The sample at or before a time."""
        return _sample_at(self.time, time)

    def snapshot(self, index: int) -> Snapshot:
        """One sample."""
        plan = _sample(self.plan, index)
        rest = self.confirmation.pose[index] if plan.feasible else None
        return Snapshot(plan.state.one_robot, plan.state.pose, plan, rest)

    def sight(self, time: float) -> Snapshot:
        """The sample at or before a time [s]."""
        return self.snapshot(self.index_at(time))

    def track(self) -> Track:
        """Charts of the limited tensions and the lengths, and spans of infeasible poses."""
        plan, robot, unit = self.plan, self.robot, force_unit(self.robot)
        name = "Chord tension" if robot.tension_limits_of == "chord" else "Tension at the winch"
        limits = tension_limits(robot, unit.newtons, at=robot.tension_limits_of)
        cables = cable_names(robot)
        tension = Chart(
            name, unit.name, unit.decimals, cables, lambda rows: plan.state.limited_tension[rows] / unit.newtons, limits
        )
        length = Chart("Unstrained length", "m", 4, cables, lambda rows: plan.unstrained_length[rows])
        paths = (("desired", WANTED), ("actual", ACTUAL))
        return Track(self.time, (tension, length), infeasible_spans(plan, self.time, unit), (), paths)

    def traces(self, most: int, error_scale: float) -> tuple[Array, Array]:
        """Desired and actual positions (n, 3), n <= most, the error drawn some times as large; NaN in gaps."""
        rows = np.unique(np.linspace(0, len(self.time) - 1, most).astype(np.intp))
        wanted = self.plan.state.pose.position[rows]
        return wanted, wanted + error_scale * self.confirmation.position_error[rows]


def _sample(plan: Plan, i: int) -> Plan:
    """The plan of one of its poses."""
    values = {field.name: getattr(plan, field.name) for field in fields(plan)}
    entries = {name: value[i] for name, value in values.items() if isinstance(value, np.ndarray)}
    return replace(plan, state=plan.state[i], path=None, **entries)


FAILURES: Final = ("break", "stall", "slack", "saturate")  # kinds of events


@dataclass(frozen=True, slots=True, eq=False)
class Playback:
    """A simulation of N samples, from time 0 on.

    Attributes:
        simulation: The simulation.
    """

    simulation: Simulation

    name = "simulation"
    still = "A simulation is what it was started as; drag the platform to ask what if."

    @property
    def robot(self) -> Robot:
        """The robot."""
        return self.simulation.robot

    @property
    def home(self) -> Pose:
        """The first pose."""
        return self.simulation.pose[0]

    @property
    def time(self) -> Array:
        """Of the samples, from 0 on [s], shape (N,)."""
        return np.asarray(self.simulation.time - self.simulation.time[0])

    @property
    def duration(self) -> float:
        """Time of the last sample [s]."""
        return float(self.time[-1])

    def sight(self, time: float) -> Moment:
        """The sample at or before a time [s]."""
        return Moment(self.simulation, _sample_at(self.time, time))

    def traces(self, most: int, error_scale: float) -> tuple[Array, Array]:
        """No desired positions, and the actual ones (n, 3), n <= most."""
        rows = np.unique(np.linspace(0, self.time.size - 1, most).astype(np.intp))
        actual = self.simulation.pose.position[rows]
        return np.full_like(actual, np.nan), actual

    def track(self) -> Track:
        """Charts of the tensions at the frame ends and the displacement, and the events."""
        simulation, robot, unit = self.simulation, self.robot, force_unit(self.robot)
        limits = tension_limits(robot, unit.newtons, at="frame_end")
        tension_rows = self._tensions()
        cables = cable_names(robot)
        tension = Chart(
            "Tension at the winch",
            unit.name,
            unit.decimals,
            cables,
            lambda rows: tension_rows[rows] / unit.newtons,
            limits,
        )
        position = simulation.pose.position
        away = Chart(
            "Motion along x, y, z", "mm", 1, ("x", "y", "z"), lambda rows: 1e3 * (position[rows] - position[0])
        )
        began = float(simulation.time[0])
        marks = tuple(
            Mark(event.time - began, event_text(event, unit), bad=event.kind in FAILURES) for event in simulation.events
        )
        spans = limit_violations(robot, self.time, tension_rows, unit)
        return Track(self.time, (tension, away), spans, marks, (("actual", ACTUAL),))

    def _tensions(self) -> Array:
        """Tensions (N, m), NaN after a break."""
        simulation, tension = self.simulation, self.simulation.tensions.copy()
        for event in simulation.events:
            if event.kind == "break":
                tension[simulation.time >= event.time, event.cable] = np.nan
        return tension


def _sample_at(times: Array, time: float) -> int:
    """Number of the sample at or before a time; of the first one before it."""
    return int(np.clip(np.searchsorted(times, time, side="right") - 1, 0, len(times) - 1))
