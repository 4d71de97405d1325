"""README and documentation: the code runs and prints what they say, the commands exist.

The blocks of a page run in order, in one namespace and one empty folder. A block

- of `python` is run, unless the line `<!-- not run: why -->` stands before it;
- of any kind is written to a file first, if the line `<!-- file: name -->` stands before it;
- of `text title="output"` must be what the blocks of Python before it printed since the last such block;
- of `sh` is not run, but its lines that begin with `sagline` must be understood by the command.

A line `<!-- drawn by: sagline ... -->` shows the figures that a command draws; it must be understood as well.
"""

import contextlib
import re
import shlex
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import pytest
import typer
import typer.main

from sagline.cli.main import app
from tests.tiers import extended

pytestmark = extended

ROOT = Path(__file__).parents[2]
WIDTH = 80  # columns that a page shows without scrolling
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
BLOCK = re.compile(
    r"(?:^ *<!-- (?P<mark>not run|file): (?P<what>[^\n]+?) -->\n+)?"
    r"^(?P<indent> *)```(?P<kind>\w*)(?P<title>[^\n`]*)\n(?P<text>.*?)^(?P=indent)```$",
    re.MULTILINE | re.DOTALL,
)


class Block(NamedTuple):
    """A fenced block of a page."""

    kind: str
    title: str
    mark: str | None
    what: str
    text: str
    line: int


def blocks(page: Path) -> Iterator[Block]:
    text = page.read_text(encoding="utf-8")
    for found in BLOCK.finditer(text):
        body = re.sub(f"^{found['indent']}", "", found["text"], flags=re.MULTILINE)
        line = text[: found.start("text")].count("\n")
        yield Block(found["kind"], found["title"].strip(), found["mark"], found["what"] or "", body, line)


def commands(page: Path) -> Iterator[str]:
    yield from re.findall(r"^<!-- drawn by: (sagline .+) -->$", page.read_text(encoding="utf-8"), re.MULTILINE)
    for block in blocks(page):
        if block.kind == "sh":
            for line in block.text.replace("\\\n", " ").splitlines():
                if line.removeprefix("$ ").startswith("sagline"):
                    yield line.removeprefix("$ ")


def name_of(page: Path) -> str:
    return str(page.relative_to(ROOT))


@pytest.mark.parametrize("page", PAGES, ids=name_of)
def test_the_code_runs_and_prints_what_the_page_says(
    page: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    for suffix in ("yaml", "csv"):
        for file in (ROOT / "examples").glob(f"*.{suffix}"):
            shutil.copy(file, tmp_path)
    names: dict[str, Any] = {"__name__": "__main__"}
    for block in blocks(page):
        if block.mark == "file":
            Path(block.what).write_text(block.text, encoding="utf-8")
        elif block.kind == "python" and block.mark is None:
            exec(compile("\n" * block.line + block.text, page, "exec"), names)
        elif (block.kind, block.title) == ("text", 'title="output"'):
            assert capsys.readouterr().out.rstrip() == block.text.rstrip(), f"{name_of(page)}, line {block.line}"


@pytest.mark.parametrize(
    "line", [pytest.param(line, id=f"{name_of(page)}: {line}") for page in PAGES for line in commands(page)]
)
def test_the_commands_exist(line: str) -> None:
    arguments = shlex.split(line, comments=True)[1:]
    whole: Any = typer.main.get_command(app)  # of click, which typer brings under its own name
    if not arguments or arguments[0].startswith("-"):
        with pytest.raises(typer.Exit):  # --help or --version, or no argument: it has said its word
            whole.make_context("sagline", arguments)
        return
    context = whole.make_context("sagline", arguments[:1])
    name, command, rest = context.command.resolve_command(context, arguments)
    with contextlib.suppress(typer.Exit):
        command.make_context(name, rest, parent=context)


def test_the_pages_are_found_and_their_blocks_too() -> None:
    assert ROOT / "docs" / "model.md" in PAGES
    assert [block.kind for block in blocks(ROOT / "README.md")].count("python") == 2


@pytest.mark.parametrize("page", PAGES, ids=name_of)
def test_no_line_of_code_is_wider_than_a_page(page: Path) -> None:
    lines = [(block.line + i, line) for block in blocks(page) for i, line in enumerate(block.text.splitlines(), 1)]
    assert [(number, line) for number, line in lines if len(line) > WIDTH] == []


@pytest.mark.parametrize("page", PAGES, ids=name_of)
def test_a_list_begins_after_an_empty_line(page: Path) -> None:
    prose = BLOCK.sub("", page.read_text(encoding="utf-8"))
    item = re.compile(r"^ *(?:[-*]|\d+\.) ", re.MULTILINE)
    paragraphs = [part.strip("\n") for part in re.split(r"\n\s*\n", prose)]
    assert [part for part in paragraphs if item.search(part) and not item.match(part)] == []  # else it is no list


@pytest.mark.parametrize("file", sorted(filter(Path.is_file, (ROOT / "examples").iterdir())), ids=name_of)
def test_no_line_of_an_example_is_wider_than_a_page(file: Path) -> None:
    lines = file.read_text(encoding="utf-8").splitlines() if file.suffix in (".py", ".yaml") else []
    assert [line for line in lines if len(line) > WIDTH] == []
