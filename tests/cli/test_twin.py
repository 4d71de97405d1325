"""`sagline twin` on the command line: outputs and refusals."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import closing
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

import sagline as sl
from sagline.cli.control import _TwinMonitor
from sagline.cli.main import app
from sagline.files.mcap_reader import read_log
from sagline.files.mcap_writer import Recorder
from sagline.twin import Machine, Server
from tests.plc.samples import a_command
from tests.tiers import extended

OWNER = 4711


@extended  # the name of the host is looked up
def test_an_unknown_host_is_refused() -> None:
    result = CliRunner().invoke(app, ["twin", "article-prototype", "--host", "nobody.invalid", "--port", "0"])
    assert (result.exit_code, result.stdout) == (2, "")
    assert "'nobody.invalid'" in result.stderr
    assert result.stderr.count("\n") == 1
    assert len(result.stderr) < 300


def test_a_port_without_free_ports_after_it_is_refused_first(monkeypatch: pytest.MonkeyPatch) -> None:
    made = []
    monkeypatch.setattr("sagline.twin.machine.Machine", lambda *_, **__: made.append(1))
    result = CliRunner().invoke(app, ["twin", "article-prototype", "--port", "65533"])
    assert (result.exit_code, result.stdout, made) == (2, "", [])
    assert "0 to 65532" in result.stderr


def interrupted(server: Server, watch: Callable[..., object]) -> None:
    raise KeyboardInterrupt


@pytest.mark.parametrize("words", [[], ["--modbus"]])
def test_the_first_lines_fit_80_columns_and_ctrl_c_is_130(words: list[str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Server, "run", interrupted)
    result = CliRunner().invoke(app, ["twin", "article-prototype", "--port", "0", *words])
    assert result.exit_code == 130
    assert (result.stderr.partition(" ")[0], result.stderr.count("\n")) == ("Interrupted.", 1)
    lines = result.stdout.splitlines()
    assert max(map(len, lines)) <= 80
    place = next(i for i, line in enumerate(lines) if line.endswith("\\"))
    command = (lines[place][:-1] + lines[place + 1]).split()
    assert command[:3] == ["sagline", "control", "article-prototype"]
    assert ("--modbus" in command) is bool(words)
    assert command[-2] == "--plc"
    assert len(command[-1].split(",")) == 4


def test_changes_of_the_plcs_are_printed(capsys: pytest.CaptureFixture[str], snapshot: Any) -> None:
    machine = Machine(sl.load_robot("article-prototype"), seed=1, faults=["servo 7 trips at 0.5 s"])
    watch, link = _TwinMonitor(machine), machine.link()
    with closing(link):
        for counter in range(1, 100):
            link.exchange(a_command(8, owner=OWNER, counter=counter, mode=sl.control.Mode.HOLD, enable=np.ones(8) > 0))
            watch(machine.time, machine.reading)
    said = capsys.readouterr().out.splitlines()
    assert [line.split(" s  ")[1] for line in said] == snapshot
    assert [float(line.split()[0]) for line in said] == pytest.approx([0.0, 0.1, 0.6], abs=0.11)


def test_a_log_contains_the_true_poses(tmp_path: Path) -> None:
    machine = Machine(sl.load_robot("article-prototype"), seed=1, faults=["cable 0 breaks at 0 s"])
    watch, seen = _TwinMonitor(machine), []
    with Recorder(tmp_path / "twin.mcap", machine.robot) as watch.recorder:
        for _ in range(30):
            machine.advance()
            watch(machine.time, machine.reading)
            seen.append((machine.time, *machine.reading.position, *machine.reading.quaternion))
    truth = read_log(tmp_path / "twin.mcap").truth
    began = truth[0][0] - round(1e9 * seen[0][0])
    found = [(1e-9 * (stamp - began), *position, *quaternion) for stamp, position, quaternion in truth]
    np.testing.assert_allclose(found, seen, atol=1e-6)
    assert abs(seen[-1][3] - seen[0][3]) > 1e-4  # the platform moved in the meantime
