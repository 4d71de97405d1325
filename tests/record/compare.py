"""Comparison of two records, with a tolerance for each quantity."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from typing import Any, Final, NamedTuple


class Tolerance(NamedTuple):
    """Allowed difference of numbers whose place in the record matches a pattern.

    Attributes:
        pattern: Regular expression that is searched in the place, keys joined by slashes.
        relative: Share of the larger of both numbers.
        absolute: Additional allowed difference, in the unit of the quantity.
    """

    pattern: str
    relative: float
    absolute: float


# The first pattern that matches counts. Residuals and errors at rounding level are compared with zero, in their unit.
TOLERANCES: Final = (
    Tolerance(r"error.*_mm|_mm\b.*error", 1e-6, 1e-5),  # mm; the exact model's errors are 1e-9 mm
    Tolerance(r"residual|wrench_error|balance_error", 1e-3, 1e-6),  # N and N m
    Tolerance(r"error|gap|shortfall", 1e-6, 1e-8),  # m, rad, N
    Tolerance(r"design|front|candidates", 1e-5, 1e-8),  # a search adds rounding from candidate to candidate
    Tolerance(r"calibrat|found|deviation|covariance|chi", 1e-5, 1e-9),  # least squares
    Tolerance(r"volume|area|workspace", 1e-6, 1e-8),  # m³, m²
    Tolerance(r"", 1e-7, 1e-10),
)


def differences(old: Any, new: Any, place: str = "") -> Iterator[str]:
    """Differences of two records, one line each."""
    if isinstance(old, dict) and isinstance(new, dict):
        for key in [*old, *(key for key in new if key not in old)]:
            here = f"{place}/{key}"
            if key not in old or key not in new:
                yield f"{here}: {'new' if key not in old else 'missing'}"
            else:
                yield from differences(old[key], new[key], here)
    elif isinstance(old, list) and isinstance(new, list):
        if len(old) != len(new):
            yield f"{place}: {len(old)} entries before, {len(new)} now"
        for k, (before, now) in enumerate(zip(old, new, strict=False)):
            yield from differences(before, now, f"{place}/{k}")
    elif _is_number(old) and _is_number(new):
        tolerance = next(each for each in TOLERANCES if re.search(each.pattern, place))
        if not math.isclose(old, new, rel_tol=tolerance.relative, abs_tol=tolerance.absolute):
            yield f"{place}: {old!r} before, {new!r} now"
    elif old != new:
        yield f"{place}: {old!r} before, {new!r} now"


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)
