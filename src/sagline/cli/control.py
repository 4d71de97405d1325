"""`sagline control` and `sagline twin`: the controller, and a simulated machine with one server per PLC."""

from __future__ import annotations

import gc
import re
import sys
from collections.abc import Sequence
from contextlib import ExitStack, closing
from pathlib import Path
from socket import gethostname
from typing import TYPE_CHECKING, Final

import sagline as sl
from sagline.cli import options as opt
from sagline.cli.terminal import show_note, show_text

if TYPE_CHECKING:
    from sagline.files.mcap_writer import Recorder


def control(
    name: str = opt.ROBOT,
    plc: str = opt.option(
        opt.NEEDED, "ADDRESS,...", "Address of the PLC of each group: host, host:port or [IPv6]:port.", "--plc"
    ),
    modbus: bool = opt.MODBUS,
    shadow: bool = opt.flag(False, "Only read and log; send no commands.", "--shadow"),
    log: Path | None = opt.LOG,
    priority: int | None = opt.PRIORITY,
) -> int:
    """Control a machine: connect, home and follow paths until the session ends.

    Each input line is a command: home, goto 0.2,-0.4,1.4, run path.yaml, jog 3 +5mm, pause, resume, stop, state, ack,
    off, help. Lines from a pipe are executed one after the other. The first error in such a line ends the session.
    Ctrl-C stops all winches and releases the machine (exit code 130). Software is not a safety function: the machine
    needs an emergency stop that is wired in hardware.

    For example:

        sagline control article-prototype --plc 127.0.0.1:11021,127.0.0.1:11022,127.0.0.1:11023,127.0.0.1:11024
        echo "home; goto 0.2,-0.4,1.4" | sagline control article-prototype --plc ... --log run.mcap
        sagline control article-prototype --plc ... --shadow --log run.mcap
    """
    from sagline.cli.session import OperatorSession
    from sagline.control.real_time import set_priority

    robot = sl.load_robot(name)
    if priority is not None:
        set_priority(priority)  # before the threads of `link` and `log` start, which inherit the priority
    with ExitStack() as stack:
        link = stack.enter_context(closing(_link(robot, plc, modbus=modbus)))
        record = None
        if log is not None:
            from sagline.files.mcap_writer import Recorder

            record = stack.enter_context(Recorder(log, robot))
        controller = sl.control.Controller(robot, link, pace=sl.control.Pace(), record=record, shadow=shadow)
        gc.collect()
        gc.freeze()  # the real-time loop is faster if the garbage collector skips all existing objects
        return OperatorSession(controller, alone=not sys.stdin.isatty(), shadow=shadow).run()


def _link(robot: sl.Robot, plc: str, *, modbus: bool) -> sl.control.Link:
    return sl.plc.ModbusLink(plc, robot) if modbus else sl.plc.S7Link(plc, robot)


LOOK: Final = 0.1  # time between two checks of the PLCs [s]
LATE: Final = 0.05  # delay of a scan above which a message is printed [s]
STATUS: Final = {  # text of the first bit of `GroupStatus` that is set
    "EMERGENCY": "emergency stop",
    "LOCKED": "drums locked",
    "BRAKED": "brakes on",
    "RAMPING": "slowing down",
    "HOLDING": "holding by itself",
    "FOLLOWING": "following",
    "READY": "holding",
}


