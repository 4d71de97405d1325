"""A machine and its controller in one process, on the lockstep clock."""

from __future__ import annotations

from functools import cache
from typing import Any
from weakref import WeakKeyDictionary

import numpy as np

import sagline as sl
from sagline.control.controller import Controller
from sagline.control.link import Command, Missing, Sample
from sagline.control.recording import Recorded
from sagline.control.states import State
from sagline.core.arrays import Array
from sagline.twin.machine import Machine

HOME = sl.Pose.from_euler([0.0, 0.0, 1.5], 0.0, 0.0, 0.0)


@cache
def prototype() -> sl.Robot:
    """The planned machine: load cells without noise, encoders with a zero."""
    robot = sl.load_robot("article-prototype")
    assert robot.winches is not None
    return robot.replace(winches=robot.winches.replace(length_zero=3.0))


def imperfect(zero: float = 0.0, noise: float = 1.0, bias: float = 2.0, seed: int = 5) -> sl.Robot:
    """The same with noisy load cells, and encoders with a given error of zeros, rms [m]."""
    robot, random = prototype(), np.random.default_rng(seed)
    signs, errors = random.choice([-1.0, 1.0], 8), random.standard_normal(8)
    errors *= zero / np.sqrt(np.mean(errors**2))
    return with_zero_errors(robot, errors, load_cell_deviation=noise, load_cell_bias=bias * signs)


def with_zero_errors(robot: sl.Robot, errors: Array, **fields: Any) -> sl.Robot:
    """A robot with additional cable off its drums relative to its encoders [m], and changed fields of its winches."""
    assert robot.winches is not None
    assert robot.winches.length_zero is not None
    return robot.replace(winches=robot.winches.replace(length_zero=robot.winches.length_zero + errors, **fields))


class Busy:
    """A link whose controller sometimes stops for 20 to 50 ms, as on a busy computer, while the machine continues."""

    def __init__(self, link: Any, seed: int) -> None:
        """Wrap a link."""
        self._link, self.groups, self.period = link, link.groups, link.period
        self._random = np.random.default_rng(seed)

    def exchange(self, command: Command | None) -> Sample | Missing:
        if self._random.random() < 0.02:
            for _ in range(int(self._random.integers(2, 6))):
                self._link.exchange(None)
        answer: Sample | Missing = self._link.exchange(command)
        return answer

    def close(self) -> None:
        """Nothing to do."""


class Spy:
    """A link that records all messages."""

    def __init__(self, link: Any) -> None:
        """Wrap a link."""
        self.link, self.groups, self.period = link, link.groups, link.period
        self.commands: list[Command | None] = []
        self.answers: list[Sample | Missing] = []

    def exchange(self, command: Command | None) -> Sample | Missing:
        answer: Sample | Missing = self.link.exchange(command)
        self.commands.append(command)
        self.answers.append(answer)
        return answer

    def close(self) -> None:
        """Nothing to do."""


class Replay:
    """A link that repeats recorded answers to any command."""

    def __init__(self, spy: Spy) -> None:
        """Start with the first answer."""
        self.groups, self.period, self._answers = spy.groups, spy.period, iter(spy.answers)
        self.commands: list[Command | None] = []

    def exchange(self, command: Command | None) -> Sample | Missing:
        self.commands.append(command)
        return next(self._answers)

    def close(self) -> None:
        """Nothing to do."""


class Watcher:
    """An observer that calls a function in one cycle."""

    stopped = ""

    def __init__(self, at: int = -1, call: Any = None) -> None:
        """Observe everything, and call the function once, in the motion cycle with this number."""
        self.cycles: list[Recorded] = []
        self.told: list[tuple[Any, ...]] = []
        self._at, self._call, self.count = at, call, 0

    def begins(self, plan: sl.Plan) -> None:
        self.told.append(("begins", len(self.cycles)))

    def ends(self, status: Any, reason: str) -> None:
        self.told.append(("ends", len(self.cycles), status, reason))

    def cycle(self, cycle: Recorded) -> None:
        self.cycles.append(cycle)
        if self.told:
            self.count += 1
            if self.count == self._at:
                self._call()

    def event(self, event: Any) -> None:
        self.told.append(("event", len(self.cycles), event))


SPIES: WeakKeyDictionary[Controller, Spy] = WeakKeyDictionary()  # of the controllers of `rig`


def rig(true: sl.Robot | None = None, home: bool = True, seed: int = 1, **settings: Any) -> tuple[Controller, Machine]:
    """A connected and homed controller, and its machine."""
    machine = Machine(true or prototype(), nominal=prototype(), start=HOME, seed=seed)
    link = Spy(machine.link())
    control = Controller(prototype(), link, seed=2, **settings)
    SPIES[control] = link
    if home:
        control.connect()
        control.home(HOME)
    return control, machine


def spy_of(control: Controller) -> Spy:
    """Link of a controller of `rig` that records all messages."""
    return SPIES[control]


def state_of(control: Controller) -> State:
    """Present state of the controller."""
    return control.state


def at(x: float, y: float, z: float) -> sl.Pose:
    """A level pose."""
    return sl.Pose.from_euler([x, y, z], 0.0, 0.0, 0.0)


def rest(control: Controller, machine: Machine, seconds: float) -> Array:
    """Mean position of the true platform at rest [m], shape (3,)."""
    places = []
    for _ in range(round(seconds / control.period)):
        control.cycle()
        places.append(machine.reading.position.copy())
    mean: Array = np.mean(places, axis=0)
    return mean
