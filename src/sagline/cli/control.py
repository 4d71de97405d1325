"""`sagline control`: the controller, which carries out the commands that an operator types."""

from __future__ import annotations

import gc
import sys
from contextlib import ExitStack, closing
from typing import TYPE_CHECKING, Annotated

from sagline.cli.options import LogOption, ModbusOption, PriorityOption, RobotArgument, flag, option

if TYPE_CHECKING:
    from sagline.control.link import Link
    from sagline.robot.robot import Robot


def control(
    name: RobotArgument,
    plc: Annotated[
        str,
        option("ADDRESS,...", "Address of the PLC of each group: host, host:port or [IPv6]:port.", "--plc"),
    ],
    modbus: ModbusOption = False,
    shadow: Annotated[bool, flag("Only read and log; send no commands.", "--shadow")] = False,
    log: LogOption = None,
    priority: PriorityOption = None,
) -> int:
    """Control a machine: connect, home, follow paths, until quit.

    Each input line is a command: home, goto 0.2,-0.4,1.4, run path.yaml, jog 3 +5mm, pause, resume, stop, state, ack,
    off, help. Lines from a pipe are executed one after the other; the first error ends the session. Ctrl-C stops all
    winches and releases the machine (exit code 130). Software is not a safety function: the machine needs an emergency
    stop that is wired in hardware.

    For example:

        sagline control article-prototype --plc 127.0.0.1:11021,127.0.0.1:11022,127.0.0.1:11023,127.0.0.1:11024
        echo "home; goto 0.2,-0.4,1.4" | sagline control article-prototype --plc ... --log run.mcap
        sagline control article-prototype --plc ... --shadow --log run.mcap
    """
    from sagline.cli.session import OperatorSession
    from sagline.control.controller import Controller
    from sagline.control.real_time import Pace, set_priority
    from sagline.files.robot_file import load_robot

    robot = load_robot(name)
    if priority is not None:
        set_priority(priority)  # before the threads of link and log start, because they inherit the priority
    with ExitStack() as stack:
        link = stack.enter_context(closing(_link(robot, plc, modbus=modbus)))
        record = None
        if log is not None:
            from sagline.files.mcap_writer import Recorder

            record = stack.enter_context(Recorder(log, robot))
        controller = Controller(robot, link, pace=Pace(), record=record, shadow=shadow)
        gc.collect()
        gc.freeze()  # the real-time loop is faster if the garbage collector skips all existing objects
        session = OperatorSession(controller, alone=not sys.stdin.isatty(), shadow=shadow)
        return session.run()


def _link(robot: Robot, plc: str, *, modbus: bool) -> Link:
    from sagline.plc import ModbusLink, S7Link

    return ModbusLink(plc, robot) if modbus else S7Link(plc, robot)
