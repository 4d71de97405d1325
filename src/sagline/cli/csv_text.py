"""Tables of numbers as CSV: with units in brackets, every number to the last bit."""

from __future__ import annotations

import csv
from collections.abc import Iterable, Sequence
from io import StringIO


def csv_text(rows: Iterable[Sequence[object]]) -> str:
    """The text of a CSV file.

    Args:
        rows: The names of the columns, with units in brackets; then floats of Python, which are written to the last
            bit, and words.
    """
    text = StringIO()
    csv.writer(text, lineterminator="\n").writerows(rows)
    return text.getvalue()
