"""What every way of sharing the load would choose, as marks in the drawing of the feasible tensions."""

from __future__ import annotations

from contextlib import suppress
from string import ascii_uppercase
from typing import Final, NamedTuple

import numpy as np

from sagline.core.arrays import Array
from sagline.core.errors import InvalidValueError
from sagline.kinematics.inverse import inverse
from sagline.kinematics.inverse_solver import InverseSolver
from sagline.kinematics.plan import Plan
from sagline.kinematics.status import PoseStatus
from sagline.tension.options import takes_default_kernel
from sagline.viewer.dot_field import DotField
from sagline.viewer.settings import METHODS

NEAR: Final = 10.0  # px: marks that are closer share one


class Mark(NamedTuple):
    """A way of sharing.

    Attributes:
        name: As it is chosen.
        letter: That marks it.
        tension: Its chord tensions [N], shape (m,); NaN where it has none.
        missing: Why it has none; "" where it has.
    """

    name: str
    letter: str
    tension: Array
    missing: str = ""


class Marks:
    """The answers of all ways at a pose, kept for as long as nothing but the way changes.

    A robot that is moved is given solvers of its own, which answer a dozen times as fast; it takes them longer to be
    made than to answer once without, and so a robot whose mass follows a slider has none.
    """

    def __init__(self) -> None:
        """Begin with none."""
        self._key: tuple[object, ...] = ()
        self._found: tuple[Mark, ...] = ()
        self._solvers: dict[str, InverseSolver] | None = None

    def at(self, plan: Plan, *, further: bool, verdicts: bool = True) -> tuple[Mark, ...]:
        """The answers at the pose of a plan, at rest under its wrench.

        Args:
            plan: A single pose.
            further: Whether ways can be had whose kernels are compiled apart.
            verdicts: Whether solvers can be had: they say of poses without an answer why.
        """
        state = plan.state
        place = (state.pose.position.tobytes(), state.pose.quaternion.tobytes(), state.wrench.tobytes())
        key = (id(state.robot), type(state.cables.model), further, verdicts, *place)
        if key != self._key:
            ways = [
                (name, letter)
                for (name, method), letter in zip(METHODS.items(), ascii_uppercase, strict=False)
                if further or takes_default_kernel(method)
            ]
            if key[:4] != self._key[:4]:
                self._solvers = None
            elif self._solvers is None and verdicts:
                self._solvers = _solvers(plan, [name for name, _ in ways])
            self._key, self._robot = key, state.robot  # and the id stays this robot's
            self._found = tuple(_mark(plan, name, letter, (self._solvers or {}).get(name)) for name, letter in ways)
        return self._found


def grouped(marks: tuple[Mark, ...], field: DotField) -> list[tuple[tuple[float, float], list[Mark]]]:
    """Marks that have an answer, with those that would lie on each other together, each at its place [px]."""
    groups: list[tuple[tuple[float, float], list[Mark]]] = []
    for mark in marks:
        if mark.missing:
            continue
        x, y = field.place(field.polygon.coordinates(mark.tension))
        home = next((group for (u, v), group in groups if np.hypot(u - x, v - y) < NEAR), None)
        if home is None:
            groups.append(((x, y), [mark]))
        else:
            home.append(mark)
    return groups


def _solvers(plan: Plan, names: list[str]) -> dict[str, InverseSolver]:
    """A solver for each way that can be had for the robot of a plan."""
    robot, model = plan.state.one_robot, plan.state.cables.model
    found = {}
    for name in names:
        with suppress(InvalidValueError):  # `inverse` tells why, and what it does otherwise
            found[name] = InverseSolver(robot, model, METHODS[name].alone)
    return found


def _mark(plan: Plan, name: str, letter: str, solver: InverseSolver | None) -> Mark:
    state = plan.state
    robot, pose = state.one_robot, state.pose
    if solver is not None:
        step = solver.step(pose.position, pose.quaternion, state.wrench)
        tension, status = step.chord_tension, step.status
    else:
        try:
            found = inverse(robot, pose, state.cables.model, METHODS[name], state.wrench)
        except InvalidValueError as error:
            return Mark(name, letter, np.full(robot.cable_count, np.nan), str(error))
        tension, status = found.chord_tension, PoseStatus(int(found.status))
    return Mark(name, letter, tension, "" if status is PoseStatus.SOLVED else status.text)
