"""SCL source for PLCs, not compiled here: its offsets, and its statements compared with the program of the twin."""

from __future__ import annotations

import re
from functools import cache
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import sagline as sl
from sagline.control.link import GroupFault, Mode
from sagline.files.c_source import _source_text
from sagline.plc.blocks import BLOCKS, CLAIM, FROM_PLC, TO_PLC, Block
from sagline.twin.plc_program import Order, PlcLimits, Program
from tests.files.scl import Array, data_block, function_block, variables
from tests.refusal import refused
from tests.tiers import extended

PERIOD = 0.005
ROBOT = sl.load_robot("article-prototype")
SPEED = 0.4


@cache
def text() -> str:
    """The source for a robot."""
    return _source_text(ROBOT)


@pytest.mark.parametrize("block", BLOCKS, ids=lambda block: block.name)
def test_offsets_in_scl_agree_with_packing(block: Block) -> None:
    rows, size = data_block(text(), block.name)
    assert rows == {name: (kind, offset) for name, kind, offset in block.rows}
    assert size == block.size == block.packer.size
    values = {name: i + 1 for i, (name, _, _) in enumerate(block.rows) if name not in ("magic", "version")}
    data = block.pack(values)
    for name, (kind, offset) in rows.items():  # and the servers contain these bytes unchanged
        if name in values:
            code = {"LReal": ">f8", "Real": ">f4", "UInt": ">u2", "DInt": ">i4", "Time": ">i4"}.get(kind, ">u4")
            assert np.frombuffer(data, code, 1, offset)[0] == values[name]


def namespace(block: Block, data: bytes | None = None) -> SimpleNamespace:
    """A data block with the values of the given bytes."""
    values = block.read(data) if data else {name: 0 for name, _, _ in block.rows}
    assert isinstance(values, dict)
    found = SimpleNamespace(winch=Array([SimpleNamespace(), SimpleNamespace()]))
    for name, value in values.items():
        winch = re.fullmatch(r"winch\[(\d)\]\.(\w+)", name)
        setattr(found.winch[int(winch[1])] if winch else found, winch[2] if winch else name, value)
    return found


class Bench:
    """The program of the twin and the statements of the source with equal inputs."""

    def __init__(self, count: int) -> None:
        self.count = count
        limits = PlcLimits([2.7] * count, [3.5] * count, [SPEED] * count, [300.0] * count)
        self.program = Program(limits, PERIOD)
        self.block, self.v = function_block(text(), "SaglineGroup"), variables(text(), "SaglineGroup")
        filled = {name: Array([0.0] * 6 + values) for name, values in limits._asdict().items()}
        config = SimpleNamespace(group=4, winches=6 + count, **filled)
        self.db = SimpleNamespace(
            sagline_from_plc=namespace(FROM_PLC), sagline_to_plc=namespace(TO_PLC), sagline_claim=namespace(CLAIM),
            sagline_config=config,
        )  # fmt: skip
        self.time, self.order = 0.0, b""
        self.encoder = [3.0 + 0.1 * i for i in range(count)]
        self.program.length = list(self.encoder)
        self.v.length = Array(pad(self.encoder))

    def claim(self, owner: int) -> None:
        self.db.sagline_claim = namespace(CLAIM, CLAIM.pack({"owner": owner}))
        self.program.claim(owner, self.time)

    def command(self, values: dict[str, Any]) -> None:
        data = TO_PLC.pack(values)
        if data == self.order:
            return  # the next scan reads the claim at once
        self.order = data
        self.db.sagline_to_plc = namespace(TO_PLC, data)
        read = TO_PLC.read(data)  # rates and tensions in single precision, as transmitted
        assert isinstance(read, dict)
        columns = [
            [read[f"winch[{i + 1}].{name}"] for i in range(self.count)]
            for name in ("length", "rate", "tension", "enable")
        ]
        lengths, rates, tensions, enable = columns
        head = read["counter"], read["owner"], read["mode"], read["valid_for"] / 1000.0
        self.program.take(Order(*head, lengths, rates, tensions, [bool(each) for each in enable]))

    def scan(self, cell: list[float], *, reset: bool, saturated: list[bool]) -> None:
        v, program, count = self.v, self.program, self.count
        if reset:
            program.reset()
        program.scan(self.time, self.encoder, cell)
        v.now, v.period, v.stopClosed, v.reset = self.time, PERIOD, program.contact, reset
        v.encoder, v.cell, v.saturated = Array(pad(self.encoder)), Array(pad(cell)), Array(pad(saturated))
        v.driveFault = Array(pad(program.drive_fault))
        self.block(v, self.db)
        self.compare(saturated)
        self.time += PERIOD
        assert count <= 2

    def compare(self, saturated: list[bool]) -> None:
        program, said, v = self.program, self.db.sagline_from_plc, self.v
        states, codes = program.states([float(each) for each in saturated])
        n = range(1, self.count + 1)
        found = (
            said.owner, said.echo, said.fault, said.status, v.mode, v.emergency, v.locked,
            [v.powered[i] for i in n], [v.length[i] for i in n], [v.tension[i] for i in n],
            [said.winch[i].state for i in n], [said.winch[i].fault for i in n],
        )  # fmt: skip
        expected = (
            program.owner, program.echo, program.fault, program.status, program._mode, program.emergency,
            program.locked, program.powered, program.length, program.tension, states, codes,
        )  # fmt: skip
        assert found == expected, self.time
        assert said.counter == said.counter_again == v.counter
        assert said.winches == self.count
        assert said.group == 4


