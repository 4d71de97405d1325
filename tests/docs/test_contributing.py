"""The pages on contributing are executed step by step in a copy of the source.

A block with a file name as title is that file. A `diff` block changes it; each part of the change fits at exactly one
place. A line that ends in … is an abbreviation of the line that begins in the same way. The commands of a `console`
block run with the kernels as plain Python, without compilation.
"""

import os
import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path
from typing import NamedTuple

import pytest

from tests.tiers import extended

ROOT = Path(__file__).parents[2]
EXPLANATIONS = {"c-kernels.md"}  # pages without steps
PAGES = sorted(each for each in (ROOT / "docs" / "contributing").glob("*.md") if each.name not in EXPLANATIONS)
BLOCK = re.compile(r'^```(?P<kind>\w+)(?: title="(?P<file>[^"]+)")?\n(?P<text>.*?)^```$', re.MULTILINE | re.DOTALL)
COPIED = ("src", "tests", "tools", "docs", "pyproject.toml", "README.md", "CHANGELOG.md")
STEPS = 10
PLACES = {  # placeholders of a page with their values in the copy
    ".venv/bin/python": [sys.executable],
    "ruff": [sys.executable, "-m", "ruff"],
    "sagline": [sys.executable, "-m", "sagline.cli"],
}


class Change(NamedTuple):
    """A part of a change: consecutive lines of a file, before and after."""

    before: list[str]
    after: list[str]


def changes(text: str) -> list[Change]:
    """Parts of a `diff` block."""
    parts = re.split(r"^@@$\n?", text, flags=re.MULTILINE)
    return [
        Change(
            [line[1:] for line in part.splitlines() if not line.startswith("+")],
            [line for line in part.splitlines() if not line.startswith("-")],
        )
        for part in parts
    ]


def is_like(line: str, shown: str) -> bool:
    return line.startswith(shown.removesuffix("…")) if shown.endswith("…") else line == shown


def changed(source: list[str], change: Change, where: str) -> list[str]:
    """Lines of the file after a part of a change, which must fit at exactly one place."""
    length = len(change.before)
    assert length > 0, f"{where}: a change without a line that stays says not where it belongs"
    starts = range(len(source) - length + 1)
    fits = [k for k in starts if all(map(is_like, source[k : k + length], change.before))]
    assert len(fits) == 1, f"{where}: {len(fits)} places for\n" + "\n".join(change.before)
    kept = iter(range(fits[0], fits[0] + length))
    new: list[str] = []
    shown = iter(change.before)
    for line in change.after:
        if line.startswith("+"):
            new.append(line[1:])
            continue
        while next(shown) != line[1:]:
            next(kept)  # a removed line
        new.append(source[next(kept)])
    return [*source[: fits[0]], *new, *source[fits[0] + length :]]


def copy_of_the_source(folder: Path) -> Path:
    ignored = shutil.ignore_patterns(".*_cache")  # the caches of Python are kept, which saves seconds
    for name in COPIED:
        if (ROOT / name).is_dir():
            shutil.copytree(ROOT / name, folder / name, ignore=ignored)
        else:
            shutil.copy(ROOT / name, folder)
    return folder


def run(line: str, folder: Path, environment: dict[str, str]) -> None:
    first, *words = shlex.split(line)
    quick = {"NO_COLOR": "1", "PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1"}
    clean = {**os.environ, "PYTHONPATH": str(folder / "src"), **quick, **environment}
    if words[:2] == ["-m", "pytest"]:
        words += ["-q", "-p", "no:cacheprovider", "-p", "syrupy", "--noconftest"]
    done = subprocess.run([*PLACES[first], *words], cwd=folder, env=clean, capture_output=True, text=True)
    assert done.returncode == 0, f"{line}\n{done.stdout[-3000:]}\n{done.stderr[-3000:]}"


def follow(page: Path, folder: Path, environment: dict[str, str]) -> None:
    """Execute the blocks of a page in order; the written files have the style of the project."""
    written: set[str] = set()
    for block in BLOCK.finditer(page.read_text(encoding="utf-8")):
        file = folder / (block["file"] or "")
        if block["kind"] == "console":
            for line in block["text"].splitlines():
                run(line, folder, environment)
        elif block["kind"] == "diff":
            lines = file.read_text(encoding="utf-8").split("\n")
            for change in changes(block["text"]):
                lines = changed(lines, change, f"{page.name}: {block['file']}")
            file.write_text("\n".join(lines), encoding="utf-8")
        else:
            assert not file.exists(), f"{page.name}: {block['file']} is there"
            file.write_text(block["text"], encoding="utf-8")
        written.add(block["file"] or "")
    python = sorted(name for name in written if name.endswith(".py"))
    for check in (["check"], ["format", "--check"]):
        run(shlex.join(["ruff", *check, *python]), folder, environment)


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_a_page_has_ten_steps(page: Path) -> None:
    steps = re.findall(r"^## (\d+)\. \w", page.read_text(encoding="utf-8"), re.MULTILINE)
    assert [int(step) for step in steps] == list(range(1, STEPS + 1))


@extended
@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_the_steps_give_the_printed_results(page: Path, tmp_path: Path) -> None:
    follow(page, copy_of_the_source(tmp_path), {"SAGLINE_BACKEND": "python"})


@pytest.mark.soak
@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_the_steps_give_the_printed_results_in_machine_code(page: Path, tmp_path: Path) -> None:
    follow(page, copy_of_the_source(tmp_path / "tree"), {"NUMBA_CACHE_DIR": str(tmp_path / "kernels")})


def test_a_change_that_does_not_fit_is_an_error() -> None:
    source = ["a", "long", "b", "a"]

    def is_applied(text: str) -> list[str]:
        (change,) = changes(text)
        return changed(source, change, "here")

    assert is_applied(" lo…\n+new\n") == ["a", "long", "new", "b", "a"]
    assert is_applied("-long\n+new\n b\n") == ["a", "new", "b", "a"]
    for wrong in (" a\n+new\n", " c\n+new\n", "+new\n"):
        with pytest.raises(AssertionError, match="here"):
            is_applied(wrong)
