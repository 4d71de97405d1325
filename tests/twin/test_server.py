"""Servers of a twin on the lockstep clock: sockets transmit the state of the machine exactly."""

from __future__ import annotations

import re
import struct
from collections.abc import Iterator
from contextlib import closing, contextmanager
from typing import Any

import numpy as np
import pytest

import sagline as sl
from sagline.control import Command, Mode, Sample
from sagline.core.arrays import Array
from sagline.twin.server import _block_of, check_first_port
from tests.control.protocol import GroupFault, GroupStatus
from tests.plc.protocol import CLAIM, FROM_PLC, TO_PLC, BlockLink, Refusal
from tests.plc.samples import a_sample, sample_blocks
from tests.plc.servers import BOTH, MODBUS, PATIENCE, S7, Kind, taken, until
from tests.refusal import refused
from tests.tiers import extended, wide
from tests.twin.blocks import memory

OWNER = 5


def machine(*faults: str) -> sl.twin.Machine:
    return sl.twin.Machine(sl.load_robot("article-prototype"), seed=3, faults=faults)


@contextmanager
def served(kind: Kind, *faults: str) -> Iterator[tuple[sl.twin.Server, BlockLink]]:
    with (
        closing(sl.twin.Server(machine(*faults), modbus=kind is MODBUS)) as server,
        closing(kind.link(server.addresses, 8, timeout=PATIENCE)) as link,
    ):
        yield server, link


def next_sample(server: sl.twin.Server, link: BlockLink) -> Sample:
    """The sample after a scan."""
    before = taken(link).counter
    server.scan()
    until(lambda: np.all(taken(link).counter == before + 1))
    return taken(link)


def send(server: sl.twin.Server, link: BlockLink, command: Command) -> None:
    """Send a command, or the claim without a grant, and wait for its arrival."""
    link.exchange(command)
    told = struct.pack(">I", command.counter)
    until(lambda: all(bytes(each[TO_PLC][:4]) == told or any(each[CLAIM]) for each in memory(server)))


def command_of(counter: int, mode: Mode, length: Array) -> Command:
    count = len(length)
    on = np.ones(count, dtype=np.bool_)
    return Command(counter, OWNER, mode, 0.1, length, np.zeros(count), np.full(count, 150.0), on)


@pytest.mark.parametrize("kind", wide(BOTH))
def test_a_machine_behind_sockets_agrees_with_one_in_process(kind: Kind) -> None:
    alone = machine()
    with served(kind) as (server, link):
        begin = taken(link).length
        for counter in range(1, 12):
            length, mode = begin + 1e-4 * max(counter - 4, 0), Mode.FOLLOW if counter > 3 else Mode.HOLD
            send(server, link, command_of(counter, mode, length))
            for group, winches in enumerate(alone.groups):
                if counter == 1:
                    alone.claim(group, OWNER)
                else:
                    alone.take(group, command_of(counter, mode, length[list(winches)]))
            alone.advance()
            sample = next_sample(server, link)
            for group, winches in enumerate(alone.groups):
                report = alone.report(group)
                assert report is not None
                assert sample.owner[group] == report.owner == OWNER
                assert sample.echo[group] == report.echo == (counter if counter > 1 else 0)
                assert sample.status[group] == report.status
                assert sample.length[list(winches)].tolist() == report.length
                assert sample.counts[list(winches)].tolist() == report.counts
                assert sample.tension[list(winches)].tolist() == np.array(report.tension, dtype=np.float32).tolist()
        assert (sample.status == GroupStatus.READY | GroupStatus.FOLLOWING).all()
        assert (sample.length - begin > 2e-4).all()


