"""Calls of kernels from page/kernels.js: layout of the arguments in the memory of a WebAssembly module."""

from __future__ import annotations

import zlib
from base64 import b64encode
from collections.abc import Iterator, Mapping
from importlib.resources import files
from math import isfinite
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from sagline.core.errors import FileError

Call = tuple[str, tuple[Any, ...]]  # name of the C entry without prefix, and arguments as in Python
AnyArray = NDArray[Any]

MODULE: Final = files("sagline.share").joinpath("page").joinpath("kernels.wasm")
_ALIGNED: Final = 16  # bytes


def check_module() -> None:
    """Create the FileError for a missing WebAssembly module, with the command that makes the module."""
    if not MODULE.is_file():
        step = "Run python -m tools.build in the source checkout, or install a wheel of sagline."
        raise FileError(str(MODULE), "is missing, but shared pages need it", step)


def module_text() -> str:
    """Read the WebAssembly module, deflated and in base64."""
    check_module()
    return b64encode(zlib.compress(MODULE.read_bytes(), 9)).decode("ascii")


def described_calls(calls: Mapping[str, Call], names: Mapping[str, AnyArray]) -> dict[str, Any]:
    """Describe calls: addresses of all arrays, contents of write-protected arrays, and arguments in C.

    `calls`: calls by the name of the function in the page. `names`: arrays or contiguous views that the page uses.
    Arrays that are not write-protected contain zeros at the start.
    """
    places: dict[int, int] = {}  # addresses of the arrays that own memory, by identity
    filled: dict[int, str] = {}
    size = 0
    leaves = {name: list(_leaves(arguments)) for name, (_, arguments) in calls.items()}
    for array in [each for row in leaves.values() for each in row if isinstance(each, np.ndarray)]:
        owner = _owner(array)
        if id(owner) not in places:
            places[id(owner)] = size
            size += -(-owner.nbytes // _ALIGNED) * _ALIGNED
        if not array.flags.writeable:
            filled[places[id(owner)]] = b64encode(owner.tobytes("A")).decode("ascii")

    def place(array: AnyArray) -> int:
        owner = _owner(array)
        return places[id(owner)] + array.ctypes.data - owner.ctypes.data

    def flat(value: Any) -> list[Any]:
        if isinstance(value, np.ndarray):
            return [[place(value)], *(f"{size}n" for size in value.shape)]
        if isinstance(value, float):
            return [value if isfinite(value) else str(value).replace("inf", "Infinity").replace("nan", "NaN")]
        return [value if isinstance(value, bool) else f"{value}n"]

    return {
        "size": size,
        "filled": list(filled.items()),
        "arrays": {name: (array.dtype.name, place(array), array.size) for name, array in names.items()},
        "calls": {
            name: (calls[name][0], [part for leaf in row for part in flat(leaf)]) for name, row in leaves.items()
        },
    }


def _leaves(value: Any) -> Iterator[Any]:
    """Arrays and numbers of nested tuples, in order. None is omitted, because None is not an argument in C."""
    if isinstance(value, tuple):
        for each in value:
            yield from _leaves(each)
    elif value is not None:
        yield value


def _owner(array: AnyArray) -> AnyArray:
    """The array that owns the memory of a view."""
    while isinstance(array.base, np.ndarray):
        array = array.base
    return array
