"""View, and the interface of its features."""

from __future__ import annotations

import os
import sys
import threading
import time
from collections.abc import Callable, Hashable
from dataclasses import dataclass
from enum import Enum
from typing import Final, TypeVar

from sagline.core.arrays import Array
from sagline.core.errors import SaglineError
from sagline.viewer.drawn import InMotion
from sagline.viewer.player import Played
from sagline.viewer.snapshot import Settings, Snapshot
from sagline.viewer.tension_scale import TensionScale


class Reading(Enum):
    """Readings whose kernels may still be compiled when the cables are drawn."""

    MARGIN = "capacity margin"
    POLYGON = "polygon of feasible tensions"
    SHARING = "what further ways of sharing choose"
    FREQUENCIES = "natural frequencies"
    REST = "where the platform rests if the model is approximate"
    MODES = "modes with cable mass"
    SIMULATION = "what follows when a cable is cut"
    WORKSPACE = "margins over a set of loads"
    VERDICTS = "whether a pose is feasible at all"


@dataclass(frozen=True, slots=True, eq=False)
class View:
    """State of the page, and how it is drawn.

    Attributes:
        snapshot: The robot.
        settings: What is set.
        scale: Colors of tensions.
        ghost: Whether straight cables are drawn beside the real ones.
        wrench: External wrench on a platform that is dragged, shape (6,); None for none.
        played: What is played, if that is shown; None for a pose of one's own.
        playing: Whether its time goes on.
    """

    snapshot: Snapshot | InMotion
    settings: Settings
    scale: TensionScale
    ghost: bool
    wrench: Array | None = None
    played: Played | None = None
    playing: bool = False


class Feature:
    """A feature of the page, made once with the `Page`: its controls, what it draws and says, what it does on a change.

    All of it belongs to the thread that serves; this one does nothing.
    """

    @property
    def moving(self) -> bool:
        """True if the drawing moves."""
        return False

    @property
    def waiting(self) -> bool:
        """True if a result is still to come."""
        return False

    def depends(self, view: View) -> Hashable:
        """All that `follow` depends on: it is called only when this has changed; by default at every view."""
        return view

    def follow(self, view: View) -> None:
        """Draw and say what there is at a view."""

    def tick(self) -> None:
        """Do what time brings."""

    def put_on(self, played: Played | None) -> None:
        """Take note of something else that is played, or nothing."""


T = TypeVar("T")

PATIENCE = 2.0  # s: the time of a longer calculation is written
NICENESS: Final = 10  # a drag comes first where both want a processor: it is then drawn up to twice as often


class BackgroundTask:
    """One calculation at a time in a thread of its own; a new one takes the place of the one before."""

    def __init__(self, later: Callable[[Callable[[], None]], None]) -> None:
        """Prepare; `later` has the serving thread call a function, from any thread."""
        self._later = later
        self._number = 0  # of the calculation asked for last
        self._began: float | None = None
        self._next: Callable[[], None] | None = None

    @property
    def busy(self) -> bool:
        """True if a calculation is running."""
        return self._began is not None

    @property
    def waited(self) -> float:
        """Time that it has been running [s]; 0 up to `PATIENCE`."""
        elapsed = 0.0 if self._began is None else time.monotonic() - self._began
        return elapsed if elapsed > PATIENCE else 0.0

    def start(self, task: Callable[[], T], done: Callable[[T], None], failed: Callable[[str], None]) -> None:
        """Run a task, and in the serving thread `done` with its result or `failed` with its message."""
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
            _lower_priority()
            try:
                result = task()
            except SaglineError as error:
                message = str(error)
                self._later(lambda: end(lambda: failed(message)))
                return
            except BaseException as error:
                mistake = error

                def fail() -> None:
                    raise mistake

                self._later(fail)
                return
            self._later(lambda: end(lambda: done(result)))

        def begin() -> None:
            self._began = time.monotonic()
            threading.Thread(target=work, daemon=True).start()

        if self._began is None:
            begin()
        else:
            self._next = begin


def _lower_priority() -> None:
    """Let this thread have a processor where no other wants it."""
    if sys.platform == "linux":  # elsewhere this would be the whole process
        os.nice(NICENESS)
