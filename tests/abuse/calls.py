"""Valid arguments for every public function, class and method of sagline."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from enum import Enum
from functools import cache, partial
from pathlib import Path
from typing import Any, NamedTuple

import attrs
import numpy as np
import trimesh
from matplotlib.figure import Figure

import sagline as sl
from sagline.control.link import Command, Mode
from sagline.core.surface import public_names as names_of
from sagline.robot.tolerances import Provenance
from tests.calibration.made_up import made_up
from tests.calibration.synthetic import log_of, true_robot, with_drums
from tests.control.rigs import HOME, at, prototype, rig
from tests.files.simulations import a_simulation
from tests.kinematics.test_underconstrained import suspended
from tests.kinematics.winches import wound
from tests.plot import made
from tools.size import public_values

MAGIC = ("__getitem__",)  # methods with two underscores that take an argument


class Argument(NamedTuple):
    """A valid value and its kind, the name of a function of `bad_values`."""

    kind: str
    value: Any
    optional: bool = False


class Call(NamedTuple):
    """A callable with valid keyword arguments. Each call of a method uses a new object."""

    function: Callable[..., Any]
    arguments: dict[str, Argument]

    def with_replaced(self, name: str, value: Any) -> Any:
        """Result of the call with one argument replaced."""
        given = {key: argument.value for key, argument in self.arguments.items()}
        return self.function(**{**given, name: value} if name else given)


def public_names() -> set[str]:
    """Names of all callables with arguments: functions, constructors and methods, also `plot.tensions` and the like.

    Results made by sagline (their constructors check nothing), exceptions and statuses are excluded.
    """
    return {each for name, value in public_values().items() for each in _of_value(name, value)}


def arguments_of(name: str) -> list[str]:
    """Names of the arguments of a public callable. `**changes` is excluded; its fields are tested with the type."""
    value: Any = sl
    for part in name.split("."):
        value = getattr(value, part)
    arguments = inspect.signature(value).parameters.values()
    return [each.name for each in arguments if each.kind is not each.VAR_KEYWORD and each.name != "self"]


def _of_value(name: str, value: Any) -> set[str]:
    if inspect.isclass(value):
        return _of_class(name, value)
    return {name} if callable(value) and inspect.signature(value).parameters else set()


def _of_class(name: str, kind: type) -> set[str]:
    if issubclass(kind, Exception | Enum | tuple):
        return set()
    found = set() if name in RESULTS or not inspect.signature(kind).parameters else {name}
    private = [base for base in kind.__mro__[1:] if base.__name__ not in names_of("sagline") and base is not object]
    methods = {method: value for base in reversed([kind, *private]) for method, value in vars(base).items()}
    for method, value in methods.items():  # methods of a public base class are called once, with the base class
        function = value.__func__ if isinstance(value, classmethod) else value
        public = not method.startswith("_") or method in MAGIC
        if inspect.isfunction(function) and public and len(inspect.signature(function).parameters) > 1:
            found.add(f"{name}.{method}")
    return found


# results, made by sagline
RESULTS = frozenset(
    {"CableFit", "CableState", "Confirmation", "EmpiricalFit", "Equilibria", "Equilibrium", "ForwardSolution"}
    | {"BendingCycles", "Clearances", "FrameForces", "FrequencySlopes", "WinchDrive"}
    | {"EnergyBalance", "Imported", "Linearized", "Modes", "Occurrence", "Plan", "Simulation", "Stiffness"}
    | {"control.Execution", "control.Gains", "control.Motion", "control.Samples", "twin.Injected"}
    | {
        "Components",
        "Front",
        "Margin",
        "MotionSet",
        "MovingAnchors",
        "Proof",
        "Surface",
        "Workspace",
        "WrenchSet",
        "sweep.Sweep",
    }
    | {"FrequencyMap", "FrequencyResponse", "TensionPolygon", "Uncertainty", "Vibration", "WinchRates"}
    | {"Calibration", "CalibrationPoses", "PoseError"}
)
# require a machine at the other end, or are one: tests/plc/test_bad_arguments.py
LINKS = frozenset({"plc.ModbusLink", "plc.S7Link", "twin.Server", "twin.Server.run"})
CRITERIA = ("Clearance", "Criterion", "InFrame", "LeastFrequency", "LeastMargin", "LeastStiffness", "MaximumSag")
# called by sagline itself, with its own arguments
TABULAR = (
    *("Confirmation", "Equilibria", "Equilibrium", "ForwardSolution", "FrequencyMap", "FrequencyResponse", "Margin"),
    *("Modes", "MovingAnchors", "Path", "Simulation", "TensionPolygon", "Vibration", "WinchRates", "control.Execution"),
    *("BendingCycles", "Clearances", "FrameForces", "Uncertainty", "WinchLog"),
)
INTERNAL = frozenset(
    {"TensionMethod.preference", "QuadraticProgram.preference", "twin.Machine.deliver"}
    | {"control.Fault", "control.Fault.look", "control.Fault.found", "control.Histogram.add"}
    | {"control.TensionLoop.step", "control.Gains.at", "control.Link", "control.Link.exchange", "control.Recorder"}
    | {"plc.ModbusLink.exchange", "plc.S7Link.exchange"}
    | {"Orientations.at", "Tilts.sampled"}
    | {f"{name}.to_csv" for name in TABULAR}  # one method for all types: see "Plan.to_csv"
    | {f"{name}.{method}" for name in (*CRITERIA, "PositionError") for method in ("check", "judge", "scale", "values")}
    | {"Clearance.excluded", "Criterion.excluded"}
    | {"AnchorErrors.added", "FreeAnchors.bound", "FreeCable.bound", "FreeLimit.bound", "Goal.values"}
    | {f"control.Recorder.{method}" for method in ("begins", "ends", "cycle", "event")}
)


@cache
def calls(folder: Path) -> dict[str, Call]:
    """The table of calls; files are written to the folder."""
    given = _Given(folder)
    table: dict[str, Call] = {}
    for part in (
        _cables,
        _robots,
        _motions,
        _planning,
        _kinematics,
        _winding,
        _solvers,
        _tensions,
        _statics,
        _vibrations,
        _workspaces,
        _designs,
        _distances,
        _articles,
        _files,
        _logs,
        _calibrations,
        _calibration_files,
        _calibration_poses,
        _in_time,
        _figures,
        _twins,
        _controls,
        _sweeps,
        _engines,
    ):
        table |= part(given)
    return table


class _Given:
    """Valid objects that several calls use."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.robot = sl.load_robot("cogiro")
        self.cable = sl.Cable(0.067, 44e3)
        self.pose = sl.Pose.from_euler([1.0, 1.0, 2.0], 0.0, 0.0, 0.0)
        self.poses = sl.Pose.from_euler([[1.0, 1.0, 2.0], [0.0, 1.0, 2.0], [0.5, 1.0, 2.0]], 0.0, 0.0, 0.0)
        self.suspended = suspended(4)
        self.plan = sl.inverse(self.robot, self.pose)
        self.path = sl.quintic_path([(0, 0, 1.5), (1, 1, 2)], durations=1.0, rate=4.0)
        self.run = sl.inverse(self.robot, self.path)
        limited = self.robot.replace(winches=sl.Winch(drum_radius=0.06, speed_limit=30.0))
        self.driven = sl.inverse(limited, self.pose).state
        self.anchors = sl.anchors_on_bases(self.robot, [(self.path, range(8))])
        self.hung = sl.Catenary().from_tension(self.cable, [10.0, 11.0, 12.0], 2.0, 100.0)
        self.length = self.plan.unstrained_length


def _all(**arguments: tuple[Any, ...]) -> dict[str, Argument]:
    return {name: Argument(*argument) for name, argument in arguments.items()}


def _cables(given: _Given) -> dict[str, Call]:
    one, many = ("one", given.cable), ("array", [0.5, 0.75])
    ends = {"span": ("array", 12.0), "rise": ("array", -4.0)}
    gravity = ("number", 9.75)
    rope = {"diameter": ("array", 0.25, True), "expansion": ("array", [-0.5, 0.5], True)}
    return {
        "Cable": Call(sl.Cable, _all(linear_density=many, axial_stiffness=many, **rope)),
        "Cable.from_material": Call(
            sl.Cable.from_material, _all(linear_density=many, youngs_modulus=many, section_area=many, **rope)
        ),
        "Cable.replace": Call(sl.Cable([0.5, 0.75], 4e4).replace, _all(linear_density=many, **rope)),
        "CableModel.from_tension": Call(
            sl.Catenary().from_tension, _all(cable=one, **ends, chord_tension=("array", [50.0, 100.0]), gravity=gravity)
        ),
        "CableModel.from_length": Call(
            sl.Parabolic().from_length,
            _all(cable=one, **ends, unstrained_length=("array", [13.0, 13.5]), gravity=gravity),
        ),
        "CableModel.profile": Call(
            sl.Elastic().profile, _all(cable=one, state=("one", given.hung), points=("whole", 5))
        ),
        "CableModel.terms": Call(sl.Catenary().terms, _all(gravity=gravity)),
        "CableSolver": Call(
            lambda **a: (sl.CableSolver(**a), None)[1],
            _all(cable=one, model=("one", sl.Catenary(), True), gravity=gravity),
        ),
        "CableSolver.from_tension": Call(
            sl.CableSolver(given.cable).from_tension,
            _all(span=("number", 12.5), rise=("number", -4.5), chord_tension=("number", 100.5)),
        ),
        "CableSolver.from_length": Call(
            sl.CableSolver(given.cable).from_length,
            _all(span=("number", 12.5), rise=("number", -4.5), unstrained_length=("number", 13.5)),
        ),
        "CableState.__getitem__": Call(given.hung.__getitem__, _all(index=("index", 0))),
        "CableState.points": Call(given.hung.points, _all(count=("whole", 5))),
        "Empirical": Call(sl.Empirical, _all(k_h=("number", 4.75), k_p=("number", 4.5))),
    }


