"""Short tours compared with all permutations."""

from itertools import permutations

import numpy as np
import pytest

from sagline.calibration.candidates import shortest_tour, tour_length
from tests.tiers import wide


@pytest.mark.parametrize("seed", wide(range(12), first=2))
def test_tours_are_as_short_as_the_best_permutation(seed: int) -> None:
    places = np.random.default_rng(seed).uniform(size=(7, 3))
    best = min(tour_length(places, np.array(order)) for order in permutations(range(7)))
    found = shortest_tour(places)
    assert sorted(found) == list(range(7))
    assert best - 1e-12 <= tour_length(places, found) <= 1.1 * best


def test_places_on_a_line_are_visited_in_order() -> None:
    places = np.zeros((30, 3))
    places[:, 1] = np.random.default_rng(1).permutation(30)
    assert tour_length(places, shortest_tour(places)) == pytest.approx(29.0)


def test_tours_of_many_places_are_near_the_best_length() -> None:
    places = np.random.default_rng(2).uniform(size=(300, 2))
    # 0.7124 sqrt(N A) is the best tour of many places; 2-opt is about 5 % longer, nearest neighbors 25 %
    assert tour_length(places, shortest_tour(places)) <= 1.12 * 0.7124 * np.sqrt(300.0)


@pytest.mark.parametrize("count", [1, 2, 3])
def test_few_places(count: int) -> None:
    assert sorted(shortest_tour(np.eye(3)[:count])) == list(range(count))


def test_places_that_coincide() -> None:
    assert sorted(shortest_tour(np.ones((5, 3)))) == list(range(5))
