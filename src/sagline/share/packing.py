"""Data of a shared page as text: calls of kernels for page/sagline.mjs, and samples for page/states.js."""

from __future__ import annotations

import zlib
from base64 import b64encode
from collections.abc import Mapping, Sequence
from importlib.resources import files
from math import isfinite
from typing import Any, Final, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from sagline.core.arrays import AnyArray, Array, leaves, owner
from sagline.core.errors import FileError
from sagline.files.packed import smallest_differences

Call = tuple[str, tuple[Any, ...]]  # name of the C entry without prefix, and arguments as in Python
PAGE: Final = files("sagline.share").joinpath("page")
MODULE: Final = PAGE.joinpath("kernels.wasm")
SCRIPT: Final = PAGE.joinpath("sagline.mjs")  # with MODULE, the package for JavaScript
EXPORTS: Final = "/* Exports:"  # the lines from here on are not for a page
_ALIGNED: Final = 16  # bytes


def check_module() -> None:
    """Raise FileError if the WebAssembly module is missing. The message has the command that makes the module."""
    if not MODULE.is_file():
        step = "Run python -m tools.build in the source checkout, or install a wheel of sagline."
        raise FileError(str(MODULE), "is missing, but shared pages need it", step)


def module_text() -> str:
    """Read the WebAssembly module, deflated and in base64."""
    check_module()
    return b64encode(zlib.compress(MODULE.read_bytes(), 9)).decode("ascii")


def page_script() -> str:
    """Read the JavaScript module for a page that opens from the disk, where no module can be imported."""
    return SCRIPT.read_text(encoding="utf-8").partition(EXPORTS)[0]


def described_calls(calls: Mapping[str, Call], names: Mapping[str, AnyArray]) -> dict[str, Any]:
    """Description of calls: addresses of all arrays, contents of write-protected arrays, and arguments in C."""
    # `calls`: calls by the name of the function in the page. `names`: arrays or contiguous views that the page uses.
    # Arrays that are not write-protected contain zeros at the start.
    places: dict[int, int] = {}  # addresses of the arrays that own memory, by identity
    filled: dict[int, str] = {}
    size = 0
    rows = {name: list(leaves(arguments)) for name, (_, arguments) in calls.items()}
    for array in [each for row in rows.values() for each in row if isinstance(each, np.ndarray)]:
        whole = owner(array)
        if id(whole) not in places:
            places[id(whole)] = size
            size += -(-whole.nbytes // _ALIGNED) * _ALIGNED
        if not array.flags.writeable:
            filled[places[id(whole)]] = b64encode(whole.tobytes("A")).decode("ascii")

    def place(array: AnyArray) -> int:
        whole = owner(array)
        return places[id(whole)] + array.ctypes.data - whole.ctypes.data

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
        "calls": {name: (calls[name][0], [part for leaf in row for part in flat(leaf)]) for name, row in rows.items()},
    }


Codes = NDArray[np.int64]

MOST_ORDER: Final = 3  # largest order of differences that page/states.js restores
_LEVEL: Final = 9


class PackedColumn(NamedTuple):
    """A quantity over time in a page."""

    name: str
    values: Array  # shape (N,) or (N, k); NaN for a missing value
    step: float  # resolution, in the unit of the values ("linear") or as a share of the value ("relative")
    scale: Literal["linear", "relative"] = "linear"  # "linear", or "relative" for values above zero


def encode_columns(channels: Sequence[PackedColumn]) -> tuple[dict[str, object], str]:
    """Description and encoded values of columns."""
    described, planes = [], []
    for channel in channels:
        values = channel.values.reshape(len(channel.values), -1)
        codes, nothing = _codes(channel, values)
        ways = [_least(column) for column in codes.T]
        planes += [_planes(code, count) for _, count, code in ways]
        columns = [(order, count) for order, count, _ in ways]
        about = {"name": channel.name, "scale": channel.scale, "step": channel.step}
        described.append({**about, "nothing": nothing, "columns": columns})
    text = b64encode(zlib.compress(b"".join(planes), _LEVEL)).decode("ascii")
    return {"count": len(channels[0].values), "channels": described}, text


def _codes(channel: PackedColumn, values: Array) -> tuple[Codes, int | None]:
    """Values rounded to whole numbers of steps, and the code of a missing value, or None if no value is missing."""
    known = np.isfinite(values)
    if channel.scale == "relative":
        known &= values > 0.0
        steps = np.log(np.where(known, values, 1.0)) / channel.step
    else:
        steps = np.where(known, values, 0.0) / channel.step
    codes = np.rint(steps).astype(np.int64)
    if known.all():
        return codes, None
    nothing = int(codes.max()) + 1
    return np.where(known, codes, nothing), nothing


def _least(column: Codes) -> tuple[int, int, NDArray[np.uint64]]:
    """Order whose differences are smallest, their size [bytes], and the differences with their signs as lowest bits."""
    order, small = smallest_differences(column, MOST_ORDER)
    return order, max(1, (int(small.max()).bit_length() + 7) // 8), small


def _planes(codes: NDArray[np.uint64], count: int) -> bytes:
    """Lowest bytes of all codes, then their second bytes, and so on."""
    return b"".join((codes >> (8 * plane) & 255).astype(np.uint8).tobytes() for plane in range(count))
