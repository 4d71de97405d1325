"""`make record`: write the record of behavior again, all parts or those named."""

from __future__ import annotations

import sys

from tests.record.parts import PARTS, recorded, write

if __name__ == "__main__":
    for name in sys.argv[1:] or PARTS:
        print(f"recording {name} ...", flush=True)
        write(name, recorded(name))
