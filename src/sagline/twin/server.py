"""Servers of a machine in real time, for controllers in other processes."""

from __future__ import annotations

import gc
import multiprocessing
import signal
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager, suppress
from multiprocessing.connection import Connection
from typing import Any, Final

import numpy as np

from sagline.control.link import OF_WINCHES, Command, Mode, Refusal, groups_of
from sagline.control.real_time import Pace
from sagline.core.arguments import flag, instance, whole_number
from sagline.core.arrays import Array
from sagline.core.errors import InvalidValueError, SaglineError, needed_packages
from sagline.dynamics.simulation.simulator import Reading
from sagline.plc.blocks import CLAIM, FROM_PLC, TO_PLC, of_winches
from sagline.plc.wire import LAST_PORT
from sagline.robot.pose import Pose
from sagline.robot.robot import Robot
from sagline.twin.block_servers import LOOPBACK, BlockServers
from sagline.twin.link import Report
from sagline.twin.machine import Machine

SCAN: Final = 0.005  # scan period of a twin's PLCs [s]; with half a control cycle, each cycle reads a new block
SILENT: Final = bytes(FROM_PLC.size)
HALF: Final = 2**31
MODES: Final = frozenset(Mode)
ROWS: Final = (*OF_WINCHES[:-1], "fault")  # names of the values in the block of a PLC


class Server:
    """Servers of a machine's PLCs, each with its own address. The machine runs in real time.

    Attributes:
        machine: The machine.
        addresses: "host:port" of each group's PLC, in the groups' order.

    Examples:
        >>> import sagline as sl
        >>> robot = sl.load_robot("article-prototype")
        >>> server = sl.twin.Server(sl.twin.Machine(robot, period=sl.twin.SCAN))
        >>> server.scan()  # run() repeats this in real time
        >>> print(len(server.addresses), server.machine.time == sl.twin.SCAN)
        4 True
        >>> server.close()
    """

    def __init__(self, machine: Machine, *, host: str = LOOPBACK, port: int = 0, modbus: bool = False) -> None:
        """Start the servers.

        Args:
            machine: Machine of the PLCs; its period is the scan period of the PLCs.
            host: Address of this computer for the servers; by default other computers cannot connect.
            port: Port of the first group. Group k has the port `port` + k. 0: any free ports.
            modbus: True if the servers use Modbus TCP instead of S7.

        Raises:
            InvalidValueError: If a port is in use or above 65535. If this computer does not have the address `host`.
            FileError: If the package for the protocol is not installed.
        """
        self.machine = instance(machine, Machine, "machine")
        place, first_port = instance(host, str, "host"), whole_number(port, "port", 0, LAST_PORT)
        check_first_port(first_port, machine.robot)
        self._pace = Pace(machine.period)
        self._groups = range(len(machine.groups))
        self._seen = [b""] * len(machine.groups)  # last commands that were read from the blocks
        first = [self._block(group) or SILENT for group in self._groups]
        self._servers = _block_servers(first, place, first_port, flag(modbus, "modbus"))
        self.addresses = self._servers.addresses

    @property
    def late(self) -> float:
        """Largest delay of a scan so far [s]."""
        return self._pace.lateness.longest

    def run(self, watch: Callable[[float, Reading], None] | None = None) -> None:
        """Serve until interrupted.

        Args:
            watch: Function that is called after every scan. The arguments are the machine's time [s] and true state;
                the next scan overwrites this state.
        """
        while True:
            self._pace.wait()
            self.scan()
            if watch is not None:
                watch(self.machine.time, self.machine.reading)

    def scan(self) -> None:
        """Pass written blocks to the PLCs, advance the machine by a period, and publish the PLCs' blocks."""
        for group, (command, claim) in enumerate(self._servers.written()):
            asked = CLAIM.read(claim)
            if not isinstance(asked, Refusal):
                self.machine.claim(group, asked["owner"])
            if command != self._seen[group]:  # a command from before the claim is ignored
                self._seen[group] = command
                order = self._command(group, command)
                if order is not None:
                    self.machine.take(group, order)
        self.machine.advance()
        self._servers.publish([self._block(group) for group in self._groups])

    def close(self) -> None:
        """Stop the servers and close all connections."""
        self._servers.close()

    def _command(self, group: int, data: bytes) -> Command | None:
        """Read the command in DB102; None if the block is empty or incomplete."""
        values = TO_PLC.read(data)
        if isinstance(values, Refusal):
            return None
        count, names = len(self.machine.groups[group]), ("length", "rate", "tension", "enable")
        length, rate, tension, enable = (np.array(of_winches(values, name)[:count]) for name in names)
        mode = Mode(values["mode"]) if values["mode"] in MODES else Mode.HOLD
        head = values["counter"], values["owner"], mode, 1e-3 * values["valid_for"]
        return Command(*head, length, rate, tension, enable != 0)

    def _block(self, group: int) -> bytes | None:
        """Block of the PLC of a group. None if the previous block remains because of a fault."""
        report = self.machine.report(group)
        return None if report is None else _block_of(group, report)


