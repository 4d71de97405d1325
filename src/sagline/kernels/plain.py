"""Kernels as plain Python functions with the same results as the compiled code.

For a division by zero, the root of a negative number or an overflow, Python raises an exception. Compiled code gives
inf, NaN or 0. `plain` replaces such operations in the source of a kernel. An index outside an array, or the conversion
of inf or NaN to an integer, raises an exception only in plain Python.
"""

from __future__ import annotations

import ast
import copy
import inspect
import math
import textwrap
from collections.abc import Callable, Iterable
from types import FunctionType, SimpleNamespace
from typing import Any, Final, TypeVar

import numpy as np

F = TypeVar("F", bound=Callable[..., object])
ENTRY: Final = "entry"  # name of the decorator of kernels that Python calls


def plain(function: F) -> F:
    """`function` in plain Python, with the line numbers of its file. All functions called in it must also be plain."""
    # `function` is in the subset that docs/contributing/c-kernels.md defines.
    assert isinstance(function, FunctionType)
    lines, first = inspect.getsourcelines(function)
    module = ast.parse(textwrap.dedent("".join(lines)))
    ast.increment_lineno(module, first - 1)
    _Compiled().visit(module)
    # the replacements are variables of a function around the kernel, because the module of the kernel must not change
    around = ast.parse(f"def around({', '.join(REPLACEMENTS)}): return {function.__name__}")
    outer = around.body[0]
    assert isinstance(outer, ast.FunctionDef)
    outer.body[:0] = module.body
    tree, file = ast.fix_missing_locations(around), function.__code__.co_filename
    code = compile(tree, file, "exec", annotations.compiler_flag, dont_inherit=True)
    space: dict[str, Any] = {}
    exec(code, function.__globals__, space)
    found: F = space["around"](**REPLACEMENTS)
    found.__qualname__ = function.__qualname__
    return found


class _Compiled(ast.NodeTransformer):
    """Transformer that replaces the operations in which Python and compiled code differ."""

    def visit_FunctionDef(self, node: ast.FunctionDef) -> ast.AST:
        """Remove the decorator. The arguments of an entry may also be numbers of NumPy."""
        is_entry = any(getattr(each, "id", "") == ENTRY for each in node.decorator_list)
        node.decorator_list = []
        self.generic_visit(node)
        if is_entry:
            texts = [f"{each.arg} = _argument({each.arg})" for each in node.args.args]
            first = int(ast.get_docstring(node) is not None)
            node.body[first:first] = ast.parse("\n".join(texts)).body
        return node

    def visit_Name(self, node: ast.Name) -> ast.AST:
        """Replace functions of math and NumPy by functions that raise no exceptions."""
        return ast.copy_location(ast.Name("_math", node.ctx), node) if node.id in ("math", "np") else node

    def visit_Subscript(self, node: ast.Subscript) -> ast.AST:
        """Convert array elements to numbers of Python. Numbers of NumPy would warn, and their integers overflow."""
        self.generic_visit(node)
        return _call("_number", node) if isinstance(node.ctx, ast.Load) else node

    def visit_For(self, node: ast.For) -> ast.AST:
        """Convert the elements of a loop to numbers of Python."""
        self.generic_visit(node)
        node.iter = node.iter if isinstance(node.iter, ast.Call) else _call("_numbers", node.iter)
        return node

    def visit_AugAssign(self, node: ast.AugAssign) -> ast.AST:
        """Replace `a += b` by `a = a + b`."""
        target = copy.deepcopy(node.target)
        target.ctx = ast.Load()
        value = ast.copy_location(ast.BinOp(target, node.op, node.value), node)
        return self.visit(ast.copy_location(ast.Assign([node.target], value), node))

    def visit_BinOp(self, node: ast.BinOp) -> ast.AST:
        """Replace division, remainder and power."""
        self.generic_visit(node)
        name = OPERATORS.get(type(node.op))
        return _call(name, node.left, node.right) if name else node


def _call(name: str, *arguments: ast.expr) -> ast.Call:
    """A call of the replacement `name`, with the line number of the first argument."""
    return ast.copy_location(ast.Call(ast.Name(name, ast.Load()), list(arguments), []), arguments[0])


def _argument(value: Any) -> Any:
    """Convert all numbers in the argument `value` of an entry to numbers of Python."""
    return tuple(map(_argument, value)) if type(value) is tuple else _number(value)


def _number(value: Any) -> Any:
    """Convert a number of NumPy to a number of Python. Other values are returned unchanged."""
    return value.item() if isinstance(value, np.generic) else value


def _numbers(values: Iterable[Any]) -> Iterable[Any]:
    """Iterate over values, and convert each value to a number of Python."""
    return map(_number, values)


def _quotient(a: Any, b: Any) -> Any:
    """Quotient a / b. For b = 0, the result is infinite, with the product of both signs, or NaN if a = 0."""
    try:
        return a / b
    except ZeroDivisionError:
        if isinstance(a, complex) or isinstance(b, complex):
            return complex(math.nan, math.nan)
        return math.copysign(math.inf, a) * math.copysign(1.0, b) if a < 0 or a > 0 else math.nan


def _whole_quotient(a: Any, b: Any) -> Any:
    """Quotient a // b; if b = 0, the result is 0 for integers."""
    try:
        return a // b
    except ZeroDivisionError:
        return 0 if isinstance(a, int) and isinstance(b, int) else _quotient(a, b)


def _remainder(a: Any, b: Any) -> Any:
    """Remainder a % b; if b = 0, the result is 0 for integers and NaN for floats."""
    try:
        return a % b
    except ZeroDivisionError:
        return 0 if isinstance(a, int) and isinstance(b, int) else math.nan


def _power(base: Any, exponent: Any) -> Any:
    """Power base ** exponent; a power of a float with a whole exponent is computed by repeated squaring."""
    if isinstance(base, int) and isinstance(exponent, int) and exponent >= 0:
        return base**exponent
    if not isinstance(exponent, int):
        return MATH.pow(base, exponent)
    found, left = 1.0, abs(exponent)
    while left > 0:
        found, base, left = (found * base if left & 1 else found), base * base, left >> 1
    return _quotient(1.0, found) if exponent < 0 else found


def _hypotenuse(x: float, y: float) -> float:
    """Function hypot of the C library; the function `math.hypot` rounds differently."""
    try:
        return abs(complex(x, y))
    except OverflowError:
        return math.inf


def _without_exceptions(function: Callable[..., Any]) -> Callable[..., Any]:
    """A function of math that returns inf or NaN as NumPy does, instead of raising an exception."""

    def call(*arguments: float) -> Any:
        try:
            return function(*arguments)
        except (ValueError, OverflowError):
            with np.errstate(all="ignore"):
                return float(getattr(np, function.__name__)(*arguments))

    return call


_RAISING: Final = "acos acosh asin atanh cos cosh exp expm1 log log10 log1p log2 pow sin sinh sqrt tan"
MATH: Final = SimpleNamespace(
    **{
        **vars(math),
        **{name: _without_exceptions(getattr(math, name)) for name in _RAISING.split(" ")},
        "hypot": _hypotenuse,
    }
)
OPERATORS: Final[dict[type[ast.operator], str]] = {
    ast.Div: "_quotient",
    ast.FloorDiv: "_whole_quotient",
    ast.Mod: "_remainder",
    ast.Pow: "_power",
}
REPLACEMENTS: Final[dict[str, Any]] = {
    "_math": MATH,
    **{each.__name__: each for each in (_argument, _number, _numbers)},
    **{each.__name__: each for each in (_quotient, _whole_quotient, _remainder, _power)},
}
