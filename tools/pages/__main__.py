"""Write the documentation as plain Markdown into build/pages; a builder of sites needs nothing else."""

from __future__ import annotations

import os
import shutil
import time
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from functools import partial
from pathlib import Path
from typing import Final

from sagline.share.packing import page_script
from tools.pages.controller import with_tables
from tools.pages.explore import with_cable
from tools.pages.formulas import with_formulas
from tools.pages.gallery import command_reference, gallery
from tools.pages.marks import ABOVE, MADE, MARK, PAGES, ROOT, WORK, folder_for, shown_above
from tools.pages.reference import reference_pages
from tools.pages.snippets import blocks

DOCS: Final = ROOT / "docs"


def main() -> None:
    """Run what the pages show, on all cores, and write the pages."""
    for folder in (PAGES, WORK):
        shutil.rmtree(folder, ignore_errors=True)
    shutil.copytree(DOCS, PAGES)
    (PAGES / "sagline.js").write_text(page_script(), encoding="utf-8")
    pages = {file.relative_to(DOCS).as_posix(): file.read_text(encoding="utf-8") for file in DOCS.rglob("*.md")}
    pages |= {"gallery.md": gallery(), "api/command.md": command_reference(), **reference_pages()}
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        try:
            for name, text in made(pages, pool):
                (PAGES / name).parent.mkdir(exist_ok=True)
                text = with_formulas(with_cable(with_tables(text))).replace("ROOT/", "../" * name.count("/"))
                (PAGES / name).write_text(text, encoding="utf-8")
        except BaseException:
            pool.shutdown(cancel_futures=True)
            raise
    print(f"{len(pages)} pages are in {PAGES.relative_to(ROOT)}")


def made(pages: dict[str, str], pool: ThreadPoolExecutor) -> Iterator[tuple[str, str]]:
    """The pages with what their lines of marks.py become; what several pages show runs once."""
    jobs: dict[str, Future[str]] = {}

    def job(make: Callable[[str, Path], str], text: str, page: str) -> Future[str]:
        files = {block.what: block.text for block in blocks(page) if block.mark == "file"}
        key = f"{make.__name__} {text} {files}"
        if key not in jobs:
            jobs[key] = pool.submit(timed, make, text, folder_for(key, files))
        return jobs[key]

    executed = {name: job(shown_above, page, page) for name, page in pages.items() if ABOVE.search(page)}
    texts = {
        (name, found[0]): job(MADE[found[1]], found[2], page)
        for name, page in pages.items()
        for found in MARK.finditer(page)
    }
    for name, page in pages.items():
        text = executed[name].result() if name in executed else page
        yield name, MARK.sub(partial(lambda name, found: texts[name, found[0]].result(), name), text)


def timed(make: Callable[[str, Path], str], text: str, folder: Path) -> str:
    """Call a function of marks.py, and print its time."""
    start = time.perf_counter()
    made = make(text, folder)
    print(f"{time.perf_counter() - start:6.1f} s  {text.splitlines()[0]}", flush=True)
    return made


if __name__ == "__main__":
    main()
