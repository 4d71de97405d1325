"""Logs that are damaged, foreign or of another version: an error or the recorded data, never other numbers."""

import json
import struct
import time
import tracemalloc
import warnings
from collections.abc import Callable
from io import BytesIO
from pathlib import Path
from typing import Any

import lz4.frame
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mcap.writer import CompressionType, Writer
from syrupy.assertion import SnapshotAssertion
from zstandard import compress

import sagline as sl
from sagline.control import Execution
from sagline.files.execution_file import save_execution
from sagline.files.mcap_layout import HEAD, JSON, RECORD, columns_of, head_of
from sagline.files.packed import pack
from tests.abuse.damage import DAMAGES, LONGEST, SLOWEST, Damage
from tests.files.executions import execution
from tests.files.test_mcap import assert_same
from tests.tiers import extended, wide

CUT = 20_000  # bytes at the end of the log that a killed process does not write


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    file = tmp_path_factory.mktemp("log") / "run.mcap"
    save_execution(execution(), file)
    return file.read_bytes()


def read(file: Path) -> tuple[Execution | None, bool]:
    """Content of the file, if it is not refused in one line, and True if the reader reports a missing end."""
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        try:
            done = sl.load_execution(file)
        except sl.SaglineError as error:
            line = str(error).replace(str(file), file.name)
            assert line.isprintable(), line
            assert len(line) < LONGEST, line
            return None, False
    assert all(issubclass(one.category, sl.SaglineWarning) for one in told), told
    return done, bool(told)


def assert_begins(done: Execution) -> None:
    """The content is the beginning of the recorded data."""
    whole = columns_of(execution())
    for name, values in columns_of(done).items():
        assert values.tobytes() == whole[name][: len(done)].tobytes(), name


@pytest.mark.parametrize("count", [12, pytest.param(3000, marks=pytest.mark.soak)])
@pytest.mark.parametrize("killed", wide([False, True]))
@pytest.mark.parametrize("damage", wide(DAMAGES), ids=lambda damage: damage.__name__)
def test_damage_gives_an_error_or_the_recorded_data(
    whole: bytes, tmp_path: Path, damage: Damage, killed: bool, count: int
) -> None:
    rng = np.random.default_rng(21)
    file = tmp_path / "run.mcap"
    for k in range(count):
        content = bytearray(whole[:-CUT] if killed else whole)
        damage(content, rng)
        file.write_bytes(content)
        start = time.process_time()
        done, was_cut = read(file)
        assert time.process_time() - start < SLOWEST, k
        if done is None:
            continue
        if was_cut:
            assert_begins(done)
        else:
            assert not killed, k
            assert_same(done, execution())


@extended
def test_all_whole_chunks_of_a_truncated_log_are_read(whole: bytes, tmp_path: Path) -> None:
    lengths = []
    for size in range(0, len(whole), 9001):
        (tmp_path / "run.mcap").write_bytes(whole[:size])
        done, was_cut = read(tmp_path / "run.mcap")
        if done is not None:
            assert_begins(done)
            assert was_cut or len(done) == 201  # only the index is missing
        lengths.append(0 if done is None else len(done))
    assert lengths == sorted(lengths)
    assert set(lengths) >= {0, 100}


def log_of(*attachments: tuple[str, bytes], topic: str = "", message: bytes = b"", **options: object) -> bytes:
    """An MCAP file with invalid content."""
    stream = BytesIO()
    writer: Any = Writer(stream, **options)  # type: ignore[arg-type]  # Any: it is only partly typed
    writer.start()
    for name, data in attachments:
        writer.add_attachment(0, 0, name, JSON, data)
    if topic:
        channel = writer.register_channel(topic, "json", 0)
        writer.add_message(channel, 0, message, 0)
    writer.finish()
    return stream.getvalue()


def head(**changes: object) -> tuple[str, bytes]:
    return HEAD, json.dumps(json.loads(head_of(sl.dump_robot(execution().robot), 0.01)) | changes).encode()


def columns(**changes: object) -> bytes:
    done = {**columns_of(execution()), "zero": np.zeros(8), "plan": np.array(-1), "epoch": np.array(0)} | changes
    return pack({name: values for name, values in done.items() if values is not None})  # type: ignore[misc]


FOREIGN = {
    "foreign": log_of(topic="/imu", message=b"{}"),
    "foreign, packed otherwise": log_of(topic="/imu", message=b"{}", compression=CompressionType.NONE),
    "empty": log_of(),
    "no cycle": log_of(head()),
    "newer": log_of(head(sagline_log_format=2, source="sagline 9.0")),
    "no robot": log_of((HEAD, b'{"sagline_log_format":1,"period":0.01}')),
    "no head": log_of((HEAD, b"[1]")),
    "head that is no text": log_of((HEAD, b"\xff\xfe")),
    "a robot that is none": log_of(head(robot="name: x\n")),
    "a chunk of other numbers": log_of(head(), topic=RECORD, message=b"no columns"),
    "a quantity is missing": log_of(head(), topic=RECORD, message=columns(tension=None)),
    "no clock of its own": log_of(head(), topic=RECORD, message=columns(epoch=None)),
    "a quantity of another shape": log_of(head(), topic=RECORD, message=columns(tension=np.zeros((201, 7)))),
    "a quantity of another type": log_of(head(), topic=RECORD, message=columns(counts=np.zeros((201, 8)))),
    "no such state": log_of(head(), topic=RECORD, message=columns(state=np.full(201, 99, dtype=np.int8))),
    "text": b"time,position\n0,1\n",
    "netcdf": b"\x89HDF\r\n\x1a\n" + bytes(99),
    "nothing": b"",
    "half a beginning": b"\x89MCA",
    "cut at once": log_of(head())[:30],
}


