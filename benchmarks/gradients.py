"""Times of the functions for JAX and PyTorch and of their gradients; one table, one core.

python -m benchmarks.gradients
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
from importlib.util import find_spec
from typing import Any

import jax
import numpy as np
from rich.console import Console

import sagline as sl
import sagline.jax as sj
from benchmarks.measure import Row, best_of_calls, best_seconds, one_core, show
from sagline.core.arrays import Array

BATCH = 1000
REPEATS = 40  # so that one of them is without other programs
Times = tuple[float, float]  # of one call, and per sample of a batch [s]


def times_in_jax(call: Callable[..., Any], given: Array, gradient: bool) -> Times:
    """Times of a function of one sample, or of its gradient."""
    slope = jax.grad(call) if gradient else call
    alone, batch = jax.jit(slope), jax.jit(jax.vmap(slope))
    one, many = jax.numpy.asarray(given), jax.numpy.tile(given, (BATCH, 1))
    return (
        best_of_calls(lambda: jax.block_until_ready(alone(one)), calls=100),
        best_seconds(lambda: jax.block_until_ready(batch(many)), REPEATS) / BATCH,
    )


def times_in_torch(call: Callable[..., Any], given: Array, gradient: bool) -> Times:
    """Times of a function of batches, or of its gradient."""
    import torch

    torch.set_num_threads(1)
    one = torch.tensor(given, requires_grad=gradient)
    many = torch.tensor(np.tile(given, (BATCH, 1)), requires_grad=gradient)

    def run(values: Any) -> None:
        found = call(values)
        if gradient:
            torch.autograd.grad(found.sum(), values)

    return best_of_calls(lambda: run(one), calls=3, repeats=100), best_seconds(lambda: run(many), REPEATS) / BATCH


def rows() -> Iterator[Row]:
    """The rows of the table."""
    jax.config.update("jax_enable_x64", True)
    robot, pose = sl.load_robot("cogiro"), sl.Pose.from_euler((1.0, 0.5, 1.5), 0.1, 0.0, 0.2)
    lengths, place = np.array(sl.inverse(robot, pose).unstrained_length), np.array(pose.position)
    hosts: list[tuple[str, Any, Callable[..., Times]]] = [("JAX", sj, times_in_jax)]
    if find_spec("torch") is not None:
        import sagline.torch

        hosts.append(("PyTorch", sagline.torch, times_in_torch))

    def height(host: Any, lengths: Any) -> Any:
        return host.forward(robot, lengths, pose).position[..., 2]

    def tension(host: Any, position: Any) -> Any:
        found = host.inverse(robot, host.Forward(position, pose.quaternion, None)).tension
        return found.max() if host is sj else found.amax(-1)

    for name, call, given, gradient, target in (
        ("height of the forward kinematics", height, lengths, False, ""),
        ("its gradient by the lengths", height, lengths, True, "JAX ≤ 25 µs"),
        ("largest tension of the inverse kinematics", tension, place, False, ""),
        ("its gradient by the position", tension, place, True, ""),
    ):
        found = {host: times(partial(call, module), given, gradient) for host, module, times in hosts}
        texts = [f"{host} {1e6 * one:.0f} µs; {1e6 * each:.1f} µs" for host, (one, each) in found.items()]
        if len(found) > 1:
            one, each = np.divide(found["PyTorch"], found["JAX"])
            texts.append(f"ratio {one:.1f}; {each:.1f}")
        yield Row(f"CoGiRo, {name}: one call; per sample of a batch", target, " / ".join(texts))


if __name__ == "__main__":
    one_core()
    show("functions for JAX and PyTorch, one core", list(rows()), Console())