def twin(
    name: str = opt.ROBOT,
    true: str | None = opt.TRUE,
    port: int = opt.port(11021),
    host: str = opt.HOST,
    modbus: bool = opt.MODBUS,
    seed: int = opt.seed(0),
    faults: list[str] | None = opt.option(
        None,
        "TEXT",
        "A fault and its time: 'cell 3 sticks at 40 s', 'group 1 is silent at 20 s for 0.2 s'; parts count from 0. "
        "The option can be repeated.",
        "--fault",
    ),
    log: Path | None = opt.LOG,
    priority: int | None = opt.PRIORITY,
) -> int:
    """Simulate plant, drives and PLCs of a robot in real time, until Ctrl-C.

    Each group of two winches has a simulated PLC: a server with the data blocks of a real PLC. The servers use
    consecutive ports from --port on. The PLCs have the values of ROBOT. The log has the true pose of the platform. The
    first printed lines show the command that connects a controller. Later lines show changes of the state of the PLCs.
    Exit code 130.

    For example:

        sagline twin article-prototype
        sagline twin article-prototype --fault "cell 3 sticks at 40 s"
        sagline twin article-prototype --true worn.yaml --log twin.mcap
        sagline twin article-prototype --modbus --port 5020
    """
    from sagline.control.real_time import set_priority
    from sagline.twin.server import check_first_port

    robot = sl.load_robot(name)
    check_first_port(port, robot)
    real = robot if true is None else sl.load_robot(true)
    if priority is not None:
        set_priority(priority)
    with ExitStack() as stack:
        machine = sl.twin.Machine(real, nominal=robot, seed=seed, period=sl.twin.SCAN, faults=tuple(faults or ()))
        server = stack.enter_context(closing(sl.twin.Server(machine, host=host, port=port, modbus=modbus)))
        watch = _TwinMonitor(machine)
        if log is not None:
            from sagline.files.mcap_writer import Recorder

            watch.recorder = stack.enter_context(Recorder(log, real, period=sl.twin.SCAN))
        _greet(name, server, modbus=modbus)
        gc.collect()
        gc.freeze()  # the real-time loop is faster if the garbage collector skips all existing objects
        try:
            server.run(watch)
        finally:
            if server.late > LATE:
                show_note("Note: ", f"This computer was busy: the twin was up to {server.late:.2f} s late.")
    return 0


def _greet(name: str, server: sl.twin.Server, *, modbus: bool) -> None:
    machine = server.machine
    winches, groups = machine.robot.cable_count, len(machine.groups)
    protocol = "Modbus TCP" if modbus else "S7"
    show_text(f"{machine.nominal.name}: {winches} winches on {groups} PLCs with {protocol}, brakes on.")
    show_text("From another terminal:")
    show_text(f"  sagline control {name}{' --modbus' * modbus} \\", whole=True)
    places = [re.sub(r"^(0\.0\.0\.0|\[::\])(?=:)", gethostname(), place) for place in server.addresses]
    show_text(f"    --plc {','.join(places)}", whole=True)
    show_text("Ctrl-C stops it.")
    if not server.addresses[0].startswith(("127.", "[::1]")):
        show_note("Note: ", "everyone who can reach this machine can drive it; there is no password.", style="bold")


class _TwinMonitor:
    """Observer that prints changes of the PLCs and records the motion of the platform."""

    def __init__(self, machine: sl.twin.Machine) -> None:
        self.recorder: Recorder | None = None
        self._stopped = ""
        self._machine = machine
        self._known = self._look()
        self._next = 0.0

    def __call__(self, time: float, reading: sl.Reading) -> None:
        """Record the true pose in `reading` after the scan at `time` [s], and print all changes of the PLCs."""
        if self.recorder is not None:
            self.recorder.truth(time, reading.position.copy(), reading.quaternion.copy())
        if time >= self._next:
            self._next = time + LOOK
            self._tell(time)

    def _look(self) -> list[str]:
        reports = [self._machine.report(group) for group in range(len(self._machine.groups))]
        return ["sends no new data" if report is None else _doing(report) for report in reports]

    def _tell(self, time: float) -> None:
        now = self._look()
        changed = [i for i, (new, old) in enumerate(zip(now, self._known, strict=True)) if new != old]
        for what in dict.fromkeys(now[i] for i in changed):
            show_text(f"{time:9.1f} s  {_groups([i for i in changed if now[i] == what])} {what}")
        self._known = now
        if self.recorder is not None and self.recorder.stopped != self._stopped:
            self._stopped = self.recorder.stopped
            show_note("Note: ", f"the log has stopped: {self._stopped}", style="bold")


def _doing(report: sl.twin.Report) -> str:
    from sagline.control.link import GroupStatus, fault_text

    state = next((words for name, words in STATUS.items() if report.status & GroupStatus[name]), "not ready")
    why = f" ({fault_text(report.fault)})" if report.fault else ""
    return f"{state}{why}, {f'driven by {report.owner}' if report.owner else 'free'}"


def _groups(groups: Sequence[int]) -> str:
    return f"group{'s' * (len(groups) > 1)} {', '.join(str(group) for group in groups)}:"
