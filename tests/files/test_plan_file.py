import hashlib
import io
import os
import re
import resource
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from functools import cache
from pathlib import Path as FilePath

import h5py
import numpy as np
import pytest
import xarray as xr
from syrupy.assertion import SnapshotAssertion

import sagline as sl
from sagline import FileError, dump_robot
from sagline.files import netcdf
from sagline.files.netcdf import seal
from sagline.files.plan_file import FORMAT
from sagline.files.robot_file import parse_robot
from tests.files.plans import OUTSIDE, SUSPENDED, a_plan, assert_same
from tests.files.wording import wording
from tests.refusal import refused
from tests.tiers import extended, wide

SEAL = len("\nsagline sha256 \n") + 64  # bytes at the end


Reader = Callable[[xr.Dataset], sl.Plan]
Parts = tuple[str | None, ...]


@pytest.fixture(scope="module")
def content(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    file = tmp_path_factory.mktemp("plan") / "run.nc"
    a_plan().save(file)
    return file.read_bytes()


@pytest.fixture(scope="module")
def data(content: bytes) -> xr.Dataset:
    """A plan's data set."""
    with xr.open_dataset(io.BytesIO(content), engine="h5netcdf", decode_times=False, mask_and_scale=False) as data:
        return data.load()


@pytest.fixture
def read(monkeypatch: pytest.MonkeyPatch) -> Reader:
    """Read a data set as from an edited file with a valid digest."""
    monkeypatch.setattr(netcdf, "parse_robot", cache(parse_robot))

    def load(data: xr.Dataset) -> sl.Plan:
        monkeypatch.setattr(netcdf, "_read_dataset", lambda *_: data)
        return sl.load_plan("run.nc")

    return load


@pytest.fixture
def saved(tmp_path: FilePath, content: bytes) -> FilePath:
    """File of a plan for modifications."""
    file = tmp_path / "run.nc"
    file.write_bytes(content)
    return file


@pytest.fixture(scope="module")
def loaded(content: bytes, tmp_path_factory: pytest.TempPathFactory) -> sl.Plan:
    """Plan of the file."""
    file = tmp_path_factory.mktemp("loaded") / "run.nc"
    file.write_bytes(content)
    return sl.load_plan(file)


@contextmanager
def edited(saved: FilePath) -> Iterator[h5py.File]:
    """Content of a file with a new digest."""
    with h5py.File(saved, "r+") as file:  # HDF5 removes bytes after its part
        yield file
    seal(saved)


@pytest.mark.parametrize("model", wide([sl.Empirical(k_h=4.9, k_p=4.1), sl.Catenary(), sl.Straight()]))
@pytest.mark.parametrize("tension", wide([sl.MinimumNorm("horizontal", 0.1), sl.Closest()]))
@pytest.mark.parametrize(
    "motion",
    [
        OUTSIDE,
        sl.Pose.from_euler((1.0, 2.0, 1.7), 0.1, -0.02, 0.03),
        sl.Pose.from_euler([(0.0, 0.0, 1.5), (0.0, 0.0, 7.0), (1.0, 2.0, 1.7)], 0.1, 0.0, 0.0),
    ],
    ids=["path", "pose", "poses"],
)
def test_a_plan_is_saved_exactly(
    tmp_path: FilePath, motion: sl.Path | sl.Pose, model: sl.CableModel, tension: sl.TensionMethod
) -> None:
    plan = sl.inverse(SUSPENDED, motion, model, tension, wrench=(1.0, 2.0, 3.0, 0.1, 0.2, 0.3))
    plan.save(tmp_path / "run.nc")
    assert_same(plan, sl.load_plan(str(tmp_path / "run.nc")))


def test_winches_and_diameters_are_saved(tmp_path: FilePath) -> None:
    winches = sl.Winch(np.linspace(0.03, 0.1, 8), dead_cable=4.1, dead_rise=1 / 3, drum_radius=0.06, gear=-20)
    thick = SUSPENDED.cables.replace(diameter=np.linspace(0.003, 0.004, 8), expansion=-1.1e-5)
    robot = SUSPENDED.replace(winches=winches, cables=thick)
    plan = sl.inverse(robot, sl.Pose.from_euler([[0.0, 0.0, 1.5], [1.0, 2.0, 1.5]], 0.0, 0.0, 0.0))
    plan.save(tmp_path / "run.nc")
    loaded = sl.load_plan(tmp_path / "run.nc")
    assert_same(plan, loaded)
    read = loaded.state.one_robot
    for mine, theirs in ((robot.cables, read.cables), (robot.winches, read.winches)):
        assert mine is not None
        assert theirs is not None
        assert {name: field.tobytes() for name, field in mine.known().items()} == {
            name: field.tobytes() for name, field in theirs.known().items()
        }
    assert loaded.state.cables.cable is read.cables


def test_contents_of_the_file(saved: FilePath) -> None:
    plan = a_plan()
    with xr.open_dataset(saved, engine="h5netcdf") as data:
        assert dict(data.sizes) | {"pose": 41, "cable": 8} == dict(data.sizes)
        np.testing.assert_array_equal(data["time"], OUTSIDE.time)
        np.testing.assert_array_equal(data["unstrained_length"], plan.unstrained_length)
        assert {
            name: data[name].attrs.get("units") for name in ("time", "unstrained_length", "shortfall", "twist")
        } == {
            "time": "s",
            "unstrained_length": "m",
            "shortfall": "N",
            "twist": "m/s, rad/s",
        }
        assert all(data[name].attrs["long_name"] for name in data.data_vars)
        status = data["pose_status"]
        meanings = dict(zip(status.attrs["flag_values"], status.attrs["flag_meanings"].split(), strict=True))
        assert [meanings[code] for code in status.values[[0, -1]]] == ["solved", "infeasible"]
        kept = ("model", "model_k_h", "model_k_p", "tension", "tension_variable", "tension_lowest_point_margin")
        assert [data.attrs[name] for name in kept] == ["Empirical", 4.845, 4.1, "Closest", "horizontal", 0.1]
        assert data.attrs["source"] == f"sagline {sl.__version__}"
        assert parse_robot(data.attrs["robot"], "robot").name == "article-suspended"


def test_a_path_without_jerk_is_saved(tmp_path: FilePath) -> None:
    sampled = sl.path_from_samples(OUTSIDE.time, OUTSIDE.pose)
    sl.inverse(SUSPENDED, sampled).save(tmp_path / "run.nc")
    with xr.open_dataset(tmp_path / "run.nc", engine="h5netcdf") as data:
        assert "jerk" not in data
    loaded = sl.load_plan(tmp_path / "run.nc").path
    assert loaded is not None
    assert loaded.jerk is None
    np.testing.assert_array_equal(loaded.twist_rate, sampled.twist_rate)


def test_infeasible_poses_are_saved_and_marked(loaded: sl.Plan) -> None:
    (gap,) = loaded.gaps
    assert (gap.first, gap.last, gap.status) == (37, 40, sl.PoseStatus.INFEASIBLE)
    assert gap.shortfall == pytest.approx(np.max(a_plan().shortfall), rel=0.0)
    assert np.isnan(loaded.unstrained_length[37:]).all()
    assert np.isfinite(loaded.unstrained_length[:37]).all()


def test_proofs_are_saved(loaded: sl.Plan, data: xr.Dataset) -> None:
    plan = loaded
    assert plan.farkas is not None
    assert plan.needed is not None
    whole = a_plan()
    assert whole.bracket is not None
    for name in ("farkas", "needed", "bracket", "relief", "at_border"):
        np.testing.assert_array_equal(getattr(plan, name), getattr(whole, name))
    assert (whole.bracket[37:, 0] > 0).all()  # at least one proof
    assert np.isnan(plan.farkas[:37]).all()
    assert [data[name].attrs["units"] for name in ("farkas", "needed", "bracket")] == ["1, 1/m", "N, N m", "N"]


@extended
def test_a_file_of_an_earlier_version_without_proofs(saved: FilePath) -> None:
    with edited(saved) as file:
        del file["farkas"], file["needed"], file["bracket"], file["relief"], file["at_border"]
    plan = sl.load_plan(saved)
    assert plan.farkas is None
    assert plan.needed is None
    plan.save(saved)
    again = sl.load_plan(saved)
    assert again.farkas is None
    np.testing.assert_array_equal(again.unstrained_length, a_plan().unstrained_length)


def test_a_full_disk_leaves_no_file(tmp_path: FilePath) -> None:
    plan = a_plan()
    plan.save(tmp_path / "other.nc")  # all modules are loaded before space is scarce
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (20_000, hard))
    try:
        with refused(kind=FileError, file=tmp_path / "run.nc") as caught:
            plan.save(tmp_path / "run.nc")
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    assert [entry.name for entry in tmp_path.iterdir()] == ["other.nc"]
    assert "written" in caught.value.reason


