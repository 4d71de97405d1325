"""Pages to touch within pages: made by `sagline share` with the site, so that they are what it makes today.

The line `<!-- shared by: sagline share cogiro -->` becomes a frame with the page that this command writes, where the
files of the examples are; commands before it, `sagline a && sagline share b`, make what it needs. A frame loads when
the reader comes near it, and nothing of it from elsewhere.
"""

from __future__ import annotations

import re
import shlex
from hashlib import sha256
from html import escape, unescape
from posixpath import dirname, relpath
from typing import Any

from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files
from mkdocs.structure.pages import Page
from running import WORK, ran

MARK = re.compile(r"^<!-- shared by: (sagline .+?) -->$", re.MULTILINE)
TITLE = re.compile(r"<title>(.*?)</title>")
_made: dict[str, tuple[File, str]] = {}


def on_pre_build(**_: Any) -> None:
    """Forget the pages of the last build."""
    _made.clear()


def on_page_markdown(markdown: str, page: Page, config: MkDocsConfig, files: Files) -> str:
    """Put the frames in the place of the lines that ask for them."""
    if not MARK.search(markdown):
        return markdown
    script = relpath("shared.js", dirname(page.file.src_uri) or ".")
    framed = MARK.sub(lambda found: _frame(found[1], page, config, files), markdown)
    return f'{framed}\n\n<script src="{script}" defer></script>\n'


def _frame(commands: str, page: Page, config: MkDocsConfig, files: Files) -> str:
    *before, last = commands.split(" && ")
    if commands not in _made:
        name = f"{sha256(commands.encode()).hexdigest()[:8]}.html"
        for line in (*before, f"{last} --out {name}"):
            ran("-m", "sagline.cli", *shlex.split(line)[1:])
        content = (WORK / name).read_text(encoding="utf-8")
        file = File.generated(config, f"shared/{name}", content=content)
        files.append(file)
        found = TITLE.search(content)
        _made[commands] = file, unescape(found[1]) if found else last
    file, title = _made[commands]
    uri = relpath(file.src_uri, dirname(page.file.src_uri) or ".")
    return (
        f'<iframe class="shared" src="{uri}" loading="lazy" title="{escape(title)}, to be touched"></iframe>\n\n'
        f"*Made by `{last}`, {len(file.content_bytes) / 1e3:,.0f} kB.* [On a page of its own]({uri})"
    )
