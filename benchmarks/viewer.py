"""Times of the viewer, warm: `python -m benchmarks.viewer`. The clients run in this process."""

from __future__ import annotations

import io
import os
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image
from rich.console import Console

import sagline as sl
from benchmarks.measure import Row, show
from tests.viewer.client import Client

ROBOT = "cogiro"
REPEATS = 5
WATCHED = 5.0  # duration [s]
RENDERING = 0.05  # time of a picture for the filming client [s]
CUT = ("falcon-7", "cogiro", "fast")
SETTLED, QUIET = 6.0, 1.0  # time without a message after which the page is complete [s]
PORT = ("--no-browser", "--port", "0")


@contextmanager
def serving(*arguments: str) -> Iterator[tuple[str, Callable[[], float]]]:
    """A viewer process with its address and its processor time [s]."""
    command = (sys.executable, "-m", "sagline.cli", "view", *arguments, *PORT)
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
    assert process.stdout is not None
    try:
        address = next(word for word in process.stdout.readline().split() if word.startswith("http://"))
        yield address, lambda: used(process.pid)
    finally:
        process.terminate()
        process.wait()


def used(pid: int) -> float:
    """Processor time of a process so far [s]."""
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def cables_in(message: dict[str, Any]) -> bool:
    """True if a message creates or moves the cables."""
    return message.get("name") == "/cables" and "points" in message.get("updates", message.get("props", {}))


def first_cables() -> Iterator[Row]:
    """Time from the command to the first cables."""
    waits, spent, whole = [], [], []
    for _ in range(REPEATS):
        with serving(ROBOT) as (address, processor):
            told, before = time.perf_counter(), processor()  # the browser opens at this time
            with Client(address) as client:
                next(message for message in client.heard(60.0) if cables_in(message))
            waits.append(time.perf_counter() - told)
            spent.append(processor() - before)
            whole.append(processor())
    yield Row(
        f"sagline view {ROBOT}, warm: first cables after the browser is opened",
        "<= 2 s",
        f"{min(waits):.2f} s; {min(spent):.2f} s of processor, {min(whole):.1f} s from the command on",
    )


def two_while_a_third_films() -> Iterator[Row]:
    """Update rates with three clients: one drags, one watches, and one records a film."""
    with tempfile.TemporaryDirectory() as folder:
        robot = sl.load_robot(ROBOT)
        ends = sl.Pose(np.array([[0.0, 0.0, 2.0], [2.0, 1.0, 2.0]]), np.stack([np.eye(3)] * 2))
        file = Path(folder) / "run.nc"
        sl.inverse(robot, sl.quintic_path(ends, durations=[60.0], rate=50)).save(file)
        with serving(ROBOT, str(file)) as (address, processor), Client(address) as dragging, Client(address) as looking:
            dragging.drag([0.0, 0.0, 2.1])
            for client in (dragging, looking):
                next(message for message in client.heard(60.0) if cables_in(message))
            alone = watched(dragging, looking, processor)
            with Client(address) as filming:
                thread = Filming(filming)
                thread.start()
                thread.taken.wait()
                together = watched(dragging, looking, processor)
                thread.stopped.set()
                pictures = thread.count / (time.perf_counter() - thread.began)
                thread.join()
    for name, (one, two, share) in (("alone", alone), ("while a third films", together)):
        films = "" if name == "alone" else f"; {pictures:.0f} pictures/s"
        reach = "" if name == "alone" else ">= 20 updates/s"
        rates = f"{one:.0f} and {two:.0f} updates/s, {100 * share:.0f}% of a processor{films}"
        yield Row(f"one client drags {ROBOT}, one watches, {name}", reach, rates)


def watched(dragging: Client, looking: Client, processor: Callable[[], float]) -> tuple[float, float, float]:
    """Updates per second of both clients, and the share of a processor."""
    counts = [0, 0]
    until = time.perf_counter() + WATCHED

    def count(i: int, client: Client) -> None:
        while time.perf_counter() < until:
            counts[i] += sum(map(cables_in, client.heard(0.05)))

    before = processor()
    threads = [threading.Thread(target=count, args=pair) for pair in enumerate((dragging, looking))]
    for thread in threads:
        thread.start()
    dragging.grab()
    while (left := until - time.perf_counter()) > 0.0:
        dragging.drag([np.cos(3.0 * left), np.sin(3.0 * left), 2.0])
        time.sleep(0.01)
    for thread in threads:
        thread.join()
    return counts[0] / WATCHED, counts[1] / WATCHED, (processor() - before) / WATCHED


class Filming(threading.Thread):
    """A filming client, with its own time for each picture."""

    def __init__(self, client: Client) -> None:
        """Film from `start` until `stopped`."""
        super().__init__(daemon=True)
        self.client = client
        self.count = 0
        self.began = 0.0
        self.taken, self.stopped = threading.Event(), threading.Event()
        buffer = io.BytesIO()
        Image.new("RGB", (1, 1)).save(buffer, "JPEG")
        self.picture = buffer.getvalue()

    def run(self) -> None:
        """Press the button and answer the requests."""
        for message in self.client.heard(60.0):
            if self.stopped.is_set():
                return
            if str(message.get("props", {}).get("label", "")).startswith("Film of"):
                self.client.set(message["uuid"], True)
            if message["type"] == "GetRenderRequestMessage":
                time.sleep(RENDERING)
                self.client.say(
                    type="GetRenderResponseMessage", payload=self.picture, render_uuid=message["render_uuid"]
                )
                self.count += 1
                if not self.taken.is_set():
                    self.began = time.perf_counter()
                    self.taken.set()


def cut_cables() -> Iterator[Row]:
    """Time from the click on "Cut" to the first picture with a moved platform."""
    for name in CUT:
        waits, spent = [], []
        with serving(name) as (address, processor), Client(address) as client:
            buttons = {}
            for message in client.heard(SETTLED):
                if message["type"] == "GuiButtonMessage":
                    buttons[message["props"]["label"]] = message["uuid"]
            for _ in range(REPEATS):
                told, before = time.perf_counter(), processor()
                client.set(buttons["Cut"], True)
                next(message for message in client.heard(60.0) if platform_in(message))
                waits.append(time.perf_counter() - told)
                spent.append(processor() - before)
                client.set(buttons["Undo cut"], True)
                for _ in client.heard(QUIET):
                    pass
        reached = f"{min(waits):.2f} s; {min(spent):.2f} s of processor"
        yield Row(f"a cable of {name} is cut: first moving picture", "<= 0.3 s", reached)


def platform_in(message: dict[str, Any]) -> bool:
    """True if a message moves the platform."""
    return bool(message["type"] == "SetPositionMessage" and message["name"] == "/platform")


PARTS = (first_cables, two_while_a_third_films, cut_cables)


def main() -> None:
    """Measure and print."""
    rows: list[Row] = []
    for part in PARTS:
        Console(stderr=True).print(f"[dim]{part.__doc__}[/dim]")
        rows.extend(part())
    show(f"The viewer, {len(os.sched_getaffinity(0))} cores", rows, Console())


if __name__ == "__main__":
    main()
