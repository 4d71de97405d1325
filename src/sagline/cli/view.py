"""`sagline view`: a robot, or a run of it, in the browser."""

from __future__ import annotations

import os
import re
import signal
import sys
import webbrowser
from contextlib import nullcontext
from pathlib import Path
from typing import TYPE_CHECKING

from sagline.arrays import Array
from sagline.cli.entries import FORWARD
from sagline.cli.terminal import note, show, working
from sagline.cli.values import loaded, wrench_of
from sagline.errors import FileError, InvalidValueError
from sagline.files.plan_file import load_plan
from sagline.files.robot_file import load_robot
from sagline.robot.robot import Robot

if TYPE_CHECKING:
    from sagline.viewer.run import Run


LAST_PORT = 65535


def view(
    robot: str, run: Path | None, wrench: str | None, payload: str | None, host: str, port: str, *, browser: bool
) -> int:
    """Serve until Ctrl-C; returns the exit code.

    Raises:
        SaglineError: If the robot or the run cannot be read, or nothing can listen there.
    """
    number = _port(port)
    if run is not None and (wrench is not None or payload is not None):
        item = "--wrench" if wrench is not None else "--payload"
        raise InvalidValueError(item, "given with a run", "a robot alone", "A run has its own load: leave one out.")
    load = wrench_of(wrench)
    return serve(loaded(load_robot(robot), payload), run, host, number, browser=browser, wrench=load)


def serve(robot: Robot, run: Path | None, host: str, port: int, *, browser: bool, wrench: Array | None = None) -> int:
    """Serve a robot until Ctrl-C; returns the exit code."""
    try:
        from sagline.cli.readings import Readings
        from sagline.viewer import server as web
        from sagline.viewer.viewer import Viewer
    except ModuleNotFoundError as error:
        raise FileError(
            f"package {error.name}", "is not installed", 'The viewer needs it: pip install "sagline[viewer]"'
        ) from None
    course = None if run is None else _run(robot, run)
    machine = robot if course is None else course.plan.state.one_robot
    server = web.started(host, port, machine.name)
    if signal.getsignal(signal.SIGINT) is not signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)  # from here on Ctrl-C is how one ends, and no failure
    try:
        address = web.url(server, host)
        show(f"{machine.name} is at {address}   (Ctrl-C stops it)", whole=True)
        if host not in ("127.0.0.1", "::1", "localhost"):
            note("Note: ", "everyone who can reach this machine can look at it and drag it.", style="bold")
        readings = Readings()
        viewer = Viewer(server, machine, course, readings.ready, wrench)
        if browser and _has_display():
            webbrowser.open(address)
        with working("") if readings.cold else nullcontext(), readings.compiled_beside(viewer):
            viewer.serve()
    except KeyboardInterrupt:
        note("", "Stopped.")
    finally:
        web.stop(server)
    return 0


def _port(text: str) -> int:
    if not re.fullmatch(r"[0-9]{1,5}", text) or int(text) > LAST_PORT:
        raise InvalidValueError("--port", repr(text), f"a whole number from 0 to {LAST_PORT}", "Choose another.")
    return int(text)


def _run(robot: Robot, file: Path) -> Run:
    from sagline.viewer.run import Run

    plan = load_plan(file)
    made_for = plan.state.one_robot.name
    if made_for != robot.name:
        raise FileError(
            file, f"is a run of {made_for}, not of {robot.name}", f"View it as: sagline view {made_for} {file}"
        )
    with working(
        f"{made_for}: confirming {len(plan.state.pose) if plan.state.pose.shape else 1:,} poses", FORWARD
    ) as line:
        return Run.of(plan, line.progress)


def _has_display() -> bool:
    """Whether a browser could open: over SSH it would open in the terminal, in the way."""
    return sys.platform in ("win32", "darwin") or any(map(os.environ.get, ("DISPLAY", "WAYLAND_DISPLAY")))
