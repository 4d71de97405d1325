"""Numbers and words are complete at every width of the terminal: the same as in a file."""

from __future__ import annotations

import fcntl
import os
import pty
import re
import struct
import subprocess
import sys
import termios
from collections import Counter
from io import StringIO
from pathlib import Path

import numpy as np
import pytest
from rich.console import Console
from typer.testing import CliRunner

import sagline as sl
from sagline.cli import terminal
from sagline.cli.installation import examples
from sagline.cli.main import GROUPS, app
from sagline.cli.output import TextTable
from tests.abuse.command_lines import LINES
from tests.kinematics.winches import wound
from tests.tiers import extended, wide

WIDTHS = (60, 80, 120)
SHORT = "durations: 1\nrate: 4\nwaypoints: [{position: [0, 0, 1.5]}, {position: [1, 0, 1.5]}]\n"
# paths, or texts on stderr
WHOLE = r"In |Try: |Written: |Look at it: |Every value: |Advice: |[\w-]+: the path|The file contains|Empty workspace: "
COMMANDS = (
    ["forward", "cogiro", "lengths.csv"],
    ["show", "many.yaml"],
    ["track", "--help"],
    # commands of the second tier
    ["robots"],
    ["track", "cogiro", "short.yaml", "--no-figures"],
    ["track", "article-suspended", "far.yaml", "--no-figures"],
    ["run"],
    ["identify", "cable.csv"],
    ["forward", "wound.yaml", "counts.csv", "--counts"],
    ["tension", "cogiro", "--no-figures"],
    ["tension", "many.yaml", "--pose", "0,0,2", "--no-figures"],
    ["vibrate", "cogiro", "--up-to", "6", "--no-figures"],
    ["simulate", "cogiro", "--break", "3@0.1s", "--after", "0.2", "--no-figures"],
    ["workspace", "cogiro", "--cells", "6", "--no-figures"],
    ["workspace", "cogiro", "--wrench", "±9 kN, ±20 N m", "--max-sag", "5 cm", "--cells", "4"],
    ["show", "cogiro"],
    ["show", "expo2015-lucia"],
    ["new", "my_robot.yaml", "--force"],
    ["examples", "--force"],
    *([name, "--help"] for name in LINES if name != "track"),
    ["--help"],
)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    place = tmp_path_factory.mktemp("widths")
    examples(place, force=False)
    (place / "short.yaml").write_text(SHORT)
    (place / "far.yaml").write_text(SHORT.replace("[1, 0, 1.5]", "[7.2, 3, 1.5]"))
    robot = sl.load_robot("article-suspended")  # three robots in one: 24 cables, the largest number
    many = robot.replace(
        name="a robot of twenty-four cables and a name of many words",
        frame_anchors=np.concatenate([robot.frame_anchors + k * 0.1 for k in range(3)]),
        platform_anchors=np.tile(robot.platform_anchors, (3, 1)),
        cables=sl.Cable(*(np.tile(each, 3) for each in (robot.cables.linear_density, robot.cables.axial_stiffness))),
        tension_min=np.linspace(1.0, 2.0, 24),
        tension_max=np.tile(robot.tension_max, 3),
    )
    (place / "many.yaml").write_text(sl.dump_robot(many))
    (place / "wound.yaml").write_text(sl.dump_robot(wound()))
    counts = sl.encoder_counts(sl.inverse(wound(), sl.load_path(place / "short.yaml").pose))
    head = ",".join(f"C{k}" for k in range(8))
    np.savetxt(place / "counts.csv", counts, delimiter=",", header=head, comments="", fmt="%.0f")
    return place


