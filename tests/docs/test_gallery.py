"""The gallery shows every command with command lines that produce its figures, pages and texts."""

import re
import shlex
from pathlib import Path

import pytest
import typer

from tests.abuse.command_lines import commands
from tests.tiers import extended
from tools.pages.gallery import SHOWN, command_reference, shown

pytestmark = extended

DOCS = Path(__file__).parents[2] / "docs"


def lines_of(text: str) -> list[list[str]]:
    """The command lines in a mark, as words."""
    _, _, asked = text.removesuffix(" -->").partition(" by: ")
    return [shlex.split(line)[1:] for line in asked.split(" && ") if line]


def test_the_gallery_shows_exactly_the_commands() -> None:
    assert {*SHOWN, "view"} == commands().keys()


def test_the_page_of_the_command_shows_every_command_and_its_examples_as_code() -> None:
    page = command_reference()
    assert [name for name in commands() if f"\n\n{shown(name)}\n" not in page] == []
    assert "\b" not in page  # the mark of click before the examples
    assert re.search(r"^    sagline track \w", page, re.MULTILINE)


@pytest.mark.parametrize("name", sorted(commands()))
def test_each_entry_of_the_gallery_runs_its_command(name: str) -> None:
    text = shown(name)
    if told := re.fullmatch(r"<!-- [a-z ]+: (\S+) -->", text):  # commands of a machine
        assert told[1] == name
        return
    if name == "view":
        images = [part.partition("images/")[2].partition(")")[0] for part in text.split("![")[1:]]
        assert len(images) == 2
        assert all((DOCS / "images" / image).is_file() for image in images)
        return
    lines = lines_of(text)
    assert lines[-1][0] == name
    files = {file.name for file in (DOCS.parent / "examples").iterdir()}
    for words in lines:  # each line is valid, with existing files
        context = typer.Context(commands()[words[0]], info_name=words[0])
        commands()[words[0]].parse_args(context, list(words[1:]))
        assert {word for word in words if word.endswith((".yaml", ".csv"))} - files <= {"shed.yaml"}


def test_the_front_page_has_an_interactive_robot() -> None:
    marks = re.findall(r"^<!-- shared .* -->$", (DOCS / "index.md").read_text(encoding="utf-8"), re.MULTILINE)
    assert [lines_of(mark) for mark in marks] == [[["share", "article-mixed"]]]
