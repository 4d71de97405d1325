"""The strongest answer of a platform to an oscillating force, at rest or near one of its modes."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final, TypeAlias

import numpy as np

from sagline.core.arrays import Array
from sagline.dynamics.answer import Answer
from sagline.dynamics.cable_dynamics import Complex
from sagline.dynamics.damping import Damping
from sagline.dynamics.robot_modes import Found

Forced: TypeAlias = Callable[[Array], Complex]  # displacement by force (F, 3, 3) at frequencies (F,)

LIKELY: Final = 0.4  # of the strongest answer at a mode: those near whose modes a stronger one is looked for
ROUNDS: Final = 2  # of looking more closely
CLOSER: Final = 5  # frequencies between two
WIDTHS: Final = np.linspace(-3.0, 3.0, 7)  # of half a peak, about a mode: where


def summed(found: Found, rest: Array, ratio: float) -> Forced:
    """The answer by the modes of a robot all of whose stiffness loses alike, which does not couple them.

    Args:
        found: The modes; those beyond answer as at rest.
        rest: Displacement of the center of mass by force at rest, shape (3, 3).
        ratio: Damping ratio of every mode.

    Returns:
        The answer.
    """
    natural = (2.0 * np.pi * found.frequency) ** 2
    products = (found.platform[:3, None] * found.platform[None, :3]).reshape(9, -1)
    lossy = 1.0 + 2j * ratio
    beyond = (rest - (products @ (1.0 / natural)).reshape(3, 3)) / lossy

    def answer(frequency: Array) -> Complex:
        terms = 1.0 / (lossy * natural - (2.0 * np.pi * frequency[:, None]) ** 2)
        return np.asarray(beyond + (terms @ products.T).reshape(-1, 3, 3))

    return answer


def coupled(answer: Answer, up_to: float) -> Forced:
    """The answer with losses that couple the modes.

    Args:
        answer: Of one state.
        up_to: Highest frequency that is asked for [Hz].

    Returns:
        The answer.
    """
    held = answer.held(up_to)
    return lambda frequency: answer.by_modes(frequency, held)[0][:, :3, :3]


def strongest(answer: Forced, natural: Array, ratios: Array, damping: Damping) -> tuple[float, float]:
    """Largest displacement for a force in any direction, at rest or near a mode.

    Args:
        answer: To forces.
        natural: Frequencies of the modes [Hz], shape (K,).
        ratios: Their damping ratios, which tell how wide their peaks are, shape (K,).
        damping: What takes energy out.

    Returns:
        The displacement for the force [m/N], infinite without damping; its frequency [Hz].
    """
    if damping == Damping():
        return np.inf, float(natural[0])
    around = np.concatenate(([0.0], natural))
    sizes = np.linalg.norm(answer(around), axis=(1, 2))
    likely = np.flatnonzero(sizes[1:] >= LIKELY * sizes.max())
    near = natural[likely, None] * (1.0 + ratios[likely, None] * WIDTHS)
    frequency = np.unique(np.concatenate((around[:1], near.ravel())))
    for _ in range(ROUNDS):
        found = answer(frequency)
        norms = np.sqrt(np.linalg.eigvalsh(np.swapaxes(found.conj(), -1, -2) @ found)[:, -1])
        best = int(np.argmax(norms))
        if not 0 < best < norms.size - 1:
            return float(norms[best]), float(frequency[best])
        top, before, after = (frequency[best + k] for k in (0, -1, 1))
        frequency = np.concatenate((np.linspace(before, top, CLOSER), np.linspace(top, after, CLOSER)[1:]))
    return _top(np.array((before, top, after)), norms[best - 1 : best + 2])


def _top(frequency: Array, norms: Array) -> tuple[float, float]:
    """The top of a peak through three values: near it one over their square is a parabola."""
    (before, after), flat = np.diff(frequency), norms**-2.0
    left, right = np.diff(flat) / (before, after)
    bend = (right - left) / (before + after)
    if not bend > 0.0:
        return float(norms[1]), float(frequency[1])
    slope = (left * after + right * before) / (before + after)
    off = -0.5 * slope / bend
    least = flat[1] + 0.5 * slope * off
    return float(least**-0.5), float(frequency[1] + off)
