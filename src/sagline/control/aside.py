"""Work that takes longer than a cycle, beside the cycles."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from typing import TypeVar

T = TypeVar("T")


def aside(work: Callable[[], T], threaded: bool) -> Future[T]:
    """Begin it in a thread of its own; on a lockstep clock, where nobody waits, do it at once.

    Args:
        work: Reads nothing that cycles change.
        threaded: Whether time goes on beside it.

    Returns:
        What becomes of it; done already without a thread.
    """
    if threaded:
        pool = ThreadPoolExecutor(1, "sagline planning")
        begun = pool.submit(work)
        pool.shutdown(wait=False)
        return begun
    done: Future[T] = Future()
    try:
        done.set_result(work())
    except Exception as error:
        done.set_exception(error)
    return done
