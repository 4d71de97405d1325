"""Session of `sagline control`. It reads lines of an operator or a pipe while the controller runs its cycles."""

from __future__ import annotations

import shutil
import sys
import time
from collections.abc import Callable
from functools import partial
from queue import Empty, SimpleQueue
from threading import Thread
from typing import Any, Final, Self

import numpy as np

import sagline as sl
from sagline.cli import options as opt
from sagline.cli.terminal import show_note, show_text
from sagline.cli.values import quantity
from sagline.control.real_time import interrupt_calls
from sagline.core.arrays import Array
from sagline.core.errors import did_you_mean
from sagline.files.quantity import pose_of_text

EVERY: Final = 0.2  # time between two updates of the status line [s]
PROMPT: Final = "> "
FAILED: Final = 1  # exit code after a fault of the machine
LATE: Final = 0.02  # delay of cycles above which a note is printed at the end [s]
AXES: Final = ("x", "y", "z")
CONFIRM: Final = "--confirm"


class _StatusLine:
    """Fixed last line of a terminal, below the lines that scroll. It has no effect if stdout is not a terminal."""

    def __init__(self, *, shown: bool) -> None:
        """Enable the line if `shown` is True and stdout is a terminal."""
        self._shown = shown and sys.stdout is not None and sys.stdout.isatty()
        self._next, self._size = 0.0, (0, 0)

    def __enter__(self) -> Self:
        if self._shown:
            self._fit()
        return self

    def __exit__(self, *failure: object) -> None:
        if self._shown:
            _, rows = self._size
            self._say(f"\x1b7\x1b[r\x1b[{rows};1H\x1b[2K\x1b8")

    def update(self, text: str) -> None:
        """Show a text, shortened to one line, at most once per `EVERY` seconds."""
        if not self._shown or time.monotonic() < self._next:
            return
        self._next = time.monotonic() + EVERY
        if shutil.get_terminal_size() != self._size:
            self._fit()
        columns, rows = self._size
        shown = text if len(text) < columns else text[: columns - 2] + "…"
        self._say(f"\x1b7\x1b[{rows};1H\x1b[7m{shown.ljust(columns - 1)}\x1b[0m\x1b8")

    def ask(self) -> None:
        if self._shown:
            self._say(f"\r\x1b[K{PROMPT}")

    def clear(self) -> None:
        if self._shown:
            self._say("\r\x1b[K")

    def _fit(self) -> None:
        """Set the scrolling region to all lines except the last one."""
        self._size = shutil.get_terminal_size()
        self._say(f"\n\x1b7\x1b[1;{max(self._size[1] - 1, 1)}r\x1b8\x1b[A")

    def _say(self, text: str) -> None:
        sys.stdout.write(text)
        sys.stdout.flush()


# text of a line ("" at the end of the input) and its action; the action of an invalid line raises the error
_Line = tuple[str, Callable[[], object]]


