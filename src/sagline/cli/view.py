"""`sagline view`: a robot, or a run of it, in the browser."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING

from sagline.cli.entries import FORWARD
from sagline.cli.hosting import HOME, Start, check_viewer, hosted
from sagline.cli.terminal import working
from sagline.cli.values import loaded, port_of, pose_of, wrench_of
from sagline.cli.view_log import LOG, view_log
from sagline.errors import FileError, InvalidValueError
from sagline.files.dataset import is_of
from sagline.files.plan_file import load_plan
from sagline.files.robot_file import load_robot
from sagline.files.simulation_file import CONTENT, load_simulation
from sagline.robot.robot import Robot

if TYPE_CHECKING:
    from sagline.viewer.played import Played


def view(
    robot: str,
    run: Path | None,
    live: bool,
    truth: Path | None,
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
    log = next((file for file in (run, Path(robot)) if file is not None and file.suffix.lower() == LOG), None)
    if log is None and (live or truth is not None):
        item, step = "--live" if live else "--truth", "Give one: sagline view run.mcap."
        raise InvalidValueError(item, "given without a log", "a log in MCAP", step)
    alone = {"--wrench": wrench, "--payload": payload, "--pose": pose, "--mode": mode}
    given = [item for item, value in alone.items() if value is not None]
    if (run is not None or log is not None) and given:
        raise InvalidValueError(given[0], "given with a run", "a robot alone", "A run has its own: leave one out.")
    if log is not None:
        return view_log(log, robot if log is run else None, live, truth, host, number, browser=browser)
    start = Start(None if pose is None else pose_of(pose), _mode(mode), wrench_of(wrench))
    return serve(loaded(load_robot(robot), payload), run, host, number, browser=browser, start=start)


def serve(robot: Robot, run: Path | None, host: str, port: int, *, browser: bool, start: Start = HOME) -> int:
    """Serve a robot, perhaps with a run, until Ctrl-C; returns the exit code."""
    check_viewer()
    course = None if run is None else _played(robot, run)
    return hosted(robot if course is None else course.robot, course, host, port, browser=browser, start=start)


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
