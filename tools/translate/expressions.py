"""Expressions in C: names, operators with Python's meaning, conditions, elements and views of arrays."""

from __future__ import annotations

import ast
import builtins
import math
import operator
from collections.abc import Callable, Sequence
from types import ModuleType
from typing import Any, Final

import numpy as np

from tools.translate.scope import (
    AND,
    ATOM,
    CHOICE,
    COMPARE,
    EQUAL,
    OR,
    PLUS,
    TIMES,
    UNARY,
    UNSET,
    NoTypeYetError,
    Scope,
    Value,
    identifier,
)
from tools.translate.types import NONE, ArrayType, Scalar, TupleType, Type, words

ARITHMETIC: Final[dict[type[ast.operator], tuple[str, int, Callable[[Any, Any], Any]]]] = {
    ast.Add: ("+", PLUS, operator.add),
    ast.Sub: ("-", PLUS, operator.sub),
    ast.Mult: ("*", TIMES, operator.mul),
}
BITS: Final[dict[type[ast.operator], str]] = {
    ast.LShift: "<<",
    ast.RShift: ">>",
    ast.BitAnd: "&",
    ast.BitOr: "|",
    ast.BitXor: "^",
}
COMPARISONS: Final[dict[type[ast.cmpop], tuple[str, Callable[[Any, Any], Any]]]] = {
    ast.Lt: ("<", operator.lt),
    ast.LtE: ("<=", operator.le),
    ast.Gt: (">", operator.gt),
    ast.GtE: (">=", operator.ge),
    ast.Eq: ("==", operator.eq),
    ast.NotEq: ("!=", operator.ne),
}


