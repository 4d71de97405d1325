"""An erratum of the article with the numbers that show it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple


class Quantity(NamedTuple):
    """A computed number.

    Attributes:
        label: What it is.
        value: The number.
        unit: Its unit; "" for none.
        size: Of what it is a difference, in the unit: tells rounding from a small number. 0 where it is none.
    """

    label: str
    value: float
    unit: str
    size: float = 0.0


@dataclass(frozen=True, slots=True, eq=False)
class Erratum:
    """An erratum of the article, with the computation that shows it.

    Attributes:
        number: As in docs/errata.md.
        title: A few words.
        printed: What the article says, and where.
        right: What is right.
        numbers: What the demonstration computes.
    """

    number: int
    title: str
    printed: str
    right: str
    numbers: tuple[Quantity, ...]

    def __getitem__(self, label: str) -> float:
        """The number of a label."""
        return next(quantity.value for quantity in self.numbers if quantity.label == label)