def _robots(given: _Given) -> dict[str, Call]:
    robot, numbers, box = given.robot, ("array", [3.0, 2.0, 4.0]), ("array", [[1.0, 2.0, 3.0], [1.5, 2.0, 3.0]])
    fields = {
        "name": ("text", "mine"),
        "frame_anchors": ("array", robot.frame_anchors),
        "platform_anchors": ("array", robot.platform_anchors),
        "cables": ("one", robot.cables),
        "winches": ("one", sl.Winch(0.05), True),
        "mass": ("number", 90.0),
        "inertia": ("array", np.diag([1.0, 2.0, 2.5])),
        "center_of_mass": ("array", [0.0, 0.125, 0.25]),
        "gravity": ("number", 9.75),
        "motion_pattern": ("word", "3R3T"),
        "tension_min": ("array", np.full(8, 10.0)),
        "tension_max": ("array", np.full(8, 1000.0)),
        "tension_limits_of": ("word", "frame_end"),
        "platform_size": (*numbers, True),
        "frame_size": (*numbers, True),
        "test_box": ("one", sl.PoseBox([0, 0, 0], [1, 1, 1]), True),
        "source": ("text", "a book"),
        "assumed": ("mapping", {"mass": "weighed"}),
        "notes": ("text", "none"),
        "tolerances": ("mapping", {"mass": 0.5}),
        "calibration": ("one", Provenance("log.csv", "2026-03-01", {"mass": 0.1}), True),
    }
    flat = sl.Robot(
        "flat",
        np.eye(4, 3),
        np.zeros((4, 3)),
        sl.Cable(0.1, 1e5),
        9.0,
        motion_pattern="2T",
        plane_normal=[0.0, 1.0, 0.0],
    )
    angle = ("array", [0.25, 0.5])
    wound: dict[str, tuple[Any, ...]] = {
        field.name: ("array", [2.0, 1.0], field.default is None) for field in attrs.fields(sl.Winch)
    }
    wound |= {"dead_rise": ("array", [0.5, -0.25]), "on_platform": ("array", [0.0, 0.0])}
    wound |= {"swivel_axis": ("array", [[0.0, 0.0, 1.0], [0.0, 0.0, -1.0]])}
    wound |= {
        "rolling_friction": ("array", [0.5, 0.25]),
        "guides": ("array", [[[1.0, 1.0, 2.0], [2.0, 1.0, 2.0]], [[1.0, 2.0, 2.0], [2.0, 2.0, 4.0]]], True),
    }
    winch = sl.Winch(0.05, dead_cable=[3.0, 4.0])
    return {
        "Winch": Call(sl.Winch, _all(**wound)),
        "Winch.replace": Call(winch.replace, _all(**{name: wound[name] for name in ("gear", "drum_radius")})),
        "winch_drive": Call(sl.winch_drive, _all(name=("word", "yaskawa-sgmsh-10aa"))),
        "WinchDrive.winch": Call(
            sl.winch_drive("yaskawa-sgmsh-10aa").winch,
            _all(
                drum_radius=("number", 0.0625),
                drum_inertia=("number", 0.125),
                position_gain=("array", [8.0, 9.0], True),
            ),
        ),
        "Winch.per_cable": Call(sl.Winch(0.05).per_cable, _all(count=("whole", 3))),
        "Robot": Call(sl.Robot, _all(**fields)),
        "Robot.replace": Call(robot.replace, _all(**{name: fields[name] for name in ("mass", "tension_min", "name")})),
        "Robot.with_payload": Call(robot.with_payload, _all(mass=("number", 2.0), at=("array", [0.0, 0.5, 1.0], True))),
        "Robot: plane": Call(flat.replace, _all(plane_normal=("array", [0.0, 0.0, 2.0]))),
        "PoseBox": Call(sl.PoseBox, _all(low=("array", [0.0, 1.0, 2.0]), high=numbers, tilt=("number", 0.25))),
        "Pose": Call(sl.Pose, _all(position=box, rotation=("array", np.eye(3), True))),
        "Pose: x, y, z": Call(partial(sl.Pose, 1.0, 2.0), _all(z=("array", 3.0, True))),
        "Pose.from_euler": Call(sl.Pose.from_euler, _all(position=box, alpha=angle, beta=angle, gamma=angle)),
        "Pose.from_quaternion": Call(
            sl.Pose.from_quaternion, _all(position=box, quaternion=("array", [0.0, 0.0, 0.0, 1.0]))
        ),
        "Pose.transform": Call(given.poses.transform, _all(points=box)),
        "Pose.__getitem__": Call(given.poses.__getitem__, _all(index=("index", 0))),
        "without_cables": Call(
            lambda robot, cable: sl.without_cables(robot, 1, cable), _all(robot=("one", robot), cable=("cable", 3))
        ),
    }


def _motions(given: _Given) -> dict[str, Call]:
    stops = ("array", [[0.0, 0.0, 1.5], [1.0, 1.0, 2.0]])
    size = len(given.path)
    rates = {name: ("array", np.ones((size, 6))) for name in ("twist", "twist_rate")}
    time, rate, durations = ("array", given.path.time), ("number", 8.0), ("array", 1.0)
    names = ("speed", "acceleration", "angular_speed", "angular_acceleration")
    limits = dict.fromkeys(names, ("number", 2.0, True))
    return {
        "Path": Call(
            sl.Path,
            _all(
                time=time,
                pose=("one", given.path.pose),
                **rates,
                jerk=("array", np.ones((size, 6)), True),
                rests=("array", [0.0, given.path.time[-1]], True),
            ),
        ),
        "path_from_samples": Call(sl.path_from_samples, _all(time=time, pose=("one", given.path.pose))),
        "quintic_path": Call(sl.quintic_path, _all(waypoints=stops, durations=(*durations, True), rate=rate)),
        "septic_path": Call(sl.septic_path, _all(waypoints=stops, durations=(*durations, True), rate=rate)),
        "quintic_path: limits": Call(sl.quintic_path, _all(waypoints=stops, **limits, rate=rate)),
        "septic_path: limits": Call(sl.septic_path, _all(waypoints=stops, **limits, rate=rate)),
        "article_path": Call(sl.article_path, _all(rate=rate)),
        "AnchorMotion": Call(
            sl.AnchorMotion, _all(time=time, position=("array", np.ones((size, 8, 3)) * np.arange(size)[:, None, None]))
        ),
        **{
            f"AnchorMotion.{name}": Call(getattr(given.anchors, name), _all(time=("array", [0.25, 0.5])))
            for name in ("at", "velocity", "acceleration")
        },
        "anchors_on_bases": Call(
            sl.anchors_on_bases, _all(robot=("one", given.robot), bases=("one", [(given.path, [0, 1])]))
        ),
    }


def _planning(given: _Given) -> dict[str, Call]:
    path = sl.quintic_path([(0, 0, 1.5), (1, 1, 2)], durations=1.0, rate=16.0)
    modes, ratio = sl.modes(given.plan.state), ("array", [0.25, 0.125])
    frequency = ("array", [2.0, 3.5])
    return {
        "Shaper": Call(
            sl.Shaper,
            _all(time=("array", [0.0, 0.5, 1.5]), amplitude=("array", [0.25, 0.5, 0.25]), frequency=frequency),
        ),
        "Shaper.residual": Call(
            sl.ZV(2.0).residual, _all(frequency=("array", [0.5, 2.0]), damping_ratio=("number", 0.125))
        ),
        "ZV": Call(sl.ZV, _all(frequency=frequency, damping_ratio=ratio)),
        "ZVD": Call(sl.ZVD, _all(frequency=frequency, damping_ratio=ratio)),
        "EI": Call(sl.EI, _all(frequency=frequency, tolerance=ratio)),
        "shaped": Call(sl.shaped, _all(path=("one", path), shaper=("one", sl.ZV(2.0)))),
        "fastest": Call(
            sl.fastest,
            _all(
                robot=("one", given.robot),
                path=("one", path),
                margin=("number", 4.5),
                jerk=("number", 64.0, True),
                angular_jerk=("number", 32.0, True),
                progress=("callback", lambda done, of: None, True),
            ),
        ),
        "Vibration.to_shape": Call(sl.vibration(given.plan.state, up_to=6.0).to_shape, _all(path=("one", path))),
        "to_shape": Call(sl.to_shape, _all(modes=("one", modes), path=("one", path))),
    }


