"""Repetition of the article's experiment: a controller moves a machine from home to the ten poses and back home."""

# The published total duration, about 14 minutes, determines the speed and the durations of the stops, which are not
# published. The machine is a twin, whose true position is known.

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Sequence
from itertools import pairwise
from math import dist
from typing import Final

import numpy as np

import sagline as sl
from sagline import control
from sagline.article.ten_poses import HOME, Table2
from sagline.control.link import PERIOD
from sagline.core.arrays import Array
from sagline.core.results import Status

PROTOTYPE: Final = "article-prototype"
SPEED: Final = 0.06  # largest speed of the platform [m/s]; the fastest winch has 61 mm/s
STOP: Final = 14.0  # duration of each stop, also at home [s]; the experiment takes 13.9 minutes
LOOK: Final = 1.0  # measured values are means over this time at the end of a stop [s]
BIAS: Final = 2.0  # load cell offset [N], 0.1 % of the range of a 2 kN load cell
NEXT: Final = "Correct the cause, and start again."
EVERY: Final = 10  # a curve in a figure has one point per this number of cycles

Where = Callable[[], Array]  # function that returns the true position of the platform [m], shape (3,)
Tell = Callable[[float], None]  # function that is called with the completed share of the experiment


class StopObserver:
    """Recorder (`sagline.control.Recorder`) of the measured values at stops and during motions."""

    def __init__(self, where: Where, tell: Tell | None = None) -> None:
        """Prepare a recorder; `where` returns the true position, and `tell` is called with the progress."""
        self.stopped = ""  # "" means that the recorder has not failed
        self.farthest = self.misjudged = 0.0
        self.courses: list[Array] = []
        self.cycles = self.acted = self.stood = 0
        self._where, self._tell, self._expected = where, tell, duration() / PERIOD
        self._plan: sl.Plan | None = None
        self._begun = False
        self._seen: deque[tuple[Array, ...]] = deque(maxlen=round(LOOK / PERIOD))
        self._before: Array | None = None

    def begins(self, plan: sl.Plan) -> None:
        """Store the plan of a motion. The first cycle of a motion counts as part of the previous stop."""
        self._plan, self._begun = plan, False

    def ends(self, status: Status, reason: str) -> None:
        """Ignore the end of a plan, which the caller of the controller handles."""

    def event(self, event: control.Event) -> None:
        """Ignore events, because the controller stores them."""

    def cycle(self, cycle: control.Recorded) -> None:
        """Update all observations with the data of one cycle."""
        answer = cycle.answer
        if not isinstance(answer, control.Sample) or cycle.state not in (control.State.MOVING, control.State.IDLE):
            return
        self.cycles += 1
        if self._tell is not None and self.cycles % round(1.0 / PERIOD) == 0:
            self._tell(min(self.cycles / self._expected, 1.0))
        place = self._where()
        self.misjudged = max(self.misjudged, dist(place, cycle.position))
        if cycle.state is control.State.IDLE:
            self._stand(place, cycle, answer)
        elif not self._begun:
            self._begun = True
        elif self._plan is not None and np.isfinite(cycle.clock):
            row = min(round(cycle.clock / PERIOD), len(self._plan.status) - 1)
            self.farthest = max(self.farthest, dist(place, self._plan.state.pose.position[row]))
            if self.cycles % EVERY == 0:
                self.courses.append(
                    np.concatenate(([cycle.clock], answer.tension, cycle.planned_tension, answer.length + cycle.zero))
                )

    def _stand(self, place: Array, cycle: control.Recorded, answer: control.Sample) -> None:
        """Store positions, tension and correction of one cycle at a stop; old cycles are dropped after a second."""
        self.stood += 1
        self.acted += self._before is not None and bool((cycle.correction != self._before).any())
        self._before = cycle.correction.copy()
        self._seen.append((place.copy(), cycle.position, answer.tension, self._before))

    def seen(self) -> tuple[Array, ...]:
        """Means over the last second of a stop: true position, estimated position, tension, correction."""
        return tuple(np.mean(rows, axis=0) for rows in zip(*self._seen, strict=True))