def pad(values: list[Any]) -> list[Any]:
    return [*values, *[0] * (2 - len(values))]


def drive(bench: Bench, seed: int, scans: int) -> dict[str, int]:
    """Apply random inputs to both, and count the events."""
    random, seen = np.random.default_rng(seed), dict[str, int]()
    last: dict[str, Any] = {}
    counter, silent, slips, asked = int(random.integers(1, 2**31 - 1)), 0, 0, list(bench.encoder)
    for _ in range(scans):
        program = bench.program
        owner = int(random.choice([1, 1, 1, 1, 1, 1, 1, 1, 1, 2]))
        if random.random() < 0.05 or not program.owner:
            bench.claim(owner)
        silent = silent - 1 if silent else int(random.integers(5, 130)) if random.random() < 0.01 else 0
        if not silent and random.random() < 0.6:
            counter = counter % (2**31 - 1) + 1
            mode = int(random.choice([0, 1, 2, 3], p=[0.003, 0.1, 0.895, 0.002]))
            speed = SPEED * (0.9 if random.random() < 0.99 else 1.3) * random.uniform(-1.0, 1.0)
            asked = [at + speed * PERIOD for at in (program.length if random.random() < 0.1 else asked)]
            if random.random() < 0.01 or not program._mode:
                asked = [at + (10.0 if random.random() < 0.03 else 0.0) for at in program.length]
            values: dict[str, Any] = {"counter": counter, "mode": mode, "owner": owner, "valid_for": 100}
            for i, at in enumerate(asked):
                broken = random.random() < 0.002
                tension = random.choice([np.nan, -0.1, 300.1, 300.0, 0.0]) if broken else random.uniform(50, 200)
                row = (at, speed, tension, random.random() < 0.995)
                values |= {
                    f"winch[{i + 1}].{name}": value
                    for name, value in zip(("length", "rate", "tension", "enable"), row, strict=True)
                }
            bench.command(values)
            last = values
        elif last and random.random() < 0.1:
            bench.command(last)
        moved = zip(program.length, bench.encoder, strict=True)
        bench.encoder = [to if random.random() < 0.9 else there for to, there in moved]
        if random.random() < 0.002:
            slips = 3
        if slips:  # again, although its set point follows it
            slips -= 1
            bench.encoder = [there + 0.02 for there in bench.encoder]
        program.contact = bool(random.random() >= (0.05 if slips else 0.001))
        if random.random() < 0.001:
            program.trip(int(random.integers(bench.count)), 7)
        stuck = program.emergency or program.locked or any(program.drive_fault)
        cell = [
            float(np.float32(each))
            for each in random.uniform(100.0, 301.0 if random.random() < 0.2 else 290.0, bench.count)
        ]
        if slips or random.random() < 0.01:
            cell[0] = float(random.choice([np.nan, -20.0, 310.0, 150.0]))
        saturated = (random.random(bench.count) < 0.1).tolist()
        bench.scan(cell, reset=bool(stuck and random.random() < 0.02), saturated=saturated)
        for what in (GroupFault(program.fault).name, f"status {program.status}", f"mode {Mode(program._mode).name}"):
            seen[what] = seen.get(what, 0) + 1
    return seen


