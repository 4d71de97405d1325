"""The operator's place of `sagline control`: lines that come in while the cycles go on."""

from __future__ import annotations

import sys
from collections.abc import Callable
from functools import partial
from queue import Empty, SimpleQueue
from threading import Thread
from typing import Any, Final, NamedTuple

from sagline.cli.status_line import PROMPT, StatusLine
from sagline.cli.terminal import note, show
from sagline.cli.values import middle_of, quantity, whole_of
from sagline.control.controller import Controller
from sagline.control.real_time import interrupt_calls
from sagline.control.recording import Event, EventKind
from sagline.control.states import State
from sagline.core.errors import InvalidValueError, SaglineError, nearest
from sagline.files.path_file import load_path
from sagline.files.pose_text import pose_of
from sagline.robot.pose import Pose

FAILED: Final = 1  # exit code where a fault ended it
LATE: Final = 0.02  # s, of which a note at the end tells
AXES: Final = ("x", "y", "z")
HELP: Final = (
    ("home [X,Y,Z[,A,B,C]]", "the platform is held there: set lengths and begin; the middle of its box if left out"),
    ("goto X,Y,Z[,A,B,C]", "straight there [m, degrees]"),
    ("run FILE", "follow a path, path.yaml"),
    ("jog WINCH LENGTH", "one winch, from 0: jog 3 +5mm lets cable out"),
    ("jog AXIS LENGTH", "the platform: jog z -10mm"),
    ("pause, resume, stop", "on the path's clock; stop gives the path up"),
    ("wait SECONDS", "go on and do nothing else"),
    ("state", "where it is, and what the cells read"),
    ("ack", "what was wrong is mended"),
    ("off, connect", "give the machine back, and take it again"),
    ("quit", "give it back and end"),
)


class Word(NamedTuple):
    """What a word begins: how the rest of its line is understood, and what is done with that."""

    parse: Callable[[str], Any]
    act: Callable[[Any], object]


class Line(NamedTuple):
    """A line that was understood, or not: then doing it tells why. No text: the end of all lines."""

    text: str | None
    act: Callable[[], object]


