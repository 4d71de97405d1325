"""Units of co-simulation, run by fmpy: equal to `simulate`, valid, with states, and errors in one line."""

from __future__ import annotations

import zipfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Final

import fmpy
import numpy as np
import pytest
from fmpy.fmi1 import FMICallException
from fmpy.fmi2 import FMU2Slave
from fmpy.fmi3 import FMU3Slave, fmi3LogMessageCallback
from fmpy.validation import validate_fmu

import sagline as sl
from sagline.core.arrays import Array
from sagline.files import compilers
from tests.dynamics.machines import prototype
from tests.files.c_programs import compiled
from tests.refusal import refused

PERIOD: Final = 0.01  # s
PUSH: Final = np.array([60.0, -30.0, 20.0, 2.0, -1.0, 3.0])
PLACE: Final = sl.Pose.from_euler([0.1, 0.05, 1.0], 0.0, 0.0, 0.0)
WRENCH: Final = [f"{name}_{axis}" for name in ("force", "moment") for axis in "xyz"]


def rows_of(result: Any, name: str, axes: Any) -> Array:
    """Columns `name`_`axis` of a result of fmpy."""
    return np.stack([result[f"{name}_{axis}"] for axis in axes], axis=1)


def run_by_fmpy(unit: Path, kind: str, inputs: Array, wrench: Array) -> dict[str, Array]:
    """Motion of a unit: `inputs` (N, m) act during the communication steps, and `wrench` (6,) all the time."""
    assert validate_fmu(str(unit)) == []
    names = [*(f"winch_{kind}_{i}" for i in range(inputs.shape[1])), *WRENCH]
    rows = np.hstack((np.arange(len(inputs))[:, None] * PERIOD, inputs, np.tile(wrench, (len(inputs), 1))))
    signals = np.array([tuple(row) for row in rows], dtype=[(name, float) for name in ("time", *names)])
    end = PERIOD * (len(inputs) - 1)
    found = fmpy.simulate_fmu(str(unit), stop_time=end, step_size=PERIOD, output_interval=PERIOD, input=signals)
    sizes = {"position": "xyz", "quaternion": "xyzw", "velocity": "xyz", "angular_velocity": "xyz"}
    cables = range(inputs.shape[1])
    return {name: rows_of(found, name, axes) for name, axes in {**sizes, "tension": cables, "length": cables}.items()}


def assert_equal(found: dict[str, Array], run: sl.Simulation, tension: float) -> None:
    """Equal to a simulation to 1e-12; tensions, which amplify the rounding of lengths, to `tension` of the largest."""
    pairs = {
        "position": run.pose.position,
        "quaternion": run.pose.quaternion,
        "velocity": run.twist[:, :3],
        "angular_velocity": run.twist[:, 3:],
        "length": run.length,
    }
    for name, expected in pairs.items():
        np.testing.assert_allclose(found[name], expected, rtol=0.0, atol=1e-12, err_msg=name)
    np.testing.assert_allclose(found["tension"], run.tensions, rtol=0.0, atol=tension * run.tensions.max())
    assert np.ptp(run.pose.position, axis=0).min() > 1e-4


def test_lengths_as_inputs_with_pulleys_drums_and_losses(tmp_path: Path) -> None:
    robot = prototype(pulley_radius=0.03, dead_cable=1.0).replace(center_of_mass=[0.02, -0.03, 0.05])
    given: dict[str, Any] = {"winches": "robot", "damping": sl.Damping(1e-3, 0.1)}
    state = sl.inverse(robot, PLACE, wrench=PUSH).state
    unit = sl.export_fmu(robot, tmp_path / "a.fmu", start=state, inputs="lengths", fmi=2, **given)
    lengths = state.unstrained_length + np.cumsum(np.random.default_rng(1).uniform(-2e-3, 2e-3, (31, 8)), axis=0)
    table = np.vstack((state.unstrained_length, lengths[:-1]))
    run = sl.simulate(state, unstrained_length=(PERIOD * np.arange(31), table), record=PERIOD, **given)
    assert_equal(run_by_fmpy(unit, "length", lengths, PUSH), run, 1e-12)


