"""Bounds of integers as polynomials in n, the degrees of freedom, and r, the redundant cables: m = n + r cables.

Both are nonnegative. The larger coefficient of each term therefore gives an upper bound of two polynomials.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass


@dataclass(frozen=True)
class Polynomial:
    """Terms ((power of n, power of r), coefficient), sorted, none of them zero."""

    terms: tuple[tuple[tuple[int, int], int], ...] = ()

    def _combined(self, other: Polynomial, rule: Callable[[int, int], int]) -> Polynomial:
        one, two = dict(self.terms), dict(other.terms)
        return polynomial({power: rule(one.get(power, 0), two.get(power, 0)) for power in {*one, *two}})

    def __add__(self, other: Polynomial) -> Polynomial:
        """Sum."""
        return self._combined(other, lambda a, b: a + b)

    def __sub__(self, other: Polynomial) -> Polynomial:
        """Difference."""
        return self._combined(other, lambda a, b: a - b)

    def __mul__(self, other: Polynomial) -> Polynomial:
        """Product."""
        found: dict[tuple[int, int], int] = {}
        for (i, j), a in self.terms:
            for (k, m), b in other.terms:
                found[i + k, j + m] = found.get((i + k, j + m), 0) + a * b
        return polynomial(found)

    def most(self, other: Polynomial) -> Polynomial:
        """Upper bound of both polynomials."""
        return self._combined(other, max)

    def least(self, other: Polynomial) -> Polynomial:
        """Lower bound of both polynomials."""
        return self._combined(other, min)


def polynomial(terms: dict[tuple[int, int], int]) -> Polynomial:
    """A polynomial of terms in any order."""
    return Polynomial(tuple(sorted((power, value) for power, value in terms.items() if value)))


def constant(value: int) -> Polynomial:
    """A polynomial without variables."""
    return polynomial({(0, 0): value})


def evaluated(bound: Polynomial, freedoms: int, redundant: int) -> int:
    """Value for a robot."""
    return sum(value * freedoms**i * redundant**j for (i, j), value in bound.terms)


ZERO, ONE = constant(0), constant(1)
FREEDOMS, CABLES = polynomial({(1, 0): 1}), polynomial({(1, 0): 1, (0, 1): 1})


@dataclass(frozen=True)
class Int:
    """An integer between two bounds; None for an unknown one."""

    low: Polynomial | None = None
    high: Polynomial | None = None

    @property
    def known(self) -> int | None:
        """The value, if both bounds are the same constant."""
        terms = self.low.terms if self.low is not None and self.low == self.high else None
        if terms is None or any(power != (0, 0) for power, _ in terms):
            return None
        return terms[0][1] if terms else 0


@dataclass(frozen=True)
class Other:
    """A float, a truth value, or None; with the value if it is known."""

    kind: str
    value: bool | None = None


@dataclass(frozen=True)
class Array:
    """An array: its sizes, True for floats; place in the work memory, if it is a part that no array was taken from."""

    sizes: tuple[Int, ...]
    floating: bool
    memory: str = ""
    start: Polynomial = ZERO


@dataclass(frozen=True)
class Record:
    """A tuple or NamedTuple."""

    fields: tuple[str, ...]
    items: tuple[Value, ...]


Value = Int | Other | Array | Record
FLOAT, FLAG, NOTHING = Other("float"), Other("flag"), Other("none")


def exactly(value: int | Polynomial) -> Int:
    """An integer that is known."""
    bound = constant(value) if isinstance(value, int) else value
    return Int(bound, bound)


def joined(one: Value | None, other: Value) -> Value:
    """A value that holds both."""
    if one is None or one in (other, NOTHING):
        return other
    if other == NOTHING:
        return one
    if isinstance(one, Int) and isinstance(other, Int):
        low = None if one.low is None or other.low is None else one.low.least(other.low)
        high = None if one.high is None or other.high is None else one.high.most(other.high)
        return Int(low, high)
    if isinstance(one, Array) and isinstance(other, Array):
        pairs = zip(one.sizes, other.sizes, strict=True)
        sizes = tuple(Int(*_bounds(joined(*pair))) for pair in pairs)
        return Array(sizes, one.floating)
    if isinstance(one, Record) and isinstance(other, Record):
        pairs_ = zip(one.items, other.items, strict=True)
        return Record(one.fields, tuple(joined(*pair) for pair in pairs_))
    if isinstance(one, Other) and isinstance(other, Other) and one.kind == other.kind:
        return Other(one.kind)
    return FLOAT if FLOAT in (one, other) else FLAG


def _bounds(value: Value) -> tuple[Polynomial | None, Polynomial | None]:
    assert isinstance(value, Int)
    return value.low, value.high


def widened(old: Value, new: Value) -> Value:
    """The new value, without the bounds of integers that have changed."""
    if isinstance(old, Int) and isinstance(new, Int):
        return Int(new.low if new.low == old.low else None, new.high if new.high == old.high else None)
    if isinstance(old, Record) and isinstance(new, Record):
        pairs = zip(old.items, new.items, strict=True)
        return Record(new.fields, tuple(widened(*pair) for pair in pairs))
    return new
