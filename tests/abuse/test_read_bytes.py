"""Files with changed bytes: flipped bits, parts removed, doubled and mixed, encodings, control characters."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from sagline import SaglineError
from tests.abuse.reading import READERS, judged, sound

Change = Callable[[np.random.Generator, bytes], bytes]
ENCODINGS = (
    "utf-8-sig",
    "utf-16",
    "utf-16-le",
    "utf-16-be",
    "utf-32",
    "utf-7",
    "latin-1",
    "cp1252",
    "cp037",
    "shift_jis",
)
PIECES = (
    *(b"\0", b"\x1b[2J", b"\x1b]0;x\x07", b"\x9b31m", b"\x7f", b"\r", b"\x85", b"\xff\xfe", b"\xef\xbb\xbf"),
    *(b"\xc0\x80", b"\xed\xa0\x80", b"&#27;", b"&#xD800;", b"&lt;", b"<![CDATA[", b"-->", b"<!--"),
    *(b'"', b"'", b"\\", b"\\ud800", b"\\x1b", b"\\U00110000", b"\t", b"\n", b"\n\n", b",", b";", b":", b": ", b"#"),
    *(b"%", b"&", b"*", b"!", b"|", b">", b"[", b"]", b"{", b"}", b"?", b"&a [*a]", b"<<: *a", b"!!python/name:x"),
    *(b"a" * 3000, b" " * 3000, b"[" * 3000, b"\n" * 3000, b"-" * 3000),
    *("\u202e", "\u2028", "\ufffe", "\U0010ffff", "e\u0301", "ä" * 300, "名" * 300, "\U0001f469\u200d\U0001f52c"),
)  # fmt: skip


def _place(rng: np.random.Generator, data: bytes) -> int:
    return int(rng.integers(len(data) + 1))


def _span(rng: np.random.Generator, data: bytes) -> tuple[int, int]:
    start = _place(rng, data)
    return start, min(len(data), start + int(rng.integers(1, 40)))


def bit(rng: np.random.Generator, data: bytes) -> bytes:
    at = int(rng.integers(len(data)))
    return data[:at] + bytes([data[at] ^ 1 << int(rng.integers(8))]) + data[at + 1 :]


def byte(rng: np.random.Generator, data: bytes) -> bytes:
    at = int(rng.integers(len(data)))
    return data[:at] + rng.bytes(1) + data[at + 1 :]


def cut_off(rng: np.random.Generator, data: bytes) -> bytes:
    return data[: _place(rng, data)]


def cut_out(rng: np.random.Generator, data: bytes) -> bytes:
    start, end = _span(rng, data)
    return data[:start] + data[end:]


def doubled(rng: np.random.Generator, data: bytes) -> bytes:
    start, end = _span(rng, data)
    return data[:end] + data[start:end] * int(rng.integers(1, 4)) + data[end:]


def moved(rng: np.random.Generator, data: bytes) -> bytes:
    start, end = _span(rng, data)
    rest = data[:start] + data[end:]
    at = _place(rng, rest)
    return rest[:at] + data[start:end] + rest[at:]


def mixed(rng: np.random.Generator, data: bytes) -> bytes:
    other = READERS[int(rng.integers(len(READERS)))].sample.encode()
    start, end = _span(rng, other)
    at = _place(rng, data)
    return data[:at] + other[start:end] + data[at:]


def pieced(rng: np.random.Generator, data: bytes) -> bytes:
    piece = PIECES[int(rng.integers(len(PIECES)))]
    at = _place(rng, data)
    return data[:at] + (piece if isinstance(piece, bytes) else piece.encode()) + data[at:]


def noise(rng: np.random.Generator, data: bytes) -> bytes:
    at = _place(rng, data)
    return data[:at] + rng.bytes(int(rng.integers(1, 60))) + data[at:]


def encoded(rng: np.random.Generator, data: bytes) -> bytes:
    text = data.decode("utf-8", "replace") + "ä" * int(rng.integers(2))
    return text.encode(ENCODINGS[int(rng.integers(len(ENCODINGS)))], "replace")


def line_ends(rng: np.random.Generator, data: bytes) -> bytes:
    return data.replace(b"\n", (b"\r\n", b"\r", b"\n\r", b"\x0b", b"\x0c", b" ")[int(rng.integers(6))])


CHANGES: tuple[Change, ...] = (
    bit, byte, cut_off, cut_out, doubled, moved, mixed, pieced, pieced, noise, encoded, line_ends,
)  # fmt: skip


@pytest.mark.parametrize("count", [270, pytest.param(10_000, marks=pytest.mark.soak)])
def test_files_with_any_bytes(count: int, tmp_path: Path) -> None:
    rng = np.random.default_rng(20260111)
    read = 0
    for k in range(count):
        reader = READERS[k % len(READERS)]
        data = reader.sample.encode()
        done = []
        for _ in range(int(rng.integers(1, 4))):
            change = CHANGES[int(rng.integers(len(CHANGES)))]
            data = change(rng, data) or b"x"
            done.append(change.__name__)
        what = f"case {k}: {reader.name}, {', '.join(done)}"
        found = judged(lambda: reader.read(reader.written(tmp_path, data)), what)  # noqa: B023
        if not isinstance(found, SaglineError):
            read += 1
            sound(found, what)
    assert 0 < read < count
