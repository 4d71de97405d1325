"""Calls of entries, recorded while the package runs, and repeated with other back ends."""

from __future__ import annotations

import ctypes
import importlib
import os
import pkgutil
import sys
from collections import defaultdict
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from functools import cache, partial
from pathlib import Path
from types import SimpleNamespace
from typing import Any, NamedTuple
from unittest.mock import patch

import numpy as np

import sagline
from sagline.kernels import jit
from sagline.share.packing import described_calls
from tests.share.programs import in_node
from tests.translate.library import Entry, copied
from tools.translate import wasm
from tools.translate.signatures import SIGNATURES, functions
from tools.translate.types import NONE, ArrayType, Scalar, Type, plain_tuple

CALLERS = (
    "article",
    "cables",
    "calibration",
    "dynamics",
    "interference",
    "kinematics",
    "motion",
    "optimization",
    "robot",
    "share",
    "statics",
    "tension",
    "workspaces",
)
INPUTS = "tests.translate.inputs"  # calls entries that only C calls


class Call(NamedTuple):
    """A call of an entry: its name, that in C, the types of its arguments, and copies of them before and after."""

    name: str
    symbol: str
    types: tuple[Type, ...]
    before: tuple[Any, ...]
    after: tuple[Any, ...]
    result: Any

    @property
    def returned(self) -> Scalar | None:
        """Type of the result."""
        return None if self.result is None else Scalar.BOOL if isinstance(self.result, bool) else Scalar.INT


Run = Callable[[Call, tuple[Any, ...]], Any]  # runs a call with its arguments and writes to them


class Difference(NamedTuple):
    """Comparison of calls.

    Attributes:
        calls: Number of calls.
        compared: Numbers that were written.
        different: Numbers that are not equal to the last bit.
        largest: Largest difference, relative for numbers above 1; infinite if a code, an integer or NaN differs.
    """

    calls: int = 0
    compared: int = 0
    different: int = 0
    largest: float = 0.0

    def joined(self, other: Difference) -> Difference:
        """Both comparisons together."""
        calls, compared, different = (one + two for one, two in zip(self[:3], other[:3], strict=True))
        return Difference(calls, compared, different, max(self.largest, other.largest))


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
    """Declared name in C and declared types of an entry for the arguments."""
    for key, types in SIGNATURES[name].items():
        if fits(arguments, plain_tuple(*types)):
            return f"sagline_{name}{f'_{key}' if key else ''}", types
    raise AssertionError(f"tools/translate/signatures.py has no set of types for these arguments of {name}")


@cache
def load_callers() -> None:
    """Load all modules that may call entries."""
    for folder in CALLERS:
        package = importlib.import_module(f"sagline.{folder}")
        for each in pkgutil.walk_packages(package.__path__, f"sagline.{folder}."):
            importlib.import_module(each.name)


@contextmanager
def recorded() -> Iterator[list[Call]]:
    """Record the calls of all entries from outside of the kernels."""
    load_callers()
    calls: list[Call] = []
    entries: dict[int, tuple[str, Any]] = {}  # by identity of the owners

    def listener(name: str, entry: Any) -> Any:
        def call(*arguments: Any) -> Any:
            before = copied(arguments)
            result = entry(*arguments)
            calls.append(Call(name, *signature_of(name, arguments), before, copied(arguments), result))
            return result

        return call

    def bound(entry: Any, *arguments: Any, numbers: int = 0) -> Any:
        return partial(listener(*entries[id(entry)]), *arguments[: len(arguments) - numbers])

    instead: dict[int, Any] = {id(jit.bound): bound}
    for name, function in functions().items():
        module = sys.modules[function.__module__]
        entry = getattr(module, name)
        instead[id(entry)] = listener(name, entry)
        instead.setdefault(id(module), SimpleNamespace(**vars(module)))
        setattr(instead[id(module)], name, instead[id(entry)])
        entries[id(entry)] = entries[id(instead[id(entry)])] = name, entry
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
    """Modules outside of the kernels and their classes, which may contain an entry under another name."""
    for key, module in list(sys.modules.items()):
        if key == INPUTS or (key.startswith("sagline.") and not key.startswith("sagline.kernels")):
            yield module
            yield from (each for each in vars(module).values() if isinstance(each, type) and each.__module__ == key)


