"""Modbus: errors of foreign servers, and registers."""

from __future__ import annotations

import re
import struct
import threading
import time
from contextlib import closing
from typing import Any

import pytest
from pymodbus.client import ModbusTcpClient
from pymodbus.server import ModbusTcpServer

import sagline as sl
from tests.plc.samples import a_sample, sample_blocks
from tests.plc.servers import MODBUS, PATIENCE, S7, plcs, stranger, unused_address
from tests.refusal import refused
from tests.tiers import extended
from tests.twin.blocks import ModbusServers


def test_registers_are_the_bytes_of_the_blocks() -> None:
    sample = a_sample(8)
    with plcs(MODBUS, sample) as servers:
        host, _, port = servers.addresses[1].partition(":")
        with closing(ModbusTcpClient(host, port=int(port))) as client:
            registers = client.read_holding_registers(0, count=52, device_id=1).registers
            assert struct.pack(">52H", *registers) == sample_blocks(sample)[1]
            assert client.read_holding_registers(18, count=4, device_id=1).registers == registers[18:22]
            client.write_registers(200, [1, 2, 3, 4], device_id=1)
            assert servers.written()[1][1] == struct.pack(">4H", 1, 2, 3, 4)
            assert not any(servers.written()[1][1])  # a reader has removed it
            assert client.read_holding_registers(52, count=1, device_id=1).isError()


@extended
def test_the_error_names_the_invalid_group_and_the_reason(snapshot: Any) -> None:
    with plcs(MODBUS) as servers, plcs(S7) as others, stranger() as mute:
        good, gone = list(servers.addresses), unused_address()
        errors = {
            "nobody": error_of([*good[:3], gone], 3, PATIENCE),
            "S7": error_of([*good[:3], others.addresses[3]], 3, PATIENCE),
            "mute": error_of([mute, *good[1:]], 0, PATIENCE),
        }
        begin = time.monotonic()
        errors["mute, with less patience"] = error_of([mute, *good[1:]], 0, 0.3)
        assert time.monotonic() - begin < 4.0
    assert errors == snapshot


def error_of(addresses: list[str], group: int, timeout: float) -> str:
    """Error of a link about one group."""
    with refused(f"group {group} at {addresses[group]}", kind=sl.plc.LinkError) as caught:
        sl.plc.ModbusLink(addresses, 8, timeout=timeout)
    assert len(str(caught.value)) < 300
    line = str(caught.value).replace(addresses[group], "ADDRESS")
    return re.sub(r" \(groups? .* either\)", "", line)  # on a busy computer others can be late as well


def test_an_invalid_device_id_is_refused() -> None:
    with refused("device", "256", kind=sl.InvalidValueError):
        sl.plc.ModbusLink(["a", "b", "c", "d"], 8, device=256)


@extended
def test_a_twin_listens_at_all_ports_or_none(monkeypatch: pytest.MonkeyPatch) -> None:
    begun: list[ModbusTcpServer] = []

    async def begin(server: ModbusTcpServer, *, background: bool) -> None:
        if len(begun) == 2:
            raise RuntimeError("no port")
        begun.append(server)
        await really(server, background=background)

    really = ModbusTcpServer.serve_forever
    monkeypatch.setattr(ModbusTcpServer, "serve_forever", begin)
    with pytest.raises(RuntimeError, match="no port"):
        ModbusServers(sample_blocks(a_sample(8)))
    assert len(begun) == 2
    assert [server.transport for server in begun] == [None, None]
    assert "sagline modbus" not in [thread.name for thread in threading.enumerate()]
