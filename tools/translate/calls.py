"""Calls: other kernels, NamedTuples, functions of math, and the few built-in functions of the subset."""

from __future__ import annotations

import ast
import inspect
import math
from collections.abc import Callable
from types import FunctionType
from typing import Any, Final

import numpy as np

from tools.translate.indexing import Indexing
from tools.translate.scope import EQUAL, FAIL, SHORT, UNARY, Value
from tools.translate.text import MATH
from tools.translate.types import NONE, ArrayType, Scalar, TupleType, holds_array, words

FUNCTIONS: Final = {getattr(library, name): name for name in MATH for library in (math, np) if hasattr(library, name)}
TESTS: Final = {getattr(library, name): name for name in ("isnan", "isinf", "isfinite") for library in (math, np)}
ROUNDED: Final[dict[Callable[..., Any], str]] = {math.ceil: "ceil", math.floor: "floor", round: "rint"}
SUBSET: Final = "Call kernels, NamedTuples, functions of math, min, max, abs, int, float, bool, round, len."


class Calls(Indexing):
    """Calls of one function."""

    def call(self, node: ast.Call) -> Value:
        """Value of a call."""
        if node.keywords:
            self.refuse(node, f"the keyword argument {node.keywords[0].arg}", "Give arguments by position.")
        target = self.static(node.func)
        if isinstance(node.func, ast.Attribute) and node.func.attr == "reshape" and not callable(target):
            return self._reshape(node)
        if not callable(target):
            self.refuse(node, f"a call of {ast.unparse(node.func)}", SUBSET)
        arguments = self.listed(node.args)
        function = inspect.unwrap(target) if callable(target) else target
        if inspect.isclass(function) and issubclass(function, tuple) and hasattr(function, "_fields"):
            return self._record(function, arguments, node)
        if isinstance(function, FunctionType):
            return self._kernel(function, arguments, node)
        return self._builtin(function, arguments, node)

    def _record(self, class_: Any, arguments: list[Value], node: ast.Call) -> Value:
        """A NamedTuple; numbers take the type of their fields."""
        names: tuple[str, ...] = class_._fields
        arguments += [self.constant(class_._field_defaults[name], node) for name in names[len(arguments) :]]
        if len(arguments) != len(names):
            self.refuse(node, f"{len(arguments)} arguments of {class_.__name__}", f"Give its {len(names)} fields.")
        hints = [ast.Constant(getattr(hint, "__name__", None) or hint) for hint in class_.__annotations__.values()]
        types = tuple(self.annotated(hint, each.type) for hint, each in zip(hints, arguments, strict=True))
        return self.packed(TupleType(f"{class_.__module__}.{class_.__name__}", names, types), arguments, node)

    def _kernel(self, function: FunctionType, arguments: list[Value], node: ast.Call) -> Value:
        """A call of another function of the subset, for the types of its arguments."""
        callee = self.program.function(function, [each.type for each in arguments], self, node)
        self.calls[callee.name] = None
        pairs = zip(arguments, callee.parameters.values(), strict=True)
        texts = [self.converted(each, type_, node) for each, type_ in pairs if type_ != NONE]
        returned = callee.result
        if callee.fallible:
            self.fallible = True
            texts.append("sl_code")
        writes = any(map(holds_array, callee.parameters.values()))
        value = Value(f"{callee.name}({', '.join(texts)})", returned, reads=writes, writes=writes)
        if callee.fallible:
            if returned == NONE:
                self.emit(f"{value.text};")
                self.written += 1
                value = Value("", NONE, known=None)
            else:
                value = self.hold(value)
            self.emit(f"if (*sl_code != 0) {FAIL}")
        return value

    def _reshape(self, node: ast.Call) -> Value:
        """Contiguous array with other sizes; an array with another number of elements ends the entry with a code."""
        assert isinstance(node.func, ast.Attribute)
        array, *sizes = self.operands([node.func.value, *node.args])
        if len(sizes) == 1 and isinstance(sizes[0].type, TupleType):
            sizes = list(self.parts(sizes[0], node))
        if not isinstance(array.type, ArrayType) or array.type.strided:
            self.refuse(node, f"reshape of {words(array.type)}, with strides", "Reshape contiguous arrays.")
        if any(size.type is not Scalar.INT or (size.is_known and size.known < 0) for size in sizes):
            self.refuse(node, "reshape to sizes that are not positive integers", "Give all sizes.")
        held = self.hold(array)
        texts = [self.hold(size).text if not size.is_known else size.text for size in sizes]
        total = " * ".join(f"{held.text}.n{k}" for k in range(array.type.rank))
        self.fallible = True
        self.emit(f"if ({total} != {' * '.join(texts)}) {SHORT}")
        type_ = ArrayType(array.type.element, len(sizes), constant=array.type.constant)
        return Value(f"(({self.program.c_type(type_)}){{{', '.join([f'{held.text}.p', *texts])}}})", type_)

    def _builtin(self, target: Callable[..., Any], arguments: list[Value], node: ast.Call) -> Value:
        """A function of Python, math or NumPy."""
        if len(arguments) == 1 and target in (min, max) and isinstance(arguments[0].type, TupleType):
            arguments = list(self.parts(arguments[0], node))
        one = arguments[0] if arguments else Value("", NONE)
        if target is len and isinstance(one.type, TupleType):
            return self.constant(len(one.type.types), node)
        if target is len and isinstance(one.type, ArrayType):
            return Value(f"{self.hold(one).text}.n0", Scalar.INT)
        if not all(isinstance(each.type, Scalar) for each in arguments) or not arguments:
            self.refuse(node, f"{ast.unparse(node.func)} of {words(one.type)}", SUBSET)
        if target in FUNCTIONS and one.type is not Scalar.COMPLEX:
            return self.helper(FUNCTIONS[target], Scalar.FLOAT, *arguments)
        if target in TESTS and one.type is not Scalar.COMPLEX:
            text = f"{TESTS[target]}({self.widened(one, Scalar.FLOAT).text}) != 0"
            return Value(text, Scalar.BOOL, EQUAL, reads=one.reads, writes=one.writes)
        if target in ROUNDED:
            return self._cast("int64_t", Scalar.INT, self.helper(ROUNDED[target], Scalar.FLOAT, one))
        if target in (min, max):
            return self._extreme("sl_min" if target is min else "sl_max", arguments)
        return self._conversion(target, one, node)

    def _extreme(self, name: str, arguments: list[Value]) -> Value:
        """Minimum or maximum: the first argument, unless a later one is smaller or larger, as in Python."""
        found = arguments[0]
        for other in arguments[1:]:
            assert isinstance(found.type, Scalar)
            assert isinstance(other.type, Scalar)
            type_ = max(found.type, other.type, Scalar.INT)
            found = self.helper(name if type_ is Scalar.FLOAT else f"{name}_int", type_, found, other)
        return found

    def _conversion(self, target: Callable[..., Any], one: Value, node: ast.Call) -> Value:
        """abs, int, float or bool of a number."""
        scalar = one.type
        assert isinstance(scalar, Scalar)
        if target is abs:
            name = {Scalar.FLOAT: "fabs", Scalar.COMPLEX: "sl_absolute"}.get(scalar, "llabs")
            type_ = Scalar.INT if name == "llabs" else Scalar.FLOAT
            return Value(f"{name}({one.text})", type_, reads=one.reads, writes=one.writes)
        if target in (int, np.int64) and one.type is not Scalar.COMPLEX:
            return self._cast("int64_t", Scalar.INT, one)
        if target is float and one.type is not Scalar.COMPLEX:
            return self._cast("double", Scalar.FLOAT, one)
        if target is bool:
            return self.truth(one, node)
        self.refuse(node, f"{ast.unparse(node.func)} of {words(one.type)}", SUBSET)

    @staticmethod
    def _cast(c_type: str, type_: Scalar, one: Value) -> Value:
        """A conversion to another type of number."""
        return Value(f"({c_type}){one.within(UNARY)}", type_, UNARY, reads=one.reads, writes=one.writes)
