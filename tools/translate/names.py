"""Names in the source of a function: counts, and loops that own their variable. They are computed once per node."""

from __future__ import annotations

import ast
from collections import Counter
from collections.abc import Iterable
from functools import cache
from typing import Final

RANGES: Final = ("range", "independent")  # names of range in kernels


@cache
def _names(node: ast.AST) -> Counter[tuple[str, type[ast.expr_context]]]:
    """Counts of the names in a statement, by context."""
    found = Counter({(node.id, type(node.ctx)): 1} if isinstance(node, ast.Name) else {})
    for child in ast.iter_child_nodes(node):
        found.update(_names(child))
    return found


def names_in(nodes: Iterable[ast.AST]) -> Counter[str]:
    """Counts of the names in statements."""
    found: Counter[str] = Counter()
    for node in nodes:
        for (name, _), count in _names(node).items():
            found[name] += count
    return found


def stored_in(nodes: Iterable[ast.AST], context: type[ast.expr_context] = ast.Store) -> set[str]:
    """Names that statements assign, or names that they use in another context."""
    return {name for node in nodes for name, kind in _names(node) if kind is context}


@cache
def as_load(target: ast.expr) -> ast.expr:
    """The target of `x += y` as an expression, at the same location in the source."""
    load = ast.parse(ast.unparse(target), mode="eval").body
    for part in ast.walk(load):
        ast.copy_location(part, target)
    return load


@cache
def own_loops(function: ast.FunctionDef) -> frozenset[ast.For]:
    """Loops over range that are not nested, whose variable occurs only in such loops and is not assigned in them."""
    loops = [each for each in ast.walk(function) if isinstance(each, ast.For) and _over_range(each)]
    counts = names_in(function.body)
    parameters = {each.arg for each in function.args.args}
    found = set[ast.For]()
    for name in {each.target.id for each in loops if isinstance(each.target, ast.Name)} - parameters:
        same = [each for each in loops if isinstance(each.target, ast.Name) and each.target.id == name]
        stored = any(name in stored_in(each.body) for each in same)  # therefore the loops are not nested
        if not stored and sum(names_in([each])[name] for each in same) == counts[name]:
            found.update(same)
    return frozenset(found)


def _over_range(loop: ast.For) -> bool:
    """True if a loop runs over range."""
    return isinstance(loop.iter, ast.Call) and isinstance(loop.iter.func, ast.Name) and loop.iter.func.id in RANGES
