import hashlib
import io
import os
import re
import resource
import warnings
from dataclasses import replace
from pathlib import Path as FilePath

import h5py
import numpy as np
import pytest
import xarray as xr

import sagline as sl
from sagline.errors import FileError, SaglineWarning
from sagline.files.robot_file import dump_robot
from tests.files.plans import OUTSIDE, SUSPENDED, a_plan, assert_same

SEAL = len("\nsagline sha256 \n") + 64  # bytes at the end
NOTICE = "run.nc is from before plans carried a digest: damage to it need not show. Save it again to have one"


@pytest.fixture(scope="module")
def content(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    file = tmp_path_factory.mktemp("plan") / "run.nc"
    a_plan().save(file)
    return file.read_bytes()


@pytest.fixture
def saved(tmp_path: FilePath, content: bytes) -> FilePath:
    """A plan's file, to be spoilt."""
    file = tmp_path / "run.nc"
    file.write_bytes(content)
    return file


@pytest.fixture
def old(saved: FilePath) -> FilePath:
    """The same as it was written before files carried digests, to be edited."""
    saved.write_bytes(saved.read_bytes()[:-SEAL])
    with h5py.File(saved, "r+") as file:
        file.attrs["sagline_format"] = 1
    return saved


@pytest.mark.parametrize("model", [sl.Catenary(), sl.Empirical(k_h=4.9, k_p=4.1), sl.Straight()])
@pytest.mark.parametrize("tension", [sl.Closest(), sl.MinimumNorm("horizontal", 0.1)])
@pytest.mark.parametrize(
    "motion",
    [
        OUTSIDE,
        sl.Pose.from_euler((1.0, 2.0, 1.7), 0.1, -0.02, 0.03),
        sl.Pose.from_euler([(0.0, 0.0, 1.5), (0.0, 0.0, 7.0), (1.0, 2.0, 1.7)], 0.1, 0.0, 0.0),
    ],
    ids=["path", "pose", "poses"],
)
def test_a_plan_comes_back_to_the_last_bit(
    tmp_path: FilePath, motion: sl.Path | sl.Pose, model: sl.CableModel, tension: sl.TensionMethod
) -> None:
    plan = sl.inverse(SUSPENDED, motion, model, tension, wrench=(1.0, 2.0, 3.0, 0.1, 0.2, 0.3))
    plan.save(tmp_path / "run.nc")
    assert_same(plan, sl.load_plan(str(tmp_path / "run.nc")))


def test_winches_and_thick_cables_come_back(tmp_path: FilePath) -> None:
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


def test_what_a_reader_finds(saved: FilePath) -> None:
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
        assert "name: article-suspended" in data.attrs["robot"]


def test_a_path_without_jerk_comes_back_without(tmp_path: FilePath) -> None:
    sampled = sl.path_from_samples(OUTSIDE.time, OUTSIDE.pose)
    sl.inverse(SUSPENDED, sampled).save(tmp_path / "run.nc")
    with xr.open_dataset(tmp_path / "run.nc", engine="h5netcdf") as data:
        assert "jerk" not in data
    loaded = sl.load_plan(tmp_path / "run.nc").path
    assert loaded is not None
    assert loaded.jerk is None
    np.testing.assert_array_equal(loaded.twist_rate, sampled.twist_rate)


def test_infeasible_poses_are_kept_and_marked(saved: FilePath) -> None:
    loaded = sl.load_plan(saved)
    (gap,) = loaded.gaps
    assert (gap.first, gap.last, gap.status) == (37, 40, sl.PoseStatus.INFEASIBLE)
    assert gap.shortfall == pytest.approx(np.max(a_plan().shortfall), rel=0.0)
    assert np.isnan(loaded.unstrained_length[37:]).all()
    assert np.isfinite(loaded.unstrained_length[:37]).all()


def test_the_proofs_are_kept(saved: FilePath) -> None:
    plan = sl.load_plan(saved)
    assert plan.farkas is not None
    assert plan.needed is not None
    whole = a_plan()
    assert whole.bracket is not None
    for name in ("farkas", "needed", "bracket", "relief", "at_border"):
        np.testing.assert_array_equal(getattr(plan, name), getattr(whole, name))
    assert (whole.bracket[37:, 0] > 0).all()  # there is something to keep
    assert np.isnan(plan.farkas[:37]).all()
    with xr.open_dataset(saved, engine="h5netcdf") as data:
        assert [data[name].attrs["units"] for name in ("farkas", "needed", "bracket")] == ["1, 1/m", "N, N m", "N"]


def test_a_file_from_before_proofs_were_kept(old: FilePath) -> None:
    saved = old
    with h5py.File(saved, "r+") as file:
        del file["farkas"], file["needed"], file["bracket"], file["relief"], file["at_border"]
    with pytest.warns(SaglineWarning, match=NOTICE):
        plan = sl.load_plan(saved)
    assert plan.farkas is None
    assert plan.needed is None
    plan.save(saved)
    again = sl.load_plan(saved)
    assert again.farkas is None
    np.testing.assert_array_equal(again.unstrained_length, a_plan().unstrained_length)


def test_a_disk_that_fills_up_leaves_nothing(tmp_path: FilePath) -> None:
    plan = a_plan()
    plan.save(tmp_path / "other.nc")  # everything is loaded before space gets short
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (20_000, hard))
    try:
        with pytest.raises(FileError, match=r"run\.nc: cannot be written"):
            plan.save(tmp_path / "run.nc")
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    assert [entry.name for entry in tmp_path.iterdir()] == ["other.nc"]


