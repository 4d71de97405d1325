"""Bounds of the expressions of a kernel, and the operations that they take."""

from __future__ import annotations

import ast
import builtins
import inspect
from collections.abc import Callable
from functools import reduce
from types import FunctionType, ModuleType
from typing import Any, Final

import numpy as np

from tools.translate.extents import (
    FLAG,
    FLOAT,
    NOTHING,
    ONE,
    ZERO,
    Array,
    Int,
    Other,
    Polynomial,
    Record,
    Value,
    constant,
    evaluated,
    exactly,
    joined,
)
from tools.translate.types import TranslationError

UNSET: Final = object()


class Values:
    """Expressions of one function.

    Attributes:
        names: Bounds of the variables.
        memory: Largest numbers of elements taken from each work array.
        cost: Operations so far.
    """

    def __init__(self, function: FunctionType, names: dict[str, Value], memory: dict[str, Polynomial]) -> None:
        """Begin without operations."""
        self.function, self.names, self.memory = function, names, memory
        self.cost = ZERO

    def kernel(self, function: FunctionType, arguments: tuple[Value, ...]) -> Value:
        """Result of another function of the kernels."""
        raise NotImplementedError

    def refuse(self, node: ast.AST, construct: str) -> TranslationError:
        """The error of a loop without a bound."""
        step = "Bound it by a constant or by the size of an array."
        return TranslationError(self.function.__code__.co_filename, getattr(node, "lineno", 0), construct, step)

    def value(self, node: ast.expr) -> Value:
        """Bounds of an expression."""
        match node:
            case ast.Constant():
                return self.known(node.value)
            case ast.Name() if node.id in self.names:
                return self.names[node.id]
            case ast.Name() | ast.Attribute() if (found := self.static(node)) is not UNSET:
                return self.known(found)
            case ast.Attribute():
                return self.attribute(self.value(node.value), node.attr)
            case ast.Tuple():
                return self.known(tuple(self.listed(node.elts)))
            case ast.UnaryOp():
                return self.unary(node)
            case ast.BinOp():
                return self.binary(node.op, self.value(node.left), self.value(node.right))
            case ast.BoolOp():
                return self.both(node)
            case ast.Compare():
                return self.comparison(node)
            case ast.IfExp():
                return self.choice(node)
            case ast.Subscript():
                return self.subscript(node)
            case ast.Call():
                return self.called(node)
        raise self.refuse(node, f"{type(node).__name__} has no bounds")

    def static(self, node: ast.expr) -> Any:
        """A global value, or an attribute of a module."""
        if isinstance(node, ast.Name):
            return self.function.__globals__.get(node.id, getattr(builtins, node.id, UNSET))
        owner = self.static(node.value) if isinstance(node, ast.Attribute) and self._rooted(node.value) else UNSET
        return getattr(owner, node.attr) if isinstance(owner, ModuleType) else UNSET  # type: ignore[attr-defined]

    def _rooted(self, node: ast.expr) -> bool:
        return isinstance(node, ast.Name) and node.id not in self.names

    def known(self, value: Any) -> Value:
        """Bounds of a Python value, or a tuple of bounds."""
        if isinstance(value, bool | np.bool_):
            return Other("flag", bool(value))
        if isinstance(value, int | np.integer):
            return exactly(int(value))
        if isinstance(value, np.ndarray):
            return Array(tuple(map(exactly, value.shape)), value.dtype.kind == "f")
        if isinstance(value, tuple):
            items = tuple(
                each if isinstance(each, Int | Other | Array | Record) else self.known(each) for each in value
            )
            return Record(("",) * len(items), items)
        return NOTHING if value is None else FLOAT

    @staticmethod
    def attribute(owner: Value, name: str) -> Value:
        """A field, or the sizes of an array."""
        if isinstance(owner, Record):
            return owner.items[owner.fields.index(name)]
        assert isinstance(owner, Array)
        if name == "shape":
            return Record(("",) * len(owner.sizes), owner.sizes)
        found = exactly(1)
        for size in owner.sizes:
            found = _product(found, size)
        return found

    def listed(self, nodes: list[ast.expr]) -> list[Value]:
        """Bounds of several expressions, starred tuples taken apart."""
        found: list[Value] = []
        for node in nodes:
            if isinstance(node, ast.Starred):
                many = self.value(node.value)
                assert isinstance(many, Record)
                found += many.items
            else:
                found.append(self.value(node))
        return found

    def unary(self, node: ast.UnaryOp) -> Value:
        """A sign, or not."""
        one = self.value(node.operand)
        if isinstance(node.op, ast.Not):
            return Other("flag", None if not isinstance(one, Other) or one.value is None else not one.value)
        if isinstance(node.op, ast.USub) and isinstance(one, Int):
            low = None if one.high is None else ZERO - one.high
            return Int(low, None if one.low is None else ZERO - one.low)
        return one

    def binary(self, op: ast.operator, one: Value, two: Value) -> Value:
        """An operation; an operation of floats counts."""
        if isinstance(one, Record) and isinstance(two, Record):
            return Record(one.fields + two.fields, one.items + two.items)
        if FLOAT in (one, two) or isinstance(op, ast.Div):
            self.cost = self.cost + ONE
            return FLOAT
        if not isinstance(one, Int) or not isinstance(two, Int):
            return Int() if isinstance(one, Int) or isinstance(two, Int) else FLAG
        if isinstance(op, ast.Add):
            low = None if one.low is None or two.low is None else one.low + two.low
            return Int(low, None if one.high is None or two.high is None else one.high + two.high)
        if isinstance(op, ast.Sub):
            low = None if one.low is None or two.high is None else one.low - two.high
            return Int(low, None if one.high is None or two.low is None else one.high - two.low)
        if isinstance(op, ast.Mult):
            return _product(one, two)
        if isinstance(op, ast.Mod) and two.known:
            return Int(ZERO, constant(two.known - 1))
        return Int(ZERO, one.high) if isinstance(op, ast.FloorDiv) and one.low == ZERO else Int()

    def both(self, node: ast.BoolOp) -> Value:
        """And, or: decided by known values."""
        stop = isinstance(node.op, ast.Or)
        found = Other("flag", not stop)
        for each in node.values:
            one = self.value(each)
            known = one.value if isinstance(one, Other) else None
            if known is stop:
                return Other("flag", stop)
            if known is None:
                found = FLAG
        return found

    def comparison(self, node: ast.Compare) -> Value:
        """A comparison of known integers, or with None, is decided."""
        values = [self.value(each) for each in (node.left, *node.comparators)]
        if len(values) == 2 and NOTHING in values and isinstance(node.ops[0], ast.Is | ast.IsNot):
            return Other("flag", (values[0] == values[1]) == isinstance(node.ops[0], ast.Is))
        numbers = [each.known if isinstance(each, Int) else None for each in values]
        if len(values) == 2 and None not in numbers:
            a, b = numbers
            text = ast.unparse(ast.Compare(ast.Constant(a), node.ops, [ast.Constant(b)]))
            return Other("flag", bool(eval(text)))
        return FLAG

    def choice(self, node: ast.IfExp) -> Value:
        """One of two values."""
        test = self.value(node.test)
        if isinstance(test, Other) and test.value is not None:
            return self.value(node.body if test.value else node.orelse)
        before = self.cost
        first = self.value(node.body)
        most, self.cost = self.cost, before
        second = self.value(node.orelse)
        self.cost = self.cost.most(most)
        return joined(first, second)

    def subscript(self, node: ast.Subscript) -> Value:
        """An element, a view, or an item."""
        base = self.value(node.value)
        places = list(node.slice.elts) if isinstance(node.slice, ast.Tuple) else [node.slice]
        if isinstance(base, Record):
            index = self.value(places[0])
            if isinstance(index, Int) and index.known is not None:
                return base.items[index.known]
            found: Value | None = None
            for each in base.items:
                found = joined(found, each)
            return found or NOTHING
        assert isinstance(base, Array)
        sizes: list[Int] = []
        start = base.start
        for size, place in zip(base.sizes, places, strict=False):
            if not isinstance(place, ast.Slice):
                self.value(place)
                continue
            lower = self.value(place.lower) if place.lower else exactly(0)
            upper = self.value(place.upper) if place.upper else size
            assert isinstance(lower, Int)
            assert isinstance(upper, Int)
            end = upper.high if upper.high is not None else size.high
            if base.memory:
                assert lower.low is not None
                assert lower.low == lower.high
                start = base.start + lower.low
                if place.upper and end is not None:
                    self.memory[base.memory] = self.memory.get(base.memory, ZERO).most(start + end)
            elif end is not None and lower.low is not None:
                end = end - lower.low
            sizes.append(Int(None, end))
        sizes += base.sizes[len(places) :]
        if sizes:
            part = isinstance(places[0], ast.Slice) and places[0].upper is None
            return Array(tuple(sizes), base.floating, base.memory if part else "", start if part else ZERO)
        return FLOAT if base.floating else Int()

    def called(self, node: ast.Call) -> Value:
        """A call of a function of the kernels, of Python or of C."""
        if isinstance(node.func, ast.Attribute) and node.func.attr == "reshape":
            array, sizes = self.value(node.func.value), self.listed(node.args)
            assert isinstance(array, Array)
            many = sizes[0].items if isinstance(sizes[0], Record) else sizes
            return Array(tuple(each for each in many if isinstance(each, Int)), array.floating)
        target: Any = self.static(node.func)
        function: Any = getattr(target, "py_func", target)
        arguments = tuple(self.listed(node.args))
        fields: tuple[str, ...] | None = getattr(function, "_fields", None)
        if inspect.isclass(target) and fields is not None:
            defaults: dict[str, Any] = getattr(function, "_field_defaults")  # noqa: B009, types know no NamedTuple here
            return Record(fields, arguments + tuple(self.known(defaults[name]) for name in fields[len(arguments) :]))
        if isinstance(function, FunctionType):
            return self.kernel(function, arguments)
        return self.builtin(function, arguments)

    def builtin(self, function: Any, arguments: tuple[Value, ...]) -> Value:
        """A function of Python or of the C library."""
        if len(arguments) == 1 and isinstance(arguments[0], Record) and function in (min, max):
            arguments = arguments[0].items
        numbers = [each for each in arguments if isinstance(each, Int)]
        if function is len:
            one = arguments[0]
            return one.sizes[0] if isinstance(one, Array) else exactly(len(one.items) if isinstance(one, Record) else 0)
        if function in (min, max) and len(numbers) == len(arguments):
            return _extreme(function is min, numbers)
        if function in (int, round) or getattr(function, "__name__", "") in ("ceil", "floor", "int64"):
            return arguments[0] if numbers else Int()
        if function is abs and numbers:
            return Int(ZERO)
        if function is bool or getattr(function, "__name__", "") in ("isnan", "isinf", "isfinite"):
            return FLAG
        self.cost = self.cost + (ZERO if function in (min, max, abs, float) else ONE)
        return FLOAT


def _extreme(least: bool, numbers: list[Int]) -> Int:
    """Bounds of the least or the largest of integers."""
    lows, highs = [each.low for each in numbers], [each.high for each in numbers]
    if not least:  # any lower bound holds, and all upper bounds together
        return Int(next((each for each in lows if each is not None), None), _all(highs, Polynomial.most))
    known = [each for each in highs if each is not None]
    return Int(_all(lows, Polynomial.least), min(known, key=_ordinary_size) if known else None)


def _ordinary_size(bound: Polynomial) -> int:
    """Order of upper bounds by their size for a robot of six freedoms and two redundant cables."""
    return evaluated(bound, 6, 2)


def _all(bounds: list[Polynomial | None], rule: Callable[[Polynomial, Polynomial], Polynomial]) -> Polynomial | None:
    """A bound of all values, if all their bounds are known."""
    known = [each for each in bounds if each is not None]
    return reduce(rule, known) if len(known) == len(bounds) else None


def _product(one: Int, two: Int) -> Int:
    """Product of integers that are not negative."""
    low = one.low * two.low if one.low is not None and two.low is not None else None
    return Int(low, one.high * two.high if one.high is not None and two.high is not None else None)
