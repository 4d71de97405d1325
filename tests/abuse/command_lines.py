"""Bad command lines: each argument and option of each command with each kind of bad value, in random order."""

from __future__ import annotations

import random
from typing import Any, NamedTuple

import typer.main

from sagline.cli.main import app

# a short valid line of each command; `sagline examples` writes the files
LINES = {
    "track": ["track", "cogiro", "short.yaml", "--no-figures"],
    "lengths": ["lengths", "run.nc"],
    "encoder": ["encoder", "wound.nc"],
    "run": ["run"],
    "article": ["article", "figure", "3"],
    "identify": ["identify", "cable.csv"],
    "forward": ["forward", "cogiro", "lengths.csv"],
    "tension": ["tension", "cogiro", "--no-figures"],
    "vibrate": ["vibrate", "cogiro", "--up-to", "4", "--no-figures"],
    "simulate": ["simulate", "cogiro", "--after", "0.1", "--no-figures"],
    "workspace": ["workspace", "cogiro", "--cells", "4", "--no-figures"],
    "sweep": ["sweep", "own_sweep.yaml", "--workers", "1"],
    "calibrate": ["calibrate", "winches_robot.yaml", "winches.csv", "--folds", "0"],
    "robots": ["robots"],
    "show": ["show", "cogiro"],
    "examples": ["examples"],
    "new": ["new", "my_robot.yaml"],
    "convert": ["convert", "robot.wcrfx"],
    "export-c": ["export-c", "cogiro"],
    "experiment": ["experiment", "article", "--in-process"],
    "export-scl": ["export-scl", "article-prototype"],
    "export-fmu": ["export-fmu", "cogiro"],
    "export-linuxcnc": ["export-linuxcnc", "cogiro"],
    "twin": ["twin", "article-prototype", "--port", "0"],
    # a port without a server
    "control": ["control", "article-prototype", "--plc", "127.0.0.1:1,127.0.0.1:2,127.0.0.1:3,127.0.0.1:4"],
    "log": ["log", "run.mcap"],
    "cache": ["cache"],
    "design": ["design", "own_robot.yaml", "design.yaml", "--evaluations", "40", "--no-figures"],
    "view": ["view", "cogiro", "--no-browser"],
    "share": ["share", "cogiro"],
}

DRAWING = ("track", "tension", "vibrate", "simulate", "workspace", "design")  # commands that draw figures
WITH = {  # lines of options that require or exclude other options
    "workspace --scene": [*LINES["workspace"], "--clearance", "3 cm"],
    "workspace --budget": [*LINES["workspace"], "--prove", "0..1, 0..1, 1..2 m"],
    "view --truth": [*LINES["view"], "run.mcap"],
    "view --beside": [*LINES["view"], "run.nc"],
    "calibrate --seed": ["calibrate", "winches_robot.yaml", "--plan", "8"],
    "calibrate --plan": ["calibrate", "winches_robot.yaml"],
    "calibrate --style": [*LINES["calibrate"], "--plot", "fit.png"],
    "convert --at": [*LINES["convert"], "--kind", "mjcf"],
    "convert --linear-density": [*LINES["convert"], "--axial-stiffness", "50 kN"],
    "convert --axial-stiffness": [*LINES["convert"], "--linear-density", "20 g/m"],
    "simulate --shaper": ["simulate", "cogiro", "short.yaml", "--after", "0.1", "--no-figures"],
    "sweep --scheduler": ["sweep", "own_sweep.yaml"],
    "vibrate --axis": ["vibrate", "cogiro", "--up-to", "4"],
    "robots --out": [*LINES["robots"], "--csv"],
    "identify --out": [*LINES["identify"], "--csv"],
    **{f"{name} {option}": LINES[name][:-1] for name in DRAWING for option in ("--style", "--format")},
}


def line_of(name: str, option: str) -> list[str]:
    """A command line to which an option can be added."""
    return list(WITH.get(f"{name} {option}", LINES[name]))


