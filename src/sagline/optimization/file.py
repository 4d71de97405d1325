"""Design files in YAML with the arguments of a design search."""

from __future__ import annotations

import os
from collections.abc import Callable
from functools import partial
from typing import Annotated, Any, Final, TypeVar

from pydantic import model_validator

from sagline.cables.cable import Cable
from sagline.core.arguments import choice, file_path
from sagline.core.errors import InvalidValueError
from sagline.core.fields import units
from sagline.files.quantity import in_si
from sagline.files.reading import read_text, value_errors
from sagline.files.yaml_text import YAML_LIMIT, YamlEntry, parse_mapping, validate
from sagline.optimization.candidates import AnchorErrors
from sagline.optimization.free import CableChoice, Free, FreeCable, FreeLimit
from sagline.optimization.free_anchors import FreeAnchors
from sagline.optimization.request import KINDS, Goal
from sagline.robot.pose import PoseBox
from sagline.workspaces.wrench_sets import Accelerations, WrenchBox, WrenchSet

T = TypeVar("T")

WAYS: Final = ("goal", "maximize", "minimize")


def load_design(file: str | os.PathLike[str]) -> dict[str, Any]:
    r"""Read a design file, which can contain all arguments of `design` except the robot.

    A quantity is a number in SI units, or a text with a number and a unit:

        free:
          - frame_anchors: {low: [-1, -1, 0], high: [1, 1, 50 cm], symmetry: xy}
          - frame_anchors: {along: [0, 0, 1], low: -1 m, high: 1 m, cables: [0, 1]}
          - platform_anchors: {low: -5 cm, high: 5 cm}
          - tension_max: {low: 500 N, high: 3 kN}
          - cable:                    # one of these is the robot's own
              - {name: 4 mm, linear_density: 10 g/m, axial_stiffness: 300 kN, cost: 2.5}
              - {name: 6 mm, linear_density: 22 g/m, axial_stiffness: 700 kN, cost: 4, tension_max: 5 kN}
        goals:
          - workspace_share           # or mean_margin, least_margin, largest_tension, ... (see Goal)
          - {minimize: cable_cost, weight: 0.5}
        wrenches: {force: 50 N, moment: 5 N*m}             # or three numbers each; also center, accelerations
        box: {low: [-2, -1, 1], high: [2, 1, 2]}           # default: the robot's test box
        grid: [9, 7, 5]
        inner:
          - frame_anchors: {along: [0, 0, 1], low: -1, high: 1, symmetry: together}
        robust: {deviation: 1 cm, samples: 8, take: worst}
        optimizer: cma                # or differential_evolution, nsga2
        evaluations: 600
        seed: 0

    Args:
        file: The file.

    Returns:
        Dictionary of the arguments that the file contains.

    Raises:
        FileError: If the file cannot be read, or if a value is wrong; the message contains key and value.

    Examples:
        >>> from pathlib import Path
        >>> import sagline as sl
        >>> free = "free: [{tension_max: {low: 500 N, high: 3 kN}}]"
        >>> text = free + "\ngoals: [least_margin]"
        >>> Path("design.yaml").write_text(text) > 0
        True
        >>> asked = sl.load_design("design.yaml")  # sl.design(robot, **asked)
        >>> print(asked["free"][0].high, "N;", asked["goals"][0].kind)
        3000.0 N; least_margin
    """
    path = file_path(file)
    entry = validate(parse_mapping(read_text(path, YAML_LIMIT), path), _Design, path)
    with value_errors(path):
        return entry.arguments()


class _Anchors(YamlEntry):
    low: Annotated[Any, "m"]
    high: Annotated[Any, "m"]
    along: Annotated[Any, ""] = None
    cables: list[int] | None = None
    symmetry: str | None = None

    def free(self, end: str) -> Free:
        along = None if self.along is None else self.si("along")
        return FreeAnchors(
            end, self.si("low"), self.si("high"), along=along, cables=self.cables, symmetry=self.symmetry
        )


class _Limit(YamlEntry):
    low: Annotated[Any, "N"]
    high: Annotated[Any, "N"]
    cables: list[int] | None = None

    def free(self, which: str) -> Free:
        return FreeLimit(which, **self.given(), cables=self.cables)


class _Choice(YamlEntry):
    name: str
    linear_density: Annotated[Any, "kg/m"]
    axial_stiffness: Annotated[Any, "N"]
    diameter: Annotated[Any, "m"] = None
    cost: Annotated[Any, ""] = None
    tension_max: Annotated[Any, "N"] = None

    def choice(self) -> CableChoice:
        found = self.given()
        cable = Cable(**{key: found.pop(key) for key in units(Cable) if key in found})
        return CableChoice(self.name, cable, **found)