def test_a_disk_that_becomes_full_during_writing(tmp_path: FilePath, monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(*_: object, **__: object) -> None:
        raise RuntimeError("Can't decrement id ref count (unable to close file, errno = 28)")

    monkeypatch.setattr("xarray.Dataset.to_netcdf", fail)
    with refused(kind=FileError, file=tmp_path / "run.nc") as caught:
        a_plan().save(tmp_path / "run.nc")
    assert "errno = 28" in caught.value.reason
    assert list(tmp_path.iterdir()) == []


def test_other_files_are_refused(tmp_path: FilePath, saved: FilePath, snapshot: SnapshotAssertion) -> None:
    half, text, other = tmp_path / "half.nc", tmp_path / "text.nc", tmp_path / "other.nc"
    half.write_bytes(saved.read_bytes()[:20_000])
    text.write_text("time,x,y,z\n")
    xr.Dataset({"a": ("b", [1.0, 2.0])}).to_netcdf(other, engine="h5netcdf")
    os.mkfifo(tmp_path / "pipe.nc")
    reasons = []
    for file in (
        *(tmp_path / "missing.nc", tmp_path, half, text, other),
        tmp_path / "pipe.nc",  # opening it would block
        *(FilePath("/dev/zero"), tmp_path / "zero\0byte.nc", tmp_path / ("x" * 300)),
    ):
        with refused(kind=FileError) as caught:
            sl.load_plan(file)
        reasons.append((caught.value.reason, caught.value.next_step))
    assert reasons == snapshot


@pytest.mark.parametrize(
    ("attribute", "value", "parts"),
    [
        ("sagline_format", 4, ("sagline_format", None, None, "Install a newer sagline.")),
        ("sagline_format", 0, ("sagline_format",)),
        ("sagline_format", "two", ("sagline_format", "has the unknown format 'two'")),
        ("model", "Rope", ("model", "'Rope'", "Straight, Elastic, Empirical, Parabolic, Catenary")),
        (
            "tension",
            "Guess",
            (
                "tension",
                "'Guess'",
                (
                    "Closest, MinimumNorm, QuadraticProgram, LowestSum, LowestMaximum, PNorm, Centroid, "
                    "AnalyticCenter, ClosedForm, ImprovedClosedForm, Puncture, PolygonWalk"
                ),
            ),
        ),
        ("model_k_p", -1.0, ("k_p", "-1 m^2/s^4", ">= 0 m^2/s^4, finite")),
        ("robot", "name: x", ("frame_anchors", "missing")),
        ("robot", 3.0, (None, "has no keys at its top level")),
        ("model_k_p", "four", ("k_p", "'four'")),
    ],
)
def test_edited_attributes(read: Reader, data: xr.Dataset, attribute: str, value: object, parts: Parts) -> None:
    with refused(*parts, kind=FileError):
        read(data.assign_attrs({attribute: value}))


@pytest.mark.parametrize("name", ["unstrained_length", "shortfall", "twist"])
def test_a_missing_variable(read: Reader, data: xr.Dataset, name: str) -> None:
    with refused(name, next_step="Write it again; it is incomplete or was edited.", kind=FileError):
        read(data.drop_vars(name))


def test_a_motion_without_times(read: Reader, data: xr.Dataset) -> None:
    with refused(next_step="Write it again; it is incomplete or was edited.", kind=FileError):
        read(data.drop_vars("time"))


def test_another_robot_in_the_file(read: Reader, data: xr.Dataset) -> None:
    with refused("cable", "has 8 cables, its robot 7", kind=FileError):
        read(data.assign_attrs(robot=dump_robot(sl.load_robot("falcon-7"))))


@pytest.mark.parametrize(
    ("name", "value", "parts"),
    [
        ("unstrained_length", -1.0, ("unstrained_length[2, 0]", "-1", ">= 0 m, finite, at the solved poses alone")),
        ("unstrained_length", np.nan, ("unstrained_length[2, 0]", "nan", ">= 0 m, finite, at the solved poses alone")),
        ("chord_tension", np.inf, ("chord_tension[2, 0]", "inf", ">= 0 N, finite, at the solved poses alone")),
        ("span", -0.5, ("span[2, 0]", "-0.5", ">= 0 m, finite, at every pose")),
        ("rise", np.nan, ("rise[2, 0]", "nan", "finite, at every pose")),
        ("shortfall", -3.0, ("shortfall[2]", "-3", ">= 0 N, at any poses")),
        ("farkas", np.inf, ("farkas[2, 0]", "inf", "finite, at any poses")),
        (
            "pose_status",
            99,
            (
                "pose_status",
                "99 (without a meaning)",
                (
                    "0 (solved), 1 (infeasible), 2 (singular), 3 (too_slack), 4 (not_converged), "
                    "5 (no_chord), 6 (not_covered), 7 (unbounded), 100 (no_pose), 8 (borderline), 9 (unstable), "
                    "11 (no_equilibrium)"
                ),
                "Read it with a newer sagline.",
            ),
        ),
        (
            "cable_status",
            -1,
            (
                "cable_status",
                "-1 (without a meaning)",
                "0 (solved), 1 (slack), 2 (no_tension), 3 (below_validity), 4 (too_slack), 5 (not_converged)",
            ),
        ),
        ("quaternion", 2.0, ("quaternion 2: length", "2.2360679775")),
        ("time", 1e9, ("time[3]", "0.375 s", "> 1000000000.0 s, the previous time")),
    ],
)
def test_impossible_values(read: Reader, data: xr.Dataset, name: str, value: float, parts: Parts) -> None:
    values = data[name].values.copy()
    values[(2, *[0] * (values.ndim - 1))] = value
    with refused(*parts, kind=FileError, file="run.nc") as caught:
        read(data.assign({name: (data[name].dims, values, data[name].attrs)}))
    assert len(str(caught.value)) < 320


def test_an_impossible_value_in_a_file(saved: FilePath) -> None:
    with edited(saved) as file:
        file["unstrained_length"][2, 0] = -1.0
    assert_refused(saved, "unstrained_length[2, 0]", "-1")


def test_a_length_at_an_infeasible_pose(read: Reader, data: xr.Dataset) -> None:
    lengths = data["unstrained_length"].copy()
    lengths[-1, 5] = 3.0
    with refused("unstrained_length[40, 5]", "3", ">= 0 m, finite, at the solved poses alone", kind=FileError):
        read(data.assign(unstrained_length=lengths))


def test_units_types_shapes_and_meanings_agree_with_the_layout(read: Reader, data: xr.Dataset) -> None:
    lengths, twist, status = data["unstrained_length"], data["twist"], data["pose_status"]
    other = status.assign_attrs(flag_meanings="infeasible solved " + "other " * 20)
    edits: tuple[tuple[dict[str, xr.DataArray], Parts], ...] = (
        ({"unstrained_length": lengths.assign_attrs(units="mm")}, ("unstrained_length: units", "'mm'", "'m'")),
        ({"unstrained_length": lengths.astype(np.float32)}, ("unstrained_length: type", "float32", "float64")),
        ({"pose_status": other}, ("pose_status", "0 (infeasible)")),
        ({"twist": twist.T}, ("twist: shape", "6 twist_part × 41 pose", "41 pose × 6 twist_part")),
        ({"axis": data["axis"][::-1]}, ("axis", None, "x, y, z")),
    )
    for edit, parts in edits:
        changed = data.drop_vars(list(edit)).assign({name: values.variable for name, values in edit.items()})
        with refused(*parts, kind=FileError):
            read(changed)


def assert_refused(file: FilePath, *parts: str | None, next_step: str | None = None) -> str:
    """Expect an error with these parts, and return its text."""
    item, value, allowed, step = (*parts, None, None, None, None)[:4]
    with refused(item, value, allowed, next_step or step, kind=FileError) as caught:
        sl.load_plan(file)
    assert caught.value.path.name.startswith(file.name)
    assert len(str(caught.value).replace(str(file), file.name)) < 300
    return wording(caught.value, file.parent)


@extended
def test_changes_by_another_program_are_reported(saved: FilePath, snapshot: SnapshotAssertion) -> None:
    with h5py.File(saved, "r+") as file:
        file["unstrained_length"][0, 0] += 1e-12  # HDF5 removes bytes after its part
    assert assert_refused(saved, "digest") == snapshot
    with xr.open_dataset(saved, engine="h5netcdf") as data:
        data.to_netcdf(saved.with_name("copy.nc"), engine="h5netcdf")
    assert_refused(saved.with_name("copy.nc"), "digest")


@extended
def test_a_damaged_file_without_its_digest_is_refused_before_anything_is_read(
    saved: FilePath, monkeypatch: pytest.MonkeyPatch
) -> None:
    """HDF5 may not return from a damaged file."""
    saved.write_bytes(saved.read_bytes()[:-SEAL])
    monkeypatch.setattr("h5py.File", None)
    assert_refused(saved, "digest")
    assert not FORMAT.matches(saved)


def test_bytes_after_the_end_are_reported(saved: FilePath, snapshot: SnapshotAssertion) -> None:
    content = saved.read_bytes()
    saved.write_bytes(content + b"\n")
    assert_refused(saved, "digest")
    saved.write_bytes(content[:-SEAL] + b"\0" + content[-SEAL:])
    assert assert_refused(saved) == snapshot


def test_the_digest_covers_all_bytes_before_it(saved: FilePath) -> None:
    content = saved.read_bytes()
    assert content[-SEAL:].decode() == f"\nsagline sha256 {hashlib.sha256(content[:-SEAL]).hexdigest()}\n"
    assert h5py.File(io.BytesIO(content[:-SEAL])).attrs["sagline_format"] == 2


def test_plans_that_cannot_be_loaded_are_not_written(tmp_path: FilePath) -> None:
    class Own(sl.Catenary):
        pass

    plan = sl.inverse(SUSPENDED, sl.Pose([0.0, 0.0, 1.5], np.eye(3)))
    cables = replace(plan.state.cables, model=Own())
    lengths = replace(plan.state.cables, unstrained_length=-plan.unstrained_length)
    shortest = f"{-plan.unstrained_length[0]:g}"
    for state, item, value in ((cables, "model", "Own"), (lengths, "unstrained_length[0]", shortest)):
        with refused(item, value, kind=sl.InvalidValueError):
            replace(plan, state=replace(plan.state, cables=state)).save(tmp_path / "run.nc")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("name", "data"),
    [
        ("own_path.yaml", b"waypoints: []"),
        ("lengths.csv", b"L0,L1"),
        ("robot.xml", b"<a/>"),
        ("run.nc", b""),
        ("run.nc", b"CDF\x01" + bytes(100)),
        ("run.nc", b"\x89HDF\r\n\x1a\n" + bytes(100)),
    ],
    ids=["YAML", "CSV", "XML", "empty", "NetCDF 3", "damaged"],
)
def test_other_files_are_named_by_their_kind(
    tmp_path: FilePath, name: str, data: bytes, snapshot: SnapshotAssertion
) -> None:
    (tmp_path / name).write_bytes(data)
    with refused(kind=FileError, file=tmp_path / name) as caught:
        sl.load_plan(tmp_path / name)
    assert wording(caught.value, tmp_path) == snapshot
    assert re.search("HDF|synchronously|signature|NetCDF", str(caught.value)) is None


