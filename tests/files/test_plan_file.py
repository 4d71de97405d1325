import resource
from operator import attrgetter
from pathlib import Path as FilePath

import h5py
import numpy as np
import pytest
import xarray as xr

import sagline as sl
from sagline.errors import FileError
from sagline.files.robot_file import dump_robot

SUSPENDED = sl.load_robot("article-suspended")
OUTSIDE = sl.quintic_path([(0.0, 0.0, 1.5), (7.2, 3.0, 1.5)], durations=5.0, rate=8.0)  # ends outside


def a_plan() -> sl.Plan:
    return sl.inverse(SUSPENDED, OUTSIDE, sl.Empirical(k_p=4.1), sl.Closest("horizontal", 0.1))


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


PLACES = (
    *(
        f"state.cables.{name}"
        for name in ("unstrained_length", "chord_tension", "horizontal_tension", "vertical_force")
    ),
    *(f"state.cables.{name}" for name in ("span", "rise", "status")),
    *("state.pose.position", "state.pose.quaternion", "state.wrench"),
    *("status", "shortfall", "wrench_residual", "blocking", "farkas", "needed"),
)
PATH_PLACES = ("path.time", "path.twist", "path.twist_rate", "path.jerk", "path.pose.position", "path.pose.quaternion")


def assert_same(plan: sl.Plan, other: sl.Plan) -> None:
    for place in PLACES + (() if plan.path is None else PATH_PLACES):
        mine, theirs = (np.asarray(attrgetter(place)(p)) for p in (plan, other))
        assert (mine.dtype, mine.shape) == (theirs.dtype, theirs.shape), place
        assert mine.tobytes() == theirs.tobytes(), place
        assert not theirs.flags.writeable
    assert plan.tension == other.tension
    assert plan.state.cables.model == other.state.cables.model
    assert dump_robot(plan.state.one_robot) == dump_robot(other.state.one_robot)
    assert (plan.path is None) == (other.path is None)


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
    matrices = sl.structure_matrix(SUSPENDED, plan.state.pose[37:])
    y, needed = plan.farkas[37:], plan.needed[37:]
    along = np.einsum("nk,nki->ni", y, matrices)
    most = np.maximum(along * SUSPENDED.tension_min, along * SUSPENDED.tension_max).sum(axis=1)
    assert (np.einsum("nk,nk->n", y, needed) > most).all()  # no tensions within the limits supply it
    assert np.isnan(plan.farkas[:37]).all()
    with xr.open_dataset(saved, engine="h5netcdf") as data:
        assert [data[name].attrs["units"] for name in ("farkas", "needed")] == ["1, 1/m", "N, N m"]


def test_a_file_from_before_proofs_were_kept(saved: FilePath) -> None:
    with h5py.File(saved, "r+") as file:
        del file["farkas"], file["needed"]
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


def test_files_that_are_no_plan(tmp_path: FilePath, saved: FilePath) -> None:
    half, text, other = tmp_path / "half.nc", tmp_path / "text.nc", tmp_path / "other.nc"
    half.write_bytes(saved.read_bytes()[:20_000])
    text.write_text("time,x,y,z\n")
    xr.Dataset({"a": ("b", [1.0, 2.0])}).to_netcdf(other, engine="h5netcdf")
    reasons = {
        tmp_path / "missing.nc": "does not exist. Check its name",
        tmp_path: "cannot be read .Is a directory",
        half: "is no complete NetCDF file .*truncated.*it may have been cut off",
        text: "is no complete NetCDF file",
        other: "is no plan of sagline, it names no sagline_format",
    }
    for file, reason in reasons.items():
        with pytest.raises(FileError, match=reason):
            sl.load_plan(file)


@pytest.mark.parametrize(
    ("attribute", "value", "reason"),
    [
        ("sagline_format", 2, "is of format 2, written by sagline .* reads up to 1. Install a newer sagline"),
        ("model", "Rope", "model is 'Rope'; allowed: Straight, Elastic, Empirical, Parabolic, Catenary"),
        ("tension", "Guess", "tension is 'Guess'; allowed: Closest, MinimumNorm"),
        ("model_k_p", -1.0, r"k_p is -1 m\^2/s\^4; allowed: >= 0"),
        ("robot", "name: x", "run.nc, robot: .* is missing"),
    ],
)
def test_edited_attributes(saved: FilePath, attribute: str, value: object, reason: str) -> None:
    with h5py.File(saved, "r+") as file:
        file.attrs[attribute] = value
    with pytest.raises(FileError, match=reason):
        sl.load_plan(saved)


@pytest.mark.parametrize("name", ["unstrained_length", "shortfall", "twist"])
def test_a_missing_variable(saved: FilePath, name: str) -> None:
    with h5py.File(saved, "r+") as file:
        del file[name]
    with pytest.raises(FileError, match=f"has no .*{name}.*Write it again"):
        sl.load_plan(saved)


def test_another_robot_in_the_file(saved: FilePath) -> None:
    with h5py.File(saved, "r+") as file:
        file.attrs["robot"] = dump_robot(sl.load_robot("falcon-7"))
    with pytest.raises(FileError, match="has 8 cables, its robot 7"):
        sl.load_plan(saved)
