import re
from dataclasses import fields, replace
from pathlib import Path as FilePath
from typing import Any

import numpy as np
import pytest
import xarray as xr

import sagline as sl
from sagline.dynamics.simulation import EnergyBalance, Occurrence
from sagline.files.seal import seal
from sagline.files.simulation_layout import EVENTS, NODES, SAMPLES, TIME
from tests.files.plans import a_plan
from tests.files.simulations import ROBOT, a_simulation, assert_same

SEAL = len("\nsagline sha256 \n") + 64  # bytes at the end


@pytest.fixture
def saved(tmp_path: FilePath) -> FilePath:
    """A simulation's file, to be spoilt."""
    a_simulation().save(tmp_path / "sim.nc")
    return tmp_path / "sim.nc"


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
    simulation = sl.simulate(state, duration=0.06, events=events, cable_mass=cable_mass, nodes=6)
    assert np.isnan(simulation.length[-1, 3])
    assert [event.kind for event in simulation.events][:2] == ["break", "drop"]
    simulation.save(tmp_path / "sim.nc")
    assert_same(simulation, sl.load_simulation(tmp_path / "sim.nc"))


def test_nothing_of_a_simulation_is_left_out() -> None:
    places = {quantity.place.split(".")[0] for quantity in (TIME, *SAMPLES, NODES)}
    assert places | {"robot", "events", "cable_mass", "step"} == {field.name for field in fields(sl.Simulation)}
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
        assert "name: article-suspended" in data.attrs["robot"]
        assert data.attrs["source"] == f"sagline {sl.__version__}"


def test_plans_and_simulations_are_told_apart(tmp_path: FilePath, saved: FilePath) -> None:
    a_plan().save(tmp_path / "run.nc")
    with pytest.raises(sl.FileError, match=r"run\.nc: is no simulation of sagline, it names no sagline_sim"):
        sl.load_simulation(tmp_path / "run.nc")
    with pytest.raises(sl.FileError, match=r"sim\.nc: is no plan of sagline, it names no sagline_format"):
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


def data_of(file: FilePath) -> xr.Dataset:
    with xr.open_dataset(file, engine="h5netcdf", decode_times=False, mask_and_scale=False) as data:
        return data.load()


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
        ("time", 4, 0.5, r"time\[4\] is 0.5 s; allowed: >= 1 s"),
        ("node_position", (0, 0, 0, 0), np.inf, r"node_position\[0, 0, 0, 0\] is inf; allowed: finite"),
        ("event_cable", 1, 8, r"event_cable\[1\] is 8; allowed: -1 to 7"),
        ("event_cable", 0, -2, r"event_cable\[0\] is -2; allowed: -1 to 7"),
        ("event_time", 0, np.nan, r"event_time\[0\] is nan; allowed: finite"),
        ("event_kind", 0, "", r"event_kind\[0\] is .*''.*; allowed: a word that prints"),
        ("event_kind", 0, "\x1b[31m", r"event_kind\[0\] is .*; allowed: a word that prints"),
        ("axis", 0, "q", "axis is .*; allowed: x, y, z"),
    ],
)
def test_values_that_no_simulation_has(saved: FilePath, name: str, index: Any, value: Any, told: str) -> None:
    assert_refused(saved, edited(data_of(saved), name, index, value), told)


@pytest.mark.parametrize(
    ("edit", "told"),
    [
        (lambda data: data.drop_vars("twist"), "has no twist. Write it again"),
        (lambda data: data.drop_vars("event_kind"), "has no event_kind. Write it again"),
        (lambda data: data.assign_attrs(cable_mass="heavy"), "cable_mass is 'heavy'; allowed: none, lumped, modal"),
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
def test_files_that_were_written_by_others(saved: FilePath, edit: Any, told: str) -> None:
    assert_refused(saved, edit(data_of(saved)), told)


def assert_refused(file: FilePath, data: xr.Dataset, told: str) -> None:
    """A file with the digest that belongs to it, as one who means it would write."""
    encoding = {str(name): {"_FillValue": None} for name in data.variables}
    data.to_netcdf(file, engine="h5netcdf", encoding=encoding)
    seal(file)
    with pytest.raises(sl.FileError, match=told) as caught:
        sl.load_simulation(file)
    assert re.match(r".{,299}$", str(caught.value).replace(str(file), file.name))


def test_what_could_not_be_read_again_is_not_written(tmp_path: FilePath) -> None:
    simulation = a_simulation()
    for wrong, told in (
        (replace(simulation, length=-simulation.length), r"length\[0, 0\] is -"),
        (replace(simulation, cable_mass="some"), "cable_mass is 'some'"),
        (replace(simulation, events=(Occurrence(0.1, "break", 9, 1.0, 2.0),)), r"event_cable\[0\] is 9"),
    ):
        with pytest.raises(sl.InvalidValueError, match=told):
            wrong.save(tmp_path / "sim.nc")
    assert list(tmp_path.iterdir()) == []


def test_the_robot_inside_is_the_robot(saved: FilePath) -> None:
    loaded = sl.load_simulation(saved).robot
    assert loaded.frame_anchors.tobytes() == ROBOT.frame_anchors.tobytes()
    assert loaded.mass == ROBOT.mass