def test_a_report_is_packed_as_in_a_plc() -> None:
    sample = a_sample(8, counts=np.arange(8) * 2**20)
    heads = [int(column[1]) for column in (sample.owner, sample.echo, sample.status, sample.fault)]
    floats = [column[2:4].tolist() for column in sample[8:13]]
    whole = [column[2:4].tolist() for column in (sample.counts, sample.state, sample.winch_fault)]
    counter = int(sample.counter[1])
    rows: list[Any] = [counter, counter, False, float(sample.plc_time[1]), *heads, *floats, *whole]
    report = sl.twin.Report(*rows)
    assert _block_of(1, report) == sample_blocks(sample)[1]
    for spoiled, said in ((report._replace(counter_again=3), "torn"), (report._replace(foreign=True), "another")):
        refusal = FROM_PLC.read(_block_of(1, spoiled))
        assert isinstance(refusal, Refusal)
        assert re.match(f"DB101 .*{said}", refusal.reason)
    beyond = _block_of(1, report._replace(counts=[2**31, -(2**31) - 1]))
    values = FROM_PLC.read(beyond)
    assert isinstance(values, dict)
    assert [values["winch[1].counts"], values["winch[2].counts"]] == [-(2**31), 2**31 - 1]


def test_foreign_bytes_do_not_move_the_machine() -> None:
    random = np.random.default_rng(0)
    with closing(sl.twin.Server(machine())) as server:
        good = bytearray(TO_PLC.pack({"counter": 1, "owner": OWNER, "mode": 2, "valid_for": 100}))
        for k in range(40):
            for blocks in memory(server):
                spoiled = bytearray(good)
                spoiled[random.integers(0, 10)] ^= random.integers(1, 256)
                blocks[TO_PLC][:] = spoiled if k % 2 else random.bytes(64)
            server.scan()
        for group in range(4):
            report = server.machine.report(group)
            assert report is not None
            assert (report.owner, report.echo) == (0, 0)
            assert report.status & GroupStatus.BRAKED


@pytest.mark.parametrize(("valid_for", "scans"), wide([(30, 3), (100, 10)]))
def test_a_command_is_valid_for_the_milliseconds_in_its_block(valid_for: int, scans: int) -> None:
    with closing(sl.twin.Server(machine())) as server:
        blocks, start = memory(server)[0], server.machine.report(0)
        assert start is not None
        blocks[CLAIM][:] = CLAIM.pack({"owner": OWNER})
        server.scan()
        for counter in range(1, 6):
            values = {"counter": counter, "owner": OWNER, "mode": Mode.HOLD, "valid_for": valid_for}
            rows = {f"winch[{k + 1}].length": start.length[k] for k in range(2)}
            enabled = {f"winch[{k + 1}].enable": 1 for k in range(2)}
            blocks[TO_PLC][:] = TO_PLC.pack({**values, **rows, **enabled})
            server.scan()
        faults = []
        for _ in range(12):
            server.scan()
            report = server.machine.report(0)
            assert report is not None
            faults.append(report.fault)
    assert faults.index(GroupFault.HEARTBEAT) == scans - 1


@extended
def test_a_silent_group_keeps_its_block() -> None:
    with served(S7, "group 1 is silent at 0.01 s") as (server, link):
        before = next_sample(server, link)
        server.scan()
        until(lambda: np.all(taken(link).counter == before.counter + np.array([1, 0, 1, 1])))


def test_each_group_needs_a_port() -> None:
    with refused("port of the first group", "65533", kind=sl.InvalidValueError):
        sl.twin.Server(machine(), port=65533)
    check_first_port(65532, machine().robot)


@extended
def test_a_port_in_use_is_reported() -> None:
    with closing(sl.twin.Server(machine())) as server:
        port = int(server.addresses[2].rpartition(":")[2])
        with refused("address of the twin", kind=sl.InvalidValueError) as caught:
            sl.twin.Server(server.machine, port=port)
        assert f"'127.0.0.1', port {port} (" in caught.value.value


@extended
def test_commands_from_before_a_grant_are_ignored() -> None:
    with served(S7) as (server, link):
        length = taken(link).length
        owners = []
        for counter, mode in enumerate((Mode.HOLD, Mode.HOLD, Mode.LEAVE, Mode.HOLD), 1):
            send(server, link, command_of(counter, mode, length))
            owners.append(int(next_sample(server, link).owner[0]))
        owners.append(int(next_sample(server, link).owner[0]))
        assert owners == [OWNER, OWNER, 0, OWNER, OWNER]
