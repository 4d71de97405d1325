"""Lateness of the cycles of a controller that drives a twin in another process over S7, in real time.

Run `python -m benchmarks.cycles --minutes 14` on a computer without other work. `--priority` has the same meaning as in
`sagline control`.
"""

from __future__ import annotations

import argparse
import gc
from collections.abc import Iterator
from contextlib import closing

import numpy as np
from rich.console import Console

import sagline as sl
from benchmarks.measure import Row, show
from sagline.article.ten_poses import Table2
from sagline.control.real_time import set_priority
from sagline.core.arrays import Array
from sagline.twin.server import machine_in_process

LATE = 5e-3  # cycles with a larger lateness count for the fault "cycle late" [s]
SPEED = 0.1  # speed of the tour through the ten poses [m/s]
LONG = 0.004  # speed of a path that takes a quarter of an hour [m/s]
CORNERS = ([0.4, 0.3, 1.5], [-0.4, 0.3, 1.5])  # length of this path [m]
PLANS = 6  # number of plans


class NotedPace(sl.control.Pace):
    """Pace that keeps the lateness of each cycle."""

    def __init__(self) -> None:
        """Begin without cycles."""
        super().__init__()
        self.late: list[float] = []

    def wait(self) -> float:
        """Wait for the next tick."""
        late = super().wait()
        self.late.append(late)
        return late


def tours(control: sl.control.Controller, pace: NotedPace, minutes: float, home: sl.Pose) -> Iterator[Row]:
    """Tours through the ten poses; each tour is planned while the platform is at rest."""
    path = sl.quintic_path([home.position, *Table2().desired, home.position], speed=SPEED)
    events = len(control.events)
    pace.late.clear()
    while len(pace.late) * control.period < 60.0 * minutes:
        control.start(path)
        while control.moving and len(pace.late) * control.period < 60.0 * minutes:
            control.cycle()
    late = np.array(pace.late)
    control.stop()
    control.wait()
    p50, p99, p999, most = 1e3 * np.quantile(late, (0.5, 0.99, 0.999, 1.0))
    alarms = sum(event.name in ("cycle late", "cycle lost") for event in control.events[events:])
    yield Row("cycles", "", f"{len(late):,} of 10 ms")
    yield Row("lateness: median, 99 %, 99.9 %, largest", "", f"{p50:.2f}, {p99:.2f}, {p999:.2f}, {most:.2f} ms")
    yield Row("cycles later than 5 ms; missed, later than 10 ms", "", f"{_beyond(late, LATE)}; {_beyond(late, 0.01)}")
    yield Row("alarms of the controller", "", f"{alarms}")


def planning(control: sl.control.Controller, pace: NotedPace, home: sl.Pose) -> Iterator[Row]:
    """Plan a path of a quarter of an hour repeatedly, while the cycles continue."""
    path = sl.septic_path([home, *(sl.Pose(place, np.eye(3)) for place in CORNERS), home], speed=LONG)
    pace.late.clear()
    for _ in range(PLANS):
        control.plan(path)
    late = np.array(pace.late)
    rare, most = 1e3 * np.quantile(late, (0.99, 1.0))
    measured = f"{rare:.2f}, {most:.2f} ms; {_beyond(late, LATE)} of {len(late):,} later than 5 ms"
    yield Row(f"lateness during plans of {path.duration / 60.0:.0f} minutes: 99 %, largest", "", measured)


def _beyond(late: Array, limit: float) -> int:
    """Number of cycles that are later than a limit [s]."""
    return int((late > limit).sum())


def main() -> None:
    """Drive the twin, and print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--minutes", type=float, default=14.0, help="duration of the tours")
    parser.add_argument("--priority", type=int, help="priority of the scheduler SCHED_FIFO, 1 to 99")
    given = parser.parse_args()
    if given.priority is not None:
        set_priority(given.priority)
    robot, home = sl.load_robot("article-prototype"), sl.Pose.from_euler([0.0, 0.0, 1.5], 0.0, 0.0, 0.0)
    pace = NotedPace()
    with machine_in_process(robot, robot, home) as (addresses, _), closing(sl.plc.S7Link(addresses, robot)) as link:
        control = sl.control.Controller(robot, link, pace=pace, seed=1)
        gc.collect()
        gc.freeze()  # as in `sagline control`
        control.connect()
        control.home(home)
        rows = [*tours(control, pace, given.minutes, home), *planning(control, pace, home)]
        control.off()
    show("Lateness of cycles", rows, Console())


if __name__ == "__main__":
    main()
