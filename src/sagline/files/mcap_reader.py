"""Reading of MCAP logs: complete logs, logs that a killed process left incomplete, and logs that still grow."""

from __future__ import annotations

import json
import os
import re
import struct
import zlib
from collections.abc import Iterator
from io import BytesIO
from typing import Any, Final

from numpy.typing import NDArray

from sagline.control.recording import Event, EventKind
from sagline.control.states import State
from sagline.core.arguments import check_memory, file_path
from sagline.core.errors import FileError
from sagline.files.mcap_layout import END, EVENT, EVERY, FORMAT, HEAD, PLAN, RECORD, TRUTH
from sagline.files.mcap_writer import check_packages
from sagline.files.netcdf import check_version
from sagline.files.packed import unpack
from sagline.files.reading import check_regular, system_errors, value_errors
from sagline.files.robot_file import parse_robot
from sagline.robot.robot import Robot

MAGIC: Final = bytes((137, 77, 67, 65, 80, 48, 13, 10))
AGAIN: Final = "Get the original file."
_HEAD: Final = 9  # number of bytes before the content of a record: its type and its length
_CHUNK, _ATTACHMENT, _DATA_END = 0x06, 0x09, 0x0F
_NEEDED: Final = {quantity.name for quantity in EVERY} | {"plan", "zero", "epoch"}  # columns required in every chunk
_INFLATION: Final = 100  # largest ratio of uncompressed to compressed size of a chunk; usual ratios are 1.5 to 10
_SMALL: Final = 1 << 16  # a chunk of this size [bytes] is always allowed
_LARGEST: Final = 1 << 24  # largest size of the packed cycles of a chunk [bytes]; the usual size is a hundredth
_SCHEMA, _CHANNEL, _MESSAGE = 0x03, 0x04, 0x05
_MESSAGE_HEAD: Final = struct.Struct("<HIQQ")  # channel, sequence number, two times
_PLAN_NAME, _END_NAME = (re.compile(name.replace(".", r"\.").format(r"(\d+|none)")) for name in (PLAN, END))


class LogReader:
    """Reader of a log that may still grow, with the content of the log as far as it has been read."""

    def __init__(self, file: os.PathLike[str] | str) -> None:
        """Store the path of the file. The method `more` reads the file."""
        self.path = file_path(file)
        check_packages()
        self.robot: Robot | None = None  # None until it has been read
        self.period = 0.0  # period of a cycle [s]
        self.plans: list[bytes] = []  # the plans, packed
        # end of each plan by the plan's index (-1: no plan): name of its `ExecutionStatus`, and the reason in one line
        self.endings: dict[int, tuple[str, str]] = {}
        self.blocks: list[dict[str, NDArray[Any]]] = []  # columns of cycles, for each chunk
        self.events: list[Event] = []  # in order
        # true poses of the platform, in the log of a twin: time on the log's clock [ns], position [m], quaternion
        self.truth: list[tuple[int, list[float], list[float]]] = []
        self.epoch = 0  # zero of the log's clock [ns]
        self.complete = False  # True if the end of the log has been read
        self._offset = self._digest = 0
        self._topics: dict[int, str] = {}

    def more(self) -> bool:
        """Read the records added since the last call; returns True if there are new records."""
        before, data = self._offset, self._bytes()
        if not before:
            self._check_kind(data)
        try:
            for code, record in self._records(data):
                self._take(code, record)
        except (FileError, MemoryError):
            raise
        except Exception as error:  # any error is caught, because the libraries have no common error for damaged files
            raise self._damaged() from error
        torn = self._offset - before < len(data) and not self.complete
        if torn and data.endswith(MAGIC) and len(data) > len(MAGIC):
            raise self._damaged()
        return self._offset > before

    def _bytes(self) -> bytes:
        path = self.path
        with system_errors(path), value_errors(path):
            status = path.stat()
            check_regular(path, status.st_mode)
            if status.st_size < self._offset:
                raise FileError(path, "has become shorter while it was read", "Read it again; it was restarted.")
            check_memory(f"{path.name}", 2.0 * (status.st_size - self._offset), "Give a shorter log.")
            with path.open("rb") as file:
                file.seek(self._offset)
                return file.read(status.st_size - self._offset)

    def _check_kind(self, data: bytes) -> None:
        if data[: len(MAGIC)] == MAGIC:
            return
        if MAGIC.startswith(data):  # the file contains at most the first few bytes
            raise FileError(self.path, "is empty", "It contains no data, or it was cut off at its start.")
        step = "Give a recorded .mcap file, or one of Execution.save."
        raise FileError(self.path, "is not a log in MCAP", step)

    def _records(self, data: bytes) -> Iterator[tuple[int, bytes]]:
        """Read all complete records; an incomplete last record is left for the next call."""
        place = 0 if self._offset else len(MAGIC)
        start = self._offset
        if not start:
            self._advance(data[:place])
        while not self.complete and place + _HEAD <= len(data):
            end = place + _HEAD + int.from_bytes(data[place + 1 : place + _HEAD], "little")
            if end > len(data):
                return
            code, record = data[place], data[place:end]
            if code == _DATA_END:
                said = int.from_bytes(record[_HEAD : _HEAD + 4], "little")
                if said and said != self._digest:
                    raise ValueError("wrong digest")
                self.complete = True
            yield code, record
            self._advance(record)
            place = end

    def _advance(self, read: bytes) -> None:
        self._offset += len(read)
        self._digest = zlib.crc32(read, self._digest)

    def _take(self, code: int, record: bytes) -> None:
        if code not in (_CHUNK, _ATTACHMENT) or (code == _CHUNK and self.robot is None):
            return  # a sagline log begins with its robot
        from mcap.records import Attachment, Chunk
        from mcap.stream_reader import StreamReader

        found = next(iter(StreamReader(BytesIO(record), skip_magic=True, emit_chunks=True).records))
        if isinstance(found, Attachment):
            if zlib.crc32(record[_HEAD:-4]) != int.from_bytes(record[-4:], "little"):
                raise ValueError("wrong digest")
            self._attached(found.name, found.log_time, found.data)
        elif isinstance(found, Chunk):
            self._take_chunk(_content_of(found))

    def _take_chunk(self, data: bytes) -> None:
        from mcap.data_stream import ReadDataStream
        from mcap.records import Channel

        place = 0
        while place < len(data):
            code, first = data[place], place + _HEAD
            place = first + int.from_bytes(data[place + 1 : first], "little")
            if code not in (_SCHEMA, _CHANNEL, _MESSAGE) or place > len(data):
                raise ValueError("a chunk with an unknown record")
            if code == _CHANNEL:
                channel = Channel.read(ReadDataStream(BytesIO(data[first:place])))
                self._topics[channel.id] = channel.topic
            elif code == _MESSAGE:
                identity, number, stamp, _ = _MESSAGE_HEAD.unpack_from(data, first)
                self._message(self._topics[identity], stamp, number, data[first + _MESSAGE_HEAD.size : place])

    def _attached(self, name: str, epoch: int, data: bytes) -> None:
        if name == HEAD:
            self.epoch = epoch
            self._begin(json.loads(data))
        elif match := _PLAN_NAME.fullmatch(name):
            if int(match[1]) != len(self.plans):
                raise ValueError("a plan is missing")
            self.plans.append(data)
        elif match := _END_NAME.fullmatch(name):
            said = json.loads(data)
            self.endings[-1 if match[1] == "none" else int(match[1])] = said["status"], str(said["reason"])

    def _begin(self, said: dict[str, Any]) -> None:
        check_version(self.path, said["sagline_log_format"], FORMAT, said["source"])
        self.period = float(said["period"])
        self.robot = parse_robot(said["robot"], f"{self.path}, robot")

    def _message(self, topic: str, stamp: int, number: int, data: bytes) -> None:
        if self.robot is None:
            return
        if topic == RECORD:
            if number != len(self.blocks):
                raise ValueError("a chunk is missing")
            self.blocks.append(block := unpack(data, _LARGEST))
            if lacking := _NEEDED - block.keys():
                raise FileError(self.path, f"is inconsistent (no {min(lacking)})", AGAIN)
        elif topic == EVENT:
            self.events.append(_event_of(data))
        elif topic == TRUTH:
            said = json.loads(data)
            self.truth.append((stamp, said["position"], said["quaternion"]))

    def _damaged(self) -> FileError:
        return FileError(self.path, f"is damaged at byte {self._offset:,}", AGAIN)


