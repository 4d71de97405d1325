"""PLCs behind sockets: valid ones, foreign ones, and silent ones."""

from __future__ import annotations

import socket
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager, suppress
from typing import Any, NamedTuple

import pytest

import sagline as sl
from sagline.control import Sample
from sagline.plc.block_link import BlockLink
from tests.plc.samples import a_sample, sample_blocks
from tests.twin.blocks import BlockServers, ModbusServers, S7Servers

OWNER = 4711
PATIENCE = 20.0  # s, for a busy machine; no wait is this long otherwise


def until(condition: Callable[[], Any], patience: float = PATIENCE) -> None:
    """Wait for a condition."""
    end = time.monotonic() + patience
    while not condition():
        assert time.monotonic() < end, "it never came about"
        time.sleep(0.002)


class Kind(NamedTuple):
    """Protocol of the blocks."""

    servers: Callable[[list[bytes]], BlockServers]
    link: Callable[..., BlockLink]


S7 = Kind(S7Servers, sl.plc.S7Link)
MODBUS = Kind(ModbusServers, sl.plc.ModbusLink)
BOTH = [pytest.param(S7, id="S7"), pytest.param(MODBUS, id="Modbus")]


@contextmanager
def plcs(kind: Kind = S7, sample: Sample | None = None) -> Iterator[Any]:
    """As many valid groups as in a sample."""
    servers = kind.servers(sample_blocks(a_sample(8) if sample is None else sample))
    try:
        yield servers
    finally:
        servers.close()


@contextmanager
def linked(kind: Kind, servers: BlockServers) -> Iterator[BlockLink]:
    with closing(kind.link(servers.addresses, 8, timeout=PATIENCE)) as link:
        yield link


def taken(link: BlockLink) -> Sample:
    sample = link.exchange(None)
    assert isinstance(sample, Sample)
    return sample


@contextmanager
def stranger(answer: bytes | None = None) -> Iterator[str]:
    """A server that accepts all connections and sends the same bytes to each, or none."""
    kept: list[socket.socket] = []
    with socket.create_server(("127.0.0.1", 0)) as listening:

        def serve() -> None:
            with suppress(OSError):
                while True:
                    client, _ = listening.accept()
                    kept.append(client)
                    if answer is not None:
                        client.recv(100)
                        client.sendall(answer)

        threading.Thread(target=serve, daemon=True).start()
        try:
            yield f"127.0.0.1:{listening.getsockname()[1]}"
        finally:
            with suppress(OSError):
                listening.shutdown(socket.SHUT_RDWR)
            for client in kept:
                client.close()


def unused_address() -> str:
    """An address without a server."""
    with socket.create_server(("127.0.0.1", 0)) as listening:
        return f"127.0.0.1:{listening.getsockname()[1]}"
