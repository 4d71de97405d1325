"""Commands and samples as blocks, and back."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Final

import numpy as np

from sagline.arrays import Array
from sagline.control.link import GROUP_SIZE, Command, Sample, Whole, groups_of
from sagline.plc.blocks import CLAIM, FROM_PLC, TO_PLC, winch_row

_HEAD: Final = ("counter", "owner", "echo", "status", "fault")
_WINCH: Final = ("length", "rate", "torque", "tension", "filtered", "counts", "state")  # and fault, as winch_fault


def claim_block(owner: int) -> bytes:
    """The block by which a controller asks for a grant.

    Args:
        owner: Its id; 0: nobody asks.
    """
    return CLAIM.pack({"owner": owner})


def command_blocks(command: Command) -> list[bytes]:
    """A command as the blocks of its groups.

    Args:
        command: Of all m winches.

    Returns:
        One block a group; the place of a winch that a last group does not have is zero.
    """
    head = {
        "counter": command.counter,
        "mode": int(command.mode),
        "owner": command.owner,
        "valid_for": round(1000.0 * command.valid_for),
    }
    names = ("length", "rate", "tension", "enable")
    columns = [getattr(command, name).tolist() for name in names]
    return [TO_PLC.pack(head | _winches(group, names, columns)) for group in groups_of(len(command.length))]


def sample_of(
    groups: Sequence[Mapping[str, Any]], *, winches: int, time: float, age: Array, discarded: Whole
) -> Sample:
    """What good blocks of all groups say.

    Args:
        groups: Values of `FROM_PLC` of each group, in their order.
        winches: How many there are, m.
        time: When it was asked [s].
        age: Of each block [s], shape (G,).
        discarded: How many of each group were no good so far, shape (G,).
    """

    def heads(name: str) -> Whole:
        return np.array([group[name] for group in groups], dtype=np.int64)

    def winch(name: str) -> list[Any]:
        rows = [winch_row(i, name) for i in range(GROUP_SIZE)]
        return [group[row] for group in groups for row in rows][:winches]

    return Sample(
        time=time,
        age=age,
        counter=heads("counter"),
        plc_time=np.array([1e-6 * group["time"] for group in groups]),
        owner=heads("owner"),
        echo=heads("echo"),
        status=heads("status"),
        fault=heads("fault"),
        length=np.array(winch("length"), dtype=np.float64),
        rate=np.array(winch("rate"), dtype=np.float64),
        torque=np.array(winch("torque"), dtype=np.float64),
        tension=np.array(winch("tension"), dtype=np.float64),
        filtered=np.array(winch("filtered"), dtype=np.float64),
        counts=np.array(winch("counts"), dtype=np.int64),
        state=np.array(winch("state"), dtype=np.int64),
        winch_fault=np.array(winch("fault"), dtype=np.int64),
        discarded=discarded,
    )


def sample_blocks(sample: Sample) -> list[bytes]:
    """A sample as the blocks of its groups: what the PLCs of a twin write.

    Args:
        sample: Of all m winches.

    Returns:
        One block a group.
    """
    names = (*_WINCH, "fault")
    columns = [getattr(sample, name).tolist() for name in (*_WINCH, "winch_fault")]
    heads = [getattr(sample, name).tolist() for name in (*_HEAD, "plc_time")]
    blocks = []
    for i, (group, *head, time) in enumerate(zip(groups_of(len(sample.length)), *heads, strict=True)):
        values = {"group": i + 1, "winches": len(group), "time": 1e6 * time, **dict(zip(_HEAD, head, strict=True))}
        blocks.append(FROM_PLC.pack(values | _winches(group, names, columns)))
    return blocks


def _winches(group: Sequence[int], names: Sequence[str], columns: Sequence[Sequence[float]]) -> dict[str, float]:
    """The rows of a group's winches, of columns over all winches."""
    return {
        winch_row(i, name): column[winch]
        for i, winch in enumerate(group)
        for name, column in zip(names, columns, strict=True)
    }
