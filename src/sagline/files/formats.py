"""The module that writes each kind of result, found by the type of the result."""

from __future__ import annotations

import os
from importlib import import_module
from typing import Any, Final

# A module is loaded when a result of its type is saved. Each has a function save(result, file).
MODULES: Final = {
    "Calibration": "calibration_file",
    "CalibrationPoses": "calibration_poses_file",
    "Execution": "execution_file",
    "FrequencyMap": "frequency_map_file",
    "Plan": "plan_file",
    "Simulation": "simulation_file",
    "Surface": "surface_file",
    "WinchLog": "log_file",
    "Workspace": "workspace_file",
}


def module_of(result: object) -> Any:
    """The module of files that writes a result, or what it derives from; KeyError if there is none."""
    names = [kind.__name__ for kind in type(result).__mro__]
    return import_module(f"sagline.files.{MODULES[next((name for name in names if name in MODULES), names[0])]}")


def save(result: object, file: os.PathLike[str] | str) -> None:
    """Write a result to a file of the format of its type, whole or not at all."""
    module_of(result).save(result, file)