def test_a_disk_that_fills_up_in_the_middle(tmp_path: FilePath, monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(*_: object, **__: object) -> None:
        raise RuntimeError("Can't decrement id ref count (unable to close file, errno = 28)")

    monkeypatch.setattr("xarray.Dataset.to_netcdf", fail)
    with pytest.raises(FileError, match=r"run\.nc: cannot be written \(Can't decrement id ref count"):
        a_plan().save(tmp_path / "run.nc")
    assert list(tmp_path.iterdir()) == []


def test_files_that_are_no_plan(tmp_path: FilePath, saved: FilePath) -> None:
    half, text, other = tmp_path / "half.nc", tmp_path / "text.nc", tmp_path / "other.nc"
    half.write_bytes(saved.read_bytes()[:20_000])
    text.write_text("time,x,y,z\n")
    xr.Dataset({"a": ("b", [1.0, 2.0])}).to_netcdf(other, engine="h5netcdf")
    os.mkfifo(tmp_path / "pipe.nc")
    reasons = {
        tmp_path / "missing.nc": "does not exist. Check its name",
        tmp_path: "is a folder. Give the name of a file in it",
        half: "is damaged, or was cut off. Run sagline track again",
        text: "is another kind of file, no run of sagline track",
        other: "is no plan of sagline, it names no sagline_format",
        tmp_path / "pipe.nc": "is a pipe, not a file. Name a file",  # opening it would wait for ever
        FilePath("/dev/zero"): "is a device, not a file. Name a file",
        tmp_path / "zero\0byte.nc": "is no name that a file can have",
        tmp_path / ("x" * 300): "is no name that a file can have",
    }
    for file, reason in reasons.items():
        with pytest.raises(FileError, match=reason):
            sl.load_plan(file)


@pytest.mark.parametrize(
    ("attribute", "value", "reason"),
    [
        ("sagline_format", 3, "is of format 3, written by sagline .* reads up to 2. Install a newer sagline"),
        ("sagline_format", 2, "is not as it was written: its digest is missing"),
        ("sagline_format", 0, "is of format .*0.*, which never was"),
        ("sagline_format", "two", "is of format 'two', which never was"),
        ("model", "Rope", "model is 'Rope'; allowed: Straight, Elastic, Empirical, Parabolic, Catenary"),
        ("tension", "Guess", "tension is 'Guess'; allowed: Closest, MinimumNorm"),
        ("model_k_p", -1.0, r"k_p is -1 m\^2/s\^4; allowed: >= 0"),
        ("robot", "name: x", "run.nc, robot: .* is missing"),
        ("robot", 3.0, "run.nc, robot: has no keys"),
        ("model_k_p", "four", "k_p is"),
    ],
)
def test_edited_attributes(old: FilePath, attribute: str, value: object, reason: str) -> None:
    with h5py.File(old, "r+") as file:
        file.attrs[attribute] = value
    assert_refused(old, reason)


@pytest.mark.parametrize("name", ["unstrained_length", "shortfall", "twist"])
def test_a_missing_variable(old: FilePath, name: str) -> None:
    with h5py.File(old, "r+") as file:
        del file[name]
    assert_refused(old, f"has no .*{name}.*Write it again")


def test_another_robot_in_the_file(old: FilePath) -> None:
    with h5py.File(old, "r+") as file:
        file.attrs["robot"] = dump_robot(sl.load_robot("falcon-7"))
    assert_refused(old, "has 8 cables, its robot 7")


@pytest.mark.parametrize(
    ("name", "value", "reason"),
    [
        ("unstrained_length", -1.0, r"unstrained_length\[2, 0\] is -1; allowed: >= 0 m, finite, at the solved poses"),
        ("unstrained_length", np.nan, r"unstrained_length\[2, 0\] is nan; allowed: >= 0 m, finite"),
        ("chord_tension", np.inf, r"chord_tension\[2, 0\] is inf; allowed: >= 0 N, finite"),
        ("span", -0.5, r"span\[2, 0\] is -0.5; allowed: >= 0 m"),
        ("rise", np.nan, r"rise\[2, 0\] is nan; allowed: finite, at every pose"),
        ("shortfall", -3.0, r"shortfall\[2\] is -3; allowed: >= 0 N, at any poses"),
        ("farkas", np.inf, r"farkas\[2, 0\] is inf; allowed: finite, at any poses"),
        ("pose_status", 99, r"pose_status is 99 \(without a meaning\); allowed: 0 \(solved\), .*Read it with a newer"),
        ("cable_status", -1, r"cable_status is -1 \(without a meaning\); allowed: 0 \(solved\)"),
        ("quaternion", 2.0, "quaternion"),
        ("time", 1e9, r"time\[3\] is .*allowed: > 1000000000.0 s"),
    ],
)
def test_values_that_no_plan_has(old: FilePath, name: str, value: float, reason: str) -> None:
    with h5py.File(old, "r+") as file:
        file[name][(2, *[0] * (file[name].ndim - 1))] = value
    assert_refused(old, reason)


def test_a_length_where_there_is_no_answer(old: FilePath) -> None:
    with h5py.File(old, "r+") as file:
        file["unstrained_length"][-1, 5] = 3.0
    assert_refused(old, r"unstrained_length\[40, 5\] is 3; allowed: .*at the solved poses alone")


def test_units_types_shapes_and_meanings_are_those_of_the_layout(old: FilePath) -> None:
    content = old.read_bytes()

    def unit(file: h5py.File) -> None:
        file["unstrained_length"].attrs["units"] = "mm"

    def meaning(file: h5py.File) -> None:
        file["pose_status"].attrs["flag_meanings"] = "infeasible solved " + "other " * 20

    def single(file: h5py.File) -> None:
        replaced(file, "unstrained_length", file["unstrained_length"][:].astype(np.float32))

    def turned(file: h5py.File) -> None:
        replaced(file, "twist", file["unstrained_length"][:, :6], ("pose", "cable"))

    def order(file: h5py.File) -> None:
        file["axis"][:] = ["z", "y", "x"]

    edits = {
        unit: "unstrained_length: units is 'mm'; allowed: 'm'",
        meaning: r"pose_status is 0 \(infeasible\); allowed: 0 \(solved\)",
        single: "unstrained_length: type is float32; allowed: float64",
        turned: "twist: shape is 41 pose × .* cable; allowed: 41 pose × 6 twist_part|is damaged, or was cut off",
        order: "axis is .*z.*y.*x.*; allowed: x, y, z",
    }
    for edit, reason in edits.items():
        old.write_bytes(content)
        with h5py.File(old, "r+") as file:
            edit(file)
        assert_refused(old, reason)


def replaced(file: h5py.File, name: str, values: np.ndarray, dimensions: tuple[str, ...] | None = None) -> None:
    before = file[name]
    scales = dimensions or [dimension[0].name for dimension in before.dims]
    attributes = {key: before.attrs[key] for key in ("long_name", "units")}
    del file[name]
    file[name] = values
    for key, value in attributes.items():
        file[name].attrs[key] = value
    for k, scale in enumerate(scales):
        file[name].dims[k].attach_scale(file[scale])


def assert_refused(file: FilePath, reason: str) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SaglineWarning)
        with pytest.raises(FileError, match=reason) as caught:
            sl.load_plan(file)
    assert len(str(caught.value).replace(str(file), file.name)) < 300


