"""State of the translation of one function: its lines of C, its variables, and values on their way through a statement.

The body of a function is translated repeatedly, each time with the types of the variables from the previous pass, until
the types do not change. A pass skips statements that require the unknown type of a variable.
"""

from __future__ import annotations

import ast
import re
from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property
from types import FunctionType
from typing import TYPE_CHECKING, Any, Final, NoReturn

from tools.translate.names import names_in, stored_in
from tools.translate.text import RESERVED
from tools.translate.types import (
    NONE,
    ArrayType,
    JoinError,
    Nothing,
    Scalar,
    TranslationError,
    TupleType,
    Type,
    join,
    plain_tuple,
    words,
)

if TYPE_CHECKING:
    from tools.translate.program import Program

ATOM, UNARY, TIMES, PLUS, COMPARE, EQUAL, AND, OR, CHOICE = 20, 14, 13, 12, 10, 9, 5, 4, 3  # levels of precedence in C
WORD: Final = re.compile(r"[A-Za-z_]\w*")
PATH: Final = re.compile(r"[A-Za-z_]\w*(\.\w+)*")
TEMPORARY: Final = re.compile(r"[tk]_\d+_*")  # names that the translator uses itself
# marks of the returns after a failed call and a failed check, whose type is known only at the end
FAIL: Final = "@fail"
SHORT: Final = "@short"
UNSET: Final = object()


class NoTypeYetError(Exception):
    """A variable is read before any pass has found its type."""


@dataclass(frozen=True)
class Value:
    """A value within a statement.

    Attributes:
        text: Its expression in C.
        type: Its type.
        level: Precedence of the expression.
        items: The items of an explicit tuple.
        known: The Python value, if translation knows it.
        reads: True if the expression reads elements of arrays.
        writes: True if it calls a function that may write elements of arrays.
    """

    text: str
    type: Type
    level: int = ATOM
    items: tuple[Value, ...] | None = None
    known: Any = UNSET
    reads: bool = False
    writes: bool = False

    @property
    def is_known(self) -> bool:
        """True if translation knows the value."""
        return self.known is not UNSET

    def within(self, level: int) -> str:
        """The expression as operand of an operator with this precedence."""
        return self.text if self.level >= level else f"({self.text})"


def identifier(name: str) -> str:
    """Name of a variable or field in C."""
    return f"{name}_" if name in RESERVED or TEMPORARY.fullmatch(name) else name


