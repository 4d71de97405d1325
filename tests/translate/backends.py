"""`python -m tests.translate.backends`: compare all back ends on the table of inputs, and print a Markdown table."""

from __future__ import annotations

import tempfile
from collections import defaultdict
from pathlib import Path

from sagline.kernels.jit import BACKENDS
from tests.translate.inputs import TABLE
from tests.translate.library import compiled_c
from tests.translate.recorded import Difference, Run, compare, from_kernels, from_library
from tools.translate.program import translate
from tools.translate.signatures import entries


def all_backends(folder: Path) -> dict[str, Run]:
    """Each back end by name; "translated" is newly translated and compiled C in a folder."""
    library = compiled_c(translate(entries()), folder)
    return {"translated": from_library(library)} | {name: from_kernels(name) for name in BACKENDS}


def main() -> None:
    """Print a row for each entry and set of argument types: number of outputs and differences of back ends."""
    found: dict[str, Difference] = defaultdict(Difference)
    with tempfile.TemporaryDirectory() as folder:
        backends = all_backends(Path(folder))
        for inputs in TABLE.values():
            for (_, symbol), one in compare(inputs, backends).items():
                found[symbol] = found[symbol].joined(one)
    print("| entry | calls | numbers | largest difference |\n|---|---|---|---|")
    for symbol, total in sorted(found.items()):
        calls, numbers = total.calls // len(backends), total.compared // len(backends)
        print(f"| `{symbol.removeprefix('sagline_')}` | {calls:,} | {numbers:,} | {total.largest:.1g} |")


if __name__ == "__main__":
    main()