@extended
@pytest.mark.parametrize("name", ["x", "x" * 100, "../../evil", "机器人"])
def test_robots_of_any_name(tmp_path: FilePath, name: str) -> None:
    robot = SUSPENDED.replace(name=name)
    sl.inverse(robot, sl.Pose([0.0, 0.0, 1.5], np.eye(3))).save(tmp_path / "run.nc")
    assert sl.load_plan(tmp_path / "run.nc").state.one_robot.name == name


@extended
def test_a_folder_named_tilde_is_a_folder(tmp_path: FilePath, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("HOME", str(tmp_path / "home"))
    (tmp_path / "~").mkdir()
    plan = sl.inverse(sl.load_robot("cogiro"), sl.Pose([0.0, 0.0, 2.0], np.eye(3)))
    plan.save("~/run.nc")
    assert [str(path.relative_to(tmp_path)) for path in tmp_path.rglob("*.nc")] == ["~/run.nc"]
    np.testing.assert_array_equal(sl.load_plan("~/run.nc").unstrained_length, plan.unstrained_length)


def test_hdf5_of_other_programs_is_refused_without_a_warning(tmp_path: FilePath) -> None:
    with h5py.File(tmp_path / "foreign.nc", "w") as file:
        file["a"], file["b"] = np.ones((3, 4)), np.ones((3, 3))
    for load in (sl.load_plan, sl.load_simulation, sl.load_workspace, sl.load_calibration):
        with pytest.raises(sl.FileError, match=r"foreign\.nc: .*is not a "):
            load(tmp_path / "foreign.nc")
