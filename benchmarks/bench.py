"""`make bench`: one table of times, ratios and residuals; one core, compared functions in the same run."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path

import numpy as np
from rich.console import Console

import sagline as sl
from benchmarks import (
    c_source,
    calibration,
    controller,
    design,
    dynamics,
    experiment,
    interference,
    machine,
    workspaces,
)
from benchmarks.formula import algebraic, as_printed
from benchmarks.links import links
from benchmarks.measure import (
    Row,
    best_of_calls,
    best_seconds,
    one_core,
    process_peak_memory,
    process_seconds,
    show,
)
from benchmarks.sweep import sweeps
from sagline.core.arrays import Array, locked
from sagline.kernels.cable.batch import batch_from_length, batch_from_tension
from sagline.kernels.tables import BUFFERS, CHUNK
from tests.cables.reference import load_reference
from tests.kinematics.test_underconstrained import places, suspended

CABLES = 1_000_000
POSES = 100_000
CABLE = sl.Cable(0.067, 44e3)


def accuracy_of_cables() -> Iterator[Row]:
    """Worst relative errors of 630 cables, compared with solutions of 90 digits."""
    table = load_reference()
    state = sl.Catenary().from_length(table.cable, table.span, table.rise, table.p2_length)
    miss = np.hypot(state.horizontal_tension - table.p2_horizontal, state.vertical_force - table.p2_vertical)
    force = miss / table.largest_tension(table.p2_horizontal, table.p2_vertical, table.p2_length)
    rows = table.span > 0
    cable = sl.Cable(table.cable.linear_density[rows], table.cable.axial_stiffness[rows])
    tension = table.p3_horizontal[rows] * np.hypot(table.span, table.rise)[rows] / table.span[rows]
    state = sl.Catenary().from_tension(cable, table.span[rows], table.rise[rows], tension)
    length = np.abs(state.unstrained_length / table.p3_length[rows] - 1)
    yield Row("catenary from tension, worst relative error, 90-digit reference", "4e-15", f"{length.max():.1e}")
    yield Row("catenary from length, worst relative error, 90-digit reference", "4e-15", f"{force.max():.1e}")


def speed_of_cables() -> Iterator[Row]:
    """Times for a batch of ordinary cables: public call, kernel alone, and the article's formula."""
    rng = np.random.default_rng(0)
    span, rise = locked(rng.uniform(1, 15, CABLES)), locked(rng.uniform(-6, 6, CABLES))
    tension = locked(rng.uniform(20, 400, CABLES))
    model = sl.Catenary()
    state = model.from_tension(CABLE, span, rise, tension)
    horizontal, length = state.horizontal_tension, state.unstrained_length
    out, work = np.empty(CABLES), np.empty((3, CABLES))
    codes = np.empty(CABLES, dtype=np.int8)
    rho, ea = CABLE.linear_density.reshape(1), CABLE.axial_stiffness.reshape(1)

    room = np.empty((BUFFERS, CHUNK))

    def kernel_of(batch: Callable[..., None], given: Array) -> Callable[[], None]:
        buffers = (room,) if batch is batch_from_tension else ()
        return lambda: batch(model.terms(9.81), (span, rise, rho, ea, given), (*work, codes), *buffers)

    to_ns = 1e9 / CABLES
    printed = best_seconds(lambda: as_printed(span, rise, horizontal, 0.067, 44e3, out)) * to_ns
    plain = best_seconds(lambda: algebraic(span, rise, horizontal, 0.067, 44e3, out)) * to_ns
    for name, reach, batch, given, call in (
        ("tension", 60, batch_from_tension, tension, lambda: model.from_tension(CABLE, span, rise, tension)),
        ("length", 250, batch_from_length, length, lambda: model.from_length(CABLE, span, rise, length)),
    ):
        public = best_seconds(call) * to_ns
        bare = best_seconds(kernel_of(batch, given)) * to_ns
        yield Row(
            f"catenary from {name}, 10^6 cables",
            f"<= {reach} ns per cable, <= 1.15 x the kernel alone",
            f"{public:.0f} ns, {public / bare:.2f} x the kernel alone ({bare:.0f} ns), "
            f"which is {bare / printed:.1f} x the formula as printed, {bare / plain:.1f} x algebraic",
        )
        if name == "tension":
            strained = best_seconds(kernel_of(batch, locked(rng.uniform(20, 0.05 * 44e3, CABLES)))) * to_ns
            yield Row(
                "catenary from tension, strains up to 5 %", "<= 1.3 x", f"{strained:.0f} ns, {strained / bare:.2f} x"
            )
    solver = sl.CableSolver(CABLE)
    single = [
        best_of_calls(call) * 1e6
        for call in (
            lambda: solver.from_tension(12.0, -4.0, 100.0),
            lambda: solver.from_length(12.0, -4.0, 12.7),
            lambda: model.from_tension(CABLE, 12.0, -4.0, 100.0),
        )
    ]
    row = f"{single[0]:.1f} us; {single[1]:.1f} us; {single[2]:.0f} us"
    yield Row("CableSolver.from_tension; .from_length; the same by Catenary.from_tension", "<= 2 us; <= 2 us", row)
    yield Row("the article's formula (48), 10^6 cables", "", f"as printed {printed:.0f} ns, algebraic {plain:.1f} ns")


