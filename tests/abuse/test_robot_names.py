"""Robots with names of all kinds: files only in the requested folder, or one line and no file."""

import json
import re
from pathlib import Path

import numpy as np
import pytest

import sagline as sl
from tests.abuse.commands import COMMANDS, MIXED, ROBOT, ended, prepare, tree
from tests.tiers import extended

pytestmark = extended

LONGEST = 300  # characters of a line
PIECES = ("..", "/", "\\", ".", "-", "~", "$HOME", "con", "NUL", "com1", "evil", "机", "ü", " ", ":", "*", "|", "%2e")
UNSEEN = ("\0", "\n", "\x1b[2J", "\x7f", "\x9b1A", "\u202e", "\ufeff", "\ud800", "\udfff", "\uffff", "\U000e0001")
COMMON = ("../../evil", "/etc/evil", "", ".", "..", "x" * 300, "ü" * 300, "con", "a\0b", "\ud800", "\x1b[31mred", "-rf")


def names(count: int) -> list[str]:
    """Common names, and names composed of special parts."""
    rng = np.random.default_rng(3)
    pieces = (*PIECES, *UNSEEN)
    others = ["".join(rng.choice(pieces, size=rng.integers(1, 9))) for _ in range(count)]
    return [*COMMON, *others]


@pytest.mark.parametrize("command", ["forward", "tension", "track"])
@pytest.mark.parametrize("count", [0, pytest.param(300, marks=pytest.mark.soak)])
def test_files_are_written_only_into_the_requested_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, command: str, count: int
) -> None:
    place = tmp_path / "deep" / "deeper"
    place.mkdir(parents=True)
    monkeypatch.chdir(place)
    prepare(place)
    kind = MIXED if command == "tension" else ROBOT
    robot = sl.dump_robot(sl.load_robot(kind))
    assert robot.startswith(f"name: {kind}\n")
    words = [word.replace(kind, "odd.yaml") for word in COMMANDS[command]]
    chosen = names(count) if count or command == "forward" else COMMON[:2]
    for name in chosen:
        # written as JSON, which is valid YAML: Python cannot create a robot with some of these names
        Path("odd.yaml").write_text(robot.replace(kind, json.dumps(name), 1), encoding="utf-8")
        before = tree(tmp_path)
        result = ended(*words, *["--no-figures"] * (command == "track"))
        new = tree(tmp_path).keys() - before.keys()
        assert {path: tree(tmp_path)[path] for path in before} == before, name
        if result.exit_code == 2:
            assert new == set(), name
            assert result.stderr.startswith("Error: "), result.output
            assert len(result.stderr) < LONGEST, result.output
        else:
            assert result.exit_code == 0, result.output
            assert new, name
        for path in new:
            assert re.fullmatch(r"deep/deeper/out/[^\W_][^/\\:*?\"<>|~$%\s]+", path), name
            assert path.isprintable(), name
            assert len(path) < 200, name
            Path(tmp_path / path).unlink()
