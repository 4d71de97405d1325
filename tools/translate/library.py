"""C of the library of all entries that Python loads: kernels, calls by slots, and the table of entries."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Final

from tools.translate.program import Program
from tools.translate.signatures import entries
from tools.translate.types import NONE, ArrayType, Element, Scalar, TupleType, Type

SCALARS: Final = {Scalar.FLOAT: "f", Scalar.INT: "i", Scalar.BOOL: "?"}
ELEMENTS: Final = {
    Element.FLOAT: "D",
    Element.INT: "L",
    Element.BYTE: "B",
    Element.FLAG: "F",
    Element.COMPLEX: "Z",
}
MOST_SLOTS: Final = 256
EXPORTED: Final = """
#ifdef _WIN32
#define EXPORTED __declspec(dllexport)
#else
#define EXPORTED __attribute__((visibility("default")))
#endif
"""
TABLE: Final = """
EXPORTED const char sagline_digest[] = "%s";
EXPORTED const Entry sagline_entries[] = {
%s
    {0, 0, 0, 0, 0},
};
"""


def library_text(digest: str) -> str:
    """C of the library; the digest of the sources is part of it.

    Raises:
        TranslationError: If a kernel is outside the subset; names file, line and construct.
    """
    program = Program()
    calls, rows = [], []
    for function, types, symbol in entries():
        translation = program.export(function, types, symbol)
        slots = [slot for type_ in types for slot in _slots(type_)]
        values = [f"slots[{k}].{member}" for k, member in enumerate(slots)]
        result = translation.result
        assert result == NONE or isinstance(result, Scalar)
        if isinstance(result, Scalar):
            kind = SCALARS[result]
            values.append("&found")
            variable = f"{'double' if kind == 'f' else 'int64_t' if kind == 'i' else 'bool'} found;"
            lines = [variable, f"int code = {symbol}({', '.join(values)});", f"result->{_member(kind)} = found;"]
            lines.append("return code;")
        else:
            kind = "N"
            lines = ["(void)result;", f"return {symbol}({', '.join(values)});"]
        body = "\n    ".join(lines)
        calls.append(f"static int call_{symbol}(const Slot *slots, Slot *result) {{\n    {body}\n}}\n")
        assert len(slots) <= MOST_SLOTS
        form = "".join(_format(type_) for type_ in types).replace("?", r"\?")  # "??(" is a trigraph of C
        rows.append(f'    {{"{function.__name__}", "({form})", call_{symbol}, {len(slots)}, \'{kind}\'}},')
    python, xla = ((Path(__file__).parent / name).read_text(encoding="utf-8") for name in ("python.c", "xla.c"))
    return "\n".join((program.text(), EXPORTED, python, *calls, TABLE % (digest, "\n".join(rows)), xla))


def _member(kind: str) -> str:
    """Member of a slot for a kind of value."""
    return "f" if kind == "f" else "i"


def _format(type_: Type) -> str:
    """Format of an argument, as `python.c` reads it."""
    if isinstance(type_, Scalar):
        return SCALARS[type_]
    if isinstance(type_, ArrayType):
        return f"{ELEMENTS[type_.element]}{type_.rank}"
    if isinstance(type_, TupleType):
        return f"({''.join(map(_format, type_.types))})"
    return "N"


def _slots(type_: Type) -> Iterator[str]:
    """Members of the slots of an argument, in the order of the parameters in C."""
    if isinstance(type_, Scalar):
        yield _member(SCALARS[type_])
    elif isinstance(type_, ArrayType):
        yield from ("p", *"i" * type_.rank)
    elif isinstance(type_, TupleType):
        for each in type_.types:
            yield from _slots(each)
