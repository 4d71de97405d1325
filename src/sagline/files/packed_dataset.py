"""A data set in few bytes, for where another file has it inside."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import numpy as np

from sagline.files.packed import TYPES, pack, unpack

if TYPE_CHECKING:
    from xarray import Dataset


def pack_dataset(data: Dataset) -> bytes:
    """A data set in few bytes.

    Args:
        data: The data set, of numbers, flags and labels.

    Returns:
        The bytes; `unpack_dataset` reads them.
    """
    numbers: dict[str, Any] = {}
    variables: dict[str, Any] = {}
    for name, variable in data.variables.items():
        values = np.asarray(variable.values)
        labels = None if values.dtype.name in TYPES else values.tolist()
        if labels is None:
            numbers[str(name)] = values
        variables[str(name)] = [variable.dims, variable.attrs, labels]
    # a plain number is no array, and JSON knows neither those of numpy
    head = json.dumps({"attributes": data.attrs, "variables": variables}, default=lambda value: value.tolist())
    text = head.encode()
    return b"".join((len(text).to_bytes(4, "little"), text, pack(numbers)))


def unpack_dataset(data: bytes) -> Dataset:
    """The data set that `pack_dataset` packed.

    Args:
        data: The bytes.

    Raises:
        ValueError: If the bytes are none of its.
        InvalidValueError: If they hold more than fits into memory.
    """
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
