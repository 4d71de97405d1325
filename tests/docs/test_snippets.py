"""README and documentation: code prints the output on the page, and the commands exist; see tools/pages/snippets.py.

A line `<!-- drawn by: sagline ... -->` shows the figures of a command, which must be valid as well.
"""

import contextlib
import re
import shlex
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import typer
import typer.main

from sagline.cli.main import app
from tests.tiers import extended
from tools.pages.snippets import BLOCK, blocks, executed

pytestmark = extended

ROOT = Path(__file__).parents[2]
WIDTH = 80  # columns that a page shows without scrolling
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]


def commands(page: Path) -> Iterator[str]:
    text = page.read_text(encoding="utf-8")
    yield from re.findall(r"^<!-- drawn by: (sagline .+) -->$", text, re.MULTILINE)
    for block in blocks(text):
        if block.kind == "sh":
            for line in block.text.replace("\\\n", " ").splitlines():
                if line.removeprefix("$ ").startswith("sagline"):
                    yield line.removeprefix("$ ")


def name_of(page: Path) -> str:
    return str(page.relative_to(ROOT))


@pytest.mark.parametrize("page", PAGES, ids=name_of)
def test_the_code_prints_the_output_on_the_page(page: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    for suffix in ("yaml", "csv"):
        for file in (ROOT / "examples").glob(f"*.{suffix}"):
            shutil.copy(file, tmp_path)
    text = page.read_text(encoding="utf-8")
    assert executed(text, str(page)) == text


def test_a_page_shows_the_output_of_its_code(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    file = "  <!-- file: a.txt -->\n  ```yaml\n  7\n  ```\n\n"
    code = "```python\nfrom pathlib import Path\nx = Path('a.txt').read_text()\nprint(x)\n```\n"
    rest = "<!-- not run: why -->\n```python\nx = 8\n```\n\n```python\nprint(x)\nprint()\n```\n"
    page = file + code + '  ```text title="output"\n{}  ```\n' + rest + '```text title="output"\n{}```\n'
    assert executed(page.format("  old\n", ""), "page") == page.format("  7\n", "7\n")


@pytest.mark.parametrize(
    "line", [pytest.param(line, id=f"{name_of(page)}: {line}") for page in PAGES for line in commands(page)]
)
def test_the_commands_exist(line: str) -> None:
    arguments = shlex.split(line, comments=True)[1:]
    whole: Any = typer.main.get_command(app)  # typer contains click under another name
    if not arguments or arguments[0].startswith("-"):
        with pytest.raises(typer.Exit):  # --help, --version or no argument
            whole.make_context("sagline", arguments)
        return
    context = whole.make_context("sagline", arguments[:1])
    name, command, rest = context.command.resolve_command(context, arguments)
    with contextlib.suppress(typer.Exit):
        command.make_context(name, rest, parent=context)


def test_pages_and_their_blocks_are_found() -> None:
    assert ROOT / "docs" / "model.md" in PAGES
    assert [block.kind for block in blocks(PAGES[0].read_text(encoding="utf-8"))].count("python") == 2


@pytest.mark.parametrize("page", PAGES, ids=name_of)
def test_no_line_of_code_is_wider_than_a_page(page: Path) -> None:
    found = blocks(page.read_text(encoding="utf-8"))
    lines = [(block.line + i, line) for block in found for i, line in enumerate(block.text.splitlines(), 1)]
    assert [(number, line) for number, line in lines if len(line) > WIDTH] == []


@pytest.mark.parametrize("page", PAGES, ids=name_of)
def test_a_list_begins_after_an_empty_line(page: Path) -> None:
    prose = BLOCK.sub("", page.read_text(encoding="utf-8"))
    item = re.compile(r"^ *(?:[-*]|\d+\.) ", re.MULTILINE)
    paragraphs = [part.strip("\n") for part in re.split(r"\n\s*\n", prose)]
    assert [
        part for part in paragraphs if item.search(part) and not item.match(part)
    ] == []  # otherwise Markdown shows no list


@pytest.mark.parametrize("file", sorted(filter(Path.is_file, (ROOT / "examples").iterdir())), ids=name_of)
def test_no_line_of_an_example_is_wider_than_a_page(file: Path) -> None:
    lines = file.read_text(encoding="utf-8").splitlines() if file.suffix in (".py", ".yaml") else []
    assert [line for line in lines if len(line) > WIDTH] == []
