"""NetCDF formats of results, selected by the type of the result."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, Generic, TypeVar

from sagline.core.arguments import file_path, instance
from sagline.files.netcdf import Content, file_errors, read_dataset, write_dataset

if TYPE_CHECKING:
    from xarray import Dataset

T = TypeVar("T")


@dataclass(frozen=True, slots=True, kw_only=True)
class Format(Content, Generic[T]):
    """The NetCDF format of one kind of result."""

    kind: type[T]  # type of the result
    pack: Callable[[T], Dataset]  # function that creates the data set of a result
    # function that creates a result from a data set and a path for messages; None if results are only written
    unpack: Callable[[Path, Dataset], T] | None = None

    def save(self, result: T, file: os.PathLike[str] | str) -> None:
        """Write a result to a file atomically, with a digest at its end."""
        write_dataset(self.pack(instance(result, self.kind, self.name)), file_path(file))

    def load(self, file: os.PathLike[str] | str) -> T:
        """Read a file that `save` wrote."""
        path = file_path(file)
        data = read_dataset(path, self)
        self.format_of(path, data.attrs)
        assert self.unpack is not None
        with file_errors(path):
            return self.unpack(path, data)


# A module is loaded when a result of its type is saved. Each module has a function save(result, file).
MODULES: Final = {
    "Calibration": "calibration_file",
    "CalibrationPoses": "calibration_poses_file",
    "Execution": "execution_file",
    "FrequencyMap": "frequency_map_file",
    "Plan": "plan_file",
    "Simulation": "simulation_file",
    "Surface": "mesh_file",
    "WinchLog": "log_file",
    "Workspace": "workspace_file",
}


def module_of(result: object) -> Any:
    """Find the module that writes results of this type or of a base class; raise KeyError if there is none."""
    names = [kind.__name__ for kind in type(result).__mro__]
    return import_module(f"sagline.files.{MODULES[next((name for name in names if name in MODULES), names[0])]}")


def dataset_of(result: Any) -> Dataset:
    """Data set of a result in its NetCDF format. A result without a format has a table with the dimension row."""
    named = any(kind.__name__ in MODULES for kind in type(result).__mro__)
    form = getattr(module_of(result), "FORMAT", None) if named else None
    if isinstance(form, Format):
        return form.pack(result)
    from xarray import Dataset

    table = result.table()
    return Dataset({name: ("row", values, {"units": table.units[name]}) for name, values in table.columns.items()})


def save(result: object, file: os.PathLike[str] | str) -> None:
    """Write a result to a file atomically, in the format of the result's type."""
    module_of(result).save(result, file)
