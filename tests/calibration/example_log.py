"""The log of the examples and the true robot behind its readings.

`python -m tests.calibration.example_log` writes both again.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Final

import numpy as np

import sagline as sl
from tests.calibration.synthetic import Synthetic, Truth, log_of, true_robot, usual_sensors

EXAMPLES: Final = Path(__file__).parents[2] / "examples"
ERRORS: Final = {
    "frame_anchors": 0.025,
    "length_zero": 0.03,
    "axial_stiffness": 0.1,
    "mass": 0.03,
    "center_of_mass": 0.02,
}
SEED: Final = 60
PAGE: Final = 80  # columns
ROWS: Final = 60


def example_truth() -> Truth:
    """The true robot of `winches_robot.yaml`, with a usual number of decimals."""
    drawn = sl.load_robot(EXAMPLES / "winches_robot.yaml")
    truth = true_robot(drawn, ERRORS, SEED, sensors=usual_sensors())
    robot = truth.robot
    assert robot.winches is not None
    assert robot.winches.length_zero is not None
    rounded = robot.replace(
        name=f"{drawn.name}, as it is",
        frame_anchors=robot.frame_anchors.round(4),
        winches=robot.winches.replace(length_zero=robot.winches.length_zero.round(4)),
        cables=robot.cables.replace(axial_stiffness=robot.cables.axial_stiffness.round(-2)),
        mass=round(robot.mass, 2),
        center_of_mass=robot.center_of_mass.round(4),
        tolerances={},
        notes="True robot of the readings in winches.csv: the drawing with errors.",
    )
    return truth._replace(robot=rounded)


def example_log(robot: sl.Robot) -> Synthetic:
    """Readings of its encoders and load cells with their resolution: whole counts, tenths of a newton.

    Args:
        robot: What it is.
    """
    found = log_of(Truth(robot, np.zeros(robot.cable_count), usual_sensors()), ROWS, SEED)
    counts, cells, commanded = found.log.counts, found.log.load_cells, found.log.commanded
    assert counts is not None
    assert cells is not None
    assert commanded is not None
    angles = np.degrees(commanded.rotation.as_euler("ZYX")).round(1)
    told = sl.Pose.from_euler(commanded.position.round(2), *np.radians(angles).T)
    return found._replace(log=found.log.replace(counts=counts.round(), load_cells=cells.round(1), commanded=told))


def text_of(log: sl.WinchLog) -> str:
    """Text of the log with commanded angles in degrees, which are easier to read than quaternions."""
    assert log.counts is not None
    assert log.load_cells is not None
    assert log.time is not None
    assert log.commanded is not None
    m = log.counts.shape[1]
    names = ["time [s]", *(f"count_{i}" for i in range(m)), *(f"load_cell_{i} [N]" for i in range(m))]
    names += [f"{axis}_commanded [m]" for axis in "xyz"]
    names += [f"{angle}_commanded [deg]" for angle in ("alpha", "beta", "gamma")]
    angles = np.degrees(log.commanded.rotation.as_euler("ZYX")).round(1)
    rows = np.column_stack((log.time, log.counts, log.load_cells, log.commanded.position, angles)) + 0.0
    lines = [
        "# Readings of the winches of winches_robot.yaml at 60 poses at rest.",
        "# length_deviation: 0.5 mm",
        "# tension_deviation: 5 N",
        ",".join(names),
        *(",".join(f"{number:.10g}" for number in row) for row in rows.tolist()),
    ]
    return "\n".join(lines) + "\n"


def robot_text(robot: sl.Robot) -> str:
    """Text of the robot file for 80 columns: a number that all cables have is written once."""
    text = re.sub(rf"\[(\S+)(?:, \1){{{robot.cable_count - 1}}}\]", r"\1", sl.dump_robot(robot))
    lines = (line if len(line) <= PAGE else line.replace(": [", ":\n    [") for line in text.splitlines())
    return "\n".join(lines) + "\n"


def main() -> None:
    """Write the truth and the log."""
    truth = example_truth().robot
    (EXAMPLES / "winches_truth.yaml").write_text(robot_text(truth), encoding="utf-8")
    (EXAMPLES / "winches.csv").write_text(text_of(example_log(truth).log), encoding="utf-8")


if __name__ == "__main__":
    main()
