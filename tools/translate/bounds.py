"""Largest number of floating-point operations of a kernel, and the work memory that it takes.

The body is run with bounds instead of values. If known values do not decide a branch, its more expensive side counts.
Statements after a return are added. A loop counts with the largest number of its passes. A loop over an unknown count
is bounded by the array that its variable indexes. Operations are + - * / of floats; a function of the C library counts
as one.
"""

from __future__ import annotations

import ast
from types import FunctionType
from typing import Any, Final

from tools.translate.extents import (
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
    exactly,
    joined,
    widened,
)
from tools.translate.names import RANGES
from tools.translate.operations import Values
from tools.translate.program import definition

Names = dict[str, Value]
PASSES: Final = 6  # over the body of a loop, until the bounds of its variables do not change


class Bounds:
    """Bounds of the functions that an entry calls.

    Attributes:
        memory: Largest numbers of elements taken from each work array.
    """

    def __init__(self) -> None:
        """Begin without functions."""
        self.memory: dict[str, Polynomial] = {}
        self._known: dict[tuple[FunctionType, tuple[Value, ...]], tuple[Value, Polynomial]] = {}

    def call(self, function: FunctionType, arguments: tuple[Value, ...]) -> tuple[Value, Polynomial]:
        """Bounds of the result of a function, and its largest number of operations."""
        key = (function, arguments)
        if key not in self._known:
            self._known[key] = _Body(self, function, arguments).run()
        return self._known[key]


class _Body(Values):
    """One function for one set of arguments."""

    def __init__(self, bounds: Bounds, function: FunctionType, arguments: tuple[Value, ...]) -> None:
        self.bounds, self.node = bounds, definition(function)
        parameters = (each.arg for each in self.node.args.args)
        super().__init__(function, dict(zip(parameters, arguments, strict=True)), bounds.memory)
        self.result: Value | None = None

    def kernel(self, function: FunctionType, arguments: tuple[Value, ...]) -> Value:
        """Result of another function; its operations count."""
        result, cost = self.bounds.call(function, arguments)
        self.cost = self.cost + cost
        return result

    def run(self) -> tuple[Value, Polynomial]:
        """Result and cost."""
        self.block(self.node.body)
        return self.result or NOTHING, self.cost

    def block(self, nodes: list[ast.stmt]) -> bool:
        """Run statements; True if they end with a return."""
        return any(self.statement(node) for node in nodes)

    def statement(self, node: ast.stmt) -> bool:
        """Run a statement; True if it returns on every path."""
        match node:
            case ast.Assign():
                value = self.value(node.value)
                for target in node.targets:
                    self.assign(target, value)
            case ast.AnnAssign(value=ast.expr() as given):
                self.assign(node.target, self.value(given))
            case ast.AugAssign():
                operation = ast.BinOp(_loaded(node.target), node.op, node.value)
                self.assign(node.target, self.value(ast.copy_location(operation, node)))
            case ast.Expr():
                self.value(node.value)
            case ast.Return():
                self.result = joined(self.result, self.value(node.value) if node.value else NOTHING)
                return True
            case ast.If():
                return self.branch(node)
            case ast.For():
                self.loop(node)
            case ast.While():
                raise self.refuse(node, "a while loop has no stated bound")
        return False

    def branch(self, node: ast.If) -> bool:
        """The side that is known to run, or the more expensive one."""
        test = self.value(node.test)
        if isinstance(test, Other) and test.value is not None:
            return self.block(node.body if test.value else node.orelse)
        before, cost = dict(self.names), self.cost
        first = self.block(node.body)
        names, most = self.names, self.cost
        self.names, self.cost = before, cost
        second = self.block(node.orelse)
        self.cost = self.cost.most(most)
        if second:
            self.names = names
        elif not first:
            self.names = _both(self.names, names)
        return first and second

    def loop(self, node: ast.For) -> None:
        """Run the body until the bounds of its variables do not change; its cost counts once for each pass."""
        assert isinstance(node.target, ast.Name)
        name = node.target.id
        variable, passes = self.range_of(node.iter)
        passes = passes if passes is not None else self._indexed(node, name)
        before = self.cost
        for _ in range(PASSES):
            start = dict(self.names)
            self.cost = ZERO
            self.names[name] = variable
            self.block(node.body)
            after = _both(start, self.names)
            self.names = {key: widened(start[key], value) if key in start else value for key, value in after.items()}
            if self.names == start:
                break
        self.cost = before + passes * self.cost

    def range_of(self, node: ast.expr) -> tuple[Value, Polynomial | None]:
        """Values of the variable of a loop, and the largest number of its passes; None if it is not known."""
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id in RANGES:
            numbers = [self.value(each) for each in node.args]
            assert all(isinstance(each, Int) for each in numbers)
            ends: list[Any] = numbers if len(numbers) > 1 else [exactly(0), *numbers]
            if len(ends) > 2 and ends[2].known == -1:
                low, high = (None if ends[1].low is None else ends[1].low + ONE), ends[0].high
            else:
                low, high = ends[0].low, None if ends[1].high is None else ends[1].high - ONE
            return Int(low, high), None if low is None or high is None else (high - low + ONE).most(ZERO)
        over = self.value(node)
        if isinstance(over, Record):
            found: Value | None = None
            for each in over.items:
                found = joined(found, each)
            return found or NOTHING, constant(len(over.items))
        assert isinstance(over, Array)
        return FLOAT if over.floating else Int(), over.sizes[0].high

    def _indexed(self, node: ast.For, name: str) -> Polynomial:
        """Size of the first array that a variable indexes."""
        for each in ast.walk(ast.Module(node.body, [])):
            if isinstance(each, ast.Subscript) and isinstance(each.value, ast.Name | ast.Attribute):
                indices = each.slice.elts if isinstance(each.slice, ast.Tuple) else [each.slice]
                for axis, index in enumerate(indices):
                    if isinstance(index, ast.Name) and index.id == name:
                        array = self.value(each.value) if self._defined(each.value) else None
                        if isinstance(array, Array) and (most := array.sizes[axis].high) is not None:
                            return most
        raise self.refuse(node, f"the loop over {ast.unparse(node.iter)} has no known bound")

    def _defined(self, node: ast.expr) -> bool:
        return node.id in self.names if isinstance(node, ast.Name) else self._defined(node.value)  # type: ignore[attr-defined]

    def assign(self, target: ast.expr, value: Value) -> None:
        """Store a value."""
        if isinstance(target, ast.Name):
            self.names[target.id] = value
        elif isinstance(target, ast.Tuple):
            assert isinstance(value, Record)
            for each, item in zip(target.elts, value.items, strict=True):
                self.assign(each, item)
        else:
            self.value(_loaded(target))


def _both(one: Names, two: Names) -> Names:
    """Variables after either of two branches."""
    return {name: joined(one.get(name), two[name]) if name in two else one[name] for name in {**one, **two}}


def _loaded(target: ast.expr) -> ast.expr:
    """The target of an assignment as an expression."""
    return ast.parse(ast.unparse(target), mode="eval").body
