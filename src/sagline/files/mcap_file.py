"""A log in MCAP as it is written: chunk by chunk, so that what a chunk holds stays whatever becomes of the writer.

Everything stands in `/record`, a message a chunk with all numbers of its cycles packed; attachments have the robot and
the plans. The other topics are for people and their tools: `/cycle` and `/event` in JSON, `/tf` and `/scene` as
Foxglove draws them.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from importlib.util import find_spec
from io import RawIOBase
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from sagline.control.events import Event
from sagline.core.arrays import Array
from sagline.core.errors import FileError
from sagline.files.execution_layout import DECIMALS, NONE
from sagline.files.mcap_layout import (
    CYCLE,
    END,
    EVENT,
    HEAD,
    JSON,
    NANO,
    PACKED,
    PLAN,
    RECORD,
    SCENE,
    SCHEMAS,
    SHARE_SCENE,
    SHARE_TF,
    SOURCE,
    TF,
    TRUTH,
    cycle_texts,
    event_text,
    head_of,
    truth_text,
)  # fmt: skip
from sagline.files.mcap_scene import Scene, transform
from sagline.files.packed import pack
from sagline.files.packed_dataset import pack_dataset
from sagline.files.plan_file import plan_dataset
from sagline.files.robot_file import dump_robot
from sagline.kinematics.plan import Plan
from sagline.robot.robot import Robot

PACKAGES: Final = ("mcap", "mcap_protobuf", "foxglove_schemas_protobuf", "zstandard")
_UNLIMITED: Final = 1 << 40  # bytes: no chunk ends by its size


class _Unbuffered:
    """A file that has what was written to it: the library's writer would keep some of it."""

    def __init__(self, file: RawIOBase) -> None:
        self._file = file
        self._size = 0

    def write(self, data: bytes) -> int:
        """Write all of it.

        Raises:
            OSError: If the disk takes no more.
        """
        rest = memoryview(data)
        while rest:
            rest = rest[self._file.write(rest) or 0 :]
        self._size += len(data)
        return len(data)

    def tell(self) -> int:
        """How much there is."""
        return self._size

    def flush(self) -> None:
        """Nothing is kept back."""


class McapFile:
    """The writer of one log. Not for several threads at a time."""

    def __init__(self, file: RawIOBase, robot: Robot, period: float, epoch: int = 0) -> None:
        """Begin a log.

        Args:
            file: Where to; opened unbuffered, closed by whoever opened it.
            robot: The robot.
            period: Of a cycle [s].
            epoch: What is added to times for the log's own [ns].

        Raises:
            OSError: If the disk takes no more.
        """
        import xarray  # noqa: F401 — whatever is loaded is loaded here, before anything moves
        from foxglove_schemas_protobuf.FrameTransform_pb2 import FrameTransform
        from foxglove_schemas_protobuf.SceneUpdate_pb2 import SceneUpdate
        from mcap.writer import Writer
        from mcap_protobuf.schema import register_schema

        self.epoch = epoch
        self._scene = Scene(robot)
        self._plans = 0
        self._blocks = 0
        output: Any = _Unbuffered(file)
        writer: Any = Writer(output, chunk_size=_UNLIMITED, enable_data_crcs=True)  # Any: it is only partly typed
        self._writer = writer
        writer.start(library=SOURCE)
        self._attach(HEAD, JSON, head_of(dump_robot(robot), period))
        kinds: dict[str, tuple[str, int]] = {RECORD: (PACKED, 0)}
        kinds |= {
            topic: ("json", writer.register_schema(topic[1:], "jsonschema", text)) for topic, text in SCHEMAS.items()
        }
        for topic, message in ((TF, FrameTransform), (SCENE, SceneUpdate)):
            kinds[topic] = ("protobuf", register_schema(writer, message))
        self._channels = {topic: writer.register_channel(topic, *kind) for topic, kind in kinds.items()}

    def begin(self, plan: Plan) -> int:
        """Attach a plan; returns its number."""
        number, self._plans = self._plans, self._plans + 1
        self._attach(PLAN.format(number), PACKED, pack_dataset(plan_dataset(plan)))
        return number

    def end(self, number: int, status: str, reason: str) -> None:
        """Attach how a plan ended."""
        self._attach(
            END.format("none" if number == NONE else number),
            JSON,
            json.dumps({"status": status, "reason": reason}).encode(),
        )

    def block(self, columns: Mapping[str, NDArray[Any]], plan: int, zero: Array, rest: Callable[[], Any] = int) -> None:
        """Write cycles.

        Args:
            columns: What there is of them.
            plan: Number of the plan they are of, `NONE` for none.
            zero: Of homing [m], shape (m,).
            rest: Called between two messages, for a thread that should let others go on.
        """
        stamps = self._stamps(columns["time"])
        kept = {**columns, "plan": np.array(plan), "zero": zero, "epoch": np.array(self.epoch)}
        for stamp, text in zip(stamps, cycle_texts(kept), strict=True):
            self._message(CYCLE, stamp, text)
            rest()
        for stamp, row in self._known(columns, stamps, SHARE_TF):
            self._message(TF, stamp, transform(stamp, row["position"], row["quaternion"]).SerializeToString())
        for stamp, row in self._known(columns, stamps, SHARE_SCENE):
            rest()
            self._message(SCENE, stamp, self._scene.at(stamp, **row).SerializeToString())
        self._message(RECORD, stamps[-1] if stamps else self.epoch, pack(kept, DECIMALS, rest), self._blocks)
        self._blocks += 1

    def event(self, event: Event) -> None:
        """Write an event."""
        self._message(EVENT, self.stamp(event.time), event_text(event))

    def truth(self, time: float, position: Array, quaternion: Array) -> None:
        """Write where the platform really is."""
        self._message(TRUTH, self.stamp(time), truth_text(time, position, quaternion))

    def close_chunk(self) -> None:
        """Have everything so far in the file."""
        self._writer.flush()

    def finish(self) -> None:
        """Write the end; nothing comes after it."""
        self._writer.finish()

    def stamp(self, time: float) -> int:
        """The log's own time of a time [s]."""
        return self.epoch + round(time * NANO)

    def _stamps(self, time: Array) -> list[int]:
        return [self.stamp(value) for value in time.tolist()]

    def _attach(self, name: str, kind: str, data: bytes) -> None:
        self._writer.flush()
        self._writer.add_attachment(0, self.epoch, name, kind, data)

    def _message(self, topic: str, stamp: int, data: bytes, number: int = 0) -> None:
        self._writer.add_message(self._channels[topic], stamp, data, stamp, number)

    @staticmethod
    def _known(
        columns: Mapping[str, NDArray[Any]], stamps: list[int], share: int
    ) -> list[tuple[int, dict[str, Array]]]:
        """Every so manieth cycle with an estimate: its stamp, pose and tensions."""
        names = ("position", "quaternion", "tension")
        known = np.flatnonzero(np.isfinite(columns["position"]).all(axis=1))
        return [(stamps[k], {name: columns[name][k] for name in names}) for k in known[::share].tolist()]


def check_packages() -> None:
    """Find out that the packages of the logs are there.

    Raises:
        FileError: If one is not; it says how to have it.
    """
    for name in PACKAGES:
        if find_spec(name) is None:
            raise FileError.not_installed(name, "Logs need it", "log")