def test_the_source_agrees_with_the_program_of_the_twin_for_a_few_seconds() -> None:
    drive(Bench(2), seed=2, scans=1_000)


@extended
@pytest.mark.parametrize("count", [2, 1])
def test_the_source_agrees_with_the_program_of_the_twin(count: int) -> None:
    seen = drive(Bench(count), seed=count + 4, scans=8_000)
    assert set(seen) >= {each.name for each in GroupFault}
    assert set(seen) >= {f"status {code}" for code in (1, 2, 3, 5, 9, 17, 35, 98)}


@pytest.mark.soak
def test_the_source_agrees_with_the_program_of_the_twin_for_a_long_time() -> None:
    for seed in range(40):
        drive(Bench(2), seed, 20_000)


@pytest.mark.parametrize("far", [0.02, 0.05])  # m from the end of the range, reached before the ramp and in it
@pytest.mark.parametrize(("end", "rate"), [(2.7, -0.375), (3.5, 0.375)])
def test_the_source_keeps_set_points_in_their_range_without_commands(end: float, rate: float, far: float) -> None:
    bench = Bench(1)
    bench.encoder = [end - far * np.sign(rate)]
    bench.claim(1)
    fixed = {"owner": 1, "valid_for": 100, "winch[1].tension": 100.0, "winch[1].enable": True}
    for counter in range(1, 90):
        follows = bench.program.powered[0]
        if counter <= 5:
            moves = {"mode": Mode.FOLLOW, "winch[1].length": bench.program.length[0] + rate * PERIOD}
            holds = {"mode": Mode.HOLD, "winch[1].length": bench.encoder[0]}
            rates = {"winch[1].rate": rate if follows else 0.0}
            bench.command({"counter": counter} | fixed | (moves if follows else holds) | rates)
        bench.scan([100.0], reset=False, saturated=[False])
        if bench.program.powered[0]:
            bench.encoder = list(bench.program.length)
    assert bench.program.fault == GroupFault.HEARTBEAT
    assert bench.v.length[1] == end


def test_the_file_names_its_settings_and_that_it_is_not_compiled(tmp_path: Path) -> None:
    path = sl.export_scl(ROBOT, tmp_path / "plc.scl")
    written = path.read_bytes().decode()
    assert written.replace("\r\n", "\n") == text()
    assert "@" not in written
    assert max(map(len, written.splitlines())) <= 120
    for words in ("NOT COMPILED", "PUT/GET", "VLAN", "access level", "101, 102, 103"):
        assert words in written.partition("DATA_BLOCK")[0]
    speed = [float(each) for each in re.findall(r" speed\[\d\] := ([^;]+);", written)]
    drums = ROBOT.winches
    assert drums is not None
    assert drums.speed_limit is not None
    assert speed == pytest.approx(drums.speed_limit * drums.drum_radius / drums.gear, rel=1e-3)  # type: ignore[operator]


def test_unsupported_robots_are_refused(tmp_path: Path) -> None:
    with refused(next_step="Let it end in .scl: plc.scl.", kind=sl.FileError):
        sl.export_scl(ROBOT, tmp_path / "plc.txt")
    with pytest.raises(sl.InvalidValueError, match="winches"):
        sl.export_scl(sl.load_robot("cogiro"), tmp_path / "plc.scl")
    assert not list(tmp_path.iterdir())
