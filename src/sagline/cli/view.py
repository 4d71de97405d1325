"""`sagline view`: a robot or a run in the browser."""

from __future__ import annotations

import re
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final

from sagline.cli.options import (
    HostOption,
    PayloadOption,
    PortOption,
    PoseOption,
    WrenchOption,
    argument,
    converted_option,
    flag,
    option,
    robot_completions,
)
from sagline.cli.terminal import show_note, working
from sagline.core.errors import FileError, InvalidValueError, SaglineError

if TYPE_CHECKING:
    from sagline.cli.hosting import ServerAddress
    from sagline.robot.pose import Pose
    from sagline.robot.robot import Robot
    from sagline.viewer.page import Page, Source
    from sagline.viewer.player import Beside, Played
    from sagline.viewer.session import LogFollower, PlayedLog

LOG: Final = ".mcap"
NO_PAGE: Final = "Draw its motion with sagline track, or record a simulation."  # with fewer cables than freedoms
LOOK: Final = 0.5  # time between two checks of a growing file [s]


_RobotOption = Annotated[
    str,
    argument(
        "ROBOT",
        "A preset (see sagline robots), a robot file, robot.yaml, a log of the controller, run.mcap, or a "
        "calibration, found.nc.",
        robot_completions,
    ),
]
_RunOption = Annotated[
    Path | None,
    argument(
        "RUN",
        "A run of this robot by sagline track, a simulation or a log of the controller, which is played; or a "
        "calibration, which is shown.",
    ),
]
_BesideOption = Annotated[
    Path | None, option("RUN", "Another run of the same robot, shown as a ghost at the same time.")
]
_TruthOption = Annotated[
    Path | None,
    option("TWIN.mcap", "For a log of the controller: the log of the twin, which has the true pose of the platform."),
]
_AllowHostOption = Annotated[
    list[str] | None,
    option("NAME", "Further name of this machine, or of a proxy, in the address of a browser. It can be repeated."),
]


