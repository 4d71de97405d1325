"""All readers with changed and made-up inputs: a result or an error of one line, in bounded time and memory.

`SAGLINE_FUZZ_MINUTES` is the duration of the soak test.
"""

from __future__ import annotations

import os
import time
from pathlib import Path

import pytest

from tests.fuzz.changes import KINDS, change_of
from tests.fuzz.run import fuzz
from tests.fuzz.targets import targets
from tests.tiers import extended


@pytest.mark.soak
def test_fuzzing_finds_nothing(tmp_path: Path) -> None:
    minutes = float(os.environ.get("SAGLINE_FUZZ_MINUTES", "10"))
    found = fuzz(minutes, seed=time.time_ns() // 10**9 * 1000, folder=tmp_path)
    assert found.faults == []
    assert found.executions.total() > 100 * minutes
    assert 0 < found.read < found.executions.total()


@extended
def test_every_reader_is_fuzzed_and_every_kind_of_change_makes_another_input(tmp_path: Path) -> None:
    import numpy as np

    rng, readers = np.random.default_rng(3), targets(tmp_path)
    assert {each.name for each in readers} >= {"run.mcap", "run.nc", "sim.nc", "found.nc", "space.nc", "solid.stl"}
    assert {each.kind for each in readers} == set(KINDS)
    for reader in readers:
        assert [reader.read(reader.written(tmp_path, reader.samples[0]))] != [None]
        assert any(change_of(rng, reader, reader.samples, tmp_path) not in reader.samples for _ in range(4))


@pytest.mark.soak
def test_a_reader_that_crashes_or_warns_is_found(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The worker process runs a file that replaces a reader."""
    for statement, reason in (("os.kill(os.getpid(), 11)", "signal 11"), ("warnings.warn('x')", "exit code 1")):
        module = tmp_path / "sitecustomize.py"
        module.write_text(
            "import os, sys, warnings\n"
            "if 'tests.fuzz.run' in sys.orig_argv:\n"
            "    from sagline.files import mesh_file\n"
            f"    mesh_file.load_mesh = lambda file: {statement}\n"
        )
        monkeypatch.setenv("PYTHONPATH", f"{tmp_path}{os.pathsep}{os.environ['PYTHONPATH']}")
        found = fuzz(0.001, seed=5, folder=tmp_path / "found", only="solid.ply")
        assert [reason in each for each in found.faults] == [True]
