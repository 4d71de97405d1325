"""Data blocks between a PLC and a controller: one table defines them for packing, servers and SCL."""

from __future__ import annotations

import struct
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Final, NamedTuple

import numpy as np

from sagline.control.link import GROUP_SIZE, OF_WINCHES, REALS, Command, Refusal, Sample, Whole, groups_of
from sagline.core.arrays import Array

LAYOUT: Final = 1  # version of the blocks; incremented if an offset in the tables below changes
TYPES: Final = {  # format in `struct` of each SCL type; PLCs use big-endian order without gaps
    "DInt": "i",
    "DWord": "I",
    "LReal": "d",
    "Real": "f",
    "Time": "i",  # number of milliseconds per second
    "UDInt": "I",
    "UInt": "H",
}


class Field(NamedTuple):
    """One row of a block."""

    name: str  # name in packing and SCL
    # one of `TYPES`, or the rows of a structure. In the second case, the value is an array with one structure per
    # winch, with indices from 1.
    type: str | tuple[Field, ...]
    offset: int  # offset from the start of the block, or of the structure [bytes]
    meaning: str


@dataclass(frozen=True, eq=False)
class Block:
    """Data block with standard (not optimized) access. The rows define the offset of every byte."""

    number: int  # number of the data block in the PLC
    name: str  # name of the block in SCL
    magic: int  # value of its row `magic`
    register: int  # first Modbus holding register of the block
    size: int  # size of the whole block [bytes]
    fields: tuple[Field, ...]

    @cached_property
    def rows(self) -> tuple[tuple[str, str, int], ...]:
        """Name, type and offset of every plain value. The names of the values of a winch come from `_winch_row`."""
        rows: list[tuple[str, str, int]] = []
        for name, kind, offset, _ in self.fields:
            if isinstance(kind, str):
                rows.append((name, kind, offset))
                continue
            size = sum(_bytes(f.type) for f in kind)
            for i in range(GROUP_SIZE):
                rows += [(_winch_row(i, f.name), str(f.type), offset + i * size + f.offset) for f in kind]
        return tuple(rows)

    @cached_property
    def packer(self) -> struct.Struct:
        """Packer of the block from `struct`, with every row at its offset."""
        text, at = ">", 0
        for _, kind, offset in self.rows:
            text += "x" * (offset - at) + TYPES[kind]
            at = offset + _bytes(kind)
        return struct.Struct(text + "x" * (self.size - at))

    def pack(self, values: Mapping[str, Any], winches: Mapping[str, Sequence[Any]] | None = None) -> bytes:
        """Pack values into the bytes of the block. `winches`: values of the winches of a group, by name."""
        known = {"magic": self.magic, "version": LAYOUT, AGAIN: values.get("counter", 0), **values}
        for name, column in (winches or {}).items():
            known |= {_winch_row(i, name): value for i, value in enumerate(column)}
        return self.packer.pack(*[known.get(name, 0) for name, _, _ in self.rows])

    def read(self, data: bytes) -> dict[str, Any] | Refusal:
        """Unpack the values of the rows, by name. If the bytes are not this block, the result is the reason."""
        block = f"DB{self.number}"
        if len(data) != self.size:
            return Refusal(f"{block} has {len(data)} bytes instead of {self.size}", LOAD)
        values = {name: value for (name, _, _), value in zip(self.rows, self.packer.unpack(data), strict=True)}
        if values["magic"] != self.magic:
            begins = f"16#{values['magic']:08X} instead of 16#{self.magic:08X}"
            return Refusal(f"{block} is of another program: it begins with {begins}", f"Check the address. {LOAD}")
        if values.get("version", LAYOUT) != LAYOUT:
            return Refusal(f"{block} has layout {values['version']}; this sagline knows layout {LAYOUT}", LOAD)
        if values.get(AGAIN) != values.get("counter"):
            counters = f"its counter is {values['counter']} at the beginning and {values[AGAIN]} at the end"
            return Refusal(f"{block} is torn: {counters}", TORN)
        return values


def of_winches(values: Mapping[str, Any], name: str) -> list[Any]:
    """One value of each winch of a group, by its name, from the values that `Block.read` returns."""
    return [values[_winch_row(i, name)] for i in range(GROUP_SIZE)]


def _winch_row(index: int, name: str) -> str:
    """Name of a value of a winch in SCL."""
    return f"winch[{index + 1}].{name}"


def _bytes(kind: str | tuple[Field, ...]) -> int:
    assert isinstance(kind, str)  # a structure never contains another structure
    return struct.calcsize(f">{TYPES[kind]}")


AGAIN: Final = "counter_again"
TORN: Final = "If this continues, the PLC writes the block in more than one scan"
LOAD: Final = "Load the blocks of this version into the PLC: sagline export-scl ROBOT --out plc.scl"

