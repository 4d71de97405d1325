"""Blocks of code of a page, and their execution: `python -m tools.pages.snippets PAGE` prints the page as executed.

The blocks of a page run in order, in one namespace and one folder. A block

- of `python` is run, unless the line `<!-- not run: why -->` is before it;
- of any kind is written to a file first, if the line `<!-- file: name -->` is before it;
- of `text title="output"` becomes what the blocks of Python before it printed since the last such block.
"""

from __future__ import annotations

import io
import re
import sys
from collections.abc import Iterator
from contextlib import redirect_stdout
from pathlib import Path
from textwrap import indent
from typing import Any, Final, NamedTuple

BLOCK: Final = re.compile(
    r"(?:^ *<!-- (?P<mark>not run|file): (?P<what>[^\n]+?) -->\n+)?"
    r"^(?P<indent> *)```(?P<kind>\w*)(?P<title>[^\n`]*)\n(?P<text>.*?)^(?P=indent)```$",
    re.MULTILINE | re.DOTALL,
)


class Block(NamedTuple):
    """A fenced block of a page; `mark` and `what` are of the line before it, `line` is its first line."""

    kind: str
    title: str
    mark: str | None
    what: str
    text: str
    line: int


def blocks(page: str) -> Iterator[Block]:
    """The blocks of a page."""
    return map(_block, BLOCK.finditer(page))


def executed(page: str, name: str) -> str:
    """A page with the output that its blocks of Python print when they are run in the current folder."""
    names: dict[str, Any] = {"__name__": "__main__"}
    printed = io.StringIO()

    def run(found: re.Match[str]) -> str:
        block = _block(found)
        if block.mark == "file":
            Path(block.what).write_text(block.text, encoding="utf-8")
        elif block.kind == "python" and block.mark is None:
            with redirect_stdout(printed):
                exec(compile("\n" * block.line + block.text, name, "exec"), names)
        elif (block.kind, block.title) == ("text", 'title="output"'):
            output = indent(printed.getvalue().rstrip() + "\n", found["indent"])
            printed.seek(printed.truncate(0))
            start, end = (place - found.start() for place in found.span("text"))
            return found[0][:start] + output + found[0][end:]
        return found[0]

    return BLOCK.sub(run, page)


def _block(found: re.Match[str]) -> Block:
    text = re.sub(f"^{found['indent']}", "", found["text"], flags=re.MULTILINE)
    line = found.string.count("\n", 0, found.start("text"))
    return Block(found["kind"], found["title"].strip(), found["mark"], found["what"] or "", text, line)


if __name__ == "__main__":
    file = Path(sys.argv[1])
    print(executed(file.read_text(encoding="utf-8"), file.name), end="")
