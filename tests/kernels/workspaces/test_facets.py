"""Subsets for the enumeration of facets."""

from itertools import combinations
from math import comb

from sagline.kernels.workspaces.facets import MEMBERS, MOST_FREE, ORDER, START


def test_subsets_of_every_size_are_complete() -> None:
    for n in range(1, MOST_FREE + 1):
        for k in range(n + 1):
            bits = ORDER[n, START[n, k] : START[n, k + 1]]
            assert len(bits) == comb(n, k)
            assert [tuple(MEMBERS[one, :k]) for one in bits] == list(combinations(range(n), k))