class Session:
    """Lines that come in, cycles that go on, and what is told."""

    def __init__(self, controller: Controller, *, alone: bool, shadow: bool) -> None:
        """Begin.

        Args:
            controller: What is driven.
            alone: Whether nobody types: lines wait for one another, and one that is refused ends it.
            shadow: Whether nothing is asked, as it only reads.
        """
        self.control, self._alone, self._shadow = controller, alone, shadow
        self._told = 0
        self._ended = self._pressed = False
        self._wait = 0  # cycles
        self._lines: SimpleQueue[Line] = SimpleQueue()
        self._line = StatusLine(shown=not alone)
        self._words: dict[str, Word] = {
            "home": Word(self._home_pose, self.control.home),
            "goto": Word(partial(_pose, "goto"), lambda pose: self.control.start(self.control.path_to(pose))),
            "run": Word(load_path, self.control.start),
            "jog": Word(self._jog, lambda jog: jog()),
            "pause": Word(_nothing, lambda _: self.control.pause()),
            "resume": Word(_nothing, lambda _: self.control.resume()),
            "stop": Word(_nothing, lambda _: self.control.stop()),
            "wait": Word(self._cycles, self._wait_for),
            "state": Word(_nothing, lambda _: self._tell_state()),
            "ack": Word(_nothing, lambda _: self.control.acknowledge()),
            "connect": Word(_nothing, lambda _: self.control.connect()),
            "off": Word(_nothing, lambda _: self.control.off()),
            "help": Word(_nothing, lambda _: self._tell_help()),
            "quit": Word(_nothing, lambda _: self._end()),
        }

    def run(self) -> int:
        """Go on until the end; returns the exit code."""
        try:
            with interrupt_calls(self._press), self._line:
                self._begin()
                while not self._ended and not self._pressed:
                    self._cycle()
                    if (line := self._due()) is not None:
                        self._do(line)
        finally:
            with interrupt_calls(lambda: None):
                self._leave()
        return FAILED if self.control.state is State.EMERGENCY or self._failed else 0

    @property
    def _failed(self) -> bool:
        return self._alone and any(event.state is State.FAULT for event in self.control.events)

    def _begin(self) -> None:
        if self._shadow:
            show("Reads only: nothing is sent. Ctrl-C ends it.")
            return
        self.control.connect()
        self._tell_events()
        if not self._alone:
            show("help lists what there is to say; home comes first.")
        Thread(target=self._read, name="sagline lines", daemon=True).start()
        self._line.ask()

    def _read(self) -> None:
        """All that the thread does: what is typed or comes through a pipe, and the numbers and files in it."""
        for line in sys.stdin:
            for part in line.split(";"):
                self._lines.put(self._understood(part.strip()))
        self._lines.put(Line(None, self._end))

    def _understood(self, text: str) -> Line:
        """What a line asks for, or why that is not understood."""
        word, _, rest = text.partition(" ")
        if not word or word.startswith("#"):
            return Line("", lambda: None)
        try:
            if word not in self._words:
                near = nearest(word, self._words)
                step = f"Did you mean {near}?" if near else "help lists them."
                raise InvalidValueError("the line", repr(text), "one that begins with a word that is known", step)
            parse, act = self._words[word]
            return Line(text, partial(act, parse(rest.strip())))
        except SaglineError as error:
            return Line(text, partial(_refuse, error))

    def _press(self) -> None:
        self._pressed = True
        self.control.stop()

    def _end(self) -> None:
        self._ended = True

    def _leave(self) -> None:
        """Lead rates to zero, and give the machine back, whatever ended it."""
        control = self.control
        control.stop()
        while control.moving:
            control.cycle()
        if control.state not in (State.OFF, State.EMERGENCY):
            control.off()
        self._tell_events()
        pace = control.pace
        if pace is not None and pace.lateness.longest > LATE:
            often = f"{1e3 * pace.lateness.quantile(0.999):.1f} ms in 999 of 1000 cycles"
            note("Note: ", f"cycles began up to {1e3 * pace.lateness.longest:.0f} ms late, {often} no more.")

    def _cycle(self) -> None:
        self.control.cycle()
        self._wait = max(self._wait - 1, 0)
        self._tell_events()
        self._line.update(self._status)

    def _due(self) -> Line | None:
        """The line to be done now: at once where somebody types, else when nothing moves any more."""
        if self._wait or (self._alone and self.control.moving):
            return None
        if self._alone and self.control.state in (State.FAULT, State.EMERGENCY):
            self._end()
            return None
        try:
            return self._lines.get_nowait()
        except Empty:
            return None

    def _do(self, line: Line) -> None:
        """Do what a line says; what is refused is told, and ends it where nobody types."""
        if self._alone and line.text:
            show(f"{PROMPT}{line.text}", whole=True)
        try:
            line.act()
        except SaglineError as error:
            if self._alone:
                raise
            note("Error: ", str(error), style="bold red")
        self._tell_events()
        self._line.ask()

    def _home_pose(self, text: str) -> Pose:
        return _pose("home", text) if text else middle_of(self.control.robot)

    def _jog(self, text: str) -> Callable[[], None]:
        which, _, far = text.partition(" ")
        by = quantity(far, "jog: LENGTH", "m")
        if which in AXES:
            return partial(self.control.start_jog_platform, [by * (axis == which) for axis in AXES])
        return partial(self.control.start_jog, whole_of(which, "jog: WINCH", 0, self.control.robot.cable_count - 1), by)

    def _cycles(self, text: str) -> int:
        return round(quantity(text, "wait", "s", low=0.0) / self.control.period)

    def _wait_for(self, cycles: int) -> None:
        self._wait = cycles

    @property
    def _status(self) -> str:
        """What the last line of a terminal shows."""
        control, sample = self.control, self.control.sample
        parts = [control.state.name + " (degraded)" * control.degraded]
        if control.homed:
            x, y, z = control.estimate.position
            parts.append(f"({x:+.3f}, {y:+.3f}, {z:+.3f}) m")
        if sample is not None:
            parts.append(f"{sample.filtered.min():.0f} to {sample.filtered.max():.0f} N")
        if control.clock is not None:
            done, whole = control.clock
            parts.append(f"{done:.1f} of {whole:.1f} s")
        return "  ".join(parts)

    def _tell_events(self) -> None:
        events = self.control.events_from(self._told)
        self._told += len(events)
        for event in events:
            self._line.clear()
            show(_told(event))
        if events:
            self._line.ask()

    def _tell_state(self) -> None:
        control, sample = self.control, self.control.sample
        show(self._status)
        if sample is None:
            return
        show(f"lengths [m]      {' '.join(f'{x:8.4f}' for x in sample.length + control.zero)}", whole=True)
        show(f"tensions [N]     {' '.join(f'{x:8.1f}' for x in sample.filtered)}", whole=True)
        show(f"grants           {' '.join('mine' if x == control.owner else str(x) for x in sample.owner)}")
        if control.pace is not None:
            often, most = control.pace.lateness.quantile(0.999), control.pace.lateness.longest
            show(f"cycles late      {1e3 * often:.1f} ms (999 of 1000), {1e3 * most:.1f} ms at most")

    def _tell_help(self) -> None:
        wide = max(len(words) for words, _ in HELP)
        for words, sense in HELP:
            show(f"{words.ljust(wide)}  {sense}")


def _pose(item: str, text: str) -> Pose:
    if not text:
        raise InvalidValueError(item, "without a pose", "X,Y,Z or X,Y,Z,A,B,C", f"Say {item} 0.2,-0.4,1.4.")
    return pose_of(text, item, f"Give meters, and degrees about z, y and x: {item} 0.2,-0.4,1.4.")


def _nothing(text: str) -> None:
    if text:
        raise InvalidValueError("the line", f"followed by {text!r}", "that word alone", "Leave it out.")


def _refuse(error: SaglineError) -> None:
    raise error


def _told(event: Event) -> str:
    name = f"{event.name}: " if event.kind is not EventKind.NOTE else ""
    return f"{event.time:9.2f} s  {name}{event.text}"
