import pickle
from collections.abc import Callable
from dataclasses import fields
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray
from syrupy.assertion import SnapshotAssertion

import sagline as sl
from sagline import dump_robot
from sagline.calibration.findings import CrossValidation, Direction, Outlier
from sagline.files import calibration_file, netcdf
from sagline.files.calibration_file import FORMAT
from sagline.files.netcdf import _read_dataset
from sagline.files.robot_file import parse_robot
from sagline.robot.tolerances import Provenance
from tests.calibration.made_up import made_up
from tests.files.wording import wording
from tests.refusal import refused
from tests.tiers import extended, wide

TILTED = sl.Pose.from_euler([1.0, -2.0, 0.3], 0.5, 0.1, -0.2)
DETAILS: dict[str, dict[str, Any]] = {
    "as usual": {},
    "nothing beside the numbers": {"outliers": (), "gauge": (), "left_out": {}, "cross_validation": None},
    "one row, of one kind": {"count": 1, "names": ("mass",), "slipped": ()},
    "every kind": {"names": ("frame_anchors", "load_cell_gain", "axial_stiffness", "measuring_frame", "target")},
    "everything else": {
        "sensors": sl.Sensors(
            np.linspace(1e-4, 8e-4, 8), None, [1e-3, 2e-3, 3e-3], 0.01, frame=TILTED, target=[0.1, -0.2, 0.3]
        ),
        "status": sl.CalibrationStatus.NOT_CONVERGED,
        "model": sl.Elastic(),
        "outliers": (Outlier(3, None, "rotation", 0.1, 9.0), Outlier(4, 7, "load cell", -90.0, 18.0)),
        "left_out": {sl.Omission.SLACK: np.array([], dtype=np.int64), sl.Omission.MOVING: np.array([7, 3])},
        "cross_validation": CrossValidation(5, np.nan, 1e-3, np.nan, 5e-3),
        "log": "",
        "date": "2026-03-01T10:11:12+01:00",
    },
}


@cache
def calibration(name: str) -> sl.Calibration:
    found = made_up(**DETAILS[name])
    size = len(found.values)
    covariance = np.where(np.eye(size, dtype=bool), np.inf, found.covariance) if "everything" in name else None
    made = Provenance(found.log, found.date, {"mass": 0.5}, "found")
    changes: dict[str, Any] = {
        "robot": found.robot.replace(calibration=made, tolerances={"mass": 1.0}),
        "covariance": found.covariance if covariance is None else covariance,
        "cannot_tell_apart": (Direction("mass with all else", np.arange(1.0, size + 1), 0.3, "weigh it"),) * 2,
    }
    return sl.Calibration(**{field.name: getattr(found, field.name) for field in fields(found)} | changes)


def assert_same(one: Any, other: Any, place: str = "calibration") -> None:
    """Both have equal fields of equal types to the last bit, and arrays are read-only."""
    if isinstance(one, sl.Robot):
        assert dump_robot(one) == dump_robot(other), place
    elif isinstance(one, np.ndarray):
        assert (one.dtype, one.shape) == (other.dtype, other.shape), place
        assert one.tobytes() == other.tobytes(), place
        assert not other.flags.writeable, place
    elif isinstance(one, dict):
        assert list(one) == list(other), place
        for key in one:
            assert_same(one[key], other[key], f"{place}[{key}]")
    elif type(one) is tuple:
        assert len(one) == len(other), place
        for k, (mine, theirs) in enumerate(zip(one, other, strict=True)):
            assert_same(mine, theirs, f"{place}[{k}]")
    elif hasattr(one, "__dataclass_fields__"):
        assert type(one) is type(other), place
        for field in fields(one):
            assert_same(getattr(one, field.name), getattr(other, field.name), f"{place}.{field.name}")
    else:
        assert type(one) is type(other), place
        assert repr(one) == repr(other), place


@pytest.mark.parametrize("name", wide(["everything else", *list(DETAILS)[:-1]]))
def test_a_loaded_calibration_is_equal(name: str, tmp_path: Path) -> None:
    found = calibration(name)
    found.save(tmp_path / "found.nc")
    assert_same(found, sl.load_calibration(tmp_path / "found.nc"))
    assert_same(found, pickle.loads(pickle.dumps(found)))


def test_numbers_in_the_file_have_units(tmp_path: Path) -> None:
    found = calibration("as usual")
    found.save(tmp_path / "found.nc")
    with xarray.open_dataset(tmp_path / "found.nc", engine="h5netcdf") as data:
        assert data["unstrained_length"].attrs["units"] == "m"
        assert data["tension_deviation"].attrs["units"] == "N"
        assert data["status"].attrs["flag_meanings"].split() == ["found", "doubtful", "not_converged"]
        labels = list(data["parameter_label"].values)
        assert data["value"].values[labels.index("mass")] == found.value_of("mass")[0]
        assert data["parameter_unit"].values[labels.index("mass")] == "kg"
        assert set(data.variables) >= {"residual", "weight", "covariance", "prior_deviation"}
        for variable in data.variables.values():
            assert variable.attrs.get("long_name") or variable.dims in {("axis",), ("quaternion_part",)}


def renamed(data: xarray.Dataset, name: str) -> xarray.Dataset:
    return data.rename({name: f"{name}_"})


def gone(data: xarray.Dataset, name: str) -> xarray.Dataset:
    return data.drop_vars(name)


