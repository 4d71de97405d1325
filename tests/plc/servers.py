"""PLCs of all kinds at the other end of a socket: good ones, strangers, and those that say nothing."""

from __future__ import annotations

import socket
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from typing import Any

from sagline.control.link import Sample
from sagline.plc.packing import sample_blocks
from sagline.twin.s7_mirrors import S7Mirrors
from tests.plc.samples import a_sample

PATIENCE = 20.0  # s: for a machine that has much else to do; nothing waits so long where all is well


def until(condition: Callable[[], Any], patience: float = PATIENCE) -> None:
    """Wait until it holds."""
    end = time.monotonic() + patience
    while not condition():
        assert time.monotonic() < end, "it never came about"
        time.sleep(0.002)


@contextmanager
def plcs(sample: Sample | None = None) -> Iterator[S7Mirrors]:
    """As many good groups as a sample has."""
    mirrors = S7Mirrors(sample_blocks(a_sample(8) if sample is None else sample))
    try:
        yield mirrors
    finally:
        mirrors.close()


@contextmanager
def stranger(answer: bytes | None = None) -> Iterator[str]:
    """Somebody who accepts whoever comes, and says the same to each, or nothing."""
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


def nobody() -> str:
    """An address where nothing listens."""
    with socket.create_server(("127.0.0.1", 0)) as listening:
        return f"127.0.0.1:{listening.getsockname()[1]}"
