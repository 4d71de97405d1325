"""Samples for playback in a shared page: pose, tensions, lengths and verdict at each time."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import NDArray

from sagline.cables.models import Catenary
from sagline.control.states import State
from sagline.core.arrays import Array
from sagline.core.numbers import n
from sagline.dynamics.simulation.results import Simulation
from sagline.kernels.cable import geometry
from sagline.kinematics.plan import Gap, Plan
from sagline.kinematics.status import PoseStatus
from sagline.motion.anchors import refuse_moving
from sagline.robot.batch import dead_cable, pulleys_of
from sagline.robot.pose import Pose
from sagline.robot.robot import Robot
from sagline.statics.tables import chord_geometry

if TYPE_CHECKING:
    from sagline.viewer.session import PlayedLog

MOST_RATE: Final = 100.0  # samples per second of a screen; a run with at least twice this rate is thinned


@dataclass(frozen=True, slots=True, eq=False)
class SharedMotion:
    """N samples of the motion of a robot."""

    robot: Robot
    kind: str  # "run", "simulation" or "log"
    time: Array  # times from 0 [s], shape (N,)
    position: Array  # position of the platform's origin [m], shape (N, 3); NaN if it is not known
    quaternion: Array  # rotation of the platform, scalar last, shape (N, 4)
    tension: Array  # tension that the page shows as numbers and colors [N], shape (N, m)
    quantity: str  # description of this tension
    chord_tension: Array  # chord tensions of the drawn catenaries [N], shape (N, m); NaN for a straight line
    length: Array  # unstrained length off the drum [m], shape (N, m)
    verdict: NDArray[np.intp]  # indices of `verdicts`, shape (N,)
    verdicts: tuple[tuple[bool | None, str], ...]  # True for a good sample, None if unknown; verdict in words
    notes: tuple[str, ...] = ()

    @classmethod
    def of_plan(cls, plan: Plan) -> SharedMotion:
        """Samples of a plan of N poses. Without times, the interval between poses is one second."""
        refuse_moving(plan.anchors, "run")
        count = len(plan.state.pose)
        time = np.arange(count, dtype=np.float64) if plan.path is None else plan.path.time
        verdicts: list[tuple[bool | None, str]] = [(True, "Feasible")]
        which = np.zeros(count, dtype=np.intp)
        for gap in plan.gaps:
            which[gap.first : gap.last + 1] = len(verdicts)
            verdicts.append((False, _why(gap)))
        notes = ["The poses have no times; the page shows one per second."] * (plan.path is None)
        if not isinstance(plan.state.cables.model, Catenary):
            name = type(plan.state.cables.model).__name__.lower()
            notes.append(f"Planned with the {name} model; cables are drawn as catenaries with these tensions.")
        return cls(
            plan.state.one_robot, "run", time - time[0], plan.state.pose.position, plan.state.pose.quaternion,
            plan.chord_tension, "along the chord", plan.chord_tension, plan.unstrained_length, which, tuple(verdicts),
            tuple(notes),
        )  # fmt: skip

    @classmethod
    def of_simulation(cls, simulation: Simulation) -> SharedMotion:
        """Samples of a simulation. Each cable with mass is drawn as a catenary at rest of the same length."""
        refuse_moving(simulation.anchors, "simulation")
        robot, time = simulation.robot, simulation.time
        broken = np.zeros_like(simulation.tensions, dtype=bool)
        verdicts: list[tuple[bool | None, str]] = [(None, "Simulated")]
        which = np.zeros(len(time), dtype=np.intp)
        for event in simulation.events:
            which[time >= event.time] = len(verdicts)
            verdicts.append((None, f"{event.text.capitalize()} at {event.time - time[0]:.3f} s"))
            if event.kind == "break" and event.cable is not None:
                broken[time >= event.time, event.cable] = True
        tension = np.where(broken, np.nan, simulation.tensions)
        drawn = np.where(broken, np.nan, chord_tension(robot, simulation.pose, simulation.length))
        with_mass = simulation.nodes is not None
        notes = ("Cables with mass are drawn as catenaries of the same lengths at rest.",) * with_mass
        pose = simulation.pose
        return cls(
            robot, "simulation", time - time[0], pose.position, pose.quaternion, tension, "at the frame end", drawn,
            simulation.length, which, tuple(verdicts), notes,
        )  # fmt: skip

    @classmethod
    def of_session(cls, session: PlayedLog) -> SharedMotion:
        """Samples of a log of the controller. Poses are planned poses, or estimated poses of cycles without a plan."""
        from sagline.viewer.session import WRONG

        codes, which = np.unique(session.state, return_inverse=True)
        states = [State(int(code)) for code in codes]
        verdicts = tuple((False if state in WRONG else None, f"Controller: {state.name}") for state in states)
        pose = session.poses
        drawn = chord_tension(session.robot, pose, session.length)
        return cls(
            session.robot, "log", session.time, pose.position, pose.quaternion, session.tension, "measured", drawn,
            session.length, which.astype(np.intp), verdicts,
        )  # fmt: skip

    def thinned(self) -> SharedMotion:
        """Every n-th sample and the last sample, if the rate exceeds that of screens. A note has the number n."""
        count, duration = len(self.time), float(self.time[-1])
        every = int((count - 1) / (MOST_RATE * duration)) if duration > 0.0 else 1
        if every <= 1:
            return self
        rows = np.unique(np.append(np.arange(0, count, every), count - 1))
        note = f"One in {every} of {count:,} samples is kept."
        fields = ("time", "position", "quaternion", "tension", "chord_tension", "length", "verdict")
        kept = {name: getattr(self, name)[rows] for name in fields}
        return replace(self, notes=(*self.notes, note), **kept)


def _why(gap: Gap) -> str:
    if gap.status is not PoseStatus.INFEASIBLE:
        word = "Unstable" if gap.status is PoseStatus.UNSTABLE else "Not feasible"
        return f"{word}: {gap.status.text.partition(';')[0]}"
    missing = f"short of up to {n(gap.shortfall, '.3g', 'N')}"
    short = missing if np.isfinite(gap.shortfall) else "no force alone is sufficient"
    cables = f"; at their limits: cables {', '.join(map(str, gap.cables))}" if gap.cables else ""
    return f"Not feasible: {short}{cables}"


def chord_tension(robot: Robot, pose: Pose, length: Array) -> Array:
    """Chord tensions (N, m) of catenaries at rest, from lengths off the drum; NaN if a length is too short or NaN."""
    # cables leave their pulleys along the chord
    found = chord_geometry(robot, pose)
    chord, sine, cosine = (np.asarray(found[:, row]) for row in (geometry.CHORD, geometry.SINE, geometry.COSINE))
    radius, entry = pulleys_of(robot)
    free = length - radius * np.arctan2(cosine, entry * sine) - dead_cable(robot)
    known = np.isfinite(chord) & (free > 0.0)
    span, rise = (np.where(known, chord * part, 1.0) for part in (cosine, sine))
    cables = Catenary().from_length(robot.cables, span, rise, np.where(known, free, 2.0), robot.gravity)
    return np.where(known, cables.chord_tension, np.nan)
