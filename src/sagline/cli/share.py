"""`sagline share`: a robot or a run as one HTML page."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Final

import sagline as sl
from sagline.cli import options as opt
from sagline.cli.output import file_of, is_file
from sagline.cli.terminal import show_text, working
from sagline.core.errors import needed_packages
from sagline.files.writing import check_file, create_folder, file_stem, write_text

if TYPE_CHECKING:
    from sagline.share.course import SharedMotion

ENDINGS: Final = (".html", ".htm")
HEAD: Final = 2000  # number of bytes at the start of a page that contain its mark


def share(
    what: str = opt.argument(
        opt.NEEDED,
        "WHAT",
        "A run or a simulation (run.nc) or a log of the controller (run.mcap), which the page plays; or a preset (see "
        "sagline robots) or a robot file (robot.yaml), whose platform can be dragged.",
        completion=opt.robot_completions,
    ),
    out: Path | None = opt.out(None, "run.html or ROBOT.html here"),
) -> None:
    """Write a robot or a run as one HTML page for a phone, a mail or a lecture. It needs no server and no network.

    The page plays a run; in the page of a robot, the platform can be dragged. The page contains the kernels. Mouse,
    touch and keys rotate the view. The file has about 160 kB, and 150 kB more for each minute of a run.

    For example:

        sagline share cogiro
        sagline share own_robot.yaml --out hall.html
        sagline track cogiro own_path.yaml
        sagline share output/cogiro-catenary.nc
        sagline share run.mcap
    """
    from sagline.share.packing import check_module
    from sagline.share.page import course_page, robot_page

    check_module()
    source = Path(what)
    if out is not None and is_file(out) and out.suffix.lower() not in ENDINGS:
        raise sl.FileError(out, "is not a valid name for a page", "Let it end in .html.")
    with working(f"reading {source.name}"):
        found = _found(source)
    robot = found if isinstance(found, sl.Robot) else found.robot
    stem = file_stem(robot.name) if source.suffix == "" else source.stem
    target = _free(Path(f"{stem}.html")) if out is None else check_file(file_of(out, f"{stem}.html"))
    text = robot_page(found) if isinstance(found, sl.Robot) else course_page(found, source.stem)
    create_folder(target.parent)
    write_text(target, text)
    size = len(text.encode())
    amount = f"{size / 1e3:,.0f} kB" if size < 1e6 else f"{size / 1e6:.1f} MB"
    show_text(f"{target.resolve()}: {amount}, opens in any browser, without a network", whole=True)


def _found(source: Path) -> sl.Robot | SharedMotion:
    from sagline.files.calibration_file import FORMAT as CALIBRATION
    from sagline.files.simulation_file import FORMAT as SIMULATION
    from sagline.share.course import SharedMotion

    suffix = source.suffix.lower()
    if suffix == ".mcap":
        return _log(source)
    if suffix != ".nc":
        return sl.load_robot(str(source))
    if SIMULATION.matches(source):
        return SharedMotion.of_simulation(sl.load_simulation(source))
    if CALIBRATION.matches(source):
        return sl.load_calibration(source).robot
    plan = sl.load_plan(source)
    if not plan.state.pose.shape:
        step = "Save a plan of a path, or share the robot."
        raise sl.InvalidValueError("run", "a plan of a single pose", "a plan of a sequence of poses", step)
    return SharedMotion.of_plan(plan)


def _log(source: Path) -> SharedMotion:
    with needed_packages("A page of a log needs it", "viewer"):
        from sagline.share.course import SharedMotion
        from sagline.viewer.session import LogFollower
    session = LogFollower(source).more()
    if session is None:
        raise sl.FileError(source, "has no cycle", "Record at least one cycle.")
    return SharedMotion.of_session(session)


def _free(file: Path) -> Path:
    """Check `file`, the default file. FileError if it exists and is not a page of sagline."""
    from sagline.share.page import MADE

    check_file(file)
    if file.exists() and MADE.encode() not in file.read_bytes()[:HEAD]:
        step = "Give a name of the page with --out; it may be this name."
        raise sl.FileError(file, "exists, and is not a page of sagline", step)
    return file