def _kinematics(given: _Given) -> dict[str, Call]:
    robot, model = ("object", given.robot), ("one", sl.Catenary())
    wrench, lengths = ("array", [0.0, 0.0, -10.0, 0.0, 1.0, 0.0], True), ("array", given.length)
    silent = ("callback", lambda done, of: None, True)
    several = ("array", np.stack((given.length, given.length)))
    measured = sl.MeasuredTension(given.plan.state.cables.frame_end_tension, 1.0, 1e-3)
    guides = given.robot.frame_anchors[:, None] * np.array([1.25, 1.25, 0.5])
    guided = given.robot.replace(winches=sl.Winch(0.05, pulley_friction=0.1, guides=guides))
    winding = ("array", np.array([1.0, -1.0, 0.0, 1.0, -1.0, 1.0, 1.0, -1.0]), True)
    return {
        "inverse": Call(
            sl.inverse,
            _all(
                robot=robot,
                motion=("motion", given.poses),
                model=model,
                tension=("one", sl.Closest()),
                wrench=wrench,
                previous=("one", given.plan, True),
                stability=("flag", True),
                progress=silent,
            ),
        ),
        "inverse: few cables": Call(
            partial(sl.inverse, given.suspended, (0.2, 0.1, 1.0)),
            _all(given=("words", ["x", "y", "z", "level"], True), level=("number", 2.0)),
        ),
        "inverse: a path": Call(sl.inverse, _all(robot=robot, motion=("motion", given.path), wrench=wrench)),
        "inverse: anchors": Call(
            partial(sl.inverse, given.robot, given.path), _all(anchors=("one", given.anchors, True))
        ),
        "inverse: previous tensions": Call(
            partial(sl.inverse, given.robot, given.pose, tension=sl.Closest()),
            _all(previous=("tensions", given.plan.chord_tension, True)),
        ),
        "inverse: winding": Call(partial(sl.inverse, guided, given.pose), _all(winding=winding)),
        "forward: winding": Call(
            partial(sl.forward, guided, sl.inverse(guided, given.pose).unstrained_length, given.pose),
            _all(winding=winding),
        ),
        "forward": Call(
            sl.forward,
            _all(
                robot=robot,
                unstrained_length=several,
                start=("one", given.pose, True),
                model=model,
                wrench=wrench,
                progress=silent,
            ),
        ),
        "forward: measured": Call(
            sl.forward,
            _all(
                robot=robot,
                unstrained_length=lengths,
                start=("one", given.pose, True),
                tension_measured=("one", measured, True),
            ),
        ),
        "equilibria": Call(
            sl.equilibria,
            _all(
                robot=("one", given.robot),
                unstrained_length=lengths,
                model=model,
                wrench=wrench,
                starts=("whole", 3),
                seed=("seed", 1),
            ),
        ),
        "confirm": Call(sl.confirm, _all(plan=("one", given.run), progress=silent)),
        "tension_polygon": Call(
            sl.tension_polygon,
            _all(
                robot=("one", given.robot),
                pose=("one", given.pose),
                model=model,
                wrench=wrench,
                variable=("word", "chord"),
            ),
        ),
        "MeasuredTension": Call(
            sl.MeasuredTension,
            _all(
                frame_end_tension=("array", [100.0, 90.0]),
                tension_deviation=("array", 1.0),
                length_deviation=("array", 0.5),
            ),
        ),
        "Equilibrium.__getitem__": Call(
            sl.inverse(given.robot, given.poses).state.__getitem__, _all(index=("index", 0))
        ),
    }


def _winding(given: _Given) -> dict[str, Call]:
    robot = wound()
    plan, run = sl.inverse(robot, given.pose), sl.inverse(robot, given.path)
    counts, tension = sl.encoder_counts(run, "remembered"), sl.winch_rates(run).drum_tension
    warmer, creep = ("array", np.linspace(-2.0, 5.0, 8)), sl.Creep([1e6, 4e5], [30.0, 1200.0])
    return {
        "encoder_counts": Call(
            sl.encoder_counts,
            _all(plan=("one", run), winding=("word", "remembered"), temperature=warmer, creep=("one", creep, True)),
        ),
        "lengths_from_counts": Call(
            sl.lengths_from_counts,
            _all(robot=("one", robot), counts=("array", counts), winding=("word", "constant"), temperature=warmer),
        ),
        "lengths_from_counts: remembered": Call(
            lambda **a: sl.lengths_from_counts(robot, winding="remembered", **a),
            _all(counts=("array", counts), drum_tension=("array", tension)),
        ),
        "home": Call(
            sl.home,
            _all(
                robot=("one", robot),
                pose=("one", given.pose),
                frame_end_tension=("array", plan.state.cables.frame_end_tension),
                counts=("array", np.arange(8.0)),
                model=("one", sl.Catenary()),
                temperature=warmer,
            ),
        ),
        "bending_cycles": Call(sl.bending_cycles, _all(plan=("one", run), elements=("whole", 50))),
        "winch_rates": Call(sl.winch_rates, _all(plan=("one", run))),
        "Creep": Call(sl.Creep, _all(axial_stiffness=("array", [1e6, 4e5]), time=("array", [30.0, 1200.0]))),
        "Creep.strain": Call(
            creep.strain,
            _all(time=("array", [0.0, 1.0, 2.5]), tension=("array", [10.0, 20.0, 15.0]), settled=("flag", True)),
        ),
    }


def _solvers(given: _Given) -> dict[str, Call]:
    solver, tracker = sl.InverseSolver(given.robot), sl.ForwardSolver(given.robot, start=given.pose)
    pose = {"position": ("sample", [1.0, 1.0, 2.0]), "quaternion": ("sample", [0.0, 0.0, 0.0, 1.0])}
    wrench, model = ("sample", [0.0, 0.0, -10.0, 0.0, 1.0, 0.0], True), ("one", sl.Catenary(), True)
    out = ("out", np.empty(8))

    def alone(function: Callable[..., Any]) -> Callable[..., Any]:
        def call(**arguments: Any) -> Any:
            solver.reset()
            return function(**arguments)

        return call

    def new() -> sl.ForwardSolver:  # `reset` discards the last equilibrium only
        return sl.ForwardSolver(given.robot, start=given.pose)

    return {
        "InverseSolver": Call(
            lambda **a: (sl.InverseSolver(**a), None)[1],
            _all(
                robot=("one", given.robot), model=model, tension=("one", sl.Closest(), True), stability=("flag", True)
            ),
        ),
        "InverseSolver.step": Call(alone(solver.step), _all(**pose, wrench=wrench)),
        "InverseSolver.step_into": Call(alone(solver.step_into), _all(**pose, out=out, wrench=wrench)),
        "ForwardSolver": Call(
            lambda **a: (sl.ForwardSolver(**a), None)[1],
            _all(robot=("one", given.robot), model=model, start=("one", given.pose, True)),
        ),
        "ForwardSolver.reset": Call(tracker.reset, _all(start=("one", given.pose, True))),
        "ForwardSolver.step": Call(
            lambda **a: new().step(**a), _all(unstrained_length=("array", given.length), wrench=wrench)
        ),
        "ForwardSolver.step_into": Call(
            lambda **a: new().step_into(**a),
            _all(
                unstrained_length=("sample", given.length),
                position=("out", np.empty(3)),
                quaternion=("out", np.empty(4)),
                wrench=wrench,
            ),
        ),
    }


def _tensions(given: _Given) -> dict[str, Call]:
    common = {"variable": ("word", "chord"), "lowest_point_margin": ("number", 1.0, True)}
    methods = ("AnalyticCenter", "Centroid", "ClosedForm", "Closest", "ImprovedClosedForm", "LowestMaximum")
    table = {
        name: Call(getattr(sl, name), _all(**common)) for name in (*methods, "LowestSum", "MinimumNorm", "Puncture")
    }
    each = ("array", np.ones(8))
    polygon = sl.tension_polygon(given.robot, given.pose)
    return table | {
        "TensionMethod": Call(sl.MinimumNorm, _all(**common)),  # an abstract base class
        "PNorm": Call(sl.PNorm, _all(**common, p=("number", 4.0))),
        "PolygonWalk": Call(sl.PolygonWalk, _all(**common, optimum=("word", "centroid"))),
        "QuadraticProgram": Call(sl.QuadraticProgram, _all(**common, weights=each, target=each)),
        "TensionPolygon.coordinates": Call(
            polygon.coordinates, _all(chord_tension=("array", given.plan.chord_tension))
        ),
    }


