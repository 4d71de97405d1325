"""Output of commands on a terminal, generated with the pages, so that it is up to date.

The line `<!-- told by: sagline a && sagline b -->` becomes the commands and the output of the last one, in a folder
with the files of the examples; `<!-- told of a machine: twin -->` the output of `sagline twin`, or `control` or `log`,
during a run of a machine.
"""

from __future__ import annotations

import re
import shlex
import signal
import subprocess
from collections.abc import Sequence
from typing import Any, Final

from mkdocs.exceptions import PluginError
from running import WORK, command_of, environment, ran

MARK = re.compile(r"^<!-- told by: (sagline .+?) -->$", re.MULTILINE)
MACHINE = re.compile(r"^<!-- told of a machine: (twin|control|log) -->$", re.MULTILINE)
MOST: Final = 24  # largest number of printed lines
ROBOT: Final = "article-prototype"
PLCS: Final = "127.0.0.1:11021,127.0.0.1:11022,127.0.0.1:11023,127.0.0.1:11024"
TWIN: Final = ("twin", ROBOT, "--port", "0")
CONTROL: Final = ("control", ROBOT, "--log", "driven.mcap")
INTERRUPTED: Final = 130  # exit code
# the machine runs in the same process without a real-time clock, because the build computer may be busy
IN_PROCESS: Final = """\
import sagline as sl
from sagline.cli import control, main
from sagline.control import real_time
control._link = lambda robot, plc, modbus: sl.twin.Machine(robot, seed=1).link()
real_time.Pace = lambda: None
main.app({words!r})
"""
DRIVEN: Final = "home 0,0,1.5\ngoto 0.1,-0.2,1.4\njog 3 +5mm\noff\n"
_told: dict[str, str] = {}
_machine: dict[str, str] = {}


def on_pre_build(**_: Any) -> None:
    """Delete the texts of the last build."""
    _told.clear()
    _machine.clear()


def on_page_markdown(markdown: str, **_: Any) -> str:
    """Replace the marked lines of a page by the texts."""
    markdown = MARK.sub(lambda found: _shown(found[1]), markdown)
    return MACHINE.sub(lambda found: _of_machine(found[1]), markdown)


def _shown(commands: str) -> str:
    if commands not in _told:
        lines = commands.split(" && ")
        for line in lines:
            text = ran("-m", "sagline.cli", *shlex.split(line)[1:], answers="\n" * 9)
        _told[commands] = _terminal(lines, text)
    return _told[commands]


def _of_machine(what: str) -> str:
    if not _machine:
        _machine.update(_drive())
    return _machine[what]


def _drive() -> dict[str, str]:
    """Output of a starting twin, of a controller with piped commands, and of its log."""
    driven = ran("-c", IN_PROCESS.format(words=[*CONTROL, "--plc", PLCS]), answers=DRIVEN)
    return {
        "twin": _terminal([f"sagline {' '.join(TWIN)}"], _first_words(TWIN)),
        "control": _terminal([f"sagline {' '.join(CONTROL)} \\\n    --plc {PLCS}"], driven),
        "log": _terminal(["sagline log driven.mcap"], ran("-m", "sagline.cli", "log", "driven.mcap")),
    }


def _first_words(words: Sequence[str]) -> str:
    """Output of a command up to its addresses; then it is interrupted."""
    command = command_of(["-m", "sagline.cli", *words])
    with subprocess.Popen(command, cwd=WORK, env=environment(), stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        found = []
        for line in process.stdout:
            found.append(line)
            if "--plc" in line:
                process.send_signal(signal.SIGINT)
    if process.returncode != INTERRUPTED:
        raise PluginError(f"sagline {' '.join(words)} ended with {process.returncode}")
    return "".join(found)


def _terminal(commands: list[str], text: str) -> str:
    """Commands and the output of the last one, cut after `MOST` lines."""
    lines = [line.rstrip() for line in text.replace(str(WORK), "~").strip("\n").splitlines()]
    if len(lines) > MOST:
        lines = [*lines[:MOST], f"… and {len(lines) - MOST:,}more lines"]
    head = "\n".join(f"$ {command}" for command in commands)
    return "```text\n" + "\n".join((head, *lines)) + "\n```"
