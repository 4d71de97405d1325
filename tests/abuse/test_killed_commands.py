"""Commands that are killed or interrupted at random moments: each file is whole, and remains are removed."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from sagline.files.writing import write_text
from tests.abuse.commands import COMMANDS, Written, prepare, tree
from tests.cli.interrupts import heard
from tests.tiers import extended

pytestmark = extended

NAMES = ("track", "article", "forward", "convert")
PATIENCE = 120.0  # s
INTERRUPTED = (130, -signal.SIGINT)  # a shell shows 130 for both; the second is from Python itself
MODULE = (sys.executable, "-m", "sagline.cli")


def spawned(*words: str) -> "subprocess.Popen[str]":
    return subprocess.Popen(
        [*MODULE, *words], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, preexec_fn=heard
    )


@pytest.mark.parametrize("count", [1, pytest.param(50, marks=pytest.mark.soak)])
@pytest.mark.parametrize("name", NAMES)
def test_no_partial_file_and_no_temporary_file_remains(
    tmp_path: Path, written: Written, monkeypatch: pytest.MonkeyPatch, name: str, count: int
) -> None:
    monkeypatch.chdir(tmp_path)
    prepare(tmp_path)
    whole = written(name)
    inputs = tree(tmp_path)
    start = time.perf_counter()
    assert spawned(*COMMANDS[name]).communicate(timeout=PATIENCE) is not None
    duration = time.perf_counter() - start
    assert tree(tmp_path) == inputs | whole
    rng = np.random.default_rng(NAMES.index(name))
    faults = []
    for k in range(count):
        number = signal.SIGINT if (k + NAMES.index(name)) % 2 else signal.SIGKILL
        for file in whole:
            Path(file).unlink(missing_ok=True)
        code, errors = stopped(COMMANDS[name], number, rng, duration)
        left = tree(tmp_path)
        faults += [f"{k}: half {path}" for path in left.keys() & whole.keys() if left[path] != whole[path]]
        if number is signal.SIGINT and code not in (0, *INTERRUPTED):
            faults.append(f"{k}: exit code {code} after Ctrl-C: {errors[-300:]}")
        write_text("out/next.txt", "")
        Path("out/next.txt").unlink()
        faults += [f"{k}: left {path}" for path in tree(tmp_path).keys() - inputs.keys() - whole.keys()]
        if {Path(file).suffix for file in left.keys() & whole.keys()} in ({".html"}, {".json"}):
            faults.append(f"{k}: one of two that belong together")
    assert faults == []


def stopped(
    words: tuple[str, ...], number: signal.Signals, rng: np.random.Generator, duration: float
) -> tuple[int, str]:
    """A command that receives a signal at a random moment of its whole run, or while it writes files."""
    process = spawned(*words)
    share = float(rng.random())
    try:
        if rng.random() < 0.5:
            process.wait(1.1 * duration * share)
        else:
            while process.poll() is None and not os.listdir("out"):
                time.sleep(1e-3)
            process.wait(0.3 * duration * share**2)
    except subprocess.TimeoutExpired:
        process.send_signal(number)
    _, errors = process.communicate(timeout=PATIENCE)
    return process.returncode, errors
