"""A process that winds out cable at 5 mm/s until it is killed: `python -m tests.plc.follower ADDRESSES`."""

from __future__ import annotations

import sys

import numpy as np

from sagline.control import Command, Mode, Pace, Sample
from sagline.plc import S7Link
from tests.control.protocol import PERIOD

RATE = 0.005  # m/s
OWNER = 11


def main(addresses: str) -> None:
    link, pace, on = S7Link(addresses, 8, timeout=20.0), Pace(), np.ones(8, dtype=np.bool_)
    sample = link.exchange(None)
    assert isinstance(sample, Sample)
    begin, tension, moved = sample.length, sample.filtered, 0
    for counter in range(1, 10_000):
        pace.wait()
        mode = Mode.FOLLOW if moved or (sample.echo > 3).all() else Mode.HOLD
        moved += mode is Mode.FOLLOW
        length, rate = begin + RATE * PERIOD * moved, np.full(8, RATE if moved else 0.0)
        answer = link.exchange(Command(counter, OWNER, mode, 0.1, length, rate, tension, on))
        assert isinstance(answer, Sample)
        sample = answer
        if moved == 20:
            sys.stdout.write("moving\n")
            sys.stdout.flush()


if __name__ == "__main__":
    main(sys.argv[1])
