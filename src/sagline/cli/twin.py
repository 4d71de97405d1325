"""`sagline twin`: a machine in real time behind servers of its own, until Ctrl-C."""

from __future__ import annotations

import gc
from collections.abc import Sequence
from contextlib import ExitStack, closing
from pathlib import Path
from socket import gethostname
from typing import TYPE_CHECKING, Final, NamedTuple

from sagline.cli.entries import FORWARD, INVERSE, SIMULATION
from sagline.cli.terminal import note, show, working
from sagline.cli.values import port_of, whole_of
from sagline.control.link import GroupStatus, fault_text
from sagline.files.robot_file import load_robot
from sagline.twin.machine import MOST_SEED, Machine
from sagline.twin.server import SCAN, Server

if TYPE_CHECKING:
    from sagline.dynamics.simulator import Reading
    from sagline.files.mcap_log import Recorder
    from sagline.twin.snapshot import Report

LOOK: Final = 0.1  # s, between two looks at what the PLCs do
LATE: Final = 0.05  # s, by which a scan may be late without a word
STATUS: Final = (  # the first that holds
    (GroupStatus.EMERGENCY, "emergency stop"),
    (GroupStatus.LOCKED, "drums locked"),
    (GroupStatus.BRAKED, "brakes on"),
    (GroupStatus.RAMPING, "slowing down"),
    (GroupStatus.HOLDING, "holding by itself"),
    (GroupStatus.FOLLOWING, "following"),
    (GroupStatus.READY, "holding"),
)


class Asked(NamedTuple):
    """What was asked for, as the command line has it."""

    host: str
    port: str
    modbus: bool
    seed: str
    faults: tuple[str, ...]
    log: Path | None


def twin(name: str, true: str | None, asked: Asked) -> int:
    """Serve until Ctrl-C.

    Raises:
        SaglineError: If a robot cannot be read or has not all the data a machine needs, or nothing can listen there.
    """
    robot = load_robot(name)
    real = robot if true is None else load_robot(true)
    port, seed = port_of(asked.port), whole_of(asked.seed, "--seed", 0, MOST_SEED)
    with ExitStack() as stack:
        with working("switching the machine on", INVERSE, FORWARD, SIMULATION):
            machine = Machine(real, nominal=robot, seed=seed, period=SCAN, faults=asked.faults)
            server = stack.enter_context(closing(Server(machine, host=asked.host, port=port, modbus=asked.modbus)))
        watch = Watch(machine)
        if asked.log is not None:
            from sagline.files.mcap_log import Recorder

            watch.recorder = stack.enter_context(Recorder(asked.log, real, period=SCAN))
        _greet(name, server, asked)
        gc.collect()
        gc.freeze()  # nothing of all that was made so far is looked at again, while time counts
        try:
            server.run(watch)
        finally:
            if server.late > LATE:
                note("Note: ", f"This computer was busy: the machine stood still for up to {server.late:.2f} s.")
    return 0


def _greet(name: str, server: Server, asked: Asked) -> None:
    machine = server.machine
    winches, groups = machine.robot.cable_count, len(machine.groups)
    spoken = "Modbus TCP" if asked.modbus else "S7"
    show(f"{machine.nominal.name}: {winches} winches behind {groups} PLCs that speak {spoken}, brakes on.")
    show("From another terminal:")
    show(f"  sagline control {name}{' --modbus' * asked.modbus} \\", whole=True)
    everywhere = "0.0.0.0:"
    places = [place.replace(everywhere, f"{gethostname()}:") for place in server.addresses]
    show(f"    --plc {','.join(places)}", whole=True)
    show("Ctrl-C switches it off.")
    if asked.host != "127.0.0.1":
        note("Note: ", "everyone who can reach this machine can drive it: nothing asks for a password.", style="bold")


class Watch:
    """Tells what the PLCs do, and writes where the platform is."""

    def __init__(self, machine: Machine) -> None:
        """Begin with what is.

        Args:
            machine: Which.
        """
        self.recorder: Recorder | None = None
        self._stopped = ""
        self._machine = machine
        self._known = self._look()
        self._next = 0.0

    def __call__(self, time: float, reading: Reading) -> None:
        """Look at the machine after a scan.

        Args:
            time: On its clock [s].
            reading: What is true.
        """
        if self.recorder is not None:
            self.recorder.truth(time, reading.position.copy(), reading.quaternion.copy())
        if time >= self._next:
            self._next = time + LOOK
            self._tell(time)

    def _look(self) -> list[str]:
        reports = [self._machine.report(group) for group in range(len(self._machine.groups))]
        return ["says nothing new" if report is None else _doing(report) for report in reports]

    def _tell(self, time: float) -> None:
        now = self._look()
        changed = [i for i, (new, old) in enumerate(zip(now, self._known, strict=True)) if new != old]
        for what in dict.fromkeys(now[i] for i in changed):
            show(f"{time:9.1f} s  {_groups([i for i in changed if now[i] == what])} {what}")
        self._known = now
        if self.recorder is not None and self.recorder.stopped != self._stopped:
            self._stopped = self.recorder.stopped
            note("Note: ", f"nothing more is written: {self._stopped}", style="bold")


def _doing(report: Report) -> str:
    """What a PLC does, in a few words."""
    state = next((words for bit, words in STATUS if report.status & bit), "not ready")
    why = f" ({fault_text(report.fault)})" if report.fault else ""
    return f"{state}{why}, {f'driven by {report.owner}' if report.owner else 'free'}"


def _groups(groups: Sequence[int]) -> str:
    return f"group{'s' * (len(groups) > 1)} {', '.join(str(group) for group in groups)}:"
