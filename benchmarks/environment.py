"""Steps per second of the vectorized Gymnasium environment, on one core."""

from __future__ import annotations

from collections.abc import Iterator

import gymnasium
import numpy as np

import sagline.gymnasium
from benchmarks.measure import Row, best_seconds, print_table

ROBOTS, STEPS = 256, 50


def rows() -> Iterator[Row]:
    """Random small actions of robots that begin new episodes when the old ones end."""
    for name, target in (("cogiro", ">= 50,000"), ("fast", "none"), ("falcon-7", "none")):
        robots = gymnasium.make_vec(
            sagline.gymnasium.ID, num_envs=ROBOTS, vectorization_mode="vector_entry_point", robot=name
        )
        robots.reset(seed=0)
        actions = np.random.default_rng(0).uniform(-0.3, 0.3, (STEPS, *(robots.action_space.shape or ())))

        def run(robots: gymnasium.vector.VectorEnv = robots, actions: np.ndarray = actions) -> None:
            for action in actions:
                robots.step(action)

        seconds = best_seconds(run, 12)
        step = robots.unwrapped._episodes._machines[0]._step  # type: ignore[attr-defined]
        yield Row(
            f"{name}: steps/s of {ROBOTS} robots, {0.01 / step:.0f} time steps each",
            target,
            f"{ROBOTS * STEPS / seconds:,.0f}",
        )


if __name__ == "__main__":
    print_table("Gymnasium environment", [rows])
