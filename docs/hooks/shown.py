"""Content of the gallery and of the command's reference for each command: figure, interactive page, or output.

The values are lines of Markdown that the other hooks replace by figures, pages and texts.
"""

from __future__ import annotations

from typing import Final


def drawn(line: str) -> str:
    """Line for the figures of a command."""
    return f"<!-- drawn by: sagline {line} -->"


def told(*lines: str) -> str:
    """Line for the output of the last command."""
    return f"<!-- told by: {' && '.join(f'sagline {line}' for line in lines)} -->"


def shared(*lines: str) -> str:
    """Line for the page of the last command."""
    return f"<!-- shared by: {' && '.join(f'sagline {line}' for line in lines)} -->"


def driven(what: str) -> str:
    """Line for the output of `twin`, `control` or `log` during a run of a machine."""
    return f"<!-- told of a machine: {what} -->"


SHOWN: Final = {
    "track": drawn("track own_robot.yaml own_path.yaml --model empirical"),
    "lengths": told("track cogiro own_path.yaml --no-figures", "lengths output/cogiro-catenary.nc"),
    "encoder": told("track winches_robot.yaml own_path.yaml --no-figures", "encoder output/hall-winches-catenary.nc"),
    "run": drawn("run"),
    "article": drawn("article figures 6-9"),
    "identify": told("identify cable.csv"),
    "forward": told("forward cogiro lengths.csv"),
    "tension": drawn("tension article-mixed --pose 1,0.5,2.5"),
    "vibrate": drawn("vibrate cogiro --pose 0,0,2 --up-to 8 --axis z"),
    "simulate": drawn("simulate cogiro --break 3@0.5s --loss-time 0.001"),
    "workspace": drawn("workspace article-suspended"),
    "sweep": told("sweep own_sweep.yaml --workers 1"),
    "design": drawn("design cogiro design.yaml --evaluations 200"),
    "calibrate": told("calibrate winches_robot.yaml winches.csv"),
    "robots": told("robots"),
    "show": told("show falcon-7"),
    "examples": told("examples --out files"),
    "new": told("new shed.yaml"),
    "convert": told("convert robot.wcrfx"),
    "export-c": told("export-c cogiro"),
    "export-scl": told("export-scl article-prototype"),
    "view": "![A robot in the viewer]({images}viewer.png)\n\n![A run in the viewer]({images}viewer-run.png)",
    "share": shared("simulate cogiro --break 3@0.5s --no-figures --out break.nc", "share break.nc"),
    "twin": driven("twin"),
    "control": driven("control"),
    "experiment": drawn("experiment article --in-process"),
    "log": driven("log"),
    "cache": told("cache"),
}
