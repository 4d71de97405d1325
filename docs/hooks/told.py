"""What commands tell on a terminal: made with the pages, so that it is what they tell today.

The line `<!-- told by: sagline a && sagline b -->` becomes the commands and what the last of them tells, in a folder
with the files of the examples; `<!-- told of a machine: twin -->` what `sagline twin`, or `control` or `log`, tells
while a machine is driven.
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
MOST: Final = 24  # lines that are shown
ROBOT: Final = "article-prototype"
PLCS: Final = "127.0.0.1:11021,127.0.0.1:11022,127.0.0.1:11023,127.0.0.1:11024"
TWIN: Final = ("twin", ROBOT, "--port", "0")
CONTROL: Final = ("control", ROBOT, "--log", "driven.mcap")
INTERRUPTED: Final = 130  # exit code
# the machine in the same process and nobody waits for a clock: sites are built on busy computers too
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
    """Forget what was told in the last build."""
    _told.clear()
    _machine.clear()


def on_page_markdown(markdown: str, **_: Any) -> str:
    """Put the texts in the place of the lines that ask for them."""
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
    """What a twin says when it begins; a controller that is told by a pipe what to do; and its log."""
    driven = ran("-c", IN_PROCESS.format(words=[*CONTROL, "--plc", PLCS]), answers=DRIVEN)
    return {
        "twin": _terminal([f"sagline {' '.join(TWIN)}"], _first_words(TWIN)),
        "control": _terminal([f"sagline {' '.join(CONTROL)} \\\n    --plc {PLCS}"], driven),
        "log": _terminal(["sagline log driven.mcap"], ran("-m", "sagline.cli", "log", "driven.mcap")),
    }


def _first_words(words: Sequence[str]) -> str:
    """What a command says until it has told its addresses; then it is interrupted."""
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
    """Commands and what the last of them tells, cut where nobody would read on."""
    lines = [line.rstrip() for line in text.replace(str(WORK), "~").strip("\n").splitlines()]
    if len(lines) > MOST:
        lines = [*lines[:MOST], f"… and {len(lines) - MOST:,} lines more"]
    head = "\n".join(f"$ {command}" for command in commands)
    return "```text\n" + "\n".join((head, *lines)) + "\n```"
