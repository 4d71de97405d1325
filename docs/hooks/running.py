"""Execution of the programs of the pages."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

from mkdocs.exceptions import PluginError

ROOT = Path(__file__).parents[2]
EXAMPLES = ROOT / "examples"
WORK = ROOT / "build" / "pages"


def fresh_folder() -> None:
    """Empty the folder, and copy the files of the examples there."""
    shutil.rmtree(WORK, ignore_errors=True)
    WORK.mkdir(parents=True)
    for file in EXAMPLES.iterdir():
        if file.is_file():
            shutil.copy(file, WORK)


def environment() -> dict[str, str]:
    """Environment of the programs: they import this tree, and write no colors."""
    return {**os.environ, "PYTHONPATH": str(ROOT / "src"), "NO_COLOR": "1"}


def command_of(arguments: Sequence[str]) -> list[str]:
    """Python with these arguments."""
    return [sys.executable, *arguments]


def ran(*arguments: str, answers: str | None = None) -> str:
    """Output of Python with these arguments and this standard input; a failure stops the build."""
    done = subprocess.run(
        command_of(arguments), cwd=WORK, env=environment(), input=answers, capture_output=True, text=True, check=False
    )
    if done.returncode != 0:
        raise PluginError(f"{' '.join(arguments)} failed:\n{done.stderr}")
    return done.stdout
