"""A run: a plan along a path, its proof, and any of its samples as a moment to look at."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace

import numpy as np

from sagline.core.arrays import Array
from sagline.core.errors import InvalidValueError
from sagline.core.progress import Progress
from sagline.kinematics.confirm import Confirmation, confirm
from sagline.kinematics.plan import Plan
from sagline.robot.pose import Pose
from sagline.robot.robot import Robot
from sagline.viewer.snapshot import Snapshot
from sagline.viewer.stage import ACTUAL, WANTED
from sagline.viewer.tension_scale import force_unit
from sagline.viewer.timeline_spans import infeasible
from sagline.viewer.timeline_track import Chart, Track, cable_names, tension_limits


@dataclass(frozen=True, slots=True, eq=False)
class Run:
    """A plan of N poses with where the platform really goes.

    Attributes:
        plan: The plan.
        confirmation: Its lengths wound onto exact cables.
        time: Time of each sample [s], shape (N,), from 0 on; one second a sample for poses without a path.
    """

    plan: Plan
    confirmation: Confirmation
    time: Array

    name = "run"
    still = "A run is what it was planned as; drag the platform to ask what if."

    @classmethod
    def of(cls, plan: Plan, progress: Progress | None = None) -> Run:
        """The run of a plan.

        Args:
            plan: The plan.
            progress: Told how many of its poses are confirmed, of how many.

        Raises:
            InvalidValueError: If it is the plan of a single pose.
        """
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
        """Where it begins."""
        return self.plan.state.pose[0]

    @property
    def duration(self) -> float:
        """Time of the last sample [s]."""
        return float(self.time[-1])

    def index_at(self, time: float) -> int:
        """The sample at or before a time."""
        return int(np.clip(np.searchsorted(self.time, time, side="right") - 1, 0, len(self.time) - 1))

    def snapshot(self, index: int) -> Snapshot:
        """One sample."""
        plan = _sample(self.plan, index)
        rest = self.confirmation.pose[index] if plan.feasible else None
        return Snapshot(plan.state.one_robot, plan.state.pose, plan, rest)

    def sight(self, time: float) -> Snapshot:
        """The sample at or before a time [s]."""
        return self.snapshot(self.index_at(time))

    def track(self) -> Track:
        """The tensions that are limited and the lengths, and where there are none."""
        plan, robot, unit = self.plan, self.robot, force_unit(self.robot)
        name = "Chord tension" if robot.tension_limits_of == "chord" else "Tension at the winch"
        limits = tension_limits(robot, unit.newtons, at=robot.tension_limits_of)
        cables = cable_names(robot)
        tension = Chart(
            name, unit.name, unit.decimals, cables, lambda rows: plan.state.limited_tension[rows] / unit.newtons, limits
        )
        length = Chart("Unstrained length", "m", 4, cables, lambda rows: plan.unstrained_length[rows])
        paths = (("desired", WANTED), ("actual", ACTUAL))
        return Track(self.time, (tension, length), infeasible(plan, self.time, unit), (), paths)

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
