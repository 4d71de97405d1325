"""Blocks: offsets, bytes, and errors of foreign bytes."""

from __future__ import annotations

import struct

import numpy as np
import pytest

from sagline.plc.blocks import (
    BLOCKS,
    CLAIM,
    FROM_PLC,
    TO_PLC,
    TYPES,
    Block,
    command_blocks,
    sample_of,
)
from tests.plc.protocol import Refusal
from tests.plc.samples import a_command, a_sample, sample_blocks


def test_sizes_are_those_of_the_protocol() -> None:
    assert [(block.number, block.size, block.packer.size) for block in BLOCKS] == [
        (101, 104, 104),
        (102, 64, 64),
        (103, 8, 8),
    ]


@pytest.mark.parametrize("block", BLOCKS, ids=lambda block: block.name)
def test_rows_have_no_gap_and_no_overlap(block: Block) -> None:
    at = 0
    for name, kind, offset in block.rows:
        assert offset == at, name
        assert offset % 2 == 0, name  # every value of a standard block begins at a word
        at += struct.calcsize(f">{TYPES[kind]}")
    assert at == block.size


def test_bytes_of_a_command_and_a_claim_are_at_their_offsets() -> None:
    command = a_command(8)
    data = command_blocks(command)[3]
    assert data[4:8] == b"SAGT"
    assert struct.unpack_from(">I", data, 0) == struct.unpack_from(">I", data, 60) == (2**31 - 1,)
    assert struct.unpack_from(">HHIi", data, 8) == (1, 2, 77, 100)
    for winch, offset in ((6, 20), (7, 40)):
        expected = command.length[winch], command.rate[winch], command.tension[winch], int(command.enable[winch])
        assert struct.unpack_from(">dffI", data, offset) == expected
    assert CLAIM.pack({"owner": 77}) == b"SAGC" + struct.pack(">I", 77)


@pytest.mark.parametrize("winches", [1, 2, 7, 8])
def test_a_sample_is_unpacked_exactly(winches: int) -> None:
    sample = a_sample(winches, seed=winches)
    groups = [read for block in sample_blocks(sample) if not isinstance(read := FROM_PLC.read(block), Refusal)]
    assert groups[-1]["winches"] == 2 - winches % 2
    back = sample_of(groups, winches=winches, time=1.5, age=sample.age, discarded=sample.discarded)
    for name, value in sample._asdict().items():
        assert np.asarray(getattr(back, name)).dtype == np.asarray(value).dtype, name
        # microseconds and seconds: one rounding in each direction
        np.testing.assert_allclose(getattr(back, name), value, rtol=1e-15 if name == "plc_time" else 0.0, err_msg=name)


def test_bytes_of_missing_winches_are_zero() -> None:
    assert command_blocks(a_command(7))[3][40:60] == bytes(20)


def spoiled(block: Block, seed: int) -> tuple[bytes, str]:
    """A block with one error, and a word of the message."""
    random = np.random.default_rng(seed)
    data = bytearray(block.pack({"counter": 5, "owner": 9}))
    kind = ["size", "magic", "version", "torn"][seed % 4 if block is not CLAIM else seed % 2]
    if kind == "size":
        return bytes(data)[: random.integers(0, block.size)] + bytes(random.integers(0, 2) * 200), "bytes instead of"
    offset = {name: at for name, _, at in block.rows}[
        {"magic": "magic", "version": "version", "torn": random.choice(["counter", "counter_again"])}[kind]
    ]
    data[offset + random.integers(0, 2)] ^= random.integers(1, 256)
    return bytes(data), {"magic": "another program", "version": "layout", "torn": "torn"}[kind]


@pytest.mark.parametrize("block", BLOCKS, ids=lambda block: block.name)
def test_errors_are_reported_in_one_line_with_a_next_step(block: Block) -> None:
    for seed in range(40):
        data, said = spoiled(block, seed)
        refusal = block.read(data)
        assert isinstance(refusal, Refusal)
        assert said in refusal.reason
        assert refusal.reason.startswith(f"DB{block.number} ")
        text = f"{refusal.reason}. {refusal.next_step}"
        assert len(text) < 260
        assert text.isprintable()


def test_random_bytes_are_no_block() -> None:
    random = np.random.default_rng(3)
    for _ in range(200):
        for block in (FROM_PLC, TO_PLC, CLAIM):
            assert isinstance(block.read(random.bytes(block.size)), Refusal)
