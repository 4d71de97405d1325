import itertools
import re
import shutil
from collections.abc import Callable
from dataclasses import fields, replace
from functools import cache
from pathlib import Path as FilePath
from typing import Any, cast

import numpy as np
import pytest
import xarray as xr
from syrupy.assertion import SnapshotAssertion

import sagline as sl
from sagline import EnergyBalance, Occurrence
from sagline.files import netcdf
from sagline.files.netcdf import seal
from sagline.files.robot_file import parse_robot
from sagline.files.simulation_file import EVENTS, LARGEST, NODES, SAMPLES, TIME
from tests.files.plans import a_plan
from tests.files.simulations import HAPPENED, ROBOT, a_simulation, assert_same
from tests.files.wording import wording
from tests.refusal import refused
from tests.tiers import extended, wide

SEAL = len("\nsagline sha256 \n") + 64  # bytes at the end


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> FilePath:
    """File of a simulation."""
    file = tmp_path_factory.mktemp("simulation") / "sim.nc"
    a_simulation().save(file)
    return file


@pytest.fixture(scope="module")
def data(whole: FilePath) -> xr.Dataset:
    """Its data set."""
    with xr.open_dataset(whole, engine="h5netcdf", decode_times=False, mask_and_scale=False) as data:
        return data.load()


@pytest.fixture
def saved(tmp_path: FilePath, whole: FilePath) -> FilePath:
    """A copy of it for modifications."""
    return FilePath(shutil.copy(whole, tmp_path))


@pytest.mark.parametrize(
    ("nodes", "events", "robot"),
    wide(itertools.product((True, False), (HAPPENED, ()), ("article-suspended", "falcon-7"))),
)
def test_a_simulation_is_saved_exactly(
    tmp_path: FilePath, nodes: bool, events: tuple[Occurrence, ...], robot: str
) -> None:
    simulation = a_simulation(events, nodes, sl.load_robot(robot))
    simulation.save(tmp_path / "sim.nc")
    assert_same(simulation, sl.load_simulation(str(tmp_path / "sim.nc")))


@pytest.mark.parametrize("cable_mass", wide(["none", "lumped"]))
def test_a_broken_cable_and_a_dropped_load_are_saved(tmp_path: FilePath, cable_mass: Any) -> None:
    state = sl.inverse(ROBOT, sl.Pose((0.0, 0.0, 1.5), np.eye(3))).state
    events = (sl.Break(cable=3, time=0.02), sl.Drop(mass=5.0, time=0.04))
    settings: dict[str, Any] = {"cable_mass": cable_mass, "nodes": 6, "damping": sl.Damping(1e-4)}
    simulation = sl.simulate(state, duration=0.06, events=events, **settings)
    assert simulation.integrator == ("splitting" if cable_mass == "lumped" else "runge-kutta")
    assert (simulation.winches, simulation.winding, simulation.damping) == ("ideal", "constant", sl.Damping(1e-4))
    assert np.isnan(simulation.length[-1, 3])
    assert [event.kind for event in simulation.events][:2] == ["break", "drop"]
    simulation.save(tmp_path / "sim.nc")
    assert_same(simulation, sl.load_simulation(tmp_path / "sim.nc"))


def test_limits_of_drives_and_pieces_of_broken_cables_are_saved(tmp_path: FilePath) -> None:
    later = Occurrence(0.4, "break", 3, 0.0, 1.0), Occurrence(0.5, "saturate", 0, 1.0, 2.0, "torque")
    happened = (*HAPPENED[:2], *later)
    simulation = a_simulation(happened)
    nodes = np.array(simulation.nodes)
    nodes[2:, 3, [0, 1, 3, 4]] = 0.5  # two pieces, with NaN between them
    simulation = replace(simulation, nodes=nodes)
    simulation.save(tmp_path / "sim.nc")
    again = sl.load_simulation(tmp_path / "sim.nc")
    assert_same(simulation, again)
    assert [event.limit for event in again.events] == [None, None, None, "torque"]
    with refused("event_limit[3]", "'power'"):
        replace(simulation, events=(*happened[:3], replace(happened[3], limit="power"))).save(tmp_path / "sim.nc")


def test_all_fields_of_a_simulation_are_saved() -> None:
    places = {quantity.place.split(".")[0] for quantity in (TIME, *SAMPLES, LARGEST, NODES)}
    told = {"robot", "events", "cable_mass", "step", "integrator", "winches", "winding", "damping", "anchors"}
    assert places | told == {field.name for field in fields(sl.Simulation)}
    kept = {quantity.place for quantity in SAMPLES if quantity.place.startswith("energy.")}
    assert kept == {f"energy.{field.name}" for field in fields(EnergyBalance)}
    assert {quantity.place for quantity in EVENTS} == {field.name for field in fields(Occurrence)}