def test_what_another_program_has_changed_is_told(saved: FilePath) -> None:
    with h5py.File(saved, "r+") as file:
        file["unstrained_length"][0, 0] += 1e-12  # HDF5 cuts off what follows its part
    assert_refused(saved, "run.nc: is not as it was written: its digest is missing. Run sagline track again")
    with xr.open_dataset(saved, engine="h5netcdf") as data:
        data.to_netcdf(saved.with_name("copy.nc"), engine="h5netcdf")
    assert_refused(saved.with_name("copy.nc"), "is not as it was written: its digest is missing")


def test_what_was_added_behind_is_told(saved: FilePath) -> None:
    content = saved.read_bytes()
    saved.write_bytes(content + b"\n")
    assert_refused(saved, "is not as it was written: its digest is missing")
    saved.write_bytes(content[:-SEAL] + b"\0" + content[-SEAL:])
    assert_refused(saved, "is not as it was written: it was damaged or edited. Run sagline track again")


def test_the_digest_is_that_of_everything_before_it(saved: FilePath) -> None:
    content = saved.read_bytes()
    assert content[-SEAL:].decode() == f"\nsagline sha256 {hashlib.sha256(content[:-SEAL]).hexdigest()}\n"
    assert h5py.File(io.BytesIO(content[:-SEAL])).attrs["sagline_format"] == 2


