"""Times of the functions for JAX and of their gradients; one table, one core.

python -m benchmarks.gradients
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
from typing import Any

import jax
import numpy as np
from rich.console import Console

import sagline as sl
import sagline.jax as sj
from benchmarks.measure import Row, best_of_calls, best_seconds, one_core, show

BATCH = 1000


def times(call: Callable[..., Any], *given: Any) -> str:
    """Time of one call, and time per sample of a batch."""
    alone, batch = jax.jit(call), jax.jit(jax.vmap(call))
    many = [jax.numpy.tile(array, (BATCH, 1)) for array in given]
    one = best_of_calls(lambda: jax.block_until_ready(alone(*given)), calls=100)
    all_ = best_seconds(lambda: jax.block_until_ready(batch(*many))) / BATCH
    return f"{1e6 * one:.0f} µs; {1e6 * all_:.1f} µs"


def rows() -> Iterator[Row]:
    """The rows of the table."""
    jax.config.update("jax_enable_x64", True)
    robot, pose = sl.load_robot("cogiro"), sl.Pose.from_euler((1.0, 0.5, 1.5), 0.1, 0.0, 0.2)
    lengths = jax.numpy.asarray(sl.inverse(robot, pose).unstrained_length)
    place = jax.numpy.asarray(np.array(pose.position))

    def height(lengths: Any) -> Any:
        return sj.forward(robot, lengths, pose).position[2]

    def tension(position: Any) -> Any:
        return sj.inverse(robot, sj.Forward(position, pose.quaternion, None)).tension.max()

    for name, call, given, target in (
        ("height of the forward kinematics", height, lengths, ""),
        ("its gradient by the lengths", jax.grad(height), lengths, "≤ 25 µs"),
        ("largest tension of the inverse kinematics", tension, place, ""),
        ("its gradient by the position", jax.grad(tension), place, ""),
    ):
        yield Row(f"CoGiRo in JAX, {name}: one call; per sample of a batch", target, partial(times, call)(given))


if __name__ == "__main__":
    one_core()
    show("functions for JAX, one core", list(rows()), Console())
