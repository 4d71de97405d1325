"""Writing of MCAP logs, chunk by chunk. If the process is killed, all complete chunks can be read."""

# The topic `/record` contains all numbers; it has one message per chunk with the packed values of its cycles.
# Attachments contain the robot and the plans. All topics except `/record` are for other programs: `/cycle` and `/event`
# in JSON, `/tf` and `/scene` in the schemas of Foxglove.

from __future__ import annotations

import json
import os
import time
from collections.abc import Callable, Mapping
from functools import partial
from importlib.util import find_spec
from io import FileIO, RawIOBase
from queue import Empty, Full, Queue
from threading import Thread
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from sagline.control.execution import ExecutionStatus, execution_of
from sagline.control.link import PERIOD, groups_of
from sagline.control.recording import CycleTable, Event, Recorded
from sagline.core.arguments import file_path, instance
from sagline.core.arrays import Array
from sagline.core.errors import FileError
from sagline.core.results import Status
from sagline.files import mcap_layout
from sagline.files.packed import pack, pack_dataset, round_decimals
from sagline.files.plan_file import plan_dataset
from sagline.files.robot_file import dump_robot
from sagline.files.variables import NONE
from sagline.files.writing import check_file
from sagline.kinematics.plan import Plan
from sagline.robot.robot import Robot

PACKAGES: Final = ("mcap", "mcap_protobuf", "foxglove_schemas_protobuf", "zstandard")
_UNLIMITED: Final = 1 << 40  # chunk size [bytes], so large that a chunk never ends because of its size
CHUNK: Final = 0.9  # time between chunks [s]; if a process is killed, less than one second is lost
BLOCK: Final = 100  # largest number of cycles per chunk, because cycles in lockstep are faster than in real time
ROOM: Final = 4096  # capacity of the queue, sufficient for the cycles of 41 s
PATIENCE: Final = 0.1  # time between two checks that the writer thread is alive [s]


class _Unbuffered:
    """Unbuffered output, which replaces the buffered writer of the library."""

    def __init__(self, file: RawIOBase) -> None:
        self._file = file
        self._size = 0

    def write(self, data: bytes) -> int:
        """Write all bytes."""
        rest = memoryview(data)
        while rest:
            rest = rest[self._file.write(rest) or 0 :]
        self._size += len(data)
        return len(data)

    def tell(self) -> int:
        """Number of bytes written."""
        return self._size

    def flush(self) -> None:
        """Do nothing, because nothing is buffered."""


