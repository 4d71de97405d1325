"""Calls of entries, recorded while the package runs, and repeated in C."""

from __future__ import annotations

import ctypes
import importlib
import pkgutil
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from sagline.kernels import jit
from tests.translate.library import Entry, copied
from tools.translate.signatures import SIGNATURES, functions
from tools.translate.types import NONE, ArrayType, Scalar, Type, plain_tuple

CALLERS = ("statics", "tension", "kinematics", "calibration", "dynamics", "interference", "workspaces", "cables")


class Call(NamedTuple):
    """A call of an entry: its name in C, the types of its arguments, and copies of them before and after."""

    symbol: str
    types: tuple[Type, ...]
    before: tuple[Any, ...]
    after: tuple[Any, ...]
    result: Any

    @property
    def returned(self) -> Scalar | None:
        """Type of the result."""
        return None if self.result is None else Scalar.BOOL if isinstance(self.result, bool) else Scalar.INT


class Difference(NamedTuple):
    """Numbers that were compared, how many are not equal to the last bit, and the largest relative difference."""

    compared: int
    different: int
    largest: float


def arrays_of(value: Any) -> Iterator[np.ndarray[Any, Any]]:
    """All arrays of an argument."""
    if isinstance(value, np.ndarray):
        yield value
    elif isinstance(value, tuple):
        for each in value:
            yield from arrays_of(each)


def fits(value: Any, type_: Type) -> bool:
    """True if an argument is of a type."""
    if type_ == NONE:
        return value is None
    if isinstance(type_, Scalar):
        return isinstance(value, bool | int | float | np.integer | np.floating)
    if isinstance(type_, ArrayType):
        complex_ = type_.element.scalar is Scalar.COMPLEX
        return isinstance(value, np.ndarray) and value.ndim == type_.rank and complex_ == (value.dtype.kind == "c")
    same = isinstance(value, tuple) and len(value) == len(getattr(type_, "types", ()))
    return same and all(map(fits, value, getattr(type_, "types", ())))


def signature_of(name: str, arguments: tuple[Any, ...]) -> tuple[str, tuple[Type, ...]]:
    """Name in C and types of an entry for arguments, of the declared ones."""
    for key, types in SIGNATURES[name].items():
        if fits(arguments, plain_tuple(*types)):
            return f"sagline_{name}{f'_{key}' if key else ''}", types
    raise AssertionError(f"tools/translate/signatures.py has no set of types for these arguments of {name}")


@contextmanager
def recorded() -> Iterator[list[Call]]:
    """Record the calls of all entries from outside the kernels."""
    for folder in CALLERS:
        package = importlib.import_module(f"sagline.{folder}")
        for each in pkgutil.walk_packages(package.__path__, f"sagline.{folder}."):
            importlib.import_module(each.name)
    calls: list[Call] = []
    entries = {name: getattr(importlib.import_module(each.__module__), name) for name, each in functions().items()}

    def listener(name: str, compiled: Any) -> Any:
        def call(*arguments: Any) -> Any:
            before = copied(arguments)
            result = compiled(*arguments)
            calls.append(Call(*signature_of(name, arguments), before, copied(arguments), result))
            return result

        return call

    names = {id(entry): name for name, entry in entries.items()}

    def bound(entry: Any, *arguments: Any, numbers: int = 0) -> Any:
        return partial(listener(names[id(entry)], entry), *arguments[: len(arguments) - numbers])

    instead: dict[int, Any] = {id(entry): listener(name, entry) for name, entry in entries.items()}
    instead[id(jit.bound)] = bound
    places = [(owner, name, value) for owner in _owners() for name, value in list(vars(owner).items())]
    places = [each for each in places if id(getattr(each[2], "__func__", each[2])) in instead]
    for owner, name, value in places:
        listening = instead[id(getattr(value, "__func__", value))]
        setattr(owner, name, staticmethod(listening) if isinstance(value, staticmethod) else listening)
    try:
        yield calls
    finally:
        for owner, name, value in places:
            setattr(owner, name, value)


def _owners() -> Iterator[Any]:
    """Modules outside the kernels, and their classes: what may call an entry by a name of its own."""
    for key, module in list(sys.modules.items()):
        if key.startswith("sagline.") and not key.startswith("sagline.kernels"):
            yield module
            yield from (each for each in vars(module).values() if isinstance(each, type) and each.__module__ == key)


def difference(expected: Any, found: Any) -> Difference:
    """Compare all arrays of two sets of arguments; codes and integers that differ count as infinite."""
    count, different, largest = 0, 0, 0.0
    for one, other in zip(arrays_of(expected), arrays_of(found), strict=True):
        with np.errstate(invalid="ignore"):  # memory that nobody has written
            unequal = ~((one == other) | ((one != one) & (other != other)))
        count += one.size
        different += int(unequal.sum())
        if one.dtype.kind not in "fc":
            largest = np.inf if unequal.any() else largest
        elif unequal.any():
            a, b = one[unequal], other[unequal]
            error = np.abs(a - b) / np.maximum(np.maximum(np.abs(a), np.abs(b)), 1.0)
            largest = max(largest, float(np.where(np.isnan(error), np.inf, error).max()))
    return Difference(count, different, largest)


def repeat(call: Call, library: ctypes.CDLL) -> Difference:
    """Repeat a call in C and compare what it wrote with what the compiled Python wrote."""
    arguments = copied(call.before)
    code, returned = Entry(library, call.symbol, call.types, call.returned).code(*arguments)
    assert (code, returned) == (0, call.result)
    return difference(call.after, arguments)
