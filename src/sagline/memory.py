"""How much memory is free, asked before much of it is taken: a process that takes too much is killed without a word."""

from __future__ import annotations

import contextlib
import os
from pathlib import Path
from typing import Final

from sagline.errors import InvalidValueError

_ALWAYS: Final = 100e6  # bytes that need no question
_GROUPS: Final = (  # limit and use of a container
    ("/sys/fs/cgroup/memory.max", "/sys/fs/cgroup/memory.current"),
    ("/sys/fs/cgroup/memory/memory.limit_in_bytes", "/sys/fs/cgroup/memory/memory.usage_in_bytes"),
)


def check_memory(count: float, bytes_each: float, item: str, next_step: str) -> None:
    """Refuse work that would need more memory than there is.

    Args:
        count: How many.
        bytes_each: What each needs at the peak [bytes].
        item: What they are, for the message: "poses".
        next_step: What to do about it.

    Raises:
        InvalidValueError: If all together need more than is free; the message says how much.
    """
    needed = count * bytes_each
    if needed <= _ALWAYS or needed <= (free := free_memory()):
        return
    raise InvalidValueError(
        f"the number of {item}",
        f"{count:.6g}, which need {needed / 1e9:.3g} GB",
        f"what fits the {free / 1e9:.3g} GB of memory that are free",
        next_step,
    )


def check_poses(count: int, cable_count: int) -> None:
    """Refuse to solve for more poses than there is memory.

    Args:
        count: How many poses.
        cable_count: Number of cables m of the robot.

    Raises:
        InvalidValueError: If all together need more than is free; the message says how much.
    """
    check_memory(count, 400.0 + 64.0 * cable_count, "poses", "Take them in parts.")  # as measured, forward and inverse


def free_memory() -> float:
    """Memory that this process can still take [bytes]; infinite where the system does not tell."""
    free = [float("inf")]
    with contextlib.suppress(OSError, ValueError, AttributeError):  # AttributeError: Windows has no sysconf
        free.append(float(os.sysconf("SC_PHYS_PAGES")) * os.sysconf("SC_PAGE_SIZE"))
    with contextlib.suppress(OSError, ValueError, StopIteration):
        lines = Path("/proc/meminfo").read_text().splitlines()
        free.append(1024.0 * float(next(line for line in lines if line.startswith("MemAvailable")).split()[1]))
    for limit, used in _GROUPS:
        with contextlib.suppress(OSError, ValueError):  # ValueError: "max", no limit
            free.append(float(Path(limit).read_text()) - float(Path(used).read_text()))
    with contextlib.suppress(ImportError, OSError, ValueError):
        import resource

        limit_of_process = resource.getrlimit(resource.RLIMIT_AS)[0]
        if limit_of_process != resource.RLIM_INFINITY:
            taken = float(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
            free.append(limit_of_process - taken)
    return max(0.0, min(free))
