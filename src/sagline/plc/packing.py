"""Commands and samples as blocks, and back."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from sagline.control.link import GROUP_SIZE, Command, Sample, Whole, groups_of
from sagline.core.arrays import Array
from sagline.plc.blocks import CLAIM, TO_PLC, winch_row


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
    return [
        TO_PLC.pack(head | winch_rows(names, [column[group[0] : group[-1] + 1] for column in columns]))
        for group in groups_of(len(command.length))
    ]


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


def winch_rows(names: Sequence[str], columns: Sequence[Sequence[Any]]) -> dict[str, Any]:
    """Values of a group's winches by name of the row.

    Args:
        names: Of what there is of each winch ("length").
        columns: The values of each of these, one a winch.
    """
    return {
        winch_row(i, name): value for name, column in zip(names, columns, strict=True) for i, value in enumerate(column)
    }
