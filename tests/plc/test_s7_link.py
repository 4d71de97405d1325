"""The link over real sockets: what it sends, what it takes, and what it says of PLCs that are none."""

from __future__ import annotations

import sys
import time
from typing import Any

import numpy as np
import pytest
from snap7 import Client
from snap7.server import Server
from snap7.type import SrvArea

import sagline as sl
from sagline.plc.blocks import BLOCKS, FROM_PLC
from tests.plc.samples import a_command, a_sample, bad, of_another_version, sample_blocks, status
from tests.plc.servers import PATIENCE, S7, linked, nobody, plcs, stranger, taken, until


def test_an_exchange_waits_for_nobody_and_a_silent_group_is_connected_anew() -> None:
    with plcs(S7, status(1)) as mirrors, linked(S7, mirrors) as link:
        server = mirrors._servers[1]
        server.lock_area(SrvArea.DB, FROM_PLC.number)  # it answers no more
        times = []

        def age() -> float:
            start = time.perf_counter()
            sample = taken(link)
            times.append(time.perf_counter() - start)
            return float(sample.age[1])

        until(lambda: age() > 1.0)
        assert np.median(times) < 2e-3
        trouble = link._exchanges[1].trouble
        assert trouble is not None
        assert trouble.reason == "it does not answer"
        server.unlock_area(SrvArea.DB, FROM_PLC.number)
        mirrors.publish(sample_blocks(status(2)))
        until(lambda: np.all(taken(link).counter == 2))


def test_the_slowest_group_sets_the_time_not_the_sum() -> None:
    wait = 0.03
    with plcs(S7, status(1)) as mirrors:
        for server in mirrors._servers:
            server.set_read_events_callback(lambda event: time.sleep(wait))
        with linked(S7, mirrors) as link:
            mirrors.publish(sample_blocks(status(2)))
            link.exchange(a_command(8))
            until(lambda: np.all(taken(link).counter == 2))
            assert wait <= link.round_trip.min()
            assert link.round_trip.max() < 3 * wait  # in turn it would be at least 4


def test_it_asks_for_the_pdu_of_an_s7_1200_and_the_twin_grants_no_other() -> None:
    with plcs() as mirrors:
        client = Client()
        client.connect("127.0.0.1", 0, 1, tcp_port=int(mirrors.addresses[0].rpartition(":")[2]))
        assert client.get_pdu_length() == 240  # it asked for 480
        client.disconnect()
    asked: list[int] = []

    class Asked(Server):
        def _handle_setup_communication(self, request: dict[str, Any]) -> bytes:
            asked.append(request["parameters"]["pdu_length"])
            return super()._handle_setup_communication(request)

    server = Asked(log=False)
    memory = {block: bytearray(block.size) for block in BLOCKS}
    memory[FROM_PLC][:] = sample_blocks(a_sample(2))[0]
    for block, content in memory.items():
        server.register_area(SrvArea.DB, block.number, content)
    server.start_to("127.0.0.1", 0)
    assert server.server_socket is not None
    port = server.server_socket.getsockname()[1]
    sl.plc.S7Link(f"127.0.0.1:{port}", 2, timeout=PATIENCE).close()
    server.stop()
    assert asked == [240]


def error_of(addresses: str | list[str], winches: int = 8, timeout: float = PATIENCE) -> str:
    with pytest.raises(sl.SaglineError) as caught:
        sl.plc.S7Link(addresses, winches, timeout=timeout)
    assert len(str(caught.value)) < 300
    assert str(caught.value).isprintable()
    return str(caught.value)


