"""The library of compiled kernels. The library contains all entries in C; loading requires no compiler.

`tools/build.py` writes two files: one for all processors and one for x86-64-v3 (processors with AVX2).
"""

from __future__ import annotations

import ctypes
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
    *("Py_IncRef", "PyFloat_FromDouble", "PyLong_FromLongLong", "PyBool_FromLong", "PyErr_Format"),
)
OBJECTS: Final = None, ValueError, TypeError  # objects of Python, in the order of `Python` in python.c
FAST_CALL: Final = 0x80  # METH_FASTCALL


class LibraryError(Exception):
    """The library cannot be used. `stale` is true if the library exists but was built from other sources."""

    def __init__(self, reason: str, *, stale: bool = False) -> None:
        """Store the reason why the library cannot be used."""
        super().__init__(reason)
        self.stale = stale


class Slot(ctypes.Union):
    """Slot of an argument: a number or a pointer."""

    _fields_ = (("f", ctypes.c_double), ("i", ctypes.c_int64), ("p", ctypes.c_void_p))


class _Row(ctypes.Structure):
    """A row of the table of entries."""

    _fields_ = (
        ("name", ctypes.c_char_p),
        ("format", ctypes.c_char_p),
        ("call", ctypes.c_void_p),
        ("slots", ctypes.c_int64),
        ("result", ctypes.c_char),
    )


class _Bound(ctypes.Structure):
    """A row, the format and number of its last arguments, which may change, and its filled slots."""

    _fields_ = (
        ("entry", ctypes.c_void_p),
        ("kinds", ctypes.c_char_p),
        ("numbers", ctypes.c_int64),
        ("slots", ctypes.c_void_p),
    )


class _Method(ctypes.Structure):
    """Declaration of a function in C: `PyMethodDef`."""

    _fields_ = (
        ("name", ctypes.c_char_p),
        ("call", ctypes.c_void_p),
        ("flags", ctypes.c_int),
        ("text", ctypes.c_char_p),
    )


_new_function: Final = ctypes.PYFUNCTYPE(ctypes.py_object, ctypes.c_void_p, ctypes.py_object, ctypes.c_void_p)(
    ("PyCFunction_NewEx", ctypes.pythonapi)
)


class Entry:
    """A compiled kernel that Python calls, with one version per set of argument types."""

    def __init__(self, name: str, rows: list[_Row], library: ctypes.PyDLL) -> None:
        """Store `rows`, the table rows of the kernel `name`."""
        self.__name__ = name
        self._rows = [(row, ctypes.addressof(row)) for row in rows]
        self._call, self._fill = library.sagline_call, library.sagline_fill
        self._method = _Method(name.encode(), ctypes.cast(library.sagline_bound, ctypes.c_void_p), FAST_CALL, None)

    def __call__(self, *arguments: object) -> object:
        """Run the kernel."""
        result = Slot()
        for row, address in self._rows:
            code = self._call(address, arguments, ctypes.byref(result))
            if code == 0:
                return value_of(result, row.result)
            if code == SHORT_MEMORY:
                raise _short_memory(self.__name__)
        raise self._wrong_types()

    def bind(self, arguments: tuple[object, ...], numbers: int) -> Callable[..., object]:
        """Kernel that keeps `arguments`. The last `numbers` arguments may change at each call."""
        for row, address in self._rows:
            slots = (Slot * row.slots)()
            if self._fill(address, arguments, slots) == 0:
                bound = _Bound(address, row.format[-1 - numbers : -1], numbers, ctypes.addressof(slots))
                kept = ctypes.addressof(bound), bound, slots, arguments, self
                return _new_function(ctypes.addressof(self._method), kept, None)
        raise self._wrong_types()

    def _wrong_types(self) -> TypeError:
        formats = " or ".join(row.format.decode() for row, _ in self._rows)
        return TypeError(f"arguments of {self.__name__} have other types than {formats} (see tools/translate/python.c)")


def value_of(slot: Slot, kind: bytes) -> object:
    """Result of an entry."""
    return None if kind == b"N" else slot.f if kind == b"f" else bool(slot.i) if kind == b"?" else slot.i


def _short_memory(name: str) -> ValueError:
    """Error for an entry `name` whose work arrays are too small."""
    return ValueError(f"work arrays of {name} are too small for the sizes of its other arguments")


class Library:
    """Entries of one shared library."""

    def __init__(self, file: Path) -> None:
        """Load `file`. LibraryError if the file is missing, cannot be loaded, or was built from other sources."""
        if not file.is_file():
            raise LibraryError(f"the library of compiled kernels, {file.name}, does not exist")
        try:
            self._library = ctypes.PyDLL(str(file))  # this library fills the slots while it holds the global lock
            built_from = ctypes.string_at(ctypes.addressof(ctypes.c_char.in_dll(self._library, "sagline_digest")))
        except (OSError, ValueError) as error:
            raise LibraryError(f"the library of compiled kernels, {file.name}, cannot be loaded ({error})") from error
        if built_from != digest_of_kernels().encode():
            raise LibraryError("the library of compiled kernels is not built from the present sources", stale=True)
        pointers = [ctypes.cast(getattr(ctypes.pythonapi, name), ctypes.c_void_p).value for name in FUNCTIONS]
        python: Any = (ctypes.c_void_p * (len(FUNCTIONS) + len(OBJECTS))).in_dll(self._library, "sagline_python")
        python[:] = [*pointers, *map(id, OBJECTS)]
        self._library.sagline_fill.argtypes = (ctypes.c_void_p, ctypes.py_object, ctypes.c_void_p)
        self._library.sagline_call.argtypes = (ctypes.c_void_p, ctypes.py_object, ctypes.c_void_p)
        self._rows: dict[str, list[_Row]] = {}
        self._entries: dict[str, Entry] = {}
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

    @property
    def xla(self) -> Any:
        """Function of the library that calls an entry for XLA, the compiler of JAX."""
        return self._library.sagline_xla

    def entry(self, name: str, module: str) -> Entry | None:
        """The compiled version of the kernel `name` of `module`. None if the library has no such version."""
        if name not in self._rows or not module.startswith("sagline.kernels."):
            return None
        if name not in self._entries:
            self._entries[name] = Entry(name, self._rows[name], self._library)
        return self._entries[name]
