"""Dynamics: residual vibration, and fastest motions; one core."""

from __future__ import annotations

import time
from collections.abc import Iterator
from functools import partial
from typing import Any, Final

import numpy as np

import sagline as sl
from benchmarks import vibrations
from benchmarks.measure import Row, best_of_calls, best_seconds, print_table
from sagline.dynamics.simulation.simulate import Integrator
from tests.dynamics.let_go import beside
from tests.dynamics.machines import prototype
from tests.dynamics.residuals import HEAVY, WAYPOINTS, residual, scene
from tests.dynamics.simulation.test_chains import cogiro as broken_state
from tests.dynamics.simulation.test_chains import moved, pushed, spectrum_peaks
from tests.dynamics.trajectories.test_fastest import shortest_quintic

AWAY: Final = np.array([0.004, -0.003, 0.0033])  # [m]
LUMPED_STEP: Final = 5e-5  # [s], the default of 20 nodes on CoGiRo


def residuals() -> Iterator[Row]:
    """Vibration after a motion in x from 0 to 3 m in 2 s, article-suspended."""
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
    """The fastest motion along the same path within the tension limits."""
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


def speed() -> Iterator[Row]:
    """Computing time of motions of 8 cables without mass, with steps of 1 ms."""
    state, lengths = beside(sl.load_robot("article-suspended"), (0.0, 0.0, 1.5), AWAY)
    seen: dict[Integrator, str] = {"splitting": ">= 250", "runge-kutta": ">= 100"}
    for integrator, reach in seen.items():
        run = partial(sl.simulate, state, unstrained_length=lengths, step=1e-3, record=0.1, integrator=integrator)
        seconds = best_seconds(lambda run=run: run(duration=20.0))  # type: ignore[misc]
        yield Row(f"{integrator}, times real time", reach, f"{20.0 / seconds:.0f}")
    for name, robot, reach in (
        ("without pulleys", prototype(), ">= 350"),
        ("with pulleys", prototype(pulley_radius=0.03, dead_cable=1.0), ">= 200"),
    ):
        machine = sl.Simulator(robot, sl.Pose.from_euler([0.1, 0.05, 1.0], 0.0, 0.0, 0.0), load_cell_filter=0.005)
        given = machine.reading.length.copy()
        for period in (1e-2, 1e-3):
            call = partial(machine.step, given, period)
            seconds = best_of_calls(call)
            what = f"prototype {name}, 1 kHz loops, sensors every {1e3 * period:g} ms, times real time"
            yield Row(
                what, reach if period == 1e-2 else "", f"{period / seconds:.0f} ({1e6 * seconds:.1f} us per call)"
            )


def energies() -> Iterator[Row]:
    """Energy of an undamped vibration in 60 s at 1 ms."""
    limits: dict[Integrator, str] = {"splitting": "5e-05", "runge-kutta": "1e-04"}
    for name, place, away in (
        ("article-suspended, 6 mm", (0.0, 0.0, 1.5), 0.006),
        ("cogiro, 6 mm", (0.0, 0.0, 2.0), 0.006),
        ("cogiro, 30 mm, cables slacken", (0.0, 0.0, 2.0), 0.03),
    ):
        state, lengths = beside(sl.load_robot(name.split(",")[0]), place, np.array([away, 0.0, 0.0]))
        for integrator, limit in limits.items():
            run = sl.simulate(state, unstrained_length=lengths, duration=60.0, step=1e-3, integrator=integrator)
            share = run.energy.error / run.energy.kinetic.max()
            trend = abs(np.polyfit(run.time / 60.0, share, 1)[0])
            shown = f"{trend:.0e} (largest {np.abs(share).max():.0e})"
            yield Row(f"{name}: trend of the energy, {integrator}", limit, shown)


