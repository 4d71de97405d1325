"""`python -m tests.translate.replay LIBRARY CALLS`: repeat recorded calls in a separate process.

A library with AddressSanitizer requires its run-time library first: the tests start this program with LD_PRELOAD.
"""

from __future__ import annotations

import ctypes
import pickle
import sys
from pathlib import Path

from tests.translate.library import Entry, copied


def main(library_file: str, calls_file: str) -> None:
    """Repeat the calls; a sanitizer ends the process at the first error."""
    library = ctypes.CDLL(library_file)
    for symbol, types, result, arguments in pickle.loads(Path(calls_file).read_bytes()):
        assert Entry(library, symbol, types, result).code(*copied(arguments))[0] == 0, symbol


if __name__ == "__main__":
    main(*sys.argv[1:])
