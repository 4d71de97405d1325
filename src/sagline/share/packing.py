"""Encoding of samples for page/states.js: whole numbers, their differences in time, and deflate."""

from __future__ import annotations

import zlib
from base64 import b64encode
from collections.abc import Sequence
from typing import Final, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from sagline.core.arrays import Array

Codes = NDArray[np.int64]

_ORDERS: Final = (0, 1, 2, 3)  # possible orders of differences; the order that gives the smallest data is used
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
        described.append(
            {"name": channel.name, "scale": channel.scale, "step": channel.step, "nothing": nothing, "columns": columns}
        )
    text = b64encode(zlib.compress(b"".join(planes), _LEVEL)).decode("ascii")
    return {"count": len(channels[0].values), "channels": described}, text


def _codes(channel: PackedColumn, values: Array) -> tuple[Codes, int | None]:
    """Round values to whole numbers of steps. The code of a missing value is also returned (None if not needed)."""
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


def _least(column: Codes) -> tuple[int, int, Codes]:
    """Order with the smallest differences, their size [bytes], and the differences with the signs in the lowest bit."""
    found = []
    for order in _ORDERS:
        rest = column
        for _ in range(order):
            rest = np.diff(rest, prepend=0)
        found.append(np.where(rest < 0, -2 * rest - 1, 2 * rest))
    order = int(np.argmin([np.log1p(code).sum() for code in found]))
    return order, max(1, (int(found[order].max()).bit_length() + 7) // 8), found[order]


def _planes(codes: Codes, count: int) -> bytes:
    """Lowest bytes of all codes, then their second bytes, and so on."""
    return b"".join((codes >> (8 * plane) & 255).astype(np.uint8).tobytes() for plane in range(count))