def _statics(given: _Given) -> dict[str, Call]:
    state, robot, one, pose = (
        ("one", given.run.state),
        ("object", given.robot),
        ("one", given.robot),
        ("one", given.pose),
    )
    rates = {name: ("array", np.ones((3, 6))) for name in ("twist", "twist_rate")}
    return {
        "stiffness": Call(sl.stiffness, _all(state=state)),
        "modes": Call(sl.modes, _all(state=state)),
        "limit_margin": Call(sl.limit_margin, _all(state=state)),
        "capacity_margin": Call(sl.capacity_margin, _all(state=state)),
        "structure_matrix": Call(sl.structure_matrix, _all(robot=robot, pose=pose)),
        "article_balance": Call(sl.article_balance, _all(robot=one, pose=pose, k_h=("number", 4.75))),
        "unresisted_motion": Call(sl.unresisted_motion, _all(robot=one, pose=pose)),
        "inertial_wrench": Call(sl.inertial_wrench, _all(robot=robot, pose=("one", given.poses), **rates)),
    }


def _vibrations(given: _Given) -> dict[str, Call]:
    state, damping = ("one", given.plan.state), ("one", sl.Damping(1e-3), True)
    ratios = {"loss_time": ("number", 0.25), "air_damping": ("number", 0.5), "modal_damping": ("number", 0.125)}
    return {
        "Damping": Call(sl.Damping, _all(**ratios)),
        "vibration": Call(sl.vibration, _all(state=state, up_to=("number", 4.75), damping=damping)),
        "dynamic_stiffness": Call(
            sl.dynamic_stiffness, _all(state=state, frequency=("array", [0.5, 2.0]), damping=damping)
        ),
        "frequency_slopes": Call(sl.frequency_slopes, _all(state=state, together=("number", 0.25))),
        "linearized": Call(
            sl.linearized,
            _all(state=state, damping=("one", sl.Damping(modal_damping=0.01), True), inputs=("word", "speeds")),
        ),
        "frequency_map": Call(
            sl.frequency_map,
            _all(
                robot=("one", given.robot),
                poses=("one", given.poses),
                up_to=("number", 4.75),
                tension=("one", sl.MinimumNorm()),
                damping=damping,
                progress=("callback", lambda done, of: None, True),
            ),
        ),
        "frequency_response": Call(
            sl.frequency_response, _all(state=state, frequency=("array", [0.5, 2.0]), damping=damping)
        ),
    }


def _workspaces(given: _Given) -> dict[str, Call]:
    limit, model = ("number", 0.5), ("one", sl.Straight())
    turned = np.stack((np.eye(3), np.diag([1.0, -1.0, -1.0])))
    space = sl.workspace(given.robot, cells=4)
    space.save(given.folder / "workspace.nc")
    three, center = ("array", [3.0, 2.0, 4.0]), ("array", [1.0, 2.0, 3.0, 0.5, 0.25, 0.75], True)
    box = {"force": three, "moment": three, "center": center}
    return {
        "WrenchBox": Call(sl.WrenchBox, _all(**box)),
        "WrenchEllipsoid": Call(sl.WrenchEllipsoid, _all(**box)),
        "WrenchEllipsoid: matrix": Call(sl.WrenchEllipsoid, _all(center=center, matrix=("array", np.eye(6), True))),
        "WrenchPolytope": Call(sl.WrenchPolytope, _all(corners=("array", np.eye(6)))),
        "Accelerations": Call(sl.Accelerations, _all(linear=("number", 2.0), angular=("number", 3.0))),
        "Orientations": Call(sl.Orientations, _all(rotations=("array", turned), need=("word", "any"))),
        "Tilts": Call(sl.Tilts, _all(angle=("number", 0.25))),
        "Clearance": Call(sl.Clearance, _all(limit=limit, obstacles=("objects", sl.Sphere([3.0, 2.0, 4.0], 0.5)))),
        "LeastMargin": Call(sl.LeastMargin, _all(limit=limit)),
        "MaximumSag": Call(sl.MaximumSag, _all(limit=limit)),
        "PositionError": Call(sl.PositionError, _all(model=model, limit=limit)),
        "LeastStiffness": Call(sl.LeastStiffness, _all(limit=limit)),
        "LeastFrequency": Call(sl.LeastFrequency, _all(limit=limit)),
        "InFrame": Call(sl.InFrame, _all(limit=limit)),
        "workspace": Call(
            sl.workspace,
            _all(
                robot=("one", given.robot),
                box=("one", sl.PoseBox([-1.0, -1.0, 1.0], [1.0, 1.0, 2.0]), True),
                wrenches=("one", sl.WrenchBox(force=2.0), True),
                orientations=("one", sl.Tilts(0.25), True),
                model=("one", sl.Catenary()),
                tension=("one", sl.MinimumNorm()),
                cells=("whole", 4),
                criteria=("several", [sl.MaximumSag(0.5)]),
                refine=("flag_or_whole", True),
                moment_arm=("number", 0.25, True),
                hull=("word", "inner"),
                progress=("callback", lambda done, of: None, True),
            ),
        ),
        "workspace: few cables": Call(
            partial(sl.workspace, given.suspended, sl.PoseBox([-0.1, -0.1, 0.9], [0.1, 0.1, 1.1]), cells=4),
            _all(given=("words", ["x", "y", "z", "yaw"], True)),
        ),
        "Components.label": Call(space.components.label, _all(position=("array", [0.0, 0.0, 1.5]))),
        "Surface.export": Call(space.surface.export, _all(file=("file", given.folder / "hull.stl"))),
        "Workspace.save": Call(space.save, _all(file=("file", given.folder / "saved.nc"))),
        "plot.workspace": Call(lambda **a: (sl.plot.workspace(**a), None)[1], _all(space=("one", space))),
        "plot.slice": Call(
            lambda **a: (sl.plot.slice(**a), None)[1],
            _all(
                space=("one", space),
                normal=("word", "z"),
                at=("number", 2.0, True),
                ax=("ax", Figure().add_subplot(), True),
            ),
        ),
        "speed_set": Call(sl.speed_set, _all(state=("one", given.driven))),
        "acceleration_set": Call(sl.acceleration_set, _all(state=("one", given.driven))),
        "MotionSet.pure": Call(sl.speed_set(given.driven).pure, _all(direction=("array", [1.0, 0.0, 0.5]))),
        "MotionSet.extent": Call(sl.speed_set(given.driven).extent, _all(direction=("array", [1.0, 0.0, 0.5]))),
        "load_workspace": Call(sl.load_workspace, _all(file=("file", given.folder / "workspace.nc"))),
        "prove": Call(
            sl.prove,
            _all(
                robot=("one", given.robot),
                box=("one", sl.PoseBox([0.0, 0.0, 2.0], [0.2, 0.1, 2.3])),
                wrenches=("one", sl.WrenchBox(force=2.0), True),
                budget=("number", 0.25),
                model=("one", sl.Catenary()),
                smallest=("number", 0.05, True),
                progress=("callback", lambda done, of: None, True),
            ),
        ),
        "margin": Call(
            sl.margin,
            _all(
                robot=("one", given.robot),
                pose=("one", given.poses),
                wrenches=("one", sl.WrenchBox(force=2.0), True),
                model=("one", sl.Catenary()),
                moment_arm=("number", 0.25, True),
                progress=("callback", lambda done, of: None, True),
            ),
        ),
    }


