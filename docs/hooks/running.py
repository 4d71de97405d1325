"""Where the pages' own programs run, and how."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

from mkdocs.exceptions import PluginError

ROOT = Path(__file__).parents[2]
EXAMPLES = ROOT / "examples"
WORK = ROOT / "build" / "pages"


def fresh_folder() -> None:
    """Empty the folder, and put the files of the examples there."""
    shutil.rmtree(WORK, ignore_errors=True)
    WORK.mkdir(parents=True)
    for file in EXAMPLES.iterdir():
        if file.is_file():
            shutil.copy(file, WORK)


def ran(*arguments: str) -> str:
    """What Python prints with these arguments; a failure stops the build."""
    environment = {**os.environ, "PYTHONPATH": str(ROOT / "src"), "NO_COLOR": "1"}
    command = [sys.executable, *arguments]
    done = subprocess.run(command, cwd=WORK, env=environment, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise PluginError(f"{' '.join(arguments)} failed:\n{done.stderr}")
    return done.stdout
