"""Planes through a space, and values of a function of positions on them."""

from __future__ import annotations

import numpy as np
import pytest

from sagline.core.arrays import Array
from sagline.workspaces.levels import Details, Plane, slice_of


def places(positions: Array) -> Details:
    """Numbers that identify a position."""
    x, y, z = positions.T
    indices = (np.rint(y).astype(np.int64), np.rint(z).astype(np.int64), np.zeros(len(x), dtype=np.int64))
    return Details(x + 10.0 * y + 100.0 * z, x, *indices, np.zeros(len(x)))


@pytest.mark.parametrize("normal", [0, 1, 2])
def test_points_of_a_slice_are_at_their_columns_and_rows(normal: int) -> None:
    low, high = np.array([-1.0, -2.0, 0.0]), np.array([3.0, 2.0, 5.0])
    cut = slice_of(places, Plane(normal, 1.25), low, high, (5, 7))
    first, second = (axis for axis in range(3) if axis != normal)
    assert (cut.across[0], cut.across[-1]) == (low[first], high[first])
    assert (cut.up[0], cut.up[-1]) == (low[second], high[second])
    for row in range(7):
        for column in range(5):
            place = np.full(3, 1.25)
            place[first], place[second] = cut.across[column], cut.up[row]
            own = places(place[None])
            assert cut.level[row, column] == own.level[0]
            assert cut.margin[row, column] == own.margin[0]
            assert (cut.criterion[row, column], cut.cable[row, column]) == (own.criterion[0], own.cable[0])


def test_a_plane_is_written_as_an_equation() -> None:
    assert str(Plane(2, 1.5)) == "z = 1.5 m"
