"""Behavior agrees with the record, and the comparison finds differences."""

import pytest

from tests.record.compare import differences
from tests.record.parts import PARTS, recorded, stored
from tests.tiers import extended


@extended
@pytest.mark.parametrize("part", PARTS)
def test_behavior_is_as_recorded(part: str) -> None:
    found = list(differences(stored(part), recorded(part)))
    assert not found, f"{len(found)} differences; if they are meant: make record\n" + "\n".join(found[:40])


@pytest.mark.parametrize(
    ("old", "new", "places"),
    [
        ({"a": 1.0}, {"a": 1.0 + 1e-9}, []),
        ({"a": 1.0}, {"a": 1.0 + 1e-6}, ["/a"]),
        ({"residual": 1e-12}, {"residual": 3e-9}, []),
        ({"residual": 1e-12}, {"residual": 3e-3}, ["/residual"]),
        ({"a": [1, 2]}, {"a": [1, 2, 3]}, ["/a"]),
        ({"a": {"b": "x"}}, {"a": {"b": "y"}}, ["/a/b"]),
        ({"a": 1}, {"b": 1}, ["/a", "/b"]),
        ({"a": True}, {"a": False}, ["/a"]),
        ({"a": 1.0}, {"a": "nan"}, ["/a"]),
    ],
)
def test_a_difference_is_found_where_it_is(old: object, new: object, places: list[str]) -> None:
    assert [line.partition(":")[0] for line in differences(old, new)] == places
