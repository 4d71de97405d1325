"""Files that the library writes from fixed inputs, by their values."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any

import numpy as np

import sagline as sl
from tests.calibration.made_up import made_up
from tests.files.executions import execution
from tests.record.values import folder_values


def record() -> dict[str, Any]:
    """Values of one file of every kind."""
    robot = sl.load_robot("article-mixed")
    path = sl.quintic_path([(0.0, 0.0, 1.5), (1.0, 0.5, 2.0)], durations=1.0, rate=20)
    plan = sl.inverse(robot, path)
    level = sl.Pose.from_euler(np.array([[0.0, 0.0, z] for z in (1.0, 2.0, 3.0)]), 0.0, 0.0, 0.0)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "robot.yaml").write_text(sl.dump_robot(robot), encoding="utf-8")
        (folder / "robot.xml").write_text(sl.dump_mjcf(robot, level[0]), encoding="utf-8")
        plan.save(folder / "plan.nc")
        sl.inverse(robot, level, tension=sl.Centroid()).save(folder / "poses.nc")
        sl.simulate(plan, damping=sl.Damping(0.01), duration=1.2).save(folder / "simulation.nc")
        sl.workspace(robot, cells=6).save(folder / "workspace.nc")
        sl.frequency_map(robot, level, up_to=5.0).save(folder / "frequencies.nc")
        made_up(count=6).save(folder / "calibration.nc")
        execution().save(folder / "execution.mcap")
        return folder_values(folder)