class _Free(YamlEntry):
    frame_anchors: _Anchors | None = None
    platform_anchors: _Anchors | None = None
    tension_min: _Limit | None = None
    tension_max: _Limit | None = None
    cable: list[_Choice] = []  # noqa: RUF012 - pydantic copies it

    def free(self, item: str) -> Free:
        """Design variable that the entry describes."""
        keys = list(_Free.model_fields)
        given = [key for key in keys if getattr(self, key)]
        if len(given) != 1:
            value = f"of {' and '.join(given)}" if given else "empty"
            raise InvalidValueError(item, value, f"one of {', '.join(keys)}", "Begin each entry with a dash.")
        key = given[0]
        where = f"{item}.{key}"
        if key == "cable":
            catalogue = [_made(f"{where}[{k}]", one.choice) for k, one in enumerate(self.cable)]
            return _made(where, lambda: FreeCable(catalogue))
        free: Callable[[str], Free] = getattr(self, key).free
        return _made(where, lambda: free(key.removesuffix("_anchors")))


class _Goal(YamlEntry):
    goal: str | None = None
    maximize: str | None = None
    minimize: str | None = None
    weight: Annotated[Any, ""] = 1.0
    scale: Any = None  # in the unit of the goal

    @model_validator(mode="before")
    @classmethod
    def _accept_name(cls, data: object) -> object:
        """Accept an entry that is only the name of a goal."""
        return {"goal": data} if isinstance(data, str) else data

    def wanted(self) -> Goal:
        """Goal that the entry describes."""
        given = [way for way in WAYS if getattr(self, way) is not None]
        if len(given) != 1:
            value = f"given by {' and '.join(given)}" if given else "missing"
            raise InvalidValueError("name", value, f"one of {', '.join(WAYS)}", "Write - maximize: workspace_share.")
        way = given[0]
        kind = choice(getattr(self, way), way, KINDS)
        scale: Any = None if self.scale is None else in_si(self.scale, KINDS[kind][0], "scale")
        maximize = None if way == "goal" else way == "maximize"
        return Goal(kind, maximize=maximize, weight=self.si("weight"), scale=scale)


class _Accelerations(YamlEntry):
    linear: Annotated[Any, "m/s^2"] = 0.0
    angular: Annotated[Any, "rad/s^2"] = 0.0


class _Wrenches(YamlEntry):
    force: Annotated[Any, "N"] = 0.0
    moment: Annotated[Any, "N*m"] = 0.0
    center: Any = None
    accelerations: _Accelerations | None = None

    def wrenches(self) -> WrenchSet:
        """Box of wrenches, to which the inertial forces of accelerations are added if the file has accelerations."""
        center = self.center
        if isinstance(center, list) and len(center) == 6:
            center = [in_si(one, "N" if k < 3 else "N*m", f"center[{k}]") for k, one in enumerate(center)]
        found = WrenchBox(self.si("force"), self.si("moment"), center)
        return found if self.accelerations is None else found + Accelerations(**self.accelerations.given())


class _Box(YamlEntry):
    low: Annotated[Any, "m"]
    high: Annotated[Any, "m"]


class _Robust(YamlEntry):
    deviation: Annotated[Any, "m"]
    samples: int = 8
    take: str = "worst"
    seed: int = 0

    def errors(self) -> AnchorErrors:
        """Anchor errors that the entry describes."""
        return AnchorErrors(self.si("deviation"), samples=self.samples, take=self.take, seed=self.seed)


class _Design(YamlEntry):
    free: list[_Free]
    goals: list[_Goal]
    wrenches: _Wrenches | None = None
    box: _Box | None = None
    grid: list[int] = []  # noqa: RUF012 - pydantic copies it
    inner: list[_Free] = []  # noqa: RUF012 - pydantic copies it
    robust: _Robust | None = None
    optimizer: str = "cma"
    evaluations: int = 600
    seed: int = 0

    def arguments(self) -> dict[str, Any]:
        """Arguments of `design` that the file contains."""
        found: dict[str, Any] = {
            "free": [one.free(f"free[{k}]") for k, one in enumerate(self.free)],
            "goals": [_made(f"goals[{k}]", one.wanted) for k, one in enumerate(self.goals)],
            "optimizer": self.optimizer,
            "evaluations": self.evaluations,
            "seed": self.seed,
        }
        if self.inner:
            found["inner"] = [one.free(f"inner[{k}]") for k, one in enumerate(self.inner)]
        if self.wrenches is not None:
            found["wrenches"] = _made("wrenches", self.wrenches.wrenches)
        if self.box is not None:
            found["box"] = _made("box", partial(PoseBox, **self.box.given()))
        if self.grid:
            found["grid"] = tuple(self.grid)
        if self.robust is not None:
            found["robust"] = _made("robust", self.robust.errors)
        return found


def _made(item: str, make: Callable[[], T]) -> T:
    """Call `make` for a part of the file; an error is raised again with the name `item` of the part."""
    try:
        return make()
    except InvalidValueError as error:
        inside = error.item.removeprefix("test_box: ")
        raise InvalidValueError(f"{item}: {inside}", error.value, error.allowed, error.next_step) from None
