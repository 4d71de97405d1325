"""`sagline view run.mcap`: a log of the controller in the browser, also while it grows."""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Final

from sagline.cli.hosting import check_viewer, hosted
from sagline.cli.played import no_cycle, played_beside
from sagline.cli.terminal import note, working
from sagline.core.errors import FileError, SaglineError
from sagline.files.robot_file import load_robot

if TYPE_CHECKING:
    from sagline.robot.robot import Robot
    from sagline.viewer.session import LogFollower, Session
    from sagline.viewer.viewer import Viewer

LOOK: Final = 0.5  # s, between two looks at a file that grows


def view_log(
    file: Path,
    robot: str | None,
    live: bool,
    truth: Path | None,
    host: str,
    port: int,
    *,
    browser: bool,
    beside: Path | None = None,
) -> int:
    """Serve a log until Ctrl-C; returns the exit code.

    Args:
        file: The log.
        robot: Whose it should be; None for whosever it is.
        live: Whether it still grows.
        truth: The log of the twin that was driven.
        host: Address to listen on.
        port: Port to listen on.
        browser: Whether to open one here.
        beside: What is played beside it.

    Raises:
        SaglineError: If a file cannot be read, or nothing can listen there.
    """
    check_viewer()
    from sagline.viewer.session import LogFollower
    from sagline.viewer.state_code import Source

    follower = LogFollower(file, truth)
    with working(f"waiting for {file.name}" if live else f"reading {file.name}"):
        _wait([log for log in (file, truth) if live and log is not None])
        session = _first(follower, live)
    if robot is not None:
        _check_robot(file, load_robot(robot), session.robot)
    source = Source.of_log(file)
    other = None if beside is None else played_beside(session.robot, file, beside)
    if not live:
        if not follower.log.complete:
            note("Note: ", f"{file} was cut off: what was recorded in its last second is not there.", style="bold")
        return hosted(session.robot, session, host, port, browser=browser, source=source, other=other)
    return hosted(
        session.robot,
        session,
        host,
        port,
        browser=browser,
        source=source,
        other=other,
        beside=lambda viewer: _grown(follower, viewer),
    )


def _wait(logs: list[Path]) -> None:
    """Wait until all logs can be read."""
    from sagline.files.mcap_reader import has_begun

    while not all(map(has_begun, logs)):
        time.sleep(LOOK)


def _first(follower: LogFollower, live: bool) -> Session:
    """What is there at first; of a log that grows, as soon as there is a cycle."""
    while (session := follower.more()) is None:
        if not live:
            raise no_cycle(follower.log.path)
        time.sleep(LOOK)
    return session


@contextmanager
def _grown(follower: LogFollower, viewer: Viewer) -> Iterator[None]:
    """While inside, what comes into the log comes onto the page."""
    over = threading.Event()

    def look() -> None:
        try:
            while not over.wait(LOOK):
                session = follower.more()
                if session is not None:
                    viewer.extend(session)
        except SaglineError as error:
            note("Note: ", f"the log is followed no longer: {error}", style="bold")

    thread = threading.Thread(target=look, name="sagline follows", daemon=True)
    thread.start()
    try:
        yield
    finally:
        over.set()
        thread.join()


def _check_robot(file: Path, robot: Robot, made_for: Robot) -> None:
    if made_for.name != robot.name:
        step = f"View it as: sagline view {file}"
        raise FileError(file, f"is a log of {made_for.name}, not of {robot.name}", step)