def test_contents_of_the_file(saved: FilePath) -> None:
    simulation = a_simulation()
    with xr.open_dataset(saved, engine="h5netcdf") as data:
        sizes = {"time": 7, "cable": 8, "node": 5, "event": 3}
        assert dict(data.sizes) | sizes == dict(data.sizes)
        np.testing.assert_array_equal(data["tensions"].sel(time=1.0 / 3.0, cable=2), simulation.tensions[1, 2])
        units = {"time": "s", "length": "m", "energy_lost": "J", "twist": "m/s, rad/s", "event_time": "s"}
        assert {name: data[name].attrs["units"] for name in units} == units
        assert all(data[name].attrs["long_name"] for name in data.data_vars)
        assert data["event_kind"].values.tolist() == ["break", "pick up", "slack"]
        assert data["event_cable"].values.tolist() == [3, -1, 0]
        assert (data.attrs["cable_mass"], data.attrs["step"], data.attrs["step_units"]) == ("lumped", 0.1 / 3.0, "s")
        told = {"integrator": "splitting", "winches": "second-order", "bandwidth": 10.0, "bandwidth_units": "Hz"}
        losses = {"damping_ratio": 0.7, "loss_time": 1e-3, "air_damping": 0.2, "air_damping_units": "N s/m^2"}
        assert told.items() | losses.items() <= {**data.attrs, "robot": ""}.items()
        assert parse_robot(data.attrs["robot"], "robot").name == "article-suspended"
        assert data.attrs["source"] == f"sagline {sl.__version__}"


def test_plans_and_simulations_are_distinguished(
    tmp_path: FilePath, saved: FilePath, snapshot: SnapshotAssertion
) -> None:
    a_plan().save(tmp_path / "run.nc")
    (tmp_path / "sim.yaml").write_text("a: 1")
    for load, file in ((sl.load_simulation, "run.nc"), (sl.load_plan, saved.name), (sl.load_simulation, "sim.yaml")):
        with refused(kind=sl.FileError, file=tmp_path / file) as caught:
            load(tmp_path / file)
        assert wording(caught.value, tmp_path) == snapshot


