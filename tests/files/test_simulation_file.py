import re
import shutil
from dataclasses import fields, replace
from pathlib import Path as FilePath
from typing import Any, cast

import numpy as np
import pytest
import xarray as xr

import sagline as sl
from sagline.dynamics.simulation import EnergyBalance, Occurrence
from sagline.files.seal import seal
from sagline.files.simulation_layout import EVENTS, LARGEST, NODES, SAMPLES, TIME
from tests.files.plans import a_plan
from tests.files.simulations import ROBOT, a_simulation, assert_same

SEAL = len("\nsagline sha256 \n") + 64  # bytes at the end


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> FilePath:
    """A simulation's file, to be copied."""
    file = tmp_path_factory.mktemp("simulation") / "sim.nc"
    a_simulation().save(file)
    return file


@pytest.fixture(scope="module")
def data(whole: FilePath) -> xr.Dataset:
    """What is in it."""
    with xr.open_dataset(whole, engine="h5netcdf", decode_times=False, mask_and_scale=False) as data:
        return data.load()


@pytest.fixture
def saved(tmp_path: FilePath, whole: FilePath) -> FilePath:
    """A copy of it, to be spoilt."""
    return FilePath(shutil.copy(whole, tmp_path))


@pytest.mark.parametrize("nodes", [True, False])
@pytest.mark.parametrize("events", [a_simulation().events, ()], ids=["events", "uneventful"])
@pytest.mark.parametrize("robot", ["article-suspended", "falcon-7"])
def test_a_simulation_comes_back_to_the_last_bit(
    tmp_path: FilePath, nodes: bool, events: tuple[Occurrence, ...], robot: str
) -> None:
    simulation = a_simulation(events, nodes, sl.load_robot(robot))
    simulation.save(tmp_path / "sim.nc")
    assert_same(simulation, sl.load_simulation(str(tmp_path / "sim.nc")))


@pytest.mark.parametrize("cable_mass", ["none", "lumped"])
def test_a_broken_cable_and_a_dropped_load_come_back(tmp_path: FilePath, cable_mass: Any) -> None:
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


def test_nothing_of_a_simulation_is_left_out() -> None:
    places = {quantity.place.split(".")[0] for quantity in (TIME, *SAMPLES, LARGEST, NODES)}
    told = {"robot", "events", "cable_mass", "step", "integrator", "winches", "winding", "damping"}
    assert places | told == {field.name for field in fields(sl.Simulation)}
    kept = {quantity.place for quantity in SAMPLES if quantity.place.startswith("energy.")}
    assert kept == {f"energy.{field.name}" for field in fields(EnergyBalance)}
    assert {quantity.place for quantity in EVENTS} == {field.name for field in fields(Occurrence)}


def test_what_a_reader_finds(saved: FilePath) -> None:
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
        assert "name: article-suspended" in data.attrs["robot"]
        assert data.attrs["source"] == f"sagline {sl.__version__}"


def test_plans_and_simulations_are_told_apart(tmp_path: FilePath, saved: FilePath) -> None:
    a_plan().save(tmp_path / "run.nc")
    with pytest.raises(sl.FileError, match=r"run\.nc: is a plan of sagline, no simulation. Read it with load_plan"):
        sl.load_simulation(tmp_path / "run.nc")
    with pytest.raises(sl.FileError, match=r"sim\.nc: is a simulation of sagline, no plan. Read it with load_sim"):
        sl.load_plan(saved)
    (tmp_path / "sim.yaml").write_text("a: 1")
    with pytest.raises(sl.FileError, match=r"is a YAML file, no simulation of sagline. Give the .nc file that a sim"):
        sl.load_simulation(tmp_path / "sim.yaml")


