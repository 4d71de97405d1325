"""All functions, structs and constant tables of one translation, and its exported entries."""

from __future__ import annotations

import ast
import inspect
from collections.abc import Iterable, Sequence
from functools import cache
from types import FunctionType
from typing import Any, Final

import numpy as np

from tools.translate.function import FunctionTranslation
from tools.translate.scope import Scope, identifier
from tools.translate.text import HEAD, array_name
from tools.translate.types import (
    C_SCALARS,
    NONE,
    ArrayType,
    Element,
    Scalar,
    TranslationError,
    TupleType,
    Type,
    holds_array,
    words,
)

ELEMENTS: Final = {
    np.dtype(np.float64): Element.FLOAT,
    np.dtype(np.int64): Element.INT,
    np.dtype(np.int8): Element.BYTE,
    np.dtype(np.bool_): Element.FLAG,
    np.dtype(np.complex128): Element.COMPLEX,
}


@cache
def definition(function: FunctionType) -> ast.FunctionDef:
    """Syntax tree of a function, with its decorators and the lines of its file."""
    lines, _ = inspect.findsource(function)
    first = function.__code__.co_firstlineno  # of the first decorator, or of `def` without decorators
    named = (node for node in ast.walk(_tree("".join(lines))) if getattr(node, "name", "") == function.__name__)
    definitions = (node for node in named if isinstance(node, ast.FunctionDef))
    return next(each for each in definitions if first in (each.lineno, *(line.lineno for line in each.decorator_list)))


@cache
def _tree(source: str) -> ast.Module:
    """Syntax tree of a file."""
    return ast.parse(source)