class McapFile:
    """The writer of one log, for use by one thread at a time."""

    def __init__(self, file: RawIOBase, robot: Robot, period: float, epoch: int = 0) -> None:
        """Begin a log."""
        # file: output, opened without buffer, closed by the caller; period: period of a cycle [s]; epoch: times of the
        # log minus given times [ns]
        import xarray  # noqa: F401 — loaded here, before the machine moves
        from foxglove_schemas_protobuf.FrameTransform_pb2 import FrameTransform
        from foxglove_schemas_protobuf.SceneUpdate_pb2 import SceneUpdate
        from mcap.writer import Writer
        from mcap_protobuf.schema import register_schema

        self.epoch = epoch
        self._scene = mcap_layout.Scene(robot)
        self._plans = 0
        self._blocks = 0
        output: Any = _Unbuffered(file)
        writer: Any = Writer(output, chunk_size=_UNLIMITED, enable_data_crcs=True)  # Any: the library is partly typed
        self._writer = writer
        writer.start(library=mcap_layout.SOURCE)
        self._attach(mcap_layout.HEAD, mcap_layout.JSON, mcap_layout.head_of(dump_robot(robot), period))
        kinds: dict[str, tuple[str, int]] = {mcap_layout.RECORD: (mcap_layout.PACKED, 0)}
        kinds |= {
            topic: ("json", writer.register_schema(topic[1:], "jsonschema", text))
            for topic, text in mcap_layout.SCHEMAS.items()
        }
        for topic, message in ((mcap_layout.TF, FrameTransform), (mcap_layout.SCENE, SceneUpdate)):
            kinds[topic] = ("protobuf", register_schema(writer, message))
        self._channels = {topic: writer.register_channel(topic, *kind) for topic, kind in kinds.items()}

    def begin(self, plan: Plan) -> int:
        """Write a plan as an attachment. Returns the index of the plan."""
        number, self._plans = self._plans, self._plans + 1
        self._attach(mcap_layout.PLAN.format(number), mcap_layout.PACKED, pack_dataset(plan_dataset(plan)))
        return number

    def end(self, number: int, status: str, reason: str) -> None:
        """Write the end of the plan with the index `number` as an attachment."""
        name = mcap_layout.END.format("none" if number == NONE else number)
        self._attach(name, mcap_layout.JSON, json.dumps({"status": status, "reason": reason}).encode())

    def block(self, columns: Mapping[str, NDArray[Any]], plan: int, zero: Array, rest: Callable[[], Any] = int) -> None:
        """Write cycles of `plan` (`NONE`: no plan) and the homing offset `zero` [m]; call `rest` between messages."""
        stamps = [self.stamp(value) for value in columns["time"].tolist()]
        kept = {**columns, "plan": np.array(plan), "zero": zero, "epoch": np.array(self.epoch)}
        for stamp, text in zip(stamps, mcap_layout.cycle_texts(kept), strict=True):
            self._message(mcap_layout.CYCLE, stamp, text)
            rest()
        for stamp, row in self._known(columns, stamps, mcap_layout.SHARE_TF):
            pose = mcap_layout.transform(stamp, row["position"], row["quaternion"])
            self._message(mcap_layout.TF, stamp, pose.SerializeToString())
        for stamp, row in self._known(columns, stamps, mcap_layout.SHARE_SCENE):
            rest()
            self._message(mcap_layout.SCENE, stamp, self._scene.at(stamp, **row).SerializeToString())
        last = stamps[-1] if stamps else self.epoch
        self._message(mcap_layout.RECORD, last, pack(kept, mcap_layout.DECIMALS, rest), self._blocks)
        self._blocks += 1

    def event(self, event: Event) -> None:
        """Write an event."""
        said = {**event._asdict(), "kind": event.kind.value, "state": event.state.name}
        self._message(mcap_layout.EVENT, self.stamp(event.time), mcap_layout.message_of(said))

    def truth(self, time: float, position: Array, quaternion: Array) -> None:
        """Write the true pose of the platform at the time `time` [s]."""
        said = {"time": time, "position": position.tolist(), "quaternion": quaternion.tolist()}
        self._message(mcap_layout.TRUTH, self.stamp(time), mcap_layout.message_of(said))

    def close_chunk(self) -> None:
        """Write the current chunk to the file."""
        self._writer.flush()

    def finish(self) -> None:
        """Write the end of the log; nothing can be written afterwards."""
        self._writer.finish()

    def stamp(self, time: float) -> int:
        """Log time [ns] of a time [s]."""
        return self.epoch + round(time * mcap_layout.NANO)

    def _attach(self, name: str, kind: str, data: bytes) -> None:
        self._writer.flush()
        self._writer.add_attachment(0, self.epoch, name, kind, data)

    def _message(self, topic: str, stamp: int, data: bytes, number: int = 0) -> None:
        self._writer.add_message(self._channels[topic], stamp, data, stamp, number)

    @staticmethod
    def _known(
        columns: Mapping[str, NDArray[Any]], stamps: list[int], share: int
    ) -> list[tuple[int, dict[str, Array]]]:
        """Time stamp, pose and tensions of one in `share` cycles. Cycles without an estimated pose are left out."""
        names = ("position", "quaternion", "tension")
        known = np.flatnonzero(np.isfinite(columns["position"]).all(axis=1))
        return [(stamps[k], {name: columns[name][k] for name in names}) for k in known[::share].tolist()]


def check_packages() -> None:
    """Check that the packages for logs are installed."""
    for name in PACKAGES:
        if find_spec(name) is None:
            raise FileError.not_installed(name, "Logs need it", "log")


