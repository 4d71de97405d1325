"""Expected errors, described by their parts: item, value, allowed values and next step."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

import sagline as sl


@contextmanager
def refused(
    item: str | None = None,
    value: str | None = None,
    allowed: str | None = None,
    next_step: str | None = None,
    *,
    kind: type[Exception] = sl.SaglineError,
    file: Path | str | None = None,
) -> Iterator[pytest.ExceptionInfo[Any]]:
    """Expect an error with the given parts.

    Args:
        item: Item that the error names.
        value: Its value, as text with its unit.
        allowed: Allowed values.
        next_step: Proposed action.
        kind: Type of the error.
        file: Path of the file that the error names.

    Examples:
        >>> with refused("mass", "-1 kg", "> 0 kg", kind=sl.InvalidValueError):
        ...     sl.load_robot("cogiro").replace(mass=-1.0)
    """
    with pytest.raises(kind) as caught:
        yield caught
    error: Any = caught.value
    if file is not None:
        assert error.path == Path(file)
    expected = {"item": item, "value": value, "allowed": allowed, "next_step": next_step}
    given = {part: text for part, text in expected.items() if text is not None}
    assert {part: str(getattr(error, part, None)) for part in given} == given
