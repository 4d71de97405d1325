"""Measurement of times: the best of many short runs on one core, because other programs disturb the measurement."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from typing import NamedTuple

from rich.console import Console
from rich.table import Table


class Row(NamedTuple):
    """One line of the table."""

    quantity: str
    target: str
    measured: str


def one_core() -> None:
    """Keep this process and its children on one processor."""
    os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})


def best_seconds(run: Callable[[], object], repeats: int = 7) -> float:
    """Shortest wall time of several runs [s], without the first."""
    run()
    times = []
    for _ in range(repeats):
        start = time.perf_counter()
        run()
        times.append(time.perf_counter() - start)
    return min(times)


def best_of_calls(call: Callable[[], object], calls: int = 500, repeats: int = 20) -> float:
    """Shortest mean time of a short call [s]."""

    def run() -> None:
        for _ in range(calls):
            call()

    return best_seconds(run, repeats) / calls


def process_seconds(arguments: Sequence[str], repeats: int = 3) -> float:
    """Shortest wall time of a whole process [s], without the first."""
    return best_seconds(lambda: subprocess.run(arguments, check=True, capture_output=True), repeats)


def process_peak_memory(code: str) -> float:
    """Peak memory of a Python program in a process of its own [GB]."""
    report = f"{code}\nimport resource; print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)"
    done = subprocess.run([sys.executable, "-c", report], check=True, capture_output=True, text=True)
    return float(done.stdout.split()[-1]) * 1024 / 1e9


class Compared(NamedTuple):
    """One line of a table that compares two programs."""

    quantity: str
    authors: str
    sagline: str


def show(title: str, rows: Sequence[Row | Compared], console: Console) -> None:
    """Print a table, as Markdown if the output is not a terminal."""
    names = rows[0]._fields if rows else Row._fields
    if console.is_terminal:
        table = Table(*names, title=title)
        for row in rows:
            table.add_row(*row)
        console.print(table)
        return
    print(f"\n### {title}\n\n| {' | '.join(names)} |\n|---|---|---|")
    for row in rows:
        print(f"| {' | '.join(row)} |")


def print_table(title: str, parts: Sequence[Callable[[], Iterator[Row]]]) -> None:
    """Measure one part after another on one core, and print a table of their rows."""
    rows: list[Row] = []
    one_core()
    for part in parts:
        Console(stderr=True).print(f"[dim]{part.__doc__}[/dim]")
        rows.extend(part())
    show(title, rows, Console())