def difference(before: Any, expected: Any, found: Any) -> Difference:
    """Compare the arrays of one call after runs of two back ends."""
    count, different, largest = 0, 0, 0.0
    for old, one, other in zip(*map(arrays_of, (before, expected, found)), strict=True):
        unequal = ~equal(one, other)
        count += int((unequal | ~equal(old, one)).sum())
        different += int(unequal.sum())
        if unequal.any():
            largest = max(largest, relative(one[unequal], other[unequal]))
    return Difference(1, count, different, largest)


def relative(one: Any, other: Any) -> float:
    """Largest difference of numbers, relative above 1; infinite for integers, inf and NaN."""
    if one.dtype.kind not in "fc":
        return np.inf
    with np.errstate(invalid="ignore"):
        error = np.abs(one - other) / np.maximum(np.maximum(np.abs(one), np.abs(other)), 1.0)
    return float(np.where(np.isfinite(error), error, np.inf).max())


def equal(one: Any, other: Any) -> Any:
    """True where numbers are equal with the sign of zero; NaN equals NaN."""
    if one.dtype.kind == "c":
        return equal(one.real, other.real) & equal(one.imag, other.imag)
    with np.errstate(invalid="ignore"):  # memory that was not written
        same = one == other
        if one.dtype.kind == "f":
            same &= np.signbit(one) == np.signbit(other)
            same |= np.isnan(one) & np.isnan(other)
    return same


def repeat(call: Call, run: Run) -> Difference:
    """Repeat a call with a back end, and compare its outputs."""
    arguments = copied(call.before)
    assert run(call, arguments) == call.result, call.symbol
    return difference(call.before, call.after, arguments)


def compare(inputs: Callable[[], object], runs: Mapping[str, Run]) -> dict[tuple[str, str], Difference]:
    """Record the calls of inputs and repeat them; differences by back end and name of the entry in C."""
    found: dict[tuple[str, str], Difference] = defaultdict(Difference)
    with recorded() as calls:
        inputs()
    for call in calls:
        for backend, run in runs.items():
            key = backend, call.symbol
            found[key] = found[key].joined(repeat(call, run))
    return dict(found)


def from_library(library: ctypes.CDLL) -> Run:
    """Calls of the C of the translator."""

    def run(call: Call, arguments: tuple[Any, ...]) -> Any:
        return Entry(library, call.symbol, call.types, call.returned)(*arguments)

    return run


def from_kernels(backend: str) -> Run:
    """Calls of the entries of the package with a back end, from a second copy of the kernels."""
    own: dict[str, Any] = {}
    places = {name: each.__module__ for name, each in functions().items()}
    with in_the_place_of_the_kernels(own), patch.dict(os.environ, {"SAGLINE_BACKEND": backend}):
        entries = {name: getattr(importlib.import_module(module), name) for name, module in places.items()}

    def run(call: Call, arguments: tuple[Any, ...]) -> Any:
        with in_the_place_of_the_kernels(own):  # numba finds types by the names of their modules
            return entries[call.name](*arguments)

    return run


@contextmanager
def in_the_place_of_the_kernels(modules: dict[str, Any]) -> Iterator[None]:
    """Replace the modules `sagline.kernels` by the given ones, and add newly loaded modules to them."""
    package = sagline.kernels
    present = removed_kernels()
    sys.modules.update(modules)
    try:
        yield
    finally:
        modules.update(removed_kernels())
        sys.modules.update(present)
        sagline.kernels = package


def removed_kernels() -> dict[str, Any]:
    """Remove the modules of the kernels from the loaded ones."""
    return {key: sys.modules.pop(key) for key in list(sys.modules) if f"{key}.".startswith("sagline.kernels.")}


def from_wasm(folder: Path) -> Run:
    """Calls of the WebAssembly module of shared pages, each in a process of node."""

    def run(call: Call, arguments: tuple[Any, ...]) -> Any:
        arrays = {str(k): each for k, each in enumerate(arrays_of(arguments))}
        kept = [each.flags.writeable for each in arrays.values()]
        for each in arrays.values():
            each.flags.writeable = False  # such arrays keep their values
        entry = call.symbol.removeprefix(wasm.PREFIX)
        kernels = described_calls({"entry": (entry, arguments)}, arrays)
        memory = in_node({"kernels": kernels}, [{}])
        for (name, each), flag in zip(arrays.items(), kept, strict=True):
            kind, place, count = kernels["arrays"][name]
            each.flags.writeable = True
            each.reshape(-1)[:] = np.frombuffer(memory, kind, count, place)
            each.flags.writeable = flag
        return call.result

    return run