def test_speeds_as_inputs_and_a_wrench_that_differs_from_the_start(tmp_path: Path) -> None:
    robot = sl.load_robot("cogiro")
    assert robot.test_box is not None
    middle = sl.Pose.from_euler(0.5 * (robot.test_box.low + robot.test_box.high), 0.0, 0.0, 0.0)
    state = sl.inverse(robot, middle).state
    unit = sl.export_fmu(robot, tmp_path / "a.fmu")
    speeds = 0.03 * np.sin(0.2 * np.arange(41)[:, None] + np.arange(8))
    table = state.unstrained_length + np.vstack((np.zeros(8), np.cumsum(PERIOD * speeds[:-1], axis=0)))
    run = sl.simulate(state, unstrained_length=(PERIOD * np.arange(41), table), wrench=PUSH, record=PERIOD)
    assert_equal(run_by_fmpy(unit, "speed", speeds, PUSH), run, 1e-11)


@pytest.fixture(scope="module", params=[2, 3])
def unit(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Unit of the prototype at rest under a wrench, with lengths as inputs."""
    file = tmp_path_factory.mktemp("unit") / "prototype.fmu"
    state = sl.inverse(prototype(dead_cable=1.0), PLACE, wrench=PUSH).state
    return sl.export_fmu(state.one_robot, file, start=state, inputs="lengths", fmi=request.param, step=0.5e-3)


class Unit:
    """Instance of a unit, with its log."""

    def __init__(self, file: Path, folder: Path, token: str | None = None) -> None:
        described = fmpy.read_model_description(str(file))
        fmpy.extract(str(file), unzipdir=str(folder))
        kind, self.texts = (FMU2Slave if described.fmiVersion == "2.0" else FMU3Slave), list[str]()
        given = {"modelIdentifier": "sagline", "unzipDirectory": str(folder), "instanceName": "one"}
        self.fmu: Any = kind(guid=token or described.guid or described.instantiationToken, **given)
        self.references = {each.name: each.valueReference for each in described.modelVariables}
        self.starts = {each.name: each.start for each in described.modelVariables}
        self.is_2 = kind is FMU2Slave

    def start(self) -> None:
        """Instantiate the unit and initialize it."""
        if self.is_2:
            from fmpy.fmi2 import (
                calloc,
                fmi2CallbackAllocateMemoryTYPE,
                fmi2CallbackFreeMemoryTYPE,
                fmi2CallbackFunctions,
                fmi2CallbackLoggerTYPE,
                free,
            )

            self.calls = fmi2CallbackFunctions()
            self.calls.logger = fmi2CallbackLoggerTYPE(
                lambda _, name, status, kind, text: self.texts.append(text.decode())
            )
            self.calls.allocateMemory = fmi2CallbackAllocateMemoryTYPE(calloc)
            self.calls.freeMemory = fmi2CallbackFreeMemoryTYPE(free)
            self.fmu.instantiate(callbacks=self.calls)
            self.fmu.setupExperiment(startTime=0.0)
        else:
            self.calls = fmi3LogMessageCallback(lambda *given: self.texts.append(given[3].decode()))
            self.fmu.instantiate(logMessage=self.calls)
        self.fmu.enterInitializationMode()
        self.fmu.exitInitializationMode()

    def read(self, *names: str) -> list[float]:
        """Values of variables."""
        get = self.fmu.getReal if self.is_2 else self.fmu.getFloat64
        return list(get([self.references[name] for name in names]))

    def write(self, **values: float) -> None:
        """Set variables."""
        put = self.fmu.setReal if self.is_2 else self.fmu.setFloat64
        put([self.references[name] for name in values], list(values.values()))

    def step(self, period: float) -> list[float]:
        """One communication step from the present time; returns height and time."""
        (time,) = self.read("time")
        self.fmu.doStep(currentCommunicationPoint=time, communicationStepSize=period)
        return self.read("position_z", "time")


@pytest.fixture
def running(unit: Path, tmp_path: Path) -> Iterator[Unit]:
    """A new instance."""
    made = Unit(unit, tmp_path)
    made.start()
    yield made
    made.fmu.terminate()
    made.fmu.freeInstance()


def test_start_values_keep_the_platform_at_rest(running: Unit) -> None:
    state = sl.inverse(prototype(dead_cable=1.0), PLACE, wrench=PUSH).state
    starts = [float(running.starts[f"winch_length_{i}"]) for i in range(8)]
    np.testing.assert_array_equal(starts, state.unstrained_length)
    assert [float(running.starts[name]) for name in WRENCH] == PUSH.tolist()
    before = running.read("position_x", "position_y", "position_z", "tension_3")
    np.testing.assert_allclose(before[:3], PLACE.position, atol=1e-12)
    for _ in range(20):
        running.step(PERIOD)
    after = running.read("position_x", "position_y", "position_z", "tension_3", "time")
    np.testing.assert_allclose(after[:3], before[:3], atol=1e-9)
    assert after[4] == pytest.approx(20 * PERIOD)


def test_a_saved_state_and_a_reset_repeat_the_motion(running: Unit) -> None:
    running.write(force_z=-200.0)
    first = running.step(PERIOD)
    saved = running.fmu.getFMUState()
    second = running.step(PERIOD)
    assert second[0] < first[0] < 1.0
    running.fmu.setFMUState(saved)
    running.fmu.freeFMUState(saved)
    assert running.step(PERIOD) == second
    running.fmu.reset()
    running.fmu.enterInitializationMode()
    running.fmu.exitInitializationMode()
    running.write(force_z=-200.0)
    assert running.step(PERIOD) == first


@contextmanager
def failing(running: Unit, text: str) -> Iterator[None]:
    """Expect an error with one line in the log, after which the unit continues."""
    running.texts.clear()
    with pytest.raises(FMICallException):
        yield
    assert len(running.texts) == 1
    assert text in running.texts[0]


def test_errors_have_one_line_and_change_nothing(running: Unit) -> None:
    (length,) = running.read("length_2")
    for period in (0.7e-3, 0.0, -PERIOD, np.nan, 1e9):
        with failing(running, "whole multiple of 0.0005 s"):
            running.step(period)
    for wrong in (0.9, np.nan, np.inf, 1e200):  # the dead length is 1 m
        running.write(winch_length_2=wrong)
        with failing(running, "dead length"):
            running.step(PERIOD)
    running.write(winch_length_2=length, force_x=np.nan)
    with failing(running, "not finite"):
        running.step(PERIOD)
    with failing(running, "only inputs can be set"):
        running.write(position_x=1.0)
    running.references["none"] = len(running.references)
    with failing(running, "does not exist"):
        running.read("none")
    running.write(force_x=PUSH[0])
    assert running.step(PERIOD)[0] == pytest.approx(1.0, abs=1e-9)


def test_a_step_that_gives_energy_ends_the_simulation(running: Unit) -> None:
    running.write(moment_x=1e7)
    with failing(running, "energy grows"):
        for _ in range(100):
            running.step(PERIOD)


def test_all_functions_of_the_interface_exist_and_other_tokens_are_refused(unit: Path, tmp_path: Path) -> None:
    other = Unit(unit, tmp_path, token="of another unit")
    prefix = "fmi2" if other.is_2 else "fmi3"
    names = {each for each in dir(other.fmu) if each.startswith(prefix)}
    assert len(names) > 25
    assert [name for name in sorted(names) if not hasattr(other.fmu.dll, name)] == []
    with pytest.raises(Exception, match="nstantiate"):
        other.start()


def test_the_source_in_the_file_compiles_without_warnings(unit: Path, tmp_path: Path) -> None:
    with zipfile.ZipFile(unit) as archive:
        archive.extractall(tmp_path)
    compiled(tmp_path / "sources" / "sagline.c", tmp_path / "again.so", "-shared", "-fPIC", "-O0")


def test_an_export_without_a_compiler_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    robot = sl.load_robot("cogiro")
    monkeypatch.setattr(compilers, "compilers", lambda: [["no-such-compiler"], ["false"]])
    with refused(kind=sl.FileError, file=tmp_path / "a.fmu") as caught:
        sl.export_fmu(robot, tmp_path / "a.fmu")
    assert "false" in str(caught.value)
    assert list(tmp_path.iterdir()) == []
    with refused(kind=sl.FileError, file=tmp_path / "a.zip"):
        sl.export_fmu(robot, tmp_path / "a.zip")