@pytest.mark.parametrize("name", FOREIGN)
def test_a_file_that_is_no_log_is_refused_in_one_line(tmp_path: Path, name: str, snapshot: SnapshotAssertion) -> None:
    (tmp_path / "run.mcap").write_bytes(FOREIGN[name])
    with pytest.raises(sl.FileError) as caught:
        sl.load_execution(tmp_path / "run.mcap")
    line = str(caught.value)
    assert line.isprintable()
    assert len(line) < LONGEST
    assert line.replace(str(tmp_path), "FOLDER") == snapshot


def chunks_of(content: bytes) -> list[tuple[int, int]]:
    """Offsets of the beginnings and ends of the chunks."""
    places, place = [], 8
    while content[place] != 0x0F:  # end of the data section
        end = place + 9 + int.from_bytes(content[place + 1 : place + 9], "little")
        places += [(place, end)] * (content[place] == 0x06)
        place = end
    return places


@pytest.mark.parametrize("which", [1, -1])
def test_a_missing_chunk_is_detected(whole: bytes, tmp_path: Path, which: int) -> None:
    """Detected by the digest of a complete log, and by the numbers of the chunks of a log without its end."""
    places = chunks_of(whole)
    first, end = places[which]
    (tmp_path / "run.mcap").write_bytes(whole[:first] + whole[end:])
    with pytest.raises(sl.FileError, match="at byte"):
        sl.load_execution(tmp_path / "run.mcap")
    if which == 1:
        (tmp_path / "run.mcap").write_bytes(whole[:first] + whole[end : places[-1][1]])
        with pytest.raises(sl.FileError, match="at byte"):
            sl.load_execution(tmp_path / "run.mcap")


def of_lz4(data: bytes) -> bytes:
    return lz4.frame.compress(data)  # type: ignore[no-any-return]


SQUEEZERS: dict[str, Callable[[bytes], bytes]] = {"zstd": compress, "lz4": of_lz4, "": bytes}


@extended
@pytest.mark.parametrize("kind", ["zstd", "lz4"])
@pytest.mark.parametrize("said", [3, 1 << 16, 1 << 28])
def test_an_impossible_chunk_size_allocates_no_memory(whole: bytes, tmp_path: Path, said: int, kind: str) -> None:
    assert_refused_at_once(whole, tmp_path, said, kind, SQUEEZERS[kind](bytes(1 << 28)))


MANY = struct.pack("<BQHIQQ", 5, 22, 0, 0, 0, 0)  # an empty message
ZEROS = bytes(1 << 20)


@pytest.mark.parametrize("kind", wide(list(SQUEEZERS)))
@pytest.mark.parametrize("content", [ZEROS, b"\x05" + ZEROS, MANY * 30_000, bytes(range(256)) * 4000], ids=range(4))
def test_an_empty_chunk_is_refused_at_once(whole: bytes, tmp_path: Path, kind: str, content: bytes) -> None:
    assert_refused_at_once(whole, tmp_path, len(content), kind, SQUEEZERS[kind](content))


@extended
def test_chunks_with_a_wrong_size_are_refused(whole: bytes, tmp_path: Path) -> None:
    @given(st.binary(max_size=300), st.integers(0, 1 << 40), st.sampled_from([*SQUEEZERS, "gzip"]))
    @settings(max_examples=60, deadline=None)
    def refused(content: bytes, said: int, kind: str) -> None:
        data = SQUEEZERS.get(kind, bytes)(content)
        assert_refused_at_once(whole, tmp_path, said if said != len(content) else said + 1, kind, data)

    refused()


def assert_refused_at_once(whole: bytes, tmp_path: Path, said: int, kind: str, data: bytes) -> None:
    """A log with a replaced first chunk is refused in limited time and memory."""
    head = struct.pack("<QQQII", 0, 1, said, 0, len(kind))
    body = head + kind.encode() + struct.pack("<Q", len(data)) + data
    before = whole[: whole.index(b"plan-0.sagline") - 29]  # the bytes before the record of the plan
    (tmp_path / "run.mcap").write_bytes(before + b"\x06" + struct.pack("<Q", len(body)) + body)
    start = time.process_time()
    tracemalloc.start()
    try:
        with pytest.raises(sl.FileError, match="is damaged"):
            sl.load_execution(tmp_path / "run.mcap")
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert peak < 5e7 + 4 * len(data)
    assert time.process_time() - start < SLOWEST
