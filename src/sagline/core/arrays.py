"""Conversion of numbers to arrays for the kernels: float64, C-contiguous, read-only; blocks of rows.

All arrays for kernels have the same memory layout, because a kernel is compiled again for every other layout.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from decimal import Decimal
from numbers import Real
from typing import Any, Final, TypeAlias, TypeGuard

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sagline.core.arguments import brief, check_memory
from sagline.core.errors import InvalidValueError

AnyArray = NDArray[Any]
Array = NDArray[np.float64]
Codes = NDArray[np.int8]
Indices = NDArray[np.int64]
Flags = NDArray[np.bool_]

# Largest allowed magnitude of a number. No machine needs more, and square and cube are still finite.
LARGEST: Final = 1e50
FARTHEST: Final = 1e6  # largest allowed coordinate of a point [m]; no machine is larger
SMALLEST: Final = 1e-50  # smallest allowed value of a quantity that must be positive
_KINDS = {"c": "complex", "M": "dates", "m": "durations of a calendar", "V": "records"}


def locked(array: NDArray[Any]) -> NDArray[Any]:
    """Make an array read-only, without a copy, and return it."""
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
    missing: bool = False,
) -> Array:
    """Read-only, C-contiguous float64 copy of `value`; raises an error if `value` is not allowed."""
    # The message contains `unit`. `shape` states the required lengths of the last axes; None allows any length or any
    # shape. Every value must exceed `above`. `missing` allows NaN. A read-only array with all these properties that
    # owns its memory, such as a result of sagline, is returned without a copy.
    array = value if _is_immutable(value) else numbers(value, item, unit)
    if shape is not None:
        _check_shape(array, item, shape)
    if not _is_within(array, low=low, above=above):
        _check_range(array, item, unit, low=low, above=above, infinite=infinite, missing=missing)
    return locked(array)


def numbers(value: ArrayLike, item: str, unit: str) -> Array:
    """C-contiguous float64 copy of real numbers of any shape and value, also NaN; refuses masked arrays and units."""
    if type(value) in (float, np.float64):
        return np.array(value)
    _refuse_masked_or_with_unit(value, item, unit)
    try:
        size = value.size if isinstance(value, np.ndarray) else len(value)  # type: ignore[arg-type]
    except Exception:  # `len` of a caller's object may raise any error
        size = 1
    check_memory(item, 8.0 * size, "Give fewer numbers.")
    try:
        given = np.asarray(value)
        if given.dtype.kind in "fiub" and given.dtype.itemsize <= 8:
            return np.array(given, dtype=np.float64, order="C")
        return _from_other_kind(given, item)
    except InvalidValueError:
        raise
    except Exception as error:  # the conversion of a caller's object may raise any error
        reason = brief(error.args[0] if error.args else error).strip("'\"")
        raise InvalidValueError(item, brief(value), "numbers", f"Give {item} as plain numbers ({reason}).") from None


def number(value: Any, item: str, unit: str, *, low: float = -np.inf, above: float = -np.inf) -> float:
    """Checked single finite number; above: limit that it must exceed."""
    return float(exactly(value, item, unit, (), low=low, above=above))


def exactly(value: ArrayLike, item: str, unit: str, shape: tuple[int, ...], **limits: Any) -> Array:
    """Checked array with exactly the shape `shape`, without batch axes."""
    array = checked(value, item, unit, **limits)
    if array.shape != shape:
        allowed = f"shape {shape}" if shape else "a single number"
        raise InvalidValueError(item, f"of shape {array.shape}", allowed, f"Reshape {item}.")
    return array


def refuse_first(
    wrong: Flags, item: str, values: Array, unit: str, allowed: str, step: str, limits: Array | None = None
) -> None:
    """Raise an error for the first value with `wrong` True; {i}, {limit} in `allowed` become its index and limit."""
    if wrong.any():
        k, index = int(np.argmax(wrong)), ", ".join(str(i) for i in np.argwhere(wrong)[0])
        where, limit = f"{item}[{index}]" if index else item, np.nan if limits is None else limits.flat[k]
        raise InvalidValueError(where, f"{values.flat[k]:g} {unit}".rstrip(), allowed.format(i=k, limit=limit), step)


def kernel_input(value: ArrayLike, shape: tuple[int, ...]) -> Array:
    """Array of shape `shape` in the memory layout of the kernels, to which `value` is broadcast; copied if needed."""
    array = np.asarray(value, dtype=np.float64, order="C")
    if array.shape != shape:
        array = np.asarray(np.broadcast_to(array, shape), order="C")
    return array if not array.flags.writeable else locked(array.view())


def spread(array: Array, shape: tuple[int, ...]) -> Array:
    """Read-only array: the result of `checked`, broadcast to `shape`."""
    return array if array.shape == shape else locked(np.array(np.broadcast_to(array, shape), order="C"))


def broadcast_shape(item: str, *shapes: tuple[int, ...]) -> tuple[int, ...]:
    """Common shape to which several arrays broadcast; item: name of the arrays in the message."""
    try:
        return np.broadcast_shapes(*shapes)
    except ValueError:
        listed = " and ".join(str(shape) for shape in dict.fromkeys(shapes))
        step = "Give one value for each, or one value for all."
        raise InvalidValueError(item, f"not of one shape, but {listed}", "shapes that broadcast", step) from None


def leaves(value: Any) -> Iterator[Any]:
    """Arrays and numbers of nested tuples, in order. None is omitted, because None is not an argument in C."""
    if isinstance(value, tuple):
        for each in value:
            yield from leaves(each)
    elif value is not None:
        yield value


def owner(array: AnyArray) -> AnyArray:
    """The array that owns the memory of a view."""
    while isinstance(array.base, np.ndarray):
        array = array.base
    return array


def _is_immutable(value: ArrayLike) -> TypeGuard[Array]:
    """True if `value` and the array that owns its memory are read-only, C-contiguous float64 arrays."""
    if not (type(value) is np.ndarray and value.dtype == np.float64 and value.flags.c_contiguous):
        return False
    holder: object = value
    while isinstance(holder, np.ndarray):
        if holder.flags.writeable:
            return False
        holder = holder.base
    return holder is None


def _refuse_masked_or_with_unit(value: Any, item: str, unit: str) -> None:
    """Refuse masked arrays and quantities with units, because numpy would silently drop the mask or the unit."""
    if type(value) in (np.ndarray, int, list, tuple):
        return
    if isinstance(value, np.ma.MaskedArray) and np.ma.is_masked(value):
        where = ", ".join(str(int(i)) for i in np.argwhere(np.ma.getmaskarray(value))[0])
        step = "Fill or remove the masked values."
        raise InvalidValueError(f"{item}[{where}]" if where else item, "masked", "a number", step)
    for name in ("units", "unit"):
        own = getattr(value, name, None)
        if own is not None and not callable(own) and str(own) != unit:
            step = f"Convert it, and give the bare number{' in ' + unit if unit else ''}."
            raise InvalidValueError(item, f"in {own}, another unit", f"numbers in {unit or '1'}", step)


def _from_other_kind(given: NDArray[Any], item: str) -> Array:
    """Float64 array from long doubles and Python's number objects; refuses values that are not real numbers."""
    if given.dtype.kind in "fO" and (given.dtype.kind == "f" or all(_is_real(entry) for entry in given.flat)):
        with np.errstate(over="ignore"):  # overflow gives infinity, which is refused later
            return np.array(given, dtype=np.float64, order="C")
    shown = next((entry for entry in given.flat if not _is_real(entry)), given) if given.dtype.kind == "O" else given
    kind = _KINDS.get(given.dtype.kind, "")
    value = f"{kind}: {_listed(shown)}" if kind else _listed(shown)
    allowed = "numbers, not complex" if kind else "numbers"
    raise InvalidValueError(item, value, allowed, f"Give {item} as plain numbers.")