def _event_of(text: bytes) -> Event:
    """Read the event of a message; raise ValueError if the message is not an event."""
    try:
        said = json.loads(text)
        kind, state = EventKind(said["kind"]), State[said["state"]]
        return Event(float(said["time"]), int(said["cycle"]), kind, str(said["name"]), state, str(said["text"]))
    except (KeyError, TypeError) as error:
        raise ValueError(f"no event ({error})") from None


def _content_of(chunk: Any) -> bytes:
    """Uncompress the records of a chunk. Raise ValueError if the records are too large for the compressed size."""
    from lz4.frame import LZ4FrameDecompressor
    from zstandard import ZstdDecompressor, get_frame_parameters

    data, said = chunk.data, chunk.uncompressed_size
    if said > _INFLATION * len(data) + _SMALL:
        raise ValueError("a chunk with a stated size that its bytes do not allow")
    if chunk.compression == "zstd":
        if get_frame_parameters(data).content_size != said:  # the libraries first allocate this size
            raise ValueError("a chunk with two sizes")
        data = ZstdDecompressor().decompress(data, allow_extra_data=False)
    elif chunk.compression == "lz4":
        data = LZ4FrameDecompressor().decompress(data, max_length=said + 1)
    elif chunk.compression:
        raise ValueError("a chunk compressed in an unknown way")
    if len(data) != said or (chunk.uncompressed_crc and zlib.crc32(data) != chunk.uncompressed_crc):
        raise ValueError("a chunk of another size, or with a wrong digest")
    return bytes(data)


def read_log(file: os.PathLike[str] | str) -> LogReader:
    """Read the content of a complete log, or of a log that was cut off."""
    log = LogReader(file)
    log.more()
    if log.robot is None and log.complete:
        raise FileError(log.path, "is an MCAP file, but not a log of sagline", "Check that this is the file you mean.")
    if log.robot is None:
        raise FileError(log.path, "was cut off before the data of its robot", "It cannot be read.")
    return log


def has_begun(file: os.PathLike[str] | str) -> bool:
    """True if the log that another process writes can be read: the file exists and has its first bytes."""
    try:
        path = file_path(file)
        check_regular(path, path.stat().st_mode)
        with path.open("rb") as stream:
            first = stream.read(len(MAGIC))
    except FileNotFoundError:
        return False
    except (FileError, OSError, ValueError):
        return True
    return first == MAGIC or not MAGIC.startswith(first)
