"""The operator's commands: lines from a pipe to a machine in the same process, without real time."""

import io
import re
import sys
from typing import Any

import pytest

import sagline as sl
from sagline.cli.session import OperatorSession, _StatusLine
from sagline.control.states import State
from tests.control.rigs import rig
from tests.tiers import wide


def session(monkeypatch: pytest.MonkeyPatch, lines: str) -> tuple[OperatorSession, Any]:
    control, machine = rig(home=False)
    monkeypatch.setattr(sys, "stdin", io.StringIO(lines))
    return OperatorSession(control, alone=True, shadow=False), machine


def test_lines_from_a_pipe_are_executed_in_order(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    place, machine = session(monkeypatch, "home 0,0,1.5; goto 0.05,0,1.5\n# a word\n\njog 3 +2mm\njog z -5 mm\nstate\n")
    assert place.run() == 0
    out = capsys.readouterr().out
    steps = ["READY:", "> home", "IDLE:", "> goto", "IDLE:", "> jog 3 +2mm", "JOGGING: winch 3", "> jog z", "JOGGING:",
             "> state", "OFF:"]  # fmt: skip
    assert re.search(".*".join(map(re.escape, steps)), out, re.DOTALL)
    assert place.control.state is State.OFF
    assert abs(machine.reading.position - [0.05, 0.0, 1.495]).max() < 3e-3


def test_an_operator_confirms_a_pose_that_contradicts_the_lengths(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    control, _ = rig(home=False)
    monkeypatch.setattr(sys, "stdin", io.StringIO("home --confirm\nhome 0.1,0,1.5\nhome --confirm\nquit\n"))
    assert OperatorSession(control, alone=False, shadow=False).run() == 0
    said = capsys.readouterr()
    changed = re.search(r"IDLE: .*confirmed.* by up to (\S+) mm", said.out)
    assert changed is not None
    assert float(changed[1]) == pytest.approx(49.4, abs=0.1)
    assert re.findall(r"Error: (\w+) is", said.err) == ["confirming", "homing"]


def test_a_cell_without_a_reading_is_named_in_place_of_a_number(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    place, machine = session(monkeypatch, "home\nwait 1 s\nstate\n")
    machine.inject("cell 5 fails at 1 s")
    assert place.run() == 0
    out = capsys.readouterr().out
    line = next(line for line in out.splitlines() if "(degraded)" in line)
    assert line.endswith("cell 5")
    table = next(line for line in out.splitlines() if line.startswith("tensions"))
    assert [word == "–" for word in table.split()[2:]] == [cell == 5 for cell in range(8)]
    assert "nan" not in out


@pytest.mark.parametrize(
    "line",
    wide(
        [
            "gotto 0,0,1",
            "goto 1,2",
            "goto",
            "jog 8 +5mm",
            "jog 3 5 kg",
            "run nowhere.yaml",
            "stop now",
            "resume",
            "ack",
            "goto 0,0,9",
        ],
        first=9,
    ),
)
def test_a_refused_line_ends_the_command_and_releases_the_machine(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], line: str, snapshot: Any
) -> None:
    place, _ = session(monkeypatch, f"home\n{line}\ngoto 0.05,0,1.5\n")
    with pytest.raises(sl.SaglineError) as caught:
        place.run()
    assert str(caught.value) == snapshot
    assert len(str(caught.value)) < 300
    assert place.control.state is State.OFF
    assert "MOVING" not in capsys.readouterr().out


def test_a_fault_ends_the_command_with_an_exit_code(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    place, machine = session(monkeypatch, "home\ngoto 0.1,0,1.5\ngoto 0,0,1.5\n")
    machine.inject("cable 3 breaks at 1.5 s")
    assert place.run() == 1
    assert capsys.readouterr().out.count("MOVING") == 1
    assert place.control.state is State.EMERGENCY


def test_the_status_line_has_the_width_of_the_terminal_and_is_removed(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    monkeypatch.setenv("LINES", "24")
    monkeypatch.setattr(sys.stdout, "isatty", lambda: True)
    with _StatusLine(shown=True) as line:
        line.update("x" * 200)
        line.update("y" * 200)  # too soon
    out = capsys.readouterr().out
    assert "\x1b[1;23r" in out
    shown = out.split("\x1b[7m")[1].split("\x1b[0m")[0]
    assert len(shown) == 79
    assert "y" not in out
    assert "\x1b[r" in out.rsplit("\x1b[7m", 1)[1]
    with _StatusLine(shown=False) as line:
        line.update("x")
        line.ask()
    assert capsys.readouterr().out == ""
