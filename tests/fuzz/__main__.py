"""`python -m tests.fuzz MINUTES`: fuzz all readers; inputs with faults are kept in a folder."""

from __future__ import annotations

import argparse
import sys
import time
from pathlib import Path

from tests.fuzz.run import fuzz


def main() -> int:
    """Fuzz, and print numbers of executions and faults; exit code 1 if there are faults."""
    parser = argparse.ArgumentParser(prog="python -m tests.fuzz")
    parser.add_argument("minutes", type=float)
    parser.add_argument("--seed", type=int, default=int(time.time()) % 1_000_000 * 1000)
    parser.add_argument("--only", default="", help="readers whose file name contains this")
    parser.add_argument("--out", type=Path, default=Path("build/fuzz"))
    given = parser.parse_args()
    found = fuzz(given.minutes, given.seed, given.out, given.only)
    for name, count in sorted(found.executions.items()):
        print(f"{name:24} {count:9,}")
    print(f"{found.executions.total():,} executions, {found.read:,} of them read, {len(found.faults)} faults")
    print("\n".join(found.faults))
    return 1 if found.faults else 0


if __name__ == "__main__":
    sys.exit(main())
