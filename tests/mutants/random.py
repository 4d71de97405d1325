"""Random mistakes: one operator, sign or number of the source is changed."""

from __future__ import annotations

import ast
import random
from collections.abc import Iterator
from pathlib import Path
from typing import Final, NamedTuple

OPERATORS: Final = {ast.Add: "-", ast.Sub: "+", ast.Mult: "/", ast.Div: "*"}
COMPARISONS: Final = {ast.Lt: ">=", ast.LtE: ">", ast.Gt: "<=", ast.GtE: "<", ast.Eq: "!=", ast.NotEq: "=="}


class Change(NamedTuple):
    """A changed source file.

    Attributes:
        file: Path below the folder of the sources.
        line: Line of the change.
        old: Expression before.
        new: Expression now.
        source: Text of the whole file with the change.
    """

    file: Path
    line: int
    old: str
    new: str
    source: str


def changes(sources: Path, count: int, seed: int) -> Iterator[Change]:
    """Choose changes at random; each expression of all files has the same chance."""
    chance = random.Random(seed)
    files = sorted(sources.rglob("*.py"))
    texts = [file.read_text(encoding="utf-8") for file in files]
    trees = [(k, text, node) for k, text in enumerate(texts) for node in ast.walk(ast.parse(text))]
    places = [(k, node) for k, text, node in trees if isinstance(node, ast.expr) and _new(node, text)]
    for k, node in chance.sample(places, count):
        old, new = ast.get_source_segment(texts[k], node), _new(node, texts[k])
        assert old is not None
        lines = texts[k].splitlines(keepends=True)
        start = sum(map(len, lines[: node.lineno - 1])) + len(
            lines[node.lineno - 1].encode()[: node.col_offset].decode()
        )
        source = texts[k][:start] + new + texts[k][start + len(old) :]
        yield Change(files[k].relative_to(sources), node.lineno, old, new, source)


def _new(node: ast.expr, source: str) -> str:
    """Changed text of a numerical expression; empty if no change applies."""
    if isinstance(node, ast.BinOp) and type(node.op) in OPERATORS and not _is_text(node):
        left, right = (ast.get_source_segment(source, side) for side in (node.left, node.right))
        return f"(({left}) {OPERATORS[type(node.op)]} ({right}))"
    if isinstance(node, ast.Compare) and len(node.ops) == 1 and type(node.ops[0]) in COMPARISONS:
        left, right = (ast.get_source_segment(source, side) for side in (node.left, node.comparators[0]))
        return f"(({left}) {COMPARISONS[type(node.ops[0])]} ({right}))"
    if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub):
        return f"({ast.get_source_segment(source, node.operand)})"
    if isinstance(node, ast.BoolOp):
        word = " or " if isinstance(node.op, ast.And) else " and "
        return "(" + word.join(f"({ast.get_source_segment(source, each)})" for each in node.values) + ")"
    return ""


def _is_text(node: ast.BinOp) -> bool:
    """True if an operand is a literal text or list, which an operator of numbers does not accept."""
    return any(isinstance(each, ast.JoinedStr | ast.List | ast.Tuple) or isinstance(getattr(each, "value", None), str)
               for each in (node.left, node.right))  # fmt: skip
