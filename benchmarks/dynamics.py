"""Dynamics: what motions leave, and how fast they may be; one core."""

from __future__ import annotations

import time
from collections.abc import Iterator

from rich.console import Console

import sagline as sl
from benchmarks.measure import Row, one_core, show
from tests.dynamics.residuals import HEAVY, WAYPOINTS, residual, scene
from tests.dynamics.test_fastest import shortest_quintic


def residuals() -> Iterator[Row]:
    """Vibration after x from 0 to 3 m in 2 s, article-suspended."""
    seen = {
        "static lengths": "5.9 mm",
        "static lengths, ZV": "2.1 mm",
        "static lengths, ZVD": "1.0 mm",
        "static lengths, EI": "0.9 mm",
        "static lengths, ZV of both": "0.41 mm",
        "plan": "<= 1e-3 mm",
    }
    for name, reach in seen.items():
        yield Row(f"left by {name}", reach, f"{residual(name):.3g} mm")
    for name, reach in (("static lengths, ZVD", "1.4 mm"), ("plan", "1.4 mm"), ("plan, ZVD", "<= 0.5 mm")):
        yield Row(f"left by {name}, mass x {HEAVY}", reach, f"{residual(name, HEAVY):.3g} mm")
    for name, reach in (("static lengths", "7.8 mm"), ("plan", "2.4 mm"), ("plan, ZVD of both", "<= 0.5 mm")):
        left = residual(name, cable_mass="lumped")
        yield Row(f"left by {name}, with cable mass", reach, f"{left:.3g} mm")


def shortest() -> Iterator[Row]:
    """The same way as fast as the tension limits allow."""
    robot, path = scene().robot, sl.quintic_path(WAYPOINTS, durations=2.0)
    for jerk in (None, 200.0):
        start = time.perf_counter()
        quick = sl.fastest(robot, path, margin=0.0, jerk=jerk)
        took = time.perf_counter() - start
        bound = "jerk unbounded" if jerk is None else f"jerk <= {jerk:g} m/s^3"
        reach = "0.858 s" if jerk is None else "within the limits"
        whole = sl.inverse(robot, quick).feasible.all()
        shown = f"{quick.duration:.3f} s, {'within' if whole else 'NOT within'} the limits; found in {took:.1f} s"
        yield Row(f"fastest, {bound}", reach, shown)
    yield Row("shortest quintic", "1.118 s", f"{shortest_quintic(robot, WAYPOINTS, 0.0):.3f} s")


def main() -> None:
    """Measure and print."""
    console = Console()
    rows: list[Row] = []
    one_core()
    for part in PARTS:
        Console(stderr=True).print(f"[dim]{part.__doc__}[/dim]")
        rows.extend(part())
    show("Dynamics", rows, console)


PARTS = (residuals, shortest)

if __name__ == "__main__":
    main()
