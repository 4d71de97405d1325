"""`sagline twin` in another process."""

from __future__ import annotations

import os
import queue
import re
import signal
import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager

from tests.plc.servers import PATIENCE

START = 300.0  # s: a first run compiles


class Twin:
    """The process and its outputs."""

    def __init__(self, *words: str) -> None:
        command = [sys.executable, "-m", "sagline.cli", "twin", "article-prototype", "--port", "0", *words]
        self.process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        self._lines: queue.Queue[str] = queue.Queue()
        self._listener = threading.Thread(target=self._listen, daemon=True)
        self._listener.start()
        self.addresses = self.line(r"--plc (\S+)", START)[1]

    def _listen(self) -> None:
        assert self.process.stdout is not None
        while line := self.process.stdout.readline():
            self._lines.put(line)
        self._lines.put("")

    def line(self, pattern: str, patience: float = PATIENCE) -> re.Match[str]:
        """The next line with a match of a pattern."""
        while True:
            line = self._lines.get(timeout=patience)
            if found := re.search(pattern, line):
                return found
            assert line, f"the twin ended: {self.process.communicate()[1]}"

    def end(self) -> None:
        """End the process in any state."""
        self.process.kill()
        self._listener.join()
        self.process.communicate()

    def signal(self, number: int) -> None:
        os.kill(self.process.pid, number)


@contextmanager
def a_twin(*words: str) -> Iterator[Twin]:
    twin = Twin(*words)
    try:
        yield twin
    finally:
        twin.end()


def interrupted(twin: Twin) -> tuple[int, str]:
    """Exit code and stderr after Ctrl-C."""
    twin.signal(signal.SIGINT)
    code = twin.process.wait(PATIENCE)
    assert twin.process.stderr is not None
    return code, twin.process.stderr.read()
