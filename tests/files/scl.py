"""SCL without a compiler: statements of a function block in Python, and data blocks with the layout of TIA Portal."""

from __future__ import annotations

import re
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

SIZES = {"DInt": 4, "DWord": 4, "LReal": 8, "Real": 4, "Time": 4, "UDInt": 4, "UInt": 2}
START = {"Bool": False, "Int": 0, "UInt": 0, "UDInt": 0, "DInt": 0, "Real": 0.0, "LReal": 0.0}
FUNCTIONS = {
    "ABS": abs,
    "MAX": max,
    "MIN": min,
    "UINT_TO_INT": int,
    "INT_TO_UINT": int,
    "UDINT_TO_DWORD": int,
    "TIME_TO_DINT": int,
    "DINT_TO_LREAL": float,
}
STATEMENT = re.compile(r"\s*(IF\b.*?\bTHEN|ELSIF\b.*?\bTHEN|ELSE\b|FOR\b.*?\bDO\b|[^;]+;)", re.DOTALL)


class Array(list[Any]):
    """An array with indices from 1."""

    def __getitem__(self, index: Any) -> Any:
        assert 1 <= index <= len(self)
        return super().__getitem__(index - 1)

    def __setitem__(self, index: Any, value: Any) -> None:
        assert 1 <= index <= len(self)
        super().__setitem__(index - 1, value)


def without_comments(text: str) -> str:
    return re.sub(r"//[^\n]*", "", text)


def data_block(text: str, name: str) -> tuple[dict[str, tuple[str, int]], int]:
    """Type and offset of each value of a block, and its size: it begins at a word, and a structure ends at one."""
    body = without_comments(text).partition(f'DATA_BLOCK "{name}"')[2].partition("END_DATA_BLOCK")[0]
    assert "S7_Optimized_Access := 'FALSE'" in body
    rows = re.findall(r"(\w+) : (Array\[1\.\.(\d+)\] of Struct|\w+)|(END_STRUCT);", body.partition("STRUCT")[2])
    found: dict[str, tuple[str, int]] = {}
    at, inside, array = 0, list[tuple[str, str, int]](), ("", 0, 0)
    for row, kind, count, _ in rows:
        if count:
            array, inside, at = (row, int(count), at + at % 2), [], at + at % 2
            begin, at = at, 0
        elif not row and array[1]:
            size = at + at % 2
            for k in range(array[1]):
                found |= {f"{array[0]}[{k + 1}].{r}": (t, begin + k * size + o) for r, t, o in inside}
            at, array = begin + array[1] * size, ("", 0, 0)
        elif row:
            at += at % 2
            if array[1]:
                inside.append((row, kind, at))
            else:
                found[row] = (kind, at)
            at += SIZES[kind]
    return found, at + at % 2


def variables(text: str, name: str) -> SimpleNamespace:
    """Variables of a function block with their initial values."""
    head = without_comments(text).partition(f'FUNCTION_BLOCK "{name}"')[2].partition("\nBEGIN\n")[0]
    head = head.partition("VAR_INPUT")[2]
    declared = r"(\w+) : (?:Array\[1\.\.(\d+)\] of )?(\w+)(?: := ([^;]+))?|END_STRUCT"
    root = SimpleNamespace()
    where = root
    for row, size, kind, begin in re.findall(declared, head):
        if not row:
            where = root
        elif kind == "Struct":
            where = SimpleNamespace()
            setattr(root, row, where)
        else:
            assert not hasattr(where, row)
            value = float(begin) if begin else START[kind]
            setattr(where, row, Array([value] * int(size)) if size else value)
    return root


def function_block(text: str, name: str) -> Callable[[SimpleNamespace, SimpleNamespace], None]:
    """Statements as a function of the variables and data blocks; unknown statements are errors."""
    body = text.partition(f'FUNCTION_BLOCK "{name}"')[2].partition("\nBEGIN\n")[2].partition("END_FUNCTION_BLOCK")[0]
    lines, depth = ["def block(v, db):"], 1
    for statement in STATEMENT.findall(without_comments(body)):
        words = " ".join(statement.split()).rstrip(";").strip()
        if words in ("END_IF", "END_FOR"):
            depth -= 1
        elif words == "ELSE":
            lines.append("    " * (depth - 1) + "else:")
        elif found := re.fullmatch(r"(IF|ELSIF) (.*) THEN", words):
            depth += found[1] == "IF"
            lines.append("    " * (depth - 1) + f"{'if' if found[1] == 'IF' else 'elif'} {_expression(found[2])}:")
        elif found := re.fullmatch(r"FOR (#\w+) := (.+) TO (.+) DO", words):
            variable, first, last = (_expression(word) for word in found.groups())
            lines.append("    " * depth + f"for {variable} in range({first}, {last} + 1):")
            depth += 1
        elif words:
            target, expression = (_expression(word) for word in re.fullmatch(r"(.+?) := (.+)", words).groups())  # type: ignore[union-attr]
            lines.append("    " * depth + f"{target} = {expression}")
    assert depth == 1
    scope: dict[str, Any] = dict(FUNCTIONS)
    exec("\n".join(lines), scope)
    block: Callable[[SimpleNamespace, SimpleNamespace], None] = scope["block"]
    return block


def _expression(words: str) -> str:
    words = re.sub(r"16#([0-9A-F]+)", r"0x\1", words)
    words = re.sub(r'"(\w+)"', r"db.\1", words).replace("#", "v.").replace("<>", "!=")
    words = re.sub(r"(?<![<>!:])=", "==", words)
    for word, python in {"AND": "and", "OR": "or", "NOT": "not", "MOD": "%", "TRUE": "True", "FALSE": "False"}.items():
        words = re.sub(rf"\b{word}\b", python, words)
    assert not set(re.findall(r"\b[A-Z][A-Z_]+\b", words)) - set(FUNCTIONS), words
    return words