class OperatorSession:
    """Session that reads lines, runs the cycles of the controller, and prints events."""

    def __init__(self, controller: sl.control.Controller, *, alone: bool, shadow: bool) -> None:
        """Prepare a session. If `alone`, a line waits until the previous line is done. If `shadow`, nothing is sent."""
        self.control = control = controller
        self._alone, self._shadow = alone, shadow
        self._event_count = 0
        self._ended = self._is_interrupted = False
        self._wait = 0  # number of cycles until the next line is read
        self._lines: SimpleQueue[_Line] = SimpleQueue()
        self._line = _StatusLine(shown=not alone)
        # for each command: its arguments, its help, the parser of its arguments, and its action
        self._words: dict[str, tuple[str, str, Callable[[str], Any], Callable[..., object]]] = {
            "home": (
                "[X,Y,Z[,A,B,C]] | --confirm",
                "set the lengths at this pose, by default the middle of the test box; or confirm the last pose",
                self._home_pose,
                lambda pose: control.confirm_homing() if pose is None else control.home(pose),
            ),
            "goto": ("X,Y,Z[,A,B,C]", "move straight to a pose [m, degrees]", partial(_pose, "goto"), self._go_to),
            "run": ("FILE", "follow a path, path.yaml", sl.load_path, control.start),
            "jog": (
                "WINCH|AXIS LENGTH",
                "jog 3 +5mm: winch 3 (the first is 0); jog z -10mm: the platform",
                self._jog,
                lambda action: action(),
            ),
            "pause": ("", "pause the path", _nothing, control.pause),
            "resume": ("", "resume the path", _nothing, control.resume),
            "stop": ("", "stop, and give up the path", _nothing, control.stop),
            "wait": ("SECONDS", "wait [s] before the next line", self._cycles, self._wait_for),
            "state": ("", "show pose, lengths and tensions", _nothing, self._show_state),
            "ack": ("", "acknowledge a fault", _nothing, control.acknowledge),
            "connect": ("", "take control of the machine", _nothing, control.connect),
            "off": ("", "release the machine", _nothing, control.off),
            "help": ("", "show this list", _nothing, self._show_help),
            "quit": ("", "release the machine, and end the session", _nothing, self._end),
        }

    def run(self) -> int:
        """Run until the end; returns the exit code."""
        try:
            with interrupt_calls(self._interrupt), self._line:
                self._begin()
                while not self._ended and not self._is_interrupted:
                    self._cycle()
                    if (line := self._next_line()) is not None:
                        self._carry_out(*line)
        finally:
            with interrupt_calls(lambda: None):
                self._disconnect()
        return FAILED if self.control.state is sl.control.State.EMERGENCY or self._failed else 0

    @property
    def _failed(self) -> bool:
        return self._alone and any(event.state is sl.control.State.FAULT for event in self.control.events)

    def _begin(self) -> None:
        if self._shadow:
            show_text("Read only: nothing is sent. Ctrl-C ends the session.")
            return
        self.control.connect()
        self._show_events()
        if not self._alone:
            show_text("help lists the commands; begin with home.")
        Thread(target=self._read, name="sagline lines", daemon=True).start()
        self._line.ask()

    def _read(self) -> None:
        """Read and parse lines in a separate thread."""
        for line in sys.stdin:
            for part in line.split(";"):
                self._lines.put(self._parse(part.strip()))
        self._lines.put(("", self._end))

    def _parse(self, text: str) -> _Line:
        """Parse a line. The action of an invalid line raises the error."""
        word, _, rest = text.partition(" ")
        if not word or word.startswith("#"):
            return "", lambda: None
        try:
            if word not in self._words:
                step = did_you_mean(word, self._words, "help lists them.")
                raise sl.InvalidValueError("the line", repr(text), "one that begins with a known word", step)
            _, _, parse, act = self._words[word]
            arguments = parse(rest.strip())
            return text, act if parse is _nothing else partial(act, arguments)
        except sl.SaglineError as error:
            return text, partial(_refuse, error)

    def _interrupt(self) -> None:
        self._is_interrupted = True
        self.control.stop()

    def _end(self) -> None:
        self._ended = True

    def _disconnect(self) -> None:
        control = self.control
        control.stop()
        while control.moving:
            control.cycle()
        if control.state not in (sl.control.State.OFF, sl.control.State.EMERGENCY):
            control.off()
        self._show_events()
        pace = control.pace
        if pace is not None and pace.lateness.longest > LATE:
            often = f"{1e3 * pace.lateness.quantile(0.999):.1f} ms in 999 of 1000"
            show_note("Note: ", f"cycles began up to {1e3 * pace.lateness.longest:.0f} ms late, at most {often}.")

    def _cycle(self) -> None:
        self.control.cycle()
        self._wait = max(self._wait - 1, 0)
        self._show_events()
        self._line.update(self._status)

    def _next_line(self) -> _Line | None:
        """The next line, or None. A line of a pipe is only returned when the platform is at rest."""
        if self._wait or (self._alone and self.control.moving):
            return None
        if self._alone and self.control.state in (sl.control.State.FAULT, sl.control.State.EMERGENCY):
            self._end()
            return None
        try:
            return self._lines.get_nowait()
        except Empty:
            return None

    def _carry_out(self, text: str, act: Callable[[], object]) -> None:
        """Carry out a line. An error in a line of an operator is printed. An error in a line of a pipe is raised."""
        if self._alone and text:
            show_text(f"{PROMPT}{text}", whole=True)
        try:
            act()
        except sl.SaglineError as error:
            if self._alone:
                raise
            show_note("Error: ", str(error), style="bold red")
        self._show_events()
        self._line.ask()

    def _go_to(self, pose: sl.Pose) -> None:
        self.control.start(self.control.path_to(pose))

    def _home_pose(self, text: str) -> sl.Pose | None:
        """The pose at which to home; None confirms the last pose."""
        if text == CONFIRM:
            return None
        return _pose("home", text) if text else opt.middle_pose(self.control.robot)

    def _jog(self, text: str) -> Callable[[], None]:
        which, _, far = text.partition(" ")
        by = quantity(far, "jog: LENGTH", "m")
        if which in AXES:
            return partial(self.control.start_jog_platform, [by * (axis == which) for axis in AXES])
        winch = opt.whole_of(which, "jog: WINCH", 0, self.control.robot.cable_count - 1)
        return partial(self.control.start_jog, winch, by)

    def _cycles(self, text: str) -> int:
        return round(quantity(text, "wait", "s", low=0.0) / self.control.period)

    def _wait_for(self, cycles: int) -> None:
        self._wait = cycles

    @property
    def _status(self) -> str:
        control, sample = self.control, self.control.sample
        parts = [control.state.name + " (degraded)" * control.degraded]
        if control.homed:
            x, y, z = control.estimate.position
            parts.append(f"({x:+.3f}, {y:+.3f}, {z:+.3f}) m")
        if sample is not None:
            parts.append(_tensions(sample.filtered))
        if control.clock is not None:
            done, whole = control.clock
            parts.append(f"{done:.1f} of {whole:.1f} s")
        return "  ".join(parts)

    def _show_events(self) -> None:
        events = self.control.events_from(self._event_count)
        self._event_count += len(events)
        for event in events:
            self._line.clear()
            show_text(_event_text(event))
        if events:
            self._line.ask()

    def _show_state(self) -> None:
        control, sample = self.control, self.control.sample
        show_text(self._status)
        if sample is None:
            return
        show_text(f"lengths [m]      {' '.join(f'{x:8.4f}' for x in sample.length + control.zero)}", whole=True)
        tensions = (f"{x:8.1f}" if np.isfinite(x) else "       –" for x in sample.filtered)
        show_text(f"tensions [N]     {' '.join(tensions)}", whole=True)
        show_text(f"owners           {' '.join('mine' if x == control.owner else str(x) for x in sample.owner)}")
        if control.pace is not None:
            often, most = control.pace.lateness.quantile(0.999), control.pace.lateness.longest
            show_text(f"cycles late      {1e3 * often:.1f} ms (999 of 1000), {1e3 * most:.1f} ms at most")

    def _show_help(self) -> None:
        usages = {f"{word} {arguments}".strip(): text for word, (arguments, text, _, _) in self._words.items()}
        wide = max(map(len, usages))
        for usage, text in usages.items():
            show_text(f"{usage.ljust(wide)}  {text}")


def _pose(item: str, text: str) -> sl.Pose:
    if not text:
        raise sl.InvalidValueError(item, "without a pose", "X,Y,Z or X,Y,Z,A,B,C", f"Enter {item} 0.2,-0.4,1.4.")
    return pose_of_text(text, item, f"Give meters, and degrees about z, y and x: {item} 0.2,-0.4,1.4.")


def _tensions(filtered: Array) -> str:
    """Text of the smallest and largest tension, and of the load cells without a reading; `filtered` (m,) [N]."""
    read = np.isfinite(filtered)
    lost = [f"no reading of cell {cell}" for cell in np.flatnonzero(~read)]
    known = [f"{filtered[read].min():.0f} to {filtered[read].max():.0f} N"] if read.any() else []
    return ", ".join((*known, *lost))


def _nothing(text: str) -> None:
    if text:
        raise sl.InvalidValueError("the line", f"followed by {text!r}", "that word alone", "Leave it out.")


def _refuse(error: sl.SaglineError) -> None:
    raise error


def _event_text(event: sl.control.Event) -> str:
    name = f"{event.name}: " if event.kind is not sl.control.EventKind.NOTE else ""
    return f"{event.time:9.2f} s  {name}{event.text}"
