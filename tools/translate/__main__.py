"""`python -m tools.translate OUT.c`: write the C of all entries of `sagline.kernels`."""

from __future__ import annotations

import sys
from pathlib import Path

from tools.translate.program import translate
from tools.translate.signatures import entries
from tools.translate.types import TranslationError


def main(arguments: list[str]) -> int:
    """Write the file. Exit code 2, with one line on standard error, if this is not possible."""
    if len(arguments) != 1:
        print("usage: python -m tools.translate OUT.c", file=sys.stderr)
        return 2
    try:
        text = translate(entries())
    except TranslationError as error:
        print("\n".join((str(error), *getattr(error, "__notes__", ()))), file=sys.stderr)
        return 2
    out = Path(arguments[0])
    out.parent.mkdir(parents=True, exist_ok=True)
    out.write_text(text, encoding="utf-8")
    print(f"{out}: {text.count(chr(10))} lines")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
