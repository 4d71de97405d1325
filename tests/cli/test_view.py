"""`sagline view` as a process: address, outputs and end."""

import re
import signal
import socket
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path as FilePath
from typing import Any
from urllib.request import urlopen

import numpy as np
import pytest
from typer.testing import CliRunner

import sagline as sl
from sagline.cli.main import app
from sagline.cli.view import _played_beside, _played_in
from tests.cli import interrupts
from tests.refusal import refused
from tests.tiers import extended
from tests.viewer.client import Client


@contextmanager
def viewing(*words: str) -> Iterator[tuple[subprocess.Popen[str], str]]:
    command = [sys.executable, "-m", "sagline.cli", "view", *words, "--port", "0", "--no-browser"]
    process = subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, preexec_fn=interrupts.heard
    )
    try:
        assert process.stdout is not None
        found = re.search(r"http://127\.0\.0\.1:\d+/\S+", process.stdout.readline())
        assert found is not None
        yield process, found[0]
    finally:
        process.kill()
        process.communicate()


@extended
def test_it_serves_a_page_and_ctrl_c_during_a_drag_ends_it() -> None:
    with viewing("article-suspended") as (process, address):
        with urlopen(address) as page:
            assert b"<html" in page.read().lower()
        client = Client(address)
        client.grab()
        client.drag([0.5, 0.0, 2.0])
        assert any("Feasible" in str(message) for message in client.heard(120.0))
        client.drag([0.6, 0.0, 2.0])
        client.send(b"\xff nonsense")
        process.send_signal(signal.SIGINT)
        said, complained = process.communicate(timeout=120.0)
        assert process.returncode == 0
        assert "Traceback" not in said + complained
        assert "Stopped." in complained
        client.break_off()


def test_ctrl_c_ends_the_command_if_an_imported_package_catches_the_exception(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def catch(page: Any) -> None:
        with suppress(KeyboardInterrupt):
            signal.raise_signal(signal.SIGINT)
        page.refresh()

    def draw(_: Any) -> None:
        raise AssertionError("the page continues")

    monkeypatch.setattr("sagline.viewer.page.Page._update", catch)
    monkeypatch.setattr("sagline.viewer.page.Page._draw", draw)
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        result = CliRunner().invoke(app, ["view", "article-suspended", "--port", "0", "--no-browser"])
    finally:
        signal.signal(signal.SIGINT, before)
    assert result.exit_code == 0, result.exception
    assert "Stopped." in result.output


@pytest.mark.parametrize(
    ("words", "path", "others"),
    [
        ([], r"/[\w-]{20,}", False),
        (["--no-token"], "", False),
        (["--host", "localhost", "--clients", "3"], r"/[\w-]{20,}", False),
        (["--host", "0.0.0.0", "--allow-host", "lab.example"], r"/[\w-]{20,}", True),
    ],
)
def test_the_printed_address_has_the_token_and_the_browser_starts_with_another(
    words: list[str], path: str, others: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    opened: list[str] = []

    def serve(*_: Any) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("sagline.viewer.page.Page.serve", serve)
    monkeypatch.setattr("sagline.cli.view._has_display", lambda: True)
    monkeypatch.setattr("webbrowser.open", opened.append)
    result = CliRunner().invoke(app, ["view", "article-suspended", "--port", "0", *words])
    found = re.search(rf"(http://[\w.]+:\d+)({path})   ", result.stdout)
    assert found is not None
    assert (opened[0] != found[0].strip()) is bool(path)
    assert re.fullmatch(re.escape(found[1]) + path, opened[0])
    place = f"http://{socket.gethostname()}:{found[1].rpartition(':')[2]}{found[2]}."
    assert (place in result.stderr) is others


def test_a_port_in_use_is_reported() -> None:
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = str(taken.getsockname()[1])
        result = CliRunner().invoke(app, ["view", "article-suspended", "--port", port, "--no-browser"])
    assert result.exit_code == 2
    assert f" {port} " in result.stderr
    assert "--port 0" in result.stderr


def test_five_cables_have_no_page_because_a_position_is_not_sufficient(tmp_path: FilePath) -> None:
    angle = np.arange(5.0)[:, None]
    circle = np.hstack((np.cos(angle), np.sin(angle), np.full_like(angle, 3.0)))
    file = tmp_path / "five.yaml"
    robot = sl.Robot("five", circle, 0.1 * circle, sl.Cable(0.1, 1e5), 10.0, np.eye(3))
    file.write_text(sl.dump_robot(robot))
    result = CliRunner().invoke(app, ["view", str(file), "--no-browser"])
    assert result.exit_code == 2
    assert result.stderr.startswith("Error: five: ")


def test_a_simulation_is_played_like_a_run(tmp_path: FilePath) -> None:
    state = sl.inverse(sl.load_robot("cogiro"), sl.Pose([0.0, 0.0, 2.0], np.eye(3))).state
    swing = sl.simulate(state, duration=0.5, events=sl.Break(cable=3, time=0.25))
    swing.save(tmp_path / "sim.nc")
    played = _played_in(sl.load_robot("cogiro"), tmp_path / "sim.nc")
    assert (played.name, played.duration) == ("simulation", 0.5)
    np.testing.assert_array_equal(played.at(0.0).pose.position, swing.pose.position[0])
    assert np.isnan(played.at(0.5).tension[3])


@extended
def test_two_runs_are_named_by_their_files(tmp_path: FilePath) -> None:
    robot = sl.load_robot("article-mixed")
    first, second = tmp_path / "a.nc", tmp_path / "b.nc"
    for file in (first, second):
        sl.inverse(robot, sl.Pose([[0.0, 0.0, 1.5], [0.1, 0.0, 1.5]], np.stack([np.eye(3)] * 2))).save(file)
    beside = _played_beside(robot, first, second)
    assert beside.names == ("a.nc", "b.nc")
    assert beside.played.duration == 1.0
    with refused(kind=sl.FileError, file=second):
        _played_beside(sl.load_robot("cogiro"), first, second)
