"""The article's experiment on a twin in one process; one core."""

from __future__ import annotations

from collections.abc import Iterator
from time import perf_counter

from rich.console import Console

from benchmarks.measure import Row, one_core, show
from sagline.article.experiment import in_process


def experiment() -> Iterator[Row]:
    """The experiment at ten points, which takes fourteen minutes of the machine's time."""
    begun = perf_counter()
    found = in_process()
    took = perf_counter() - begun
    speed = f"{took:.0f} s, {found.duration / took:.0f} x"
    yield Row(f"the experiment, {found.duration / 60:.1f} minutes of a machine", "<= 30 s", speed)
    error = f"{1e3 * found.distance.mean():.3f} mm in the mean, {1e3 * found.distance.max():.3f} mm at most"
    yield Row("pose error at the ten stops; cells with 1 N noise and 2 N bias, 15 N stiction", "<= 0.05 mm", error)


PARTS = (experiment,)

if __name__ == "__main__":
    one_core()
    show("The experiment of ten points", [row for part in PARTS for row in part()], Console())
