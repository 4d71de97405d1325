"""`sagline view`: a robot, or a run of it, in the browser."""

from __future__ import annotations

import os
import re
import signal
import sys
import webbrowser
from contextlib import nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from sagline.arrays import Array
from sagline.cli.entries import FORWARD
from sagline.cli.terminal import note, show, working
from sagline.cli.values import loaded, port_of, pose_of, wrench_of
from sagline.errors import FileError, InvalidValueError
from sagline.files.dataset import is_of
from sagline.files.plan_file import load_plan
from sagline.files.robot_file import load_robot
from sagline.files.simulation_file import CONTENT, load_simulation
from sagline.robot.pose import Pose
from sagline.robot.robot import Robot

if TYPE_CHECKING:
    from sagline.viewer.played import Played


def view(
    robot: str,
    run: Path | None,
    pose: str | None,
    mode: str | None,
    wrench: str | None,
    payload: str | None,
    host: str,
    port: str,
    *,
    browser: bool,
) -> int:
    """Serve until Ctrl-C; returns the exit code.

    Raises:
        SaglineError: If the robot or the run cannot be read, or nothing can listen there.
    """
    number = port_of(port)
    alone = {"--wrench": wrench, "--payload": payload, "--pose": pose, "--mode": mode}
    given = [item for item, value in alone.items() if value is not None]
    if run is not None and given:
        raise InvalidValueError(given[0], "given with a run", "a robot alone", "A run has its own: leave one out.")
    start = Start(None if pose is None else pose_of(pose), _mode(mode), wrench_of(wrench))
    return serve(loaded(load_robot(robot), payload), run, host, number, browser=browser, start=start)


class Start(NamedTuple):
    """How a robot is shown at first.

    Attributes:
        pose: Where its platform is; None for its home.
        mode: Name of the mode that moves, "" for none.
        wrench: On the platform, shape (6,); None for none.
    """

    pose: Pose | None = None
    mode: str = ""
    wrench: Array | None = None


HOME = Start()


def serve(robot: Robot, run: Path | None, host: str, port: int, *, browser: bool, start: Start = HOME) -> int:
    """Serve a robot until Ctrl-C; returns the exit code."""
    try:
        from sagline.cli.readings import Readings
        from sagline.viewer import server as web
        from sagline.viewer.viewer import Viewer
    except ModuleNotFoundError as error:
        raise FileError(
            f"package {error.name}", "is not installed", 'The viewer needs it: pip install "sagline[viewer]"'
        ) from None
    course = None if run is None else _played(robot, run)
    machine = robot if course is None else course.robot
    server = web.started(host, port, machine.name)
    if signal.getsignal(signal.SIGINT) is not signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)  # from here on Ctrl-C is how one ends, and no failure
    try:
        address = web.url(server, host)
        show(f"{machine.name} is at {address}   (Ctrl-C stops it)", whole=True)
        if host not in ("127.0.0.1", "::1", "localhost"):
            note("Note: ", "everyone who can reach this machine can look at it and drag it.", style="bold")
        readings = Readings()
        viewer = Viewer(server, machine, course, readings.ready, start.wrench, start.pose, start.mode)
        if browser and _has_display():
            webbrowser.open(address)
        with working("") if readings.cold else nullcontext(), readings.compiled_beside(viewer):
            viewer.serve()
    except KeyboardInterrupt:
        note("", "Stopped.")
    finally:
        web.stop(server)
    return 0


def _mode(text: str | None) -> str:
    """The name of a mode: "1", "massless 1"; "" for none."""
    words = " ".join((text or "").split())
    if words and not re.fullmatch(r"(massless )?[1-9][0-9]{0,3}", words):
        step = "The page lists them."
        raise InvalidValueError("--mode", repr(text), "a number from 1 on, or massless 1 and so on", step)
    return words


def _played(robot: Robot, file: Path) -> Played:
    """A run or a simulation, whichever is in the file."""
    from sagline.viewer.playback import Playback
    from sagline.viewer.run import Run

    if is_of(file, CONTENT):
        simulation = load_simulation(file)
        _check_robot(file, "simulation", simulation.robot, robot)
        return Playback(simulation)
    plan = load_plan(file)
    made_for = plan.state.one_robot
    _check_robot(file, "run", made_for, robot)
    count = len(plan.state.pose) if plan.state.pose.shape else 1
    with working(f"{made_for.name}: confirming {count:,} poses", FORWARD) as line:
        return Run.of(plan, line.progress)


def _check_robot(file: Path, kind: str, made_for: Robot, robot: Robot) -> None:
    if made_for.name != robot.name:
        step = f"View it as: sagline view {made_for.name} {file}"
        raise FileError(file, f"is a {kind} of {made_for.name}, not of {robot.name}", step)


def _has_display() -> bool:
    """Whether a browser could open: over SSH it would open in the terminal, in the way."""
    return sys.platform in ("win32", "darwin") or any(map(os.environ.get, ("DISPLAY", "WAYLAND_DISPLAY")))
