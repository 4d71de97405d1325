"""Times to write and read over links to PLCs: four servers in another process, as in `sagline twin`, on loopback."""

from __future__ import annotations

import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import closing, contextmanager

import numpy as np
from rich.console import Console

import sagline as sl
from benchmarks.measure import Row, show
from sagline.control.link import PERIOD, Command, Mode
from sagline.core.arrays import Array
from sagline.plc.block_link import BlockLink
from sagline.plc.blocks import FROM_PLC
from sagline.twin.block_servers import BlockServers

GROUPS, WINCHES, OWNER = 4, 8, 7
CYCLES = 600
SLOW = 3e-3  # response time of a slow server [s]
KINDS = {"s7": sl.plc.S7Link, "slow": sl.plc.S7Link, "modbus": sl.plc.ModbusLink}


def blocks(counter: int) -> list[bytes]:
    """Blocks of four idle PLCs."""
    head = {"counter": counter, "owner": OWNER, "winches": 2}
    return [FROM_PLC.pack({**head, "group": group + 1}) for group in range(GROUPS)]


def serve(kind: str) -> None:
    """Run the servers until stdin ends."""
    servers = _block_servers(kind)
    sys.stdout.write(",".join(servers.addresses) + "\n")
    sys.stdout.flush()
    ended, counter = threading.Event(), 1

    def listen() -> None:
        sys.stdin.read()
        ended.set()

    threading.Thread(target=listen, daemon=True).start()
    while not ended.wait(sl.twin.SCAN):
        counter += 1
        servers.publish(blocks(counter))
    servers.close()


def _block_servers(kind: str) -> BlockServers:
    if kind == "modbus":
        from sagline.twin.modbus_servers import ModbusServers

        return ModbusServers(blocks(1))
    from sagline.twin.s7_servers import S7Servers

    servers = S7Servers(blocks(1))
    if kind == "slow":
        for server in servers._servers:
            server.set_read_events_callback(lambda event: time.sleep(SLOW))
    return servers


@contextmanager
def linked(kind: str) -> Iterator[BlockLink]:
    """A link to servers in another process."""
    words = [sys.executable, "-m", "benchmarks.links", kind]
    with subprocess.Popen(words, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        addresses = process.stdout.readline().strip()
        with closing(KINDS[kind](addresses, WINCHES, timeout=10.0)) as link:
            yield link
        process.communicate()


def round_trips(kind: str) -> tuple[Array, Array]:
    """Time of the slowest group in each cycle, and time of `exchange` [s]."""
    none, on = np.zeros(WINCHES), np.ones(WINCHES, dtype=np.bool_)
    slowest, taken = [], []
    with linked(kind) as link:
        for counter in range(1, CYCLES):
            start = time.perf_counter()
            link.exchange(Command(counter, OWNER, Mode.HOLD, 0.1, none, none, none, on))
            taken.append(time.perf_counter() - start)
            time.sleep(PERIOD)
            slowest.append(link.round_trip.max())
    return np.array(slowest), np.array(taken)


def links() -> Iterator[Row]:
    """Four groups: write a command and read a block of each."""
    for kind, name, target in (
        ("s7", "four S7 servers, write and read, slowest group", "p50 <= 1.5 ms"),
        ("slow", "the same with a response time of 3 ms each", "not their sum, 12 ms"),
        ("modbus", "four Modbus servers", "about 3.7 ms"),
    ):
        slowest, taken = round_trips(kind)
        p50, p99 = 1e3 * np.quantile(slowest, (0.5, 0.99))
        yield Row(name, target, f"p50 {p50:.2f} ms, p99 {p99:.2f} ms")
        if kind == "s7":
            yield Row("`exchange`, which does not wait for the PLCs", "", f"p50 {1e6 * np.median(taken):.0f} us")


if __name__ == "__main__":
    if sys.argv[1:]:
        serve(sys.argv[1])
    else:
        show("Links", list(links()), Console())
