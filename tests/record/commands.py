"""Exit code, `--json` output and files of the commands on the examples."""

from __future__ import annotations

import contextlib
import json
import os
import tempfile
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Final
from unittest.mock import patch

from typer.testing import CliRunner

import sagline as sl
from sagline.cli.main import app
from tests.files.executions import execution
from tests.record.values import folder_values, plain

RUN: Final = "track cogiro own_path.yaml --no-figures --json --out run"
# In this order in one folder: a later command may read what an earlier one wrote.
COMMANDS: Final = (
    "examples --out .",
    "robots --json",
    *(f"show {name} --json" for name in sl.robot_names()),
    RUN,
    *(
        f"track cogiro own_path.yaml --no-figures --json --model {model}"
        for model in ("elastic", "straight", "parabolic", "empirical")
    ),
    *(
        f"track article-mixed own_path.yaml --no-figures --json --tension {tension}"
        for tension in (
            "minimum-norm",
            "puncture",
            "centroid",
            "analytic-center",
            "p-norm",
            "lowest-sum",
            "lowest-maximum",
        )
    ),
    "track own_robot.yaml own_samples.csv --no-figures --json --payload 5kg",
    "lengths run/cogiro-catenary.nc --out lengths_out.csv",
    "forward cogiro lengths.csv --json --out poses.csv",
    "forward cogiro lengths.csv --json --model elastic",
    "tension cogiro --pose 0,0,2 --json --no-figures",
    "tension falcon-7 --pose 0,0,0.5 --json --no-figures",
    "vibrate cogiro --pose 0,0,2 --json --no-figures",
    "vibrate article-mixed --pose 0,0,2 --up-to 5 --json --no-figures",
    "simulate cogiro --break 3@0.5s --json --no-figures --out simulation.nc",
    "workspace cogiro --cells 8 --json --no-figures --out space.nc",
    "workspace article-suspended --cells 8 --max-sag 0.1 --json --no-figures --out space_sag.nc",
    "sweep own_sweep.yaml --json --workers 1",
    "design own_robot.yaml design.yaml --evaluations 28 --no-figures --json --out front",
    "identify cable.csv --json",
    "calibrate winches_robot.yaml winches.csv --json --out found.nc",
    "convert robot.wcrfx --out converted.yaml",
    "convert cogiro --format mjcf --out cogiro.xml",
    "export-c cogiro --out c.c",
    "export-scl article-prototype --out prototype.scl",
    "export-fmu cogiro --out cogiro.fmu",
    "export-linuxcnc cogiro --out kins.c",
    "track winches_robot.yaml own_path.yaml --no-figures --json --out wound",
    "encoder wound/hall-winches-catenary.nc --out counts.csv",
    "run --json --out the_run",
    "article errata sag constants table 2 --json --out the_article",
    "log run.mcap --json",
    "share cogiro --out page.html",
    "new mine.yaml --frame 4x3x2m --mass 10kg",
)
# Commands whose files have the same form as those of a command before them: their names are enough.
VARIANTS: Final = (
    "examples",
    "run",
    "article ",
    "track cogiro own_path.yaml --no-figures --json --model",
    "track article-mixed",
)


def _undated(value: Any, day: str) -> Any:
    """The same data with the date of the run replaced by the word "today"."""
    if isinstance(value, dict):
        return {key: _undated(each, day) for key, each in value.items()}
    if isinstance(value, list):
        return [_undated(each, day) for each in value]
    return "today" if value == day else value


def record() -> dict[str, Any]:
    """Make a dictionary: each command with its exit code, its JSON, and the files that it made or changed."""
    found: dict[str, Any] = {}
    day = datetime.now(UTC).date().isoformat()
    before: dict[str, Any] = {}
    runner = CliRunner()
    with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder), patch.dict(os.environ, COLUMNS="80"):
        execution().save("run.mcap")
        for command in COMMANDS:
            result = runner.invoke(app, command.split(), input="\n" * 12)
            entry: dict[str, Any] = {"exit_code": result.exit_code}
            if "--json" in command:
                entry["json"] = plain(json.loads(result.stdout)) if result.stdout else None
            after = folder_values(Path())
            written = {name: values for name, values in after.items() if before.get(name) != values}
            entry["files"] = list(written) if command.startswith(VARIANTS) else written
            before = after
            found[command] = _undated(entry, day)
    return found
