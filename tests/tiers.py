"""The two tiers of the tests: `make test` runs the first, `make test-all` both.

A test belongs to the first tier unless it is marked where it stands: `@extended` above a function or a class,
`pytestmark = extended` at the top of a file, or `wide(...)` around the values of a parameter, of which the first few
stay in the first tier.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, Final

import pytest

extended: Final = pytest.mark.extended
TEST_LIMIT: Final = 2.0  # s of processor time of a test of the first tier, kernels compiled
FILE_LIMIT: Final = 10.0  # s, of all tests of a file


def wide(values: Iterable[Any], first: int = 1) -> list[Any]:
    """Values for `pytest.mark.parametrize`: the first few in the first tier, the others in the second.

    Args:
        values: The values, or tuples of them.
        first: Number of values in the first tier.
    """
    return [value if k < first else _second_tier(value) for k, value in enumerate(values)]


def _second_tier(value: Any) -> Any:
    if isinstance(value, type(pytest.param())):
        return pytest.param(*value.values, marks=[*value.marks, extended], id=value.id)
    return pytest.param(*(value if type(value) is tuple else (value,)), marks=extended)
