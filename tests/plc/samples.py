"""Samples and commands for transmission."""

from __future__ import annotations

import struct
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sagline.control import Command, Mode, Sample
from sagline.core.arrays import Array


def a_sample(winches: int, seed: int = 0, **values: Any) -> Sample:
    """A sample of random values that are exact in single precision."""
    random = np.random.default_rng(seed)
    groups = -(-winches // 2)

    def whole(count: int, most: int) -> NDArray[np.int64]:
        return random.integers(0, most, count)

    def real(count: int) -> Array:
        return random.normal(scale=100.0, size=count).astype(np.float32).astype(np.float64)

    sample = Sample(
        time=1.5,
        age=np.zeros(groups),
        counter=whole(groups, 2**31 - 1),
        plc_time=whole(groups, 10**9) / 1024.0,
        owner=whole(groups, 2**31 - 1),
        echo=whole(groups, 2**31 - 1),
        status=whole(groups, 128),
        fault=whole(groups, 7),
        length=random.normal(size=winches),
        rate=real(winches),
        torque=real(winches),
        tension=real(winches),
        filtered=real(winches),
        counts=whole(winches, 2**32) - 2**31,
        state=whole(winches, 5),
        winch_fault=whole(winches, 65536),
        discarded=np.zeros(groups, dtype=np.int64),
    )
    return sample._replace(**values)


def sample_blocks(sample: Sample) -> list[bytes]:
    """Blocks of the groups packed by hand, an independent reference of the layout."""
    blocks = []
    for g, (counter, owner, echo) in enumerate(zip(sample.counter, sample.owner, sample.echo, strict=True)):
        winches = range(2 * g, min(2 * g + 2, len(sample.length)))
        head = struct.pack(">I4sHHdII", counter, b"SAGF", 1, g + 1, 1e6 * sample.plc_time[g], owner, echo)
        head += struct.pack(">IHH", sample.status[g], sample.fault[g], len(winches))
        for i in winches:
            forces = sample.torque[i], sample.tension[i], sample.filtered[i]
            whole = sample.counts[i], sample.state[i], sample.winch_fault[i]
            head += struct.pack(">dffffiHH", sample.length[i], sample.rate[i], *forces, *whole)
        blocks.append(head.ljust(100, b"\0") + struct.pack(">I", counter))
    return blocks


def a_command(winches: int, seed: int = 0, **values: Any) -> Command:
    """A command with random set points."""
    random = np.random.default_rng(seed)
    rate, tension = (np.float32(random.normal(size=winches)).astype(float) for _ in range(2))
    enable = random.random(winches) < 0.5
    command = Command(2**31 - 1, 77, Mode.FOLLOW, 0.1, random.normal(size=winches), rate, tension, enable)
    return command._replace(**values)


def status(counter: int, owner: int = 0) -> Sample:
    return a_sample(8, counter=np.full(4, counter), owner=np.full(4, owner))


def bad(counter: int, spoil: Callable[[bytearray], None]) -> list[bytes]:
    """Valid blocks, except that of the third group."""
    blocks = sample_blocks(status(counter))
    content = bytearray(blocks[2])
    spoil(content)
    return [*blocks[:2], bytes(content), blocks[3]]


def torn(content: bytearray) -> None:
    content[103] ^= 1


def foreign(content: bytearray) -> None:
    content[4] ^= 1


def of_another_version(content: bytearray) -> None:
    content[9] ^= 2


def of_another_group(content: bytearray) -> None:
    content[11] = 1


def repeated(content: bytearray) -> None:
    content[:] = sample_blocks(status(10))[2]


def older(content: bytearray) -> None:
    content[:] = sample_blocks(status(9))[2]