class Expressions(Scope):
    """Expressions of one function."""

    def expression(self, node: ast.expr) -> Value:
        """Value of an expression."""
        match node:
            case ast.Constant():
                return self.constant(node.value, node)
            case ast.Name() | ast.Attribute():
                static = self.static(node)
                if static is not UNSET:
                    return self.constant(static, node)
                return self.variable(node) if isinstance(node, ast.Name) else self.attribute(node)
            case ast.Tuple():
                return self.tuple_of(self.listed(node.elts), node)
            case ast.UnaryOp():
                return self.unary(node)
            case ast.BinOp():
                left, right = self.operands([node.left, node.right])
                return self.binary(left, node.op, right, node)
            case ast.BoolOp():
                return self.boolean(node)
            case ast.Compare():
                return self.comparison(node)
            case ast.IfExp():
                return self.choice(node)
            case ast.Subscript():
                return self.subscript(node)
            case ast.Call():
                return self.call(node)
        self.refuse(node, f"{type(node).__name__}: {ast.unparse(node)}", "Write it with loops, indices and operators.")

    def call(self, node: ast.Call) -> Value:
        """Value of a call."""
        raise NotImplementedError

    def subscript(self, node: ast.Subscript) -> Value:
        """An element or a view of an array, or an item of a tuple."""
        raise NotImplementedError

    # ---- names and constants

    def static(self, node: ast.expr) -> Any:
        """Value of a global name or of an attribute of a module; UNSET for other expressions."""
        if isinstance(node, ast.Name) and node.id not in self.locals:
            found = self.function.__globals__.get(node.id, getattr(builtins, node.id, UNSET))
            if found is UNSET:
                self.refuse(node, f"the name {node.id} is not defined", "Import it at the top of the module.")
            return found
        if isinstance(node, ast.Attribute):
            module = self.static(node.value)
            if isinstance(module, ModuleType):
                return getattr(module, node.attr)
        return UNSET

    def constant(self, value: Any, node: ast.AST) -> Value:
        """A value that is known during translation."""
        if value is None:
            return Value("", NONE, known=None)
        if isinstance(value, bool | np.bool_):
            return Value("true" if value else "false", Scalar.BOOL, known=bool(value))
        if isinstance(value, int | np.integer):
            text = str(int(value)) if abs(int(value)) < 2**31 else f"INT64_C({int(value)})"
            return Value(text, Scalar.INT, UNARY if value < 0 else ATOM, known=int(value))
        if isinstance(value, float | np.floating):
            number = float(value)
            sign = "-" if math.copysign(1.0, number) < 0.0 else ""
            text = "NAN" if math.isnan(number) else f"{sign}INFINITY" if math.isinf(number) else repr(number)
            return Value(text, Scalar.FLOAT, UNARY if sign else ATOM, known=number)
        if isinstance(value, tuple):
            return self.tuple_of([self.constant(each, node) for each in value], node)
        if isinstance(value, np.ndarray):
            name, type_ = self.program.table(value, node.id if isinstance(node, ast.Name) else "table")
            self.constants[name] = None
            return Value(name, type_)
        self.refuse(node, f"a constant of type {type(value).__name__}", "Use numbers, tuples and arrays of numbers.")

    def variable(self, node: ast.Name) -> Value:
        """A parameter or an assigned name."""
        type_ = self.types.get(node.id)
        if type_ is None:
            raise NoTypeYetError
        self.read.add(node.id)
        if node.id not in self.declared:  # read before it is assigned, in the order of lines
            self.declared.add(node.id)
            self.above[node.id] = None
        return Value(identifier(node.id), type_, known=None if type_ == NONE else UNSET)

    def attribute(self, node: ast.Attribute) -> Value:
        """A field of a NamedTuple, the sizes of an array, the parts of a complex number."""
        value = self.expression(node.value)
        type_ = value.type
        if isinstance(type_, TupleType) and node.attr in type_.fields:
            place = type_.fields.index(node.attr)
            if value.items is not None and not value.writes:
                return value.items[place]
            return self.field(self.hold(value), node.attr, type_.types[place])
        if isinstance(type_, ArrayType) and node.attr in ("shape", "size"):
            held = self.hold(value).text
            sizes = [Value(f"{held}.n{axis}", Scalar.INT) for axis in range(type_.rank)]
            if node.attr == "shape":
                return self.tuple_of(sizes, node)
            return Value(" * ".join(each.text for each in sizes), Scalar.INT, TIMES if len(sizes) > 1 else ATOM)
        if isinstance(type_, Scalar) and node.attr in ("real", "imag"):
            if type_ is Scalar.COMPLEX:
                return Value(f"c{node.attr}({value.text})", Scalar.FLOAT, reads=value.reads, writes=value.writes)
            return value if node.attr == "real" else self.constant(0.0, node)
        self.refuse(node, f"{words(type_)} has no {node.attr} here", "Use fields of NamedTuples, .shape, .size, .real.")

    def listed(self, nodes: Sequence[ast.expr]) -> list[Value]:
        """Values of a list of expressions; starred tuples are unpacked."""
        plain = [node.value if isinstance(node, ast.Starred) else node for node in nodes]
        found: list[Value] = []
        for node, value in zip(nodes, self.operands(plain), strict=True):
            found += self.parts(value, node) if isinstance(node, ast.Starred) else (value,)
        return found

    # ---- operators

    def unary(self, node: ast.UnaryOp) -> Value:
        """A sign, `not` or `~`."""
        value = self.expression(node.operand)
        if isinstance(node.op, ast.Not):
            truth = self.truth(value, node)
            if truth.is_known:
                return self.constant(not truth.known, node)
            return Value(f"!{truth.within(UNARY)}", Scalar.BOOL, UNARY, reads=value.reads, writes=value.writes)
        if not isinstance(value.type, Scalar) or (isinstance(node.op, ast.Invert) and value.type is not Scalar.INT):
            self.refuse(node, f"a sign of {words(value.type)}", "Use numbers; ~ takes integers only.")
        if isinstance(node.op, ast.UAdd):
            return value
        if value.is_known and isinstance(node.op, ast.USub):
            return self.constant(-value.known, node)
        sign, type_ = "-" if isinstance(node.op, ast.USub) else "~", max(value.type, Scalar.INT)
        inner = f"({value.text})" if value.text.startswith("-") else value.within(UNARY)
        return Value(f"{sign}{inner}", type_, UNARY, reads=value.reads, writes=value.writes)

    def binary(self, left: Value, op: ast.operator, right: Value, node: ast.AST) -> Value:
        """An operation of two numbers, or the concatenation of two tuples."""
        kind = type(op)
        if isinstance(left.type, TupleType) and isinstance(right.type, TupleType) and kind is ast.Add:
            return self.tuple_of([*self.parts(left, node), *self.parts(right, node)], node)
        if not isinstance(left.type, Scalar) or not isinstance(right.type, Scalar):
            found = f"{kind.__name__} of {words(left.type)} and {words(right.type)}"
            self.refuse(node, found, "Loop over the elements of arrays.")
        type_ = max(left.type, right.type, Scalar.INT)
        if kind in ARITHMETIC:
            symbol, level, known = ARITHMETIC[kind]
            if left.is_known and right.is_known:
                return self.constant(known(left.known, right.known), node)
            if type_ is Scalar.COMPLEX and kind is ast.Mult:
                return self.helper("sl_multiply", Scalar.COMPLEX, left, right)
            return self._infix(left, symbol, right, type_, level)
        if kind is ast.Div:
            if type_ is Scalar.COMPLEX:
                return self.helper("sl_divide", Scalar.COMPLEX, left, right)
            if type_ is Scalar.INT and not left.is_known and not right.is_known:
                left = Value(f"(double){left.within(UNARY)}", Scalar.FLOAT, UNARY, reads=left.reads, writes=left.writes)
            return self._infix(left, "/", right, Scalar.FLOAT, TIMES)
        if kind in (ast.FloorDiv, ast.Mod) and type_ is not Scalar.COMPLEX:
            name = "sl_floor_divide" if kind is ast.FloorDiv else "sl_modulo"
            return self.helper(name if type_ is Scalar.INT else f"{name}_float", type_, left, right)
        if kind is ast.Pow:
            return self._power(left, right, node)
        if kind in BITS and type_ is Scalar.INT:
            return self._bits(left, BITS[kind], right)
        self.refuse(node, f"operator {kind.__name__} of {words(type_)}", "Use + - * / // % ** and bits of integers.")

    def _infix(self, left: Value, symbol: str, right: Value, type_: Scalar, level: int) -> Value:
        """An operator of C between two numbers of the same type, or of types that C converts the same way."""
        one, other = self.widened(left, type_), self.widened(right, type_)
        text = f"{one.within(level)} {symbol} {other.within(level + 1)}"
        return Value(text, type_, level, reads=left.reads or right.reads, writes=left.writes or right.writes)

    def helper(self, name: str, type_: Scalar, *values: Value) -> Value:
        """A call of a helper function."""
        texts = ", ".join(self.widened(each, type_).text for each in values)
        reads, writes = any(each.reads for each in values), any(each.writes for each in values)
        return Value(f"{name}({texts})", type_, reads=reads, writes=writes)

    def _bits(self, left: Value, symbol: str, right: Value) -> Value:
        """An operator of integers, all operands in parentheses."""
        first = f"(int64_t){left.within(UNARY)}" if symbol == "<<" and left.is_known else left.within(UNARY)
        both = left.type is Scalar.BOOL and right.type is Scalar.BOOL and symbol in "&|^"
        text = f"({first} {symbol} {right.within(UNARY)})"
        reads, writes = left.reads or right.reads, left.writes or right.writes
        return Value(text, Scalar.BOOL if both else Scalar.INT, reads=reads, writes=writes)

    def _power(self, base: Value, exponent: Value, node: ast.AST) -> Value:
        """A power: by repeated squaring for whole exponents, as in numba; else the power of C."""
        assert isinstance(base.type, Scalar)
        assert isinstance(exponent.type, Scalar)
        if base.is_known and exponent.is_known:
            return self.constant(base.known**exponent.known, node)
        reads, writes = base.reads or exponent.reads, base.writes or exponent.writes
        if exponent.is_known and exponent.type is Scalar.INT and exponent.known >= 0 and base.type is Scalar.INT:
            return Value(f"sl_power_int({base.text}, {exponent.text})", Scalar.INT, reads=reads, writes=writes)
        if base.type is Scalar.FLOAT and exponent.is_known and exponent.known == 2:
            return self.helper("sl_square", Scalar.FLOAT, base)
        if base.type is Scalar.FLOAT and exponent.type is Scalar.INT:
            return Value(f"sl_power({base.text}, {exponent.text})", Scalar.FLOAT, reads=reads, writes=writes)
        if exponent.type is Scalar.FLOAT and base.type is not Scalar.COMPLEX:
            return self.helper("pow", Scalar.FLOAT, base, exponent)
        self.refuse(node, "a power of integers with an exponent that varies", "Multiply in a loop, or use floats.")

    # ---- conditions

    def boolean(self, node: ast.BoolOp) -> Value:
        """`and`, `or`: && and || of C, or nested ifs if an operand requires separate lines."""
        stops = isinstance(node.op, ast.Or)
        found: list[tuple[list[str], Value]] = []
        for operand in node.values:
            with self.aside(deeper=len(found) > 0) as lines:
                value = self.expression(operand)
                if not value.is_known and value.type is not Scalar.BOOL:
                    self.refuse(operand, f"{words(value.type)} as operand of `and` or `or`", "Compare it, x != 0.")
                value = self.truth(value, operand)
            if not value.is_known:
                found.append((lines, value))
            elif value.known == stops:
                found.append((lines, value))
                break
        if not found or (len(found) == 1 and found[0][1].is_known):
            return self.constant(stops if found else not stops, node)
        self.lines += found[0][0]
        level, symbol = (OR, "||") if stops else (AND, "&&")
        writes, reads = any(value.writes for _, value in found), any(value.reads for _, value in found)
        if len(found) == 1:
            return found[0][1]
        if not any(lines for lines, _ in found[1:]):
            text = f" {symbol} ".join(value.within(EQUAL) for _, value in found)
            return Value(text, Scalar.BOOL, level, reads=reads, writes=writes)
        name = self.temporary()
        self.emit(f"bool {name} = {found[0][1].text};")
        for lines, value in found[1:]:
            self.emit(f"if ({'!' if stops else ''}{name}) {{")
            self.lines += lines
            self.emit(f"    {name} = {value.text};")
            self.emit("}")
        self.written += writes
        return Value(name, Scalar.BOOL)

    def comparison(self, node: ast.Compare) -> Value:
        """A comparison, or a chain of them."""
        if isinstance(node.ops[0], ast.Is | ast.IsNot):
            return self._is_none(node)
        values = self.operands([node.left, *node.comparators])
        if isinstance(node.ops[0], ast.In | ast.NotIn):
            left = self.hold(values[0]) if values[0].writes else values[0]
            items = self.parts(values[1], node)
            text = " || ".join(f"{left.within(EQUAL + 1)} == {item.within(EQUAL + 1)}" for item in items)
            inside = Value(text, Scalar.BOOL, OR if len(items) > 1 else EQUAL, reads=left.reads)
            return inside if isinstance(node.ops[0], ast.In) else Value(f"!({text})", Scalar.BOOL, UNARY)
        for value in values:
            if not isinstance(value.type, Scalar):
                self.refuse(node, f"{words(value.type)} is compared", "Compare numbers; None with `is`.")
        values[1:-1] = [self.hold(value) if value.writes else value for value in values[1:-1]]
        found = []
        for k, op in enumerate(node.ops):
            symbol, known = COMPARISONS[type(op)]
            one, other = values[k], values[k + 1]
            if len(node.ops) == 1 and one.is_known and other.is_known:
                return self.constant(known(one.known, other.known), node)
            found.append(f"{one.within(COMPARE + 1)} {symbol} {other.within(COMPARE + 1)}")
        reads, writes = any(value.reads for value in values), any(value.writes for value in values)
        level = EQUAL if len(found) == 1 else AND
        return Value(" && ".join(found), Scalar.BOOL, level, reads=reads, writes=writes)

    def _is_none(self, node: ast.Compare) -> Value:
        """`is None`, decided by the type."""
        left, right = self.operands([node.left, node.comparators[0]])
        if right.type != NONE or len(node.ops) != 1:
            self.refuse(node, "`is` compares other things than None", "Compare numbers with ==.")
        return self.constant((left.type == NONE) == isinstance(node.ops[0], ast.Is), node)

    def choice(self, node: ast.IfExp) -> Value:
        """`a if b else c`: the operator ?: of C, or if and else if a side requires separate lines."""
        test = self.truth(self.expression(node.test), node.test)
        if test.is_known:
            return self.expression(node.body if test.known else node.orelse)
        with self.aside(deeper=1) as first:
            one = self.expression(node.body)
        with self.aside(deeper=1) as second:
            other = self.expression(node.orelse)
        type_ = self.joined(node, one.type, other.type, "the conditional expression")
        texts = []
        for lines, value in ((first, one), (second, other)):
            with self.aside(deeper=1) as more:
                texts.append(self.converted(value, type_, node))
            lines += more
        writes = test.writes or one.writes or other.writes
        if not first and not second:
            sides = [
                f"({text})" if value.level <= CHOICE else text for text, value in zip(texts, (one, other), strict=True)
            ]
            text = f"{test.within(OR)} ? {sides[0]} : {sides[1]}"
            return Value(text, type_, CHOICE, reads=test.reads or one.reads or other.reads, writes=writes)
        return self._branches(test, type_, (first, second), texts, writes)

    def _branches(
        self, test: Value, type_: Type, sides: tuple[list[str], list[str]], texts: list[str], writes: bool
    ) -> Value:
        """A conditional expression as statements."""
        name = self.temporary()
        self.emit(f"{self.program.c_type(type_)} {name};")
        self.emit(f"if ({test.text}) {{")
        for lines, text, end in zip(sides, texts, ("} else {", "}"), strict=True):
            self.lines += lines
            self.emit(f"    {name} = {text};")
            self.emit(end)
        self.written += writes
        return Value(name, type_)
