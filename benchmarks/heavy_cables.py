"""Hulls of robots with heavy cables, compared with the inverse: `python -m benchmarks.heavy_cables 1000000 20`.

The arguments are the number of verdicts for each robot, and the number of random robots. The defaults are 20,000 and 3.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator

import numpy as np
from rich.console import Console

from benchmarks.measure import Row, one_core, show
from tests.workspaces.heavy import compared, random_robots, three_robots

CELLS = 16
DEFAULTS = 20_000, 3


def main() -> None:
    """Print the table."""
    one_core()
    given = [int(text) for text in sys.argv[1:]]
    show("Hulls with heavy cables", list(rows(*given, *DEFAULTS[len(given) :])), Console())


def rows(verdicts: int, robots: int) -> Iterator[Row]:
    """One row for each robot."""
    for name, robot in (*three_robots(), *random_robots(robots, 42)):
        start = time.process_time()
        found = compared(robot, verdicts, CELLS, np.random.default_rng(41))
        seconds = time.process_time() - start
        yield Row(
            name,
            f"{found.volume:.1f} +- {found.deviation:.1f} m3 by {verdicts:,} verdicts, 0 contradictions, <= 1 % open, "
            "99.9 % of vertices right 1 mm aside",
            f"{found.space.volume:.1f} +- {found.space.volume_error:.1f} m3, {found.contradictions} contradictions, "
            f"{100 * found.open:.2f} % open, {100 * found.right:.2f} % right, {seconds:.0f} s",
        )


if __name__ == "__main__":
    main()
