"""Figures of commands, generated with the pages, so that they are up to date.

The line `<!-- drawn by: sagline track cogiro -->` of a page becomes the figures that this command writes, in a folder
where the page's files (`<!-- file: name -->` before a block of code) and those of the examples are. The line
`<!-- drawn above: name.svg -->` becomes the figure of that name that the page's own blocks of Python save.
"""

from __future__ import annotations

import re
import shlex
from hashlib import sha256
from pathlib import Path
from posixpath import dirname, relpath
from typing import Any

from mkdocs.config.defaults import MkDocsConfig
from mkdocs.exceptions import PluginError
from mkdocs.structure.files import File, Files
from mkdocs.structure.pages import Page
from running import WORK, ran

MARK = re.compile(r"^<!-- drawn by: sagline (.+?) -->$", re.MULTILINE)
NAMED = re.compile(r"^<!-- file: (\S+) -->\n+```\w*\n(.*?)^```$", re.MULTILINE | re.DOTALL)
ABOVE = re.compile(r"^<!-- drawn above: (\S+\.svg) -->$", re.MULTILINE)
PYTHON = re.compile(r"(?<!-->\n\n)^```python\n(.*?)^```$", re.MULTILINE | re.DOTALL)
NAMESPACE = 'xmlns="http://www.w3.org/2000/svg"'
_drawn: dict[str, list[File]] = {}


def on_pre_build(**_: Any) -> None:
    """Delete the figures of the last build."""
    _drawn.clear()


def on_page_markdown(markdown: str, page: Page, config: MkDocsConfig, files: Files) -> str:
    """Replace the marked lines of a page by the figures."""
    for name, text in NAMED.findall(markdown):
        (WORK / name).write_text(text, encoding="utf-8")
    if names := ABOVE.findall(markdown):
        _run(markdown, names, config, files)
    markdown = ABOVE.sub(lambda found: _picture(found[1].partition(".")[0], f"pictures/{found[1]}", page), markdown)
    return MARK.sub(lambda found: _shown(found[1], page, config, files), markdown)


def _run(markdown: str, names: list[str], config: MkDocsConfig, files: Files) -> None:
    """Run the Python blocks of a page, and return the figures with these names."""
    ran("-c", "\n".join(PYTHON.findall(markdown)))
    for name in names:
        content = (WORK / name).read_text(encoding="utf-8")
        files.append(File.generated(config, f"pictures/{name}", content=content))


def _picture(title: str, uri: str, page: Page) -> str:
    return f"![{title}]({relpath(uri, dirname(page.file.src_uri) or '.')})"


def _shown(command: str, page: Page, config: MkDocsConfig, files: Files) -> str:
    if command not in _drawn:
        _drawn[command] = [
            File.generated(config, f"pictures/{file.name}", content=content) for file, content in draw(command)
        ]
        for file in _drawn[command]:
            files.append(file)
    here = dirname(page.file.src_uri)
    return "\n\n".join(f"![sagline {command}]({relpath(file.src_uri, here or '.')})" for file in _drawn[command])


def draw(command: str) -> list[tuple[Path, str | bytes]]:
    """The figures of a command in the order of writing, as SVG, and films as GIF."""
    folder = WORK / sha256(command.encode()).hexdigest()[:8]
    words = shlex.split(command)
    out = f"{folder.name}/sim.nc" if words[0] == "simulate" else folder.name  # `simulate` writes a file
    ran("-m", "sagline.cli", *words, "--out", out)
    written = sorted([*folder.glob("*.svg"), *folder.glob("*.gif")], key=lambda file: file.stat().st_mtime_ns)
    figures: list[tuple[Path, str | bytes]] = [
        (file.with_stem(f"{folder.name}-{file.stem}"), file.read_bytes()) for file in written
    ]
    for page in folder.glob("*.html"):
        figures.append((page.with_name(f"{folder.name}.svg"), first_drawing(page.read_text(encoding="utf-8"))))
    if not figures:
        raise PluginError(f"sagline {command} drew nothing")
    return figures


def first_drawing(html: str) -> str:
    """The first drawing of a report, as a separate file."""
    found = re.search(r"<svg\b.*?</svg>", html, re.DOTALL)
    if not found:
        raise PluginError("there is no drawing in the report")
    return found[0] if NAMESPACE in found[0] else found[0].replace("<svg", f"<svg {NAMESPACE}", 1)