class Program:
    """Functions by argument types, in the order in which C needs them."""

    def __init__(self) -> None:
        """Begin without functions."""
        self._functions: dict[tuple[FunctionType, tuple[Type, ...]], FunctionTranslation] = {}
        self._open: list[FunctionType] = []
        self._structs: dict[Type, tuple[str, str]] = {}  # name, definition
        self._tables: dict[int, tuple[str, str, ArrayType, Any]] = {}  # name, definition, type, the array itself
        self._names: set[str] = set()
        self._entries: list[tuple[str, FunctionTranslation]] = []

    def _unique(self, name: str) -> str:
        """The name, with a number if it is already used."""
        found, number = name, 1
        while found in self._names:
            number += 1
            found = f"{name}_{number}"
        self._names.add(found)
        return found

    def c_type(self, type_: Type) -> str:
        """Name of a type in C; defines its struct at the first call."""
        if isinstance(type_, Scalar):
            return C_SCALARS[type_]
        if type_ not in self._structs:
            if isinstance(type_, ArrayType):
                name, fields = self._array(type_)
            else:
                assert isinstance(type_, TupleType)
                pairs = zip(type_.fields, type_.types, strict=True)
                fields = [f"{self.c_type(each)} {identifier(name)};" for name, each in pairs if each != NONE]
                name = self._unique(type_.name.rpartition(".")[2].strip("_") or f"Tuple{len(type_.types)}")
            self._structs[type_] = (name, f"typedef struct {{ {' '.join(fields) or 'char none;'} }} {name};")
        return self._structs[type_][0]

    def _array(self, type_: ArrayType) -> tuple[str, list[str]]:
        """Name and fields of the struct of an array."""
        name = self._unique(array_name(type_.element, type_.rank, type_.strided, type_.constant))
        axes = range(type_.rank)
        strides = f"int64_t {', '.join(f's{k}' for k in axes)};"
        pointer = f"{'const ' * type_.constant}{type_.element.c} *p;"
        sizes = f"int64_t {', '.join(f'n{k}' for k in axes)};"
        return name, [pointer, sizes, *([strides] if type_.strided else [])]

    def table(self, array: Any, name: str) -> tuple[str, ArrayType]:
        """A constant array: static numbers and static sizes."""
        if id(array) not in self._tables:
            type_ = ArrayType(ELEMENTS[array.dtype], array.ndim, constant=True)
            unique = self._unique(name.strip("_"))
            numbers = ", ".join(_number(value) for value in array.ravel().tolist())
            sizes = ", ".join(str(size) for size in array.shape)
            text = f"static const {type_.element.c} {unique}_numbers[] = {{{numbers}}};\n"
            text += f"static const {self.c_type(type_)} {unique} = {{{unique}_numbers, {sizes}}};\n"
            self._tables[id(array)] = (unique, text, type_, array)
        name, _, type_, _ = self._tables[id(array)]
        return name, type_

    def function(
        self, function: FunctionType, types: Sequence[Type], caller: Scope | None = None, call: ast.AST | None = None
    ) -> FunctionTranslation:
        """A function for argument types, translated at the first call."""
        node = definition(function)
        reader = caller or Scope(self, function, node, types)
        place = call or node
        if len(types) != len(node.args.args) or node.args.vararg or node.args.kwonlyargs or node.args.kwarg:
            reader.refuse(place, f"{len(types)} arguments of {function.__name__}", "Give each parameter one argument.")
        annotations = [each.annotation for each in node.args.args]
        given = tuple(reader.annotated(*pair) for pair in zip(annotations, types, strict=True))
        key = (function, given)
        if key not in self._functions:
            if function in self._open:
                reader.refuse(place, f"{function.__name__} calls itself", "Use a loop with a bound.")
            self._open.append(function)
            translation = FunctionTranslation(self, function, node, given)
            translation.name = self._unique(f"{function.__module__.rpartition('.')[2]}_{function.__name__.strip('_')}")
            try:
                translation.infer()
            except TranslationError as error:
                if call is not None:
                    line = getattr(call, "lineno", 0)
                    error.add_note(f"called in {reader.function.__code__.co_filename}:{line}")
                raise
            finally:
                self._open.pop()
            self._functions[key] = translation
        return self._functions[key]

    def export(self, function: FunctionType, types: Sequence[Type], symbol: str) -> FunctionTranslation:
        """Add an entry with an exported name."""
        translation = self.function(function, types)
        self._entries.append((symbol, translation))
        return translation

    def parts(self) -> list[tuple[str, str]]:
        """All structs, tables, functions and exported entries with their names, in the order in which C needs them."""
        wrappers = [(symbol, self._wrapper(symbol, each)) for symbol, each in self._entries]
        found = [(name, f"{text}\n") for name, text in self._structs.values()]
        found += [(name, text) for name, text, _, _ in self._tables.values()]
        found += [(each.name, each.text()) for each in self._functions.values()]
        return [*found, *((symbol, f"static {head} {{\n{body}}}\n") for symbol, (head, body) in wrappers)]

    def text(self) -> str:
        """The whole C text, with only the functions that entries use."""
        wrappers = [self._wrapper(symbol, each) for symbol, each in self._entries]
        by_name = {each.name: each for each in self._functions.values()}
        waiting, reached, tables = [each.name for _, each in self._entries], set[str](), set[str]()
        while waiting:
            name = waiting.pop()
            if name not in reached:
                reached.add(name)
                tables |= set(by_name[name].constants)
                waiting += by_name[name].calls
        functions = [each.text() for each in self._functions.values() if each.name in reached]
        constants = [text for name, text, _, _ in self._tables.values() if name in tables]
        structs = [f"{text}\n" for _, text in self._structs.values()]
        prototypes = [f"{head};\n" for head, _ in wrappers]
        bodies = [f"{head} {{\n{body}}}\n" for head, body in wrappers]
        sections = ("".join(structs), "".join(constants), "".join(prototypes), "\n".join(functions), "\n".join(bodies))
        return "\n".join((HEAD, *(section for section in sections if section)))

    def _wrapper(self, symbol: str, entry: FunctionTranslation) -> tuple[str, str]:
        """Head and body of an exported function: pointers, sizes and numbers in, a code out."""
        parameters: list[str] = []
        lines, arguments = [], []
        for name, type_ in entry.parameters.items():
            if type_ != NONE:
                text = _flat(identifier(name), type_, parameters)
                if not isinstance(type_, Scalar):
                    lines.append(f"    const {self.c_type(type_)} {identifier(name)}_ = {text};")
                    text = f"{identifier(name)}_"
                arguments.append(text)
        returned = entry.result
        if isinstance(returned, TupleType | ArrayType) and holds_array(returned):
            entry.refuse(entry.node, f"an entry returns {words(returned)}", "Fill arrays that are arguments.")
        if returned != NONE:
            parameters.append(f"{self.c_type(returned)} *result")
        lines.append("    int code = 0;")
        arguments += ["&code"] if entry.fallible else []
        call = f"{entry.name}({', '.join(arguments)});"
        lines.append(f"    {'*result = ' if returned != NONE else ''}{call}")
        lines.append("    return code;")
        return f"int {symbol}({', '.join(parameters) or 'void'})", "\n".join(lines) + "\n"


def _number(value: Any) -> str:
    """An element of a constant table."""
    return (
        str(value).lower() if isinstance(value, bool) else f"INT64_C({value})" if abs(value) >= 2**31 else repr(value)
    )


def _flat(name: str, type_: Type, parameters: list[str]) -> str:
    """Add the parameters of an argument; returns the initial value of its struct."""
    if isinstance(type_, Scalar):
        parameters.append(f"{C_SCALARS[type_]} {name}")
        return name
    if isinstance(type_, ArrayType):
        sizes = [f"{name}_n{axis}" for axis in range(type_.rank)]
        parameters.append(f"{'const ' * type_.constant}{type_.element.c} *{name}")
        parameters.extend(f"int64_t {size}" for size in sizes)
        return f"{{{', '.join([name, *sizes])}}}"
    assert isinstance(type_, TupleType)
    pairs = [pair for pair in zip(type_.fields, type_.types, strict=True) if pair[1] != NONE]
    return f"{{{', '.join(_flat(f'{name}_{field}', each, parameters) for field, each in pairs) or '0'}}}"


def translate(entries: Iterable[tuple[Any, Sequence[Type], str]]) -> str:
    """C of entries, each with the types of its arguments and the name under which it is exported.

    Raises:
        TranslationError: If a function that they call is outside the subset; names file, line and construct.
    """
    program = Program()
    for function, types, symbol in entries:
        program.export(function, types, symbol)
    return program.text()
