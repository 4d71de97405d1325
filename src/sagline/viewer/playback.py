"""Plans and simulations in the form that the player and the timeline need."""

from __future__ import annotations

from dataclasses import fields, replace
from typing import Final

import numpy as np

from sagline.core.arguments import evenly_spaced
from sagline.core.arrays import Array, Progress
from sagline.core.errors import InvalidValueError
from sagline.core.numbers import n
from sagline.dynamics.simulation.results import Occurrence, Simulation
from sagline.kinematics.confirm import confirm
from sagline.kinematics.plan import Plan
from sagline.kinematics.status import PoseStatus
from sagline.motion.anchors import refuse_moving
from sagline.viewer.player import InMotion, Played
from sagline.viewer.readout import definitions, verdict_box
from sagline.viewer.robot_scene import ACTUAL, WANTED
from sagline.viewer.snapshot import Snapshot
from sagline.viewer.tension_scale import ForceUnit, cables_text, number_text
from sagline.viewer.timeline import Chart, Span, Track, limit_violations, spans_of

CABLES: Final = {
    "none": "massless cables",
    "lumped": "cables with mass, as chains of nodes",
    "modal": "cables with mass, as their linear modes",
}
NO_CHOICE: Final = "In motion, tensions are not chosen: they follow from the lengths and from the pose."


def _event_text(event: Occurrence, unit: ForceUnit) -> str:
    before, after = unit.bare(event.tension_before), unit.written(event.tension_after)
    return f"{event.text} at {event.time:.3f} s: {before} before, then at most {after}"


class PlayedPlan(Played):
    """A plan of N poses, with its poses confirmed by forward kinematics; one second per pose without a path."""

    name = "run"
    unchanged = "A run keeps its robot and loads; drag the platform to change them."

    def __init__(self, plan: Plan, progress: Progress | None = None) -> None:
        """Confirm the poses with exact cables."""
        refuse_moving(plan.anchors, "run")
        if not plan.state.pose.shape:
            step = "Save a plan of a path."
            raise InvalidValueError("run", "a plan of a single pose", "a plan of poses in a row", step)
        time = np.arange(len(plan.state.pose), dtype=np.float64) if plan.path is None else plan.path.time
        self.plan, self.robot, self.time = plan, plan.state.one_robot, time - time[0]
        self.confirmation = confirm(plan, progress=progress)

    def at(self, time: float) -> Snapshot:
        """The sample at or before a time [s]."""
        index = self.index_at(time)
        plan = _sample(self.plan, index)
        rest = self.confirmation.pose[index] if plan.feasible else None
        return Snapshot(plan.state.one_robot, plan.state.pose, plan, rest)

    def code(self, source: str, time: float) -> list[str]:
        """Lines of Python that reproduce a sample; `source` is an expression of the plan."""
        index = self.index_at(time)
        lines = [f"plan = {source}", f"index = {index}"]
        lines += ["robot, pose = plan.state.one_robot, plan.state.pose[index]", "tension = plan.chord_tension[index]"]
        if self.plan.feasible[index]:
            lines.append("rest = sl.confirm(plan).pose[index]  # true equilibrium")
        return lines

    def track(self) -> Track:
        """Charts of the limited tensions and the lengths, and spans of infeasible poses."""
        plan, limited = self.plan, self.robot.tension_limits_of
        name = "Chord tension" if limited == "chord" else "Tension at the winch"
        tension = Chart.of_tensions(name, self.robot, plan.state.limited_tension, limited)
        length = Chart("Unstrained length", "m", 4, tension.names, lambda rows: plan.unstrained_length[rows])
        paths = (("desired", WANTED), ("actual", ACTUAL))
        return Track(self.time, (tension, length), _infeasible_spans(plan, self.time), (), paths)

    def traces(self, most: int, error_scale: float) -> tuple[Array, Array]:
        """Desired and actual positions (n, 3), n <= `most`, with a scaled error; NaN in gaps."""
        rows = evenly_spaced(len(self.time), most)
        wanted = self.plan.state.pose.position[rows]
        return wanted, wanted + error_scale * self.confirmation.position_error[rows]


