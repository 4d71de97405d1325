"""Signals at random moments: exit code 130, 143 or 129 after Ctrl-C, SIGTERM or SIGHUP, one line, no partial file.

The moments cover all phases of a command: loading, solving, drawing, writing and ending.
"""

from __future__ import annotations

import random
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from functools import cache
from pathlib import Path

import pytest

from sagline.cli.installation import examples
from tests.cli.interrupts import heard
from tests.tiers import extended

pytestmark = extended

Whole = Callable[[tuple[str, ...]], tuple[float, set[str]]]
SHARE, ALL = 2, 200  # number of moments of all commands
TRACK = ("track", "cogiro", "own_path.yaml", "--csv", "--out", "out")
COMMANDS: tuple[tuple[str, ...], ...] = (  # test_killed_commands.py tests the last three in each run
    ("forward", "cogiro", "lengths.csv", "--out", "out"),
    (
        "new",
        "my_robot.yaml",
        "--frame",
        "6 x 4 x 3 m",
        "--layout",
        "top",
        "--cables",
        "8",
        "--mass",
        "30 kg",
        "--platform",
        "0.5 x 0.5 x 0.4 m",
        "--rope",
        "dyneema-sk78",
        "--diameter",
        "4 mm",
    ),
    ("tension", "cogiro", "--out", "out"),
    ("article", "figures", "6-7", "--out", "out"),
    ("convert", "cogiro", "--format", "mjcf", "--out", "out.xml"),
    TRACK,
)
INTERRUPTED = "Interrupted. All written files are complete.\n"

# a thread of the process itself sends Ctrl-C, so that the delay begins with the command
HEARD = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
TIMED = """
import faulthandler, os, signal, sys, threading, time
from sagline.cli.__main__ import app_entry

faulthandler.enable() # a crash leaves its traceback in the assertion

def strike(seconds=float(sys.argv.pop(1)), number=int(sys.argv.pop(1))):
    time.sleep(seconds)
    os.kill(os.getpid(), number)

threading.Thread(target=strike, daemon=True).start()
app_entry()
"""


HELD = TIMED.replace("    os.kill", "    while True:\n        time.sleep(0.005)\n        os.kill")


def started(
    place: Path, moment: float, number: int, words: tuple[str, ...], code: str = TIMED
) -> subprocess.Popen[str]:
    return subprocess.Popen(
        [sys.executable, "-c", code, f"{moment:.4f}", str(number), *words],
        cwd=place,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        preexec_fn=heard,
    )


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Whole:
    """Duration of a command without a signal [s], and the files that it writes."""

    @cache
    def found(words: tuple[str, ...]) -> tuple[float, set[str]]:
        place = tmp_path_factory.mktemp("whole")
        examples(place, force=False)
        before, start = files(place), time.monotonic()
        process = started(place, 600.0, signal.SIGINT, words)
        _, errors = process.communicate(timeout=300)
        assert process.returncode == 0, errors
        seconds, made = time.monotonic() - start, files(place) - before
        assert made
        return seconds, made

    return found


def files(place: Path) -> set[str]:
    return {str(path.relative_to(place)) for path in place.rglob("*") if path.is_file()}


def check(
    words: tuple[str, ...], seconds: float, made: set[str], place: Path, draw: random.Random, number: int
) -> None:
    examples(place, force=False)
    before = files(place)
    moment = seconds * draw.random()
    process = started(place, moment, number, words)
    printed, errors = process.communicate(timeout=300)
    what = f"{' '.join(words)} after {moment:.3f} s: {process.returncode}, {errors!r}"
    left = files(place) - before
    if process.returncode == 0:  # the command was finished: all files exist, and all lines are printed
        assert left == made, what
        assert printed or "new" not in words, what
        return
    if number == signal.SIGKILL:
        assert process.returncode == -signal.SIGKILL, what
        rest = subprocess.run([sys.executable, "-m", "sagline.cli", *words], cwd=place, capture_output=True, text=True)
        assert rest.returncode == 0 or "exists" in rest.stderr, rest.stderr  # no remains block the next run
        left = files(place) - before
        assert left == made, f"{what}: {left ^ made}"
    else:
        assert process.returncode == 128 + number, what
        assert not any(place.rglob(".sagline*")), what
        assert errors.endswith(INTERRUPTED), what
        told = errors.splitlines()
        assert told[-1] == INTERRUPTED.strip(), what
        assert len(told) == 1 or (left == made and "Traceback" not in errors), what  # printed after all files
        assert left <= made, f"{what}: {left - made}"
        if any(name.endswith("article.json") for name in left):
            assert any(name.endswith("article.html") for name in left), what


def each(count: int, seed: int, number: int, whole: Whole, top: Path) -> None:
    draw = random.Random(seed)
    for k in range(count):
        words = COMMANDS[k % len(COMMANDS)]
        place = top / str(k)
        place.mkdir()
        check(words, *whole(words), place, draw, number)


@pytest.mark.parametrize("number", HEARD)
def test_signals_at_any_moment(number: int, whole: Whole, tmp_path: Path) -> None:
    each(SHARE, 12 + number, number, whole, tmp_path)


@pytest.mark.soak
@pytest.mark.parametrize("number", [*HEARD, signal.SIGKILL])
def test_ctrl_c_and_kill_at_many_moments(number: int, whole: Whole, tmp_path: Path) -> None:
    each(ALL, 13, number, whole, tmp_path)


@pytest.mark.soak
def test_ctrl_c_in_track_never_crashes(whole: Whole, tmp_path: Path) -> None:
    """500 random moments; a segmentation fault once killed a process in `track` after Ctrl-C."""
    seconds, made = whole(TRACK)
    draw = random.Random(500)
    for k in range(500):
        place = tmp_path / str(k)
        place.mkdir()
        check(TRACK, seconds, made, place, draw, signal.SIGINT)
        shutil.rmtree(place)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGHUP])
def test_a_signal_that_the_shell_ignores_is_ignored(number: int) -> None:
    """The state of a command in the background, or of a command started with nohup."""
    code = TIMED.replace("threading.Thread", f"signal.signal({int(number)}, signal.SIG_IGN); threading.Thread", 1)
    words = [sys.executable, "-c", code, "0.3", str(int(number)), "robots"]
    done = subprocess.run(words, capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (0, "")


def test_many_signals_at_once_end_the_command_at_once(tmp_path: Path) -> None:
    """Ctrl-C held down: many signals, one line."""
    examples(tmp_path, force=False)
    process = started(tmp_path, 0.3, signal.SIGINT, TRACK, HELD)
    _, errors = process.communicate(timeout=120)
    assert process.returncode == 130, errors
    assert errors == INTERRUPTED
