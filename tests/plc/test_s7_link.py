"""The S7 link over real sockets: sent and received data, and errors of foreign servers."""

from __future__ import annotations

import re
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
from tests.plc.servers import PATIENCE, S7, linked, plcs, stranger, taken, until, unused_address
from tests.refusal import refused
from tests.tiers import extended


@extended
def test_an_exchange_does_not_wait_and_a_silent_group_is_reconnected() -> None:
    with plcs(S7, status(1)) as servers, linked(S7, servers) as link:
        server = servers._servers[1]
        server.lock_area(SrvArea.DB, FROM_PLC.number)  # it no longer answers
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
        assert re.search("answer", trouble.reason)
        server.unlock_area(SrvArea.DB, FROM_PLC.number)
        servers.publish(sample_blocks(status(2)))
        until(lambda: np.all(taken(link).counter == 2))


@extended
def test_groups_are_read_in_parallel() -> None:
    wait = 0.03
    with plcs(S7, status(1)) as servers:
        for server in servers._servers:
            server.set_read_events_callback(lambda event: time.sleep(wait))
        with linked(S7, servers) as link:
            servers.publish(sample_blocks(status(2)))
            link.exchange(a_command(8))
            until(lambda: np.all(taken(link).counter == 2))
            assert wait <= link.round_trip.min()
            assert link.round_trip.max() < 3 * wait  # in sequence it would be at least 4


@extended
def test_the_pdu_has_the_size_of_an_s7_1200() -> None:
    with plcs() as servers:
        client = Client()
        client.connect("127.0.0.1", 0, 1, tcp_port=int(servers.addresses[0].rpartition(":")[2]))
        assert client.get_pdu_length() == 240  # the client requested 480
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


@pytest.mark.parametrize(
    ("addresses", "group", "value"),
    [
        ("127.0.0.1:1,127.0.0.1:2,127.0.0.1:3", None, "3"),
        ("127.0.0.1:1", None, "1"),
        (["a", "b", "c", "d", "e"], None, "5"),
        ("a,b,a,d", 2, "a:102, as that of group 0"),
        ("a,b,a:102,d", 2, "a:102, as that of group 0"),
        ("a,,c,d", 1, "''"),
        ("a,b,c,d:", 3, "'d:'"),
        ("a,b,c,d:0", 3, "'d:0'"),
        ("a,b,c,d:65536", 3, "'d:65536'"),
        ("a,b,c,d:102x", 3, "'d:102x'"),
        ("a,b,http://c,d", 2, "'http://c'"),
        ("a,b,c d,e", 2, "'c d'"),
        ("a,b,c\x1b[2J,e", 2, "'c\\x1b[2J'"),
        ([1, 2, 3, 4], 0, "1"),
    ],
)
def test_invalid_addresses_are_refused_before_connecting(addresses: Any, group: int | None, value: str) -> None:
    item = "number of PLC addresses" if group is None else f"address of group {group}"
    with refused(item, value, kind=sl.InvalidValueError) as caught:
        sl.plc.S7Link(addresses, 8)
    assert group is not None or caught.value.allowed.startswith("4")
    assert len(str(caught.value)) < 300
    assert str(caught.value).isprintable()


@pytest.mark.parametrize(
    "addresses", [None, 5, b"a,b,c,d", [], "", [None] * 4, {"a": 1}, "a" * 20_000, ["a", "b", "c", object()]]
)
def test_addresses_of_another_kind_are_refused(addresses: Any) -> None:
    with pytest.raises(sl.InvalidValueError) as caught:
        sl.plc.S7Link(addresses, 8)
    assert len(str(caught.value)) < 300


def error_of(addresses: list[str], group: int, winches: int = 8, timeout: float = PATIENCE) -> str:
    """Error of a link about one group."""
    with refused(f"group {group} at {addresses[group]}", kind=sl.plc.LinkError) as caught:
        sl.plc.S7Link(addresses, winches, timeout=timeout)
    assert len(str(caught.value)) < 300
    assert str(caught.value).isprintable()
    return str(caught.value).replace(addresses[group], "ADDRESS")


@extended
def test_the_error_names_a_port_without_a_server(snapshot: Any) -> None:
    with plcs() as servers:
        assert error_of([*servers.addresses[:2], unused_address(), servers.addresses[3]], 2) == snapshot


@extended
def test_the_error_names_a_port_that_does_not_answer_in_time(snapshot: Any) -> None:
    with plcs() as servers, stranger() as mute:
        begin = time.monotonic()
        text = error_of([servers.addresses[0], mute, *servers.addresses[2:]], 1, timeout=0.5)
        assert time.monotonic() - begin < 4.0  # the library alone waits 5 s
    assert text == snapshot


@extended
@pytest.mark.parametrize("answer", [b"HTTP/1.1 400 Bad Request\r\n\r\n", b"SSH-2.0\r\n", b"\x03\x00\x00\x04"])
def test_the_error_names_a_port_that_does_not_speak_s7(answer: bytes) -> None:
    with plcs() as servers, stranger(answer) as address:
        text = error_of([address, *servers.addresses[1:]], 0)
    assert re.match(r"group 0 at ADDRESS: .* S7 \(", text)


@extended
def test_the_error_names_the_first_of_two_groups_in_the_wrong_order(snapshot: Any) -> None:
    with plcs() as servers:
        first, second, *others = servers.addresses
        assert error_of([second, first, *others], 0) == snapshot


def test_the_error_names_the_layout_of_a_group_and_the_command_that_exports_this_one(snapshot: Any) -> None:
    with plcs() as servers:
        servers.publish(bad(1, of_another_version))
        assert error_of(list(servers.addresses), 2) == snapshot


@extended
def test_the_error_names_the_block_that_is_missing(snapshot: Any) -> None:
    server = Server(log=False)
    server.start_to("127.0.0.1", 0)
    assert server.server_socket is not None
    text = error_of([f"127.0.0.1:{server.server_socket.getsockname()[1]}"], 0, winches=2)
    server.stop()
    assert text == snapshot


@extended
def test_the_error_names_the_number_of_winches_of_plc_and_robot(snapshot: Any) -> None:
    with plcs() as servers:
        assert error_of(list(servers.addresses), 3, winches=7) == snapshot


@pytest.mark.parametrize(("package", "link"), [("snap7", sl.plc.S7Link), ("pymodbus", sl.plc.ModbusLink)])
def test_a_missing_package_is_named_with_the_extra(package: str, link: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    for name in [*sys.modules]:
        if name.startswith((package, "sagline.plc.s7_link", "sagline.plc.modbus_link")):
            monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, package, None)
    with refused(f"package {package}", kind=sl.FileError) as caught:
        link("a,b,c,d", 8)
    assert caught.value.next_step.endswith('pip install "sagline[plc]"')
