"""Design: improvement of the article's robot in 600 evaluations, and its time; one core."""

from __future__ import annotations

import time
from collections.abc import Iterator

import sagline as sl
from benchmarks.measure import Row, print_table

EVALUATIONS = 600
OPTIMIZERS = ("cma", "differential_evolution", "nsga2")


def searches() -> Iterator[Row]:
    """The article's suspended robot with anchors up to 3 m lower, separately for upper and lower cables."""
    robot, load = sl.load_robot("article-suspended"), sl.WrenchBox(force=50.0, moment=5.0)
    free, box = posts(), inside(0.3)
    for optimizer in OPTIMIZERS:
        sl.design(robot, free, ["workspace_share"], load, box=box, optimizer=optimizer, evaluations=60)
        begin = time.process_time()
        front = sl.design(robot, free, ["workspace_share"], load, box=box, optimizer=optimizer, evaluations=EVALUATIONS)
        seconds = time.process_time() - begin
        was, now = front.start_values[0], front.values[0, 0]
        yield Row(
            f"{optimizer}, {EVALUATIONS} robots x 315 poses: share of the grid",
            ">= 7 % more, <= 10 s" if optimizer == OPTIMIZERS[0] else "none",
            f"{was:.4f} -> {now:.4f}, {100.0 * (now / was - 1.0):.0f} % more; {seconds:.1f} s of cpu, "
            f"{len(front.evaluated)} robots",
        )


def posts() -> list[sl.FreeAnchors]:
    """Design variables: upper and lower anchors, vertically, equal at all posts."""
    return [
        sl.FreeAnchors("frame", -3.0, 0.0, along=[0, 0, 1], symmetry="together", cables=cables)
        for cables in ((0, 2, 4, 6), (1, 3, 5, 7))
    ]


def inside(edge: float) -> sl.PoseBox:
    """The article's frame without an edge [m]."""
    return sl.PoseBox([-7.5 + edge, -5.5 + edge, edge], [7.5 - edge, 5.5 - edge, 6.0 - edge])


PARTS = (searches,)

if __name__ == "__main__":
    print_table("Better robots", PARTS)
