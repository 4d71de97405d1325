"""SIGTERM and SIGHUP of `sagline control` and `sagline twin`: the machine stops, the log is whole, exit 143 and 129."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

import sagline as sl
from tests.plc.servers import PATIENCE
from tests.plc.twins import Twin, a_twin
from tests.tiers import extended

pytestmark = extended  # real time, processes and sockets
COMMAND = [sys.executable, "-m", "sagline.cli", "control", "article-prototype"]
TRIES = 8
MAGIC = b"\x89MCAP0\r\n"  # also the end of a closed file
UNBUFFERED = {**os.environ, "PYTHONUNBUFFERED": "1"}
LINES = "home 0,0,1.5; goto 0.3,0,1.5\n"  # the motion takes longer than the test


def moving(twin: Twin, log: Path) -> subprocess.Popen[str]:
    """A controller that is on its way; on a busy machine a cycle may be so late that it has to try again."""
    for _ in range(TRIES):
        if process := one_that_moves(twin, log):
            return process
    raise AssertionError("none of them moved")


def one_that_moves(twin: Twin, log: Path) -> subprocess.Popen[str] | None:
    """A controller that has begun its way; None if it ended before."""
    words = [*COMMAND, "--plc", twin.addresses, "--log", str(log)]
    process = subprocess.Popen(
        words, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=UNBUFFERED
    )
    assert process.stdin is not None
    assert process.stdout is not None
    process.stdin.write(LINES)
    process.stdin.flush()
    while line := process.stdout.readline():
        if "MOVING" in line:
            return process
    process.communicate()
    return None


@pytest.mark.parametrize(("number", "code"), [(signal.SIGTERM, 143), (signal.SIGHUP, 129)])
def test_controller_and_twin_stop_the_machine_and_close_their_logs(number: int, code: int, tmp_path: Path) -> None:
    log, truth = tmp_path / "run.mcap", tmp_path / "twin.mcap"
    with a_twin("--log", str(truth)) as twin:
        controller = moving(twin, log)
        time.sleep(1.0)
        controller.send_signal(number)
        said, errors = controller.communicate(timeout=PATIENCE)
        twin.line("brakes on, free")
        twin.signal(number)
        ended = twin.process.wait(PATIENCE)
    assert (controller.returncode, ended) == (code, code)
    assert "STOPPING" in said
    assert "OFF" in said.splitlines()[-1]
    assert errors.splitlines()[-1].startswith("Interrupted.")
    assert "Traceback" not in errors
    done = sl.load_execution(log)
    assert done.status is sl.control.ExecutionStatus.STOPPED
    # on a busy machine one late cycle may be as long as the ramp, so that no recorded one is STOPPING
    assert {sl.control.State.MOVING, sl.control.State.OFF} <= set(done.state.tolist())
    assert np.abs(done.samples.rate[-1]).max() < 1e-3
    assert 0.0 < np.nanmax(done.position[:, 0]) < 0.25
    for file in (log, truth):
        assert file.read_bytes().endswith(MAGIC)
        assert file.stat().st_size > 10_000