VALUES = (
    # empty or very long text
    "", " ", "\t", "\n", "x" * 300, "x" * 5000, "1" * 400, "é" * 200,
    # invalid numbers, numbers out of range, and numbers of another type
    "nan", "-nan", "inf", "-inf", "1e308", "-1e308", "1e999", "1e-400", "0x10", "010", "1_000", "1:30", "1,5", "1.5.2",
    "٣", "１", "½", "-1", "0", "-0", "1", "7", "True", "None", "+", "-", ".", "..", "e", "--",
    # lists
    "1,2", "1,2,3,4", "1,2,3,4,5,6,7", "1;2;3", "1 2 3", "nan,nan,nan", "1e308,0,0", "0,0,1e308", "1,2,", ",,",
    "[1,2,3]", "0,0,2,1e308,0,0", "0,0,2,400,0,0", "1_0,0,0",
    # units
    "1 kg", "1 m", "12 kg/m*", "5 parsec", "1 kg kg kg", "-3 mm", "1e400 kg", "m", "3 m/", "1 " + "m*" * 500 + "m",
    "6 x 4 x 3 m", "6 x 4", "0 x 0 x 0", "nan x nan x nan", "1e308 x 1e308 x 1e308 m", "axbxc", "×××",
    # paths
    "missing.yaml", "missing.csv", "missing.nc", "own_robot.yaml", "cable.csv", "lengths.csv", "run.nc", "folder",
    "folder/", "folder.yaml", "own_robot.yaml/x", "../../evil", "/proc/nothere/x", "/", "~", "x/" * 200, "broken.nc",
    "pipe.yaml", "/dev/null", "/dev/zero", "/dev/full", "broken.yaml", "empty.csv", "link.yaml", "*", "con", "-x",
    # special characters of terminals, shells, formats and encodings
    "\x1b[31mred", "a\x1b]0;title\x07", "\x9b2J", "\u202eevil", "\udcff", "a\rb", "%s%n", "{}", "$(x)",
    "`x`", "[red]", ":smile:",
    # words
    "catenery", "Catenary", "closest ", "nothere", "cogiro", "COGIRO", "mixed", "steel", "robot", "3-1", "0-99",
    "errata",
)  # fmt: skip


class Case(NamedTuple):
    """One bad command line."""

    name: str
    words: list[str]


def cases(seed: int, count: int | None) -> list[Case]:
    """A number of bad command lines in random order, or all of them if the number is None."""
    every = [*_options(), *_arguments(), *_others()]
    random.Random(seed).shuffle(every)
    return every[:count]


def commands() -> dict[str, Any]:
    """All commands by name."""
    whole: Any = typer.main.get_command(app)
    return dict(whole.commands)


def _options() -> list[Case]:
    found = []
    for name, command in commands().items():
        for parameter in command.params:
            option = parameter.opts[0]
            if not option.startswith("--") or option == "--help":
                continue
            for value in VALUES:
                if parameter.is_flag:
                    words = [*line_of(name, option), f"{option}={value}"]
                else:
                    words = [*line_of(name, option), option, *[value] * parameter.nargs]
                found.append(Case(f"{name} {option}", words))
            if not parameter.is_flag:
                found.append(Case(f"{name} {option}", [*line_of(name, option), option]))
    return found


def _arguments() -> list[Case]:
    found = []
    for name, line in LINES.items():
        for k in range(1, len(line)):
            if not line[k].startswith("-"):
                found += [Case(f"{name} [{k}]", [*line[:k], value, *line[k + 1 :]]) for value in VALUES]
        found += [
            Case(f"{name} extra", [*line[:1], *line[1:], "a", "b", "c"]),
            Case(f"{name} alone", [name, "--nothing"]),
        ]
    return found


def _others() -> list[Case]:
    return [Case("command", [value]) for value in VALUES]
