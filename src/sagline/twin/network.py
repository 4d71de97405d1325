"""The way between a controller and the PLCs on the lockstep clock: late, uneven, with losses, and all of it seeded."""

from __future__ import annotations

from heapq import heappop, heappush
from typing import Any, Final

import numpy as np

from sagline.core.arrays import number
from sagline.core.errors import InvalidValueError

TINY: Final = 1e-9  # s, of rounding


class Network:
    """How late messages arrive, and which do not.

    Attributes:
        ideal: Whether each arrives at once.
    """

    def __init__(self, delay: float, jitter: float, loss: float, seed: int) -> None:
        """Say how it is.

        Args:
            delay: Of every message, each way [s], >= 0.
            jitter: On top of it, evenly between 0 and this [s], >= 0; messages may overtake each other.
            loss: Share of the messages that are lost, >= 0, < 1.
            seed: Of all this; the generator is the network's own.

        Raises:
            InvalidValueError: If a value is out of its range.
        """
        self._delay = number(delay, "delay", "s", low=0.0)
        self._jitter = number(jitter, "jitter", "s", low=0.0)
        self._loss = number(loss, "loss", "", low=0.0)
        if self._loss >= 1.0:
            raise InvalidValueError("loss", f"{loss:g}", ">= 0, < 1", "Give the share, 0.01 for 1 %.")
        self.ideal = not (self._delay or self._jitter or self._loss)
        self._generator = np.random.default_rng((seed, 1))

    def arrival(self, now: float) -> float | None:
        """When a message that is sent now arrives [s]; None if it is lost."""
        if self.ideal:
            return now
        lost, late = self._generator.random(2)
        return None if lost < self._loss else now + self._delay + late * self._jitter


class Way:
    """Messages that are on their way from one to another."""

    def __init__(self, network: Network) -> None:
        """Begin empty."""
        self._network, self._sent = network, 0
        self._messages: list[tuple[float, int, Any]] = []

    def send(self, now: float, message: Any) -> None:
        """Send a message [s]."""
        if (arrival := self._network.arrival(now)) is not None:
            self._sent += 1
            heappush(self._messages, (arrival, self._sent, message))

    def arrived(self, now: float) -> list[tuple[float, Any]]:
        """All that has arrived by now [s], the earliest first: when, and what."""
        found = []
        while self._messages and self._messages[0][0] <= now + TINY:
            arrival, _, message = heappop(self._messages)
            found.append((arrival, message))
        return found
