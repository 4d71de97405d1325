"""The log of a controller while it runs, and of an execution afterwards."""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from functools import partial
from io import FileIO, RawIOBase
from queue import Empty, Full, Queue
from threading import Thread
from typing import Final

import numpy as np

from sagline.control.events import Event
from sagline.control.execution import Execution, ExecutionStatus, execution_of
from sagline.control.link import PERIOD, groups_of
from sagline.control.recording import Recorded, Tape
from sagline.core.arguments import file_path, instance
from sagline.core.arrays import Array
from sagline.core.errors import FileError
from sagline.core.status import Status
from sagline.files.execution_layout import DECIMALS, NONE, columns_of
from sagline.files.mcap_file import McapFile, check_packages
from sagline.files.mcap_layout import NANO
from sagline.files.packed import rounded
from sagline.files.whole import check_file, written_whole
from sagline.kinematics.plan import Plan
from sagline.robot.robot import Robot

CHUNK: Final = 0.9  # s from chunk to chunk: with what it takes to write one, no more than a second is ever lost
BLOCK: Final = 100  # cycles of a chunk at the most: on a lockstep clock they come faster
ROOM: Final = 4096  # of what waits to be written: 41 s of cycles
PATIENCE: Final = 0.1  # s, between two looks whether the writer still lives