class Recorder:
    """Recording of a log: a separate thread writes the file while a controller or a twin runs."""

    # Data are put into a queue, so that the caller never waits for a disk. If the queue or the disk is full, recording
    # stops permanently. The attribute `stopped` then gives the reason, and the file keeps the data written so far.
    # Numbers are rounded to the numbers of decimals in `DECIMALS`.

    def __init__(
        self,
        file: os.PathLike[str] | str,
        robot: Robot,
        *,
        period: float = PERIOD,
        epoch: int | None = None,
        stream: RawIOBase | None = None,
    ) -> None:
        """Open the file and start the thread."""
        # file: for example "run.mcap"; an existing regular file is replaced, any other target is refused. robot: the
        # robot used by the controller. period: period of a cycle [s]. epoch: time of the log minus time of the link's
        # clock [ns]; None: the log starts at the current date and time. stream: unbuffered output that is used instead
        # of the file
        self.file = check_file(file_path(file))
        check_packages()
        self._robot, self._period = instance(robot, Robot, "robot"), period
        self._groups = len(groups_of(robot.cable_count))
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
        """Reason why recording has stopped; "" while it continues."""
        return self._why

    def begins(self, plan: Plan) -> None:
        """Record a plan; call it before the first cycle of the plan."""
        self._put(partial(self._begin, plan))

    def ends(self, status: Status, reason: str) -> None:
        """Record the end of the plan; call it after the last cycle of the plan."""
        self._put(partial(self._end, status.name, reason))

    def cycle(self, cycle: Recorded) -> None:
        """Record a cycle."""
        self._date(cycle.answer.time)
        self._put(partial(self._add, cycle))

    def event(self, event: Event) -> None:
        """Record an event. Events before the first cycle are written later, when the start time of the log is known."""
        if self._epoch is None:
            self._early.append(event)
        else:
            self._put(partial(self._mcap.event, event))

    def truth(self, time: float, position: Array, quaternion: Array) -> None:
        """Record the true pose of the platform at a time [s]; position and quaternion are copied."""
        self._date(time)
        self._put(partial(self._mcap.truth, time, position.copy(), quaternion.copy()))

    def close(self) -> None:
        """Write the queued data and the end of the log; wait until this is done."""
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
        """Enter the block of a `with` statement; the log is closed at the end of the block."""
        return self

    def __exit__(self, *failure: object) -> None:
        """Close the log."""
        self.close()

    def _put(self, task: Callable[[], None]) -> None:
        if self._why:
            return
        try:
            self._queue.put_nowait(task)
        except Full:
            self._why = f"{self.file}: {ROOM} entries wait to be written, and the queue is full; the disk is too slow"

    def _date(self, time_of_link: float) -> None:
        """Set the start time of the log, so that times in the log are dates and times of day."""
        if self._epoch is None:
            self._epoch = self._mcap.epoch = time.time_ns() - round(time_of_link * mcap_layout.NANO)
            for event in self._early:
                self._put(partial(self._mcap.event, event))

    def _run(self) -> None:
        """Write queued data until the end; the function of the thread."""
        try:
            with self._stream:
                self._write()
                self._mcap.finish()
        except OSError as error:
            self._why = f"{self.file}: cannot be written ({_reason(error)})"
        except Exception as error:  # any error: the control loop must continue; the operator receives a message
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
            late = time.monotonic() >= due and self._queue.empty()  # queued data are added to the chunk first
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
        if not len(self._tape):
            return
        none = ExecutionStatus.UNKNOWN
        cycles = execution_of(self._tape, self._robot, None, none, "", self._period, self._zero, ())
        columns = mcap_layout.columns_of(cycles)
        columns |= {name: round_decimals(columns[name], decimals) for name, decimals in mcap_layout.DECIMALS.items()}
        columns["degraded"] = np.array(self._degraded)
        self._mcap.block(columns, self._plan, self._zero, partial(time.sleep, 0.0))
        self._tape, self._degraded = self._blank(), []

    def _blank(self) -> CycleTable:
        return CycleTable(self._robot.cable_count, self._groups, BLOCK)


def _reason(error: OSError) -> str:
    return error.strerror or type(error).__name__
