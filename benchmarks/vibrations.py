"""Vibrations of robots with cable mass: comparisons and times; one core."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

import numpy as np

import sagline as sl
from benchmarks.measure import Row, best_seconds, print_table
from sagline.dynamics.vibration.robot_modes import ReducedModel, VibrationModel
from tests.dynamics.states import at, middle
from tests.dynamics.vibration.test_vibration import LOWEST_SIX
from tests.kernels.dynamics.strings import chain, held, string
from tests.kernels.dynamics.test_collocation import CABLES, extrapolated, irvine_errors

UP_TO: Final = 20.0  # [Hz]


def cables() -> Iterator[Row]:
    """One cable: frequencies with fixed ends, compared with closed forms and chains of springs."""
    table = string(30.0, 40.0, 7.0, 0.1, 1e6)
    table[0, 3] = 0.0
    exact = np.sqrt(50.0 / (0.1 * (1.0 + 50.0 / 1e6))) / 14.0
    worst = max(abs(held(table, n, plane) / (n * exact) - 1.0) for n in (1, 2, 9, 40) for plane in (0, 1))
    yield Row("taut string, four frequencies", "1e-12", f"{worst:.0e}")
    errors = ", ".join(f"{error:.1e}" for error in irvine_errors())
    yield Row("Irvine's first symmetric frequency, sag over span 0.02 to 0.0025", "falls 4 x", errors)
    for name, table in CABLES.items():
        exact_three = np.array([held(table, n, 0) for n in (1, 2, 3)])
        rough = np.array([np.sqrt(chain(table, n).squares(0)[:3]) / (2.0 * np.pi) for n in (80, 160, 320)])
        at_160, limit = (np.abs(one / exact_three - 1.0).max() for one in (rough[1], extrapolated(rough)))
        reach = "1e-6 extrapolated" if name != "almost folded" else "3e-5 extrapolated"
        yield Row(f"chain of springs, {name} cable", reach, f"{at_160:.1e} at 160 elements, {limit:.0e} extrapolated")


def robots() -> Iterator[Row]:
    """Robots, compared with stored finite elements, with the exact count and with other element sizes."""
    for position, expected in LOWEST_SIX.items():
        found = sl.vibration(at("article-suspended", position), up_to=3.0).frequency[:6]
        off = np.abs(found - expected).max()
        yield Row(f"lowest six of article-suspended at {position}, with cable mass", "1e-5 Hz", f"{off:.0e} Hz")
    state = at("cogiro", (0.0, 0.0, 2.0))
    setting, found_all = VibrationModel(state), sl.vibration(state, up_to=50.0).frequency
    limits = np.linspace(2.0, 50.0, 49)
    equal = sum(int((found_all < limit).sum()) == setting.modes_below(0, limit) for limit in limits)
    yield Row(
        "cogiro: modes and exact count, 49 frequencies to 50 Hz", "equal", f"{equal} of 49, {found_all.size} modes"
    )
    few = sl.vibration(state, up_to=UP_TO)
    off_12, off = (np.abs(few.frequency[:n] - found_all[:n]).max() for n in (12, few.count))
    size = len(ReducedModel(setting, 0, UP_TO).matrix)
    shown = f"{off_12:.0e} Hz; all {few.count}: {off:.0e} Hz, {size} unknowns"
    yield Row("cogiro: lowest twelve frequencies, with modes up to 20 Hz and up to 50 Hz", "1e-5 Hz", shown)


def speed() -> Iterator[Row]:
    """Times of vibrations, maps and responses."""
    for name in ("cogiro", "article-suspended"):
        state = middle(name)
        setting = VibrationModel(state)
        taken = 1e3 * best_seconds(lambda state=state: sl.vibration(state, up_to=UP_TO), 40)  # type: ignore[misc]
        matrix = ReducedModel(setting, 0, UP_TO).matrix
        alone = 1e3 * best_seconds(lambda matrix=matrix: np.linalg.eigh(matrix), 40)  # type: ignore[misc]
        shown = f"{taken:.1f} ms, of which {alone:.1f} ms for the eigenvalues of {len(matrix)} unknowns"
        yield Row(f"{name}: vibration up to 20 Hz", "<= 3 ms" if name == "cogiro" else "none", shown)
    places = np.random.default_rng(0).uniform([-3, -2, 1], [3, 2, 3], (64, 3))
    poses, robot = sl.Pose.from_euler(places, 0, 0, 0), sl.load_robot("cogiro")
    taken = 1e3 * best_seconds(lambda: sl.frequency_map(robot, poses, up_to=UP_TO)) / len(poses)
    yield Row("cogiro: one pose of a map, up to 20 Hz", "<= 3 ms", f"{taken:.1f} ms")
    frequency = np.linspace(1.0, UP_TO, 1000)
    for words, damping in (("modal", sl.Damping(modal_damping=0.01)), ("stretch", sl.Damping(loss_time=1e-4))):
        found = sl.frequency_response(state := middle("cogiro"), frequency, damping)
        taken = best_seconds(
            lambda damping=damping, state=state: sl.frequency_response(state, frequency, damping)  # type: ignore[misc]
        )
        shown = f"{taken:.2f} s, off by {found.deviation.max():.0e} at {found.deviation.size} of them"
        yield Row(f"cogiro: response at 1,000 frequencies to 20 Hz, {words} damping", "none", shown)


PARTS = (cables, robots, speed)

if __name__ == "__main__":
    print_table("Vibrations", PARTS)