_MEASURED: Final = (  # values of a winch in the block of a PLC
    Field("length", "LReal", 0, "unstrained length off the drum [m]"),
    Field("rate", "Real", 8, "rate of the length [m/s]"),
    Field("torque", "Real", 12, "torque at the motor's shaft, positive if it pays out cable [N m]"),
    Field("tension", "Real", 16, "tension from the load cell [N]"),
    Field("filtered", "Real", 20, "filtered tension from the load cell [N]"),
    Field("counts", "DInt", 24, "counts of the encoder"),
    Field("state", "UInt", 28, "state: braked, enabled, saturated, locked, fault"),
    Field("fault", "UInt", 30, "fault code of the drive, 0 for none"),
)
_COMMANDED: Final = (  # values of a winch in the block of a command
    Field("length", "LReal", 0, "set point of the unstrained length off the drum [m]"),
    Field("rate", "Real", 8, "rate of the set point [m/s]"),
    Field("tension", "Real", 12, "expected tension at the drum [N]"),
    Field("enable", "DWord", 16, "1: the drive may move"),
)
_WINCHES: Final = "first and second winch of the group"
_COMPLETE: Final = "the same as counter, or the block is incomplete"
_FROM_PLC: Final = (
    Field("counter", "UDInt", 0, "counter of this block, incremented in each scan, 1 to 2147483647"),
    Field("magic", "DWord", 4, "SAGF"),
    Field("version", "UInt", 8, "version of this layout"),
    Field("group", "UInt", 10, "number of the group of this PLC plus 1, 0 if not set"),
    Field("time", "LReal", 12, "clock of the PLC [us]"),
    Field("owner", "UDInt", 20, "id of the controller that owns this group, 0 for none"),
    Field("echo", "UDInt", 24, "counter of the last accepted command"),
    Field("status", "DWord", 28, "bits: ready, braked, following, ramping, holding, locked, emergency"),
    Field("fault", "UInt", 32, "reason why the PLC has stopped its winches"),
    Field("winches", "UInt", 34, "number of winches of this PLC"),
    Field("winch", _MEASURED, 36, _WINCHES),
    Field(AGAIN, "UDInt", 100, _COMPLETE),
)
_TO_PLC: Final = (
    Field("counter", "UDInt", 0, "counter of commands, incremented in each cycle, 1 to 2147483647"),
    Field("magic", "DWord", 4, "SAGT"),
    Field("version", "UInt", 8, "version of this layout"),
    Field("mode", "UInt", 10, "mode: 0 leave, 1 hold, 2 follow, 3 lock"),
    Field("owner", "UDInt", 12, "id of the controller"),
    Field("valid_for", "Time", 16, "time for which the PLC may use the command [ms]"),
    Field("winch", _COMMANDED, 20, _WINCHES),
    Field(AGAIN, "UDInt", 60, _COMPLETE),
)
_CLAIM: Final = (
    Field("magic", "DWord", 0, "SAGC"),
    Field("owner", "UDInt", 4, "id of the controller that claims the group; the PLC resets it to 0"),
)
FROM_PLC: Final = Block(101, "sagline_from_plc", int.from_bytes(b"SAGF"), register=0, size=104, fields=_FROM_PLC)
TO_PLC: Final = Block(102, "sagline_to_plc", int.from_bytes(b"SAGT"), register=100, size=64, fields=_TO_PLC)
CLAIM: Final = Block(103, "sagline_claim", int.from_bytes(b"SAGC"), register=200, size=8, fields=_CLAIM)
BLOCKS: Final = (FROM_PLC, TO_PLC, CLAIM)


def command_blocks(command: Command) -> list[bytes]:
    """Create the blocks of a command, one per group. If the last group has fewer winches, its last values are zero."""
    head = {
        "counter": command.counter,
        "mode": int(command.mode),
        "owner": command.owner,
        "valid_for": round(1000.0 * command.valid_for),
    }
    columns = {name: getattr(command, name).tolist() for name in ("length", "rate", "tension", "enable")}
    return [
        TO_PLC.pack(head, {name: column[group[0] : group[-1] + 1] for name, column in columns.items()})
        for group in groups_of(len(command.length))
    ]


def sample_of(
    groups: Sequence[Mapping[str, Any]],
    *,
    winches: int,
    time: float,
    age: Array,
    discarded: Whole,
    reasons: tuple[Refusal | None, ...] = (),
) -> Sample:
    """Create a sample at `time` [s] from valid blocks of all groups. `age` [s], `discarded`, `reasons`: (G,)."""
    heads = ("counter", "owner", "echo", "status", "fault")
    columns: dict[str, Any] = {name: np.array([group[name] for group in groups], dtype=np.int64) for name in heads}
    for name in OF_WINCHES:
        values = [value for group in groups for value in of_winches(group, name.removeprefix("winch_"))][:winches]
        columns[name] = np.array(values, dtype=np.float64 if name in REALS else np.int64)
    plc_time = np.array([1e-6 * group["time"] for group in groups])
    return Sample(time=time, age=age, plc_time=plc_time, discarded=discarded, reasons=reasons, **columns)