def in_the_box(robot: sl.Robot, count: int) -> sl.Pose:
    """Feasible poses among `count` random poses of a robot's test box."""
    rng, box = np.random.default_rng(3), robot.test_box
    assert box is not None
    pose = sl.Pose.from_euler(rng.uniform(box.low, box.high, (count, 3)), *rng.uniform(-0.05, 0.05, (3, count)))
    return pose[np.flatnonzero(sl.inverse(robot, pose).feasible)]


def inverse_kinematics() -> Iterator[Row]:
    """Times for random poses of the article's suspended robot in a batch, and for single poses."""
    robot = sl.load_robot("article-suspended")
    rng = np.random.default_rng(1)
    drawn = 6 * POSES // 5  # infeasible poses run other code and are omitted
    pose = sl.Pose.from_euler(
        rng.uniform((-5, -3.5, 1), (5, 3.5, 4), (drawn, 3)), *rng.uniform(-0.05, 0.05, (3, drawn))
    )
    pose = pose[np.flatnonzero(sl.inverse(robot, pose).feasible)[:POSES]]

    def microseconds(model: sl.CableModel) -> float:
        return best_seconds(lambda: sl.inverse(robot, pose, model), 5) * 1e6 / len(pose)

    exact, empirical, elastic = (microseconds(model) for model in (sl.Catenary(), sl.Empirical(), sl.Elastic()))
    yield Row(
        "inverse, 8 cables, exact, 10^5 poses",
        "<= 5 us per pose, <= 4 x empirical",
        f"{exact:.1f} us; {exact / empirical:.1f} x empirical ({empirical:.1f} us), elastic {elastic:.1f} us",
    )
    for name in ("article-mixed", "cogiro", "ipanema-1"):
        other = sl.load_robot(name)
        there = in_the_box(other, POSES // 5)
        time = best_seconds(partial(sl.inverse, other, there), 5) * 1e6 / len(there)
        yield Row(f"the same, {name}", "", f"{time:.1f} us")
    ratios = []
    for name in ("article-suspended", "article-mixed", "cogiro", "ipanema-1", "ipanema-3"):
        other = sl.load_robot(name)
        run = partial(sl.inverse, other, in_the_box(other, POSES // 2))
        pairs = [[best_seconds(partial(run, stability=asked), 1) for asked in (True, False)] for _ in range(15)]
        ratios.append(np.divide(*np.min(pairs, axis=0)))
    listed = ", ".join(f"{ratio:.2f}" for ratio in ratios)
    yield Row("inverse with stability, relative to stability=False, in turn; five presets", "<= 1.1 x", f"{listed} x")
    plan = sl.inverse(robot, pose)
    residual = float(np.max(plan.wrench_residual))
    some = slice(10_000)
    found = sl.forward(robot, plan.unstrained_length[some], start=pose[some], wrench=plan.state.wrench[some])
    miss = float(np.max(np.linalg.norm(found.pose.position - pose.position[some], axis=1)))
    yield Row("wrench residual of these exact plans", "1e-8 N", f"{residual:.1e} N")
    yield Row("position error after the exact forward kinematics, 10^4 poses", "1e-9 m", f"{miss:.1e} m")
    few, spots = suspended(4), places(4, POSES // 5)
    time = best_seconds(partial(sl.inverse, few, spots), 5) * 1e6 / len(spots)
    yield Row("underconstrained, 4 cables, exact", "<= 5 x 8 cables", f"{time:.1f} us; {time / exact:.1f} x 8 cables")
    solver = sl.InverseSolver(robot)
    place, turn, lengths = np.array([1.0, 2.0, 1.5]), np.array([0.0, 0.0, 0.0, 1.0]), np.empty(8)
    step = best_of_calls(lambda: solver.step(place, turn)) * 1e6
    into = best_of_calls(lambda: solver.step_into(place, turn, lengths)) * 1e6
    yield Row("InverseSolver.step; .step_into", "<= 20 us; <= 6 us", f"{step:.1f} us; {into:.1f} us")


def two_threads() -> Iterator[Row]:
    """Two threads on two cores, each with half of the poses, compared with one thread; this runs before `one_core`."""
    cores = len(os.sched_getaffinity(0))
    if cores < 2:
        return
    robot, rng = sl.load_robot("article-suspended"), np.random.default_rng(2)
    count = 1_000_000
    pose = sl.Pose(rng.uniform((-4, -3, 1), (4, 3, 3), (count, 3)), np.broadcast_to(np.eye(3), (count, 3, 3)))
    halves = pose[: count // 2], pose[count // 2 :]
    with ThreadPoolExecutor(2) as threads:
        one = best_seconds(lambda: sl.inverse(robot, pose), 3)
        two = best_seconds(lambda: list(threads.map(lambda half: sl.inverse(robot, half), halves)), 3)
    yield Row("inverse of 10^6 poses in two threads", ">= 1.8 x one", f"{one / two:.2f} x; {two:.2f} s")


def whole_processes() -> Iterator[Row]:
    """Memory of a long plan, and times of whole processes."""
    memory = process_peak_memory(
        "import numpy as np, sagline as sl\n"
        "path = sl.article_path(rate=1_000_000 / 60)\n"
        "plan = sl.inverse(sl.load_robot('article-suspended'), path)\n"
        "assert len(path) >= 1_000_000 and plan.feasible.all()"
    )
    yield Row("peak memory of a 10^6-pose plan", "<= 1.5 GB", f"{memory:.2f} GB")
    imported = process_seconds([sys.executable, "-c", "import sagline"])
    command = str(Path(sys.executable).parent / "sagline")
    out = ["--no-figures", "--out", "output/bench"]
    tracked = process_seconds([command, "track", "article-suspended", *out])
    yield Row(
        "import sagline; sagline track, 6,001 poses, no figures, warm",
        "<= 1.2 s; <= 3 s",
        f"{imported:.2f} s; {tracked:.2f} s",
    )


def main() -> None:
    """Measure and print."""
    console = Console()
    rows: list[Row] = [*two_threads(), *links(), *sweeps()]
    one_core()
    for part in (
        accuracy_of_cables,
        speed_of_cables,
        inverse_kinematics,
        whole_processes,
        *machine.PARTS,
        *controller.PARTS,
        *dynamics.PARTS,
        *c_source.PARTS,
        *experiment.PARTS,
        *workspaces.PARTS,
        *calibration.PARTS,
        *design.PARTS,
        *interference.PARTS,
    ):
        Console(stderr=True).print(f"[dim]{part.__doc__}[/dim]")
        rows.extend(part())
    show("From a path to lengths", rows, console)


if __name__ == "__main__":
    main()