def test_changes_by_another_program_are_reported(saved: FilePath, snapshot: SnapshotAssertion) -> None:
    content = saved.read_bytes()
    damaged = content[: len(content) // 2] + b"\1" + content[len(content) // 2 :]
    for data in (content[:-SEAL], damaged):
        saved.write_bytes(data)
        with refused(kind=sl.FileError, file=saved) as caught:
            sl.load_simulation(saved)
        assert wording(caught.value, saved.parent) == snapshot


Reader = Callable[[xr.Dataset], sl.Simulation]


@pytest.fixture
def read(monkeypatch: pytest.MonkeyPatch) -> Reader:
    """Read a data set as from an edited file with a valid digest."""
    monkeypatch.setattr(netcdf, "parse_robot", cache(parse_robot))

    def load(data: xr.Dataset) -> sl.Simulation:
        monkeypatch.setattr(netcdf, "_read_dataset", lambda *_: data)
        return sl.load_simulation("sim.nc")

    return load


def edited(data: xr.Dataset, name: str, index: Any, value: Any) -> xr.Dataset:
    values = data[name].values.copy()
    values[index] = value
    return data.assign({name: (data[name].dims, values, data[name].attrs)})


@pytest.mark.parametrize(
    ("name", "index", "value", "parts"),
    [
        ("tensions", (2, 1), -1.0, ("tensions[2, 1]", "-1", ">= 0 N, finite, at every pose")),
        ("length", (2, 1), -1.0, ("length[2, 1]", "-1", ">= 0 m, finite, at any poses")),
        ("energy_error", 3, np.inf, ("energy_error[3]", "inf", "finite, at every pose")),
        ("twist", (0, 0), np.nan, ("twist[0, 0]", "nan")),
        ("quaternion", (2, 0), 7.0, ("quaternion 2: length", "7.06767118786")),
        ("time", 4, 0.5, ("time[4]", "0.5 s", "> 1 s")),
        ("time", 4, 1.0, ("time[4]", "1 s", "> 1 s")),
        ("energy_error", slice(3, 5), 5.0, ("energy_error[3]", "5 J", "-1.05394 J, from the other energies")),
        ("energy_lost", 3, 0.5, ("energy_error[3]", "-1.05394 J", "-0.895963 J, from the other energies")),
        ("length", (2, 1), np.nan, ("length[2, 1]", "nan", "a number: its cable has not broken")),
        ("length", (2, 3), 1.0, ("length[2, 3]", "1", "nan: its cable has broken")),
        (
            "node_position",
            (2, 1, 4, 2),
            np.nan,
            ("node_position[2, 1, 4, 2]", "nan", "a number: its cable has not broken"),
        ),
        ("node_position", (2, 3, 4, 2), 0.5, ("node_position[2, 3, 4, 2]", "0.5", "nan: its cable has broken")),
        (
            "event_kind",
            0,
            "gremlin",
            ("event_kind[0]", "'gremlin'", "break, stall, saturate, slack, drop, pick up, brake"),
        ),
        ("event_kind", 0, "drop", ("event_cable[0]", "3", "-1 for 'drop'")),
        ("event_cable", 0, -1, ("event_cable[0]", "-1", "0 to 7 for 'break'")),
        ("event_cable", 2, 3, ("event_cable[2]", "3 at 0.5 s", "an unbroken cable: 3 broke at 0.1 s")),
        ("event_cable", 0, 4, ("length[1, 3]", "nan", "a number: its cable has not broken")),
        ("event_time", 0, 0.5, ("event_time[1]", "0.333333 s", "0.5 to 2 s, in order")),
        ("event_time", 2, 99.0, ("event_time[2]", "99 s", "0.333333 to 2 s, in order")),
        ("event_tension_after", 0, -1.0, ("event_tension_after[0]", "-1", ">= 0 N, finite, at any poses")),
        ("node_position", (0, 0, 0, 0), np.inf, ("node_position[0, 0, 0, 0]", "inf", "finite, at any poses")),
        ("event_cable", 1, 8, ("event_cable[1]", "8", "-1 for 'pick up'")),
        ("event_cable", 0, -2, ("event_cable[0]", "-2", "0 to 7 for 'break'")),
        ("event_time", 0, np.nan, ("event_time[0]", "nan", "finite, at every pose")),
        ("event_kind", 0, "", ("event_kind[0]", None, "printable characters")),
        ("event_kind", 0, "\x1b[31m", ("event_kind[0]", None, "printable characters")),
        ("axis", 0, "q", ("axis", None, "x, y, z")),
    ],
)
def test_impossible_values(
    read: Reader, data: xr.Dataset, name: str, index: Any, value: Any, parts: tuple[str, ...]
) -> None:
    assert_refused(read, edited(data, name, index, value), parts)


@pytest.mark.parametrize(
    ("edit", "parts"),
    [
        (
            lambda data: data.drop_vars("twist"),
            ("twist", "has no twist", None, "Write it again; it is incomplete or was edited."),
        ),
        (
            lambda data: data.drop_vars("event_kind"),
            ("event_kind", "has no event_kind", None, "Write it again; it is incomplete or was edited."),
        ),
        (lambda data: data.assign_attrs(cable_mass="heavy"), ("cable_mass", "'heavy'", "none, lumped, modal")),
        (
            lambda data: data.assign_attrs(cable_mass="none"),
            ("node_position", "given", "given for cables with mass only"),
        ),
        (
            lambda data: data.drop_vars("node_position"),
            ("node_position", "not given", "given for cables with mass only"),
        ),
        (
            lambda data: data.assign_attrs(integrator="euler"),
            ("integrator", "'euler'", "splitting, runge-kutta, exact"),
        ),
        (lambda data: data.assign_attrs(integrator="exact"), ("integrator", "exact for cable_mass lumped")),
        (lambda data: data.assign_attrs(winches="magic"), ("winches", "'magic'", "ideal, robot, second-order")),
        (lambda data: data.assign_attrs(winding="none"), ("winding", "'none'", "constant, remembered")),
        (lambda data: data.assign_attrs(bandwidth=0.0), ("bandwidth", "0 Hz", "> 0 Hz, finite")),
        (lambda data: data.assign_attrs(modal_damping=1.0), ("modal_damping", "1", "< 1")),
        (lambda data: data.assign_attrs(loss_time="x"), ("loss_time", "'x'")),
        (lambda data: data.isel(time=[0]), ("time", "of 1 samples", "at least the start and the end")),
        (lambda data: data.assign_attrs(step=0.0), ("step", "0 s", "> 0 s, finite")),
        (lambda data: data.assign_attrs(step="x"), ("step", "'x'")),
        (lambda data: data.assign_attrs(robot="name: x"), ("frame_anchors", "missing")),
        (
            lambda data: data.assign_attrs(sagline_simulation_format=3),
            ("sagline_simulation_format", None, None, "Install a newer sagline."),
        ),
        (
            lambda data: data.assign_attrs(sagline_simulation_format="x"),
            ("sagline_simulation_format", "has the unknown format 'x'"),
        ),
        (lambda data: data.isel(cable=slice(7)), ("cable", "has 7 cables, its robot 8")),
        (lambda data: data.isel(axis=slice(2)), ("axis", None, "x, y, z")),
        (lambda data: data.assign(length=data["length"].astype("f4")), ("length: type", "float32", "float64")),
        (lambda data: data.assign(length=data["length"].assign_attrs(units="mm")), ("length: units", "'mm'")),
        (lambda data: data.assign(length=data["length"].T), ("length: shape", "8 cable × 7 time", "7 time × 8 cable")),
    ],
)
def test_files_of_other_programs(read: Reader, data: xr.Dataset, edit: Any, parts: tuple[str, ...]) -> None:
    assert_refused(read, edit(data), parts)


def test_the_unedited_file_is_valid(tmp_path: FilePath, data: xr.Dataset, read: Reader) -> None:
    sealed(tmp_path / "sim.nc", edited(data, "tensions", (2, 1), -1.0))
    with refused("tensions[2, 1]", "-1", file=tmp_path / "sim.nc"):
        sl.load_simulation(tmp_path / "sim.nc")
    sealed(tmp_path / "sim.nc", data)
    assert_same(a_simulation(), sl.load_simulation(tmp_path / "sim.nc"))
    assert_same(a_simulation(), read(data))


def sealed(file: FilePath, data: xr.Dataset) -> None:
    """A file with a valid digest, as by a deliberate change."""
    encoding = {str(name): {"_FillValue": None} for name in data.variables}
    data.to_netcdf(file, engine="h5netcdf", encoding=encoding)
    seal(file)


def assert_refused(read: Reader, data: xr.Dataset, parts: tuple[str, ...]) -> None:
    with refused(*parts, kind=sl.FileError) as caught:
        read(data)
    assert caught.value.path.name.startswith("sim.nc")
    assert re.match(r".{,299}$", str(caught.value))


def test_simulations_that_cannot_be_loaded_are_not_written(tmp_path: FilePath) -> None:
    simulation, none, three = a_simulation(), cast("Any", None), cast("Any", 3)
    for wrong, item, value in (
        (replace(simulation, length=-simulation.length), "length[0, 0]", f"{-simulation.length[0, 0]:g}"),
        (replace(simulation, cable_mass="some"), "cable_mass", "'some'"),
        (replace(simulation, events=(Occurrence(0.1, "break", 9, 1.0, 2.0),)), "event_cable[0]", "9"),
        (replace(simulation, nodes=None), "node_position", "not given"),
        (replace(simulation, damping=none), "damping", "None"),
        (replace(simulation, winches=three), "winches", "3"),
    ):
        with refused(item, value, kind=sl.InvalidValueError):
            wrong.save(tmp_path / "sim.nc")
    assert list(tmp_path.iterdir()) == []


def test_the_file_contains_the_robot(saved: FilePath) -> None:
    loaded = sl.load_simulation(saved).robot
    assert loaded.frame_anchors.tobytes() == ROBOT.frame_anchors.tobytes()
    assert loaded.mass == ROBOT.mass


@pytest.mark.parametrize("time", wide([0.0301, 0.0, 0.0333, 0.035]))
def test_simulations_with_events_at_any_time_can_be_saved(tmp_path: FilePath, time: float) -> None:
    """At the start, between records, and at the end, which is not at a record."""
    state = sl.inverse(ROBOT, sl.Pose((0.0, 0.0, 1.5), np.eye(3))).state
    simulation = sl.simulate(
        state, duration=0.035, step=1e-4, events=[sl.Drop(5.0, time), sl.Break(3, time), sl.Break(5, time)]
    )
    simulation.save(tmp_path / "sim.nc")
    assert_same(simulation, sl.load_simulation(tmp_path / "sim.nc"))
    assert np.isnan(simulation.length[:, 3]).tolist() == (simulation.time > time).tolist()


@extended
def test_small_motions_are_saved(tmp_path: FilePath) -> None:
    state = sl.inverse(sl.load_robot("expo2015-lucia"), sl.Pose([-0.6, 0.0, 3.5], np.eye(3))).state
    damping = sl.Damping(modal_damping=0.01)
    push = ([0.0, 0.1], np.outer([0, 1], [3.0, 2.0, -3.0, 1.0, 0.8, 0.5]))
    simulation = sl.simulate(state, duration=0.1, wrench=push, cable_mass="modal", damping=damping)
    assert (simulation.integrator, simulation.damping) == ("exact", damping)
    simulation.save(tmp_path / "sim.nc")
    assert_same(simulation, sl.load_simulation(tmp_path / "sim.nc"))
