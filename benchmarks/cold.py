"""Times of new processes, from start to end, on all cores: `python -m benchmarks.cold`."""

from __future__ import annotations

import os
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from pathlib import Path

from rich.console import Console

from benchmarks.measure import Row, show

SAGLINE = (sys.executable, "-m", "sagline.cli")
VIEW = """
import sys, threading, time
import sagline as sl
import numpy as np
from sagline.viewer.workspace import WorkspaceQuery, region_hull
from sagline.viewer.server import start_server, stop_server
from sagline.viewer.features import FEATURES
from sagline.viewer.page import Page

begun = float(sys.argv[1])
server = start_server(port=0)
viewer = Page(server, FEATURES, sl.load_robot("cogiro"))

def watch():
    while viewer.view is None:
        time.sleep(0.01)
    print(time.time() - begun, flush=True)
    asked = WorkspaceQuery(viewer.view.snapshot.robot, np.array([0.0, 0.0, 0.0, 1.0]), sl.Catenary(), sl.WrenchBox())
    region_hull(asked, True, lambda *_: None)
    print(time.time() - begun, flush=True)
    viewer.stop()

threading.Thread(target=watch, daemon=True).start()
viewer.serve()
stop_server(server)
"""


LENGTH = """
import sagline as sl
print(sl.inverse(sl.load_robot("cogiro"), sl.Pose.from_euler([0.2, -0.4, 2.4], 0, 0, 0)).unstrained_length[0])
"""


def process(arguments: Sequence[str]) -> tuple[float, float, str]:
    """Wall time and processor time [s] of a process with its children, and its standard output."""
    before, start = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
    done = subprocess.run(arguments, check=True, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
    wall, after = time.perf_counter() - start, resource.getrusage(resource.RUSAGE_CHILDREN)
    return wall, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime, done.stdout


def commands() -> Iterator[Row]:
    """Times of the first length, of a robot along a path, and of the article's test."""
    with tempfile.TemporaryDirectory() as folder:
        out = ("--out", str(Path(folder) / "out"))
        for name, reach, command in (
            ("import sagline", "<= 0.3 s", (sys.executable, "-c", "import sagline")),
            ("first exact length", "<= 5 s", (sys.executable, "-c", LENGTH)),
            ("sagline track cogiro, no figures", "", (*SAGLINE, "track", "cogiro", "--no-figures", *out)),
            ("sagline run", "<= 45 s", (*SAGLINE, "run", *out)),
        ):
            wall, seconds, _ = process(command)
            yield Row(name, reach, f"{wall:.2f} s; {seconds:.2f} s of processor")


def viewer() -> Iterator[Row]:
    """Time of the viewer until the cables can be dragged, and until the region is complete."""
    _, _, shown = process((sys.executable, "-c", VIEW, str(time.time())))
    first, region = map(float, shown.split())
    yield Row("sagline view cogiro: cables and all readings", "<= 15 s", f"{first:.1f} s")
    yield Row("region of the platform, after the readings", "<= 10 s", f"{region - first:.1f} s")


def main() -> None:
    """Measure and print."""
    rows: list[Row] = []
    for part in (commands, viewer):
        Console(stderr=True).print(f"[dim]{part.__doc__}[/dim]")
        rows.extend(part())
    show(f"The first run, {len(os.sched_getaffinity(0))} cores", rows, Console())


if __name__ == "__main__":
    main()
