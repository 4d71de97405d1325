"""Times of two versions, measured in turn: `python -m benchmarks.versions FOLDER`, a clone of the other version.

The clone needs its own environment in `.venv`. Each version runs in one process, on one core, and measures processor
time. The measurements use names that exist in both versions.
"""

from __future__ import annotations

import os
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import Any, Final

import numpy as np

import sagline as sl

POSES: Final = 3_000
CABLES: Final = 1_000_000
TURNS: Final = 12  # measurements of each row in each version
Measured = tuple[str, Callable[[], object], int, float]  # quantity, run, runs per measurement, units per second


def inverses() -> Iterator[Measured]:
    """Inverse kinematics of feasible poses, in microseconds per pose."""
    for name in ("article-suspended", "article-mixed", "cogiro", "ipanema-1"):
        robot, rng = sl.load_robot(name), np.random.default_rng(3)
        box = robot.test_box
        assert box is not None
        place = rng.uniform(box.low, box.high, (POSES, 3))
        pose = sl.Pose.from_euler(place, *rng.uniform(-0.05, 0.05, (3, POSES)))
        pose = pose[np.flatnonzero(sl.inverse(robot, pose).feasible)]
        scale = 1e6 / len(pose)
        yield f"inverse, {name}, exact [µs]", partial(sl.inverse, robot, pose), 1, scale
        if name == "article-suspended":
            for model in (sl.Empirical(), sl.Parabolic(), sl.Elastic()):
                row = f"inverse, {name}, {type(model).__name__.lower()} [µs]"
                yield row, partial(sl.inverse, robot, pose, model), 1, scale
        over = robot.replace(winches=sl.Winch(0.05, dead_cable=4.0))
        yield f"inverse, {name}, pulleys [µs]", partial(sl.inverse, over, pose), 1, scale


def cables() -> Iterator[Measured]:
    """Single cables in a batch, in nanoseconds per cable."""
    rng, model, cable = np.random.default_rng(0), sl.Catenary(), sl.Cable(0.067, 44e3)
    chord = rng.uniform(1, 15, CABLES), rng.uniform(-6, 6, CABLES)
    tension = rng.uniform(20, 400, CABLES)
    length = model.from_tension(cable, *chord, tension).unstrained_length
    yield "catenary from tension [ns]", partial(model.from_tension, cable, *chord, tension), 1, 1e9 / CABLES
    yield "catenary from length [ns]", partial(model.from_length, cable, *chord, length), 1, 1e9 / CABLES


def calls() -> Iterator[Measured]:
    """Single calls in a control loop, in microseconds."""
    from tests.dynamics.machines import prototype

    solver, turn, lengths = sl.InverseSolver(sl.load_robot("article-suspended")), np.array([0.0, 0, 0, 1]), np.empty(8)
    run = partial(solver.step_into, np.array([1.0, 2.0, 1.5]), turn, lengths)
    yield "InverseSolver.step_into [µs]", run, 500, 1e6
    for words, robot in (("", prototype()), (", pulleys", prototype(pulley_radius=0.03, dead_cable=1.0))):
        machine = sl.Simulator(robot, sl.Pose.from_euler([0.1, 0.05, 1.0], 0.0, 0.0, 0.0), load_cell_filter=0.005)
        given = machine.reading.length.copy()
        for period in (1e-2, 1e-3):
            row = f"Simulator.step of {1e3 * period:g} ms{words} [µs]"
            yield row, partial(machine.step, given, period), 300, 1e6


def whole() -> Iterator[Measured]:
    """Vibrations and a calibration, in milliseconds."""
    calibration: Any = import_module("benchmarks.calibration")
    middle = import_module("benchmarks.vibrations").middle
    for name in ("cogiro", "article-suspended"):
        yield f"vibration, {name} [ms]", partial(sl.vibration, middle(name), up_to=20.0), 3, 1e3
    places = np.random.default_rng(0).uniform([-3, -2, 1], [3, 2, 3], (64, 3))
    run: Any = partial(sl.frequency_map, sl.load_robot("cogiro"), sl.Pose.from_euler(places, 0, 0, 0), up_to=20.0)
    yield "frequency map, cogiro, per pose [ms]", run, 1, 1e3 / 64
    robot = calibration.COGIRO
    log = calibration.varied(calibration.true_robot(robot, calibration.ERRORS, 1), 60, 1).log
    yield "calibrate, 60 poses [ms]", partial(sl.calibrate, robot, log, calibration.UNKNOWNS, folds=0), 1, 1e3


def work() -> None:
    """Measure the rows that the standard input names, one per line."""
    rows = {row[0]: row[1:] for part in (inverses, cables, calls, whole) for row in part()}
    print("|".join(rows), flush=True)
    for line in sys.stdin:
        run, count, scale = rows[line.strip()]
        times = []
        for _ in range(4):
            start = time.process_time()
            for _ in range(count):
                run()
            times.append((time.process_time() - start) / count)
        print(scale * min(times), flush=True)


def worker(folder: Path) -> tuple[Any, list[str]]:
    """Process of one version, and the names of its rows."""
    paths = os.pathsep.join((str(folder / "src"), str(folder)))
    environment = {**os.environ, "PYTHONPATH": paths, "OPENBLAS_NUM_THREADS": "1"}
    command = [str(folder / ".venv" / "bin" / "python"), __file__, "work"]
    process = subprocess.Popen(
        command, cwd=folder, env=environment, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    )
    assert process.stdout is not None
    return process, process.stdout.readline().strip().split("|")


def main(other: Path) -> None:
    """Print the shortest times of both versions and their ratios."""
    workers = [worker(folder) for folder in (other.resolve(), Path(__file__).parents[1])]
    best: dict[tuple[str, int], float] = {}
    for turn in range(TURNS):
        for name in workers[0][1]:
            for k in (0, 1) if turn % 2 else (1, 0):
                process = workers[k][0]
                process.stdin.write(f"{name}\n")
                process.stdin.flush()
                best[name, k] = min(best.get((name, k), np.inf), float(process.stdout.readline()))
    print("| quantity | other version | this version | ratio |\n|---|---|---|---|")
    for name in workers[0][1]:
        before, after = best[name, 0], best[name, 1]
        print(f"| {name} | {before:.2f} | {after:.2f} | {after / before:.2f} |")
    for process, _ in workers:
        process.stdin.close()
        process.wait()


if __name__ == "__main__":
    os.sched_setaffinity(0, {max(os.sched_getaffinity(0))})
    if sys.argv[1] == "work":
        work()
    else:
        main(Path(sys.argv[1]))
