"""Modbus alone: what it says of PLCs that are none, and registers."""

from __future__ import annotations

import struct
import threading
import time
from contextlib import closing

import pytest
from pymodbus.client import ModbusTcpClient
from pymodbus.server import ModbusTcpServer

import sagline as sl
from sagline.twin.modbus_mirrors import ModbusMirrors
from tests.plc.samples import a_sample, sample_blocks
from tests.plc.servers import MODBUS, PATIENCE, S7, nobody, plcs, stranger


def test_registers_are_the_bytes_of_the_blocks() -> None:
    sample = a_sample(8)
    with plcs(MODBUS, sample) as mirrors:
        host, _, port = mirrors.addresses[1].partition(":")
        with closing(ModbusTcpClient(host, port=int(port))) as client:
            registers = client.read_holding_registers(0, count=52, device_id=1).registers
            assert struct.pack(">52H", *registers) == sample_blocks(sample)[1]
            assert client.read_holding_registers(18, count=4, device_id=1).registers == registers[18:22]
            client.write_registers(200, [1, 2, 3, 4], device_id=1)
            assert mirrors.written()[1][1] == struct.pack(">4H", 1, 2, 3, 4)
            assert not any(mirrors.written()[1][1])  # who looked took it out
            assert client.read_holding_registers(52, count=1, device_id=1).isError()


def error_of(addresses: list[str], **options: float) -> str:
    with pytest.raises(sl.SaglineError) as caught:
        sl.plc.ModbusLink(addresses, 8, **{"timeout": PATIENCE, **options})  # type: ignore[arg-type]
    assert len(str(caught.value)) < 300
    return str(caught.value)


def test_who_is_no_plc_is_named() -> None:
    with plcs(MODBUS) as mirrors, plcs(S7) as others, stranger() as mute:
        good, gone = list(mirrors.addresses), nobody()
        assert error_of([*good[:3], gone]).startswith(f"group 3 at {gone}: nothing listens there. ")
        text = error_of([*good[:3], others.addresses[3]])
        assert text.startswith(f"group 3 at {others.addresses[3]}: whoever is there hangs up. ")
        assert error_of([mute, *good[1:]]).startswith(f"group 0 at {mute}: it does not answer. ")
        start = time.monotonic()
        assert error_of([mute, *good[1:]], timeout=0.3).startswith(f"group 0 at {mute}: something listens there, but")
        assert time.monotonic() - start < 4.0


def test_a_device_id_that_is_none_is_refused() -> None:
    assert "device is 256" in error_of(["a", "b", "c", "d"], device=256)


def test_a_twin_that_cannot_listen_at_all_its_ports_listens_at_none(monkeypatch: pytest.MonkeyPatch) -> None:
    begun: list[ModbusTcpServer] = []

    async def begin(server: ModbusTcpServer, *, background: bool) -> None:
        if len(begun) == 2:
            raise RuntimeError("no port")
        begun.append(server)
        await really(server, background=background)

    really = ModbusTcpServer.serve_forever
    monkeypatch.setattr(ModbusTcpServer, "serve_forever", begin)
    with pytest.raises(RuntimeError, match="no port"):
        ModbusMirrors(sample_blocks(a_sample(8)))
    assert len(begun) == 2
    assert [server.transport for server in begun] == [None, None]
    assert "sagline modbus" not in [thread.name for thread in threading.enumerate()]