@pytest.fixture(autouse=True)
def place(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(folder)
    monkeypatch.setattr("sagline.article_path", lambda: sl.load_path("short.yaml"))
    monkeypatch.setattr("sagline.cli.article.FIGURES", ())
    monkeypatch.setattr("sagline.cli.article.CELLS", 4)
    monkeypatch.setattr("sagline.cli.article._figures", lambda *_: ())
    monkeypatch.setattr("sagline.cli.track.perf_counter", iter(range(1000)).__next__)  # each run takes a second


def printed(words: list[str], width: int | None, monkeypatch: pytest.MonkeyPatch) -> str:
    """Output of a command on a terminal with a width, or in a pipe for None."""
    with monkeypatch.context() as patched:
        patched.setattr("sagline.cli.track.perf_counter", iter(range(1000)).__next__)
        if width is not None:
            patched.setattr(terminal, "_out", Console(force_terminal=True, width=width, markup=False, emoji=False))
            patched.setattr(terminal, "_err", Console(stderr=True, width=width, markup=False, emoji=False))
            patched.setenv("COLUMNS", str(width))
        else:
            patched.setenv("COLUMNS", "1000")
        result = CliRunner().invoke(app, words, input="\n" * 9)
    assert result.exit_code in (0, 1), result.output
    return re.sub(r"\x1b\[[0-9;]*m", "", result.output)


def words_of(text: str) -> Counter[str]:
    """All texts between spaces, except rules."""
    return Counter(word for word in text.split() if not set(word) <= set("─"))


@pytest.mark.parametrize("words", wide(COMMANDS, first=3), ids=" ".join)
def test_numbers_and_words_are_complete(words: list[str], monkeypatch: pytest.MonkeyPatch) -> None:
    wide = words_of(printed(words, None, monkeypatch))
    assert sum(wide.values()) > 10
    for width in WIDTHS:
        text = printed(words, width, monkeypatch)
        assert "…" not in text
        assert wide - words_of(text) == Counter(), f"lost at {width} columns"
        if "--help" not in words:
            lines = [line for line in text.splitlines() if not re.match(WHOLE, line)]
            assert max(map(len, lines), default=0) <= width, f"too wide for {width} columns"


@extended
def test_the_help_lists_every_command_once_in_a_group(monkeypatch: pytest.MonkeyPatch) -> None:
    text = printed(["--help"], 80, monkeypatch)
    places = [text.index(f"\n{title}:\n") for title in GROUPS]
    assert places == sorted(places)
    for title, names in GROUPS.items():
        section = text[text.index(f"\n{title}:\n") :].partition("\n\n")[0]
        assert re.findall(r"^  ([\w-]+) ", section, re.MULTILINE) == list(names)


def test_a_table_is_split_only_if_it_does_not_fit() -> None:
    rows = [[f"method {k}", *(f"{1234.5 + k + j:.1f}" for j in range(8))] for k in range(3)]
    grid = TextTable(["", *map(str, range(8))], rows, "Tensions")
    for width, pieces in ((200, 1), (82, 1), (60, 2), (40, 3), (30, 4)):
        text = StringIO()
        console = Console(file=text, width=width)
        tables = grid.pieces(console, width)
        assert len(tables) == pieces, width
        for table, least in tables:
            console.print(table, width=max(width, least), crop=False)
        assert Counter(text.getvalue().split()) >= Counter(cell for row in rows for cell in row[1:])
        assert text.getvalue().count("method 2") == pieces
        assert text.getvalue().count("Tensions") == 1


def on_terminal(width: int, *words: str) -> str:
    """Output of a command on a real terminal."""
    leader, follower = pty.openpty()
    fcntl.ioctl(follower, termios.TIOCSWINSZ, struct.pack("HHHH", 40, width, 0, 0))
    environment = {name: value for name, value in os.environ.items() if name not in ("COLUMNS", "NO_COLOR")}
    process = subprocess.Popen(
        [sys.executable, "-m", "sagline.cli", *words],
        stdout=follower,
        stderr=subprocess.DEVNULL,
        env={**environment, "TERM": "xterm"},
    )
    os.close(follower)
    text = b""
    try:
        while part := os.read(leader, 65536):
            text += part
    except OSError:  # the other end is closed
        pass
    os.close(leader)
    assert process.wait() == 0
    return re.sub(r"\x1b\[[0-9;?]*[a-zA-Z]", "", text.decode()).replace("\r", "")


@extended
def test_on_a_real_terminal_and_in_a_real_pipe() -> None:
    command = ("forward", "cogiro", "lengths.csv")
    piped = subprocess.run([sys.executable, "-m", "sagline.cli", *command], capture_output=True, text=True, check=True)
    assert "\x1b" not in piped.stdout
    narrow = on_terminal(60, *command)
    assert words_of(piped.stdout) - words_of(narrow) == Counter()
    assert max(len(line) for line in piped.stdout.splitlines()) > 120  # one table of any width
    assert max(len(line) for line in narrow.splitlines() if not line.startswith("In ")) <= 60


def test_json_has_numbers_as_numbers(monkeypatch: pytest.MonkeyPatch) -> None:
    import json

    for words in (["forward", "cogiro", "lengths.csv"], ["tension", "cogiro", "--no-figures"], ["show", "many.yaml"]):
        found = json.loads(printed([*words, "--json"], None, monkeypatch))

        def check(what: object) -> None:
            if isinstance(what, dict):
                list(map(check, what.values()))
            elif isinstance(what, list):
                list(map(check, what))
            elif isinstance(what, str):
                assert not re.fullmatch(r"[-+−]?[\d.]+(e[-+]?\d+)?|nan|inf", what.lower()), what

        check(found)