def view(
    robot: _RobotOption,
    run: _RunOption = None,
    beside: _BesideOption = None,
    live: Annotated[bool, flag("Follow a log that is still being written.", "--live")] = False,
    truth: _TruthOption = None,
    pose: PoseOption = None,
    mode: Annotated[
        str | None,
        option("NUMBER", "Natural mode to animate at the start: 1, 2, ..., or 'massless 1' for massless cables."),
    ] = None,
    wrench: WrenchOption = None,
    payload: PayloadOption = None,
    host: HostOption = "127.0.0.1",
    port: PortOption = 8080,
    token: Annotated[
        bool, flag("Accept only requests with the token in the printed address.", "--token/--no-token")
    ] = True,
    clients: Annotated[
        int,
        converted_option("NUMBER", "Largest number of pages open at the same time.", "whole_of", least=1, most=1000),
    ] = 32,
    allow_host: _AllowHostOption = None,
    browser: Annotated[bool, flag("Open the page in a browser on this machine.", "--browser/--no-browser")] = True,
) -> int:
    """Show a robot in the browser; its platform can be dragged, and the cables follow.

    Only the printed address opens the page. Over SSH, forward the port (`ssh -L 8080:localhost:8080 ...`), and open
    the printed address on the computer in front of you.

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
    from sagline.cli.hosting import ServerAddress
    from sagline.cli.values import robot_with_payload

    access = {"token": token, "clients": clients, "allow_host": allow_host or ()}
    address = ServerAddress(host, port, browser, access)
    log = next((file for file in (run, Path(robot)) if file is not None and file.suffix.lower() == LOG), None)
    if log is None and (live or truth is not None):
        item, step = "--live" if live else "--truth", "Give one: sagline view run.mcap."
        raise InvalidValueError(item, "given without a log", "a log in MCAP", step)
    found = run if run is not None and _is_calibration(run) else None
    if found is None and Path(robot).suffix.lower() == ".nc":  # not a robot file; the reader reports the error
        found = Path(robot)
    alone = {"--wrench": wrench, "--payload": payload, "--pose": pose, "--mode": mode}
    given = [item for item, value in alone.items() if value is not None]
    if (run is not None or log is not None or found is not None) and given:
        raise InvalidValueError(
            given[0], "given with a run", "a robot alone", "A run has its own values: leave one out."
        )
    if beside is not None and (found is not None or (run is None and log is None)):
        step = "Give both: sagline view cogiro run_a.nc --beside run_b.nc"
        raise InvalidValueError("--beside", "given without a run", "two runs of one robot", step)
    if log is not None:
        return view_log(log, robot if log is run else None, address, live=live, truth=truth, beside=beside)
    if found is not None:
        return view_calibration(found, robot if found is run else None, address)
    start = {"pose": pose, "mode": _mode(mode), "wrench": wrench}
    machine = robot_with_payload(robot, payload)
    if run is not None:
        return view_run(machine, run, address, beside)
    return view_robot(machine, robot, address, None if payload is None else machine.mass, **start)


def view_robot(robot: Robot, name: str | Path, address: ServerAddress, mass: float | None = None, **start: Any) -> int:
    """Serve a robot with a payload [kg] until Ctrl-C; returns the exit code."""
    from sagline.robot.reach import check_cable_count

    check_cable_count(robot, step=NO_PAGE)
    serve, Source = _viewer()
    if start.get("mode"):
        _check_mode(robot, **start)
    return serve(robot, address, source=Source.of_robot(name, mass), **start)


def view_run(robot: Robot, file: Path, address: ServerAddress, beside: Path | None = None) -> int:
    """Serve a run or a simulation of a robot, optionally with another run, until Ctrl-C; returns the exit code."""
    from sagline.files.netcdf import is_of
    from sagline.files.simulation_file import FORMAT
    from sagline.robot.reach import check_cable_count

    serve, Source = _viewer()
    check_cable_count(robot, step=NO_PAGE)
    played = played_in(robot, file)
    other = None if beside is None else played_beside(played.robot, file, beside)
    source = Source.of_file("simulation" if is_of(file, FORMAT) else "plan", file)
    return serve(played.robot, address, played=played, source=source, beside=other)


def view_calibration(file: Path, robot: str | None, address: ServerAddress) -> int:
    """Serve a calibrated robot with its calibration until Ctrl-C; returns the exit code."""
    from sagline.files.calibration_file import load_calibration
    from sagline.files.robot_file import load_robot

    serve, Source = _viewer()
    found = load_calibration(file)
    if robot is not None:
        _check_robot(file, "calibration", found.robot, load_robot(robot))
    return serve(found.robot, address, found=found, source=Source.of_file("calibration", file))


def view_log(
    file: Path,
    robot: str | None,
    address: ServerAddress,
    *,
    live: bool = False,
    truth: Path | None = None,
    beside: Path | None = None,
) -> int:
    """Serve a log of the controller until Ctrl-C; `live`: follow a growing log. Returns the exit code."""
    from sagline.files.robot_file import load_robot

    serve, Source = _viewer()
    from sagline.viewer.session import LogFollower

    follower = LogFollower(file, truth)
    with working(f"waiting for {file.name}" if live else f"reading {file.name}"):
        session = _first_session(follower, [log for log in (file, truth) if log is not None], live=live)
    if robot is not None:
        _check_robot(file, "log", session.robot, load_robot(robot), alone=True)
    other = None if beside is None else played_beside(session.robot, file, beside)
    if not live and not follower.log.complete:
        show_note("Note: ", f"{file} was cut off: its last second is missing.", style="bold")
    return serve(
        session.robot,
        address,
        meanwhile=lambda viewer: _following(follower, viewer) if live else nullcontext(),
        played=session,
        source=Source.of_file("execution", file),
        beside=other,
    )


def played_in(robot: Robot, file: Path) -> Played:
    """The run, simulation or log of a robot in a file; FileError if the file belongs to another robot."""
    from sagline.files.netcdf import is_of
    from sagline.files.plan_file import load_plan
    from sagline.files.simulation_file import FORMAT, load_simulation
    from sagline.viewer.playback import PlayedPlan, PlayedSimulation
    from sagline.viewer.session import LogFollower

    if file.suffix.lower() == LOG:
        session = _first_session(LogFollower(file), [file], live=False)
        _check_robot(file, "log", session.robot, robot)
        return session
    if is_of(file, FORMAT):
        simulation = load_simulation(file)
        _check_robot(file, "simulation", simulation.robot, robot)
        return PlayedSimulation(simulation)
    plan = load_plan(file)
    made_for = plan.state.one_robot
    _check_robot(file, "run", made_for, robot)
    count = len(plan.state.pose) if plan.state.pose.shape else 1
    with working(f"{made_for.name}: confirming {count:,} poses") as line:
        return PlayedPlan(plan, line.progress)


def played_beside(robot: Robot, first: Path, second: Path) -> Beside:
    """The second run of a robot, which is played together with the first. Both runs have the names of their files."""
    from sagline.viewer.player import Beside

    names = (first.name, second.name) if first.name != second.name else (str(first), str(second))
    return Beside(played_in(robot, second), names)


def _check_robot(file: Path, kind: str, made_for: Robot, robot: Robot, *, alone: bool = False) -> None:
    """Raise FileError if `file` belongs to another robot. Its next step is the command that views `file`."""
    if made_for.name != robot.name:
        step = f"View it as: sagline view {file if alone else f'{made_for.name} {file}'}"
        raise FileError(file, f"is a {kind} of {made_for.name}, not of {robot.name}", step)


def _first_session(follower: LogFollower, logs: list[Path], *, live: bool) -> PlayedLog:
    """Cycles in a log. With `live`, the function waits until all `logs` exist and contain a cycle."""
    from sagline.files.mcap_reader import has_begun

    while live and not all(map(has_begun, logs)):
        time.sleep(LOOK)
    while (session := follower.more()) is None:
        if not live:
            file = follower.log.path
            raise FileError(file, "has no cycle", "Record at least one cycle.")
        time.sleep(LOOK)
    return session


@contextmanager
def _following(follower: LogFollower, viewer: Page) -> Iterator[None]:
    """Show new cycles of the log on the page inside the `with` block."""
    over = threading.Event()

    def look() -> None:
        try:
            while not over.wait(LOOK):
                session = follower.more()
                if session is not None:
                    viewer.extend(session)
        except SaglineError as error:
            show_note("Note: ", f"the page no longer follows the log: {error}", style="bold")

    thread = threading.Thread(target=look, name="sagline follows", daemon=True)
    thread.start()
    try:
        yield
    finally:
        over.set()
        thread.join()


def _viewer() -> tuple[Callable[..., int], type[Source]]:
    """The modules of the viewer's server and of its pages; FileError if packages of the viewer are missing."""
    from sagline.cli import hosting

    hosting.check_viewer()
    from sagline.viewer.page import Source

    return hosting.serve, Source