def check_first_port(port: int, robot: Robot) -> None:
    """Refuse a first port that is too high for the ports of all groups of a robot. 0 means any free ports."""
    count = len(groups_of(robot.cable_count))
    last = LAST_PORT + 1 - count
    if port > last:
        allowed = f"0 to {last}, because {count} groups have {count} ports"
        raise InvalidValueError("port of the first group", port, allowed, "Choose another port with --port.")


def _block_of(group: int, report: Report) -> bytes:
    """Create the block that contains `report`, for the PLC of `group` (from 0)."""
    head = {"group": group + 1, "time": 1e6 * report.plc_time, "winches": len(report.length)}
    if report.foreign:
        head["magic"] = 0
    counts = [(count + HALF) % (2 * HALF) - HALF for count in report.counts]  # counters overflow as in a PLC
    columns: list[list[Any]] = [*report[8:13], counts, report.state, report.winch_fault]
    return FROM_PLC.pack(report._asdict() | head, dict(zip(ROWS, columns, strict=True)))


def _block_servers(blocks: list[bytes], host: str, port: int, modbus: bool) -> BlockServers:
    with needed_packages("PLCs need it", "plc"):
        if modbus:
            from sagline.twin.modbus_servers import ModbusServers

            return ModbusServers(blocks, host, port)
        from sagline.twin.s7_servers import S7Servers

        return S7Servers(blocks, host, port)


SWITCHING_ON: Final = 60.0  # longest time for the start of the process [s], including the loading of kernels


@contextmanager
def machine_in_process(
    robot: Robot, nominal: Robot, start: Pose, *, seed: int = 0
) -> Iterator[tuple[tuple[str, ...], Callable[[], Array]]]:
    """Context with a machine that runs in another process in real time. The end of the context kills the process."""
    # the value has the address of each group's PLC, "host:port", and a function that returns the true position of the
    # platform's origin after the last scan [m], shape (3,)
    context = multiprocessing.get_context("spawn")
    here, there = context.Pipe()
    place = context.Array("d", 3)
    process = context.Process(target=_serve, args=(robot, nominal, start, seed, there, place), daemon=True)
    process.start()
    there.close()
    try:
        yield _receive_addresses(here), lambda: np.array(place[:])
    finally:
        process.kill()
        process.join()
        here.close()


def _receive_addresses(pipe: Connection) -> tuple[str, ...]:
    """Wait for the addresses from the other process. If that process reports an error, raise this error."""
    answer: tuple[str, ...] | SaglineError | None = None
    with suppress(EOFError):
        answer = pipe.recv() if pipe.poll(SWITCHING_ON) else None
    if isinstance(answer, tuple):
        return answer
    if answer is not None:
        raise answer
    step = "Try again, or use this process."
    raise InvalidValueError("the twin's process", "not running, or silent for a minute", "a process that answers", step)


def _serve(robot: Robot, nominal: Robot, start: Pose, seed: int, pipe: Connection, place: Any) -> None:
    """Run the machine until the process is killed. SIGINT is ignored, because the controller must stop the robot."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        server = Server(Machine(robot, nominal=nominal, start=start, seed=seed, period=SCAN))
    except SaglineError as error:
        pipe.send(error)
        return

    def watch(time: float, reading: Reading) -> None:
        place[:] = reading.position.tolist()

    with closing(server):
        gc.collect()
        gc.freeze()
        pipe.send(tuple(server.addresses))
        server.run(watch)
