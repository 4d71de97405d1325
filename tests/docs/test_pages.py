"""The documentation as plain Markdown, and the check of its site."""

import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
import yaml

from tests.tiers import extended
from tools.pages import formulas
from tools.pages.check import faults
from tools.pages.marks import MOST, terminal
from tools.pages.reference import documented, reference_pages, signature
from tools.size import public_values

ROOT = Path(__file__).parents[2]
OF_COMMANDS = {"gallery.md", "api/command.md"}
TWIN = """\
from pathlib import Path
from tools.pages import marks
marks.WORK = Path()
print(marks.printed_during_run("twin", marks.folder_for("twin", {})))
"""


def addresses(nav: Any) -> set[str]:
    """Pages of a navigation."""
    if isinstance(nav, str):
        return {nav}
    return set[str]().union(*map(addresses, nav.values() if isinstance(nav, dict) else nav))


@extended
def test_the_navigation_has_every_page_and_the_reference_every_public_name() -> None:
    pages = reference_pages()
    written = {file.relative_to(ROOT / "docs").as_posix() for file in (ROOT / "docs").rglob("*.md")}
    nav = yaml.safe_load((ROOT / "mkdocs.yml").read_text(encoding="utf-8"))["nav"]
    assert addresses(nav) == written | pages.keys() | OF_COMMANDS
    named = {name for page in pages.values() for name in re.findall(r"^## (\w+) \{", page, re.MULTILINE)}
    public = {name.split(".")[-1] for name, value in public_values().items() if callable(value)}
    assert named == public


def outside_code(text: str) -> str:
    """A page without its code blocks."""
    return re.sub(r"^ *```.*?^ *```", "", text, flags=re.MULTILINE | re.DOTALL)


@pytest.mark.parametrize("file", sorted((ROOT / "docs").rglob("*.md")), ids=lambda file: file.stem)
def test_headings_and_tables_stand_between_blank_lines(file: Path) -> None:
    lines = ["", *outside_code(file.read_text(encoding="utf-8")).splitlines(), ""]
    kinds = [line[0] if re.match(r"#+ |\|", line) else line.strip() and "text" for line in lines]
    meetings = {"#|", "|#", "##", "#text", "text#", "text|", "|text"}
    assert [line for line, *pair in zip(lines[1:], kinds, kinds[1:], strict=False) if "".join(pair) in meetings] == []


def headings(file: Path) -> set[str]:
    """Addresses of the headings of a page, as the site forms them."""
    titles = re.findall(r"^#+ (.+)$", outside_code(file.read_text(encoding="utf-8")), re.MULTILINE)
    return {re.sub(r"[\s-]+", "-", re.sub(r"[^\w\s-]", "", title).strip().lower()) for title in titles}


def test_links_between_pages_lead_to_files_and_headings() -> None:
    docs, dead, anchors = ROOT / "docs", [], 0
    made = {docs / "api", docs / "gallery", docs / "gallery.md"}  # by `make docs`
    for file in (ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted(docs.rglob("*.md"))):
        for link in re.findall(r"\]\((?!\w+:)([^)\s]+)\)", outside_code(file.read_text(encoding="utf-8"))):
            path, _, heading = link.partition("#")
            target = (file.parent / path).resolve() if path else file
            if made & {target, *target.parents}:
                continue
            anchors += bool(heading)
            if not target.exists() or (heading and heading not in headings(target)):
                dead.append(f"{file.name}: {link}")
    assert dead == []
    assert anchors > 20


def measured(span: "float", *, rise: "float | None" = None) -> "Cable":  # type: ignore[name-defined]  # noqa: F821
    """Length of a cable.

    Args:
        span: Distance
            [m].
        rise: Height [m].

    Returns:
        A
        length.

    Raises:
        CableError: Short.

    Examples:
        A short one:

        >>> 1 + 1
        2
    """


def test_a_docstring_becomes_markdown() -> None:
    text = documented(
        measured.__doc__, {"CableError": "core.md#e", "Cable": "cables.md#c", "span": "plot.md#s"}, {"Returns": "Cable"}
    )
    items = [line for line in text.splitlines() if line.startswith("- ")]
    assert items == [
        "- **`span`**: Distance [m].",
        "- **`rise`**: Height [m].",
        "- [`Cable`](cables.md#c): A length.",
        "- **[`CableError`](core.md#e)**: Short.",
    ]
    assert text.splitlines()[-5:] == ["", "```pycon", ">>> 1 + 1", "2", "```"]


def test_a_signature_has_its_annotations_without_quotes() -> None:
    rest = "*, rise: float | None = None) -> Cable"
    assert signature("f", measured) == f"f(span: float, {rest}"
    assert signature("f", measured, method=True) == f"f({rest}"
    assert signature("a_rather_long_name" * 3, measured).splitlines()[1] == "    span: float,"


def test_formulas_outside_of_code_become_mathml(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(formulas, "mathml", lambda latex, display: f"[{display} {latex.strip()}]")
    page = "($x$), `$y$` and\n\n  $$\n  z\n  $$\n\n```sh\n$ a\n$ b\n```\n"
    line = '<span class="kept">([inline x]),</span>'
    block = '  <span class="formula">[block z]</span>'
    changed = page.replace("($x$),", line).replace("  $$\n  z\n  $$", block)
    assert formulas.with_formulas(page) == changed


def test_long_output_is_cut(tmp_path: Path) -> None:
    lines = terminal(["sagline show"], f"{tmp_path}/a\n" * (MOST + 1200), tmp_path).splitlines()
    assert lines[:3] == ["```text", "$ sagline show", "~/a"]
    assert lines[-2].split()[2] == "1,200"
    assert len(lines) == MOST + 4


@extended
def test_a_background_shell_is_not_awaited(tmp_path: Path) -> None:
    command = f"import signal; signal.signal(signal.SIGINT, signal.SIG_IGN)\n{TWIN}"
    environment = {"PYTHONPATH": f"{ROOT}/src:{ROOT}"}
    done = subprocess.run(
        [sys.executable, "-c", command], cwd=tmp_path, env=environment, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    assert [line for line in done.stdout.splitlines() if "Ctrl-C" in line]


def test_dead_links_and_files_of_other_servers_are_found(tmp_path: Path) -> None:
    (tmp_path / "api").mkdir()
    (tmp_path / "a.css").write_text("p { color: red }")
    pages = {
        "index.html": '<link rel="stylesheet" href="a.css"><a href="api/b.html#c">b</a><a href="https://x.org">x</a>',
        "api/b.html": '<p id="c"><a href="../index.html">home</a> <a href="#c">up</a></p>',
    }
    for name, text in pages.items():
        (tmp_path / name).write_text(text)
    assert faults(tmp_path) == []
    wrong = (
        '<a href="no.html"></a><a href="api/b.html#d"></a><img src="https://x.org/i.png"><script src="no.js"></script>'
    )
    (tmp_path / "index.html").write_text(wrong)
    (tmp_path / "a.css").write_text('@import "https://x.org/a.css"')
    (tmp_path / "c.html").write_text("")
    found = "\n".join(faults(tmp_path))
    assert len(found.splitlines()) == 6
    for part in ("at no.html", "at api/b.html#d", "x.org/i.png", "at no.js", "a.css loads", "to c.html"):
        assert part in found
