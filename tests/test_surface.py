import subprocess
import sys

import pytest

import sagline as sl
from tests.tiers import extended

# yaml is no matter: numba loads it
PACKAGES = ("matplotlib", "xarray", "h5netcdf", "h5py", "pint", "pydantic", "typer", "rich", "scipy.spatial")
HEAVY = (*PACKAGES, "mcap", "mcap_protobuf", "google.protobuf", "zstandard", "snap7", "pymodbus")


def test_every_public_name_is_there() -> None:
    assert [name for name in sl.__all__ if not hasattr(sl, name)] == []
    assert dir(sl) == sorted(sl.__all__)


def test_an_unknown_name_is_an_attribute_error() -> None:
    with pytest.raises(AttributeError, match="'solve'"):
        _ = sl.solve  # type: ignore[attr-defined]


@extended
def test_import_loads_the_core_alone() -> None:
    code = f"import sys, sagline; print([name for name in {HEAVY} if name in sys.modules])"
    out = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True).stdout
    assert out.strip() == "[]"