def _designs(given: _Given) -> dict[str, Call]:
    posts, load = sl.FreeAnchors("frame", -0.5, 0.5, along=[0, 0, 1], symmetry="together"), sl.WrenchBox(20.0, 2.0)
    names = {"progress": ("callback", lambda done, of: None, True), "model": ("one", sl.Catenary())}
    common = {"robot": ("one", given.robot), "wrenches": ("one", load, True), "poses": ("one", given.poses, True)}
    front = sl.design(given.robot, [posts], ["mean_margin"], poses=given.poses, evaluations=16)
    thin, thick = (sl.CableChoice(name, sl.Cable(*of)) for name, of in (("a", (0.05, 3e5)), ("b", (0.1, 6e5))))
    asked = given.folder / "design.yaml"
    asked.write_text("free: [{tension_max: {low: 1 kN, high: 5 kN}}]\ngoals: [least_margin]\n")
    boxed = {
        "poses": ("one", None, True),
        "box": ("one", sl.PoseBox([0.0, 0.0, 1.0], [1.0, 1.0, 2.0]), True),
        "grid": ("wholes", (2, 1, 1)),
    }
    inner = sl.FreeAnchors("platform", -0.125, 0.125, along=[0, 0, 1], symmetry="together")
    shifts = ("array", [-0.5, -0.25, -0.125]), ("array", [0.5, 0.25, 0.125])
    return {
        "AnchorErrors": Call(
            sl.AnchorErrors,
            _all(deviation=("number", 0.25), samples=("whole", 4), take=("word", "mean"), seed=("seed", 3)),
        ),
        "CableChoice": Call(
            sl.CableChoice,
            _all(
                name=("text", "4 mm"),
                cable=("one", given.cable),
                cost=("number", 2.5, True),
                tension_max=("number", 2500.0, True),
            ),
        ),
        "FreeAnchors": Call(
            sl.FreeAnchors,
            _all(
                end=("word", "platform"),
                low=shifts[0],
                high=shifts[1],
                along=("array", np.eye(3)[::-1], True),
                cables=("cables", [0, 3], True),
                symmetry=("word", "xy", True),
            ),
        ),
        "FreeCable": Call(sl.FreeCable, _all(catalogue=("object", [thin, thick]))),
        "FreeLimit": Call(
            sl.FreeLimit,
            _all(
                which=("word", "tension_min"),
                low=("number", 8.0),
                high=("number", 1024.0),
                cables=("cables", [0, 3], True),
            ),
        ),
        "Goal": Call(
            sl.Goal,
            _all(
                kind=("word", "cable_cost"),
                weight=("number", 2.0),
                scale=("number", 64.0, True),
                maximize=("flag", False, True),
            ),
        ),
        "plot.front": Call(lambda **a: (sl.plot.front(**a), None)[1], _all(front=("one", front))),
        "Front.save": Call(front.save, _all(folder=("folder", given.folder / "front"))),
        "design": Call(
            sl.design,
            _all(
                **common,
                **names,
                free=("object", [posts]),
                goals=("object", [sl.Goal("mean_margin")]),
                robust=("one", sl.AnchorErrors(0.25, samples=1), True),
                optimizer=("word", "differential_evolution"),
                evaluations=("whole", 32),
                seed=("seed", 3),
            ),
        ),
        "design: box": Call(
            partial(sl.design, given.robot, [posts], ["mean_margin"], evaluations=16),
            _all(**boxed, inner=("several", [inner]), folder=("folder", given.folder / "search", True)),
        ),
        "moving_anchors: box": Call(partial(sl.moving_anchors, given.robot, [posts]), _all(**boxed)),
        "load_design": Call(sl.load_design, _all(file=("file", asked))),
        "moving_anchors": Call(sl.moving_anchors, _all(**common, **names, moving=("object", [posts]))),
    }