class Scope:
    """Lines, variables and values of one function."""

    def __init__(self, program: Program, function: FunctionType, node: ast.FunctionDef, types: Sequence[Type]) -> None:
        """Store a function with the types of its parameters."""
        self.program, self.function, self.node = program, function, node
        self.parameters = dict(zip((each.arg for each in node.args.args), types, strict=True))
        self.types: dict[str, Type] = dict(self.parameters)
        self.returned: Type | None = None
        self.unread = frozenset(stored_in([node]) - stored_in([node], ast.Load))
        self.fallible = False
        self.begin_pass()

    def begin_pass(self) -> None:
        """Discard the lines of the previous pass; types remain."""
        self.lines: list[str] = []
        self.depth = 1
        self.complete: ast.AST | None = None  # otherwise the first node without a type
        self.read: set[str] = set()
        self.declared: set[str] = set(self.parameters)
        self.above: dict[str, None] = {}  # variables that are declared above all lines
        self.blocks: list[frozenset[str]] = []
        self.calls: dict[str, None] = {}
        self.constants: dict[str, None] = {}
        self.temporaries = 0
        self.written = 0  # calls so far that may write arrays

    @cached_property
    def locals(self) -> frozenset[str]:
        """Parameters and assigned names."""
        return frozenset(stored_in([self.node])) | frozenset(self.parameters)

    @cached_property
    def mentions(self) -> Counter[str]:
        """Counts of the names in the function."""
        return names_in(self.node.body)

    @property
    def result(self) -> Type:
        """Type of the function's result."""
        return NONE if self.returned is None else self.returned

    def refuse(self, node: ast.AST, construct: str, instead: str) -> NoReturn:
        """Raise the error of a construct outside the subset."""
        line = getattr(node, "lineno", self.node.lineno)
        raise TranslationError(self.function.__code__.co_filename, line, construct, instead)

    def joined(self, node: ast.AST, first: Type | None, second: Type, place: str) -> Type:
        """The type that holds both types, or the error that names the location."""
        try:
            return join(first, second)
        except JoinError as error:
            self.refuse(node, f"{place} has two types: {error}", "Give each type a name of its own.")

    def emit(self, line: str) -> None:
        """Append a line of C."""
        self.lines.append("    " * self.depth + line)

    @contextmanager
    def aside(self, deeper: int = 0) -> Iterator[list[str]]:
        """Collect lines separately from the lines of the function."""
        lines, self.lines = self.lines, []
        self.depth += deeper
        try:
            yield self.lines
        finally:
            self.lines, self.depth = lines, self.depth - deeper

    def temporary(self) -> str:
        """A new name for a value."""
        self.temporaries += 1
        return f"t_{self.temporaries}"

    def hold(self, value: Value) -> Value:
        """Assign the value to a variable, so that it can be used repeatedly."""
        if PATH.fullmatch(value.text):
            return value
        name = self.temporary()
        self.emit(f"{self.program.c_type(value.type)} {name} = {value.text};")
        self.written += value.writes
        return Value(name, value.type, known=value.known)

    def kept_in_order(self, values: list[Value], marks: list[int], written: list[int]) -> list[Value]:
        """Operands in Python's order from left to right, which C does not guarantee.

        A value that reads or writes arrays gets a name if a later value writes arrays. A value that writes arrays gets
        a name if a later value reads arrays. The name is inserted at the mark of the value, the number of lines after
        it.
        """
        for k in range(len(values) - 2, -1, -1):
            later = values[k + 1 :]
            writes = self.written > written[k] or any(each.writes for each in later)
            one = values[k]
            if (one.reads and writes) or (one.writes and (writes or any(each.reads for each in later))):
                with self.aside() as lines:
                    values[k] = self.hold(one)
                self.lines[marks[k] : marks[k]] = lines
        return values

    def operands(self, nodes: Sequence[ast.expr]) -> list[Value]:
        """Values of several expressions of a statement, in Python's order."""
        values, marks, written = [], [], []
        for node in nodes:
            values.append(self.expression(node))
            marks.append(len(self.lines))
            written.append(self.written)
        return self.kept_in_order(values, marks, written)

    def expression(self, node: ast.expr) -> Value:
        """Value of an expression."""
        raise NotImplementedError

    def parts(self, value: Value, node: ast.AST) -> tuple[Value, ...]:
        """Items of a tuple."""
        if value.items is not None:
            return value.items
        if not isinstance(value.type, TupleType):
            self.refuse(node, f"{words(value.type)} is unpacked", "Unpack tuples only.")
        held = self.hold(value)
        fields = zip(value.type.fields, value.type.types, strict=True)
        return tuple(self.field(held, name, type_) for name, type_ in fields)

    def field(self, held: Value, name: str, type_: Type) -> Value:
        """A field of a struct."""
        return Value(f"{held.within(ATOM)}.{identifier(name)}", type_, known=None if type_ == NONE else UNSET)

    def tuple_of(self, items: Sequence[Value], node: ast.AST) -> Value:
        """An explicit tuple."""
        type_ = plain_tuple(*(item.type for item in items))
        return self.packed(type_, items, node)

    def packed(self, type_: TupleType, items: Sequence[Value], node: ast.AST) -> Value:
        """Items, converted, as a struct of a type."""
        pairs = zip(items, type_.types, strict=True)
        texts = [self.converted(item, each, node) for item, each in pairs if each != NONE]
        text = f"(({self.program.c_type(type_)}){{{', '.join(texts) or '0'}}})"
        reads, writes = any(item.reads for item in items), any(item.writes for item in items)
        return Value(text, type_, items=tuple(items), reads=reads, writes=writes)

    def converted(self, value: Value, type_: Type, node: ast.AST) -> str:
        """The expression as a value of another type."""
        if value.type == type_:
            return value.text
        if isinstance(value.type, Scalar) and isinstance(type_, Scalar) and value.type <= type_:
            return self.widened(value, type_).text
        if isinstance(type_, TupleType) and isinstance(value.type, TupleType):
            return self.packed(type_, self.parts(value, node), node).text
        if isinstance(type_, ArrayType) and isinstance(value.type, ArrayType):
            return self._other_layout(value, type_)
        self.refuse(node, f"{words(value.type)} stands for {words(type_)}", "Use one type.")

    def widened(self, value: Value, scalar: Scalar) -> Value:
        """A number, converted to a larger type."""
        if scalar is Scalar.COMPLEX and value.type is not Scalar.COMPLEX:
            return Value(f"sl_complex({value.text}, 0.0)", scalar, reads=value.reads, writes=value.writes)
        if scalar is Scalar.FLOAT and value.is_known and value.type is not Scalar.FLOAT:
            return Value(repr(float(value.known)), scalar, known=float(value.known))
        return value

    def _other_layout(self, value: Value, type_: ArrayType) -> str:
        """An array, converted to one with strides or to a constant one."""
        held, source = self.hold(value).text, value.type
        assert isinstance(source, ArrayType)
        sizes = [f"{held}.n{k}" for k in range(type_.rank)]
        strides = [self.stride(held, source, k) or "1" for k in range(type_.rank)] if type_.strided else []
        return f"(({self.program.c_type(type_)}){{{', '.join([f'{held}.p', *sizes, *strides])}}})"

    @staticmethod
    def stride(held: str, type_: ArrayType, axis: int) -> str:
        """Distance of neighbors along an axis, in elements; "" for 1."""
        if type_.strided:
            return f"{held}.s{axis}"
        return " * ".join(f"{held}.n{k}" for k in range(axis + 1, type_.rank))

    def truth(self, value: Value, node: ast.AST) -> Value:
        """A value as a condition."""
        if value.is_known:
            known = bool(value.known)
            return Value("true" if known else "false", Scalar.BOOL, known=known)
        if value.type is Scalar.BOOL:
            return value
        if value.type in (Scalar.INT, Scalar.FLOAT):
            text = f"{value.within(EQUAL + 1)} != 0"
            return Value(text, Scalar.BOOL, EQUAL, reads=value.reads, writes=value.writes)
        self.refuse(node, f"{words(value.type)} is a condition", "Compare with a number, or with `is None`.")

    def annotated(self, annotation: ast.expr | None, type_: Type) -> Type:
        """The type of a number by its annotation; an int for a float becomes a float."""
        if isinstance(annotation, ast.Constant) and isinstance(annotation.value, str):
            annotation = ast.parse(annotation.value, mode="eval").body
        if isinstance(annotation, ast.Name) and isinstance(type_, Scalar):
            least = {"float": Scalar.FLOAT, "int": Scalar.INT}.get(annotation.id, type_)
            return max(type_, least)
        if isinstance(annotation, ast.Subscript) and isinstance(type_, TupleType) and not type_.name:
            inner = annotation.slice.elts if isinstance(annotation.slice, ast.Tuple) else [annotation.slice]
            if len(inner) == len(type_.types):
                return plain_tuple(*(self.annotated(*pair) for pair in zip(inner, type_.types, strict=True)))
        return type_

    def zero(self, type_: Type) -> str:
        """Initial value of a variable."""
        if isinstance(type_, Nothing | TupleType | ArrayType):
            return "{0}"
        return "false" if type_ is Scalar.BOOL else "0.0" if type_ >= Scalar.FLOAT else "0"