def moving_anchors() -> Iterator[Row]:
    """A plan and its simulation on a ship that heaves and rolls, relative to fixed anchors; CoGiRo."""
    robot, seconds = sl.load_robot("cogiro"), 20.0
    path = sl.quintic_path([(0, 0, 2), (2, 1, 2.5)], durations=seconds, rate=500.0)
    wave = np.sin(path.time)
    place = sl.Pose.from_euler(np.outer(wave, [0.1, 0.0, 0.2]), 0.0, 0.0, 0.02 * wave)
    anchors = sl.anchors_on_bases(robot, [(sl.path_from_samples(path.time, place), range(8))])
    plans = [partial(sl.inverse, robot, path, anchors=each) for each in (anchors, None)]
    moved, fixed = np.min([[best_seconds(run, 1) for run in plans] for _ in range(9)], axis=0)
    shown = f"{1e6 * moved / len(path):.1f} us per pose; {moved / fixed:.1f} x"
    yield Row("plan with moving anchors; relative to fixed anchors", "", shown)
    runs = [partial(sl.simulate, plan(), step=1e-3, record=0.1) for plan in plans]
    moved, fixed = np.min([[best_seconds(run, 1) for run in runs] for _ in range(3)], axis=0)
    shown = f"{seconds / moved:.0f} x real time; {moved / fixed:.2f} x"
    yield Row("simulation with moving anchors, steps of 1 ms; time relative to fixed anchors", "", shown)


def lumped() -> Iterator[Row]:
    """Cables with mass as chains, CoGiRo and expo2015-lucia."""
    state = broken_state()
    seconds = 2.0
    took = best_seconds(lambda: sl.simulate(state, cable_mass="lumped", duration=seconds), 3)
    yield Row("lumped cables, 20 nodes, CoGiRo, 0.4 of the limit", ">= 8 x real time", f"{seconds / took:.0f} x")
    for name in ("cogiro", "falcon-7"):
        robot = sl.load_robot(name)
        assert robot.test_box is not None
        middle = sl.inverse(robot, sl.Pose(0.5 * (robot.test_box.low + robot.test_box.high), np.eye(3))).state
        given: dict[str, Any] = {"cable_mass": "lumped", "duration": 10.0, "damping": sl.Damping(loss_time=1e-3)}
        start = time.process_time()
        sl.simulate(middle, **given)
        yield Row(
            f"10 s of lumped cables with a loss time, 20 nodes, {name}",
            "<= 10 s",
            f"{time.process_time() - start:.1f} s",
        )
    largest = []
    for share in (1.125, 0.5, 0.25):  # 0.45, 0.2 and 0.1 of l sqrt(rho/EA)
        event = sl.Break(cable=0, time=0.0)
        run = sl.simulate(state, cable_mass="lumped", duration=1.0, step=share * LUMPED_STEP, events=event)
        largest.append(run.events[0].tension_after)
    off = max(abs(one / largest[-1] - 1.0) for one in largest)
    before = state.cables.frame_end_tension.max()
    shown = f"{100 * off:.2f} %; {largest[-1]:,.0f} N after {before:.0f} N"
    yield Row("a broken cable at 0.45, 0.2, 0.1 of the limit", "1 %; 1,074 N after 424 N", shown)
    run = moved()
    turned, worst = np.ptp(run.energy.supplied), np.abs(run.energy.error).max()
    yield Row(f"lumped cables along a path, {turned:,.0f} J of work", "closes", f"{worst:.0e} J")
    for nodes in (10, 20, 40):
        run = pushed(60.0, nodes)
        peaks = spectrum_peaks(run.time[40:], run.pose.position[40:, 0], 1.9, 3.2)
        shown = ", ".join(f"{peak:.3f}" for peak in peaks)
        invented = np.abs(run.energy.error).max() / run.energy.kinetic.max()
        yield Row(
            f"peaks of 60 s, expo2015-lucia with cable mass, {nodes} nodes",
            "2.011, 2.586, 3.028 Hz +- 0.017",
            f"{shown} Hz; energy invented {invented:.0e}",
        )


PARTS = (residuals, shortest, speed, energies, moving_anchors, lumped, *vibrations.PARTS)

if __name__ == "__main__":
    print_table("Dynamics", PARTS)