@pytest.mark.parametrize(
    ("addresses", "said"),
    [
        ("127.0.0.1:1,127.0.0.1:2,127.0.0.1:3", "number of PLC addresses is 3; allowed: 4"),
        ("127.0.0.1:1", "number of PLC addresses is 1; allowed: 4"),
        (["a", "b", "c", "d", "e"], "number of PLC addresses is 5; allowed: 4"),
        ("a,b,a,d", "address of group 2 is a:102, as that of group 0"),
        ("a,b,a:102,d", "address of group 2 is a:102, as that of group 0"),
        ("a,,c,d", "address of group 1 is ''"),
        ("a,b,c,d:", "address of group 3 is 'd:'"),
        ("a,b,c,d:0", "address of group 3 is 'd:0'"),
        ("a,b,c,d:65536", "address of group 3 is 'd:65536'"),
        ("a,b,c,d:102x", "address of group 3 is 'd:102x'"),
        ("a,b,http://c,d", "address of group 2 is 'http://c'"),
        ("a,b,c d,e", "address of group 2 is 'c d'"),
        ("a,b,c\x1b[2J,e", "address of group 2 is 'c\\x1b[2J'"),
        ([1, 2, 3, 4], "address of group 0 is 1"),
    ],
)
def test_addresses_that_are_none_are_refused_before_anything_is_connected(addresses: Any, said: str) -> None:
    assert said in error_of(addresses)


def test_a_port_where_nothing_listens_is_named() -> None:
    with plcs() as mirrors:
        gone = nobody()
        text = error_of([*mirrors.addresses[:2], gone, mirrors.addresses[3]])
    assert text.startswith(f"group 2 at {gone}: nothing listens there. ")


def test_a_mute_port_is_named_within_the_time_given() -> None:
    with plcs() as mirrors, stranger() as mute:
        start = time.monotonic()
        text = error_of([mirrors.addresses[0], mute, *mirrors.addresses[2:]], timeout=0.5)
        assert time.monotonic() - start < 4.0  # the library alone waits 5 s
    assert text.startswith(f"group 1 at {mute}: something listens there, but has answered nothing for 0.5 s. ")


@pytest.mark.parametrize("answer", [b"HTTP/1.1 400 Bad Request\r\n\r\n", b"SSH-2.0\r\n", b"\x03\x00\x00\x04"])
def test_a_stranger_is_named(answer: bytes) -> None:
    with plcs() as mirrors, stranger(answer) as address:
        text = error_of([address, *mirrors.addresses[1:]])
    assert text.startswith(f"group 0 at {address}: whoever is there speaks no S7 (")


def test_groups_in_the_wrong_order_are_told() -> None:
    with plcs() as mirrors:
        first, second, *others = mirrors.addresses
        text = error_of([second, first, *others])
    assert text.startswith(f"group 0 at {second}: the PLC there is group 1, not 0 (group 1 cannot")


def test_a_plc_of_another_layout_is_told_with_what_to_load() -> None:
    with plcs() as mirrors:
        mirrors.publish(bad(1, of_another_version))
        text = error_of(list(mirrors.addresses))
    assert "group 2 at" in text
    assert "DB101 has layout 3; this sagline knows layout 1" in text
    assert "sagline export-scl ROBOT" in text


def test_a_plc_without_the_blocks_is_told_with_what_to_load() -> None:
    server = Server(log=False)
    server.start_to("127.0.0.1", 0)
    assert server.server_socket is not None
    text = error_of(f"127.0.0.1:{server.server_socket.getsockname()[1]}", winches=2)
    server.stop()
    assert "it has no DB101 of 104 bytes. Load the blocks" in text


def test_a_robot_of_another_number_of_winches_is_told() -> None:
    with plcs() as mirrors:
        text = error_of(list(mirrors.addresses), winches=7)
    assert "group 3 at" in text
    assert "the PLC there drives 2 winches, the robot has 1 in this group" in text


@pytest.mark.parametrize(("package", "link"), [("snap7", sl.plc.S7Link), ("pymodbus", sl.plc.ModbusLink)])
def test_a_package_that_is_missing_is_named_with_the_extra(
    package: str, link: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in [*sys.modules]:
        if name.startswith((package, "sagline.plc.s7_wire", "sagline.plc.modbus_wire")):
            monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, package, None)
    with pytest.raises(sl.FileError) as caught:
        link("a,b,c,d", 8)
    assert str(caught.value) == f'package {package}: is not installed. PLCs need it: pip install "sagline[plc]"'
