"""Request of a sweep: robots, poses, wrenches, and the quantities to compute; sweep files in YAML, with units."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator, Sequence, Sized
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Annotated, Any, Final, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from sagline.cables.model import CableModel
from sagline.cables.models import Catenary, model_of
from sagline.core.arguments import brief, check_memory, choice, elements, file_path, listed, whole_number
from sagline.core.arrays import Array, checked, locked, number
from sagline.core.errors import FileError, InvalidValueError
from sagline.core.numbers import counted
from sagline.core.results import Result, set_fields
from sagline.files.quantity import in_si
from sagline.files.reading import read_text, value_errors
from sagline.files.robot_file import load_robot
from sagline.files.variables import Quantity
from sagline.files.yaml_text import YAML_LIMIT, YamlEntry, parse_mapping, validate
from sagline.kinematics.forward_rows import without_guides
from sagline.kinematics.status import PoseStatus
from sagline.robot.catalogue import robot_names
from sagline.robot.pose import Pose, PoseLike, pose_of
from sagline.robot.reach import check_reach
from sagline.robot.robot import Robot
from sagline.tension.method import TensionMethod, kernel_options
from sagline.tension.methods import DEFAULT, method_of
from sagline.workspaces.margin import MarginStatus
from sagline.workspaces.wrench_sets import WrenchBox, WrenchSet, load_of

_CABLE: Final = ("cable",)  # last dimension, after robot, pose and wrench
_STATUS: Final = Quantity("status", (), "", "status of each request", codes=PoseStatus)
_CHANGE: Final = "change of force that makes the request feasible"
_PROOF: Final = Quantity("proof", (), "N", f"proved lower bound of the {_CHANGE}, 0 if it is feasible")
_TENSION: Final = Quantity("tension", _CABLE, "N", "tension along the chord, T_x / cos phi")
_LENGTH: Final = Quantity("length", _CABLE, "m", "unstrained length L of the cable off the drum")
_LIMIT: Final = "cable whose limit has the most effect on the margin, or -1"

QUANTITIES: Final = MappingProxyType(
    {
        "tension": (_STATUS, _PROOF, _TENSION),
        "length": (_STATUS, _PROOF, _LENGTH),
        "shortfall": (_STATUS, _PROOF, Quantity("enough", (), "N", _CHANGE)),
        "margin": (
            Quantity("margin_status", (), "", "verdict of the margin's bracket", codes=MarginStatus),
            Quantity("margin", (), "N", "additional load that the cables can balance; if negative, excess load"),
            Quantity("margin_low", (), "N", "lower bound of the margin; if >= 0, the request is feasible"),
            Quantity("margin_high", (), "N", "upper bound of the margin; if negative, the request is infeasible"),
            Quantity("limiting_cable", (), "", _LIMIT, values=np.int8),
        ),
    }
)


def variables_of(quantities: Iterable[str]) -> tuple[Quantity, ...]:
    """Names of the variables that contain the given quantities, without repetitions."""
    return tuple(dict.fromkeys(variable for name in quantities for variable in QUANTITIES[name]))


MOST: Final = 1 << 40  # largest number of requests; a hundred cores need about a year for them
_CATENARY: Final = Catenary()


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Request(Result):
    """Request of a sweep: quantities to compute for every robot at every pose under every wrench.

    Attributes:
        robots: The R robots.
        poses: Batch of P poses.
        wrenches: External wrenches on the platform, about the center of mass in world axes [N, N m], shape (W, 6).
        quantities: Quantities to compute, in the order of `sl.sweep.QUANTITIES`, such as "tension" or "margin".
        model: Cable model.
        tension: Tension distribution method, applied to each request independently.
        around: Set of loads that is added to each wrench for the margin; None for each wrench alone.
        moment_arm: Lever arm by which the margin divides moments [m]; None for the mean lever arm of each robot.
    """

    robots: tuple[Robot, ...]
    poses: Pose
    wrenches: Array
    quantities: tuple[str, ...]
    model: CableModel
    tension: TensionMethod
    around: WrenchSet
    moment_arm: float | None

    def __init__(
        self,
        robots: Robot | Sequence[Robot],
        poses: PoseLike,
        wrenches: ArrayLike | None = None,
        quantities: str | Sequence[str] = ("tension",),
        *,
        model: CableModel | str = _CATENARY,
        tension: TensionMethod | str = DEFAULT.alone,
        around: WrenchSet | None = None,
        moment_arm: float | None = None,
    ) -> None:
        """Check the arguments of the request.

        Args:
            robots: A robot, or a sequence of robots, which may have different numbers of cables.
            poses: A single pose, or a batch.
            wrenches: Force [N], then moment [N m], shape (6,) or (W, 6); None for the weight alone.
            quantities: One or several of `sl.sweep.QUANTITIES`.
            model: Cable model.
            tension: Tension distribution method.
            around: Set of loads that is added to each wrench for the margin; None for each wrench alone.
            moment_arm: Lever arm by which the margin divides moments [m], >= 0, as in `sl.margin`.

        Raises:
            InvalidValueError: If an argument has a wrong type, or is empty; if the tension distribution method is not
                defined for a robot; if the motion pattern of a robot does not allow a pose.
        """
        machines = listed(robots, Robot, "robots")
        batch = pose_of(poses, "poses")
        if not batch.shape:
            batch = pose_of([batch])
        loads = np.atleast_2d(checked(np.zeros(6) if wrenches is None else wrenches, "wrenches", "N, N m", shape=(6,)))
        if loads.ndim > 2:
            raise InvalidValueError("wrenches", f"of shape {loads.shape}", "shape (6,) or (W, 6)", "Reshape to (W, 6).")
        words = elements(quantities, str, "quantities", "Give quantities as a list.")
        chosen = {choice(word, f"quantities[{k}]", QUANTITIES) for k, word in enumerate(words)}
        if len(chosen) < len(words):
            raise InvalidValueError("quantities", brief(list(words)), "each once", "Omit repeated names.")
        parts: dict[str, Sized] = {"robots": machines, "poses": batch, "wrenches": loads, "quantities": chosen}
        for item, some in parts.items():
            if not len(some):
                raise InvalidValueError(item, "empty", "one or more", f"Give {item}.")
        if (count := len(machines) * len(batch) * len(loads)) > MOST:
            raise InvalidValueError("the sweep", f"of {count:,} requests", f"<= {MOST:,}", "Make several sweeps.")
        model, method = model_of(model), method_of(tension).alone
        for one in machines:
            kernel_options(without_guides(one, "a sweep", "inverse"), model, method)
            check_reach(one, batch, "poses")
        set_fields(
            self,
            robots=machines,
            poses=batch,
            wrenches=locked(np.ascontiguousarray(loads)),
            quantities=tuple(name for name in QUANTITIES if name in chosen),
            model=model,
            tension=method,
            around=load_of(around),
            moment_arm=None if moment_arm is None else number(moment_arm, "moment_arm", "m", low=0.0),
        )

    @property
    def shape(self) -> tuple[int, int, int]:
        """Numbers of robots, poses and wrenches in the request."""
        return len(self.robots), len(self.poses), len(self.wrenches)

    def __str__(self) -> str:
        """Numbers of robots, poses and wrenches in the request."""
        return " x ".join(map(counted, self.shape, ("robot", "pose", "wrench")))

    @property
    def cable_count(self) -> int:
        """Largest number of cables of all robots."""
        return max(robot.cable_count for robot in self.robots)

    def __len__(self) -> int:
        """Number of requests."""
        robots, poses, wrenches = self.shape
        return robots * poses * wrenches


class RequestBox(NamedTuple):
    """Box of requests: the index of one robot, a range of poses and a range of wrenches."""

    robot: int
    poses: slice
    wrenches: slice

    @property
    def shape(self) -> tuple[int, int]:
        """Numbers of poses and wrenches in the box."""
        return self.poses.stop - self.poses.start, self.wrenches.stop - self.wrenches.start

    def pieces(self, most: int) -> Iterator[RequestBox]:
        """Smaller boxes with at most `most` requests each, which together are this box."""
        wide = min(self.shape[1], most)
        tall = max(1, most // wide)
        for first in range(self.poses.start, self.poses.stop, tall):
            for left in range(self.wrenches.start, self.wrenches.stop, wide):
                rows = slice(first, min(first + tall, self.poses.stop))
                yield RequestBox(self.robot, rows, slice(left, min(left + wide, self.wrenches.stop)))


KEYS: Final = ("low", "high", "count")  # keys of an axis: first point, last point and number of points
MOST_POINTS: Final = 1_000_000  # largest number of points along an axis
_POINT_BYTES: Final = 400.0  # [bytes], memory per point of a grid during the construction of poses


class _Grid(YamlEntry):
    """Grid of poses in a sweep file; each coordinate is one value or an axis."""

    x: Annotated[Any, "m"]
    y: Annotated[Any, "m"]
    z: Annotated[Any, "m"]
    alpha: Annotated[Any, "rad"] = 0.0
    beta: Annotated[Any, "rad"] = 0.0
    gamma: Annotated[Any, "rad"] = 0.0


class _Poses(YamlEntry):
    grid: _Grid | None = None
    path: str | None = None


class _Loads(YamlEntry):
    """Grid of forces and moments in a sweep file; each component is one value or an axis."""

    force_x: Annotated[Any, "N"] = 0.0
    force_y: Annotated[Any, "N"] = 0.0
    force_z: Annotated[Any, "N"] = 0.0
    moment_x: Annotated[Any, "N*m"] = 0.0
    moment_y: Annotated[Any, "N*m"] = 0.0
    moment_z: Annotated[Any, "N*m"] = 0.0


class _Wrenches(YamlEntry):
    grid: _Loads | None = None
    rows: list[Any] | None = None


class _Around(YamlEntry):
    """Box of loads around each wrench: largest force and moment components, as one number or three numbers each."""

    force: Annotated[Any, "N"] = 0.0
    moment: Annotated[Any, "N*m"] = 0.0


class _SweepEntry(YamlEntry):
    robots: Any
    poses: _Poses
    wrenches: _Wrenches | None = None
    around: _Around | None = None
    moment_arm: Any = None
    quantities: Any = "tension"
    model: str = "catenary"
    tension: str = "minimum-norm"


def load_sweep(file: os.PathLike[str] | str) -> Request:
    """Read a sweep file.

    A sweep file is YAML. A quantity is a number in SI units, or a text with its unit. A quantity that varies is an axis
    with low end, high end and number of points.

        robots: [cogiro, own_robot.yaml]       # presets, and files in the same folder
        poses:
          grid:                                # or path: own_path.yaml, for the poses of a path
            x: {low: -3 m, high: 3 m, count: 25}
            y: {low: -2 m, high: 2 m, count: 17}
            z: 1500 mm
            alpha: {low: -10 deg, high: 10 deg, count: 3}   # about z; beta about y, gamma about x
        wrenches:                              # default: the weight alone
          grid:                                # or rows: [[fx, fy, fz, mx, my, mz], ...]
            force_x: {low: -100 N, high: 100 N, count: 11}
            moment_z: 5 N*m
        around: {force: 20 N, moment: 5 N*m}   # the margin is for all these loads around each wrench
        quantities: [tension, margin]          # names from sl.sweep.QUANTITIES
        model: catenary                        # as in sagline track; the key tension is also possible

    Args:
        file: The file.

    Returns:
        Request of the sweep.

    Raises:
        FileError: If the file cannot be read, or if it is not a valid request; the message names the key.

    Examples:
        >>> import sagline as sl
        >>> request = sl.load_sweep("own_sweep.yaml")  # doctest: +SKIP
    """
    path = file_path(file)
    if path.suffix.lower() not in (".yaml", ".yml"):
        step = "Give a sweep file: sagline examples writes one."
        raise FileError.of(path, InvalidValueError("the suffix", path.suffix or "missing", ".yaml, .yml", step))
    entry = validate(parse_mapping(read_text(path, YAML_LIMIT), path), _SweepEntry, path)
    with value_errors(path):
        return Request(
            _robots(entry.robots, path.parent),
            _poses(entry.poses, path.parent),
            _wrenches(entry.wrenches),
            entry.quantities,
            model=model_of(entry.model),
            tension=method_of(entry.tension),
            around=None if entry.around is None else WrenchBox(**entry.around.given("around.")),
            moment_arm=None if entry.moment_arm is None else _one(entry.moment_arm, "moment_arm", "m"),
        )


def _robots(given: Any, folder: Path) -> list[Robot]:
    names = given if isinstance(given, list) else [given]
    for k, name in enumerate(names):
        if not isinstance(name, str) or not name.strip():
            step = f"Give a preset ({', '.join(robot_names()[:3])}, ...) or a robot file."
            raise InvalidValueError(f"robots[{k}]", brief(name), "the name of a robot, or its file", step)
    # the path of a robot file is relative to the folder of the sweep file
    files = (name not in robot_names() and Path(name).suffix.lower() in (".yaml", ".yml") for name in names)
    return [load_robot(folder / name if is_file else name) for name, is_file in zip(names, files, strict=True)]


def _check_one_of(given: YamlEntry, item: str, allowed: str, step: str) -> None:
    """Refuse an entry in which not exactly one of its two keys is given."""
    found = [name for name, value in given if value is not None]
    if len(found) != 1:
        raise InvalidValueError(item, f"given by {' and '.join(found)}" if found else "not given", allowed, step)


def _poses(given: _Poses, folder: Path) -> Pose:
    _check_one_of(given, "poses", "a grid, or a path", "Give one of the two.")
    if given.path is not None:
        from sagline.files.path_file import load_path

        return load_path(folder / file_path(given.path, "poses.path")).pose
    assert given.grid is not None
    points = _product(given.grid, "poses.grid.")
    return Pose.from_euler(points[:, :3], *points[:, 3:].T)


def _wrenches(given: _Wrenches | None) -> Array | None:
    if given is None:
        return None
    _check_one_of(given, "wrenches", "a grid, or rows", "Give one of the two, or leave wrenches out.")
    if given.grid is not None:
        return _product(given.grid, "wrenches.grid.")
    units = _Loads.units()
    rows = []
    for k, row in enumerate(given.rows or ()):
        if not isinstance(row, list) or len(row) != len(units):
            step = "Give force x, y, z, then moment x, y, z."
            raise InvalidValueError(f"wrenches.rows[{k}]", brief(row), "a list of six quantities", step)
        cells = zip(row, units.items(), strict=True)
        rows.append([_one(value, f"wrenches.rows[{k}]: {name}", unit) for value, (name, unit) in cells])
    return np.array(rows).reshape(-1, len(units))


def _one(given: Any, item: str, unit: str) -> float:
    if isinstance(given, list | dict):
        raise InvalidValueError(item, brief(given), f"one number in {unit}, or text with a unit", f"Correct {item}.")
    return number(in_si(given, unit, item), item, unit)


def _axis(given: Any, item: str, unit: str) -> Array:
    """Points of an axis, or a single value, from an entry of the file."""
    if not isinstance(given, dict):
        return np.array([_one(given, item, unit)])
    if set(given) != set(KEYS):
        keys = ", ".join(map(str, given)) or "nothing"
        raise InvalidValueError(item, f"given by {brief(keys)}", ", ".join(KEYS), "Give all three keys, or one value.")
    low, high = (_one(given[key], f"{item}.{key}", unit) for key in KEYS[:2])
    count = whole_number(given["count"], f"{item}.count", 1, MOST_POINTS)
    if high < low or (high > low) != (count > 1):
        allowed = f"{count} points from low up to high" if count > 1 else "one value instead of an axis with one point"
        raise InvalidValueError(item, f"{low:g} to {high:g} {unit}", allowed, f"Correct {item}.")
    return np.linspace(low, high, count)


def _product(grid: _Grid | _Loads, within: str) -> Array:
    """All points (N, axes) of a grid in SI units; the last axis varies fastest."""
    axes = [_axis(getattr(grid, name), within + name, unit) for name, unit in type(grid).units().items()]
    count = int(np.prod([float(len(axis)) for axis in axes]))
    check_memory(f"a grid of {count:,} points", _POINT_BYTES * count, "Give fewer points.")
    return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, len(axes))
