"""End of a command: its exit code, and one line on stderr for an error."""

from __future__ import annotations

import os
import re
import signal
import sys
import threading
from collections.abc import Callable
from contextlib import suppress
from types import FrameType
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from threading import ExceptHookArgs

OUTSIDE, BAD_INPUT, UNEXPECTED, INTERRUPTED, CUT_OFF = 1, 2, 70, 130, 141  # the shell reports 141 after SIGPIPE
SIGNALS = tuple(getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name))
REPORT = "the authors of sagline"
ALTERNATIVES = 165  # largest number of characters of the list of allowed words


def exit_code_of(command: Callable[[], object], *, debug: bool = False, last: bool = False) -> int:
    """Run a command, which returns its exit code or None for 0, and turn an error into one message and an exit code."""
    # The code is BAD_INPUT for an error of sagline or of the system, UNEXPECTED for a mistake in the program,
    # INTERRUPTED for Ctrl-C, even if Python lost the interrupt, 143 for SIGTERM, 129 for SIGHUP, and CUT_OFF if the
    # reader of the output has closed the pipe. `last`: the process ends after the command; Ctrl-C then has no effect.
    interrupts = _Interrupts()
    code = UNEXPECTED
    try:
        try:
            code = _finished(command)
        finally:
            interrupts.ignore()
    except BaseException as error:  # a signal can arrive in the line above
        interrupts.ignore()
        if not interrupts.received:
            code = _report(error, debug)
    if interrupts.received or code == INTERRUPTED:
        code = _interrupted(interrupts.received or signal.SIGINT)
    if not last:
        interrupts.restore()
    return code


def report_thread(failed: ExceptHookArgs) -> None:
    """Print one line about the error that ended a thread other than the main thread."""
    if failed.exc_value is not None:
        _report(failed.exc_value, debug=False)


def _finished(command: Callable[[], object]) -> int:
    code = command()
    if sys.stdout is not None:
        sys.stdout.flush()  # otherwise Python would report a write error only when it ends
    return code if isinstance(code, int) else 0


def _report(error: BaseException, debug: bool) -> int:
    _give_up_unwritable()
    # typer raises another error after a BrokenPipeError
    if isinstance(error, BrokenPipeError) or isinstance(error.__context__, BrokenPipeError):
        return CUT_OFF
    if isinstance(error, SystemExit):
        return error.code if isinstance(error.code, int) else 0 if error.code is None else UNEXPECTED
    if isinstance(error, KeyboardInterrupt):
        return INTERRUPTED
    if debug:
        import traceback

        traceback.print_exception(error)
    from sagline.cli.terminal import show_note
    from sagline.core.errors import LONGEST, shortened

    head, text, code = _message(error)
    (text,) = shortened((text,), LONGEST - len(head))
    show_note(head, text, style="bold red")
    for line in getattr(error, "__notes__", ()):
        show_note("", line)
    return code


def _message(error: BaseException) -> tuple[str, str, int]:
    """Heading, text and exit code of `error`."""
    from typer import Abort

    from sagline.core.errors import HEAD, SaglineError, shortened

    if isinstance(error, SaglineError):
        return HEAD, str(error), BAD_INPUT
    if isinstance(error, Abort):
        return HEAD, "the input ended before all questions were answered. Answer all, or give the options.", BAD_INPUT
    if hasattr(error, "format_message"):  # errors of the command line itself
        return HEAD, _usage(error), BAD_INPUT
    if isinstance(error, MemoryError):
        reason = f" ({error})" if str(error) else ""
        return HEAD, f"there is not enough memory{reason}. Take fewer poses or samples at a time.", BAD_INPUT
    if isinstance(error, OSError):
        if error.filename is None:
            from sagline.cli.terminal import unwritable

            return HEAD, str(unwritable(error)), BAD_INPUT
        what = error.filename
        step = "Check its name, its permissions and the space on the disk."
        return HEAD, f"{what}: {error.strerror or error}. {step}", BAD_INPUT
    what = f"{type(error).__name__}: {error}" if str(error) else type(error).__name__
    (what,) = shortened((what,), 120)
    text = f"{what}. This is a mistake in sagline: please report it to {REPORT}, with the command"
    return "Unexpected error: ", f"{text} and its files; the option --debug shows the traceback.", UNEXPECTED


def _usage(error: BaseException) -> str:
    text = str(error.format_message()).strip().replace(" Value error, ", " ", 1)  # type: ignore[attr-defined]
    if found := re.search(r"'([^']*)' is not one of (.*)", text):
        from sagline.core.errors import first_words, nearest

        near = nearest(found[1].replace("_", "-"), re.findall(r"'([^']*)'", found[2]))
        text = text[: found.start(2)] + first_words(found[2].rstrip("."), ALTERNATIVES) + "."
        text += f" Did you mean {near}?" if near else ""
    text = text if text.endswith((".", "?")) else f"{text}."
    context = getattr(error, "ctx", None)
    command = "sagline" if context is None else context.command_path
    return f"{text} See: {command} --help"


def _interrupted(number: int) -> int:
    _give_up_unwritable()
    # clears an interrupt that occurred inside another exec; otherwise Python would end itself by the signal
    exec("")
    with suppress(OSError, ValueError, AttributeError):  # plain text, because the output library may be partly loaded
        sys.stderr.write("Interrupted. All written files are complete.\n")
        sys.stderr.flush()
    return 128 + number


def _give_up_unwritable() -> None:
    """Discard the buffer of a stdout that cannot be written; otherwise Python would try again when it ends."""
    try:
        if sys.stdout is not None:
            sys.stdout.flush()
    except (OSError, ValueError):
        with suppress(OSError, ValueError):
            null = os.open(os.devnull, os.O_WRONLY)
            os.dup2(null, sys.stdout.fileno())
            os.close(null)


class _Interrupts:
    """Handler of Ctrl-C, SIGTERM and SIGHUP in the main thread. A signal that the process ignores stays ignored."""

    # SIGTERM and SIGHUP have the same effect as Ctrl-C. A controller, for instance, stops its robot before it ends.

    def __init__(self) -> None:
        self.received = 0  # number of the signal
        self._before: dict[int, Any] = {}
        self._hook = sys.unraisablehook
        if threading.current_thread() is threading.main_thread():
            for number in SIGNALS:
                before = signal.getsignal(number)
                if before is signal.default_int_handler or (before is signal.SIG_DFL and number != signal.SIGINT):
                    self._before[number] = before
                    signal.signal(number, self._receive)

    def _receive(self, number: int, frame: FrameType | None) -> None:
        self.received = self.received or number
        sys.unraisablehook = lambda _: None  # Python's messages about unfinished objects do not help the user
        pressed = signal.getsignal(signal.SIGINT)
        if number == signal.SIGINT or pressed == self._receive or not callable(pressed):
            pressed = signal.default_int_handler
        pressed(signal.SIGINT, frame)

    def ignore(self) -> None:
        for number in self._before:
            signal.signal(number, signal.SIG_IGN)

    def restore(self) -> None:
        sys.unraisablehook = self._hook
        for number, before in self._before.items():
            signal.signal(number, before)
