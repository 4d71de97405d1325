"""Lossless compression of columns of numbers, and of data sets inside other files."""

# Measured and planned values are smooth in time. Each column is converted to integers. If all values have few digits
# after the point, the integers are the values times a power of ten. Otherwise the integers are the bits of the floats,
# changed so that larger numbers have larger integers. The integers are stored as differences of order 0 to 5; the order
# with the fewest bits is selected. The upper bytes of the differences are nearly all zero. Bytes of equal weight are
# stored together, because zstandard then compresses them strongly.

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from math import prod
from typing import TYPE_CHECKING, Any, Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from sagline.core.arguments import check_memory

if TYPE_CHECKING:
    from xarray import Dataset

MOST_ORDER: Final = 5
LEVEL: Final = 9  # compression level of zstandard; higher levels take much longer and save little
TYPES: Final = ("float64", "int64", "int8", "bool")
_EXACT: Final = 2.0**53  # all integers below this number are exact as floats
_GAPS: Final = np.iinfo(np.int64).min + np.arange(3)  # codes of NaN, infinity, -infinity in a column of decimals
_GAP_VALUES: Final = np.array([np.nan, np.inf, -np.inf])


# Head of a packed column: name; type and shape of the values; largest number of decimals (-1 for integers or bits of
# floats); order of the stored differences
_Column: TypeAlias = tuple[str, str, tuple[int, ...], int, int]


def round_decimals(values: NDArray[np.float64], decimals: int) -> NDArray[np.float64]:
    """Round numbers to `decimals`. Each result is the float nearest to the rounded decimal number, and never -0.0."""
    scale = 10.0**decimals
    whole = np.abs(values) < _EXACT / scale  # a larger float does not have this number of decimals
    return np.asarray(np.where(whole, np.rint(np.where(whole, values, 0.0) * scale) / scale, values) + 0.0)  # no -0.0


def pack(
    columns: Mapping[str, NDArray[Any]], decimals: Mapping[str, int] | None = None, rest: Callable[[], Any] = int
) -> bytes:
    """Pack columns without loss. The first axis of each column is time."""
    # columns: floats, integers or flags of any shape; the first axis is time
    # decimals: expected number of decimals of each column; a column with more decimals is stored as bits
    # rest: function to call between two columns, so that other threads can run
    from zstandard import compress

    known = decimals or {}
    heads, parts = [], []
    for name, values in columns.items():
        whole, places = _whole(np.asarray(values), known.get(name, -1))
        order, small = smallest_differences(whole.reshape(len(whole) if whole.ndim else 1, -1) if whole.size else whole)
        heads.append((name, values.dtype.name, values.shape, places, order))
        courses = np.ascontiguousarray(small.T).view(np.uint8)
        parts.append(courses.reshape(-1, 8).T.tobytes())  # bytes of each column, grouped by weight
        rest()
    head = json.dumps(heads, separators=(",", ":")).encode()
    return compress(b"".join((len(head).to_bytes(4, "little"), head, *parts)), LEVEL)


def unpack(data: bytes, most: int = 1 << 62) -> dict[str, NDArray[Any]]:
    """Restore columns exactly from data that `pack` returned. `most`: largest allowed size of the columns [bytes]."""
    from zstandard import ZstdDecompressor, ZstdError, get_frame_parameters

    try:
        size = get_frame_parameters(data).content_size
    except ZstdError as error:
        raise ValueError(f"no packed columns ({error})") from None
    if size > most:
        raise ValueError(f"more than {most} bytes are packed")
    check_memory("what is packed", 3.0 * size, "Get the original file.")
    try:
        plain = ZstdDecompressor().decompress(data, allow_extra_data=False)
        start = 4 + int.from_bytes(plain[:4], "little")
        heads = json.loads(plain[4:start])
        columns: list[_Column] = [(name, kind, tuple(shape), *rest) for name, kind, shape, *rest in heads]
    except (ZstdError, TypeError, ValueError) as error:  # reading JSON can also raise ValueError
        raise ValueError(f"no packed columns ({error})") from None
    found: dict[str, NDArray[Any]] = {}
    for column in columns:
        end = start + 8 * _count(column)
        if end > len(plain):
            raise ValueError(f"column {column[0]!r} is cut off")
        found[column[0]] = _values(column, plain[start:end])
        start = end
    if start != len(plain):
        raise ValueError("the data are longer than their header states")
    return found


def _count(column: _Column) -> int:
    """Number of values of a column; raise ValueError for a head that `pack` never writes."""
    _, kind, shape, decimals, order = column
    sizes = all(0 <= size < 1 << 40 for size in shape)
    if not (kind in TYPES and sizes and order in range(MOST_ORDER + 1) and decimals in range(-1, 16)):
        raise ValueError(f"a column has an invalid header: {column}")
    return prod(shape)


