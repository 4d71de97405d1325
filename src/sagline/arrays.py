"""The border between a caller's numbers and ours: float64, C-contiguous, write-locked.

Kernels compile once for each memory layout they meet, so everything that enters one
comes through here.
"""

from __future__ import annotations

from typing import Any, TypeGuard

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sagline.errors import InvalidValueError

Array = NDArray[np.float64]
Codes = NDArray[np.int8]
Indices = NDArray[np.int64]
Flags = NDArray[np.bool_]


def locked(array: NDArray[Any]) -> NDArray[Any]:
    """Adopt an array of our own making: the same memory, write-locked."""
    array.flags.writeable = False
    return array


def checked(
    value: ArrayLike,
    item: str,
    unit: str,
    *,
    shape: tuple[int | None, ...] | None = None,
    low: float = -np.inf,
    above: float = -np.inf,
    infinite: bool = False,
) -> Array:
    """A locked float64 copy of a caller's value, or an error that names what is wrong.

    Args:
        value: Number or array of numbers.
        item: The name a message uses.
        unit: Unit of the value, for the message; "" for none.
        shape: Trailing axes the array must have; None stands for any length. Leading axes are free.
            None (the default) accepts every shape.
        low: Smallest allowed value.
        above: Every value must be strictly larger than this.
        infinite: Whether infinities may pass (NaN never does).

    Returns:
        Array of float64, C-contiguous, write-locked, with memory of its own; an array that already is
        all this down to its memory, such as a result of ours, is taken as it is.

    Raises:
        InvalidValueError: If the value is no number, has the wrong shape, or is out of range.
    """
    array = value if _is_immutable(value) else _copied(value, item)
    if shape is not None:
        _check_shape(array, item, shape)
    if _is_within(array, low=low, above=above):
        return locked(array)
    _check_range(array, item, unit, low=low, above=above, infinite=infinite)
    return locked(array)


def kernel_input(value: ArrayLike, shape: tuple[int, ...]) -> Array:
    """Broadcast to a shape and lay out as kernels expect; copies only where it must."""
    array = np.asarray(np.broadcast_to(np.asarray(value, dtype=np.float64), shape), order="C")
    return array if not array.flags.writeable else locked(array.view())


def _is_immutable(value: ArrayLike) -> TypeGuard[Array]:
    """Whether a value is an array as ours, and so is whatever holds its memory."""
    if not (isinstance(value, np.ndarray) and value.dtype == np.float64 and value.flags.c_contiguous):
        return False
    holder: object = value
    while isinstance(holder, np.ndarray):
        if holder.flags.writeable:
            return False
        holder = holder.base
    return holder is None


def _copied(value: ArrayLike, item: str) -> Array:
    try:
        return np.array(value, dtype=np.float64, order="C")
    except (TypeError, ValueError) as error:
        raise InvalidValueError(item, repr(value), "numbers", f"Give {item} as plain numbers ({error}).") from None


def _is_within(array: Array, *, low: float, above: float) -> bool:
    """Whether every value is finite and in range, found by two reductions; NaN propagates through both."""
    if array.size == 0:
        return True
    smallest, largest = float(array.min()), float(array.max())
    return smallest >= low and smallest > above and smallest > -np.inf and largest < np.inf


def _check_shape(array: Array, item: str, shape: tuple[int | None, ...]) -> None:
    trailing = array.shape[array.ndim - len(shape) :] if array.ndim >= len(shape) else None
    if trailing is None or any(want is not None and want != have for want, have in zip(shape, trailing, strict=True)):
        wanted = ", ".join("any" if n is None else str(n) for n in shape)
        raise InvalidValueError(
            item, f"of shape {array.shape}", f"shape (..., {wanted})", f"Reshape {item} so that its last axes fit."
        )


def _check_range(array: Array, item: str, unit: str, *, low: float, above: float, infinite: bool) -> None:
    wrong = np.isnan(array) if infinite else ~np.isfinite(array)
    wrong |= (array < low) | (array <= above)
    if not wrong.any():
        return
    index = tuple(int(i) for i in np.argwhere(wrong)[0])
    where = item if not index else f"{item}[{', '.join(map(str, index))}]"
    bounds = [
        f">= {low:g} {unit}".rstrip() if low > -np.inf else "",
        f"> {above:g} {unit}".rstrip() if above > -np.inf else "",
        "" if infinite else "finite",
    ]
    raise InvalidValueError(
        where,
        f"{array[index]:g} {unit}".rstrip(),
        ", ".join(b for b in bounds if b) or "a number",
        f"Correct {where}.",
    )