class Recorder:
    """A log that is written beside a controller, or a twin, by a thread of its own.

    Whatever is handed over is put into a queue and left there: nothing here waits for a disk. Where the queue is full
    or the disk takes no more, recording stops for good, `stopped` says why, and what is in the file stays. Numbers are
    kept to the digits of `DECIMALS`.
    """

    def __init__(
        self,
        file: os.PathLike[str] | str,
        robot: Robot,
        *,
        period: float = PERIOD,
        group_count: int | None = None,
        epoch: int | None = None,
        stream: RawIOBase | None = None,
    ) -> None:
        """Open the file and begin.

        Args:
            file: The file, "run.mcap" for instance; a regular file that exists is replaced, anything else is refused.
            robot: The robot as the controller knows it.
            period: Of a cycle [s].
            group_count: Number of groups G; None: two winches are a group.
            epoch: What is added to times of the link's clock for those of the log [ns]; None: what makes the first of
                them the time of day.
            stream: Where to write in place of the file, unbuffered.

        Raises:
            FileError: If the file cannot be written, or a package is missing.
        """
        self.file = check_file(file_path(file))
        check_packages()
        self._robot, self._period = instance(robot, Robot, "robot"), period
        self._groups = len(groups_of(robot.cable_count)) if group_count is None else group_count
        self._plan, self._zero = NONE, np.zeros(robot.cable_count)
        self._degraded: list[bool] = []
        self._tape = self._blank()
        self._why, self._epoch = "", epoch
        self._early: list[Event] = []
        self._queue: Queue[Callable[[], None] | None] = Queue(ROOM)
        try:
            self._stream = FileIO(self.file, "wb") if stream is None else stream
            self._mcap = McapFile(self._stream, robot, period, epoch or 0)
        except OSError as error:
            raise FileError(self.file, f"cannot be written ({_reason(error)})", "Name another file.") from None
        self._thread = Thread(target=self._run, name="sagline log", daemon=True)
        self._thread.start()

    @property
    def stopped(self) -> str:
        """Why nothing more is taken; "" while something is."""
        return self._why

    def begins(self, plan: Plan) -> None:
        """Take a plan, before the first cycle that follows it."""
        self._put(partial(self._begin, plan))

    def ends(self, status: Status, reason: str) -> None:
        """Take how it ended, after its last cycle."""
        self._put(partial(self._end, status.name, reason))

    def cycle(self, cycle: Recorded) -> None:
        """Take a cycle."""
        self._date(cycle.answer.time)
        self._put(partial(self._add, cycle))

    def event(self, event: Event) -> None:
        """Take an event; one before the first cycle, whose time nobody knew, waits for it to be dated."""
        if self._epoch is None:
            self._early.append(event)
        else:
            self._put(partial(self._mcap.event, event))

    def truth(self, time: float, position: Array, quaternion: Array) -> None:
        """Take where the platform really is, as only a twin knows.

        Args:
            time: On the twin's clock [s].
            position: Of the platform's origin [m], shape (3,); a copy is taken.
            quaternion: Rotation platform -> world, scalar last, shape (4,); so it is of this.
        """
        self._date(time)
        self._put(partial(self._mcap.truth, time, position.copy(), quaternion.copy()))

    def close(self) -> None:
        """Write what waits, and the end; wait until that is done."""
        if self._early:
            self._date(self._early[-1].time)
        while self._thread.is_alive():
            try:
                self._queue.put(None, timeout=PATIENCE)
            except Full:
                continue
            self._thread.join()
        self._why = self._why or "it is closed"

    def __enter__(self) -> Recorder:
        """Record inside, close at the end."""
        return self

    def __exit__(self, *failure: object) -> None:
        """Close."""
        self.close()

    def _put(self, task: Callable[[], None]) -> None:
        if self._why:
            return
        try:
            self._queue.put_nowait(task)
        except Full:
            self._why = f"{self.file}: {ROOM} entries wait to be written, and no more fit; the disk is too slow"

    def _date(self, time_of_link: float) -> None:
        """Have the log's times be times of day."""
        if self._epoch is None:
            self._epoch = self._mcap.epoch = time.time_ns() - round(time_of_link * NANO)
            for event in self._early:
                self._put(partial(self._mcap.event, event))

    def _run(self) -> None:
        """All that the thread does."""
        try:
            with self._stream:
                self._write()
                self._mcap.finish()
        except OSError as error:
            self._why = f"{self.file}: cannot be written ({_reason(error)})"
        except Exception as error:  # whatever it is, the loop goes on and the operator is told
            self._why = f"{self.file}: {type(error).__name__}: {error}; a mistake in sagline"

    def _write(self) -> None:
        due = time.monotonic() + CHUNK
        while True:
            try:
                task = self._queue.get(timeout=max(due - time.monotonic(), 0.0))
            except Empty:
                pass
            else:
                if task is None:
                    break
                task()
            late = time.monotonic() >= due and self._queue.empty()  # else what waits comes into the same chunk
            if late or len(self._tape) >= BLOCK:
                self._close_block()
                self._mcap.close_chunk()
                due = time.monotonic() + CHUNK
        self._close_block()

    def _add(self, cycle: Recorded) -> None:
        if not np.array_equal(cycle.zero, self._zero):
            self._close_block()
            self._zero = cycle.zero
        self._tape.add(cycle)
        self._degraded.append(cycle.degraded)

    def _begin(self, plan: Plan) -> None:
        self._close_block()
        self._mcap.close_chunk()  # packing a long plan takes a second
        self._plan = self._mcap.begin(plan)

    def _end(self, status: str, reason: str) -> None:
        self._close_block()
        self._mcap.end(self._plan, status, reason)
        self._plan = NONE

    def _close_block(self) -> None:
        """Write the cycles so far."""
        if not len(self._tape):
            return
        none = ExecutionStatus.UNKNOWN
        cycles = execution_of(self._tape, self._robot, None, none, "", self._period, self._zero, ())
        columns = columns_of(cycles)
        columns |= {name: rounded(columns[name], decimals) for name, decimals in DECIMALS.items()}
        columns["degraded"] = np.array(self._degraded)
        self._mcap.block(columns, self._plan, self._zero, partial(time.sleep, 0.0))
        self._tape, self._degraded = self._blank(), []

    def _blank(self) -> Tape:
        return Tape(self._robot.cable_count, self._groups, BLOCK)


def save_execution(execution: Execution, file: os.PathLike[str] | str) -> None:
    """Write an execution to a log in MCAP, whole or not at all, with plan and robot inside and every number as it is.

    Args:
        execution: The execution.
        file: The file, "run.mcap" for instance; a regular file that exists is replaced, anything else is refused.

    Raises:
        FileError: If the file cannot be written, or a package is missing; what was there before is untouched.
        InvalidValueError: If the execution is none.
    """
    done, target = instance(execution, Execution, "execution"), file_path(file)
    check_packages()
    with written_whole(target) as partial_file, FileIO(partial_file, "wb") as stream:
        mcap = McapFile(stream, done.robot, done.period)
        number = NONE if done.plan is None else mcap.begin(done.plan)
        columns = columns_of(done)
        for first in range(0, max(len(done), 1), BLOCK):
            rows = {name: values[first : first + BLOCK] for name, values in columns.items()}
            mcap.block(rows, number, done.zero)
            mcap.close_chunk()
        for event in done.events:
            mcap.event(event)
        mcap.end(number, done.status.name, done.reason)
        mcap.finish()


def _reason(error: OSError) -> str:
    return error.strerror or type(error).__name__
