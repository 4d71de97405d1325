"""Commands that write files, with small inputs, and the contents of a folder."""

import hashlib
import os
import stat
from collections.abc import Callable
from pathlib import Path

import numpy as np
from typer.testing import CliRunner, Result

import sagline as sl
from sagline.cli.main import app
from tests.kinematics.winches import wound

PATH = """\
waypoints:
  - {position: [0.0, 0.0, 1.5]}
  - {position: [0.4, 0.2, 1.6]}
durations: 1.0
rate: 8
"""
Written = Callable[[str], dict[str, str]]  # name of a command -> its files and their contents
ROBOT, MIXED = "article-suspended", "article-mixed"
COMMANDS = {
    "track": ("track", ROBOT, "path.yaml", "--out", "out"),
    "encoder": ("encoder", "wound.nc", "--out", "out/counts.csv"),
    "forward": ("forward", ROBOT, "lengths.csv", "--out", "out"),
    "tension": ("tension", MIXED, "--pose", "1,0.5,2.5", "--out", "out"),
    "article": ("article", "errata", "--out", "out"),
    "convert": ("convert", ROBOT, "--out", "out/robot.yaml"),
    "mjcf": ("convert", ROBOT, "--format", "mjcf", "--out", "out/robot.xml"),
    "export-c": ("export-c", ROBOT, "--out", "out/sagline.c"),
    "export-scl": ("export-scl", "article-prototype", "--out", "out/plc.scl"),
    "export-fmu": ("export-fmu", ROBOT, "--out", "out/robot.fmu"),
    "export-linuxcnc": ("export-linuxcnc", ROBOT, "--out", "out/cablekins.c"),
    "new": ("new", "out/mine.yaml", "--force"),
}


def prepare(folder: Path) -> None:
    """Write the inputs of the commands."""
    (folder / "path.yaml").write_text(PATH)
    plan = sl.inverse(sl.load_robot(ROBOT), sl.Pose([[0.0, 0.0, 1.5], [0.1, 0.0, 1.5]], np.stack([np.eye(3)] * 2)))
    head = ",".join(f"L{i} [m]" for i in range(plan.unstrained_length.shape[1]))
    np.savetxt(folder / "lengths.csv", plan.unstrained_length, delimiter=",", header=head, comments="")
    sl.inverse(wound(), sl.Pose([0.0, 0.0, 2.0], np.eye(3))).save(folder / "wound.nc")
    (folder / "out").mkdir()


def ended(*words: str) -> Result:
    """Result of a command in this process."""
    return CliRunner().invoke(app, words, input="\n" * 9)


def tree(folder: Path) -> dict[str, str]:
    """Contents of a folder: each path with its kind and content; links are not followed."""
    return {str(place.relative_to(folder)): _kind_and_content(place) for place in sorted(folder.rglob("*"))}


def _kind_and_content(place: Path) -> str:
    mode = os.lstat(place).st_mode
    if stat.S_ISLNK(mode):
        return f"link to {os.readlink(place)}"
    if not stat.S_ISREG(mode):
        return f"kind {stat.S_IFMT(mode)}"
    content = place.read_bytes()
    return f"{len(content)} bytes {hashlib.sha256(content).hexdigest()}"