def _distances(given: _Given) -> dict[str, Call]:
    place, edges = ("array", [1.0, 2.0, 3.0]), ("array", [0.5, 0.25, 2.0])
    name, radius = ("text", "lamp"), ("number", 0.25)
    faces = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]
    wedge = sl.Mesh([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]], faces)
    stl, yaml = str(given.folder / "wedge.stl"), str(given.folder / "scene.yaml")
    trimesh.Trimesh(wedge.vertices, wedge.faces).export(stl)
    Path(yaml).write_text(f"base: cogiro\nname: mine\nscene: [{{name: wedge, mesh: {stl}}}]\n", encoding="utf-8")
    turned = ("array", [[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    return {
        "Box": Call(sl.Box, _all(size=edges, center=place, orientation=turned, name=name)),
        "Capsule": Call(sl.Capsule, _all(start=place, end=edges, radius=radius, name=name)),
        "Mesh": Call(sl.Mesh, _all(vertices=("array", wedge.vertices), faces=("array", faces), name=name)),
        "Mesh.placed": Call(wedge.placed, _all(pose=("one", given.pose))),
        "Mesh.encloses": Call(wedge.encloses, _all(points=place)),
        "frame_beams": Call(lambda **a: sl.frame_beams(**a)[0], _all(robot=("one", given.robot), radius=radius)),
        "load_mesh": Call(sl.load_mesh, _all(file=("file", stl), unit=("text", "mm"), name=(*name, True))),
        "load_scene": Call(lambda file: sl.load_scene(file)[0], _all(file=("file", yaml))),
        "Sphere": Call(sl.Sphere, _all(center=place, radius=radius, name=name)),
        "clearance": Call(
            sl.clearance,
            _all(
                state=("one", given.run.state),
                obstacles=("objects", sl.Sphere([3.0, 2.0, 2.0], 0.25)),
                precision=("number", 1e-3),
                cable_radius=("array", np.full(8, 0.125), True),
                platform=("one", sl.Box([0.5, 0.5, 0.5]), True),
                from_anchor=("number", 0.5, True),
            ),
        ),
    }


def _articles(given: _Given) -> dict[str, Call]:
    few = ("array", [8.0, 10.0, 12.0])
    fit = sl.identify_empirical(given.cable, [8.0, 10.0], [-2.0, 1.0], [100.0, 200.0])
    state = sl.Catenary().from_tension(given.cable, [8.0, 10.0, 12.0], -2.0, [50.0, 150.0, 300.0])
    measured = {
        "span": few,
        "rise": ("array", np.full(3, -2.0)),
        "unstrained_length": ("array", state.unstrained_length),
        "tension": ("array", state.frame_end_tension),
    }
    errors = {"length_error": ("number", 0.001), "tension_error": ("number", 1.0), "gravity": ("number", 9.81)}
    return {
        "identify_empirical": Call(
            sl.identify_empirical,
            _all(
                cable=("one", given.cable),
                spans=few,
                rises=("array", [-2.0, 1.0]),
                tensions=("array", [100.0, 200.0]),
                gravity=("number", 9.75),
            ),
        ),
        "EmpiricalFit.tension_min": Call(fit.tension_min, _all(tolerance=("number", 1.0))),
        "EmpiricalFit.weight_max": Call(
            fit.weight_max, _all(tolerance=("number", 1.0), tension=("number", 100.0, True))
        ),
        "identify_cable": Call(
            sl.identify_cable,
            _all(
                **measured,
                **errors,
                tension_at=("word", "frame_end"),
                unknowns=("words", ["linear_density", "axial_stiffness"]),
                start=("one", given.cable, True),
            ),
        ),
    }


def _files(given: _Given) -> dict[str, Call]:
    folder, cable = given.folder, ("one", given.cable, True)
    names = {name: str(folder / name) for name in ("run.nc", "robot.yaml", "path.csv", "cable.csv", "robot.wcrfx")}
    given.run.save(names["run.nc"])
    simulation = a_simulation()
    simulation.save(folder / "sim.nc")
    Path(names["robot.yaml"]).write_text(sl.dump_robot(given.robot), encoding="utf-8")
    Path(names["path.csv"]).write_text("time,x,y,z\n0,0,0,1\n1,1,0,1\n", encoding="utf-8")
    Path(names["cable.csv"]).write_text("span,rise,length,tension\n10,1,10.1,100\n", encoding="utf-8")
    Path(names["robot.wcrfx"]).write_text(_WIREX, encoding="utf-8")
    (folder / "swing_bodies.xml").write_text(_BODIES, encoding="utf-8")
    (folder / "swing_cables.xml").write_text(_CABLES, encoding="utf-8")
    lowest = sl.frequency_map(made.ROBOT, sl.Pose([[0.0, 0.0, 1.5]], np.eye(3)), up_to=3.0)
    return {
        "FrequencyMap.save": Call(lowest.save, _all(file=("file", str(folder / "saved.nc")))),
        "Plan.to_csv": Call(given.run.to_csv, _all(file=("file", str(folder / "saved.csv"), True))),
        "Plan.save": Call(given.run.save, _all(file=("file", str(folder / "saved.nc")))),
        "save_plan": Call(sl.save_plan, _all(plan=("one", given.run), file=("file", str(folder / "saved.nc")))),
        "load_plan": Call(sl.load_plan, _all(file=("file", names["run.nc"]))),
        "Simulation.save": Call(simulation.save, _all(file=("file", str(folder / "saved.nc")))),
        "load_simulation": Call(sl.load_simulation, _all(file=("file", str(folder / "sim.nc")))),
        "load_robot": Call(sl.load_robot, _all(name_or_path=("file", names["robot.yaml"]))),
        **_programs(folder),
        "load_path": Call(sl.load_path, _all(file=("file", names["path.csv"]))),
        "load_measurements": Call(sl.load_measurements, _all(file=("file", names["cable.csv"]))),
        "load_wirex": Call(sl.load_wirex, _all(source=("file", names["robot.wcrfx"]), cables=cable)),
        "load_caspr": Call(
            sl.load_caspr,
            _all(source=("file", str(folder / "swing_bodies.xml")), cables=cable, cable_set=("word", "basic", True)),
        ),
        "dump_robot": Call(sl.dump_robot, _all(robot=("one", given.robot))),
        "export_c": Call(
            sl.export_c,
            _all(
                robot=("one", given.robot),
                file=("file", str(folder / "sagline.c")),
                tension=("methods", sl.Closest()),
                forward=("flag", False),
                single_precision=("flag", True),
            ),
        ),
        "export_scl": Call(
            sl.export_scl,
            _all(robot=("one", sl.load_robot("article-prototype")), file=("file", str(folder / "plc.scl"))),
        ),
        "export_linuxcnc": Call(
            sl.export_linuxcnc,
            _all(
                robot=("one", given.robot),
                folder=("folder", str(folder)),
                name=("text", "cablekins"),
                unit=("word", "inch"),
                tension=("one", sl.Closest()),
                home=("one", given.pose, True),
            ),
        ),
        "export_fmu": Call(
            sl.export_fmu,
            _all(
                robot=("one", given.robot),
                file=("file", str(folder / "robot.fmu")),
                start=("place", sl.inverse(given.robot, given.pose).state, True),
                inputs=("word", "lengths"),
                fmi=("whole", 2),
                winches=("one", sl.SecondOrder(10.0)),
                integrator=("word", "splitting", True),
                step=("number", 5e-4, True),
                damping=("one", sl.Damping(), True),
            ),
        ),
        "dump_mjcf": Call(
            sl.dump_mjcf,
            _all(robot=("one", given.robot), pose=("one", given.pose), unstrained_length=("array", given.length, True)),
        ),
    }


def _programs(folder: Path) -> dict[str, Call]:
    (folder / "part.ngc").write_text("G1 X1 F60\nX2 Y1\n", encoding="utf-8")
    arguments = _all(
        file=("file", str(folder / "part.ngc")),
        rapid=("number", 0.5),
        acceleration=("number", 1.0),
        tolerance=("number", 0.001),
        offsets=("one", {"G54": (0.0, 0.0, 1.0)}, True),
        start=("array", [0.0, 0.0, 1.0], True),
        dialect=("word", "marlin", True),
        rate=("number", 100.0),
    )
    return {
        "load_gcode": Call(sl.load_gcode, arguments),
        "gcode_parts": Call(lambda **given: list(sl.gcode_parts(**given)), arguments),
    }


def _logs(given: _Given) -> dict[str, Call]:
    lengths, cells = np.array([[3.0, 2.0], [3.5, 2.5], [4.0, 2.25]]), np.array([[50.0, 60.0], [np.nan, 61.0], [52, 62]])
    sensors = sl.Sensors(
        *(5e-4, 5.0, 1e-3, 1e-3),
        swivel_deviation=1e-3,
        frequency_deviation=0.02,
    )
    quaternion = np.tile([0.0, 0.6, 0.0, 0.8], (3, 1))
    fields: dict[str, tuple[Any, ...]] = {
        "load_cells": ("array", np.nan_to_num(cells), True),
        "position": ("array", np.ones((3, 3)), True),
        "rotation": ("array", quaternion, True),
        "swivel": ("array", lengths, True),
        "frequency": ("array", np.sort(lengths, axis=1), True),
        "time": ("array", [0.0, 1.0, 2.5], True),
        "commanded": ("one", given.poses, True),
        "sensors": ("one", sensors),
        "source": ("text", "a table"),
    }
    log = sl.WinchLog(unstrained_length=lengths, load_cells=cells, sensors=sensors)
    still = sl.WinchLog(unstrained_length=np.ones((30, 3)), time=np.arange(0.0, 3.0, 0.1))
    file, columns = given.folder / "winches.csv", given.folder / "columns.yaml"
    log.save(file)
    columns.write_text('columns: {length: "length_{}", load_cell: "load_cell_{}"}')
    return {
        "WinchLog": Call(sl.WinchLog, _all(unstrained_length=("array", lengths), **fields)),
        "WinchLog: counts": Call(sl.WinchLog, _all(counts=("array", lengths))),
        "WinchLog.replace": Call(
            log.replace, _all(**{name: fields[name] for name in ("load_cells", "time", "source")})
        ),
        "WinchLog.rows": Call(log.rows, _all(which=("index", 0))),
        "WinchLog.at_rest": Call(still.at_rest, _all(duration=("number", 1.0))),
        "WinchLog.save": Call(log.save, _all(file=("file", str(given.folder / "saved.csv")))),
        "load_log": Call(
            sl.load_log,
            _all(file=("file", str(file)), sensors=("one", sensors, True), columns=("file", str(columns), True)),
        ),
    }


def _calibrations(given: _Given) -> dict[str, Call]:
    truth = true_robot(with_drums(), {"mass": 0.02})
    log = log_of(truth, 8).log
    sensors = {
        "length_deviation": ("array", np.full(8, 5e-4)),
        "tension_deviation": ("array", np.full(8, 5.0), True),
        "position_deviation": ("array", np.full(3, 1e-3), True),
        "rotation_deviation": ("array", np.full(3, 1e-3), True),
        "swivel_deviation": ("array", np.full(8, 1e-3), True),
        "frequency_deviation": ("array", np.full(6, 1e-3), True),
        "frame": ("one", given.pose, True),
        "target": ("array", [0.0, 0.0, 0.125]),
    }
    return {
        "Sensors": Call(sl.Sensors, _all(**sensors)),
        "Sensors.replace": Call(log.sensors.replace, _all(**sensors)),
        "Unknown": Call(
            sl.Unknown,
            _all(name=("word", "linear_density"), deviation=("number", 0.1, True), shared=("flag", True, True)),
        ),
        "calibrate": Call(
            sl.calibrate,
            _all(
                robot=("one", with_drums()),
                log=("one", log),
                unknowns=("one", ("mass",), True),
                model=("one", sl.Catenary()),
                folds=("whole", 2),
                robust=("flag", True),
                progress=("callback", lambda done, of: None, True),
            ),
        ),
    }


def _calibration_files(given: _Given) -> dict[str, Call]:
    found = made_up(count=4, slipped=())
    found.save(given.folder / "found.nc")
    return {
        "Calibration.save": Call(found.save, _all(file=("file", str(given.folder / "saved.nc")))),
        "Calibration.sensor_deviations": Call(found.sensor_deviations, _all(per_cable=("flag", True))),
        "Calibration.value_of": Call(found.value_of, _all(label=("word", "mass"))),
        "Calibration.pose_error": Call(found.pose_error, _all(pose=("one", found.poses))),
        "Calibration.forward": Call(
            found.forward,
            _all(unstrained_length=("array", found.unstrained_length), start=("one", found.poses, True)),
        ),
        "plot.calibration": Call(
            lambda **a: (sl.plot.calibration(**a), None)[1],
            _all(found=("one", found), part=("word", "residuals"), height=("number", 2.0, True)),
        ),
        "load_calibration": Call(sl.load_calibration, _all(file=("file", str(given.folder / "found.nc")))),
    }


def _calibration_poses(given: _Given) -> dict[str, Call]:
    few = {"candidates": ("whole", 12), "seed": ("seed", 3), "progress": ("callback", lambda done, of: None, True)}
    found = sl.calibration_poses(given.robot, 2, ("mass",), candidates=12)
    return {
        "calibration_poses": Call(
            sl.calibration_poses,
            _all(
                robot=("one", given.robot),
                count=("whole", 2),
                unknowns=("one", ("mass", "center_of_mass"), True),
                sensors=("one", sl.Sensors(tension_deviation=4.0), True),
                box=("one", sl.PoseBox([0, 0, 1], [1, 1, 2], 0.125), True),
                **few,
            ),
        ),
        "CalibrationPoses.save": Call(found.save, _all(file=("file", str(given.folder / "poses.yaml")))),
    }


def _figures(given: _Given) -> dict[str, Call]:
    from mpl_toolkits.mplot3d.axes3d import Axes3D

    flat, deep = Figure().add_subplot(), Figure().add_subplot(projection="3d")
    assert isinstance(deep, Axes3D)
    ax, plan, path, proof = ("ax", flat, True), ("one", given.run), ("one", given.path), ("one", sl.confirm(given.run))
    swing = made.vibration(made.state_at(), np.array([1.0, 2.0]), np.array([0.9, 0.1]))
    mapped = sl.frequency_map(made.ROBOT, sl.Pose([[0.0, 0.0, 1.5], [1.0, 0.0, 1.5]], np.eye(3)), up_to=3.0)
    polygon, points = sl.tension_polygon(given.robot, given.pose), {"norm": given.plan.chord_tension}

    def draw_all(confirmation: Any) -> None:
        sl.plot.errors(confirmation)

    def draw(function: Callable[..., Any]) -> Callable[..., Any]:
        def call(**arguments: Any) -> None:
            flat.clear()
            deep.clear()
            function(**arguments)

        return call

    table: dict[str, tuple[Callable[..., Any], dict[str, tuple[Any, ...]]]] = {
        "tensions": (sl.plot.tensions, {"plan": plan, "quantity": ("word", "vertical_force"), "ax": ax}),
        "lengths": (sl.plot.lengths, {"plan": plan, "quantity": ("word", "adjusting_length"), "ax": ax}),
        "overview": (sl.plot.overview, {"plan": plan}),
        "error": (sl.plot.error, {"confirmation": proof, "ax": ax}),
        "errors": (draw_all, {"confirmation": proof}),
        "path": (sl.plot.path, {"path": path, "ax": ax}),
        "velocity": (sl.plot.velocity, {"path": path, "ax": ax}),
        "polygon": (sl.plot.polygon, {"shape": ("one", polygon), "points": ("points", points, True), "ax": ax}),
        "robot": (
            sl.plot.robot,
            {"robot": ("one", given.robot), "pose": ("one", given.pose, True), "ax": ("one", deep, True)},
        ),
        "drawing": (
            sl.plot.drawing,
            {
                "robot": ("one", given.robot),
                "pose": ("one", given.pose, True),
                "azimuth": ("number", 0.5),
                "elevation": ("number", 0.25),
                "ax": ax,
            },
        ),
        "small_multiples": (sl.plot.small_multiples, {"plan": plan, "quantity": ("word", "vertical_force")}),
        "style": (sl.plot.style, {"name": ("word", "ieee"), "columns": ("whole", 2)}),
        "response": (
            sl.plot.response,
            {"vibration": ("one", swing), "force": ("word", "about z"), "motion": ("word", "x", True), "ax": ax},
        ),
        "frequencies": (
            sl.plot.frequencies,
            {
                "vibrations": ("several", [swing, swing]),
                "time": ("array", np.array([0.0, 1.0]), True),
                "label": ("text", "x [m]"),
                "ax": ax,
            },
        ),
        "frequency_map": (sl.plot.frequency_map, {"found": ("one", mapped), "quantity": ("word", "peak")}),
        "film": (
            sl.plot.film,
            {
                "vibration": ("one", swing),
                "number": ("whole", 1),
                "file": ("file", str(given.folder / "mode.gif")),
                "progress": ("callback", lambda done, of: None, True),
            },
        ),
        "energy": (sl.plot.energy, {"simulation": ("one", made.simulation(20))}),
        "simulation": (sl.plot.simulation, {"simulation": ("one", made.simulation(20))}),
        "save": (sl.plot.save, {"drawing": ("one", flat), "file": ("file", str(given.folder / "figure.svg"))}),
    }
    return {f"plot.{name}": Call(draw(function), _all(**arguments)) for name, (function, arguments) in table.items()}


def _sweeps(given: _Given) -> dict[str, Call]:
    request, folder = sl.sweep.Request(given.robot, given.poses), given.folder / "sweep"
    found = sl.sweep.run(request, folder, workers=1)
    file = given.folder / "sweep.yaml"
    file.write_text("robots: cogiro\nposes: {grid: {x: 1, y: 1, z: {low: 1, high: 2, count: 2}}}\n")
    return {
        "sweep.Request": Call(
            sl.sweep.Request,
            _all(
                robots=("object", given.robot),
                poses=("one", given.poses),
                wrenches=("array", np.zeros((2, 6)), True),
                quantities=("words", ["tension", "length"]),
                model=("one", sl.Catenary()),
                tension=("one", sl.MinimumNorm()),
                around=("one", sl.WrenchBox(force=2.0), True),
                moment_arm=("number", 0.25, True),
            ),
        ),
        "sweep.run: scheduler": Call(partial(sl.sweep.run, request, folder), _all(scheduler=("address", None, True))),
        "sweep.run": Call(
            sl.sweep.run,
            _all(
                request=("one", request),
                folder=("file", folder),
                workers=("whole", 1, True),
                progress=("callback", lambda done, of: None, True),
                tell=("callback", lambda text: None, True),
            ),
        ),
        "sweep.load": Call(sl.sweep.load, _all(folder=("file", folder))),
        "sweep.Sweep.values": Call(
            lambda **a: found.values(a.get("name", "status"), (0, a["index"]) if "index" in a else ()),
            _all(name=("word", "status"), index=("index", 0)),
        ),
        "load_sweep": Call(sl.load_sweep, _all(file=("file", file))),
    }


def _twins(given: _Given) -> dict[str, Call]:
    robot = sl.load_robot("article-prototype")
    place = sl.Pose.from_euler([0.0, 0.0, 1.5], 0.0, 0.0, 0.0)
    machine, two = sl.twin.Machine(robot), np.array([3.0, 3.5])
    command = Command(1, 7, Mode.HOLD, 0.1, two, 0.0 * two, 50.0 * two, two > 0.0)
    text, group = ("text", "cell 3 sticks at 40 s"), ("whole", 3)
    return {
        "twin.fault": Call(sl.twin.fault, _all(text=text)),
        "twin.Machine": Call(
            lambda **a: (sl.twin.Machine(**a), None)[1],
            _all(
                robot=("one", robot),
                nominal=("one", robot, True),
                start=("one", place, True),
                seed=("seed", 3),
                period=("number", 0.01),
                step=("number", 1e-3),
                delay=("number", 0.01),
                jitter=("number", 0.01),
                loss=("number", 0.25),
                damping=("one", sl.Damping(1e-3), True),
                surveyed=("flag", False),
                faults=("texts", "cell 3 sticks at 40 s"),
            ),
        ),
        "twin.Machine.link": Call(lambda moves: (machine.link(moves=moves), None)[1], _all(moves=("flag", True))),
        "twin.Machine.claim": Call(machine.claim, _all(group=group, owner=("whole", 7))),
        "twin.Machine.take": Call(machine.take, _all(group=group, command=("object", command))),
        "twin.Machine.report": Call(lambda group: (machine.report(group), None)[1], _all(group=group)),
        "twin.Machine.inject": Call(machine.inject, _all(what=text)),
    }


def _controls(given: _Given) -> dict[str, Call]:
    robot, place = prototype(), at(0.02, 0.0, 1.5)
    path = sl.septic_path([HOME, place], durations=1.0)
    plan, settings = sl.inverse(robot, path), sl.control.TensionSettings()
    machine = sl.twin.Machine(robot)
    done = rig()[0].go_to(place)
    histogram, pose, number = sl.control.Histogram(), ("one", place), ("number", 0.1)
    where, kept, flat = str(given.folder / "run.mcap"), str(given.folder / "kept.mcap"), Figure().add_subplot()
    done.save(kept)
    speeds = _all(pose=pose, speed=number, angular_speed=number)

    def ready(method: str, home: bool = True) -> Callable[..., Any]:
        def call(**arguments: Any) -> None:
            control, _ = rig(home=home)
            if not home:
                control.connect()
            getattr(control, method)(**arguments)

        return call

    def drawn(name: str) -> Callable[..., Any]:
        def call(**arguments: Any) -> None:
            flat.clear()
            getattr(sl.plot, name)(**arguments)

        return call

    found = {
        f"control.Controller.{method}": Call(ready(method), arguments)
        for method, arguments in {
            "plan": _all(path=("one", path)),
            "start": _all(path=("one", path)),
            "execute": _all(path=("one", path)),
            "path_to": speeds,
            "go_to": speeds,
            "events_from": _all(first=("whole", 1)),
            "jog": _all(winch=("cable", 3), by=("number", 1e-3)),
            "start_jog": _all(winch=("cable", 3), by=("number", 1e-3)),
            "jog_platform": _all(by=("array", np.array([1e-3, 0.0, 2e-3]))),
            "start_jog_platform": _all(by=("array", np.array([1e-3, 0.0, 2e-3]))),
        }.items()
    }
    for method in ("home", "begin_homing"):
        found[f"control.Controller.{method}"] = Call(ready(method, home=False), _all(pose=("one", HOME)))
    return found | {
        "control.Controller": Call(
            lambda **a: (sl.control.Controller(**a), None)[1],
            _all(
                robot=("one", robot),
                link=("object", machine.link()),
                model=("one", sl.Catenary(), True),
                tension=("one", sl.Closest(), True),
                loop=("one", settings, True),
                pace=("one", sl.control.Pace(0.01), True),
                record=("recorder", None, True),
                shadow=("flag", False),
                seed=("seed", 3, True),
            ),
        ),
        "control.faults_of": Call(
            lambda **a: (sl.control.faults_of(**a), None)[1],
            _all(
                robot=("one", robot),
                period=("number", 0.01),
                cell_deviation=("number", 1.0, True),
                cell_bias=("number", 2.0, True),
                largest_correction=("number", 5e-3),
                groups=("groups", ((0, 1, 2, 3), (4, 5, 6, 7)), True),
            ),
        ),
        "control.gains_along": Call(
            lambda **a: (sl.control.gains_along(**a), None)[1], _all(plan=("one", plan), every=("number", 0.5))
        ),
        "control.null_space": Call(sl.control.null_space, _all(state=("one", plan.state[0]))),
        "control.parity": Call(sl.control.parity, _all(state=("one", plan.state[0]))),
        "control.TensionLoop": Call(
            lambda **a: (sl.control.TensionLoop(**a), None)[1],
            _all(cable_count=("whole", 8), settings=("one", settings, True), period=("number", 0.01)),
        ),
        "control.TensionSettings": Call(
            sl.control.TensionSettings,
            _all(
                filter_time=("number", 0.5),
                gain=("number", 0.01),
                act_above=("number", 3.0),
                rest_below=("number", 0.5),
                largest=("number", 5e-3),
            ),
        ),
        "control.Histogram.quantile": Call(histogram.quantile, _all(share=("number", 0.5))),
        "control.Pace": Call(lambda period: (sl.control.Pace(period), None)[1], _all(period=("number", 0.01))),
        "control.Samples.at": Call(lambda index: (done.samples.at(index), None)[1], _all(index=("whole", 1))),
        "control.Execution.save": Call(done.save, _all(file=("file", where))),
        "control.planned_position": Call(sl.control.planned_position, _all(execution=("one", done))),
        "control.position_error": Call(sl.control.position_error, _all(execution=("one", done))),
        "control.null_space_error": Call(
            sl.control.null_space_error, _all(execution=("one", done), filter_time=("number", 0.5, True))
        ),
        "load_execution": Call(
            lambda **a: (sl.load_execution(**a), None)[1], _all(file=("file", kept), plan=("entry", 0, True))
        ),
        "plot.execution": Call(lambda done: (sl.plot.execution(done), None)[1], _all(done=("one", done))),
        **{
            f"plot.{name}": Call(drawn(name), _all(done=("one", done), ax=("ax", flat, True)))
            for name in ("states", "measured_tensions", "mendable_tensions", "place_errors")
        },
    }


_WIREX = """<models version="0.32"><robot name="swing" motionpattern="3T"><geometry>
<chain><base x="-1" y="-1" z="2"/><platform x="0" y="0" z="0"/></chain>
<chain><base x="1" y="-1" z="2"/><platform x="0" y="0" z="0"/></chain>
<chain><base x="0" y="1" z="2"/><platform x="0" y="0" z="0"/></chain>
</geometry><platform mass="3"/></robot></models>"""
_BODIES = """<links><link_rigid num="1" name="swing"><joint type="SPATIAL_EULER_XYZ" q_initial="0 0 1 0 0 0"/>
<physical><mass>8</mass><com_location>0 0 0</com_location><end_location>0 0 0.3</end_location>
<inertia ref="com"><Ixx>0.8</Ixx><Iyy>1</Iyy><Izz>0.5</Izz><Ixy>0</Ixy><Ixz>0</Ixz><Iyz>0</Iyz></inertia></physical>
<parent><num>0</num><location>0 0 0</location></parent></link_rigid></links>"""
_CABLES = """<cables default_cable_set="basic"><cable_set id="basic">
<cable_ideal name="left" attachment_reference="joint">
<properties><force_min>5</force_min><force_max>300</force_max></properties><attachments>
<attachment><link>0</link><location>-3 0 4</location></attachment>
<attachment><link>1</link><location>-0.2 0 0.1</location></attachment></attachments></cable_ideal>
</cable_set></cables>"""


def _in_time(given: _Given) -> dict[str, Call]:
    state = given.plan.state

    drive = {"inertia": 0.035, "position_gain": 20.0, "speed_gain": 4e3, "integral_gain": 8e4}
    driven = given.robot.replace(winches=sl.Winch(drum_radius=0.05, **drive))
    driven_state = sl.inverse(driven, given.pose).state
    machine = sl.Simulator(driven, driven_state)
    thick = given.robot.replace(cables=given.robot.cables.replace(diameter=0.004))
    in_wind = sl.inverse(thick, given.pose).state

    def moved(**arguments: Any) -> Any:
        return sl.simulate(**{"start": state, "duration": 0.02, **arguments})

    return {
        "simulate": Call(
            moved,
            _all(
                start=("one", state),
                duration=("number", 0.02),
                step=("number", 5e-4, True),
                cable_mass=("word", "none"),
                nodes=("whole", 20),
                integrator=("word", "splitting", True),
                winches=("one", sl.SecondOrder(10.0)),
                winding=("word", "constant"),
                unstrained_length=("array", given.length, True),
                wrench=("array", [0.0, 0.0, -10.0, 0.0, 1.0, 0.0], True),
                damping=("one", sl.Damping(1e-3), True),
                record=("number", 0.01, True),
                events=("objects", sl.Break(3, 0.02)),
            ),
        ),
        "simulate: pose": Call(partial(sl.simulate, given.robot, duration=0.02), _all(pose=("one", given.pose))),
        "simulate: anchors": Call(
            partial(sl.simulate, given.robot, given.pose, duration=0.02), _all(anchors=("one", given.anchors, True))
        ),
        "simulate: wind": Call(
            partial(sl.simulate, in_wind, duration=0.02),
            _all(wind=("table", ([0.0, 1.0], np.ones((2, 3))), True)),
        ),
        "Simulator": Call(
            lambda **a: (sl.Simulator(**a), None)[1],
            _all(
                robot=("one", given.robot),
                start=("place", state),
                winches=("one", sl.SecondOrder(10.0)),
                winding=("word", "constant"),
                integrator=("word", "splitting", True),
                step=("number", 5e-4, True),
                damping=("one", sl.Damping(1e-3), True),
                load_cell_filter=("number", 0.25),
                seed=("seed", 3),
            ),
        ),
        "Simulator.step": Call(
            lambda **a: sl.Simulator(driven, driven_state).step(**a),
            _all(
                unstrained_length=("sample", given.length),
                dt=("number", 0.25),
                tension=("sample", np.full(8, 50.0), True),
                wrench=("sample", [0.0, 0.0, -10.0, 0.0, 1.0, 0.0], True),
            ),
        ),
        "Simulator.hold": Call(lambda winches: machine.hold(winches), _all(winches=("cable", 3))),
        "Simulator.shift": Call(
            lambda length, winches: machine.shift(length, winches), _all(length=("number", 1e-3), winches=("cable", 3))
        ),
        "Simulator.cut": Call(lambda cable: sl.Simulator(driven, driven_state).cut(cable), _all(cable=("cable", 3))),
        "Simulator.drop": Call(lambda mass: sl.Simulator(driven, driven_state).drop(mass), _all(mass=("number", 1.0))),
        "Simulator.pick_up": Call(
            lambda mass: sl.Simulator(driven, driven_state).pick_up(mass), _all(mass=("number", 1.0))
        ),
        "Simulator.limit_force": Call(
            lambda force, winches: machine.limit_force(force, winches),
            _all(force=("number", 1e3), winches=("cable", 3)),
        ),
        "Simulator.release": Call(lambda winches: machine.release(winches), _all(winches=("cable", 3))),
        "SecondOrder": Call(sl.SecondOrder, _all(bandwidth=("number", 10.0), damping_ratio=("number", 0.75))),
        "Break": Call(sl.Break, _all(cable=("whole", 3), time=("number", 0.5), position=("number", 0.5))),
        "Stall": Call(sl.Stall, _all(winch=("whole", 3), time=("number", 0.5))),
        "Brake": Call(sl.Brake, _all(time=("number", 0.5), winch=("whole", 3, True), duration=("number", 0.25))),
        "Drop": Call(sl.Drop, _all(mass=("number", 3.0), time=("number", 0.5))),
        "PickUp": Call(sl.PickUp, _all(mass=("number", 3.0), time=("number", 0.5))),
    }


def _engines(given: _Given) -> dict[str, Call]:
    import mujoco

    body = '<body name="load" pos="1 1 2"><freejoint/><geom size="0.1" mass="79"/></body>'
    spec = mujoco.MjSpec.from_string(f"<mujoco><worldbody>{body}</worldbody></mujoco>")
    start: dict[str, tuple[Any, ...]] = {
        "robot": ("one", given.robot),
        "unstrained_length": ("array", given.length, True),
        "damping": ("one", sl.Damping(1e-3), True),
    }

    def attach(spec: Any, **arguments: Any) -> None:
        sl.mujoco.attach(spec.copy() if isinstance(spec, mujoco.MjSpec) else spec, **arguments)

    words = _all(spec=("one", spec), body=("word", "load"), prefix=("text", "left/"), **start)
    return {
        "mujoco.attach": Call(attach, words),
        "mujoco.model_of": Call(lambda **a: sl.mujoco.model_of(**a).to_xml(), _all(pose=("one", given.pose), **start)),
        "mujoco.build_plugin": Call(
            lambda **a: sl.mujoco.build_plugin(**a).name, _all(folder=("folder", str(given.folder / "plugins")))
        ),
    }
