"""The controller: time of a cycle, alone and with a machine in the same process; one core."""

from __future__ import annotations

import time
from collections.abc import Iterator

import numpy as np

import sagline as sl
from benchmarks.measure import Row, print_table
from sagline.article.ten_poses import Table2
from sagline.control.link import Command, Missing, Sample
from tests.control.rigs import HOME, Spy, imperfect, rig
from tests.control.tours import OFF, tour

SPEED, STAND = 0.047, 3.0  # speed [m/s] and stop [s]: fourteen minutes through the ten poses


class Timed(Spy):
    """A link that measures the computing time of the machine to which it leads."""

    seconds = 0.0

    def exchange(self, command: Command | None) -> Sample | Missing:
        """Exchange data with the machine, and measure the time."""
        begin = time.perf_counter()
        answer: Sample | Missing = self.link.exchange(command)
        self.seconds += time.perf_counter() - begin
        return answer


def cycles() -> Iterator[Row]:
    """Time of the controller in each cycle, for homing and the ten poses without stops."""
    control, machine = rig(imperfect(zero=2e-3))
    link = control._context.link = Timed(machine.link())
    path = sl.quintic_path([HOME.position, *Table2().desired], speed=0.2)
    begin = time.perf_counter()
    motion = control.plan(path)
    planning = time.perf_counter() - begin
    control.start(motion)
    own, whole = [], time.perf_counter()
    while control.moving:
        begin, before = time.perf_counter(), link.seconds
        control.cycle()
        own.append(time.perf_counter() - begin - (link.seconds - before))
    whole = time.perf_counter() - whole
    half, rare = 1e3 * np.quantile(own, (0.5, 0.999))
    real = control.period * len(own) / whole
    yield Row(
        "computing time of a cycle: forward kinematics, control law, faults",
        "p50 0.2, p99.9 0.5 ms",
        f"{half:.3f}, {rare:.3f} ms",
    )
    yield Row(
        "controller and machine, of real time", ">= 80", f"{real:.0f} ({1e6 * whole / len(own):.0f} us per cycle)"
    )
    yield Row("part of the machine in this time", "", f"{1e6 * link.seconds / len(own):.0f} us per cycle")
    yield Row(f"planning and checking {path.duration:.0f} s", "", f"{planning:.2f} s, {path.duration / planning:.0f} x")


def stops() -> Iterator[Row]:
    """Times of a run of fourteen minutes through the ten poses."""
    right = tour(imperfect(), SPEED, STAND)
    mean, most = 1e3 * right.error.mean(), 1e3 * right.error.max()
    yield Row("pose error at the ten stops, perfect parameters", "<= 0.05 mm", f"{mean:.3f} mean, {most:.3f} mm worst")
    on, off = (tour(imperfect(zero=2e-3), SPEED, STAND, loop=loop) for loop in (None, OFF))
    errors = [float(np.sqrt(np.mean(one.tension**2))) for one in (off, on)]
    moved = 1e3 * np.linalg.norm(on.place - off.place, axis=1).max()
    yield Row(
        "length zeros wrong by 2 mm rms: tension error in the null space",
        "<= 1.5 N",
        f"{errors[0]:.1f} -> {errors[1]:.2f} N",
    )
    yield Row(
        "displacement of the platform by the tension loop",
        "<= 0.05 mm",
        f"{moved:.3f} mm, acting {1e2 * on.acting:.1f} %",
    )


PARTS = (cycles, stops)

if __name__ == "__main__":
    print_table("The controller", PARTS)
