"""What `sagline view` plays: a run, a simulation or a log, whichever is in a file."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Final

from sagline.cli.entries import FORWARD
from sagline.cli.terminal import working
from sagline.core.errors import FileError
from sagline.files.netcdf import is_of
from sagline.files.plan_file import load_plan
from sagline.files.simulation_file import FORMAT, load_simulation
from sagline.robot.robot import Robot

if TYPE_CHECKING:
    from sagline.viewer.player import Beside, Played

LOG: Final = ".mcap"


def played_in(robot: Robot, file: Path) -> Played:
    """What is in a file of a robot.

    Raises:
        FileError: If it cannot be read, or is another robot's.
    """
    from sagline.viewer.playback import Playback, Run
    from sagline.viewer.session import LogFollower

    if file.suffix.lower() == LOG:
        session = LogFollower(file).more()
        if session is None:
            raise no_cycle(file)
        check_robot(file, "log", session.robot, robot)
        return session
    if is_of(file, FORMAT):
        simulation = load_simulation(file)
        check_robot(file, "simulation", simulation.robot, robot)
        return Playback(simulation)
    plan = load_plan(file)
    made_for = plan.state.one_robot
    check_robot(file, "run", made_for, robot)
    count = len(plan.state.pose) if plan.state.pose.shape else 1
    with working(f"{made_for.name}: confirming {count:,} poses", FORWARD) as line:
        return Run.of(plan, line.progress)


def played_beside(robot: Robot, first: Path, second: Path) -> Beside:
    """What is in a second file of a robot, to be played beside the first.

    Raises:
        FileError: If it cannot be read, or is another robot's.
    """
    from sagline.viewer.player import Beside

    names = (first.name, second.name) if first.name != second.name else (str(first), str(second))
    return Beside(played_in(robot, second), names)


def check_robot(file: Path, kind: str, made_for: Robot, robot: Robot) -> None:
    """Refuse what is of another robot.

    Raises:
        FileError: If it is.
    """
    if made_for.name != robot.name:
        step = f"View it as: sagline view {made_for.name} {file}"
        raise FileError(file, f"is a {kind} of {made_for.name}, not of {robot.name}", step)


def no_cycle(file: Path) -> FileError:
    """What is said of a log that is empty."""
    return FileError(file, "has no cycle", "Nothing was recorded in it, or it was cut off at once.")