def _infeasible_spans(plan: Plan, time: Array) -> tuple[Span, ...]:
    """Time spans in which a plan of N poses is not feasible or not stable."""
    unit = ForceUnit.of(plan.state.one_robot)

    def why(rows: slice) -> str:
        lost = plan.status[rows] == PoseStatus.INFEASIBLE
        if not lost.any():  # poses before and after infeasible ones are often unstable
            return PoseStatus(int(plan.status[rows][~plan.solved[rows]][0])).name.replace("_", " ").lower()
        short = plan.shortfall[rows][lost]
        known = short[np.isfinite(short)]
        parts = ["not feasible"]
        if np.isinf(short).any():
            parts.append("no force alone is sufficient")
        elif known.size:
            parts.append(f"short of up to {unit.written(float(known.max()))}")
        blocking = np.flatnonzero(plan.blocking[rows][lost].any(axis=0))
        return ": ".join(parts) + (f"; at their limits: {cables_text(blocking)}" if blocking.size else "")

    return spans_of(time, ~plan.solved, why)


def _sample(plan: Plan, i: int) -> Plan:
    values = {field.name: getattr(plan, field.name) for field in fields(plan)}
    entries = {name: value[i] for name, value in values.items() if isinstance(value, np.ndarray)}
    return replace(plan, state=plan.state[i], path=None, **entries)


FAILURES: Final = ("break", "stall", "slack", "saturate")  # kinds of events


class PlayedSimulation(Played):
    """A simulation with N samples; its times begin at 0."""

    name = "simulation"
    unchanged = "A simulation keeps its robot and loads; drag the platform to change them."

    def __init__(self, simulation: Simulation) -> None:
        """Play a simulation."""
        refuse_moving(simulation.anchors, "simulation")
        self.simulation, self.robot = simulation, simulation.robot
        self.time = np.asarray(simulation.time - simulation.time[0])
        self.tension = simulation.tensions.copy()  # NaN after a break
        for event in simulation.events:
            if event.kind == "break":
                self.tension[simulation.time >= event.time, event.cable] = np.nan

    def at(self, time: float) -> InMotion:
        """The sample at or before a time [s]."""
        simulation, unit, k = self.simulation, ForceUnit.of(self.robot), self.index_at(time)
        now = float(simulation.time[k])
        past = [event for event in simulation.events if event.time <= now]
        broken = [event.cable for event in past if event.kind == "break" and event.cable is not None]
        tension, length, pose = self.tension[k], np.asarray(simulation.length[k]), simulation.pose[k]
        energy = simulation.energy
        size = float(np.nanmax(np.abs(energy.kinetic) + np.abs(energy.potential)))
        rows = [
            ("Cables", CABLES.get(simulation.cable_mass, simulation.cable_mass)),
            ("Time", f"{now - simulation.time[0]:.3f} s"),
            ("Speed", n(np.linalg.norm(simulation.twist[k, :3]), ".3g", "m/s")),
            ("Tensions", unit.span(tension)),
            ("Energy error", n(energy.error[k], ".2g", "J", size=size)),
            *(("Event", _event_text(event, unit)) for event in past),
        ]
        heads = ("cable", f"at the winch<br>[{unit.name}]", "length<br>[m]")
        columns = [unit.bare(each) for each in tension], [number_text(each, ".4f") for each in length]
        table = (verdict_box("quiet", "Simulated", definitions(rows)), heads, columns, NO_CHOICE)
        nodes = None if simulation.nodes is None else np.asarray(simulation.nodes[k])
        return InMotion(self.robot, pose, k, tension, length, *table, nodes=nodes, broken=broken)

    def code(self, source: str, time: float) -> list[str]:
        """Lines of Python that reproduce a sample; `source` is an expression of the simulation."""
        index = self.index_at(time)
        return [
            f"simulation = {source}",
            f"index = {index}  # {self.time[index]:g} s",
            "robot, pose = simulation.robot, simulation.pose[index]",
            "tension = simulation.tensions[index]",
        ]

    def traces(self, most: int, error_scale: float) -> tuple[Array, Array]:
        """Desired positions, all NaN, and actual positions, both of shape (n, 3) with n <= `most`."""
        actual = self.simulation.pose.position[evenly_spaced(len(self.time), most)]
        return np.full_like(actual, np.nan), actual

    def track(self) -> Track:
        """Charts of the tensions at the frame ends and the displacement, and the events."""
        simulation, unit, position = self.simulation, ForceUnit.of(self.robot), self.simulation.pose.position
        tension = Chart.of_tensions("Tension at the winch", self.robot, self.tension)
        axes, began = ("x", "y", "z"), float(simulation.time[0])
        away = Chart("Motion along x, y, z", "mm", 1, axes, lambda rows: 1e3 * (position[rows] - position[0]))
        events = simulation.events
        marks = tuple((each.time - began, _event_text(each, unit), each.kind in FAILURES) for each in events)
        spans = limit_violations(self.robot, self.time, self.tension)
        return Track(self.time, (tension, away), spans, marks, (("actual", ACTUAL),))