def test_what_another_program_has_changed_is_told(saved: FilePath) -> None:
    content = saved.read_bytes()
    saved.write_bytes(content[:-SEAL])
    with pytest.raises(sl.FileError, match=r"its digest is missing. Save the simulation again"):
        sl.load_simulation(saved)
    saved.write_bytes(content[: len(content) // 2] + b"\1" + content[len(content) // 2 :])
    with pytest.raises(sl.FileError, match=r"it was damaged or edited. Save the simulation again"):
        sl.load_simulation(saved)


def edited(data: xr.Dataset, name: str, index: Any, value: Any) -> xr.Dataset:
    values = data[name].values.copy()
    values[index] = value
    return data.assign({name: (data[name].dims, values, data[name].attrs)})


@pytest.mark.parametrize(
    ("name", "index", "value", "told"),
    [
        ("tensions", (2, 1), -1.0, r"tensions\[2, 1\] is -1; allowed: >= 0 N, finite"),
        ("length", (2, 1), -1.0, r"length\[2, 1\] is -1; allowed: >= 0 m"),
        ("energy_error", 3, np.inf, r"energy_error\[3\] is inf; allowed: finite"),
        ("twist", (0, 0), np.nan, r"twist\[0, 0\] is nan"),
        ("quaternion", (2, 0), 7.0, "quaternion"),
        ("time", 4, 0.5, r"time\[4\] is 0.5 s; allowed: > 1 s"),
        ("time", 4, 1.0, r"time\[4\] is 1 s; allowed: > 1 s"),
        ("energy_error", slice(3, 5), 5.0, r"energy_error\[3\] is 5 J; allowed: .* J, what the other energies leave"),
        ("energy_lost", 3, 0.5, r"energy_error\[3\] is .* J; allowed: .* J, what the other energies leave"),
        ("length", (2, 1), np.nan, r"length\[2, 1\] is nan; allowed: a number: its cable has not broken"),
        ("length", (2, 3), 1.0, r"length\[2, 3\] is 1; allowed: nan: its cable has broken"),
        ("node_position", (2, 1, 4, 2), np.nan, r"node_position\[2, 1, 4, 2\] is nan; allowed: a number"),
        ("node_position", (2, 3, 4, 2), 0.5, r"node_position\[2, 3, 4, 2\] is 0.5; allowed: nan"),
        ("event_kind", 0, "gremlin", r"event_kind\[0\] is 'gremlin'; allowed: break, stall,"),
        ("event_kind", 0, "drop", r"event_cable\[0\] is 3; allowed: -1 for 'drop'"),
        ("event_cable", 0, -1, r"event_cable\[0\] is -1; allowed: 0 to 7 for 'break'"),
        ("event_cable", 2, 3, r"event_cable\[2\] is 3 at 0.5 s; allowed: a cable that is there: 3 broke at 0.1 s"),
        ("event_cable", 0, 4, r"length\[1, 3\] is nan; allowed: a number"),
        ("event_time", 0, 0.5, r"event_time\[1\] is 0.3.* s; allowed: 0.5 to 2 s, in order"),
        ("event_time", 2, 99.0, r"event_time\[2\] is 99 s; allowed: 0.3.* to 2 s, in order"),
        ("event_tension_after", 0, -1.0, r"event_tension_after\[0\] is -1; allowed: >= 0 N"),
        ("node_position", (0, 0, 0, 0), np.inf, r"node_position\[0, 0, 0, 0\] is inf; allowed: finite"),
        ("event_cable", 1, 8, r"event_cable\[1\] is 8; allowed: -1 for 'pick up'"),
        ("event_cable", 0, -2, r"event_cable\[0\] is -2; allowed: 0 to 7 for 'break'"),
        ("event_time", 0, np.nan, r"event_time\[0\] is nan; allowed: finite"),
        ("event_kind", 0, "", r"event_kind\[0\] is .*''.*; allowed: a word that prints"),
        ("event_kind", 0, "\x1b[31m", r"event_kind\[0\] is .*; allowed: a word that prints"),
        ("axis", 0, "q", "axis is .*; allowed: x, y, z"),
    ],
)
def test_values_that_no_simulation_has(
    tmp_path: FilePath, data: xr.Dataset, name: str, index: Any, value: Any, told: str
) -> None:
    assert_refused(tmp_path / "sim.nc", edited(data, name, index, value), told)


@pytest.mark.parametrize(
    ("edit", "told"),
    [
        (lambda data: data.drop_vars("twist"), "has no twist. Write it again"),
        (lambda data: data.drop_vars("event_kind"), "has no event_kind. Write it again"),
        (lambda data: data.assign_attrs(cable_mass="heavy"), "cable_mass is 'heavy'; allowed: none, lumped, modal"),
        (lambda data: data.assign_attrs(cable_mass="none"), "node_position is given; allowed: given for cables with m"),
        (lambda data: data.drop_vars("node_position"), "node_position is not given; allowed: given for cables with m"),
        (
            lambda data: data.assign_attrs(integrator="euler"),
            "integrator is 'euler'; allowed: splitting, runge-kutta, ",
        ),
        (lambda data: data.assign_attrs(integrator="exact"), "integrator is exact for cable_mass lumped"),
        (lambda data: data.assign_attrs(winches="magic"), "winches is 'magic'; allowed: ideal, robot, second-order"),
        (lambda data: data.assign_attrs(winding="none"), "winding is 'none'; allowed: constant, remembered"),
        (lambda data: data.assign_attrs(bandwidth=0.0), "bandwidth is 0 Hz; allowed: > 0"),
        (lambda data: data.assign_attrs(modal_damping=1.0), "modal_damping is 1; allowed: < 1"),
        (lambda data: data.assign_attrs(loss_time="x"), "loss_time is 'x'"),
        (lambda data: data.isel(time=[0]), "time is of 1 samples; allowed: at least the start and the end"),
        (lambda data: data.assign_attrs(step=0.0), "step is 0 s; allowed: > 0"),
        (lambda data: data.assign_attrs(step="x"), "step is"),
        (lambda data: data.assign_attrs(robot="name: x"), "sim.nc, robot: .* is missing"),
        (lambda data: data.assign_attrs(sagline_simulation_format=2), "is of format 2, .* reads up to 1. Install a"),
        (lambda data: data.assign_attrs(sagline_simulation_format="x"), "is of format 'x', which never was"),
        (lambda data: data.isel(cable=slice(7)), "has 7 cables, its robot 8"),
        (lambda data: data.isel(axis=slice(2)), "axis is .*; allowed: x, y, z"),
        (lambda data: data.assign(length=data["length"].astype("f4")), "length: type is float32; allowed: float64"),
        (lambda data: data.assign(length=data["length"].assign_attrs(units="mm")), "length: units is 'mm'"),
        (lambda data: data.assign(length=data["length"].T), "length: shape is 8 cable × 7 time; allowed: 7 time × 8"),
    ],
)
def test_files_that_were_written_by_others(tmp_path: FilePath, data: xr.Dataset, edit: Any, told: str) -> None:
    assert_refused(tmp_path / "sim.nc", edit(data), told)


def test_what_is_edited_above_would_be_read_as_it_is(tmp_path: FilePath, data: xr.Dataset) -> None:
    sealed(tmp_path / "sim.nc", data)
    assert_same(a_simulation(), sl.load_simulation(tmp_path / "sim.nc"))


def sealed(file: FilePath, data: xr.Dataset) -> None:
    """A file with the digest that belongs to it, as one who means it would write."""
    encoding = {str(name): {"_FillValue": None} for name in data.variables}
    data.to_netcdf(file, engine="h5netcdf", encoding=encoding)
    seal(file)


def assert_refused(file: FilePath, data: xr.Dataset, told: str) -> None:
    sealed(file, data)
    with pytest.raises(sl.FileError, match=told) as caught:
        sl.load_simulation(file)
    assert re.match(r".{,299}$", str(caught.value).replace(str(file), file.name))


def test_what_could_not_be_read_again_is_not_written(tmp_path: FilePath) -> None:
    simulation, none, three = a_simulation(), cast("Any", None), cast("Any", 3)
    for wrong, told in (
        (replace(simulation, length=-simulation.length), r"length\[0, 0\] is -"),
        (replace(simulation, cable_mass="some"), "cable_mass is 'some'"),
        (replace(simulation, events=(Occurrence(0.1, "break", 9, 1.0, 2.0),)), r"event_cable\[0\] is 9"),
        (replace(simulation, nodes=None), "node_position is not given"),
        (replace(simulation, damping=none), "damping is None"),
        (replace(simulation, winches=three), "winches is 3"),
    ):
        with pytest.raises(sl.InvalidValueError, match=told):
            wrong.save(tmp_path / "sim.nc")
    assert list(tmp_path.iterdir()) == []


def test_the_robot_inside_is_the_robot(saved: FilePath) -> None:
    loaded = sl.load_simulation(saved).robot
    assert loaded.frame_anchors.tobytes() == ROBOT.frame_anchors.tobytes()
    assert loaded.mass == ROBOT.mass


@pytest.mark.parametrize("time", [0.0, 0.0301, 0.0333, 0.035])
def test_events_at_any_time_leave_a_simulation_that_can_be_saved(tmp_path: FilePath, time: float) -> None:
    """At the start, between records, at the end, which no record falls on."""
    state = sl.inverse(ROBOT, sl.Pose((0.0, 0.0, 1.5), np.eye(3))).state
    simulation = sl.simulate(
        state, duration=0.035, step=1e-4, events=[sl.Drop(5.0, time), sl.Break(3, time), sl.Break(5, time)]
    )
    simulation.save(tmp_path / "sim.nc")
    assert_same(simulation, sl.load_simulation(tmp_path / "sim.nc"))
    assert np.isnan(simulation.length[:, 3]).tolist() == (simulation.time > time).tolist()


def test_small_motions_come_back(tmp_path: FilePath) -> None:
    state = sl.inverse(sl.load_robot("expo2015-lucia"), sl.Pose([-0.6, 0.0, 3.5], np.eye(3))).state
    damping = sl.Damping(modal_damping=0.01)
    push = ([0.0, 0.1], np.outer([0, 1], [3.0, 2.0, -3.0, 1.0, 0.8, 0.5]))
    simulation = sl.simulate(state, duration=0.1, wrench=push, cable_mass="modal", damping=damping)
    assert (simulation.integrator, simulation.damping) == ("exact", damping)
    simulation.save(tmp_path / "sim.nc")
    assert_same(simulation, sl.load_simulation(tmp_path / "sim.nc"))
