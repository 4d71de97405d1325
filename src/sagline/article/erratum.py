"""An erratum of the article with the numbers that show it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple


class Quantity(NamedTuple):
    """A computed number."""

    label: str
    value: float
    unit: str  # its unit; "" for none
    size: float = 0.0  # of what it is a difference, in the unit: tells rounding from a small number. 0 where it is none


@dataclass(frozen=True, slots=True, eq=False)
class Erratum:
    """An erratum of the article, with the computation that shows it."""

    number: int  # as in docs/errata.md
    title: str
    printed: str  # what the article says, and where
    right: str  # what is right
    numbers: tuple[Quantity, ...]  # what the demonstration computes

    def __getitem__(self, label: str) -> float:
        """The number of a label."""
        return next(quantity.value for quantity in self.numbers if quantity.label == label)
