"""Interface of the features of the viewer: the state of the page that they display, and background tasks."""

from __future__ import annotations

import os
import sys
import threading
import time
from collections.abc import Callable, Hashable
from dataclasses import dataclass
from functools import partial
from typing import Final, TypeVar

from sagline.core.arrays import Array
from sagline.core.errors import SaglineError
from sagline.robot.equilibrium import Equilibrium
from sagline.viewer.player import Configuration, Played
from sagline.viewer.snapshot import MissingWrench, Settings, Snapshot
from sagline.viewer.tension_scale import TensionScale


@dataclass(frozen=True, slots=True, eq=False)
class View:
    """State of the page: configuration of the robot, and settings of the controls."""

    snapshot: Configuration
    settings: Settings
    scale: TensionScale  # colors of tensions
    ghost: bool  # True if straight cables are drawn beside the sagging ones
    wrench: Array | None = None  # external wrench on the platform while it is dragged, shape (6,)
    played: Played | None = None  # played motion (run, simulation or log) if it is shown; None for a pose of the user
    missing: MissingWrench | None = None  # missing wrench of an infeasible pose, if one was found
    playing: bool = False  # True if the clock runs

    @property
    def state(self) -> Equilibrium | None:
        """The shown equilibrium; None during a motion, and if the pose is not feasible."""
        plan = self.snapshot.plan if isinstance(self.snapshot, Snapshot) else None
        return plan.state if plan is not None and self.snapshot.feasible else None


class Feature:
    """Base of a feature of the page, which does nothing. The serving thread calls all methods of a feature."""

    # True if the feature follows every view of a drag that changes its key, unless the key is None, because it draws at
    # the pose. Others follow up to 20 views per second.
    live: bool = False
    _task: BackgroundTask | None = None  # background task of a feature that has one

    @property
    def moving(self) -> bool:
        """True if the drawing moves."""
        return False

    @property
    def waiting(self) -> bool:
        """True while a result is being computed."""
        return self._task is not None and self._task.busy

    def depends(self, view: View) -> Hashable:
        """Key of all inputs of `follow`, which is called only if the key changes; the default is a new key per view."""
        return view

    def follow(self, view: View) -> None:
        """Update drawing and text for a new view."""

    def tick(self) -> None:
        """Do periodic work; it is called after every update, and at least every half second."""

    def put_on(self, played: Played | None) -> None:
        """React to a new played motion, or to the end of playing."""


T = TypeVar("T")

PATIENCE: Final = 2.0  # [s], the elapsed time of a longer calculation is shown
NICENESS: Final = 10  # increase of the niceness, by which a busy processor draws a drag up to twice as often


class BackgroundTask:
    """Calculations in a separate thread, one at a time; a new calculation replaces the previous one."""

    def __init__(self, later: Callable[[Callable[[], None]], None]) -> None:
        """Store `later`, with which any thread makes the serving thread call a function."""
        self._later = later
        self._number = 0  # number of the last calculation
        self._began: float | None = None
        self._next: Callable[[], None] | None = None

    @property
    def busy(self) -> bool:
        """True if a calculation is running."""
        return self._began is not None

    @property
    def elapsed(self) -> float:
        """Time since the start of the calculation [s]; 0 until `PATIENCE` has passed."""
        elapsed = 0.0 if self._began is None else time.monotonic() - self._began
        return elapsed if elapsed > PATIENCE else 0.0

    def start(self, task: Callable[[], T], done: Callable[[T], None], failed: Callable[[str], None]) -> None:
        """Run a task; the serving thread then calls `done` with the result, or `failed` with the error message."""
        self._number += 1
        number = self._number

        def end(report: Callable[[], None]) -> None:
            self._began = None
            if number == self._number:
                report()
            if self._next is not None:
                begin_next, self._next = self._next, None
                begin_next()

        def work() -> None:
            if sys.platform == "linux":  # on other systems this would affect the whole process
                os.nice(NICENESS)
            try:
                report = partial(done, task())
            except SaglineError as error:
                report = partial(failed, str(error))
            except BaseException as error:
                self._later(partial(_raise, error))
                return
            self._later(lambda: end(report))

        def begin() -> None:
            self._began = time.monotonic()
            threading.Thread(target=work, daemon=True).start()

        if self._began is None:
            begin()
        else:
            self._next = begin


def _raise(error: BaseException) -> None:
    raise error
