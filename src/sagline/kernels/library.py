"""The library of compiled kernels. It contains all entries in C; loading requires no compiler.

`tools/build.py` writes two files: one for all processors and one for x86-64-v3 (processors with AVX2).
"""

from __future__ import annotations

import ctypes
import operator
import sys
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any, Final

from sagline.kernels.sources import SOURCES, digest_of_kernels

SUFFIX: Final = {"win32": ".dll", "darwin": ".dylib"}.get(sys.platform, ".so")
FOLDER: Final = SOURCES / "compiled"
FILES: Final = (f"kernels{SUFFIX}", f"kernels_v3{SUFFIX}")
SHORT_MEMORY, WRONG_TYPES = 1, -1
FUNCTIONS: Final = (  # functions of Python's stable interface, in the order of `Python` in python.c
    *("PyObject_GetBuffer", "PyBuffer_Release", "PyTuple_Size", "PyTuple_GetItem", "PyFloat_AsDouble"),
    *("PyLong_AsLongLong", "PyObject_IsTrue", "PyErr_Occurred", "PyErr_Clear"),
    *("PyEval_SaveThread", "PyEval_RestoreThread"),
)

# letter of a format -> conversion of a number, and member of its slot
CONVERSIONS: Final[dict[str, tuple[Callable[[Any], Any], str]]] = {
    "f": (float, "f"),
    "i": (operator.index, "i"),
    "?": (bool, "i"),
}


class LibraryError(Exception):
    """The library cannot be used. `stale` is true if it exists and was built from other sources."""

    def __init__(self, reason: str, *, stale: bool = False) -> None:
        """Store the reason why the library cannot be used."""
        super().__init__(reason)
        self.stale = stale


class Slot(ctypes.Union):
    """Slot of an argument: a number or a pointer."""

    _fields_ = (("f", ctypes.c_double), ("i", ctypes.c_int64), ("p", ctypes.c_void_p))


_CALL: Final = ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_void_p, ctypes.c_void_p)  # runs without the global lock


class _Row(ctypes.Structure):
    """A row of the table of entries."""

    _fields_ = (
        ("name", ctypes.c_char_p),
        ("format", ctypes.c_char_p),
        ("call", ctypes.c_void_p),
        ("slots", ctypes.c_int64),
        ("result", ctypes.c_char),
    )


class Entry:
    """A compiled kernel that Python calls, with one version per set of argument types."""

    def __init__(self, function: Callable[..., object], rows: list[_Row], library: ctypes.PyDLL, python: Any) -> None:
        """Store `rows`, the rows of the function; for `library` and `python` see `Library`."""
        self.__wrapped__, self.__name__, self.__doc__ = function, function.__name__, function.__doc__
        self.__module__ = function.__module__
        self._rows = [(row, ctypes.addressof(row)) for row in rows]
        self._call, self._fill, self._python = library.sagline_call, library.sagline_fill, ctypes.addressof(python)
        self._kept = python

    def __call__(self, *arguments: object) -> object:
        """Run the kernel."""
        result = Slot()
        for row, address in self._rows:
            code = self._call(self._python, address, arguments, ctypes.byref(result))
            if code == 0:
                return value_of(result, row.result)
            if code == SHORT_MEMORY:
                raise short_memory(self.__name__)
        raise self._wrong_types()

    def bind(self, arguments: tuple[object, ...], numbers: int) -> Bound:
        """Kernel with these arguments, which it keeps alive. The last `numbers` arguments may change at each call."""
        for row, address in self._rows:
            slots = (Slot * row.slots)()
            if self._fill(self._python, address, arguments, slots) == 0:
                return Bound(self.__name__, row, slots, numbers, arguments)
        raise self._wrong_types()

    def _wrong_types(self) -> TypeError:
        formats = " or ".join(row.format.decode() for row, _ in self._rows)
        return TypeError(f"arguments of {self.__name__} have other types than {formats} (see tools/translate/python.c)")


class Bound:
    """A compiled kernel with its arguments."""

    __slots__ = ("_call", "_kept", "_kind", "_last", "_name", "_result", "_slots")

    def __init__(self, name: str, row: _Row, slots: Any, numbers: int, arguments: object) -> None:
        """Store filled slots, and keep the arguments alive."""
        self._name, self._kind, self._call = name, row.result, _CALL(row.call)
        self._result = Slot()
        self._slots, self._kept = ctypes.addressof(slots), (arguments, slots)
        kinds = row.format.decode()[-1 - numbers : -1]
        last = slots[row.slots - numbers : row.slots]
        self._last = [(slot, *CONVERSIONS[kind]) for slot, kind in zip(last, kinds, strict=True)]

    def __call__(self, *numbers: float) -> object:
        """Run the kernel with new values of the last numbers."""
        for (slot, convert, member), number in zip(self._last, numbers, strict=True):
            setattr(slot, member, convert(number))
        if self._call(self._slots, ctypes.addressof(self._result)):
            raise short_memory(self._name)
        return value_of(self._result, self._kind)


def value_of(slot: Slot, kind: bytes) -> object:
    """Result of an entry."""
    return None if kind == b"N" else slot.f if kind == b"f" else bool(slot.i) if kind == b"?" else slot.i


def short_memory(name: str) -> ValueError:
    """Error of the entry `name` if its work arrays are too small."""
    return ValueError(f"work arrays of {name} are too small for the sizes of its other arguments")


class Library:
    """Entries of one shared library."""

    def __init__(self, file: Path) -> None:
        """Load `file`. LibraryError if it is missing, cannot be loaded, or was built from other sources."""
        if not file.is_file():
            raise LibraryError(f"the library of compiled kernels, {file.name}, does not exist")
        try:
            self._library = ctypes.PyDLL(str(file))  # fills slots under the global lock
            built_from = ctypes.string_at(ctypes.addressof(ctypes.c_char.in_dll(self._library, "sagline_digest")))
        except (OSError, ValueError) as error:
            raise LibraryError(f"the library of compiled kernels, {file.name}, cannot be loaded ({error})") from error
        if built_from != digest_of_kernels().encode():
            raise LibraryError("the library of compiled kernels is not built from the present sources", stale=True)
        pointers = [ctypes.cast(getattr(ctypes.pythonapi, name), ctypes.c_void_p).value for name in FUNCTIONS]
        self._python = (ctypes.c_void_p * (len(FUNCTIONS) + 1))(*pointers, id(None))
        pointer = ctypes.c_void_p
        self._library.sagline_fill.argtypes = (pointer, pointer, ctypes.py_object, pointer)
        self._library.sagline_call.argtypes = (pointer, pointer, ctypes.py_object, pointer)
        self._rows: dict[str, list[_Row]] = {}
        table = ctypes.addressof(_Row.in_dll(self._library, "sagline_entries"))
        while (row := _Row.from_address(table)).name:
            self._rows.setdefault(row.name.decode(), []).append(row)
            table += ctypes.sizeof(_Row)

    @classmethod
    def load(cls, folder: Path = FOLDER) -> Library:
        """The library for this processor. LibraryError if no library can be used."""
        everywhere, newer = (folder / name for name in FILES)
        library = cls(everywhere)
        if library._library.sagline_is_v3():
            with suppress(LibraryError):
                return cls(newer)
        return library

    def entry(self, function: Callable[..., object]) -> Entry | None:
        """The compiled version of a function. None if the library has no such version."""
        rows = self._rows.get(function.__name__)
        if rows is None or not function.__module__.startswith("sagline.kernels."):
            return None
        return Entry(function, rows, self._library, self._python)
