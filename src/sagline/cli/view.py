"""`sagline view`: a robot or a run in the browser, and the server of the page."""

from __future__ import annotations

import os
import re
import signal
import sys
import threading
import time
import webbrowser
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from socket import gethostname
from types import FrameType
from typing import TYPE_CHECKING, Any, Final

import sagline as sl
from sagline.cli import options as opt
from sagline.cli.terminal import show_note, show_text, working
from sagline.core.errors import needed_packages

if TYPE_CHECKING:
    from sagline.viewer.page import Page, Source
    from sagline.viewer.player import Beside, Played
    from sagline.viewer.session import LogFollower, PlayedLog

LOG: Final = ".mcap"
LATER = "trimesh"  # a package that the viewer imports only when it is needed
LOOK: Final = 0.5  # time between two checks of a growing file [s]


@dataclass(frozen=True)
class ServerOptions:
    """Options of the server of the page."""

    host: str = opt.HOST
    port: int = opt.port(8080)
    token: bool = opt.flag(True, "Accept only requests with the token in the printed address.", "--token/--no-token")
    clients: int = opt.converted(
        32, "NUMBER", "Largest number of pages open at the same time.", opt.whole_of, least=1, most=1000
    )
    allow_host: list[str] | None = opt.option(
        None,
        "NAME",
        "Name of this machine or of a proxy that browsers may use in the address. The option can be repeated.",
    )
    browser: bool = opt.flag(True, "Open the page in a browser on this machine.", "--browser/--no-browser")