def _whole(values: NDArray[Any], decimals: int) -> tuple[NDArray[np.int64], int]:
    """Values as integers, and the number of decimals that scales them; -1 for given integers or bits of floats."""
    if values.dtype.name not in TYPES:
        raise TypeError(f"columns of {values.dtype} are not packed")
    if values.dtype != np.float64:
        return values.astype(np.int64), -1
    bits = np.ascontiguousarray(values).view(np.int64).reshape(values.shape)
    if decimals < 0:
        return bits, -1
    gaps = ~np.isfinite(values)
    with np.errstate(over="ignore"):  # infinite values are stored as bits
        scaled = np.rint(np.where(gaps, 0.0, values) * 10.0**decimals)
    if not (np.abs(scaled) < _EXACT).all():
        return bits, -1
    whole = scaled.astype(np.int64)
    if gaps.any():
        whole[gaps] = _GAPS[np.where(np.isnan(values[gaps]), 0, np.where(values[gaps] > 0.0, 1, 2))]
    if not np.array_equal(_decimal(whole, decimals).view(np.int64), bits):
        return bits, -1
    return whole, decimals


def _decimal(whole: NDArray[np.int64], decimals: int) -> NDArray[np.float64]:
    values = np.asarray(whole / 10.0**decimals)  # both operands are exact: the float nearest to the decimal
    for gap, value in zip(_GAPS, _GAP_VALUES, strict=True):
        values[whole == gap] = value
    return values


def smallest_differences(whole: NDArray[np.int64], most: int = MOST_ORDER) -> tuple[int, NDArray[np.uint64]]:
    """Order up to `most` of the differences with the fewest bits, and these differences; the lowest bit is the sign."""
    best: tuple[float, int, NDArray[np.uint64]] | None = None
    for order in range(most + 1):
        small = ((whole << 1) ^ (whole >> 63)).view(np.uint64)
        bits = float(np.log2(small + 1.0).sum())
        if best is None or bits < best[0]:
            best = bits, order, small
        whole = np.diff(whole, axis=0, prepend=np.int64(0)) if whole.size else whole  # overflow is reversible
    assert best is not None
    return best[1], best[2]


def _values(column: _Column, planes: bytes) -> NDArray[Any]:
    _, kind, shape, decimals, order = column
    rows = shape[0] if shape else 1
    packed = np.frombuffer(planes, dtype=np.uint8).reshape(8, -1).T
    small = np.ascontiguousarray(packed).view(np.uint64).reshape(-1, rows).T if packed.size else np.empty(0, np.uint64)
    whole = (small >> np.uint64(1)).view(np.int64) ^ -(small & np.uint64(1)).view(np.int64)
    for _ in range(order):
        whole = np.cumsum(whole, axis=0)
    whole = np.ascontiguousarray(whole).reshape(shape)
    if kind != "float64":
        return whole.astype(kind)
    return whole.view(np.float64) if decimals < 0 else _decimal(whole, decimals)


def pack_dataset(data: Dataset) -> bytes:
    """Pack a data set without loss."""
    numbers: dict[str, Any] = {}
    variables: dict[str, Any] = {}
    for name, variable in data.variables.items():
        values = np.asarray(variable.values)
        labels = None if values.dtype.name in TYPES else values.tolist()
        if labels is None:
            numbers[str(name)] = values
        variables[str(name)] = [variable.dims, variable.attrs, labels]
    # JSON cannot store numbers and arrays of numpy, which are therefore converted
    head = json.dumps({"attributes": data.attrs, "variables": variables}, default=lambda value: value.tolist())
    text = head.encode()
    return b"".join((len(text).to_bytes(4, "little"), text, pack(numbers)))


def unpack_dataset(data: bytes) -> Dataset:
    """Restore a data set that `pack_dataset` packed."""
    from xarray import Coordinates, Dataset

    end = 4 + int.from_bytes(data[:4], "little")
    try:
        head = json.loads(data[4:end])
        numbers = unpack(data[end:])
        coordinates: dict[str, Any] = {}
        variables: dict[str, Any] = {}
        for name, (dimensions, attributes, labels) in head["variables"].items():
            values = numbers[name] if labels is None else labels
            part = coordinates if name in dimensions or name == "time" else variables
            part[name] = (tuple(dimensions), values, attributes)
        return Dataset(variables, Coordinates(coordinates, indexes={}), head["attributes"])
    except (AttributeError, KeyError, TypeError, UnicodeDecodeError, json.JSONDecodeError) as error:
        raise ValueError(f"no packed data set ({error})") from None
