import importlib
import subprocess
import sys
from pathlib import Path
from types import FunctionType, ModuleType

import pytest

import sagline as sl
from sagline.core.results import Saved, formats
from sagline.core.surface import public_names
from tests.tiers import extended
from tools.size import public_values

# yaml is allowed: numba loads it
PACKAGES = ("matplotlib", "xarray", "h5netcdf", "h5py", "pint", "pydantic", "typer", "rich", "scipy.spatial")
HEAVY = (*PACKAGES, "mcap", "mcap_protobuf", "google.protobuf", "zstandard", "snap7", "pymodbus")
GROUPS = [name for name in sl.__all__ if isinstance(getattr(sl, name), ModuleType)]
TOP = 45  # largest number of listed names without those of groups


def test_every_public_name_exists() -> None:
    assert [name for name in public_names("sagline") if not hasattr(sl, name)] == []
    assert dir(sl) == sorted(sl.__all__)
    assert len(sl.__all__) - len(GROUPS) <= TOP


@pytest.mark.parametrize("name", GROUPS)
def test_a_group_shows_only_its_public_names(name: str) -> None:
    group = getattr(sl, name)
    assert dir(group) == sorted(group.__all__) == sorted(public_names(f"sagline.{name}"))
    assert not [each for each in dir(group) if each.startswith("_") or isinstance(getattr(group, each), ModuleType)]


def test_every_listed_name_is_one_of_a_group() -> None:
    grouped = {id(getattr(getattr(sl, name), each)) for name in GROUPS for each in dir(getattr(sl, name))}
    assert [name for name in set(sl.__all__) - {*GROUPS, "__version__"} if id(getattr(sl, name)) not in grouped] == []


@pytest.mark.parametrize("name", ["kinematics.inverse", "workspaces.workspace", "dynamics.vibration", "plot.robot"])
def test_a_module_does_not_hide_the_function_of_its_name(name: str) -> None:
    module = importlib.import_module(f"sagline.{name}")
    group, _, function = name.partition(".")
    assert isinstance(module, ModuleType)
    assert isinstance(getattr(getattr(sl, group), function), FunctionType)


def test_every_type_with_save_has_a_writer() -> None:
    for kind in public_values().values():
        if isinstance(kind, type) and issubclass(kind, Saved):
            assert callable(formats().writer_of(object.__new__(kind)).save), kind


def test_no_folder_bears_the_name_of_a_public_function() -> None:
    folders = {place.name for place in Path(sl.__file__).parent.iterdir() if place.is_dir()}
    assert folders & set(public_names("sagline")) == set(GROUPS)


def test_an_unknown_name_is_an_attribute_error() -> None:
    with pytest.raises(AttributeError, match="'solve'"):
        _ = sl.solve  # type: ignore[attr-defined]


@extended
def test_import_loads_only_the_core() -> None:
    code = f"import sys, sagline; print([name for name in {HEAVY} if name in sys.modules])"
    out = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True).stdout
    assert out.strip() == "[]"
