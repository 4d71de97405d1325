"""Hulls of robots with heavy cables, compared with the inverse: `python -m benchmarks.heavy_cables 1000000 20 12`.

The arguments are the number of verdicts for each robot, the number of random robots, and the number of robots that are
left out at the beginning. The defaults are 20,000, 3 and 0. Each row is printed as soon as it is known. If a target is
missed, the exit code is 1.
"""

from __future__ import annotations

import sys
import time

import numpy as np
from rich.console import Console

from benchmarks.measure import Row, one_core, show
from tests.workspaces.heavy import OPEN, RIGHT, Compared, compared, random_robots, three_robots

CELLS = 16
DEFAULTS = 20_000, 3, 0
TARGETS = (
    f"0 contradictions, 0 wrong signs, <= {100 * OPEN:.0f} % open, >= {100 * RIGHT:.1f} % right, "
    f"<= {100 * OPEN:.0f} % before a gap, volumes agree"
)


def meets_targets(found: Compared) -> bool:
    """True if a comparison meets all targets."""
    wrong = found.contradictions + found.wrong_sign
    return wrong == 0 and max(found.open, found.before_gap) <= OPEN and found.right >= RIGHT and found.away <= 1.0


def main() -> int:
    """Print one row for each robot. Returns the exit code."""
    one_core()
    missed = 0
    given = [int(text) for text in sys.argv[1:]]
    verdicts, count, first = *given, *DEFAULTS[len(given) :]
    console = Console()
    show("Hulls with heavy cables", [], console)
    for name, robot in [*three_robots(), *random_robots(count, 42)][first:]:
        start = time.process_time()
        found = compared(robot, verdicts, CELLS, np.random.default_rng(41))
        seconds = time.process_time() - start
        row = Row(
            name,
            TARGETS,
            f"{found.contradictions} contradictions, {found.wrong_sign} wrong signs, {100 * found.open:.2f} % open, "
            f"{100 * found.right:.2f} % right, {100 * found.before_gap:.2f} % before a gap, "
            f"{found.space.volume:.1f} ± {found.space.volume_error:.1f} m³ "
            f"and by verdicts {found.volume:.1f} ± {found.deviation:.1f} m³, {seconds:.0f} s",
        )
        print(f"| {' | '.join(row)} |", flush=True)
        missed += not meets_targets(found)
    if missed:
        console.print(f"Robots that miss a target: {missed}.")
    return 1 if missed else 0


if __name__ == "__main__":
    sys.exit(main())