def _is_calibration(file: Path) -> bool:
    from sagline.files.calibration_file import FORMAT as CALIBRATION
    from sagline.files.netcdf import is_of

    return file.suffix.lower() == ".nc" and is_of(file, CALIBRATION)


def _mode(text: str | None) -> str:
    """Name of a mode: "1", "massless 1"; "" for none."""
    words = " ".join((text or "").split())
    if words and not re.fullmatch(r"(massless )?[1-9][0-9]{0,3}", words):
        step = "The page lists the modes."
        raise InvalidValueError("--mode", repr(text), "a number from 1 on, or massless 1, massless 2", step)
    return words


def _check_mode(robot: Robot, pose: Pose | None, mode: str, wrench: Any) -> None:
    """Reject `mode` if it is not in the list of modes at `pose`. If there is no list, the page states the reason."""
    from sagline.dynamics.vibration.vibration import VibrationStatus, vibration
    from sagline.kinematics.inverse import inverse
    from sagline.robot.reach import home_pose
    from sagline.viewer.features.modes import UP_TO, range_of_modes
    from sagline.viewer.swing import mode_of

    found = vibration(inverse(robot, home_pose(robot) if pose is None else pose, wrench=wrench).state, up_to=UP_TO)
    if found.status is VibrationStatus.SOLVED and mode_of(found, mode) is None:
        allowed = f"{range_of_modes(found)}, below {UP_TO:g} Hz"
        raise InvalidValueError("--mode", repr(mode), allowed, "Choose a mode of the list on the page.")