def _listed(value: object) -> str:
    return brief(value.item() if isinstance(value, np.ndarray) and value.size == 1 else value)


def _is_real(entry: object) -> bool:
    return isinstance(entry, Real | Decimal) and not isinstance(entry, np.timedelta64)


def _is_within(array: Array, *, low: float, above: float) -> bool:
    """True if all values are finite and in range. A test of minimum and maximum also detects NaN."""
    if array.size == 0:
        return True
    smallest, largest = float(array.min()), float(array.max())
    tiny = above == 0.0 and 0.0 < smallest < SMALLEST  # a division by it would overflow
    return smallest >= max(low, -LARGEST) and smallest > above and largest <= LARGEST and not tiny


def _check_shape(array: Array, item: str, shape: tuple[int | None, ...]) -> None:
    trailing = array.shape[array.ndim - len(shape) :] if array.ndim >= len(shape) else None
    if trailing is None or any(want is not None and want != have for want, have in zip(shape, trailing, strict=True)):
        wanted = ", ".join("any" if n is None else str(n) for n in shape)
        step = f"Reshape {item} so that its last axes fit."
        raise InvalidValueError(item, f"of shape {array.shape}", f"shape (..., {wanted})", step)


def _check_range(
    array: Array, item: str, unit: str, *, low: float, above: float, infinite: bool, missing: bool
) -> None:
    wrong = np.zeros(array.shape, dtype=np.bool_) if infinite else np.isinf(array)
    if not missing:
        wrong |= np.isnan(array)
    wrong |= (array < low) | (array <= above)
    beyond = ~wrong & np.isfinite(array) & (np.abs(array) > LARGEST)
    if above == 0.0:
        beyond |= ~wrong & (array < SMALLEST)
    if not (wrong | beyond).any():
        return
    index = tuple(int(i) for i in np.argwhere(wrong | beyond)[0])
    where = item if not index else f"{item}[{', '.join(map(str, index))}]"
    size = f"{SMALLEST:g} to {LARGEST:g} {unit}" if above == 0.0 else f"up to {LARGEST:g} {unit}, of either sign"
    bounds = [
        f">= {low:g} {unit}".rstrip() if low > -np.inf else "",
        f"> {above:g} {unit}".rstrip() if above > -np.inf else "",
        size.replace("  ", " ").rstrip() if beyond[index] else "",
        "" if infinite else "finite",
    ]
    allowed = ", ".join(b for b in bounds if b) or "a number"
    raise InvalidValueError(where, f"{array[index]:g} {unit}".rstrip(), allowed, f"Correct {where}.")


# function that is called after each block with the number of finished rows and the number of all rows
Progress: TypeAlias = Callable[[int, int], None]


def blocks(count: int, size: int, progress: Progress | None = None) -> Iterator[slice]:
    """Slices that divide `count` rows into blocks of at most `size` rows; progress is called after each block."""
    for first in range(0, count, size):
        part = slice(first, min(first + size, count))
        yield part
        if progress is not None:
            progress(part.stop, count)


def rows_of(array: Array, part: slice) -> Array:
    """Rows `part` of `array`. An array with a single row is for all entries, and is returned unchanged."""
    return array if len(array) == 1 else array[part]
