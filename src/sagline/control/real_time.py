"""Control in real time: ticks, garbage collection, Ctrl-C, and early loading of kernels."""

from __future__ import annotations

import os
import signal
import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import Future
from contextlib import contextmanager, suppress
from math import inf
from types import FrameType
from typing import Final, TypeVar

import numpy as np

from sagline.cables.model import CableModel
from sagline.control.checks import plan_motion
from sagline.control.homing import Homing
from sagline.control.link import PERIOD
from sagline.control.set_points import PlatformJog, SetPoint, standing_at, winch_jog
from sagline.core.arguments import whole_number
from sagline.core.arrays import Array, Indices, locked, number
from sagline.core.errors import InvalidValueError, SaglineError
from sagline.motion.rest_to_rest import septic_path
from sagline.robot.pose import Pose
from sagline.robot.robot import Robot
from sagline.tension.method import TensionMethod

T = TypeVar("T")
BIN: Final = 1e-4  # width of a bin [s]
BINS: Final = 1000  # number of bins; an additional bin counts all longer durations


class Histogram:
    """Histogram of durations up to 100 ms, in bins of 0.1 ms."""

    def __init__(self) -> None:
        """Create an empty histogram."""
        self._counts = [0] * (BINS + 1)  # a list is faster than an array
        self.longest = 0.0

    def add(self, duration: float) -> None:
        """Count one duration.

        Args:
            duration: Duration [s], >= 0.
        """
        self._counts[min(int(duration / BIN), BINS)] += 1
        self.longest = max(self.longest, duration)

    @property
    def counts(self) -> Indices:
        """Number of durations in each bin, shape (1001,); the last bin contains all durations of 100 ms and more."""
        return locked(np.array(self._counts))

    def quantile(self, share: float) -> float:
        """Quantile of the durations [s], rounded up to the end of its bin; 0 for an empty histogram.

        Args:
            share: Share of all durations, 0 to 1.

        Raises:
            InvalidValueError: If `share` is not a number in this range.
        """
        if not number(share, "share", "", low=0.0) <= 1.0:
            raise InvalidValueError("share", f"{share:g}", "0 to 1", "Give 0.999 for the limit of 999 of 1000 cycles.")
        counts = np.cumsum(self._counts)
        if not counts[-1]:
            return 0.0
        k = int(np.searchsorted(counts, share * counts[-1]))
        return min((k + 1) * BIN if k < BINS else inf, self.longest)


class Pace:
    """Clock without drift: `wait` returns at the next tick. The duration of a cycle has no effect on the ticks.

    The thread sleeps during the wait, because threads of the link need the processor. If a cycle is late by more than a
    period, the ticks restart at the late cycle. Without this restart, all missed set points would be sent at once.
    """

    def __init__(self, period: float = PERIOD) -> None:
        """Prepare the clock; the ticks begin with the first wait.

        Args:
            period: Time between two ticks [s], > 0.

        Raises:
            InvalidValueError: If `period` is not a positive number.
        """
        self.period = number(period, "period", "s", above=0.0)
        self.lateness = Histogram()
        self.periods = Histogram()  # from the start of a cycle to the start of the next one
        self._next: float | None = None
        self._began = 0.0

    def wait(self) -> float:
        """Wait for the next tick.

        Returns:
            Delay of the start of the cycle [s], >= 0.
        """
        now = time.perf_counter()
        if self._next is None:
            self._next = self._began = now
        if self._next > now:
            time.sleep(self._next - now)
            now = time.perf_counter()
        late = max(now - self._next, 0.0)
        self.lateness.add(late)
        self.periods.add(now - self._began)
        self._began = now
        self._next = (now if late > self.period else self._next) + self.period
        return late


def set_priority(priority: int) -> None:
    """Give this thread a real-time priority (SCHED_FIFO of Linux), and all threads and processes that it starts."""
    # priority: 1 to 99; the kernel's own threads have 50
    level = whole_number(priority, "priority", 1, 99)
    if not hasattr(os, "sched_setscheduler"):
        raise InvalidValueError("priority", level, "none: only Linux has this scheduler", "Run without a priority.")
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(level))
    except OSError as error:
        allowed = f"up to the limit that ulimit -r shows ({error.strerror})"
        step = f"Raise the limit of this shell: sudo prlimit --pid $$ --rtprio={level}"
        raise InvalidValueError("priority", level, allowed, step) from None


