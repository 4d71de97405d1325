"""The progress line: shown at once, with a bar for long work, and absent in files."""

import re
import time
from io import StringIO

from rich.console import Console

from sagline.cli.terminal import working


def test_a_bar_appears_on_a_terminal_when_work_takes_long() -> None:
    text = StringIO()
    with working("first part", Console(file=text, force_terminal=True, width=100)) as line:
        progress = line.stage("second [part]\x1b")
        progress(1, 10)
        line._bar.refresh()
        soon = text.getvalue()
        line._bar.tasks[0].start_time = time.monotonic() - 60.0
        line.name("third part")
        progress(5, 10)
        line._bar.refresh()
    later = text.getvalue()[len(soon) :]
    assert "first part" in soon
    assert "second [part]\\x1b" in soon
    assert "━" not in soon
    assert "third part" in later
    assert "━" in later
    assert re.search(r"\d:\d\d:\d\d", later)
    assert not re.search(r"\d:\d\d:\d\d", soon)


def test_nothing_is_written_to_a_file() -> None:
    text = StringIO()
    with working("work", Console(file=text)) as line:
        line.stage("more work")(1, 2)
    assert text.getvalue() == ""
