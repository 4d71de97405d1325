"""Samples and commands to be sent about."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from sagline.arrays import Array
from sagline.control.link import Command, Mode, Sample


def a_sample(winches: int, seed: int = 0, **values: Any) -> Sample:
    """A sample of random values that single precision holds."""
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


def a_command(winches: int, seed: int = 0, **values: Any) -> Command:
    """A command of random set points."""
    random = np.random.default_rng(seed)
    rate, tension = (np.float32(random.normal(size=winches)).astype(float) for _ in range(2))
    enable = random.random(winches) < 0.5
    command = Command(2**31 - 1, 77, Mode.FOLLOW, 0.1, random.normal(size=winches), rate, tension, enable)
    return command._replace(**values)
