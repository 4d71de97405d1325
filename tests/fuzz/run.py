"""Runs of the fuzzer: a worker process executes cases, and its parent detects crashes, blocked cases and faults."""

from __future__ import annotations

import atexit
import faulthandler
import re
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import warnings
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

import numpy as np

from sagline import SaglineError, SaglineWarning
from tests.abuse.reading import judged, sound
from tests.fuzz.changes import change_of
from tests.fuzz.targets import Target, targets

SILENCE: Final = 60.0  # s without a new case, after which a worker is blocked
MEMORY: Final = 6 << 30  # bytes of address space
CASES: Final = 20_000  # of one worker
MOST_SAMPLES: Final = 60  # of one reader
LARGEST: Final = {"text": 10_000, "binary": 300_000, "hdf5": 300_000}  # bytes of an input that is changed again
ROOT: Final = Path(__file__).parents[2]


@dataclass
class Found:
    """Results of a run."""

    executions: Counter[str] = field(default_factory=Counter)
    read: int = 0  # inputs that were accepted
    faults: list[str] = field(default_factory=list)


def fuzz(minutes: float, seed: int, folder: Path, only: str = "") -> Found:
    """Execute cases for some minutes; inputs with faults are kept in the folder."""
    found, end = Found(), time.monotonic() + 60.0 * minutes
    folder.mkdir(parents=True, exist_ok=True)
    while (left := end - time.monotonic()) > 0.0:
        seed += 1
        with tempfile.TemporaryDirectory() as place:
            words = [sys.executable, "-m", "tests.fuzz.run", str(seed), f"{left:.1f}", place, only]
            with (Path(place) / "errors").open("w+") as errors:
                process = subprocess.Popen(words, cwd=ROOT, stdout=subprocess.PIPE, stderr=errors, text=True)
                code = _followed(process, Path(place))
                assert process.stdout is not None
                _count(process.stdout.read(), found)
                process.stdout.close()
                errors.seek(0)
                last = errors.read()[-5000:]
            if code:
                kept = folder / f"{seed}-{time.time_ns()}"
                shutil.copytree(place, kept, ignore=shutil.ignore_patterns("errors", "scratch"))
                (kept / "reason.txt").write_text(f"{code}\n{last}", encoding="utf-8")
                found.faults.append(f"{kept}: {code}: {[*last.strip().splitlines(), ''][-2:][0]}")
    return found


def _followed(process: subprocess.Popen[str], place: Path) -> str:
    """Wait for a worker; the reason if it crashed, blocked, or reported a fault."""
    clock = place / "clock"
    while process.poll() is None:
        time.sleep(0.2)
        if clock.exists() and time.time() - clock.stat().st_mtime > SILENCE:
            process.send_signal(signal.SIGABRT)  # the traceback follows
            process.wait(30)
            return "hangs"
    code = process.returncode
    return "" if not code else f"signal {-code}" if code < 0 else f"exit code {code}"


def _count(text: str, found: Found) -> None:
    """Add the numbers of a worker."""
    for name, count, read in re.findall(r"^(\S+) (\d+) (\d+)$", text, re.MULTILINE):
        found.executions[name] += int(count)
        found.read += int(read)


def work(seed: int, seconds: float, place: Path, only: str) -> None:
    """Execute cases; raise at the first fault, with its input in the folder."""
    faulthandler.enable()
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    inputs, scratch = place / "input", place / "scratch"
    inputs.mkdir()
    scratch.mkdir()
    chosen = [each for each in targets(scratch) if only in each.name]
    samples = {each.name: list(each.samples) for each in chosen}
    known: dict[str, set[str]] = {each.name: set() for each in chosen}
    counts, read = Counter[str](), Counter[str]()
    atexit.register(lambda: [print(name, counts[name], read[name]) for name in counts])
    rng, end = np.random.default_rng(seed), time.monotonic() + seconds
    while time.monotonic() < end and counts.total() < CASES:
        target = chosen[int(rng.integers(len(chosen)))]
        data = change_of(rng, target, samples[target.name], scratch)
        file = target.written(inputs, data)
        (place / "clock").touch()
        counts[target.name] += 1
        found = judged(lambda: _read(target, file), f"seed {seed}: {target.name}")  # noqa: B023
        kind = "read"
        if isinstance(found, SaglineError):
            kind = re.sub(r"[\d.]+|'.*?'|\S{30,}", "#", str(found))
        else:
            read[target.name] += 1
            if target.checked:
                sound(found, target.name)
        if kind not in known[target.name]:  # a new message: the input reached other statements
            known[target.name].add(kind)
            if len(data) < LARGEST[target.kind] and len(samples[target.name]) < MOST_SAMPLES:
                samples[target.name].append(data)


def _read(target: Target, file: Path) -> Any:
    """Read a file; warnings of sagline are permitted, other warnings are errors."""
    warnings.simplefilter("ignore", SaglineWarning)
    return target.read(file)


if __name__ == "__main__":
    work(int(sys.argv[1]), float(sys.argv[2]), Path(sys.argv[3]), sys.argv[4])
