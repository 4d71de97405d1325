"""A robot with winches and a platform as a unit of co-simulation (FMU): the kernels of `Simulator`, translated to C."""

from __future__ import annotations

import hashlib
import os
import platform
import sys
import tempfile
from pathlib import Path
from typing import Any, Final, Literal, NamedTuple, get_args
from xml.etree import ElementTree
from zipfile import ZIP_DEFLATED, ZipFile

import numpy as np

from sagline.core.arguments import choice, instance, whole_number
from sagline.core.arrays import leaves, owner
from sagline.core.version import __version__
from sagline.dynamics.simulation.simulate import Integrator
from sagline.dynamics.simulation.simulator import Simulator
from sagline.dynamics.simulation.winches import Winches
from sagline.dynamics.vibration.dynamic_stiffness import Damping
from sagline.files.c_source import checked_name, constant_text, filled, origin, reached_parts, translated_kernels
from sagline.files.compilers import compile_library
from sagline.files.writing import atomic_file
from sagline.kernels.dynamics import progress
from sagline.robot.batch import has_routing
from sagline.robot.equilibrium import Equilibrium, HasState
from sagline.robot.pose import PoseLike
from sagline.robot.reach import home_pose
from sagline.robot.robot import Robot

Inputs = Literal["speeds", "lengths"]
NAME: Final = "sagline"  # of the library and its source inside the file
PERIOD: Final = 1e-3  # usual communication step [s]
SYSTEMS: Final = {"linux": ("linux", ".so"), "darwin": ("darwin", ".dylib"), "win32": ("win", ".dll")}
UNITS: Final = {  # base units with their exponents
    "m": {"m": "1"},
    "m/s": {"m": "1", "s": "-1"},
    "rad/s": {"rad": "1", "s": "-1"},
    "N": {"kg": "1", "m": "1", "s": "-2"},
    "N.m": {"kg": "1", "m": "2", "s": "-2"},
    "s": {"s": "1"},
}


class _Variable(NamedTuple):
    """A variable of the unit; its value reference is its index in the list of variables."""

    name: str
    unit: str | None
    causality: str
    place: int  # index in the numbers of the C source


def export_fmu(
    robot: Robot,
    file: str | os.PathLike[str],
    *,
    start: PoseLike | Equilibrium | HasState | None = None,
    inputs: Inputs = "speeds",
    fmi: int = 3,
    winches: Winches = "ideal",
    integrator: Integrator | None = None,
    step: float | None = None,
    damping: Damping | None = None,
) -> Path:
    """Write a robot with winches and a platform as a unit of co-simulation (FMU) for FMI 3 or FMI 2.

    The unit is `Simulator` in C, translated from the kernels, with static catenaries as cables; it agrees with
    `simulate` to rounding. It contains the library for this machine and the source for others. An instance needs no
    Python, and its state can be saved and restored.

    Inputs for each cable i: `winch_speed_i` [m/s] or `winch_length_i` [m], the length off the drum at the end of the
    communication step. During a step the set points of the lengths change linearly. Inputs for the platform:
    `force_x` to `moment_z`, a wrench about the center of mass in world axes, without gravity. Outputs: `position_x`,
    `quaternion_x` (scalar `quaternion_w`), `velocity_x`, `angular_velocity_x` and so on, of the platform origin in
    world axes; for each cable `tension_i` at the frame end [N] and the unstrained `length_i` off the drum [m].

    Args:
        robot: The robot; its winches may have pulleys and dead lengths, but no guides.
        file: Path of the output, for example cogiro.fmu. An existing file is replaced.
        start: A pose, at which the robot rests with the tensions of `inverse`, or a single equilibrium. None: the
            middle of the test box of the robot, or of its frame.
        inputs: "speeds" or "lengths".
        fmi: Version of the interface, 3 or 2.
        winches: Same as in `simulate`.
        integrator: Same as in `simulate`.
        step: Same as in `simulate`. A communication step must be a whole multiple of this step.
        damping: Same as in `simulate`.

    Returns:
        The path.

    Raises:
        InvalidValueError: If an argument has the wrong type, or `simulate` would refuse it.
        FileError: If the name does not end in .fmu, the file cannot be written, or no C compiler is found.

    Examples:
        >>> import sagline as sl
        >>> robot = sl.load_robot("cogiro")
        >>> path = sl.export_fmu(robot, "cogiro.fmu", inputs="lengths")

    Source:
        Functional Mock-up Interface Specification, versions 2.0.5 and 3.0.2, Modelica Association.
    """
    instance(robot, Robot, "robot")
    path = checked_name(file, ".fmu", "a unit of co-simulation", robot.name)
    choice(inputs, "inputs", get_args(Inputs))
    version = whole_number(fmi, "fmi", 2, 3)
    place = home_pose(robot) if start is None else start
    machine = Simulator(robot, place, winches=winches, integrator=integrator, step=step, damping=damping)
    image = _Image(machine, inputs)
    source = image.source(robot, version)
    token = hashlib.sha256(source.encode()).hexdigest()[:32]
    source = source.replace("@token@", token)
    texts = {"modelDescription.xml": _description(robot, image, version, token), f"sources/{NAME}.c": source}
    if version == 3:
        texts["sources/buildDescription.xml"] = _build_description()
    with atomic_file(path) as partial, tempfile.TemporaryDirectory() as folder:
        code, library = Path(folder) / f"{NAME}.c", Path(folder) / NAME
        code.write_text(source, encoding="utf-8")
        compile_library(code, library, path)
        with ZipFile(partial, "w", ZIP_DEFLATED) as archive:
            for name, text in texts.items():
                archive.writestr(name, text)
            archive.write(library, f"binaries/{_library_place(version)}")
    return path


