"""Python code that reproduces what is shown."""

from __future__ import annotations

from dataclasses import fields
from os import PathLike, fspath
from typing import Any, Final, NamedTuple

import numpy as np

from sagline.core.arrays import Array
from sagline.robot.pose import Pose
from sagline.robot.robot import Robot
from sagline.tension.methods import QuadraticProgram
from sagline.viewer.drawn import InMotion
from sagline.viewer.feature import View
from sagline.viewer.playback import Moment, Run
from sagline.viewer.session import SessionMoment
from sagline.viewer.snapshot import Settings, Snapshot
from sagline.viewer.tension_scale import number


class Source(NamedTuple):
    """Python expressions for what the page was opened with.

    Attributes:
        robot: An expression for the robot; "" where nobody said.
        mass: Of the platform with a payload [kg]; None for the robot's own.
        played: An expression for the plan, simulation or execution; "" for none.
    """

    robot: str = ""
    mass: float | None = None
    played: str = ""

    @classmethod
    def of_robot(cls, name_or_path: str | PathLike[str], mass: float | None = None) -> Source:
        """A robot by its name or its file, perhaps with another mass [kg]."""
        return cls(f"sl.load_robot({fspath(name_or_path)!r})", mass)

    @classmethod
    def of_plan(cls, file: PathLike[str]) -> Source:
        """A plan in a file."""
        played = f"sl.load_plan({fspath(file)!r})"
        return cls(f"{played}.state.one_robot", None, played)

    @classmethod
    def of_simulation(cls, file: PathLike[str]) -> Source:
        """A simulation in a file."""
        played = f"sl.load_simulation({fspath(file)!r})"
        return cls(f"{played}.robot", None, played)

    @classmethod
    def of_log(cls, file: PathLike[str]) -> Source:
        """A log of the controller."""
        played = f"sl.load_execution({fspath(file)!r})"
        return cls(f"{played}.robot", None, played)

    @classmethod
    def of_calibration(cls, file: PathLike[str]) -> Source:
        """A calibration in a file."""
        return cls(f"sl.load_calibration({fspath(file)!r}).robot")


SHOWN: Final = "print(tension)  # [N], cable by cable"


def code_of(view: View, robot: Robot, source: Source, time: float = 0.0) -> str:
    """Lines of Python whose last names hold what is on the screen: `robot`, `pose`, `tension`."""
    snapshot = view.snapshot
    if isinstance(snapshot, InMotion):
        lines = _of_moment(snapshot, source)
    elif isinstance(view.played, Run):
        lines = _of_run(snapshot, source, view.played.index_at(time))
    else:
        lines = [*_opened(robot, source), *changes(view.settings, robot), *_planned(snapshot, view)]
    return "\n".join(["import sagline as sl", "", *lines, SHOWN, ""])


def _opened(robot: Robot, source: Source) -> list[str]:
    """The robot as the page was opened with it."""
    lines = [f"robot = {source.robot or f'sl.load_robot({robot.name!r})'}"]
    return lines if source.mass is None else [*lines, _weighed(source.mass)]


def _of_run(snapshot: Snapshot, source: Source, index: int) -> list[str]:
    lines = [f"plan = {source.played}", f"index = {index}"]
    lines += ["robot, pose = plan.state.one_robot, plan.state.pose[index]", "tension = plan.chord_tension[index]"]
    return lines if snapshot.rest is None else [*lines, "rest = sl.confirm(plan).pose[index]  # where it really rests"]


def _of_moment(moment: InMotion, source: Source) -> list[str]:
    if isinstance(moment, SessionMoment):
        return [
            f"log = {source.played}",
            f"index = {moment.index}  # {moment.time:g} s",
            "robot, tension = log.robot, log.samples.tension[index]",
        ]
    assert isinstance(moment, Moment)
    return [
        f"simulation = {source.played}",
        f"index = {moment.index}  # {moment.time:g} s",
        "robot, pose = simulation.robot, simulation.pose[index]",
        "tension = simulation.tensions[index]",
    ]


def changes(settings: Settings, robot: Robot) -> list[str]:
    """Lines of the changes of a robot by the settings."""
    lines = [] if settings.mass == robot.mass else [_weighed(settings.mass)]
    factors = {"linear_density": settings.density, "axial_stiffness": settings.stiffness}
    changed = [f"    {name}=cables.{name} * {factor!r}," for name, factor in factors.items() if factor != 1.0]
    if changed:
        lines += ["cables = robot.cables", "robot = robot.replace(cables=cables.replace(", *changed, "))"]
    return lines


def _weighed(mass: float) -> str:
    return f"robot = robot.replace(mass={mass!r}, inertia=robot.inertia * ({mass!r} / robot.mass))"


def _planned(snapshot: Snapshot, view: View) -> list[str]:
    """A robot held at a pose by a plan."""
    settings = view.settings
    arguments = [
        f"model={written(settings.model)}",
        f"tension={written(settings.tension)}",
        *([] if view.wrench is None else [f"wrench={_list(view.wrench)}"]),
        *([] if snapshot.previous is None else [f"previous={_list(snapshot.previous)}"]),
    ]
    lines = [*_pose(snapshot.pose), "plan = sl.inverse(", "    robot,", "    pose,"]
    lines += [f"    {argument}," for argument in arguments] + [")", "tension = plan.chord_tension"]
    if snapshot.rest is not None:
        lines += ["rest = sl.confirm(plan).pose  # where it really rests"]
    return lines


def _pose(pose: Pose) -> list[str]:
    angles = ", ".join(number(angle, ".6g") for angle in pose.rotation.as_euler("ZYX", degrees=True))
    return [
        f"# alpha, beta, gamma = {angles} degrees",
        f"pose = sl.Pose.from_quaternion({_list(pose.position)}, {_list(pose.quaternion)})",
    ]


def written(choice: Any) -> str:
    """A cable model or a way of sharing the load as one writes it: its name and the arguments that are not usual."""
    kind = QuadraticProgram if isinstance(choice, QuadraticProgram) else type(choice)  # by hand or not
    usual = kind()
    given = {field.name: getattr(choice, field.name) for field in fields(usual)}
    arguments = [f"{name}={_plain(value)}" for name, value in given.items() if not _same(value, getattr(usual, name))]
    return f"sl.{kind.__name__}({', '.join(arguments)})"


def _same(one: Any, other: Any) -> bool:
    return one is other or (one is not None and other is not None and bool(np.array_equal(one, other)))


def _plain(value: Any) -> str:
    return _list(value) if isinstance(value, np.ndarray) else repr(value)


def _list(values: Array) -> str:
    return repr(np.asarray(values).tolist())