@contextmanager
def interrupt_calls(stop: Callable[[], object]) -> Iterator[None]:
    """Block of the main thread in which the first Ctrl-C calls `stop`; KeyboardInterrupt follows at the block's end."""
    before = signal.getsignal(signal.SIGINT)
    if threading.current_thread() is not threading.main_thread() or not callable(before):
        yield
        return
    pressed = False

    def hear(number: int, frame: FrameType | None) -> None:
        nonlocal pressed
        if not pressed:
            pressed = True
            stop()

    signal.signal(signal.SIGINT, hear)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)
    if pressed:
        raise KeyboardInterrupt


def result_in_thread(work: Callable[[], T]) -> Future[T]:
    """Run `work` in another thread of ordinary priority. Canceling the returned future does not stop the work."""
    # cycles continue during the work, because compiled kernels release Python's lock. A process instead of the thread
    # would make cycles late at the moment when it returns a long plan.
    result: Future[T] = Future()

    def run() -> None:
        with suppress(AttributeError, OSError):  # the control loop may have a real-time priority
            os.sched_setscheduler(0, os.SCHED_OTHER, os.sched_param(0))
        try:
            value = work()
        except Exception as error:
            if result.set_running_or_notify_cancel():
                result.set_exception(error)
            return
        if result.set_running_or_notify_cancel():
            result.set_result(value)

    # a daemon thread, so that Python can end before the work
    threading.Thread(target=run, name="sagline planning", daemon=True).start()
    return result


MOVE = 0.01  # length of the path [m]
HEIGHTS = (0.25, 0.5, 0.1, 0.75)  # depths of the poses below the frame anchors, as shares of the frame width


def load_kernels(robot: Robot, period: float, model: CableModel, method: TensionMethod) -> None:
    """Load all kernels of a controller: run a homing, a path and jogs near the middle of `robot`. Ignore refusals."""
    middle, homing = _first_feasible(robot, model, method)
    beside = Pose(middle.position + np.array([MOVE, 0.0, 0.0]))
    path, by = septic_path([middle, beside], speed=0.1), np.full(6, 1e-3)
    previous = None if homing is None else homing.plan
    point = _straight_set_point(robot, middle) if homing is None else homing.standing.step()
    parts: tuple[Callable[[], object], ...] = (
        lambda: None if homing is None else homing.refusal(),
        lambda: standing_at(robot, point.length, None, model),
        lambda: plan_motion(robot, path, period, model, method, previous),
        lambda: winch_jog(robot, point.length, middle, 0, 1e-3, period, model),
        lambda: PlatformJog(robot, point, middle, by, period, model, method).step(),
    )
    for part in parts:
        with suppress(SaglineError):
            part()


def _first_feasible(robot: Robot, model: CableModel, method: TensionMethod) -> tuple[Pose, Homing | None]:
    """First position with feasible tensions, and its plan. If no position is feasible, the middle and None."""
    for place in _probable_positions(robot):
        pose = Pose(place)
        with suppress(SaglineError):
            homing = Homing(robot, pose, model, method)
            homing.off = np.zeros(robot.cable_count)
            return pose, homing
    return Pose(_probable_positions(robot)[0]), None


def _straight_set_point(robot: Robot, pose: Pose) -> SetPoint:
    length = np.linalg.norm(pose.transform(robot.platform_anchors) - robot.frame_anchors, axis=1)
    none, unknown = np.zeros(len(length)), np.full(len(length), np.nan)
    return SetPoint(length, none, unknown, unknown, None, None, np.nan, True)


def _probable_positions(robot: Robot) -> list[Array]:
    """Positions that are probably feasible: middle of the test box, and points below the middle of the anchors."""
    low, high = robot.frame_anchors.min(axis=0), robot.frame_anchors.max(axis=0)
    width = float(np.linalg.norm((high - low)[:2]))
    below = [np.asarray(0.5 * (low + high) - [0.0, 0.0, height * width]) for height in HEIGHTS]
    box = robot.test_box
    return below if box is None else [0.5 * (box.low + box.high), *below]