def of_other_unit(data: xarray.Dataset, name: str) -> xarray.Dataset:
    data[name].attrs["units"] = "mm"
    return data


def of_other_type(data: xarray.Dataset, name: str) -> xarray.Dataset:
    old = data[name]
    return data.assign({name: (old.dims, np.full(old.shape, "x", dtype=object), old.attrs)})


def one_too_few(data: xarray.Dataset, name: str) -> xarray.Dataset:
    old = data[name]
    short = old.values[:-1] if old.ndim else np.stack([old.values] * 2)
    return data.drop_vars(name).assign({name: (("some", *old.dims[1:]), short, old.attrs)})


def far_out(data: xarray.Dataset, name: str) -> xarray.Dataset:
    """An impossible value: NaN, negative, an index out of range, or an unknown word."""
    old = data[name]
    values = old.values.copy()
    kind = values.dtype.kind
    values[(0,) * values.ndim] = {"f": -np.inf, "i": -100, "O": "\x07", "U": "\x07", "T": "\x07", "b": True}[kind]
    return data.assign({name: (old.dims, values, old.attrs)})


EDITS = (renamed, gone, of_other_unit, of_other_type, one_too_few, far_out)
FREE = {  # fields with arbitrary values: text, counts
    (far_out, name) for name in ("degrees_of_freedom", "iterations", "folds", "logarithmic", "prior_stated")
} | {
    (of_other_type, name)
    for name in ("parameter_label", "gauge_name", "gauge_step", "cannot_tell_apart_name", "criticism_name")
}
FREE |= {(of_other_type, "cannot_tell_apart_step"), (far_out, "covariance"), (far_out, "prior_deviation")}


OPTIONAL = {"rotation_deviation", "tension_deviation", "position_deviation", "folds"}  # a sensor or a check is missing


@pytest.fixture
def read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[[xarray.Dataset], sl.Calibration]:
    """Read a data set as from an edited file with a valid digest: only checks of the content remain."""

    monkeypatch.setattr(calibration_file, "parse_robot", cache(parse_robot))

    def load(data: xarray.Dataset) -> sl.Calibration:
        monkeypatch.setattr(netcdf, "_read_dataset", lambda *_: data)
        return sl.load_calibration(tmp_path / "edited.nc")

    return load


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> xarray.Dataset:
    file = tmp_path_factory.mktemp("calibration") / "found.nc"
    calibration("as usual").save(file)
    return _read_dataset(file, FORMAT)


@pytest.mark.parametrize("edit", wide(reversed(EDITS)), ids=lambda edit: edit.__name__)
def test_an_edited_file_is_refused(
    edit: Callable[[xarray.Dataset, str], xarray.Dataset], whole: xarray.Dataset, read: Any, tmp_path: Path
) -> None:
    assert_same(calibration("as usual"), read(whole))
    names = [str(name) for name in whole.variables if name not in whole.coords and whole[name].size]
    assert len(names) > 40
    for name in names:
        if (edit, name) in FREE or (name in OPTIONAL and edit in {renamed, gone}):
            continue
        with refused(kind=sl.FileError) as caught:
            read(edit(whole.copy(deep=True), name))
        assert caught.value.path.name.startswith("edited.nc"), name
        assert len(str(caught.value).removeprefix(str(tmp_path))) < 300, name


@pytest.mark.parametrize(
    "name", wide([FORMAT.key, "robot_before", "left_out", "log", "date", "model", "robot"], first=3)
)
@pytest.mark.parametrize("value", [None, 3.5, "\x07", "nonsense"])
def test_an_edited_attribute_is_refused(name: str, value: Any, whole: xarray.Dataset, read: Any) -> None:
    if (name, value) in {("log", "nonsense"), ("date", "nonsense")}:
        return
    data = whole.copy(deep=True)
    data.attrs[name] = value
    if value is None:
        del data.attrs[name]
    with refused(kind=sl.FileError) as caught:
        read(data)
    assert caught.value.path.name.startswith("edited.nc")


def test_a_robot_of_other_cables_is_refused(whole: xarray.Dataset, read: Any) -> None:
    data = whole.copy(deep=True)
    data.attrs["robot_before"] = dump_robot(sl.load_robot("falcon-7"))
    with refused("robot_before", "of 7 cables", "of 8, as robot", kind=sl.FileError):
        read(data)


@extended
def test_other_files_are_refused(tmp_path: Path, snapshot: SnapshotAssertion) -> None:
    calibration("as usual").save(tmp_path / "found.nc")
    whole = (tmp_path / "found.nc").read_bytes()
    with refused(kind=sl.FileError, file=tmp_path / "found.nc") as caught:
        sl.load_plan(tmp_path / "found.nc")
    assert wording(caught.value, tmp_path) == snapshot
    (tmp_path / "cut.nc").write_bytes(whole[: len(whole) // 2])
    (tmp_path / "changed.nc").write_bytes(whole.replace(b"residual", b"RESIDUAL"))
    (tmp_path / "text.nc").write_text("x")
    for name in ("cut.nc", "changed.nc", "text.nc", "missing.nc"):
        with refused(kind=sl.FileError, file=tmp_path / name):
            sl.load_calibration(tmp_path / name)


def test_a_custom_model_cannot_be_loaded(tmp_path: Path) -> None:
    class Own(sl.Catenary):
        pass

    found = made_up(model=Own())
    with refused("model", "Own", kind=sl.InvalidValueError):
        found.save(tmp_path / "found.nc")
    assert not list(tmp_path.iterdir())
