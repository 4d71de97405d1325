"""C of the translator, compiled by gcc and called through ctypes with arguments of Python."""

from __future__ import annotations

import ctypes
import shutil
import subprocess
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np

from tools.translate.program import translate
from tools.translate.types import NONE, ArrayType, Scalar, TupleType, Type

FLAGS: Final = ("-std=c99", "-fno-math-errno", "-fno-trapping-math", "-ffp-contract=off", "-fPIC", "-shared")
STRICT: Final = ("-Wall", "-Wextra", "-pedantic", "-Werror")
C_TYPES: Final[dict[Scalar, Any]] = {
    Scalar.BOOL: ctypes.c_bool,
    Scalar.INT: ctypes.c_int64,
    Scalar.FLOAT: ctypes.c_double,
}


def compiled_c(text: str, folder: Path, *flags: str) -> ctypes.CDLL:
    """Compile C to a shared library and load it."""
    assert shutil.which("gcc"), "The tests of the translator need gcc: install it (apt-get install gcc)."
    source = folder / "kernels.c"
    source.write_text(text, encoding="utf-8")
    return ctypes.CDLL(str(library_of(source, *flags)))


def library_of(source: Path, *flags: str) -> Path:
    """Compile C to a shared library beside it; warnings are errors."""
    library = source.with_suffix(".so")
    command = ["gcc", *FLAGS, *STRICT, *(flags or ("-O2",)), str(source), "-o", str(library), "-lm"]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr[:3000]
    return library


def flat(value: Any, type_: Type) -> list[Any]:
    """Arguments in C of a value in Python: pointers with sizes, numbers."""
    if type_ == NONE:
        assert value is None
        return []
    if isinstance(type_, Scalar):
        return [C_TYPES[type_](value)]
    if isinstance(type_, ArrayType):
        assert value.ndim == type_.rank
        assert value.flags.c_contiguous
        return [ctypes.c_void_p(value.ctypes.data), *(ctypes.c_int64(size) for size in value.shape)]
    assert isinstance(type_, TupleType)
    return [each for one, kind in zip(value, type_.types, strict=True) for each in flat(one, kind)]


def copied(value: Any) -> Any:
    """A copy of an argument; read-only arrays remain read-only, because numba compiles an entry for these flags."""
    if isinstance(value, np.ndarray):
        same = value.copy()
        same.flags.writeable = value.flags.writeable
        return same
    return tuple(copied(each) for each in value) if isinstance(value, tuple) else value


class Entry:
    """An exported function with the types of its arguments.

    Attributes:
        function: The function of the library.
        types: Types of the arguments.
        result: Type of the result; None if it returns nothing.
    """

    def __init__(self, library: ctypes.CDLL, symbol: str, types: Sequence[Type], result: Scalar | None = None) -> None:
        self.function, self.types, self.result = library[symbol], tuple(types), result

    def code(self, *arguments: Any) -> tuple[int, Any]:
        """Call the function; return its code and its result."""
        passed = [each for pair in zip(arguments, self.types, strict=True) for each in flat(*pair)]
        if self.result is None:
            return self.function(*passed), None
        result = C_TYPES[self.result]()
        return self.function(*passed, ctypes.byref(result)), result.value

    def __call__(self, *arguments: Any) -> Any:
        """Call the function; return its result."""
        code, result = self.code(*arguments)
        assert code == 0
        return result


def translated(function: Callable[..., Any], types: Sequence[Type], folder: Path, *flags: str) -> Entry:
    """A function of the subset, compiled."""
    annotation = function.__annotations__.get("return")
    result = {"float": Scalar.FLOAT, "int": Scalar.INT, "bool": Scalar.BOOL}.get(str(annotation))
    library = compiled_c(translate([(function, types, "entry")]), folder, *flags)
    return Entry(library, "entry", types, result)