class Experiment:
    """Result of the experiment; the time series have K points, and the robot has m winches."""

    def __init__(
        self,
        controller: control.Controller,
        watch: StopObserver,
        stops: Sequence[tuple[Array, ...]],
        plans: Sequence[sl.Plan],
        ends: Array,
    ) -> None:
        """Evaluate observations at the stops, plans of the legs, and times (12,) of the ends of the legs."""
        self.table, self.robot, m = Table2(), controller.robot, controller.robot.cable_count
        true, estimated, tension, correction = (np.array(column) for column in zip(*stops[1:], strict=True))
        planned = np.array([plan.state.cables.frame_end_tension[-1] for plan in plans])
        seen = [
            control.null_space(plan.state[-1]).visible @ off for plan, off in zip(plans, tension - planned, strict=True)
        ]
        # true positions of the platform at the ten stops [m], shape (10, 3)
        # estimated: positions estimated from the encoders at the stops [m], shape (10, 3)
        # tension: measured tensions at the stops, as means over a second [N], shape (10, m)
        self.true, self.estimated, self.tension = true[:-1], estimated[:-1], tension[:-1]
        # planned_tension: planned tensions at the stops [N], shape (10, m)
        # correction: correction of the lengths by the tension loop at the stops [m], shape (10, m)
        self.planned_tension, self.correction = planned[:-1], correction[:-1]
        # null_error: largest tension error of a cable in the null space, which length changes can correct without
        # motion [N], shape (10,)
        # back: final minus initial position of the platform at home [m], shape (3,)
        self.null_error, self.back = np.abs(seen[:-1]).max(axis=1), true[-1] - stops[0][0]
        # cells: measured tensions [N], shape (K, m)
        # planned: planned tensions [N], shape (K, m)
        time, self.cells, self.planned, lengths = np.split(np.array(watch.courses), [1, 1 + m, 1 + 2 * m], axis=1)
        # time: time of motion, without the stops [s], shape (K,)
        # lengths: lengths minus lengths at home [m], shape (K, m)
        # stops: times of the ten stops on the time axis `time`, shape (10,)
        self.time, self.lengths, self.stops = time[:, 0], lengths - plans[0].unstrained_length[0], ends[1:-1]
        self.duration = PERIOD * watch.cycles  # from home to home, including stops [s]
        rates = [plan.length_rate for plan in plans]
        # largest speed of a winch [m/s]
        self.winch_speed = max(float(np.abs(rate).max()) for rate in rates if rate is not None)
        # farthest: largest distance between true position and set point in motion [m]
        # misjudged: largest distance between true and estimated position [m]
        # acting: share of the cycles at stops in which the tension loop changes the lengths
        self.farthest, self.misjudged, self.acting = watch.farthest, watch.misjudged, watch.acted / watch.stood
        self.events = controller.events

    @property
    def error(self) -> Array:
        """True minus desired position [m], shape (10, 3)."""
        return self.true - self.table.desired

    @property
    def distance(self) -> Array:
        """Euclidean distance of true and desired position [m], shape (10,)."""
        return np.asarray(np.linalg.norm(self.error, axis=1))


def with_cells(robot: sl.Robot) -> sl.Robot:
    """The robot with load cell offsets of +2 N and -2 N, if its load cells do not have offsets already."""
    winches = robot.winches
    if winches is None or winches.load_cell_bias.any():
        return robot
    signs = np.where(np.arange(robot.cable_count) // 2 % 2, -1.0, 1.0)
    return robot.replace(winches=winches.replace(load_cell_bias=BIAS * signs))


def in_process(
    true: sl.Robot | None = None,
    nominal: sl.Robot | None = None,
    *,
    seed: int = 1,
    loop: control.TensionSettings | None = None,
    tell: Tell | None = None,
) -> Experiment:
    """Run the experiment with a twin in this process, in lockstep."""
    planned = sl.load_robot(PROTOTYPE) if nominal is None else nominal
    real = with_cells(planned if true is None else true)
    twin = sl.twin.Machine(real, nominal=planned, start=sl.Pose(HOME), seed=seed)
    watch = StopObserver(lambda: twin.reading.position, tell)
    return experiment(control.Controller(planned, twin.link(), loop=loop, record=watch, seed=seed), watch)


def experiment(controller: control.Controller, watch: StopObserver) -> Experiment:
    """Run the experiment. Raise RefusedError if connection or homing fails, or if a fault ends the experiment."""
    places, rate = sl.Pose(points()), 1.0 / controller.period  # one sample per cycle
    legs = [sl.quintic_path([here, there], speed=SPEED, rate=rate) for here, there in pairwise(places)]
    controller.connect()
    controller.home(sl.Pose(HOME))
    _stand(controller, "home")
    stops, plans, ends = [watch.seen()], list[sl.Plan](), [0.0]
    for name, leg in zip([*Table2().points, "home"], legs, strict=True):
        first = len(watch.courses)
        done = _executed(controller, leg, name)
        assert done.plan is not None
        plans.append(done.plan)
        for row in watch.courses[first:]:
            row[0] += ends[-1]
        ends.append(ends[-1] + float(done.clock[np.isfinite(done.clock)][-1]))
        _stand(controller, name)
        stops.append(watch.seen())
    controller.off()
    return Experiment(controller, watch, stops, plans, np.array(ends))


def _executed(controller: control.Controller, leg: sl.Path, name: str) -> control.Execution:
    """Execute the motion `leg` to the point `name`; raise RefusedError if the platform does not reach the end."""
    try:
        done = controller.execute(leg)
    except control.RefusedError as error:  # planning takes some time, in which a fault can occur
        raise (
            error if controller.state is control.State.IDLE else _ended(controller, f"before the motion to {name}")
        ) from None
    if done.status is not control.ExecutionStatus.DONE:
        raise control.RefusedError(f"the experiment, on the way to {name}", done.reason.rstrip("."), NEXT)
    return done


def _stand(controller: control.Controller, name: str) -> None:
    """Wait at a stop for the duration of the measurement."""
    for _ in range(round(STOP / PERIOD)):
        controller.cycle()
        if controller.state is not control.State.IDLE:
            raise _ended(controller, f"at {name}")


def _ended(controller: control.Controller, where: str) -> control.RefusedError:
    """Error with the fault that ended the experiment."""
    faults = [event.text for event in controller.events if event.kind is control.EventKind.FAULT]
    reason = faults[-1] if faults else controller.events[-1].text
    return control.RefusedError(f"the experiment, {where}", reason.rstrip("."), NEXT)


def duration() -> float:
    """Duration of the experiment [s], including all stops at the ten poses and at home."""
    path = sl.quintic_path(points(), speed=SPEED, rate=10.0)
    return float(path.time[-1] - path.time[0]) + STOP * len(points())


def points() -> Array:
    """Positions of all stops [m], shape (12, 3): home, the ten poses, and home."""
    return np.vstack((HOME, Table2().desired, HOME))