def test_what_could_not_be_read_again_is_not_written(tmp_path: FilePath) -> None:
    class Own(sl.Catenary):
        pass

    plan = sl.inverse(SUSPENDED, sl.Pose([0.0, 0.0, 1.5], np.eye(3)))
    cables = replace(plan.state.cables, model=Own())
    lengths = replace(plan.state.cables, unstrained_length=-plan.unstrained_length)
    for state, reason in ((cables, "model is Own; allowed: Straight"), (lengths, r"unstrained_length\[0\] is -")):
        with pytest.raises(sl.InvalidValueError, match=reason):
            replace(plan, state=replace(plan.state, cables=state)).save(tmp_path / "run.nc")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("name", "data", "told"),
    [
        ("own_path.yaml", b"waypoints: []", "is a YAML file, no run of sagline track. Give the .nc file"),
        ("lengths.csv", b"L0,L1", "is a CSV file, no run of sagline track"),
        ("robot.xml", b"<a/>", "is an XML file, no run of sagline track"),
        ("run.nc", b"", "is empty, no run of sagline track"),
        ("run.nc", b"CDF\x01" + bytes(100), "is another kind of file, no run of sagline track"),
        ("run.nc", b"\x89HDF\r\n\x1a\n" + bytes(100), "is damaged, or was cut off. Run sagline track again"),
    ],
)
def test_another_file_is_told_by_what_it_is(tmp_path: FilePath, name: str, data: bytes, told: str) -> None:
    (tmp_path / name).write_bytes(data)
    with pytest.raises(sl.FileError) as caught:
        sl.load_plan(tmp_path / name)
    assert told in str(caught.value)
    assert re.search("HDF|synchronously|signature|NetCDF", str(caught.value)) is None


@pytest.mark.parametrize("name", ["x", "x" * 100, "../../evil", "机器人"])
def test_robots_of_any_name(tmp_path: FilePath, name: str) -> None:
    robot = SUSPENDED.replace(name=name)
    sl.inverse(robot, sl.Pose([0.0, 0.0, 1.5], np.eye(3))).save(tmp_path / "run.nc")
    assert sl.load_plan(tmp_path / "run.nc").state.one_robot.name == name


def test_a_folder_of_the_name_of_a_tilde_is_a_folder(tmp_path: FilePath, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("HOME", str(tmp_path / "home"))
    (tmp_path / "~").mkdir()
    plan = sl.inverse(sl.load_robot("cogiro"), sl.Pose([0.0, 0.0, 2.0], np.eye(3)))
    plan.save("~/run.nc")
    assert [str(path.relative_to(tmp_path)) for path in tmp_path.rglob("*.nc")] == ["~/run.nc"]
    np.testing.assert_array_equal(sl.load_plan("~/run.nc").unstrained_length, plan.unstrained_length)
