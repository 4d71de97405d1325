"""`sagline view`: a robot, or a run of it, in the browser."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from sagline.cli.options import PayloadOption, WrenchOption, robot_completions
from sagline.core.errors import InvalidValueError

if TYPE_CHECKING:
    from sagline.cli.hosting import Start
    from sagline.robot.robot import Robot


def view(
    robot: Annotated[
        str,
        typer.Argument(
            metavar="ROBOT",
            help="A preset (see sagline robots) or a robot file, robot.yaml; a log of the controller, run.mcap; or a "
            "calibration, found.nc.",
            autocompletion=robot_completions,
        ),
    ],
    run: Annotated[
        Path | None,
        typer.Argument(
            metavar="RUN",
            help="To play: a run of this robot, written by sagline track, a simulation, or a log of the controller; "
            "or a calibration to show.",
        ),
    ] = None,
    beside: Annotated[
        Path | None,
        typer.Option(metavar="RUN", help="Another run of the same robot beside it, with the same clock, as a ghost."),
    ] = None,
    live: Annotated[bool, typer.Option("--live", help="Follow a log that is still written.")] = False,
    truth: Annotated[
        Path | None,
        typer.Option(metavar="TWIN.mcap", help="Beside a log: the twin's own, where the platform truly was."),
    ] = None,
    pose: Annotated[
        str | None,
        typer.Option(
            metavar="X,Y,Z[,A,B,C]",
            help="Where the platform is at first: position [m] and angles about z, y, x [degrees].",
        ),
    ] = None,
    mode: Annotated[
        str | None,
        typer.Option(metavar="NUMBER", help="Natural mode that moves at first: 1, 2, ...; 'massless 1'."),
    ] = None,
    wrench: WrenchOption = None,
    payload: PayloadOption = None,
    host: Annotated[
        str, typer.Option(metavar="ADDRESS", help="Address to listen on; 0.0.0.0 is every one, for others to look.")
    ] = "127.0.0.1",
    port: Annotated[str, typer.Option(metavar="NUMBER", help="Port to listen on; 0 takes any that is free.")] = "8080",
    browser: Annotated[bool, typer.Option("--browser/--no-browser", help="Open it in a browser here.")] = True,
) -> int:
    """Look at a robot in the browser: drag its platform, and the cables follow.

    Over SSH, forward the port (`ssh -L 8080:localhost:8080 ...`) and open http://localhost:8080 at home.

    For example:

        sagline view cogiro
        sagline view cogiro --pose 0,0,2 --mode 1
        sagline view own_robot.yaml --payload "5 kg" --port 9000
        sagline track article-mixed --model empirical
        sagline view article-mixed output/article-mixed-empirical.nc
        sagline view article-mixed run_a.nc --beside run_b.nc
        sagline view found.nc
        sagline view run.mcap --live
        sagline view run.mcap --truth twin.mcap
    """
    from sagline.cli.hosting import Start
    from sagline.cli.played import LOG
    from sagline.cli.values import loaded, port_of
    from sagline.cli.view_log import view_log
    from sagline.files.pose_text import pose_of, wrench_of
    from sagline.files.robot_file import load_robot

    number = port_of(port)
    log = next((file for file in (run, Path(robot)) if file is not None and file.suffix.lower() == LOG), None)
    if log is None and (live or truth is not None):
        item, step = "--live" if live else "--truth", "Give one: sagline view run.mcap."
        raise InvalidValueError(item, "given without a log", "a log in MCAP", step)
    found = run if run is not None and _is_calibration(run) else None
    if found is None and Path(robot).suffix.lower() == ".nc":  # no robot has this suffix: its reader says what is wrong
        found = Path(robot)
    alone = {"--wrench": wrench, "--payload": payload, "--pose": pose, "--mode": mode}
    given = [item for item, value in alone.items() if value is not None]
    if (run is not None or log is not None or found is not None) and given:
        raise InvalidValueError(given[0], "given with a run", "a robot alone", "A run has its own: leave one out.")
    if beside is not None and (found is not None or (run is None and log is None)):
        step = "Give both: sagline view cogiro run_a.nc --beside run_b.nc"
        raise InvalidValueError("--beside", "given without a run", "two runs of one robot", step)
    if log is not None:
        name = robot if log is run else None
        return view_log(log, name, live, truth, host, number, browser=browser, beside=beside)
    if found is not None:
        return view_calibration(found, robot if found is run else None, host, number, browser=browser)
    start = Start(None if pose is None else pose_of(pose), _mode(mode), wrench_of(wrench))
    machine = loaded(load_robot(robot), payload)
    if run is not None:
        return view_run(machine, run, host, number, browser=browser, beside=beside)
    mass = None if payload is None else machine.mass
    return serve(machine, robot, host, number, browser=browser, start=start, mass=mass)


def serve(
    robot: Robot,
    name: str | Path,
    host: str,
    port: int,
    *,
    browser: bool,
    start: Start | None = None,
    mass: float | None = None,
) -> int:
    """Serve a robot until Ctrl-C; returns the exit code.

    Args:
        robot: The robot.
        name: Its name or file.
        host: Address to listen on.
        port: Port to listen on.
        browser: Whether to open one here.
        start: How it is shown at first; None for its home.
        mass: Its mass with a payload [kg]; None for its own.

    Raises:
        SaglineError: If nothing can listen there.
    """
    from sagline.cli.hosting import check_viewer, hosted

    check_viewer()
    from sagline.viewer.state_code import Source

    return hosted(robot, None, host, port, browser=browser, start=start, source=Source.of_robot(name, mass))


def view_run(robot: Robot, file: Path, host: str, port: int, *, browser: bool, beside: Path | None = None) -> int:
    """Serve a run or a simulation of a robot until Ctrl-C; returns the exit code.

    Args:
        robot: Whose it should be.
        file: The run or the simulation.
        host: Address to listen on.
        port: Port to listen on.
        browser: Whether to open one here.
        beside: What is played beside it; None for nothing.

    Raises:
        SaglineError: If the file cannot be read, or nothing can listen there.
    """
    from sagline.cli.hosting import check_viewer, hosted
    from sagline.cli.played import played_beside, played_in
    from sagline.files.netcdf import is_of
    from sagline.files.simulation_file import FORMAT

    check_viewer()
    from sagline.viewer.state_code import Source

    course = played_in(robot, file)
    other = None if beside is None else played_beside(course.robot, file, beside)
    source = Source.of_simulation(file) if is_of(file, FORMAT) else Source.of_plan(file)
    return hosted(course.robot, course, host, port, browser=browser, source=source, other=other)


def view_calibration(file: Path, robot: str | None, host: str, port: int, *, browser: bool) -> int:
    """Serve a calibrated robot with what was found until Ctrl-C; returns the exit code.

    Args:
        file: The calibration.
        robot: Whose it should be; None for whosever it is.
        host: Address to listen on.
        port: Port to listen on.
        browser: Whether to open one here.

    Raises:
        SaglineError: If a file cannot be read, or nothing can listen there.
    """
    from sagline.cli.hosting import check_viewer, hosted
    from sagline.cli.played import check_robot
    from sagline.files.calibration_file import load_calibration
    from sagline.files.robot_file import load_robot

    check_viewer()
    found = load_calibration(file)
    if robot is not None:
        check_robot(file, "calibration", found.robot, load_robot(robot))
    from sagline.viewer.state_code import Source

    source = Source.of_calibration(file)
    return hosted(found.robot, None, host, port, browser=browser, found=found, source=source)


def _is_calibration(file: Path) -> bool:
    from sagline.files.calibration_file import FORMAT as CALIBRATION
    from sagline.files.netcdf import is_of

    return file.suffix.lower() == ".nc" and is_of(file, CALIBRATION)


def _mode(text: str | None) -> str:
    """The name of a mode: "1", "massless 1"; "" for none."""
    words = " ".join((text or "").split())
    if words and not re.fullmatch(r"(massless )?[1-9][0-9]{0,3}", words):
        step = "The page lists them."
        raise InvalidValueError("--mode", repr(text), "a number from 1 on, or massless 1 and so on", step)
    return words
