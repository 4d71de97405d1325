"""Links of a built site: `python -m tools.pages.check build/site` names links without a target and foreign files."""

from __future__ import annotations

import re
import sys
from html.parser import HTMLParser
from pathlib import Path
from typing import Final
from urllib.parse import unquote, urlsplit

LOADED: Final = {"stylesheet", "preload", "preconnect", "icon"}  # links whose file a page loads
FOREIGN: Final = re.compile(r"""@import\s+["'(]*(?:url\()?https?:|url\(["']?https?:""")


class Page(HTMLParser):
    """Anchors, links and loaded files of a page."""

    def __init__(self, file: Path) -> None:
        """Read a page."""
        super().__init__()
        self.anchors, self.links, self.loaded = {"", "__tabbed", "__skip"}, set[str](), set[str]()
        self.feed(file.read_text(encoding="utf-8"))

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Note the addresses of an element."""
        found = {name: value or "" for name, value in attrs}
        self.anchors |= {found[name] for name in ("id", "name") if name in found}
        loaded = LOADED & {*found.get("rel", "").split()} if tag == "link" else tag in ("script", "img", "iframe")
        addresses = {found[name] for name in ("src", "href") if name in found}
        self.links |= addresses if tag != "link" or loaded else set()
        self.loaded |= addresses if loaded else set()


def faults(site: Path) -> list[str]:
    """Links of a site that lead nowhere, files of other servers that it loads, and pages without a link to them."""
    pages = {file: Page(file) for file in sorted(site.rglob("*.html")) if file.name != "404.html"}
    linked = {site / "index.html", *site.joinpath("shared").glob("*.html")}
    found = []
    for file, page in pages.items():
        name = file.relative_to(site)
        found += [f"{name} loads {link}" for link in page.loaded if urlsplit(link).netloc]
        for link in sorted(page.links):
            parts = urlsplit(link)
            if parts.scheme or parts.netloc:
                continue
            target = (file.parent / unquote(parts.path)).resolve() if parts.path else file
            linked |= {target} - {file}
            anchors = pages[target].anchors if target in pages else {unquote(parts.fragment)}
            if not target.is_file() or unquote(parts.fragment) not in anchors:
                found.append(f"{name}: nothing is at {link}")
    for style in (*pages, *site.rglob("*.css")):
        if foreign := FOREIGN.search(style.read_text(encoding="utf-8")):
            found.append(f"{style.relative_to(site)} loads {foreign[0]}")
    return found + [f"no page leads to {file.relative_to(site)}" for file in pages.keys() - linked]


if __name__ == "__main__":
    sys.exit("\n".join(faults(Path(sys.argv[1]).resolve())) or 0)
