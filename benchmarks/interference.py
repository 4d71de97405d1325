"""Least distances of sagging cables, rods, boxes and meshes; one core."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

import sagline as sl
from benchmarks.measure import Row, best_seconds, print_table
from sagline.core.arrays import Array, Indices, locked
from sagline.interference.clearance import ClearanceRows
from sagline.interference.pairs import cable_rows
from sagline.kernels.interference import shapes
from sagline.kernels.interference.catenary_distance import least_distances, work_arrays_for_pieces
from tests.interference.scenes import box_mesh
from tests.kernels.interference.hanging import agreement, all_pairs, nearest_cable_pairs

ROBOTS = ("article-suspended", "cogiro", "ipanema-1", "expo2015-lucia-pulleys")
POSES = 40  # few poses, so that a run ends before another program disturbs it
RUNS = 50


def states(name: str) -> sl.Equilibrium:
    """Feasible poses in a robot's test box, with small tilts."""
    robot, rng = sl.load_robot(name), np.random.default_rng(14)
    assert robot.test_box is not None
    places = rng.uniform(robot.test_box.low, robot.test_box.high, (POSES, 3))
    tilts = np.radians(rng.uniform(-5.0, 5.0, (3, POSES)))
    state = sl.inverse(robot, sl.Pose.from_euler(places, *tilts)).state
    return state[np.flatnonzero(~np.isnan(state.chord_tension).any(axis=1))]


def measured(rows: Array, pairs: Indices, precision: float, together: bool = False) -> tuple[float, Array, Array]:
    """Seconds per pose, distances and lower bounds."""
    still, numbers = locked(np.zeros((0, shapes.COLUMNS))), locked(pairs)
    shape = len(rows), len(pairs)
    value, low, nearest = np.empty(shape), np.empty(shape), np.empty((*shape, 2, 3))
    memory = work_arrays_for_pieces()
    seconds = best_seconds(
        lambda: least_distances(rows, still, numbers, precision, together, *memory, value, low, nearest), RUNS
    )
    return seconds / len(rows), value, low


def pairs_of_cables() -> Iterator[Row]:
    """Distances of two sagging cables, and of all pairs of a pose."""
    for name in ROBOTS:
        state = states(name)
        rows = locked(cable_rows(state, np.zeros(1)))
        pairs = all_pairs(8)
        for precision, reach in ((1e-3, 3), (1e-4, 5)):
            seconds, value, low = measured(rows, pairs, precision)
            yield Row(
                f"two sagging cables of {name}, certified to {1e3 * precision:g} mm",
                f"<= {reach} us per pair" + (", 28 pairs <= 60 us" if precision == 1e-4 else ""),
                f"{1e6 * seconds / 28:.2f} us, {1e6 * seconds:.1f} us per pose, {1e3 * (value - low).max():.3g} mm",
            )
        seconds, _, _ = measured(rows, pairs, 1e-4, together=True)
        yield Row(f"the nearest of all 28 pairs of {name}", "", f"{1e6 * seconds:.1f} us per pose")


def brute_force() -> Iterator[Row]:
    """The sixty nearest pairs of four robots, compared with dense samples and a simplex search."""
    worst = agreement(nearest_cable_pairs())
    yield Row("60 nearest cable pairs, compared with 1,501 x 1,501 points and simplex", "1e-12 m", f"{worst:.0e} m")


def obstacles() -> Iterator[Row]:
    """Distances between cables and obstacles."""
    state = states("cogiro")
    robot = state.one_robot
    around = (
        sl.Box([1.0, 2.0, 1.0], [3.0, 1.0, 0.5]),
        sl.Sphere([-2.0, 1.0, 1.0], 0.2),
        sl.Capsule([4, 0, 0], [4, 0, 4], 0.1),
    )
    alone = best_seconds(lambda: ClearanceRows(robot).distances(state), RUNS)
    rows = ClearanceRows(robot, around)
    seconds = best_seconds(lambda: rows.distances(state), RUNS) - alone
    yield Row(
        "distance of a cable and a box, a ball or a rod, to 0.1 mm", "", f"{1e6 * seconds / len(state) / 24:.2f} us"
    )
    meshed = ClearanceRows(robot, (box_mesh([1.0, 2.0, 1.0], [3.0, 1.0, 0.5]),))
    some = state[:20]
    seconds = best_seconds(lambda: meshed.distances(some), 3)
    yield Row(
        "distance of a cable and a mesh of 12 triangles, to 0.1 mm", "", f"{1e6 * seconds / len(some) / 8:.0f} us"
    )


PARTS = (pairs_of_cables, brute_force, obstacles)

if __name__ == "__main__":
    print_table("Least distances", PARTS)