def view(
    robot: str = opt.argument(
        opt.NEEDED,
        "ROBOT",
        "A preset (see sagline robots), a robot file (robot.yaml), a log of the controller (run.mcap) or a "
        "calibration (found.nc).",
        completion=opt.robot_completions,
    ),
    run: Path | None = opt.argument(
        None,
        "RUN",
        "A run of sagline track, a simulation or a log of this robot, which the page plays; or a calibration of this "
        "robot, which the page shows.",
    ),
    beside: Path | None = opt.option(None, "RUN", "Another run of the same robot, shown as a ghost at the same time."),
    live: bool = opt.flag(False, "Follow a log that is still being written.", "--live"),
    truth: Path | None = opt.option(
        None, "TWIN.mcap", "For a log of the controller: the log of the twin, which has the true pose of the platform."
    ),
    pose: Any = opt.POSE,
    mode: str | None = opt.option(
        None, "NUMBER", "Natural mode to animate at the start: 1, 2, ..., or 'massless 1' for massless cables."
    ),
    wrench: Any = opt.WRENCH,
    given: Any = opt.GIVEN,
    payload: float | None = opt.PAYLOAD,
    address: ServerOptions = ServerOptions(),
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
    log = next((file for file in (run, Path(robot)) if file is not None and file.suffix.lower() == LOG), None)
    if log is None and (live or truth is not None):
        item, step = "--live" if live else "--truth", "Give one: sagline view run.mcap."
        raise sl.InvalidValueError(item, "given without a log", "a log in MCAP", step)
    found = run if run is not None and _is_calibration(run) else None
    if found is None and Path(robot).suffix.lower() == ".nc":  # not a robot file; the reader raises the error
        found = Path(robot)
    alone = {"--wrench": wrench, "--payload": payload, "--pose": pose, "--mode": mode, "--given": given}
    own = [item for item, value in alone.items() if value is not None]
    if (run is not None or log is not None or found is not None) and own:
        step = "A run has its own values: leave one out."
        raise sl.InvalidValueError(own[0], "given with a run", "a robot alone", step)
    if beside is not None and (found is not None or (run is None and log is None)):
        step = "Give both: sagline view cogiro run_a.nc --beside run_b.nc"
        raise sl.InvalidValueError("--beside", "given without a run", "two runs of one robot", step)
    if log is not None:
        return _view_log(log, robot if log is run else None, address, live=live, truth=truth, beside=beside)
    if found is not None:
        return _view_calibration(found, robot if found is run else None, address)
    start = {"pose": pose, "mode": _mode(mode), "wrench": wrench, "given": given}
    machine = opt.robot_with_payload(robot, payload)
    if run is not None:
        return _view_run(machine, run, address, beside)
    return view_robot(machine, robot, address, None if payload is None else machine.mass, **start)


def view_robot(
    robot: sl.Robot, name: str | Path, address: ServerOptions, mass: float | None = None, **start: Any
) -> int:
    """Serve the page of a robot until Ctrl-C. `mass`: platform with payload [kg]. Returns the exit code."""
    from sagline.workspaces.balanced import check_given

    check_given(robot, start.get("given"))  # raises an error if the pose cannot be computed from a position
    Source = _viewer()
    if start.get("mode"):
        _check_mode(robot, **start)
    return serve(robot, address, source=Source.of_robot(name, mass), **start)


def _view_run(robot: sl.Robot, file: Path, address: ServerOptions, beside: Path | None = None) -> int:
    Source = _viewer()
    from sagline.viewer.playback import PlayedSimulation

    played = _played_in(robot, file)
    other = None if beside is None else _played_beside(played.robot, file, beside)
    source = Source.of_file("simulation" if isinstance(played, PlayedSimulation) else "plan", file)
    return serve(played.robot, address, played=played, source=source, beside=other)


def _view_calibration(file: Path, robot: str | None, address: ServerOptions) -> int:
    Source = _viewer()
    found = sl.load_calibration(file)
    if robot is not None:
        _check_robot(file, "calibration", found.robot, sl.load_robot(robot))
    return serve(found.robot, address, found=found, source=Source.of_file("calibration", file))


def _view_log(
    log: Path, robot: str | None, address: ServerOptions, *, live: bool, truth: Path | None, beside: Path | None = None
) -> int:
    """Serve the page of a log until Ctrl-C. If `live`, the page follows a growing log. Returns the exit code."""
    Source = _viewer()
    from sagline.viewer.session import LogFollower

    follower = LogFollower(log, truth)
    with working(f"waiting for {log.name}" if live else f"reading {log.name}"):
        session = _first_session(follower, [each for each in (log, truth) if each is not None], live=live)
    if robot is not None:
        _check_robot(log, "log", session.robot, sl.load_robot(robot), alone=True)
    other = None if beside is None else _played_beside(session.robot, log, beside)
    if not live and not follower.log.complete:
        show_note("Note: ", f"{log} was cut off: its last second is missing.", style="bold")
    return serve(
        session.robot,
        address,
        meanwhile=lambda viewer: _following(follower, viewer) if live else nullcontext(),
        played=session,
        source=Source.of_file("execution", log),
        beside=other,
    )


def _played_in(robot: sl.Robot, file: Path) -> Played:
    """The run, simulation or log in `file`. FileError if `file` does not belong to `robot`."""
    from sagline.files.simulation_file import FORMAT
    from sagline.viewer.playback import PlayedPlan, PlayedSimulation
    from sagline.viewer.session import LogFollower

    if file.suffix.lower() == LOG:
        session = _first_session(LogFollower(file), [file], live=False)
        _check_robot(file, "log", session.robot, robot)
        return session
    if FORMAT.matches(file):
        simulation = sl.load_simulation(file)
        _check_robot(file, "simulation", simulation.robot, robot)
        return PlayedSimulation(simulation)
    plan = sl.load_plan(file)
    made_for = plan.robot
    _check_robot(file, "run", made_for, robot)
    count = len(plan.state.pose) if plan.state.pose.shape else 1
    with working(f"{made_for.name}: confirming {count:,} poses") as line:
        return PlayedPlan(plan, line.progress)


def _played_beside(robot: sl.Robot, first: Path, second: Path) -> Beside:
    """The run in the file `second`, which is played together with the run in `first`; with the names of both runs."""
    from sagline.viewer.player import Beside

    names = (first.name, second.name) if first.name != second.name else (str(first), str(second))
    return Beside(_played_in(robot, second), names)


def _check_robot(file: Path, kind: str, made_for: sl.Robot, robot: sl.Robot, *, alone: bool = False) -> None:
    """Raise FileError if `made_for` is not `robot`. The message has the command that views `file`."""
    if made_for.name != robot.name:
        step = f"View it as: sagline view {file if alone else f'{made_for.name} {file}'}"
        raise sl.FileError(file, f"is a {kind} of {made_for.name}, not of {robot.name}", step)


def _first_session(follower: LogFollower, logs: list[Path], *, live: bool) -> PlayedLog:
    """The cycles in the log of `follower`. If `live`, the function waits until all `logs` exist and contain a cycle."""
    from sagline.files.mcap_reader import has_begun

    while live and not all(map(has_begun, logs)):
        time.sleep(LOOK)
    while (session := follower.more()) is None:
        if not live:
            raise sl.FileError(follower.log.path, "has no cycle", "Record at least one cycle.")
        time.sleep(LOOK)
    return session


@contextmanager
def _following(follower: LogFollower, viewer: Page) -> Iterator[None]:
    """Inside the `with` block, show new cycles of the log of `follower` on the page `viewer`."""
    over = threading.Event()

    def look() -> None:
        try:
            while not over.wait(LOOK):
                session = follower.more()
                if session is not None:
                    viewer.extend(session)
        except sl.SaglineError as error:
            show_note("Note: ", f"the page no longer follows the log: {error}", style="bold")

    thread = threading.Thread(target=look, name="sagline follows", daemon=True)
    thread.start()
    try:
        yield
    finally:
        over.set()
        thread.join()


def _viewer() -> type[Source]:
    """The class `Source`. FileError if a package that the viewer needs is not installed."""
    with needed_packages("The viewer needs it", "viewer"):
        import sagline.viewer.features  # noqa: F401
        from sagline.viewer.page import Source
    if find_spec(LATER) is None:
        raise sl.FileError.not_installed(LATER, "The viewer needs it", "viewer")
    return Source


def _is_calibration(file: Path) -> bool:
    from sagline.files.calibration_file import FORMAT as CALIBRATION

    return file.suffix.lower() == ".nc" and CALIBRATION.matches(file)


def _mode(text: str | None) -> str:
    """Name of the mode in `text`: "1", "massless 1", or "" for none."""
    words = " ".join((text or "").split())
    if words and not re.fullmatch(r"(massless )?[1-9][0-9]{0,3}", words):
        step = "The page lists the modes."
        raise sl.InvalidValueError("--mode", repr(text), "a number from 1 on, or massless 1, massless 2", step)
    return words


def _check_mode(robot: sl.Robot, pose: sl.Pose | None, mode: str, wrench: Any, given: Any = None) -> None:
    """Reject `mode` if the modes at `pose` do not include it. If there are no modes, the page states the reason."""
    from sagline.robot.reach import home_pose
    from sagline.viewer.features.modes import UP_TO, range_of_modes
    from sagline.viewer.swing import mode_of

    plan = sl.inverse(robot, home_pose(robot) if pose is None else pose, wrench=wrench, given=given)
    found = sl.vibration(plan.state, up_to=UP_TO)
    if found.status is sl.VibrationStatus.SOLVED and mode_of(found, mode) is None:
        allowed = f"{range_of_modes(found)}, below {UP_TO:g} Hz"
        raise sl.InvalidValueError("--mode", repr(mode), allowed, "Choose a mode of the list on the page.")


def serve(
    robot: sl.Robot,
    address: ServerOptions,
    *,
    meanwhile: Callable[[Page], AbstractContextManager[None]] = lambda _: nullcontext(),
    **page: Any,
) -> int:
    """Serve a page until Ctrl-C, inside the context `meanwhile`. `page`: arguments of `Page`. Returns the exit code."""
    from sagline.viewer import server as web
    from sagline.viewer.features import FEATURES
    from sagline.viewer.page import Page

    names = address.allow_host or ()
    where = address.host, address.port, robot.name
    server = web.start_server(*where, token=address.token, clients=address.clients, allow_host=names)
    stopping = threading.Event()

    def stop(number: int, frame: FrameType | None) -> None:
        if not stopping.is_set():
            stopping.set()  # an imported package can catch the exception and continue; trimesh does
        signal.default_int_handler(number, frame)

    if signal.getsignal(signal.SIGINT) is not signal.SIG_IGN:
        signal.signal(signal.SIGINT, stop)  # Ctrl-C is the normal end of the command from here
    try:
        show_text(f"{robot.name} is at {server.url}   (Ctrl-C stops it)", whole=True)
        if not server.access.local:
            who = "who has this address" if server.access.path else "who can reach this machine"
            place = server.url_at(server.access.path, gethostname())
            text = f"on other machines it is {place}. Everyone {who} can see the page and drag the platform."
            show_note("Note: ", text, style="bold")
        viewer = Page(server, FEATURES, robot, stopping=stopping, **page)
        if address.browser and _has_display():
            webbrowser.open(server.url_at(server.access.path_once()))
        with meanwhile(viewer):
            viewer.serve()
    except KeyboardInterrupt:
        stopping.set()
    finally:
        web.stop_server(server)
    if stopping.is_set():
        show_note("", "Stopped.")
    return 0


def _has_display() -> bool:
    """True if a browser can open a window. Over SSH, the browser would open in the terminal."""
    return sys.platform in ("win32", "darwin") or any(map(os.environ.get, ("DISPLAY", "WAYLAND_DISPLAY")))
