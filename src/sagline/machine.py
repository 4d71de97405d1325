"""What the machine has: a request that does not fit into its memory is refused before it is begun."""

from __future__ import annotations

import math
import os
from pathlib import Path
from typing import Final

from sagline.errors import InvalidValueError

UNASKED: Final = 1 << 26  # bytes: a request below that is not worth asking the machine how much it has


def check_memory(item: str, size: float, next_step: str) -> None:
    """Refuse what would not fit into memory, before it is begun.

    Args:
        item: What asks for it, for the message.
        size: Bytes that it needs; less than 64 MB are not asked about.
        next_step: How to need less.

    Raises:
        InvalidValueError: If the machine has not as much left; the message gives both numbers.
    """
    if size > UNASKED and size > (free := free_memory()):
        wanted, left = f"a request for {size:,.0f} bytes of memory", f"<= {free:,.0f} bytes, which are free"
        raise InvalidValueError(item, wanted, left, next_step)


def free_memory() -> float:
    """Bytes of memory that this process can still have; infinite where the system does not tell.

    Returns:
        The least of what the machine has free and what its container is allowed.
    """
    free = [math.inf]
    try:
        fields = dict(line.split(":") for line in Path("/proc/meminfo").read_text(encoding="ascii").splitlines())
        free.append(1024.0 * int(fields["MemAvailable"].split()[0]))
    except (OSError, KeyError, ValueError):  # no Linux: all the machine has
        if hasattr(os, "sysconf") and "SC_PHYS_PAGES" in os.sysconf_names:
            free.append(float(os.sysconf("SC_PHYS_PAGES")) * os.sysconf("SC_PAGE_SIZE"))
    try:
        group = Path("/sys/fs/cgroup")
        used, most = (float((group / name).read_text()) for name in ("memory.current", "memory.max"))
        free.append(most - used)
    except (OSError, ValueError):  # no container, or one without a limit
        pass
    return min(free)