class _Image:
    """Arrays of a simulator, joined to one list of numbers, and the variables of the unit."""

    def __init__(self, machine: Simulator, inputs: Inputs) -> None:
        """Join the arrays of `machine`."""
        period, massless, self._look = self.given = machine.kernel_arguments
        self._places: dict[int, int] = {}
        self.numbers: list[float] = []
        self.counters: list[int] = []
        self.step: float = massless[2][0]
        (asked, _, wrench), lengths, load = period[0], period[3], period[5]
        for array in (each for each in leaves(self.given) if isinstance(each, np.ndarray)):
            whole = owner(array)
            if id(whole) not in self._places:
                target: list[Any] = self.counters if whole.dtype == np.int64 else self.numbers
                self._places[id(whole)] = len(target)
                target.extend(whole.ravel(order="K").tolist())
        at = self.place(wrench)
        self.numbers[at : at + 6] = load.tolist()  # the wrench at the start is the default of the inputs
        self.asked, self.lengths, m = self.place(asked), self.place(lengths[1]), lengths.shape[1]
        self.set_points = self.asked
        if inputs == "speeds":
            self.set_points = len(self.numbers)
            self.numbers += [0.0] * m
        else:
            self.numbers[self.asked : self.asked + m] = lengths[1].tolist()
        self.variables = self._variables(machine, inputs, at, m)
        self.numbers.append(0.0)  # time

    def place(self, array: Any) -> int:
        """Index of the first number of an array."""
        whole = owner(array)
        return int(self._places[id(whole)] + (array.ctypes.data - whole.ctypes.data) // 8)

    def _variables(self, machine: Simulator, inputs: Inputs, wrench: int, m: int) -> list[_Variable]:
        """Inputs, outputs and time, in the order of their value references."""
        kind, unit = ("speed", "m/s") if inputs == "speeds" else ("length", "m")
        found = [_Variable(f"winch_{kind}_{i}", unit, "input", self.set_points + i) for i in range(m)]
        platform = self.place(self._look[-1])
        vectors = (
            ("force", "xyz", "N", "input", wrench),
            ("moment", "xyz", "N.m", "input", wrench + 3),
            ("position", "xyz", "m", "output", platform),
            ("quaternion", "xyzw", None, "output", platform + 3),
            ("velocity", "xyz", "m/s", "output", platform + 7),
            ("angular_velocity", "xyz", "rad/s", "output", platform + 10),
        )
        for name, axes, unit_, causality, at in vectors:
            found += [_Variable(f"{name}_{axis}", unit_, causality, at + k) for k, axis in enumerate(axes)]
        rows = (("tension", "N", machine.reading.tension), ("length", "m", machine.reading.length))
        for name, unit, values in rows:
            found += [_Variable(f"{name}_{i}", unit, "output", self.place(values) + i) for i in range(m)]
        return [*found, _Variable("time", "s", "independent", len(self.numbers))]

    def source(self, robot: Robot, fmi: int) -> str:
        """C source of the unit, without the token."""
        run = "run_over_pulleys" if has_routing(robot) else "run_bare"
        by_speed = f"numbers[{self.lengths} + i] + period * numbers[{self.set_points} + i]"
        period, massless, look = self.given
        words = {
            **origin(robot),
            "fmi": str(fmi),
            "cables": str(robot.cable_count),
            "variables": str(len(self.variables)),
            "time": str(len(self.numbers) - 1),
            "size": str(len(self.numbers)),
            "counters_size": str(len(self.counters)),
            "numbers": ", ".join(_number(value) for value in self.numbers),
            "counters": ", ".join(map(str, self.counters)),
            "places": ", ".join(str(each.place) for each in self.variables),
            "step": _number(self.step),
            "asked": str(self.asked),
            "set_point": f"numbers[{self.asked} + i]" if self.set_points == self.asked else by_speed,
            "begin_period": self._arguments(period[:-3]),
            "run": run,
            "run_massless": self._arguments(massless[:-2]),
            "failed": str(progress.FAILED),
            "platform_state": self._arguments(look),
            "kernels": reached_parts(translated_kernels()["double"], ["begin_period", run, "platform_state"]),
        }
        return filled("c/fmu.c", words) + filled(f"c/fmu{fmi}.c", {})

    def _arguments(self, given: tuple[Any, ...]) -> str:
        """Arguments of a kernel as C text."""
        return ", ".join(self._argument(each) for each in leaves(given))

    def _argument(self, value: Any) -> str:
        if isinstance(value, np.ndarray):
            name = "now->counters" if value.dtype == np.int64 else "numbers"
            return ", ".join([f"{name} + {self.place(value)}", *map(str, value.shape)])
        return str(value).lower() if isinstance(value, bool | int) else _number(value)


def _number(value: float) -> str:
    return constant_text(np.asarray(value), "a number", np.float64)


def _description(robot: Robot, image: _Image, fmi: int, token: str) -> str:
    """The file modelDescription.xml."""
    name = f"{NAME}: {origin(robot)['name']}"
    first = {"fmiVersion": f"{fmi}.0", "modelName": name, "guid" if fmi == 2 else "instantiationToken": token}
    root = ElementTree.Element("fmiModelDescription", first, generationTool=f"sagline {__version__}")
    root.set("variableNamingConvention", "structured")
    state = "canGetAndSetFMUstate" if fmi == 2 else "canGetAndSetFMUState"
    unit = _add(root, "CoSimulation", modelIdentifier=NAME, canHandleVariableCommunicationStepSize="true")
    unit.set(state, "true")
    if fmi == 2:
        _add(_add(unit, "SourceFiles"), "File", name=f"{NAME}.c")
    else:
        unit.set("fixedInternalStepSize", repr(image.step))
    units = _add(root, "UnitDefinitions")
    for each, exponents in UNITS.items():
        _add(_add(units, "Unit", name=each), "BaseUnit", **exponents)
    _add(root, "DefaultExperiment", stepSize=repr(image.step * max(1, round(PERIOD / image.step))))
    variables, structure = _add(root, "ModelVariables"), ElementTree.Element("ModelStructure")
    for reference, variable in enumerate(image.variables):
        _add_variable(variables, variable, reference, image.numbers[variable.place], fmi)
    outputs = [str(k) for k, each in enumerate(image.variables) if each.causality == "output"]
    if fmi == 3:
        for kind in ("Output", "InitialUnknown"):
            for k in outputs:
                _add(structure, kind, valueReference=k)
    else:
        for kind in ("Outputs", "InitialUnknowns"):
            group = _add(structure, kind)
            for k in outputs:
                _add(group, "Unknown", index=str(int(k) + 1))
    root.append(structure)
    ElementTree.indent(root)
    return ElementTree.tostring(root, encoding="unicode", xml_declaration=True)


def _add_variable(parent: ElementTree.Element, variable: _Variable, reference: int, start: float, fmi: int) -> None:
    """Add a variable to the list of variables."""
    numbers = {} if variable.unit is None else {"unit": variable.unit}
    if variable.causality == "input":
        numbers["start"] = repr(start)
    common = {"name": variable.name, "valueReference": str(reference), "causality": variable.causality}
    common["variability"] = "continuous"
    if fmi == 2:
        _add(_add(parent, "ScalarVariable", **common), "Real", **numbers)
    else:
        _add(parent, "Float64", **common, **numbers)


def _build_description() -> str:
    """The file sources/buildDescription.xml of FMI 3."""
    root = ElementTree.Element("fmiBuildDescription", fmiVersion="3.0")
    files = _add(_add(root, "BuildConfiguration", modelIdentifier=NAME), "SourceFileSet", language="C99")
    files.set("compilerOptions", "-std=c99 -O2 -ffp-contract=off")
    _add(files, "SourceFile", name=f"{NAME}.c")
    return ElementTree.tostring(root, encoding="unicode", xml_declaration=True)


def _add(parent: ElementTree.Element, tag: str, **attributes: str) -> ElementTree.Element:
    return ElementTree.SubElement(parent, tag, attributes)


def _library_place(fmi: int) -> str:
    """Folder and name of the library of this machine."""
    system, ending = SYSTEMS[sys.platform]
    if fmi == 2:
        return f"{system}64/{NAME}{ending}"
    machine = {"amd64": "x86_64", "arm64": "aarch64"}.get(platform.machine().lower(), platform.machine().lower())
    return f"{machine}-{'windows' if system == 'win' else system}/{NAME}{ending}"
