"""Checks of free memory before large allocations. The system kills a process that uses too much memory."""

from __future__ import annotations

import contextlib
import os
from pathlib import Path
from typing import Final

from sagline.core.errors import InvalidValueError

UNASKED: Final = 1 << 26  # [bytes], smaller allocations are not checked
_POSE_BYTES, _CABLE_BYTES = 400.0, 64.0  # [bytes], measured memory per pose, and per cable and pose
_BEHIND_BYTES = 72.0  # [bytes], measured memory per cable and pose for the routing
_GROUPS: Final = (  # files that contain the memory limit and the used memory of a container
    ("/sys/fs/cgroup/memory.max", "/sys/fs/cgroup/memory.current"),
    ("/sys/fs/cgroup/memory/memory.limit_in_bytes", "/sys/fs/cgroup/memory/memory.usage_in_bytes"),
)


def check_memory(item: str, size: float, next_step: str) -> None:
    """Refuse an allocation of more than 64 MB that does not fit into memory; size [bytes]; item: its purpose."""
    if size > UNASKED and size > (free := free_memory()):
        # the message needs so many digits that the two numbers differ
        digits = next((k for k in range(3, 17) if f"{size:.{k}g}" != f"{free:.{k}g}"), 17)
        wanted, left = f"{size / 1e9:.{digits}g} GB", f"<= {free / 1e9:.{digits}g} GB, which are free"
        raise InvalidValueError(f"the memory for {item}", wanted, left, next_step)


def check_poses(count: int, cable_count: int, behind: bool) -> None:
    """Refuse kinematics of `count` poses that need too much memory; behind: True with pulleys or dead lengths."""
    cable = _CABLE_BYTES + (_BEHIND_BYTES if behind else 0.0)
    size = count * (_POSE_BYTES + cable * cable_count)
    check_memory(f"a batch of {count:,} poses", size, "Solve the batch in parts.")


def free_memory() -> float:
    """Free memory that computer, container and process limits allow [bytes]; infinite if the system reports none."""
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
