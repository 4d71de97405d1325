"""An argument or option that names a missing item ends the command; no name is ignored silently."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path

from tests.abuse.command_lines import LINES, Case, commands, line_of
from tests.abuse.test_command_lines import Bench, shortened_commands, stocked
from tests.tiers import extended

__all__ = ["shortened_commands", "stocked"]  # fixtures

pytestmark = extended

MISSING = ("nothere", "nothere.stl", "nothere.yaml", "nothere/nothere.nc", "folder", "folder.yaml", "/dev/null")
WRITTEN = frozenset({"--out", "--plot", "--log", "--to"})  # name the output
ANY = frozenset({"new file", "view --host", "view --allow-host", "twin --host"})  # new names, and names of machines
NUMBERED = (  # counts: one more than the robot has
    "simulate cogiro --after 0.1 --no-figures --break 8@0.05s",
    "vibrate cogiro --up-to 4 --no-figures --film 999",
    "view cogiro --no-browser --mode 999",
    "article figure 99",
    "log run.mcap --plan 9",
    "calibrate winches_robot.yaml winches.csv --folds 9999",
    "convert robot.wcrfx --cable-set nothere",
    "calibrate winches_robot.yaml winches.csv --folds 0 --unknowns length_zero,nothere",
)
FAULTS = ("cell 99 sticks at 1 s", "cell 8 sticks at 1 s", "group 99 is silent at 1 s", "cell 0 nothing at 1 s")


def cases() -> Iterator[Case]:
    for name, command in commands().items():
        places = [parameter for parameter in command.params if not parameter.opts[0].startswith("--")]
        for parameter in command.params:
            option = parameter.opts[0]
            place = f"{name} {option}"
            if getattr(parameter, "is_flag", False) or option in WRITTEN or place in ANY or option == "--help":
                continue
            for value in MISSING:
                if option.startswith("--"):
                    words = [*line_of(name, option), option, *[value] * parameter.nargs]
                else:
                    words, k = list(LINES[name]), places.index(parameter) + 1
                    words[k : k + 1] = [value]
                yield Case(place, words)
    for line in NUMBERED:
        yield Case(line, line.split())
    for fault in FAULTS:
        yield Case(fault, [*LINES["twin"], "--fault", fault])


def test_names_of_missing_items_are_refused(stocked: Path, tmp_path: Path) -> None:
    bench, here = Bench(stocked, tmp_path), Path.cwd()
    every = list(cases())
    try:
        found = [f"{case.name} {case.words}: {fault}" for case in every for fault in bench.faults(case, (2,))]
    finally:
        os.chdir(here)
    assert found == []
    assert len(every) > 500
