"""Where a robot can work: hulls, volumes and their error bars; one core."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

import sagline as sl
from benchmarks.measure import Row, best_seconds, print_table
from sagline.workspaces.boundary import boundary
from sagline.workspaces.rays import ray_hull
from tests.workspaces.levels import ipanema, level_of

CENTER = (0.0, 0.0, 1.0)
MODELS = (sl.Straight(), sl.Catenary())
FRAME = (-7.5, -5.5, 0.0), (7.5, 5.5, 6.0)
SETTINGS = ((24, 0.5), (64, 2.0))  # cells, and seconds they may take


def hulls() -> Iterator[Row]:
    """4,098 rays of ipanema-1, 1 to 10 N, no gravity: what WireX calls its workspace (9.734 m3 in 0.13 s)."""
    robot, low, high = ipanema()
    for model, reach in zip(MODELS, (0.13, 0.2), strict=True):
        level = level_of(robot, model)
        hull = ray_hull(level, CENTER, low, high)
        seconds = best_seconds(lambda level=level: ray_hull(level, CENTER, low, high))  # type: ignore[misc]
        yield Row(
            f"hull of ipanema-1 by 4,098 rays, {type(model).__name__}",
            f"9.7452 m3, <= {reach} s",
            f"{hull.volume:.4f} m3, {seconds:.3f} s",
        )


def volumes() -> Iterator[Row]:
    """The true volume of that hull."""
    robot, low, high = ipanema()
    level = level_of(robot, sl.Straight())
    for cells, reach in SETTINGS:
        found = boundary(level, low, high, cells=cells)
        seconds = best_seconds(lambda cells=cells: boundary(level, low, high, cells=cells), 3)  # type: ignore[misc]
        worst = np.abs(level(found.surface.vertices)).max()
        yield Row(
            f"its true volume, {cells} cells halved",
            f"9.774 +- 0.002 m3, <= {reach:g} s",
            f"{found.volume:.4f} +- {found.volume_error:.4f} m3, {seconds:.2f} s, {found.evaluations:,} margins; "
            f"{worst:.0e} N at vertices",
        )


def frames() -> Iterator[Row]:
    """The article's suspended robot in its frame, with sag and without."""
    robot = sl.load_robot("article-suspended")
    for model, reach in zip(MODELS, ("782.7", "789.4"), strict=True):
        level = level_of(robot, model)
        found = boundary(level, *FRAME, cells=32)
        seconds = best_seconds(lambda level=level: boundary(level, *FRAME, cells=32), 3)  # type: ignore[misc]
        yield Row(
            f"article-suspended in its frame, {type(model).__name__}",
            f"{reach} +- 1 m3",
            f"{found.volume:.2f} +- {found.volume_error:.2f} m3, {seconds:.2f} s",
        )


PARTS = (hulls, volumes, frames)

if __name__ == "__main__":
    print_table("Where a robot can work", PARTS)
