"""Time of the compiled library divided by the time of numba, in one process: `python -m benchmarks.back_ends`."""

from __future__ import annotations

import os
import time

os.environ["SAGLINE_BACKEND"] = "numba"

from collections.abc import Callable, Iterator
from functools import partial
from typing import Any

from rich.console import Console

import sagline as sl
from benchmarks.measure import Row, one_core, show
from sagline.kernels.library import Library
from tests.translate.inputs import poses_of
from tests.translate.library import copied
from tests.translate.recorded import Call, recorded
from tools.translate.signatures import functions

POSES, ROUNDS = 400, 15


def jobs() -> Iterator[tuple[str, str, Callable[[], object]]]:
    """Name of each job, its entry, and a call of a public function that runs this entry."""
    for name in ("cogiro", "ipanema-3", "ipanema-3-pulleys"):
        robot = sl.load_robot(name)
        poses = poses_of(robot, POSES, 1)
        plan = sl.inverse(robot, poses)
        state = sl.forward(robot, plan.unstrained_length[int(plan.feasible.argmax())]).state
        lengths = plan.unstrained_length
        yield f"inverse of {name}", "inverse_poses", partial(sl.inverse, robot, poses)
        yield f"forward of {name}, without a start", "forward_poses", partial(sl.forward, robot, lengths)
        yield f"simulation of {name}", "run_massless", partial(sl.simulate, state, duration=0.5)
        yield f"margins of {name}", "signed_margins", partial(sl.margin, robot, poses[:40])


def longest(calls: list[Call], entry: str) -> Call:
    """Of all calls of an entry, the call with the largest number of values."""
    found = [each for each in calls if each.symbol.removesuffix("_pulleys") == f"sagline_{entry}"]
    return max(found, key=lambda each: sum(part.size for part in arrays(each.before)))


def arrays(value: Any) -> Iterator[Any]:
    """All arrays in nested tuples."""
    if isinstance(value, tuple):
        for each in value:
            yield from arrays(each)
    elif hasattr(value, "size"):
        yield value


def rows() -> Iterator[Row]:
    """One row for each job: library and numba are called alternately, and the shortest times count."""
    library = Library.load()
    for name, entry, job in jobs():
        with recorded() as calls:
            job()
        call, function = longest(calls, entry), functions()[entry]
        compiled = library.entry(function.__name__, function.__module__)
        assert compiled is not None
        by_numba = getattr(__import__(function.__module__, fromlist=[entry]), entry)
        best = {compiled: float("inf"), by_numba: float("inf")}
        for _ in range(ROUNDS):
            for each in best:
                arguments = copied(call.before)
                start = time.perf_counter()
                each(*arguments)
                best[each] = min(best[each], time.perf_counter() - start)
        c, numba = best.values()
        yield Row(f"{name}: C / numba", "<= 1.0", f"{c / numba:.2f} ({1e3 * c:.2f} and {1e3 * numba:.2f} ms)")


if __name__ == "__main__":
    one_core()
    console = Console()
    show("Back ends of the kernels", list(rows()), console)
